"""The notes of a building: monitors of its bearings that tripped, from the rows of the run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from msfp_gen.buildings.bearing_result import BearingResult, bearings_of
from msfp_gen.common.arrays import Array
from msfp_gen.results.note import Note
from msfp_gen.scene.effect_selection import UPLIFT_MONITOR_SHARE
from msfp_gen.scene.plausibility import doubtful_values

if TYPE_CHECKING:
    from msfp_gen.buildings.data import BuildingData

ENERGY_LIMIT = 0.02  # error of the energy balance of the building over its largest term, above which a note is written
TEXTS = {
    "uplift": "the normal force of surface {surface} falls to {value:.4g} N; contacts of the model cannot open: "
    "give effects.uplift = true",
    "rims": "a slider is {value:.3g} m beyond the capacity of surface {surface}; the model has no rims: give "
    "effects.rims = true",
    "energy": "the energy balance of the building has an error of {value:.1%} of the largest energy: give a smaller "
    "solver.max_step",
}


def notes_of(result: BuildingData) -> tuple[Note, ...]:
    """The notes of a run in order of time. The text of each begins with the bearing that it is about."""
    found = [note for each in bearings_of(result) for note in _of_bearing(each)]
    return tuple(sorted([*found, *_energy(result)], key=lambda note: note.time))


def _of_bearing(one: BearingResult) -> Iterator[Note]:
    effects = one.building.scene.modelled[one.index]
    for surface, value, text in doubtful_values(one.bearing):
        yield Note(0.0, "value", surface, value, f"{one.label}: {text}")
    if not effects.uplift:
        yield from _first(one, "uplift", one.normal_force, one.normal_force < UPLIFT_MONITOR_SHARE * one.axial_load)
    if not effects.rims:
        beyond = one.sliding - one.capacity
        yield from _first(one, "rims", beyond, beyond > 0)


def _first(one: BearingResult, kind: str, values: Array, tripped: NDArray[np.bool_]) -> Iterator[Note]:
    """A note of the first row in which a monitor trips, with the most that follows."""
    if not tripped.any():
        return
    row, surface = np.argwhere(tripped)[0]
    worst = values[:, surface].min() if kind == "uplift" else values[:, surface].max()
    text = TEXTS[kind].format(surface=surface + 1, value=float(worst))
    yield Note(float(one.time[row]), kind, int(surface) + 1, float(worst), f"{one.label}: {text}")


def _energy(result: BuildingData) -> Iterator[Note]:
    error, row = energy_error(result)
    if error > ENERGY_LIMIT:
        yield Note(float(result.time[row]), "energy", 0, error, TEXTS["energy"].format(value=error))


def energy_error(result: BuildingData) -> tuple[float, int]:
    """Largest difference of the work on the building from its energies, over the largest of them, and its row."""
    terms = np.stack([result.received, result.kinetic, result.strain, result.damped])
    difference = np.abs(terms[0] - terms[1:].sum(axis=0))
    row, largest = int(difference.argmax()), float(np.abs(terms).max())
    return (float(difference[row]) / largest if largest else 0.0), row
