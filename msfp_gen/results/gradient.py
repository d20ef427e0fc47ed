"""Derivatives of a run with respect to parameters of its scene: of rows, events and extremes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.model.plane import out_of_plane
from msfp_gen.results.extremes import Extremes
from msfp_gen.results.history import ENERGY
from msfp_gen.results.row_unpacking import unpacked

if TYPE_CHECKING:
    from msfp_gen.model.compiled import Run
    from msfp_gen.model.model import Model
    from msfp_gen.scene.parameters import Parameter

CONSTANT = ("time", "lift", "separation", "temperature", "energy")  # fields of `History` that are treated apart
ENERGIES = ("kinetic", "potential", "restraint", "rim_stored")  # terms of the state; the others are integrals
WITH_INTEGRALS = tuple(name for name in ENERGY if not name.startswith("seat_"))  # which only models with uplift have
ERROR = "_error"  # ends the name of the variable with the error of a derivative
EVENT = 7  # numbers of an event: time, displacement, top force


@dataclass(frozen=True, eq=False)
class Gradients:
    """Derivatives of a run with respect to k parameters.

    Attributes:
        parameters: k of them.
        rows: derivatives of the fields of `History`, each an ndarray, shape (k, T, ...), [unit of the field/unit].
        energy: the same of energies, shape (k, T): of those that the state determines, or also of the integrals.
        event_time, event_displacement, event_top_force: shape (k, e), (k, e, 3), (k, e, 3).
        extremes: k of them, of `RunData.extremes`.
        error: errors of all of these, measured where a rim was met (`results.gradient_error`); None: not measured.
    """

    parameters: tuple[Parameter, ...]
    rows: dict[str, Array]
    energy: dict[str, Array]
    event_time: Array
    event_displacement: Array
    event_top_force: Array
    extremes: tuple[Extremes, ...]
    error: Gradients | None = None

    @classmethod
    def of_run(
        cls,
        parameters: tuple[Parameter, ...],
        energies: tuple[str, ...],
        model: Model,
        run: Run,
        count: int,
        azimuth: float,
        sprung: bool,
    ) -> Gradients:
        """The derivatives of a compiled run that has ended. count: number of its rows that are kept.

        energies: `ENERGIES` or `WITH_INTEGRALS`.
        """
        rows, events = run.gradient_rows(len(parameters))[:count], run.gradient_events(len(parameters))
        found = [unpacked(model, rows[:, i], azimuth, sprung) for i in range(len(parameters))]
        names = [name for name, values in found[0].items() if name not in CONSTANT and values is not None]
        vectors = (out_of_plane(events[:, :, 1 + 3 * i : 4 + 3 * i], azimuth, "vector") for i in range(2))
        displacement, force = (np.moveaxis(vector, 1, 0) for vector in vectors)
        return cls(
            parameters,
            {name: np.array([each[name] for each in found]) for name in names},
            {name: np.array([each["energy"][name] for each in found]) for name in energies},
            events[:, :, 0].T,
            displacement,
            force,
            tuple(
                Extremes.of_run(model.extension.EXTREMES, numbers, azimuth)
                for numbers in run.gradient_extremes(len(parameters))
            ),
        )

    def largest_numbers(self) -> Array:
        """Largest magnitude of all derivatives with respect to each parameter, shape (k,); not finite if one is not."""
        arrays = (*self.rows.values(), *self.energy.values(), self.event_time, self.event_top_force)
        largest: Array = np.max([np.abs(a).max(axis=tuple(range(1, a.ndim)), initial=0.0) for a in arrays], axis=0)
        return largest
