"""What the segments of a run that have ended state: the message of a failure, the extremes of all, versions."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.results.extremes import Extremes
from msfp_gen.results.monitor_notes import monitor_notes
from msfp_gen.simulation import failures
from msfp_gen.version import __version__

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene
    from msfp_gen.simulation.segment import Segment


def message_of(scene: Scene, segment: Segment) -> str:
    """Message about a segment that failed, in one line; after a monitor stopped the run, the texts of its notes."""
    stopped = segment.status == "guard"
    cause = "; ".join(note.text for note in monitor_notes(segment.ending, None)) if stopped else None
    return failures.message(scene, segment.model, segment.run, segment.status, cause)


def extremes_of(segments: Sequence[Segment]) -> Extremes | None:
    """Extremes of all segments in the frame of the user; None where none of them could start.

    Of segments that took no step only the last counts, where no other did: see `Joint`.
    """
    started = [s for s in segments if s.run.row_count]
    counted = [s for s in started if s.run.counts["steps"]] or started[-1:]
    found = [Extremes.of_run(s.model.extension.EXTREMES, s.run.extremes, s.azimuth) for s in counted]
    return reduce(or_, found) if found else None


def provenance_of(scene: Scene, segments: Sequence[Segment]) -> dict[str, str]:
    """Versions, models and options of the solver with which the segments were computed."""
    return {
        "msfp_gen": __version__,
        "model": ", then ".join(segment.model.spec.key for segment in segments),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "method": scene.solver.method,
        "rtol": f"{scene.solver.rtol:g}",
        "build_seconds": f"{sum(segment.setup for segment in segments):.3g}",
    }
