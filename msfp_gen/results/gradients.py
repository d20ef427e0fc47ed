"""`Gradients`: the derivatives of a run and of its extremes by parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.history import ENERGY, LEAST, SERIES, Extremes, History, series
from msfp_gen.scene.parameters import Parameter

ENERGIES = ("kinetic", "potential", "restraint", "rim_stored", "seat_stored")  # of the state; the others are integrals
ERROR = "_error"  # ends the name of the variable with the error of a derivative
EVENTS = ("event_time", "event_displacement", "event_top_force")  # fields


def energy_terms(integrals: bool, uplift: bool) -> tuple[str, ...]:
    """The terms of the energy that are differentiated.

    integrals: also terms that are integrals over the run. uplift: also terms of unilateral contacts.
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
        extremes: k of them, of `Result.extremes`.
        error: errors of all of these, measured where a rim was met (`simulation.gradients`); None: not measured.
    """

    parameters: tuple[Parameter, ...]
    arrays: dict[str, Array]
    extremes: tuple[Extremes, ...]
    error: Gradients | None = None


def gradients_of_extremes(gradients: Gradients, history: History, recorded: Extremes) -> dict[str, Array]:
    """Derivatives of `Result.extremes` by name, each of shape (k, number of values) [SI]."""
    derivatives = {}
    for name in gradients.extremes[0].arrays:
        values = getattr(recorded, name)
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
    """Derivatives of the values from which an extreme is taken, `series`, shape (k, T, m) [SI]."""
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
