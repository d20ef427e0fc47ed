"""What the segments of a run that have ended state: the message of a failure, the extremes of all, versions."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.results.extremes import Extremes
from msfp_gen.results.note import monitor_notes
from msfp_gen.scene.effect_switching import JAM_STATUSES
from msfp_gen.scene.standing import MARGIN, standing_of
from msfp_gen.scene.top import MassTop, RigTop
from msfp_gen.specification.contract import STATUSES
from msfp_gen.version import __version__

if TYPE_CHECKING:
    from msfp_gen.model.compiled import Run
    from msfp_gen.model.model import Model
    from msfp_gen.scene.scene import Scene
    from msfp_gen.scene.solver import Solver
    from msfp_gen.simulation.segment import Segment


def message_of(scene: Scene, segment: Segment) -> str:
    """Message about a segment that failed, in one line; after a monitor stopped the run, the texts of its notes."""
    stopped = segment.status == "guard"
    cause = "; ".join(note.text for note in monitor_notes(segment.ending, None)) if stopped else None
    return message(scene, segment.model, segment.run, segment.status, cause)


def extremes_of(segments: Sequence[Segment]) -> Extremes | None:
    """Extremes of all segments in the frame of the user; None where none of them could start.

    Of segments that took no step only the last counts, where no other did: see `Joint`.
    """
    started = [s for s in segments if s.run.row_count]
    counted = [s for s in started if s.run.counts["steps"]] or started[-1:]
    found = [Extremes.of_run(s.model.extension.EXTREMES, s.run.extremes, s.azimuth) for s in counted]
    return reduce(or_, found) if found else None


def provenance_of(solver: Solver, models: str) -> dict[str, str]:
    """Versions, names of the models, and options of the solver with which a run was computed."""
    return {
        "msfp_gen": __version__,
        "model": models,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "method": solver.method,
        "rtol": f"{solver.rtol:g}",
    }


_STATUSES = {status.name: status for status in STATUSES}
MASSLESS = (  # docs/model.md, choice 10
    "; the sliders are massless: where forces depend on rates, only inertia determines how the surfaces share the "
    "motion; give effects.sliders = 'inertial'"
)
PULLED = (
    "; the springs of the rig are anchored above the base and pull the displaced top at once: lower top.stiffness, or "
    "leave out initial_state"
)
AT_ONCE = 1e-3  # [s]; a failure before is one of the initial state
OVERTURNED = 0.1  # tilt of the top plate above which the stack is considered to overturn [rad]


def message(scene: Scene, model: Model, run: Run, status: str, cause: str | None = None) -> str:
    """One line with time, surface, cause, remedy and last state. cause: None for the meaning of the status."""
    text = stopped(run.time, scene.end, status, *run.status[1:], cause)
    text += _state(scene, model, run) if _STATUSES[status].motion and run.row_count else ""
    text += PULLED if _pulled(scene, run) else ""
    return text + (MASSLESS if _inertia_missing(scene, model, status) else "")


def stopped(time: float, end: float, status: str, surface: int, value: float, cause: str | None = None) -> str:
    """Time reached and end of a run [s], surface (0: none), value and cause; None: the meaning of the status."""
    known = _STATUSES[status]
    where = f", surface {surface}" if surface else ""
    where += f", {known.quantity} = {value:.4g}" if surface and known.quantity else ""
    return f"stopped at t = {time:.6g} s of {end:.6g} s{where}: {cause or known.failure}"


def _pulled(scene: Scene, run: Run) -> bool:
    """Whether a run failed at once from a displaced state under a rig, whose springs are anchored above the base."""
    state, top = scene.initial_state, scene.top
    anchored = isinstance(top, RigTop) and top.stiffness > 0
    return anchored and run.time < AT_ONCE and state is not None and bool(np.any(state.q))


def _inertia_missing(scene: Scene, model: Model, status: str) -> bool:
    """Whether a run ended because massless sliders had no unique motion, as far as its end tells."""
    massless, carried = model.effects.sliders == "massless", isinstance(scene.top, MassTop)
    return massless and (status in JAM_STATUSES or (carried and status == "uplift"))


def _state(scene: Scene, model: Model, run: Run) -> str:
    """Summary of the last row, with a remedy where the top plate has overturned."""
    row = model.unpack(run.rows[-1])
    angles = row["q"][:, :2]
    tilt, top = float(np.abs(angles).max()), float(np.abs(angles.sum(axis=0)).max())
    low, high = float(row["normal"].min()), float(row["normal"].max())
    text = (
        f" (last state: tilts up to {tilt:.3g} rad, N {low:.3g} to {high:.3g} N, rims up to {row['rim'].max():.3g} N)"
    )
    standing = standing_of(scene)
    if top > OVERTURNED and standing and standing[1] < MARGIN * standing[2]:
        text += f"; the top plate has tilted by {top:.2g} rad: give it a rotational_stiffness of several times "
        text += f"{standing[2]:.4g} N m/rad, with which it stands at rest"
    return text
