"""The notes of the run of a building: of the monitors of its bearings, of its values and of its energy balance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from msfp_gen.buildings.plausibility import building_doubts
from msfp_gen.buildings.scene import BuildingBearing, BuildingScene, standing_below
from msfp_gen.results.note import RISING, Note
from msfp_gen.scene.effect_selection import doubtful_values
from msfp_gen.scene.fidelity import UNSEEN
from msfp_gen.scene.standing import unsteady

ENERGY_LIMIT = 0.02  # error of the energy balance of the building over its largest term, above which a note is written
GATHERED = ("heat", "law_speed", "law_load", "law_temperature")  # kinds
ENERGY = (
    "the energy balance of the building has an error of {value:.1%} of the largest energy: give a smaller "
    "solver.max_step"
)


def notes_of(scene: BuildingScene, monitored: Sequence[Note], error: float, time: float) -> tuple[Note, ...]:
    """The notes of a run in order of time. The text of each begins with the bearing that it is about.

    monitored: of the monitors of the bearings. error: of the energy balance [-]; time: at which it is largest [s].
    """
    values = [
        replace(note, bearing=number)
        for number, (one, load) in enumerate(zip(scene.bearings, scene.axial_loads, strict=True), start=1)
        for note in value_notes(one, load)
    ]
    notes = [*values, *_gathered(monitored)]
    labelled = [replace(note, text=f"{scene.label(note.bearing - 1)}: {note.text}") for note in notes]
    whole = [Note(0.0, "value", *doubt) for doubt in building_doubts(scene)]
    whole += [Note(0.0, "fidelity", 0, 0.0, UNSEEN[scene.fidelity])] if scene.fidelity in UNSEEN else []
    return tuple(sorted([*labelled, *whole, *_energy(error, time)], key=lambda note: note.time))


def _gathered(notes: Sequence[Note]) -> list[Note]:
    """The notes; of those about friction, which many bearings get, one of each kind stands for all.

    It is the one with the largest value of those in `RISING`, and else the first.
    """
    gathered = [note for note in notes if note.kind not in GATHERED]
    for kind in GATHERED:
        alike = [note for note in notes if note.kind == kind and not note.action]
        alike.sort(key=lambda note: -note.value if note.kind in RISING else note.time)
        for note in alike[:1]:
            others = len({other.bearing for other in alike}) - 1
            words = f"; the same holds for {others} other bearing{'s' * (others > 1)}"
            words += ", with less" if kind in RISING else ""
            gathered.append(replace(note, text=note.text + (words if others else "")))
        gathered += [note for note in notes if note.kind == kind and note.action]
    return gathered


def value_notes(one: BuildingBearing, load: float) -> tuple[Note, ...]:
    """Notes about values that are hardly meant, of a bearing and its interface. load: at rest [N]."""
    stiffness, needed, _ = standing_below(one, load)
    doubts = (*doubtful_values(one.bearing), *unsteady("interface.rotational_stiffness", stiffness, needed))
    return tuple(Note(0.0, "value", *doubt) for doubt in doubts)


def _energy(error: float, time: float) -> Iterator[Note]:
    if error > ENERGY_LIMIT:
        yield Note(time, "energy", 0, error, ENERGY.format(value=error))
