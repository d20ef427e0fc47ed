"""`RunData`: the data of a run, from which its tables, figures and files are made."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.extremes import Extremes
from msfp_gen.results.files import ResultFiles
from msfp_gen.results.history import Counters, Event, History

if TYPE_CHECKING:
    from msfp_gen.results.gradient import Gradients
    from msfp_gen.results.note import Note
    from msfp_gen.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class RunData(ResultFiles):
    """Scene, rows, events and provenance of a run. `msfp_gen.Result` adds dataset and summary.

    status: "ok", "stopped" (the stop condition of the scene was met) or the name of a failure; message: one line of
    text, "" for a run that succeeded. counters: the work of the solver. provenance: versions, model keys and solver
    options with which the result was computed. notes: messages of the monitors, in order of time (docs/effects.md).
    recorded_extremes: of all accepted steps; None where only the rows are known. gradients: derivatives with respect to
    parameters; None: not computed.
    """

    source: ClassVar[str] = "msfp-gen"
    scene: Scene
    history: History
    events: tuple[Event, ...] = ()
    counters: Counters = field(default_factory=Counters)
    status: str = "ok"
    message: str = ""
    provenance: dict[str, str] = field(default_factory=dict)
    notes: tuple[Note, ...] = ()
    recorded_extremes: Extremes | None = None
    gradients: Gradients | None = None

    @cached_property
    def extremes(self) -> Extremes:
        """Extremes over all accepted steps and rows."""
        rows = Extremes.of_rows(self.history)
        return rows if self.recorded_extremes is None else rows | self.recorded_extremes

    @property
    def friction_coefficient(self) -> Array:
        """Friction coefficient mu of every surface, ndarray, shape (T, n-1): recorded, or that of the bearing."""
        recorded = self.history.friction_coefficient
        if recorded is not None:
            return recorded
        return np.broadcast_to(self.scene.bearing.arrays()["friction"], self.history.normal_force.shape)
