"""The notes on the run of a building: doubtful values of the scene, the energy balance, and notes of the monitors."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from msfp_gen.buildings.building import Building
from msfp_gen.buildings.scene import BuildingBearing, BuildingScene, standing_below
from msfp_gen.common.arrays import Array
from msfp_gen.results.note import RISING, Note
from msfp_gen.scene.fidelity import UNSEEN
from msfp_gen.scene.plausibility import (
    LEAST_DAMPING,
    OF_BEARING,
    OF_RUN,
    USUAL_DAMPING,
    Check,
    Reading,
    Subject,
    doubtful_values,
    judged,
    ringing,
    shear_doubts,
    unread_values,
)
from msfp_gen.scene.standing import unsteady
from msfp_gen.specification.layout import Auto

ENERGY_LIMIT = 0.02  # error of the energy balance of the building over its largest term, above which a note is written
ENERGY = (
    "the energy balance of the building has an error of {value:.1%} of the largest energy: give a smaller "
    "solver.max_step"
)


def notes_of(
    scene: BuildingScene, monitored: Sequence[Note], error: float, time: float, shear: tuple[float, float]
) -> tuple[Note, ...]:
    """The notes of a run in order of time; a note about a bearing begins with the label of the bearing.

    monitored: notes of the monitors of the bearings. error: largest error of the energy balance [-]. time: of this
    error [s]. shear: largest base shear [N], and its time [s].
    """
    values = [
        replace(note, bearing=number)
        for number, (mount, load) in enumerate(zip(scene.bearings, scene.axial_loads, strict=True), start=1)
        for note in value_notes(mount, load)
    ]
    notes = [*shared(values), *_gathered(monitored)]
    labelled = [replace(note, text=f"{scene.label(note.bearing - 1)}: {note.text}") for note in notes]
    whole = [Note(0.0, "value", *doubt) for doubt in building_doubts(scene)]
    whole += [Note(0.0, "fidelity", 0, 0.0, UNSEEN[scene.fidelity])] if scene.fidelity in UNSEEN else []
    doubts = shear_doubts(shear[0], scene.weight, "base shear", "weight of the building")
    whole += [Note(shear[1], "value", *doubt) for doubt in doubts]
    if error > ENERGY_LIMIT:
        whole.append(Note(time, "energy", 0, error, ENERGY.format(value=error)))
    return tuple(sorted([*labelled, *whole], key=lambda note: note.time))


def shared(notes: Iterable[Note]) -> list[Note]:
    """The notes on values, with one note, of the first bearing, for all that have such a value at the same place."""
    alike: dict[tuple[int, str], list[Note]] = {}
    for note in notes:
        words = re.sub(r"[-+]?\d[\d.]*(e[-+]?\d+)?", "", note.text.partition(":")[0])  # values may differ
        alike.setdefault((note.surface, words), []).append(note)
    return [_with_others(group[0], group) for group in alike.values()]


def _with_others(note: Note, alike: Sequence[Note], addition: str = "") -> Note:
    """The note, with the number of other bearings that have such a note."""
    others = len({other.bearing for other in alike}) - 1
    words = f"; the same holds for {others} other bearing{'s' * (others > 1)}{addition}"
    return replace(note, text=note.text + (words if others else ""))


def _gathered(notes: Sequence[Note]) -> list[Note]:
    """The notes of monitors, with one note of each kind for all bearings whose model did not change."""
    # Of a kind in `RISING` it is the note with the largest value, of another kind the first note.
    gathered = [note for note in notes if note.action]
    for kind in dict.fromkeys(note.kind for note in notes):
        alike = [note for note in notes if note.kind == kind and not note.action]
        alike.sort(key=lambda note: -note.value if note.kind in RISING else note.time)
        gathered += [_with_others(note, alike, ", with less" if kind in RISING else "") for note in alike[:1]]
    return gathered


def value_notes(mount: BuildingBearing, load: float) -> tuple[Note, ...]:
    """Notes about doubtful values of a bearing and its interface. load: at rest [N]."""
    stiffness, needed, _ = standing_below(mount, load)
    doubts = (
        *doubtful_values(mount.bearing, load),
        *unread_values(mount.bearing, mount.effects or Auto()),
        *unsteady("interface.rotational_stiffness", stiffness, needed),
    )
    return tuple(Note(0.0, "value", *doubt) for doubt in doubts)


LIGHT = 0.005  # mass of a floor over the mean of all floors, below which it is doubtful
GYRATION = 1.0  # radius of gyration of a floor over the largest distance of two bearings, above which it is doubtful
SHARE = 0.1  # lateral acceleration over gravity at which drifts are compared
DRIFT = 0.05  # drift over the height of the storey above which the stiffness is doubtful
HEIGHT = 20.0  # height of a storey above which it is doubtful [m]
OF_INTERFACES = 0.2  # share of the interfaces in the strain energy of a mode, above which they can damp the mode
SLOWEST = 0.05  # frequency of any mode below which a stiffness or an inertia is doubtful [Hz]
SAG = 0.05  # compression of the spring of an interface at rest above which its stiffness is doubtful [m]


class Floor(NamedTuple):
    """A floor: mass [kg], centre of mass in plan, shape (2,) [m], and its radius of gyration about E3 [m]."""

    mass: float
    centre: Array
    gyration: float


def _damping(building: Building) -> Iterator[Reading]:
    """Damping ratio of the first mode on a fixed base."""
    fixed = building.fixed
    if len(fixed.frequencies) and fixed.frequencies[0] > 0:
        mode = fixed.modes[:, 0]
        ratio = mode @ building.damping[np.ix_(fixed.inner, fixed.inner)] @ mode / (2 * fixed.frequencies[0])
        yield Reading(0, float(ratio), float(ratio))


def _frequency(building: Building) -> Iterator[Reading]:
    """Lowest frequency on a fixed base [Hz]."""
    if len(building.frequencies):
        yield Reading(0, float(building.frequencies[0]), float(building.frequencies[0]))


OF_BUILDING = (
    Check(
        _damping,
        (-np.inf, 0.2),
        "building.damping_ratio: the first mode on a fixed base has {value:.3g} of critical damping; is it a fraction, "
        "such as 0.05 for 5 per cent?",
    ),
    Check(
        _frequency,
        (SLOWEST, np.inf),
        "building: the lowest frequency on a fixed base is {value:.3g} Hz; are stiffnesses in N/m and N m/rad, of "
        "torsion and rocking too?",
    ),
)
"""Checks of a superstructure."""


def _of_run(scene: BuildingScene) -> Subject:
    """What is judged of the run of a building: the bearing with the largest load at rest, ground and limits."""
    heaviest = int(np.argmax(scene.axial_loads))
    bearing, load = scene.bearings[heaviest].bearing, float(scene.axial_loads[heaviest])
    return Subject(bearing, load, motion=scene.first_ground, limits=scene.limits)


def refusals(scene: BuildingScene) -> list[str]:
    """The texts of the doubts about values that no unit can make right, each once for all bearings of one kind."""
    found = [text for (_, _, text), refused in judged(OF_RUN, _of_run(scene)) if refused]
    kinds = {mount.bearing: float(load) for mount, load in zip(scene.bearings, scene.axial_loads, strict=True)}
    for bearing, load in kinds.items():
        found += [text for (_, _, text), refused in judged(OF_BEARING, Subject(bearing, load)) if refused]
    return found


def building_doubts(scene: BuildingScene) -> Iterator[tuple[int, float, str]]:
    """Doubtful values of a building: 0 (no surface), the value, and the text of the doubt with the likely unit."""
    yield from (doubt for doubt, _ in (*judged(OF_RUN, _of_run(scene)), *judged(OF_BUILDING, scene.building)))
    yield from _floor_doubts(scene)
    yield from _storey_doubts(scene.building, scene.gravity)
    springs = np.array([mount.interface.vertical_stiffness for mount in scene.bearings])
    sags = scene.axial_loads / springs
    index = int(sags.argmax())
    if sags[index] > SAG:
        text = (
            f"building.bearing[{index}].interface.vertical_stiffness = {springs[index]:g} N/m: the building settles by "
            f"{sags[index]:.3g} m at rest; is it in N/m, not in kN/m?"
        )
        yield 0, float(springs[index]), text
    yield from _soft(scene)
    yield from _undamped(scene)


def floors(building: Building) -> list[Floor]:
    """The floors of a shear frame, the base first; none for a building of matrices.

    The columns of each storey have the inertia of all floors above; a floor is the difference of two consecutive ones.
    """
    if not building.columns:
        return []
    motions = building.rigid_motions
    groups = [_mass_properties(motions.T @ building.mass @ motions)]
    groups += [_mass_properties(columns.inertia @ motions) for columns in building.columns]
    found = []
    for (mass, centre, inertia), (above, centre_above, inertia_above) in pairwise([*groups, (0.0, np.zeros(2), 0.0)]):
        own = mass - above
        own_centre = (mass * centre - above * centre_above) / own
        own_inertia = inertia - inertia_above
        own_inertia -= own * np.sum((own_centre - centre) ** 2) + above * np.sum((centre_above - centre) ** 2)
        found.append(Floor(own, own_centre, float(np.sqrt(max(own_inertia, 0.0) / own))))
    return found


def _mass_properties(inertia: Array) -> tuple[float, Array, float]:
    """Mass [kg], centre of mass in plan, shape (2,) [m], and moment of inertia about E3 through the centre [kg m^2]."""
    # inertia: of rigid bodies, shape (6, 6). Its columns are motions about the origin. Its rows are about any point,
    # since a rotation about the centre of mass needs no force, so that its moment is equal about all points.
    mass = float(inertia[0, 0])
    x, y = inertia[1, 5] / mass, -inertia[0, 5] / mass
    rotation = inertia[:, 5] + y * inertia[:, 0] - x * inertia[:, 1]
    return mass, np.array([x, y]), float(rotation[5])


def _path(index: int) -> str:
    """Path in a file of a floor by its index, 0 for the base."""
    return "building.base" if index == 0 else f"building.storey[{index - 1}]"


def _floor_doubts(scene: BuildingScene) -> Iterator[tuple[int, float, str]]:
    frame = floors(scene.building)
    if not frame:
        return
    mean = float(np.mean([floor.mass for floor in frame]))
    places = scene.places
    widest = float(np.linalg.norm(places[:, None] - places, axis=-1).max())
    for index, floor in enumerate(frame):
        if floor.mass < LIGHT * mean:
            text = f"{_path(index)}.mass = {floor.mass:g} kg is {floor.mass / mean:.2g} of the mean of all floors"
            yield 0, floor.mass, f"{text}; is it in kg, not in t?"
        elif widest > 0 and floor.gyration > GYRATION * widest:
            text = (
                f"{_path(index)}.inertia: about E3 the radius of gyration is {floor.gyration:.3g} m, the bearings are "
                f"at most {widest:.3g} m apart; is it mass times radius squared [kg m^2]?"
            )
            yield 0, floor.gyration, text


def _storey_doubts(building: Building, gravity: float) -> Iterator[tuple[int, float, str]]:
    if not building.columns:
        return
    levels = [float(node.position[2]) for node in building.nodes]
    drifts = _drifts(building, SHARE * gravity)
    for index, (below, above) in enumerate(pairwise(levels)):
        height = above - below
        if height > HEIGHT:
            yield 0, height, f"{_path(index + 1)}.height = {height:g} m is unusually high; is it in m, not in mm?"
        elif drifts[index] > DRIFT * height:
            text = (
                f"{_path(index + 1)}.stiffness: under {SHARE:g} g the storey drifts by {drifts[index] / height:.0%} of "
                "its height; is it in N/m, not in kN/m?"
            )
            yield 0, float(drifts[index]), text


def _drifts(building: Building, acceleration: float) -> Array:
    """Largest drift of every storey on a fixed base under a lateral acceleration, shape (storeys,) [m]."""
    # acceleration: along E1 or E2 [m/s^2].
    fixed = building.fixed
    rows = np.stack([columns.deformation[:2] for columns in building.columns])[..., fixed.inner]
    forces = [building.uniform_acceleration(acceleration * axis)[fixed.inner] for axis in np.eye(3)[:2]]
    response = fixed.modes @ (fixed.modes.T @ np.transpose(forces) / fixed.frequencies[:, None] ** 2)
    drifts: Array = np.linalg.norm(rows @ response, axis=1).max(axis=1)
    return drifts


def _soft(scene: BuildingScene) -> Iterator[tuple[int, float, str]]:
    """A doubt where the building rocks or heaves on its interfaces more slowly than any building does."""
    modes = scene.vertical_modes
    squares = modes.squares[modes.shares > OF_INTERFACES]
    if len(squares) and (frequency := float(np.sqrt(max(squares.min(), 0.0)) / (2 * np.pi))) < SLOWEST:
        text = (
            f"building: on the vertical springs of its interfaces it rocks or heaves at {frequency:.3g} Hz; are their "
            "stiffnesses in N/m, positions in m, and moments of inertia in kg m^2?"
        )
        yield 0, frequency, text


def _undamped(scene: BuildingScene) -> Iterator[tuple[int, float, str]]:
    """A doubt where a mode that the interfaces can damp has less than `LEAST_DAMPING` of critical damping."""
    # Yields 0 (no surface), the least damping ratio, and the text with the damping that suffices.
    modes = scene.vertical_modes
    on_springs = modes.shares > OF_INTERFACES
    if not on_springs.any():
        return
    frequencies = np.sqrt(modes.squares[on_springs])  # circular [rad/s]
    ratios = modes.rates[on_springs] / (2 * frequencies)
    least, interface = int(ratios.argmin()), scene.bearings[0].interface
    if ratios[least] < LEAST_DAMPING:
        missing = 2 * (USUAL_DAMPING - ratios) / (frequencies * modes.shares[on_springs])  # damping over stiffness [s]
        damping = interface.vertical_damping
        sufficient = damping + float(missing.max()) * interface.vertical_stiffness
        what = "the building vibrates on the vertical springs of its interfaces"
        name = "building.interface.vertical_damping"
        yield 0, float(ratios[least]), ringing(name, damping, what, frequencies[least], ratios[least], sufficient)
