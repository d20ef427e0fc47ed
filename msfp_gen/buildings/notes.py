"""The notes on the run of a building: doubtful values of the scene, the energy balance, and notes of the monitors."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from msfp_gen.buildings.bearing import BuildingBearing, standing_below
from msfp_gen.buildings.building import Building
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.arrays import Array
from msfp_gen.results.note import RISING, Note
from msfp_gen.scene.fidelity import UNSEEN
from msfp_gen.scene.plausibility import (
    LEAST_DAMPING,
    NUMBER,
    OF_BEARING,
    OF_MOTION,
    OF_RUN,
    USUAL_DAMPING,
    Doubt,
    Reading,
    Subject,
    UsualRange,
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
    notes = [*doubt_notes(scene), *_labelled(scene, _gathered(monitored))]
    notes += [Note(0.0, "fidelity", 0, 0.0, UNSEEN[scene.fidelity])] if scene.fidelity in UNSEEN else []
    doubts = shear_doubts(shear[0], scene.weight, "base shear", "weight of the building")
    notes += [Note(shear[1], "value", *doubt) for doubt in doubts]
    if error > ENERGY_LIMIT:
        notes.append(Note(time, "energy", 0, error, ENERGY.format(value=error)))
    return tuple(sorted(notes, key=lambda note: note.time))


def doubt_notes(scene: BuildingScene) -> list[Note]:
    """The notes on doubtful values of the bearings, each with a label, and of the building."""
    values = [
        replace(note, bearing=number)
        for number, (mount, load) in enumerate(zip(scene.bearings, scene.axial_loads, strict=True), start=1)
        for note in value_notes(mount, load)
    ]
    whole = [Note(0.0, "value", *doubt) for doubt in building_doubts(scene)]
    return [*_labelled(scene, shared(values)), *whole]


def _labelled(scene: BuildingScene, notes: Iterable[Note]) -> list[Note]:
    """The notes with the labels of their bearings."""
    return [replace(note, text=f"{scene.label(note.bearing - 1)}: {note.text}") for note in notes]


def shared(notes: Iterable[Note]) -> list[Note]:
    """The notes on values, with one note, of the first bearing, for all that have such a value at the same place."""
    alike: dict[tuple[int, str], list[Note]] = {}
    for note in notes:
        words = NUMBER.sub("", re.split(r"(?<=\d): ", note.text)[0])  # values may differ, and the reasons after them
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


def _has_rims(mount: BuildingBearing) -> bool:
    """Whether a run of the bearing may model its rims."""
    return (mount.effects or Auto()).rims is not False


def ground_doubts(mount: BuildingBearing) -> Iterator[Doubt]:
    """Doubts about the motion of the ground that a bearing has of its own."""
    if mount.motion is not None:
        yield from (doubt for doubt, _ in judged(OF_MOTION, mount.motion))


def value_notes(mount: BuildingBearing, load: float) -> tuple[Note, ...]:
    """Notes about doubtful values of a bearing, its interface and its own ground. load: at rest [N]."""
    stiffness, needed, _ = standing_below(mount, load)
    doubts = (
        *doubtful_values(mount.bearing, load, _has_rims(mount)),
        *unread_values(mount.bearing, mount.effects or Auto()),
        *unsteady("interface.rotational_stiffness", stiffness, needed),
        *ground_doubts(mount),
    )
    return tuple(Note(0.0, "value", *doubt) for doubt in doubts)


SHARE = 0.1  # lateral acceleration over gravity at which drifts are compared
HEIGHT = 20.0  # height of a storey above which it is doubtful, and its drift is not judged [m]
LIGHT = 0.005  # mass of a floor over the mean of all floors, below which it is doubtful, and its inertia is not judged
OF_INTERFACES = 0.2  # share of the interfaces in the strain energy of a mode, above which they can damp the mode


class Floor(NamedTuple):
    """A floor: mass [kg], centre of mass in plan, shape (2,) [m], and its radius of gyration about E3 [m]."""

    mass: float
    centre: Array
    gyration: float


def _damping(scene: BuildingScene) -> Iterator[Reading]:
    """Damping ratio of the first mode on a fixed base."""
    building, fixed = scene.building, scene.building.fixed
    if len(fixed.frequencies) and fixed.frequencies[0] > 0:
        mode = fixed.modes[:, 0]
        ratio = mode @ building.damping[np.ix_(fixed.inner, fixed.inner)] @ mode / (2 * fixed.frequencies[0])
        yield Reading(0, float(ratio), float(ratio))


def _frequency(scene: BuildingScene) -> Iterator[Reading]:
    """Lowest frequency on a fixed base [Hz]."""
    if len(scene.building.frequencies):
        yield Reading(0, float(scene.building.frequencies[0]), float(scene.building.frequencies[0]))


def _floor_mass(scene: BuildingScene) -> Iterator[Reading]:
    """Masses of the floors of a frame over their mean."""
    frame = floors(scene.building)
    for index, floor in enumerate(frame):
        mean = float(np.mean([floor.mass for floor in frame]))
        yield Reading(0, floor.mass, floor.mass / mean, {"path": _path(index)})


def _widest(scene: BuildingScene) -> float:
    """Largest distance of two bearings [m]."""
    return float(np.linalg.norm(scene.places[:, None] - scene.places, axis=-1).max())


def _gyration(scene: BuildingScene) -> Iterator[Reading]:
    """Radii of gyration of the floors of a frame over the largest distance of two bearings."""
    widest = _widest(scene)
    for mass, floor in zip(_floor_mass(scene), floors(scene.building), strict=True):
        if mass.measure >= LIGHT and widest > 0:
            yield Reading(0, floor.gyration, floor.gyration / widest, {**mass.words, "widest": widest})


def _plan(scene: BuildingScene) -> Iterator[Reading]:
    """Largest distance of two bearings [m]."""
    widest = _widest(scene)
    if widest > 0:
        yield Reading(0, widest, widest)


def _heights(scene: BuildingScene) -> Iterator[Reading]:
    """Heights of the storeys of a frame [m]."""
    if scene.building.columns:
        levels = [float(node.position[2]) for node in scene.building.nodes]
        for index, (below, above) in enumerate(pairwise(levels), start=1):
            yield Reading(0, above - below, above - below, {"path": _path(index)})


def _storey_drifts(scene: BuildingScene) -> Iterator[Reading]:
    """Drifts of the storeys of a frame under `SHARE` of gravity, over their heights."""
    heights = list(_heights(scene))
    drifts = _drifts(scene.building, SHARE * scene.gravity) if heights else np.zeros(0)
    for (_, height, _, words), drift in zip(heights, drifts, strict=True):
        if height <= HEIGHT:
            yield Reading(0, float(drift), float(drift) / height, words)


def _sag(scene: BuildingScene) -> Iterator[Reading]:
    """The spring of the interface that is compressed most at rest, by its compression [m]."""
    springs = np.array([mount.interface.vertical_stiffness for mount in scene.bearings])
    sags = scene.axial_loads / springs
    mount = int(sags.argmax())
    yield Reading(0, float(springs[mount]), float(sags[mount]), {"mount": mount})


def _slowest(scene: BuildingScene) -> Iterator[Reading]:
    """Lowest frequency of the modes in which the building rocks or heaves on its interfaces [Hz]."""
    modes = scene.vertical_modes
    squares = modes.squares[modes.shares > OF_INTERFACES]
    if len(squares):
        frequency = float(np.sqrt(max(squares.min(), 0.0)) / (2 * np.pi))
        yield Reading(0, frequency, frequency)


OF_BUILDING = (
    UsualRange(
        _damping,
        (-np.inf, 0.2),
        "building.damping_ratio: the first mode on a fixed base has {value:.3g} of critical damping; is it a fraction, "
        "such as 0.05 for 5 per cent?",
        (-np.inf, 1.0),
    ),
    UsualRange(
        _frequency,
        (0.05, np.inf),
        "building: the lowest frequency on a fixed base is {value:.3g} Hz; are stiffnesses in N/m and N m/rad, of "
        "torsion and rocking too?",
        (0.02, np.inf),
    ),
    UsualRange(
        _floor_mass,
        (LIGHT, np.inf),
        "{path}.mass = {value:g} kg is {measure:.2g} of the mean of all floors; is it in kg, not in t?",
        (0.003, np.inf),
    ),
    UsualRange(
        _gyration,
        (0.02, 1.0),
        "{path}.inertia: about E3 the radius of gyration is {value:.3g} m, the bearings are at most {widest:.3g} m "
        "apart; is it mass times radius squared [kg m^2]?",
        (0.001, 10.0),
    ),
    UsualRange(
        _plan,
        (0.5, 500.0),
        "building.bearing: two bearings are {value:.4g} m apart; are their positions in m?",
        (0.01, 5000.0),
    ),
    UsualRange(
        _heights,
        (-np.inf, HEIGHT),
        "{path}.height = {value:g} m is unusually high; is it in m, not in mm?",
        (-np.inf, 100.0),
    ),
    UsualRange(
        _storey_drifts,
        (-np.inf, 0.05),
        f"{{path}}.stiffness: under {SHARE:g} g the storey drifts by {{measure:.0%}} of its height; is it in N/m, not "
        "in kN/m?",
        (-np.inf, 0.3),
    ),
    UsualRange(
        _sag,
        (-np.inf, 0.05),
        "building.bearing[{mount}].interface.vertical_stiffness = {value:g} N/m: the building settles by {measure:.3g} "
        "m at rest; is it in N/m, not in kN/m?",
        (-np.inf, 0.5),
    ),
    UsualRange(
        _slowest,
        (0.05, np.inf),
        "building: on the vertical springs of its interfaces it rocks or heaves at {value:.3g} Hz; are their "
        "stiffnesses in N/m, positions in m, and moments of inertia in kg m^2?",
        (0.02, np.inf),
    ),
)
"""Checks of a superstructure and of its interfaces."""


def _judged_building(scene: BuildingScene) -> Iterator[tuple[Doubt, bool]]:
    """What `judged` finds in a building: its limits on the bearing with the largest load at rest, ground, structure."""
    heaviest = int(np.argmax(scene.axial_loads))
    bearing, load = scene.bearings[heaviest].bearing, float(scene.axial_loads[heaviest])
    yield from judged(OF_RUN, Subject(bearing, load, limits=scene.limits))
    if any(mount.motion is None for mount in scene.bearings):
        yield from judged(OF_MOTION, scene.motion)
    yield from judged(OF_BUILDING, scene)


def refusals(scene: BuildingScene) -> list[str]:
    """The texts of the doubts about values that no unit can make right, each once for all bearings of one kind."""
    found = [text for (_, _, text), refused in _judged_building(scene) if refused]
    loads = zip(scene.bearings, scene.axial_loads, strict=True)
    kinds = {(mount.bearing, _has_rims(mount)): float(load) for mount, load in loads}
    for (bearing, rims), load in kinds.items():
        found += [text for (_, _, text), refused in judged(OF_BEARING, Subject(bearing, load, rims)) if refused]
    own = {id(mount.motion): index for index, mount in reversed(list(enumerate(scene.bearings))) if mount.motion}
    for index in sorted(own.values()):
        judgements = judged(OF_MOTION, scene.bearings[index].motion)
        found += [f"{scene.label(index)}: {text}" for (_, _, text), refused in judgements if refused]
    return found


def building_doubts(scene: BuildingScene) -> Iterator[Doubt]:
    """Doubtful values of a building: 0 (no surface), the value, and the text of the doubt with the likely unit."""
    yield from (doubt for doubt, _ in _judged_building(scene))
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


def _drifts(building: Building, acceleration: float) -> Array:
    """Largest drift of every storey on a fixed base under a lateral acceleration, shape (storeys,) [m]."""
    # acceleration: along E1 or E2 [m/s^2].
    fixed = building.fixed
    rows = np.stack([columns.deformation[:2] for columns in building.columns])[..., fixed.inner]
    forces = [building.uniform_acceleration(acceleration * axis)[fixed.inner] for axis in np.eye(3)[:2]]
    response = fixed.modes @ (fixed.modes.T @ np.transpose(forces) / fixed.frequencies[:, None] ** 2)
    drifts: Array = np.linalg.norm(rows @ response, axis=1).max(axis=1)
    return drifts


def _undamped(scene: BuildingScene) -> Iterator[Doubt]:
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
