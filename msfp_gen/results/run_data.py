"""`BearingData`: the data of the run of one bearing, alone or below a building; `RunData`: of a bearing alone.

Summaries, tables, figures and files are made from them. `Gradients`: the derivatives of a run by parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.files import ResultFiles
from msfp_gen.results.history import (
    ENERGY,
    LEAST,
    SERIES,
    BearingRows,
    Counters,
    Event,
    Extremes,
    History,
    series,
)
from msfp_gen.results.note import Note
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.parameters import Parameter
from msfp_gen.scene.scene import Scene
from msfp_gen.specification.layout import Effects

ENERGIES = ("kinetic", "potential", "restraint", "rim_stored", "seat_stored")  # of the state; the others are integrals
ERROR = "_error"  # ends the name of the variable with the error of a derivative
EVENTS = ("event_time", "event_displacement", "event_top_force")  # fields


def energy_terms(integrals: bool, uplift: bool) -> tuple[str, ...]:
    """The terms of the energy that are differentiated.

    integrals: also those that are integrals over the run. uplift: also those of unilateral contacts.
    """
    return tuple(
        name for name in ENERGY if (integrals or name in ENERGIES) and (uplift or not name.startswith("seat_"))
    )


@dataclass(frozen=True, eq=False)
class Gradients:
    """Derivatives of a run with respect to k parameters.

    Attributes:
        parameters: k of them.
        arrays: derivatives by field: of `History`, shape (k, T, ...), [unit of the field/unit]; of energies
            `energy_...`, of those that the state determines, or also of the integrals, shape (k, T); of `EVENTS`,
            shape (k, e), (k, e, 3), (k, e, 3).
        extremes: k of them, of `RunData.extremes`.
        error: errors of all of these, measured where a rim was met (`simulation.gradients`); None: not measured.
    """

    parameters: tuple[Parameter, ...]
    arrays: dict[str, Array]
    extremes: tuple[Extremes, ...]
    error: Gradients | None = None


def gradients_of_extremes(gradients: Gradients, history: History, recorded: Extremes) -> dict[str, Array]:
    """Derivatives of `RunData.extremes` by name, each of shape (k, number of values) [SI]."""
    derivatives = {}
    for name in (f.name for f in fields(Extremes) if f.name in SERIES):
        values = getattr(recorded, name)
        if values is None:
            continue
        steps = np.array([getattr(extremes, name) for extremes in gradients.extremes])
        values_of_rows, slopes = series(name, history), _slopes(name, gradients, history)
        assert values_of_rows is not None
        sign = -1.0 if name in LEAST else 1.0
        row = (sign * values_of_rows).argmax(axis=0)
        columns = np.arange(values_of_rows.shape[1])
        beyond = sign * (values_of_rows[row, columns] - values) > 0
        derivatives[name] = np.where(beyond, slopes[:, row, columns], steps)
    return derivatives


def _slopes(name: str, gradients: Gradients, history: History) -> Array:
    """Derivatives of the values of which an extreme is taken, `series`, shape (k, T, m) [SI]."""
    field, kind = SERIES[name]
    values, slopes = getattr(history, field), gradients.arrays[field]
    if not kind:
        return slopes
    size = np.hypot(values[..., 0], values[..., 1])
    safe = np.where(size > 0, size, 1.0)
    length: Array = (values[..., 0] * slopes[..., 0] + values[..., 1] * slopes[..., 1]) / safe
    if kind == "length":
        return length
    return np.concatenate([np.sign(values) * slopes, length[..., None]], axis=-1)


class BearingData(ResultFiles):
    """Data of the run of any bearing, alone or below a building."""

    @property
    def number(self) -> int:
        """Number of the bearing below a building, from 1; 0: the bearing is alone."""
        return 0

    @property
    def label(self) -> str:
        """Name of the bearing in messages below a building; "" for a bearing alone."""
        return ""

    @property
    def one_pendulum(self) -> bool:
        """Whether its surfaces are those of one pendulum in place of the stack (docs/fidelity.md)."""
        return bool(self.scene.fidelity == "equivalent")

    if TYPE_CHECKING:  # fields of the subclasses, or properties

        @property
        def bearing(self) -> Bearing:
            """The bearing that was run."""

        @property
        def effects(self) -> Effects:
            """Effects of the model at the start."""

        @property
        def axial_load(self) -> float | None:
            """Compression at rest [N]; None: it varies, or there is none."""

        @property
        def history(self) -> BearingRows:
            """Rows of the run."""

        @property
        def events(self) -> tuple[Event, ...]:
            """Events in order of time; none below a building, which does not record them."""

        @property
        def extremes(self) -> Extremes:
            """Extremes over all steps."""


# (word of an extreme, field of the history) -> field of `Extremes`, the same over all steps of a run.
OVER_STEPS = {
    ("peak", "displacement"): "displacement",
    ("peak", "top_force"): "top_force",
    ("peak", "sliding"): "sliding",
    ("most", "sliding"): "sliding",
    ("least", "gap"): "gap",
    ("least", "normal_force"): "least_normal",
    ("most", "normal_force"): "most_normal",
    ("least", "friction_coefficient"): "least_friction",
    ("most", "friction_coefficient"): "most_friction",
    ("most", "temperature"): "temperature",
}


@dataclass(frozen=True, eq=False)
class RunData(BearingData):
    """The fields of `msfp_gen.Result`, which adds dataset and summary.

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

    @property
    def time(self) -> Array:
        """Times of the rows, ndarray, shape (T,), [s]."""
        return self.history.time

    @property
    def bearing(self) -> Bearing:
        """The bearing of the scene."""
        return self.scene.bearing

    @property
    def effects(self) -> Effects:
        """The effects at the start."""
        return self.scene.modelled

    @property
    def axial_load(self) -> float | None:
        """The constant axial load on the top plate [N]; None if there is none, or it varies."""
        scene = self.scene
        loads: dict[str, Callable[[Any], float]] = {
            "rig": lambda top: top.axial_load,
            "prescribed": lambda top: -top.force[2],
            "mass": lambda top: top.mass * scene.bearing.gravity,
        }
        load = loads[scene.top.kind](scene.top)
        if scene.load is not None:
            vertical = scene.load.coefficients[:, 2]
            if np.any(vertical[:, 1:]) or np.any(vertical[:, 0] != vertical[0, 0]):
                return None
            load -= float(vertical[0, 0])
        return load if load > 0 else None

    @cached_property
    def extremes(self) -> Extremes:
        """Extremes over all accepted steps and rows."""
        rows = Extremes.of_rows(self.history)
        return rows if self.recorded_extremes is None else rows | self.recorded_extremes

    def over_steps(self, word: str, field: str) -> Array | None:
        """An extreme of a field of the history over all steps, ndarray, shape (m,), [SI]; None: it is not recorded.

        word: "peak", "least" or "most". m: the columns of the field.
        """
        name = OVER_STEPS.get((word, field))
        return None if name is None else getattr(self.extremes, name)

    @property
    def friction_coefficient(self) -> Array:
        """Friction coefficient mu of every surface, ndarray, shape (T, n-1), [-]: recorded, or that of the bearing."""
        recorded = self.history.friction_coefficient
        if recorded is not None:
            return recorded
        return np.broadcast_to(self.scene.bearing.arrays()["friction"], self.history.normal_force.shape)
