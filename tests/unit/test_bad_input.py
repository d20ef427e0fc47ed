"""Bad input: one line that names the field, the value and the remedy.

Records, measurements and the files of buildings, factors and results have tables of their own, beside what reads them.
"""

# mypy: disable-error-code="arg-type"

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf, nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import scene_of
from support.buildings import BEARING, INTERFACE, frame
from support.buildings import MOTION as SHAKEN
from support.buildings import scene as building
from support.friction_scenes import P_REF, lawful
from support.malformed_scenes import GOOD, ROWS, broken
from support.study_tables import cheap_study

from msfp_gen import (
    Bearing,
    Body,
    Building,
    BuildingBearing,
    Effects,
    InitialState,
    InputError,
    Layout,
    Load,
    Measurement,
    Motion,
    Rotation,
    Scene,
    Solver,
    Stop,
    Surface,
    Top,
    TwoPort,
    changed_scene,
    load_scene,
    presets,
)
from msfp_gen.motions.records import bundled, read_record
from msfp_gen.scene.file.loader import dumps, scene_from_table
from msfp_gen.scene.parameters import parameters_of
from msfp_gen.studies import load_study

SURFACE = Surface(radius=0.5, capacity=0.06, friction=0.03, yield_displacement=1e-4, rim_stiffness=1e7, rim_damping=5.0)
SLIDER = Body(height=0.04, centroid=0.02, mass=1.0, inertia=(1e-3, 1.1e-3), rim_radius=0.05, rim_offset=0.003)
PLATE = Body(height=0.02, centroid=0.012, mass=8.0, inertia=0.03)
TIME = np.linspace(0.0, 6.0, 61)
WAVY = np.stack([np.sin(TIME) ** 2, 0.3 * np.cos(2 * TIME), 0.1 * TIME**2], axis=1)
MOTION, LOAD = Motion.harmonic(0.01, 1.0, cycles=1), Load.constant((1.0, 0.0, 0.0))
HUGE: Any = 10**400  # too large for a float
SHEET: dict[str, Any] = {
    "device": "triple", "radius": [0.473, 0.076], "height": [0.038, 0.023], "friction": [0.03, 0.017, 0.017, 0.107],
    "slider_diameter": [0.102, 0.051], "capacity": [0.065, 0.0215], "plate_height": 0.013, "axial_load": 112e3,
}  # fmt: skip
BOUNDS = {"friction_lower": [0.02, 0.01, 0.01, 0.08], "friction_upper": [0.04, 0.02, 0.02, 0.13]}
LOADED: dict[str, Any] = {
    "bearing": "double-fp",
    "motion": {"kind": "harmonic", "amplitude": 0.05, "frequency": 0.5, "rotation": {"kind": "constant", "psi": 0.01}},
    "top": {"kind": "rig", "axial_load": "1 MN", "stiffness": 1e9, "rotational_stiffness": 1e8},
    "load": {"kind": "samples", "time": [0, 2], "force": [[0, 0, 0], [0, 0, "100 kN"]]},
    "top_rotation": {"kind": "ramp", "theta": "1 deg", "duration": 1.0},
}


def double(changes: dict[str, Any]) -> Bearing:
    values = {"layout": Layout.dfp(), "base_height": 0.01, "surfaces": [SURFACE] * 2, "bodies": [SLIDER, PLATE]}
    return Bearing(**{**values, **changes})


def scene(changes: dict[str, Any]) -> Scene:
    rig = Top.rig(112e3, 1e8, 5.0, 1e6, 5.0)
    parts = {"bearing": presets.bearing("fenz-tfp"), "motion": Motion.harmonic(0.025, 0.5), "top": rig}
    return Scene(**{**parts, **changes})


def matrices(changes: dict[str, Any]) -> Building:
    return Building.from_matrices(
        frame().mass, None, frame().stiffness, **{"nodes": {"base": (range(6), (0.0, 0.0, 0.0))}, **changes}
    )


def call(given: Callable[[], Any]) -> Any:
    return given()


# What makes the refused object, and rows of what it is given and the words that the message holds.
TABLES: list[tuple[Callable[[Any], Any], list[tuple[Any, tuple[str, ...]]]]] = [
    (
        lambda changes: replace(SURFACE, **changes),
        [
            ({"radius": 0.0}, ("surface.radius = 0.0", "above 0 [m]")),
            ({"radius": "0.1"}, ("surface.radius = '0.1'",)),
            ({"radius": True}, ("surface.radius = True",)),
            ({"capacity": inf}, ("surface.capacity = inf", "finite")),
            ({"capacity": None}, ("surface.capacity = None",)),
            ({"yield_displacement": nan}, ("surface.yield_displacement = nan", "finite")),
            ({"yield_displacement": -1.0}, ("surface.yield_displacement = -1.0",)),
            ({"friction": -0.1}, ("surface.friction = -0.1",)),
            ({"rim_stiffness": -0.1}, ("surface.rim_stiffness = -0.1",)),
            ({"rim_damping": -0.1}, ("surface.rim_damping = -0.1",)),
        ],
    ),
    (
        lambda changes: replace(SLIDER, **changes),
        [
            ({"height": 0}, ("body.height = 0",)),
            ({"mass": 0}, ("body.mass = 0",)),
            ({"mass": -1}, ("body.mass = -1",)),
            ({"centroid": -0.001}, ("body.centroid = -0.001",)),
            ({"centroid": 0.05}, ("body.centroid = 0.05",)),
            ({"rim_radius": -1}, ("body.rim_radius = -1",)),
            ({"rim_offset": 0.05}, ("body.rim_offset = 0.05",)),
            ({"rim_offset": nan}, ("body.rim_offset = nan",)),
            ({"inertia": 0}, ("body.inertia = 0",)),
            ({"inertia": (1e-3, 0)}, ("body.inertia = (0.001, ",)),
            ({"inertia": (1e-3, nan)}, ("body.inertia = (0.001, ",)),
            ({"inertia": (1e-3, 2.1e-3)}, ("body.inertia = (0.001, ",)),
            ({"inertia": (1e-3,)}, ("body.inertia = (0.001,)",)),
            ({"inertia": "1"}, ("body.inertia = ",)),
            ({"height": inf}, ("body.height = inf",)),
        ],
    ),
    (
        double,
        [
            ({"surfaces": [SURFACE]}, ("bearing.surfaces has 1 entries", "needs 2")),
            ({"bodies": [SLIDER, PLATE, PLATE]}, ("bearing.bodies has 3 entries", "needs 2")),
            ({"surfaces": 3}, ("bearing.surfaces = 3",)),
            ({"surfaces": [SURFACE, SLIDER]}, ("bearing.surfaces[1]", "give a Surface")),
            ({"layout": (3, 1, 1)}, ("bearing.layout", "give a Layout")),
            ({"base_height": -0.01}, ("bearing.base_height = -0.01", "above 0 [m]")),
            ({"gravity": nan}, ("bearing.gravity = nan", "finite")),
            ({"base_centroid": 0.02}, ("bearing.base_centroid = 0.02", "at most")),
            ({"base_rim_offset": 0.02}, ("bearing.base_rim_offset = 0.02", "at most")),
            (
                {"surfaces": [SURFACE, replace(SURFACE, capacity=0.8)]},
                ("bearing.surfaces[1].capacity = 0.8 (surface 2)", "quarter turn"),
            ),
            (
                {"surfaces": [SURFACE, replace(SURFACE, capacity=0.78)]},
                ("bearing.surfaces[1].capacity = 0.78 (surface 2)", "hemisphere"),
            ),
            (
                {"bodies": [replace(SLIDER, rim_radius=0.5), PLATE]},
                ("bearing.bodies[0].rim_radius = 0.5 (body 2)", "radius of the surface"),
            ),
        ],
    ),
    (
        lambda changes: double({}).replace(**changes),
        [
            ({"friction": [0.1]}, ("bearing.friction has 1 entries: give 2",)),
            ({"frictions": 0.1}, ("bearing.frictions: unknown name",)),
            ({"friction": -0.1}, ("friction = -0.1",)),
            ({"surfaces": 3}, ("bearing.surfaces = 3",)),
            ({"capacity": 1.0}, ("quarter turn",)),
        ],
    ),
    (
        lambda changes: Bearing.from_sheet(**{**SHEET, **changes}),
        [
            ({"friction": [0.1]}, ("sheet.friction has 1 entries: a triple pendulum needs 4, or 2 of a symmetric",)),
            ({"radius": None}, ("height of radius, effective_radius, height is given; give two of them",)),
            ({"height": [0.02, 0.023]}, ("farther from the pivot than the one inside",)),
            ({"slider_diameter": [0.102, 0.05, 0.051, 0.102]}, ("both are faces of one rigid slider",)),
            ({"friction": [0.03, 0.01, 0.02, 0.1]}, ("sheet.friction of surfaces 2 and 3 = 0.01, 0.02",)),
            ({"dish_diameter": [0.229, 0.089]}, ("give either dish_diameter or capacity",)),
            ({"capacity": None, "dish_diameter": [0.1, 0.089]}, ("give more than the slider_diameter, 0.102",)),
            ({"friction_lower": [0.02, 0.01]}, ("give both friction_lower and friction_upper, or neither",)),
            ({**BOUNDS, "friction_lower": [0.04, 0.01, 0.01, 0.08]}, ("give at most its friction, 0.03",)),
            ({"slider_diameter": [1.0, 0.051]}, ("give less than twice the radius, 0.946",)),
            ({"effective_radius": [0.5, 0.05], "height": None}, ("radius = effective_radius + height",)),
            ({"rims": 1}, ("sheet.rims: unknown name; give one of device",)),
            ({"device": "quadruple"}, ("sheet.device = 'quadruple': give one of 'single'",)),
        ],
    ),
    (
        scene,
        [
            ({"bearing": "fenz-tfp"}, ("scene.bearing",)),
            ({"motion": None}, ("scene.motion",)),
            ({"top": 112e3}, ("scene.top",)),
            ({"stop": 0.14}, ("scene.stop",)),
            ({"name": 3}, ("scene.name",)),
            ({"duration": -1}, ("scene.duration",)),
            ({"duration": 1e3}, ("hold",)),
            ({"duration": 1e-9}, ("no step is shorter than 1e-09 s",)),
            ({"output_step": 100}, ("output_step",)),
            ({"initial_state": InitialState([[0, 0, 0]], [[0, 0, 0]], [[0, 0]])}, ("initial_state.q has 1 rows",)),
            ({"effects": Effects(rims=False), "stop": Stop(all_rims=True)}, ("effects.rims = False",)),
            (
                {"bearing": presets.bearing("fenz-tfp").replace(rim_radius=0.0)},
                ("bearing.bodies[0].rim_radius = 0 (body 2)",),
            ),
            ({"bearing": presets.bearing("fenz-tfp").replace(rim_stiffness=0.0)}, ("rim_stiffness = 0 (surface 1)",)),
            ({"effects": Effects(dimension="planar"), "motion": Motion.circle(0.02, 1.0)}, ("no vertical plane",)),
            (
                {"effects": Effects(dimension="planar"), "top": Top.prescribed((0, 1, -1e5))},
                ("leaves the vertical plane",),
            ),
            (
                {"effects": Effects(dimension="planar"), "top": Top.prescribed((0, 0, -1e5), (1, 0, 0))},
                ("leaves the vert",),
            ),
        ],
    ),
    (
        call,
        [
            (Top, ("top = Top()",)),
            (lambda: Top.rig(-1, 1e8), ("top.axial_load = -1",)),
            (lambda: Top.rig(1e5, -1), ("top.stiffness = -1",)),
            (lambda: Top.rig(1e5, 1e8, rotational_damping=nan), ("top.rotational_damping = nan",)),
            (lambda: Top.prescribed((0, 1)), ("top.force = (0, 1): give 3 finite numbers [N]",)),
            (lambda: Top.prescribed((0, 0, 1), (0, 0, inf)), ("top.moment",)),
            (lambda: Top.mass(0, 300, 0.5), ("top.mass = 0",)),
            (lambda: Top.mass(1e4, (300, -1), 0.5), ("top.inertia",)),
            (lambda: Top.mass(1e4, 300, -0.5), ("top.height = -0.5",)),
            (lambda: Solver(method="rk4"), ("solver.method = 'rk4': give one of 'implicit', 'esdirk4', 'dopri5'",)),
            (lambda: Solver(rtol=0), ("solver.rtol = 0",)),
            (lambda: Solver(rtol=1), ("solver.rtol = 1: give a finite number above 0 and below 1",)),
            (lambda: Solver(atol_angle=-1), ("solver.atol_angle = -1",)),
            (lambda: Solver(max_step=0.1, first_step=0.2), ("solver.first_step = 0.2",)),
            (lambda: Solver(max_steps=0), ("solver.max_steps = 0: give a whole number above 0",)),
            (lambda: Solver(max_steps=1e3), ("solver.max_steps = 1000.0",)),
            (Stop, ("nothing to stop at",)),
            (lambda: Stop(displacement=0), ("stop.displacement = 0",)),
            (lambda: InitialState([[0, 0]], [[0, 0, 0]], [[0, 0]]), ("initial_state.q",)),
            (lambda: InitialState([[0, 0, 0]], [[0, 0, np.nan]], [[0, 0]]), ("initial_state.v",)),
            (lambda: InitialState([[0, 0, 0]], [[0, 0, 0]], [[0.8, 0.8]]), ("Y^2 + Z^2 <= 1",)),
            (lambda: Motion.from_arrays([0, 1, 1, 2], np.zeros((4, 3))), ("time[2]: 1 s does not come after 1 s",)),
            (lambda: Motion.from_arrays([0, 2, 1, 3], np.zeros((4, 3))), ("sort the samples",)),
            (lambda: Motion.from_arrays([0, 1, 2], np.zeros((3, 3))), ("at least 4",)),
            (lambda: Motion.from_arrays([0, 1, 2, np.nan], np.zeros((4, 3))), ("time[3]: nan",)),
            (lambda: Motion.from_arrays(TIME, WAVY[:, :2]), ("displacement: shape (61, 2); give (61, 3)",)),
            (lambda: Motion.from_arrays(TIME, WAVY, WAVY[:5]), ("rotation: shape",)),
            (lambda: Motion.from_arrays(TIME, np.where(WAVY > 0.9, np.inf, WAVY)), ("displacement", "not finite")),
            (lambda: Motion.from_arrays(TIME, [["a"] * 3] * 61), ("displacement = 'a'", "give a number [m]")),
            (lambda: Motion.from_acceleration(TIME, WAVY[:-1]), ("acceleration: shape",)),
            (lambda: Motion.harmonic(0.0, 1.0), ("amplitude: 0.0 is not a positive",)),
            (lambda: Motion.harmonic(0.1, -1.0), ("frequency",)),
            (lambda: Motion.harmonic(0.1, 1.0, cycles=0), ("cycles",)),
            (lambda: Motion.circle(0.1, 0.1, lead_in=0), ("lead_in",)),
            (lambda: Motion.circle("wide", 0.1), ("amplitude = 'wide'", "give a number [m]")),
            (lambda: Motion.ramp(0.1, np.inf), ("duration",)),
            (lambda: Motion.ramp(0.1, 1.0).held(1.0), ("held",)),
            (lambda: Motion(np.array([1.0, 2.0]), np.zeros((1, 6, 6))), ("first of them zero",)),
            (lambda: Motion(np.array([0.0, 2.0]), np.zeros((1, 6, 4))), ("coefficients: shape",)),
            (lambda: Motion(np.array([0.0, 2.0]), np.zeros((1, 6, 6)), max_step=0.0), ("max_step",)),
            (lambda: Motion.from_record(bundled("ridgecrest-2019-ci-clc"), scale=-1), ("scale",)),
            (lambda: read_record("nowhere.v1"), ("nowhere.v1: cannot be read",)),
            (lambda: Load.constant((1.0, 0.0)), ("load.force: shape (2,); give 3 numbers",)),
            (lambda: Load.ramp([[0.0, 0.0, 1.0]], duration=1), ("load.force: shape (1, 3); give 3 numbers",)),
            (lambda: Load.harmonic((0, 0, 1), 5.0, frequency=1, cycles=1), ("load.moment: shape (", "give 3 numbers")),
            (lambda: Rotation.constant([1e-3] * 3, [1e-3] * 3), ("rotation: shape (2, 3); give 2 numbers",)),
            (lambda: Load.constant((HUGE, 0, 0)), ("load.force: not an array of numbers",)),
            (lambda: Motion.harmonic(HUGE, 1.0), ("amplitude: 1000", "is not a number")),
            (lambda: Motion.from_arrays(HUGE, [[0.0] * 3]), ("time: not an array of numbers",)),
            (lambda: Load.constant(np.array([1j, 0, 0])), ("load.force: not an array of numbers",)),
            (lambda: Rotation.from_arrays([[0, 1]], [[0, 0]]), ("rotation.time: shape (1, 2); give times in one",)),
            (
                lambda: Load.from_arrays([0, 2, 1.5], np.zeros((3, 3))),
                ("load.time[2]: 1.5 s is before 2.0 s; sort the samples",),
            ),
            (lambda: Load.from_arrays([1, 2], np.zeros((2, 3))), ("load.time:", "first [1.]; give", "of them zero")),
            (lambda: Motion.harmonic(0.01, 1.0, direction=np.nan), ("direction", "nan is not finite")),
            (lambda: Motion.ramp(0.1, 1.0, direction="E1"), ("direction = 'E1'", "give a number [rad]")),
            (
                lambda: Load.harmonic((1, 0, 0), frequency=1, cycles=1, phase=np.inf),
                ("load.phase", "inf is not finite"),
            ),
            (lambda: MOTION.rotated(np.inf), ("angle", "inf is not finite")),
            (lambda: MOTION.rotated([0.1, 0.2]), ("angle: shape (2,); give one number",)),
            (lambda: MOTION.rocking(LOAD), ("rotation =", ": give a Rotation")),
            (lambda: LOAD.evaluate("1 s"), ("time: not an array of numbers",)),
            (lambda: LOAD.evaluate(-np.inf), ("time", "-inf is not finite")),
            (lambda: LOAD.evaluate(0.5, 1.5), ("derivative: 1.5; give 0",)),
            (lambda: MOTION.evaluate(0.5, -1), ("derivative: -1; give 0",)),
            (lambda: Motion.from_record("a.v2"), ("record = 'a.v2': give a Record",)),
            (lambda: Measurement("test", ["a"] * 20, [0.0] * 20, [0.0] * 20), ("test: time: not an array of numbers",)),
            (lambda: TwoPort.of_scene("fenz-test2"), ("scene = 'fenz-test2': give a Scene",)),
        ],
    ),
    (
        lambda changes: scene_from_table({**LOADED, **changes}),
        [
            ({"load": {"kind": "samples", "time": [0, 2], "force": [[0, 0, 0]]}}, ("load: 1 rows for 2 times",)),
            ({"load": {"kind": "samples", "time": [1, 2], "force": [[0, 0, 0]] * 2}}, ("load.time",)),
            ({"load": {"kind": "push"}}, ("load.kind = 'push'",)),
            ({"load": {"kind": "constant", "force": "1 kN"}}, ("load.force",)),
            ({"load": {"kind": "constant", "forse": [0, 0, 1]}}, ("load.forse",)),
            ({"top_rotation": {"kind": "constant", "psi": 5.0}}, ("plates turn by less than 1 rad",)),
            ({"top_rotation": {"kind": "ramp", "psi": 0.1}}, ("top_rotation.duration",)),
            (
                {"top": {"kind": "prescribed", "force": [0, 0, -1e6]}},
                ("acts through rotational springs, and this prescribed top has none",),
            ),
            ({"effects": {"dimension": "planar"}}, ("leaves the vertical plane",)),
        ],
    ),
    (
        lambda law: lawful(scene_of("fenz-test2"), law[0], law[1], **law[2]),
        [
            (
                ("constant", None, {"velocity_rate": 100.0}),
                ("surfaces[0].velocity_rate = 100.0", "has no such parameter"),
            ),
            (
                ("velocity", None, {"velocity_rate": 100.0}),
                ("surfaces[0].friction_slow is missing", "'velocity' needs it"),
            ),
            (("velocity", None, {"friction_slow": 0.01, "velocity_rate": 9.0, "c1": 1.0}), ("c1 = 1.0", "'custom'")),
            (("pvt", None, {}), ("reference_pressure is missing",)),
            (("pvt", None, {"reference_pressure": P_REF, "velocity_drop": 1.5}), ("gives mu = -", "at v = 0 m/s")),
            (("custom", "mu - c1 * v", {"c1": 1.0}), ("gives mu = -", "finite and positive")),
            (("custom", "mu - c1 * v", {}), ("c1 is missing",)),
            (
                ("custom", "mu * (1 + sqrt(c1 * v))", {"c1": 1.0}),
                ("gives d mu/dv = inf at v = 0 m/s;", "of finite slope"),
            ),
            (("custom", "mu * (1 + (c1 * v) ** c2)", {"c1": -1.0, "c2": 2.0}), ("gives mu = nan at v =", "finite")),
        ],
    ),
    (
        lambda text: Effects(friction="custom", friction_law=text),
        [
            ("__import__('os').system('true')", ("not allowed",)),
            ("mu.real", ("not allowed",)),
            ("[mu for mu in (1,)]", ("not allowed",)),
            ("mu if v else 1", ("not allowed",)),
            ("mu * sin(v)", ("no function of a law",)),
            ("mu * exp(v, v)", ("takes 1 argument",)),
            ("mu * w", ("no name of a law",)),
            ("mu *", ("no formula",)),
            ("mu * 10 ** 10 ** 10", ("no number that can be used",)),
            ("mu * v", ("has no unit",)),
            ("mu * exp(-100 * v)", ("constants with a unit are c1 to c4",)),
            ("mu + p", ("against",)),
            ("mu" + " * mu" * 200, ("at most 500 characters",)),
        ],
    ),
    (
        lambda path: parameters_of(load_scene("fenz-test2"), [path]),
        [
            (
                "bearing.surfaces[4].friction",
                ("gradients = 'bearing.surfaces[4].friction': ", "there are 4 of them; give an index from 0 to 3"),
            ),
            (
                "bearing.surfaces.friction",
                (
                    "gradients = 'bearing.surfaces.friction': ",
                    "there are 4 surfaces; give bearing.surfaces[0].friction",
                ),
            ),
            ("bearing.friction", ("gradients = 'bearing.friction': ", "give bearing.surfaces[0].friction, or")),
            ("bearing.surfaces[0].frictio", ("gradients = 'bearing.surfaces[0].frictio': ", "did you mean friction")),
            (
                "bearing.surfaces[0].friction_slow",
                (
                    "gradients = 'bearing.surfaces[0].friction_slow': ",
                    "effects.friction = 'constant' has no such number",
                ),
            ),
            (
                "bearing.surfaces[0].seat_stiffness",
                (
                    "gradients = 'bearing.surfaces[0].seat_stiffness': ",
                    "this scene has no uplift,",
                    "give uplift = true",
                ),
            ),
            ("bearing.bodies[0].inertia", ("gradients = 'bearing.bodies[0].inertia': ", "this field holds 2 numbers")),
            ("bearing.base_centroid", ("gradients = 'bearing.base_centroid': ", "a run does not depend on it")),
            ("bearing[0].gravity", ("gradients = 'bearing[0].gravity': ", "there is one bearing")),
            ("top.mass", ("gradients = 'top.mass': ", "top has no number 'mass'")),
            ("top.vertical_stiffness", ("gradients = 'top.vertical_stiffness': ", "this top has no vertical spring")),
            (
                "motion.frequency",
                ("gradients = 'motion.frequency': ", "give motion.scale or motion.direction or motion.amplitude"),
            ),
            ("load.scale", ("gradients = 'load.scale': ", "this scene has no load history")),
            ("solver.rtol", ("gradients = 'solver.rtol': ", "a run has no gradient with respect to it")),
            ("initial_state.q[0]", ("gradients = 'initial_state.q[0]': ", "it needs 2 indices")),
            ("friction", ("gradients = 'friction': ", "no path of a parameter")),
            (
                "bearing.surfaces[-1].friction",
                ("gradients = 'bearing.surfaces[-1].friction': ", "no path of a parameter"),
            ),
        ],
    ),
    (
        lambda changes: changed_scene("fenz-test2", changes),
        [
            ({"fidelity": "cheap"}, ("fidelity = 'cheap'",)),
            ({"fidelity": "loose", "solver.rtol": 0.05}, ("solver.rtol = 0.05 already",)),
            ({"fidelity": "rigid"}, ("one bearing has no such model",)),
            (
                {"fidelity": "equivalent", "top": {"kind": "prescribed", "force": [0.0, 0.0, -1e5]}},
                ("it needs a top of kind 'rig' or 'mass'",),
            ),
        ],
    ),
    (
        lambda changes: replace(building(frame()), **changes),
        [
            ({"bearings": []}, ("scene.bearings: there are none",)),
            ({"duration": 1e3}, ("scene.duration = 1000.0: the motion lasts",)),
            ({"solver": Solver("dopri5")}, ("solver.method = 'dopri5'",)),
            (
                {"motion": SHAKEN.rocking(Rotation.of([0.0, SHAKEN.duration], 1e-3 * np.eye(6)[None, :2]))},
                ("the ground",),
            ),
            ({"motion": Motion.from_velocity(np.arange(5.0), np.ones((5, 3)))}, ("it starts with 1 m/s",)),
            ({"bearings": [BuildingBearing(BEARING, INTERFACE, (3.0, 0.0))]}, ("do not balance the weight",)),
            (
                {"bearings": [BuildingBearing(BEARING, INTERFACE, p) for p in ((1, 1), (2, 1), (1, 2))]},
                ("scene.bearings[1].position: it would be in tension at rest (-", "is outside the bearings, 1 to 2 m"),
            ),
            ({"bearings": [BuildingBearing(BEARING, INTERFACE, node="roof")]}, ("scene.bearings[0].node = 'roof'",)),
            (
                {"bearings": [BuildingBearing(BEARING, INTERFACE, node="floor 1")]},
                ("no bearing can be attached there",),
            ),
            (
                {"bearings": [BuildingBearing(BEARING.replace(gravity=g), INTERFACE) for g in (9.8, 9.81)]},
                ("scene.bearings[1].bearing.gravity = 9.81",),
            ),
            ({"motion": 3}, ("scene.motion = 3: give a Motion",)),
        ],
    ),
    (
        matrices,
        [
            ({"nodes": {"base": ([0, 1, 2], (0, 0, 0))}}, ("six different indices",)),
            ({"nodes": {"base": ([0, 1, 2, 3, 4, 99], (0, 0, 0))}}, ("outside of 0",)),
            ({"nodes": {"base": (range(6), (0, 0))}}, ("three finite numbers",)),
            ({"nodes": {}}, ("none carries bearings",)),
            (
                {"nodes": {"a": (range(6), (0, 0, 0)), "b": (range(3, 9), (0, 0, 0))}},
                ("coordinate 3 belongs to another",),
            ),
            ({"damping_ratio": 1.5}, ("building.damping_ratio = 1.5: give",)),
            ({"rayleigh_frequencies": (3.0, 2.0)}, ("building.rayleigh_frequencies = (3.0, 2.0): give two rising",)),
        ],
    ),
    (
        lambda changes: load_study(cheap_study(**changes)),
        [
            (
                {"axes": {"mu": {"sets": "bearing.friction", "values": [16**4000]}}},
                ("axes.mu.values[0]: a whole number has more than 64 bits",),
            ),
            ({"scene": None}, ("scene is missing",)),
            ({"scene": "fenz-tset1"}, ("scene = 'fenz-tset1'",)),
            ({"axis": {}}, ("axis: unknown key; did you mean 'axes'",)),
            ({"axes": {"a": {"sets": "solver.rtol"}}}, ("axes.a.values is missing",)),
            (
                {"axes": {"a": {"sets": "solver.rtoll", "values": [1.0]}}, "sampling": None},
                ("run 1 (a = 1.0): ", "rtoll"),
            ),
            (
                {"axes": {"a": {"sets": "solver.rtol", "values": [0.1, -1.0]}}, "sampling": None},
                ("axes.a: value -1.0: solver.rtol = -1.0",),
            ),
            (
                {"axes": {"a": {"sets": "solver.rtol", "values": [1e-3, 1e-3]}}},
                ("axes.a.values =", "a value occurs twice"),
            ),
            ({"sampling": None}, ("sampling is missing: axes.friction has a distribution",)),
            ({"axes": {}}, ("sampling: no axis has a distribution",)),
            (
                {"axes": {"a": {"multiplies": "bearing.friction", "distribution": "uniform", "low": 2, "high": 1}}},
                ("axes.a", "2.0, 1.0", "give low < high"),
            ),
            (
                {"axes": {"a": {"multiplies": "bearing.friction", "distribution": ["normal"]}}},
                ("axes.a.distribution = ['normal']", "give one of 'uniform'"),
            ),
            (
                {"axes": {"a": {"multiplies": "bearing.friction", "distribution": "gumbel"}}},
                ("axes.a.distribution = 'gumbel': give one of 'uniform'",),
            ),
            (
                {
                    "axes": {
                        "a": {"multiplies": "bearing.friction", "distribution": "normal", "mean": 0, "deviation": 1}
                    }
                },
                ("axes.a: value -", "friction"),
            ),
            ({"axes": {"status": {"values": [1]}}, "sampling": None}, ("axes.status: the table has such a column",)),
            ({"axes": {"a b": {"values": [1]}}, "sampling": None}, ("axes.a b: a name has letters",)),
            (
                {"axes": {"a": {"multiplies": "bearing.friction", "surfaces": [5], "values": [1]}}, "sampling": None},
                ("axes.a.surfaces has 5: this bearing has surfaces 1 to 4",),
            ),
            (
                {"keep": ["peak_displacment"]},
                ("keep: 'peak_displacment' is no quantity; did you mean 'peak_displacement'",),
            ),
            ({"quantities": {"x": "peak_force +"}}, ("quantities.x",)),
            ({"quantities": {"x": "nothing * 2"}}, ("quantities.x =", "'nothing' is no quantity")),
            ({"quantities": {"x": "peak(normal_forse_1)"}}, ("quantities.x: 'normal_forse_1' is no column",)),
            ({"limits": {"run_seconds": -1}}, ("limits.run_seconds = -1: give a finite number above 0",)),
            ({"limits": {"seconds": 1}}, ("limits.seconds: unknown key",)),
            ({"chunk": 0}, ("chunk = 0: give a whole number not below 1",)),
            (
                {
                    "records": {"motions": [{"bundled": "ridgecrest-2019-ci-clc"}]},
                    "axes": {"a": {"sets": "motion.scale", "values": [1]}},
                    "sampling": None,
                },
                ("axes.a.sets = 'motion.scale': [records] gives the motion",),
            ),
            ({"sampling": {"method": "sobol-sequence", "samples": 6}}, ("sampling.samples = 6:", "give 4 or 8")),
            ({"quantities": {"friction": "1 * peak_force"}}, ("friction: this name occurs twice",)),
        ],
    ),
    (lambda row: scene_from_table(broken(*row)), [((path, value), words) for path, value, words in ROWS]),
]


@pytest.mark.parametrize(
    ("make", "given", "words"),
    [pytest.param(make, given, words, id=words[0]) for make, rows in TABLES for given, words in rows],
)
def test_bad_input(make: Callable[[Any], Any], given: Any, words: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as caught:
        make(given)
    line = str(caught.value)
    assert "\n" not in line and len(line) < 600
    assert all(word in line for word in words), line


def test_what_the_tables_start_from_is_fine() -> None:
    made = [double({}), scene({}), matrices({}), Bearing.from_sheet(**SHEET), scene_from_table(LOADED)]
    assert all(made) and scene_from_table(GOOD) == presets.scene("fenz-test2")
    assert load_study(cheap_study()).runs == 12


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"name = ", ("no valid TOML", "end of document")),
        (b"name = 'a'\nname = 'b'\n", ("no valid TOML", "line 2")),
        (b"name = '\xff'", ("no UTF-8", "byte 8")),
        (b"", ("bearing is missing",)),
        (b"bearing = 'fenz-tfp'\nmotion = {kind = 'ramp'}", ("motion.acceleration is missing",)),
    ],
)
def test_files_that_are_no_scenes_are_named(tmp_path: Path, content: bytes, words: tuple[str, ...]) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(content)
    with pytest.raises(InputError) as error:
        load_scene(path)
    assert all(word in str(error.value) for word in ("scene.toml", *words)), str(error.value)


MISSING = [("fenz-tets1", "fenz-test1"), ("no/such.toml", "give the"), (".", "path")]


@pytest.mark.parametrize(("source", "word"), MISSING)
def test_files_that_are_not_there(source: str, word: str) -> None:
    with pytest.raises(InputError) as error:
        load_scene(source)
    assert word in str(error.value) and repr(source) in str(error.value)


def test_errors_of_files_name_file_and_field(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(dumps(broken("bearing.surfaces.2.radius", "76 kN")), encoding="utf-8")
    with pytest.raises(InputError) as error:
        load_scene(path)
    assert str(error.value).startswith(f"{path}: bearing.surfaces[2].radius = '76 kN' (surface 3): ")
