"""The notes of a building: monitors of its bearings that tripped, doubtful values, the balance of energy."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.buildings.scene import BuildingBearing, standing_below
from msfp_gen.buildings.vibration import undamped
from msfp_gen.results.note import RISING, Note
from msfp_gen.scene.effect_selection import doubtful_values
from msfp_gen.scene.standing import unsteady

if TYPE_CHECKING:
    from msfp_gen.buildings.data import BuildingData

ENERGY_LIMIT = 0.02  # error of the energy balance of the building over its largest term, above which a note is written
GATHERED = ("heat", "law_speed", "law_load", "law_temperature")  # kinds
ENERGY = (
    "the energy balance of the building has an error of {value:.1%} of the largest energy: give a smaller "
    "solver.max_step"
)


def notes_of(result: BuildingData) -> tuple[Note, ...]:
    """The notes of a run in order of time. The text of each begins with the bearing that it is about."""
    scene = result.scene
    found = [(i, note) for i, each in enumerate(scene.bearings) for note in value_notes(each, scene.axial_loads[i])]
    named = [replace(note, text=f"{scene.label(i)}: {note.text}") for i, note in [*found, *_gathered(result.monitored)]]
    whole = [Note(0.0, "value", *doubt) for doubt in undamped(scene, scene.vertical_modes)]
    return tuple(sorted([*named, *whole, *_energy(result)], key=lambda note: note.time))


def _gathered(notes: Sequence[tuple[int, Note]]) -> list[tuple[int, Note]]:
    """The notes; of those about friction, which many bearings get, one of each kind stands for all.

    It is the one with the largest value of those in `RISING`, and else the first.
    """
    found = [pair for pair in notes if pair[1].kind not in GATHERED]
    for kind in GATHERED:
        alike = [pair for pair in notes if pair[1].kind == kind and not pair[1].action]
        alike.sort(key=_falling_value if kind in RISING else _time)
        for index, note in alike[:1]:
            others = len({i for i, _ in alike}) - 1
            words = f"; the same holds for {others} other bearing{'s' * (others > 1)}"
            words += ", with less" if kind in RISING else ""
            found.append((index, replace(note, text=note.text + (words if others else ""))))
        found += [pair for pair in notes if pair[1].kind == kind and pair[1].action]
    return found


def _time(pair: tuple[int, Note]) -> float:
    return pair[1].time


def _falling_value(pair: tuple[int, Note]) -> float:
    return -pair[1].value


def value_notes(each: BuildingBearing, load: float) -> tuple[Note, ...]:
    """Notes about values that are hardly meant, of a bearing and its interface. load: at rest [N]."""
    given, needed, _ = standing_below(each, load)
    doubts = (*doubtful_values(each.bearing), *unsteady("interface.rotational_stiffness", given, needed))
    return tuple(Note(0.0, "value", *doubt) for doubt in doubts)


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
