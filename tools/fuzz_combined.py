"""Random combinations of the public constructors, for the campaign `python tools/fuzz.py --combined`.

Sums of histories, pieces, uneven sampling, jumps at starts and ends, records with baseline errors, tops with moments and
springs, extreme friction laws, displaced states, stops, stacks of 12 and more bodies, scenes through TOML with units, and
effects that are selected automatically.
"""

from __future__ import annotations

import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
from fuzz_scenes import Case, Draw, Layers, a_bearing, a_motion, load_of, noise, reach

from msfp_gen import Auto, Bearing, Effects, InitialState, InputError, Load, Motion, Rotation, Scene, Solver, Stop, Top
from msfp_gen.motions.records.record import Record
from msfp_gen.scene.file.loader import scene_from_table, scene_text
from msfp_gen.scene.top import RigTop

FADING = "mu * (1 - c1 * v)"  # negative above a velocity of 1/c1
BOUNDED = "mu * (1 - c1 * exp(-c2 * v)) * Max(1 - tanh(N / c3) / 5, 0.5)"
PLANAR, MASSLESS = {"dimension": "planar"}, {"sliders": "massless"}
COMBINED: list[tuple[Layers, dict[str, Any]]] = [
    ((5, 2, 2), {}),
    ((5, 2, 2), {"bouc_wen": "plastic"}),
    ((5, 2, 2), {"top_rotation": True}),
    ((5, 2, 2), PLANAR),
    ((5, 2, 2), PLANAR | MASSLESS),
    ((5, 2, 2), {"friction": "velocity"}),
    ((5, 2, 2), PLANAR | {"friction": "pvt"}),
    ((5, 2, 2), {"friction": "pvt", "bouc_wen": "plastic"}),
    ((5, 2, 2), {"friction": "custom", "friction_law": BOUNDED}),
    ((5, 2, 2), PLANAR | {"friction": "custom", "friction_law": FADING}),
    ((5, 2, 2), PLANAR | {"uplift": True}),
    ((5, 2, 2), {"uplift": True}),
    ((3, 1, 1), {"spin": "patch", "bouc_wen": "isotropic"}),
    ((3, 1, 1), MASSLESS),
    ((2, 1, 0), {}),
    ((12, 6, 5), PLANAR | {"bouc_wen": "plastic"}),
    ((13, 6, 6), {}),
    ((16, 8, 7), PLANAR | MASSLESS),
]
SELECTED: list[tuple[Layers, dict[str, Any]]] = [((3, 1, 1), {}), ((5, 2, 2), {}), ((5, 2, 2), {"bouc_wen": "plastic"})]
SHARE_SELECTED = 0.2  # scenes whose effects are selected automatically
SHARE_TOML = 0.25  # scenes that go through TOML text with units
LONGEST = 8.0  # [s]
ATTEMPTS = 50
SHARE_HEATED = 0.3  # of the scenes whose effects are selected, with parameters of a law of pressure and temperature
UNITS = {
    "radius": (1e3, "mm"),
    "capacity": (1e2, "cm"),
    "height": (1e3, "mm"),
    "yield_displacement": (1e6, "um"),
    "axial_load": (1e-3, "kN"),
    "stiffness": (1e-6, "kN/mm"),
    "rotational_stiffness": (1e-3, "kN*m/rad"),
    "rim_stiffness": (1e-6, "MN/m"),
    "mass": (1e3, "g"),
    "duration": (1e3, "ms"),
    "output_step": (1e3, "ms"),
}


def case(seed: int, number: int) -> Case:
    """Scene `number` of a seed; the same on every machine. What constructors refuse is drawn again."""
    draw = Draw(seed, number)
    for _ in range(ATTEMPTS):
        try:
            return Case(number, through_toml(a_scene(draw, f"combined-{seed}-{number}"), draw))
        except InputError as error:
            if "\n" in str(error):
                raise AssertionError(f"{number}: more than one line: {error}") from error
    raise AssertionError(f"{number}: {ATTEMPTS} refusals in a row")


def a_scene(draw: Draw, name: str) -> Scene:
    selected = draw.chance(SHARE_SELECTED)
    layout, words = draw.one(SELECTED if selected else COMBINED)
    effects = Effects(**words)
    law = "pvt" if selected and draw.chance(SHARE_HEATED) else effects.friction
    bearing = a_bearing(draw, layout, law, (0.35, 0.8) if layout[0] < 10 else (0.8, 0.95))
    bearing = lawful(draw, bearing, effects)
    axis = draw.one([0.0, draw.flat(0.0, 3.1)])
    plane = axis if effects.dimension == "planar" or draw.chance(0.2) else None
    top = a_top(draw, layout, plane)
    motion = combined_motion(draw, bearing, effects, plane)
    rotation = a_rotation(draw, motion.duration) if effects.top_rotation else None
    return Scene(
        bearing,
        motion,
        top,
        Auto(**words) if selected else effects,
        a_solver(draw),
        duration=draw.one([None, draw.flat(0.3, 1.0) * motion.duration]),
        initial_state=a_state(draw, bearing, top, plane) if draw.chance(0.3) else None,
        output_step=draw.one([None, None, 0.01, 0.0137]),
        stop=draw.one([None] * 6 + [Stop(displacement=0.5 * reach(bearing)), Stop(all_rims=True)]),
        load=a_load(draw, load_of(top), motion.duration, plane) if draw.chance(0.7) else None,
        top_rotation=rotation,
        name=name,
    )


def lawful(draw: Draw, bearing: Bearing, effects: Effects) -> Bearing:
    """The bearing with contact damping of any size, and with the parameters of a custom law."""
    values: dict[str, Any] = {"contact_damping": draw.one([1e-4, 1e-4, 0.0, 1e-3, 1e-2])}
    if effects.friction_law == BOUNDED:
        values |= {"c1": draw.flat(0.0, 0.99), "c2": draw.decades((1.0, 1e3)), "c3": draw.decades((1e3, 1e7))}
    if effects.friction_law == FADING:
        values |= {"c1": draw.flat(0.0, 0.6)}
    return bearing.replace(**values)


def a_top(draw: Draw, layout: Layers, plane: float | None) -> Top:
    """A rig, a mass or prescribed force and moment; some on a vertical spring."""
    load = draw.decades((1e4, 5e6), (10.0, 1e7))
    held = 0.0 if layout[0] == 2 else draw.decades((10.0, 100.0)) * load
    restraint = (held, draw.one([0.0, 0.01 * held]))
    spring = draw.decades((20.0, 2e3)) * load
    kind = draw.one(["rig", "rig", "mass", "load"])
    if kind == "rig" or layout[0] == 2:
        damping = draw.one([0.0, 0.05 * load])
        upright = (spring, 0.01 * spring) if draw.chance(0.2) else (0.0, 0.0)
        return Top.rig(load, draw.decades((30.0, 1e4)) * load, damping, *restraint, *upright)
    if kind == "mass":
        mass = load / 9.8
        upright = {"vertical_stiffness": spring, "vertical_damping": 0.01 * spring} if draw.chance(0.4) else {}
        return Top.mass(mass, draw.flat(0.05, 1.0) * mass, draw.flat(0.0, 1.0), *restraint, **upright)
    azimuth, moment = draw.flat(0.0, 6.28) if plane is None else plane, draw.flat(-2e-3, 2e-3) * load
    return Top.prescribed((0.0, 0.0, -load), (-np.sin(azimuth) * moment, np.cos(azimuth) * moment, 0.0))


# ---- histories


def combined_motion(draw: Draw, bearing: Bearing, effects: Effects, plane: float | None) -> Motion:
    """One motion or the sum of two, some held at their end, some with a rocking base."""
    motion = one_motion(draw, bearing, effects, plane)
    if draw.chance(0.3):
        other = one_motion(draw, bearing, effects, plane)
        lasts = 0.1 + max(motion.duration, other.duration)
        motion = motion.held(lasts - motion.duration) + other.held(lasts - other.duration)
    if draw.chance(0.2):
        motion = motion.held(draw.flat(0.05, 1.0))
    if draw.chance(0.15) and effects.dimension == "spatial":
        motion = motion.rocking(a_rotation(draw, motion.duration))
    return motion


def one_motion(draw: Draw, bearing: Bearing, effects: Effects, plane: float | None) -> Motion:
    kind = draw.one(["simple", "pieces", "uneven", "acceleration", "velocity", "record"])
    azimuth = draw.flat(0.0, 6.28) if plane is None else plane
    size = reach(bearing) * (draw.flat(1.0, 1.4) if draw.chance(0.1) else draw.flat(0.02, 0.8))
    if kind == "simple":
        planar = replace(effects, dimension="planar") if plane is not None else effects
        motion = a_motion(draw, bearing, planar)
        turn = motion.plane() if plane is not None else None
        motion = motion if plane is None else motion.rotated(plane - (turn or 0.0))
        if motion.duration > LONGEST:
            raise InputError(f"motion: {motion.duration:g} s is longer than the campaign draws")
        return motion
    if kind == "pieces":
        return pulses(draw, size, azimuth)
    given = noise(draw, size, azimuth, plane is not None, 0.3)
    t = np.arange(0.0, given.duration, 0.01) if kind != "uneven" else uneven(draw, given.duration)
    if kind == "uneven":
        return Motion.from_arrays(t, given.displacement(t))
    if kind == "velocity":
        return Motion.from_velocity(t, given.velocity(t))
    acceleration = given.acceleration(t)
    if kind == "acceleration":
        return Motion.from_acceleration(t, acceleration)
    error = draw.rng.normal(size=2) * 0.02 * np.abs(acceleration).max()  # offset and drift of the instrument
    along = np.array([np.cos(azimuth), np.sin(azimuth), 0.0]) if plane is not None else draw.rng.normal(size=3)
    drifted = acceleration + np.outer(error[0] + error[1] * t / t[-1], along)
    return Motion.from_record(Record("drifting", 0.01, drifted), taper=0.2, corner=draw.one([0.05, 0.5]))


def pulses(draw: Draw, size: float, azimuth: float) -> Motion:
    """Rest, a quintic step there and back of any duration, and rest: pieces of a hundredth to a hundred of the others."""
    width, wait = draw.decades((0.3, 2.0)), draw.decades((0.05, 3.0))
    size = min(size, 1.0 * width**2)  # 0.6 g at most
    knots = np.cumsum([0.0, wait, width, draw.decades((0.01, 1.0)), width, draw.flat(0.1, 1.0)])
    rise = np.array([0.0, 0.0, 0.0, 10 / width**3, -15 / width**4, 6 / width**5]) * size
    along = np.zeros((5, 6))
    along[1], along[2, 0], along[3] = rise, size, -rise
    along[3, 0] = size
    pieces = np.zeros((5, 6, 6))
    pieces[:, 0], pieces[:, 1] = np.cos(azimuth) * along, np.sin(azimuth) * along
    return Motion(knots, pieces)


def uneven(draw: Draw, duration: float) -> Any:
    """Times whose distances differ by up to a hundred."""
    steps = np.exp(draw.rng.uniform(np.log(2e-3), np.log(0.1), size=2000))
    t = np.concatenate([[0.0], np.cumsum(steps)])
    return t[t < duration]


def a_load(draw: Draw, size: float, duration: float, plane: float | None) -> Load:
    """A sum of one to three loads, of up to a quarter of the axial load each."""
    total = one_load(draw, size, duration, plane)
    for _ in range(draw.one([0, 1, 2])):
        total = total + one_load(draw, size, duration, plane)
    return total


def one_load(draw: Draw, size: float, duration: float, plane: float | None) -> Load:
    azimuth = draw.flat(0.0, 6.28) if plane is None else plane
    along, across = np.array([np.cos(azimuth), np.sin(azimuth)]), np.array([-np.sin(azimuth), np.cos(azimuth)])
    force = size * np.array([*(draw.flat(-0.02, 0.02) * along), draw.flat(-0.25, 0.25)])
    moment = size * np.array([*(draw.flat(-2e-3, 2e-3) * across), 0.0])
    kind = draw.one(["constant", "ramp", "harmonic", "samples", "jumps", "pulse", "pieces"])
    if kind == "constant":
        return Load.constant(force, moment)
    if kind == "ramp":
        return Load.ramp(force, moment, duration=draw.flat(0.05, 1.2) * duration)
    if kind == "harmonic":
        frequency = draw.decades((0.2, 10.0))
        return Load.harmonic(force, moment, frequency=frequency, cycles=draw.flat(0.5, 1.0) * duration * frequency)
    if kind == "pieces":
        knots = np.cumsum([0.0, *np.exp(draw.rng.uniform(np.log(0.01), np.log(0.5 * duration), size=3))])
        pieces = draw.rng.uniform(-1, 1, size=(3, 1, 6)) / np.diff(knots)[:, None, None] ** np.arange(6) / 3
        return Load.of(knots, pieces * np.concatenate([force, moment])[:, None])
    time, share = {
        "samples": (uneven(draw, duration), None),
        "jumps": (np.array([0.0, 0.3, 0.3, 0.8, 0.8]) * duration, [0.0, 0.0, 1.0, 1.0, -0.5]),  # the last at the end
        "pulse": (np.array([0.0, 0.5, 0.501, 0.502]) * duration, [0.0, 0.0, 1.0, 0.0]),
    }[kind]
    values = draw.rng.uniform(-1, 1, size=len(time)) if share is None else np.array(share)
    return Load.from_arrays(time, np.outer(values, force), np.outer(values, moment))


def a_rotation(draw: Draw, duration: float) -> Rotation:
    """A small tilt: constant, growing, swinging or sampled, or a sum."""
    psi, theta = draw.flat(-0.01, 0.01), draw.flat(-0.01, 0.01)
    kinds = [
        Rotation.constant(psi, theta),
        Rotation.ramp(psi, theta, duration=draw.flat(0.2, 0.9) * duration),
        Rotation.harmonic(psi, theta, frequency=1.0, cycles=1.0, lead_in=0.2),
        Rotation.from_arrays(np.linspace(0, 0.9 * duration, 6), draw.rng.uniform(-0.005, 0.005, size=(6, 2))),
    ]
    return draw.one(kinds) + draw.one(kinds) if draw.chance(0.3) else draw.one(kinds)


def a_solver(draw: Draw) -> Solver:
    """Both implicit methods, some with a longest or a first step."""
    return Solver(
        draw.one(["implicit"] * 5 + ["esdirk4"]),
        draw.decades((1e-5, 1e-3)),
        max_step=draw.decades((0.01, 1.0)) if draw.chance(0.1) else None,
        first_step=draw.decades((1e-7, 0.1)) if draw.chance(0.1) else None,
        max_steps=100_000,
    )


def a_state(draw: Draw, bearing: Bearing, top: Top, plane: float | None) -> InitialState:
    """A displaced and partly sheared start, some of them moving; nearly centred under a rig, whose springs would throw it."""
    most, rate = 0.3, draw.decades((1e-3, 0.3)) if draw.chance(0.3) else 0.0
    if isinstance(top, RigTop):  # springs of about the axial load
        most *= min(1.0, top.axial_load / (top.stiffness * reach(bearing)))
    share = [most * s.capacity / s.radius * draw.flat(-1, 1) for s in bearing.surfaces]
    q = [(0.0, x, 0.0) if plane is not None else (x * draw.flat(-1, 1), x, 0.0) for x in share]
    v = [(0.0 if plane is not None else rate * draw.flat(-1, 1), rate * draw.flat(-1, 1), 0.0) for _ in share]
    h = [(draw.flat(-0.6, 0.6), 0.0 if plane is not None else draw.flat(-0.6, 0.6)) for _ in share]
    return InitialState(q, v, h)


# ---- text


def through_toml(scene: Scene, draw: Draw) -> Scene:
    """The scene itself, or one read from its text with units."""
    if not draw.chance(SHARE_TOML):
        return scene
    return scene_from_table(with_units(tomllib.loads(scene_text(scene))))


def with_units(table: Any) -> Any:
    """The table with numbers that have a unit of their own."""
    if isinstance(table, list):
        return [with_units(item) for item in table]
    if not isinstance(table, dict):
        return table
    found = {}
    for key, value in table.items():
        factor, unit = UNITS.get(key, (0.0, ""))
        scaled = unit and isinstance(value, float)
        found[key] = f"{factor * value!r} {unit}" if scaled else with_units(value)
    return found
