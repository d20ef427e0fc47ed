"""The notes of a building: monitors of its bearings that tripped, doubtful values, the balance of energy."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.results.note import Note
from msfp_gen.scene.plausibility import doubtful_values

if TYPE_CHECKING:
    from msfp_gen.buildings.data import BuildingData
    from msfp_gen.scene.bearing import Bearing

ENERGY_LIMIT = 0.02  # error of the energy balance of the building over its largest term, above which a note is written
ENERGY = (
    "the energy balance of the building has an error of {value:.1%} of the largest energy: give a smaller "
    "solver.max_step"
)


def notes_of(result: BuildingData) -> tuple[Note, ...]:
    """The notes of a run in order of time. The text of each begins with the bearing that it is about."""
    scene = result.scene
    found = [(i, note) for i, each in enumerate(scene.bearings) for note in value_notes(each.bearing)]
    named = [replace(note, text=f"{scene.label(i)}: {note.text}") for i, note in [*found, *result.monitored]]
    return tuple(sorted([*named, *_energy(result)], key=lambda note: note.time))


def value_notes(bearing: Bearing) -> tuple[Note, ...]:
    """Notes about values that are hardly meant."""
    return tuple(Note(0.0, "value", *doubt) for doubt in doubtful_values(bearing))


def _energy(result: BuildingData) -> Iterator[Note]:
    error, row = energy_error(result)
    if error > ENERGY_LIMIT:
        yield Note(float(result.time[row]), "energy", 0, error, ENERGY.format(value=error))


def energy_error(result: BuildingData) -> tuple[float, int]:
    """Largest difference of the work on the building from its energies, over the largest of them, and its row."""
    terms = np.stack([result.received, result.kinetic, result.strain, result.damped])
    difference = np.abs(terms[0] - terms[1:].sum(axis=0))
    row, largest = int(difference.argmax()), float(np.abs(terms).max())
    return (float(difference[row]) / largest if largest else 0.0), row
