"""Scenes in which recorded histories drive a bearing: the motion of its plates, and its axial force.

The upper plate is held by a rig. Where the motion of both plates is recorded, the base moves as the lower one and the
springs of the rig are anchored to the upper one, by a load of their stiffness times its motion; where only the
displacement across the bearing is, the base moves by it and the upper plate stays.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from msfp_gen.auditing.histories import Histories
from msfp_gen.auditing.stated import Stated
from msfp_gen.common.arrays import Array, Flags
from msfp_gen.common.errors import InputError
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.prescribed import Load
from msfp_gen.results.result import Result
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.top import RigTop
from msfp_gen.specification.layout import Auto

OFF_CENTRE = 0.05  # permitted first displacement over the largest
LEAST_LOAD = 0.02  # axial force over that at rest, below which surfaces may part
HOLD = 5e3  # stiffness of the rig over the axial force at rest [1/m]: it moves some hundredths of a millimetre
RELAXED = 1e-3  # damping of the rig over its stiffness [s]
SAME_MOTION = 0.02  # RMS difference between the displacement and the motion of the ends, over the RMS displacement
ENDS = ("lower", "upper")


def opens(data: Histories) -> Flags:
    """Rows after the first motion in which the axial force is nearly zero or a tension, ndarray of bool, shape (T,)."""
    return data.below(LEAST_LOAD)


def off_centre(data: Histories) -> float:
    """First displacement [m]; 0 where it is small enough for a model, which begins at the centre."""
    start, most = (float(np.hypot(*rows)) for rows in (data.displacement[0], np.abs(data.displacement).max(axis=0)))
    return start if start > OFF_CENTRE * most else 0.0


def force_of(result: Result, data: Histories) -> Array:
    """Force of a run on its upper plate at the rows of a record, without the inertia of the plate, (T, 2) [N]."""
    time, own = data.time - data.time[0], result.alone.history
    return np.column_stack([np.interp(time, own.time, own.interface_force[:, -1, i]) for i in (0, 1)])


def ends(data: Histories) -> tuple[Array, Array]:
    """Motion of both plates from the first row, (T, 5) each: along E1, E2, E3 [m], about E1, E2 [rad].

    Raises InputError where one end is missing, or their difference is not the displacement.
    """
    u = data.displacement - data.displacement[0]
    given = [end for end in ENDS if not data.missing(end)]
    if not given:
        zero = np.zeros((len(u), 5))
        return np.column_stack([u, zero[:, 2:]]), zero
    if len(given) == 1:
        other = next(end for end in ENDS if end not in given)
        raise InputError(f"{data.name}: {given[0]} without {other}; give the motion of both plates, or of neither")
    sides = [np.column_stack([data.vector(end, 3), data.vector(f"{end}_rotation")]) for end in ENDS]
    lower, upper = (side - [*side[0, :3], 0.0, 0.0] for side in sides)
    apart = [float(np.std(sign * (lower - upper)[:, :2] - u)) for sign in (1.0, -1.0)]
    if min(apart) > SAME_MOTION * float(np.std(u)):
        raise InputError(
            f"{data.name}: displacement is not lower - upper, which differ by {1e3 * min(apart):.3g} mm RMS; check "
            "units and axes, or leave one of them out"
        )
    turned = np.array([1.0, 1.0, 1.0, 1.0, 1.0] if apart[0] <= apart[1] else [-1.0, -1.0, 1.0, -1.0, -1.0])
    return lower * turned, upper * turned  # half a turn about E3, where the displacement is upper - lower


def shadow_scene(data: Histories, stated: Stated, step: int = 1) -> Scene:
    """The bearing between plates that move as recorded, under the recorded axial force; it carries `LEAST_LOAD`.

    step: every so many rows are used.
    """
    rest, (lower, upper) = data.at_rest, ends(data)
    top = _rig(rest, rest, stated.bearing)
    axial = np.maximum(data.axial, LEAST_LOAD * rest)
    scene = Scene(
        stated.bearing,
        _motion(data, lower, step),
        top,
        Auto(rims=None if _has_rims(stated.bearing) else False) if stated.scene is None else stated.scene.effects,
        load=_load(data, top, axial, upper, step),
        output_step=data.step,
        name=f"shadow of {data.name}",
    )
    scene = scene if stated.scene is None else replace(scene, solver=stated.scene.solver)
    return scene.with_effects(uplift=False)


def opening_scene(data: Histories, scene: Scene, closed: Result) -> Scene:
    """The scene with surfaces that part: its upper plate has the mass that the axial force at rest carries.

    The recorded axial force acts, tension too, and the base moves so that a closed bearing leaves the plate level:
    the force on the mass is then the recorded one, and pulled up it rises as a mass that nothing holds. Where the
    record has the rise, the base also moves by its part that is not of the dish. closed: the run without lift-off.
    """
    bearing, rest, (_, upper) = scene.bearing, data.at_rest, ends(data)
    lower = np.array(ends(data)[0])
    time, open_ = data.time - data.time[0], opens(data)
    dish = -np.interp(time, closed.history.time, closed.history.displacement[:, 2])
    recorded = data.columns.get("rise", np.zeros_like(time))
    lower[:, 2] = -dish - np.where(open_, np.maximum(recorded - recorded[0] - dish, 0.0), 0.0)
    last = replace(bearing.bodies[-1], mass=rest / bearing.gravity)
    top = _rig(rest, 0.0, bearing)
    axial = np.where(open_, data.axial, np.maximum(data.axial, LEAST_LOAD * rest))
    changed = replace(
        scene,
        bearing=bearing.replace(bodies=[*bearing.bodies[:-1], last]),
        top=top,
        motion=_motion(data, lower, 1),
        load=_load(data, top, axial, upper, 1),
    )
    return changed.with_effects(uplift=True, sliders="inertial")


def even_load(data: Histories, scene: Scene) -> Scene:
    """The scene with the axial force at rest throughout."""
    assert isinstance(scene.top, RigTop)
    return replace(scene, load=_load(data, scene.top, np.full_like(data.time, data.at_rest), ends(data)[1], 1))


def _has_rims(bearing: Bearing) -> bool:
    """Whether the data of the bearing have all that rims need."""
    return all(
        surface.rim_stiffness and bearing.slider_rim_radius(index) for index, surface in enumerate(bearing.surfaces)
    )


def _rig(rest: float, axial_load: float, bearing: Bearing) -> RigTop:
    """The rig that holds the upper plate under an axial force at rest [N]."""
    stiffness = HOLD * rest
    # A plate that is one piece with the only slider tilts as it slides.
    against_tilt = 0.0 if bearing.layout.surfaces == 1 else stiffness
    return RigTop(axial_load, stiffness, RELAXED * stiffness, against_tilt, RELAXED * against_tilt)


def _motion(data: Histories, lower: Array, step: int) -> Motion:
    """The motion of the base, from every so many rows."""
    turns = np.column_stack([lower[:, 3:], 0 * data.time]) if lower[:, 3:].any() else None
    rows = _rows(data, step)
    return Motion.from_arrays(data.time[rows] - data.time[0], lower[rows, :3], None if turns is None else turns[rows])


def _load(data: Histories, top: RigTop, axial: Array, upper: Array, step: int) -> Load:
    """The axial force beside that at rest, and the springs of the rig times the motion of their anchor."""
    rows = _rows(data, step)
    time, down = data.time[rows] - data.time[0], (data.at_rest - axial)[rows]
    load = Load.from_arrays(time, np.column_stack([0 * down, 0 * down, down]))
    if not upper[:, [0, 1, 3, 4]].any():
        return load
    anchor = Motion.from_arrays(time, upper[rows, :3], np.column_stack([upper[rows, 3:], 0 * time]))
    rates = np.zeros_like(anchor.coefficients)
    rates[..., :-1] = anchor.coefficients[..., 1:] * np.arange(1, anchor.coefficients.shape[-1])
    springs = np.array([top.stiffness] * 2 + [0.0] + [top.rotational_stiffness] * 2 + [0.0])
    dampers = np.array([top.damping] * 2 + [0.0] + [top.rotational_damping] * 2 + [0.0])
    parts = springs[:, None] * anchor.coefficients + dampers[:, None] * rates
    return load + Load.of(anchor.knots, parts)


def _rows(data: Histories, step: int) -> Array:
    """Every so many rows, and the last one."""
    return np.unique(np.append(np.arange(0, len(data.time), step), len(data.time) - 1))
