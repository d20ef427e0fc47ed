"""Random scenes of practice for `auto.py`: bearings of every preset layout with other values, under rigs and masses.

Scene number i of a seed is always the same, on every machine.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path

import numpy as np

from msfp_gen import Auto, Bearing, Load, Motion, Scene, Solver, Top, presets
from msfp_gen.motions.records import bundled

sys.path.append(str(Path(__file__).resolve().parents[1] / "tools"))
from fuzz_scenes import GRAVITY, Draw, noise, reach

BEARINGS = (
    "single-fp",
    "single-articulated-fp",
    "double-fp",
    "double-articulated-fp",
    "fenz-tfp",
    "fenz-tfp",
    "becker-tfp",
    "prototype-tfp",
    "prototype-tfp",
    "quintuple-fp",
)
RECORDS = ("ridgecrest-2019-ci-ccc", "ridgecrest-2019-ci-clc")
FASTEST = 0.8  # peak velocity of a prescribed motion, about [m/s]
STRONGEST = 0.8 * GRAVITY  # its peak acceleration, about [m/s^2]
VARYING = 0.3  # share of the scenes under a rig whose axial load varies
LEAVING = 0.15  # share of the straight motions that leave their plane


@dataclass(frozen=True)
class Chosen:
    """What is drawn first, and decides the equations."""

    bearing: str
    law: str
    hysteresis: str


def chosen(draw: Draw) -> Chosen:
    """Bearing, friction law and hysteresis law."""
    law = draw.one(["constant"] * 6 + ["velocity"] * 2 + ["pv"] * 2)
    return Chosen(draw.one(BEARINGS), law, draw.one(["report", "plastic"]))


def a_bearing(draw: Draw, what: Chosen) -> Bearing:
    """A preset bearing with other radii, capacities, friction and masses, and the default contact damping.

    In half of them the inner surfaces keep equal friction: then only small forces decide how they share the motion.
    """
    given = presets.bearing(what.bearing)
    count, equal = len(given.surfaces), draw.chance(0.5)
    friction = [draw.decades((0.02, 0.12)) for _ in range(count)]
    if equal:
        inner = sorted(range(count), key=lambda j: given.surfaces[j].radius)[:2]
        for j in inner:
            friction[j] = friction[inner[0]]
    surfaces = [
        replace(
            surface,
            radius=surface.radius * draw.flat(1.0, 1.3),
            capacity=surface.capacity * draw.flat(0.7, 1.0),
            friction=mu,
            yield_displacement=draw.decades((1e-4, 1e-3)),
            contact_damping=1e-4,
            friction_slow=mu * draw.flat(0.4, 0.9) if what.law == "velocity" else None,
            velocity_rate=draw.decades((20.0, 100.0)) if what.law == "velocity" else None,
            reference_pressure=3e7 if what.law == "pv" else None,
        )
        for surface, mu in zip(given.surfaces, friction, strict=True)
    ]
    heavier = draw.decades((0.5, 2.0))
    bodies = [replace(b, mass=heavier * b.mass, inertia=tuple(heavier * j for j in b.moments)) for b in given.bodies]
    return given.replace(surfaces=surfaces, bodies=bodies)


def a_top(draw: Draw, what: Chosen, bearing: Bearing) -> Top:
    """A rig or a rigid mass. The load is some hundred to some thousand times the weight of the bearing."""
    weight = GRAVITY * sum(body.mass for body in bearing.bodies)
    load = draw.decades((200.0, 3000.0)) * weight
    damping = draw.one([0.0, 0.05 * load])
    if what.bearing == "single-fp":  # the plate is the slider: nothing may hold its tilt
        return Top.rig(load, 1e3 * load, damping)
    if draw.chance(0.6):
        return Top.rig(load, draw.decades((3e2, 3e3)) * load, damping, 10.0 * load, 0.2 * damping)
    return Top.mass(load / GRAVITY, 0.03 * load / GRAVITY, 0.5, 100.0 * load, 0.1 * load)


def a_motion(draw: Draw, bearing: Bearing, top: Top) -> Motion:
    """A line, an orbit, noise or a record; in a quarter of the rigs' motions beyond the capacity of the outer surfaces."""
    size = reach(bearing) * (draw.flat(1.0, 1.15) if draw.chance(0.25) else draw.flat(0.2, 0.8))
    azimuth = draw.one([0.0, 0.0, pi / 2, draw.flat(0.0, pi)])
    if top.kind == "mass" or draw.chance(0.15):
        return ground_motion(draw, bearing, azimuth)
    frequency = draw.decades((0.005, 1.0))
    frequency = min(frequency, FASTEST / (2 * pi * size), float(np.sqrt(STRONGEST / size)) / (2 * pi))
    kind = draw.one(["line", "line", "circle", "eight", "noise"])
    if kind == "circle":
        return Motion.circle(size, 2 * pi * frequency, cycles=1.5, lead_in=1.0 / frequency)
    if kind == "eight":
        return Motion.figure_eight(size, pi * frequency, cycles=1.5, lead_in=1.0 / frequency)
    if kind == "noise":
        return noise(draw, size, azimuth, draw.chance(0.5), 0.3)
    if draw.chance(LEAVING):
        return leaving(size, frequency)
    return Motion.harmonic(size, frequency, direction=azimuth, cycles=draw.one([1.25, 2.0]))


def leaving(size: float, frequency: float) -> Motion:
    """Three cycles along E1, of which the last is joined by motion along E2."""
    t = np.linspace(0.0, 4.0, 401)
    u = np.zeros((len(t), 3))
    u[:, 0] = size * np.sin(2 * pi * t) * np.sin(pi * t / 4) ** 2
    u[:, 1] = 0.5 * size * np.sin(pi * np.clip(t - 2.5, 0.0, None) / 1.5) ** 3
    return Motion.from_arrays(t / frequency, u)


def ground_motion(draw: Draw, bearing: Bearing, azimuth: float) -> Motion:
    """Noise in all directions, or the strongest 12 s of a record; the displacement is half of the reach at most."""
    if draw.chance(0.4):
        return noise(draw, reach(bearing) * draw.flat(0.15, 0.4), azimuth, draw.chance(0.3), 0.3)
    record = bundled(draw.one(RECORDS))
    motion = Motion.from_record(record, duration=12.0)
    moved = float(np.linalg.norm(motion.displacement(np.linspace(0.0, motion.duration, 400))[:, :2], axis=1).max())
    scale = min(1.0, draw.flat(0.2, 0.6) * reach(bearing) / moved)
    return Motion.from_record(record, duration=12.0, scale=scale).rotated(azimuth)


def a_load(draw: Draw, top: Top, duration: float) -> Load | None:
    """A harmonic axial load on top of that of a rig, in a share of the scenes; None without."""
    if top.kind != "rig" or not draw.chance(VARYING):
        return None
    size = draw.flat(0.1, 0.7) * top.axial_load  # type: ignore[attr-defined]
    cycles = draw.flat(1.5, 6.0)
    return Load.harmonic((0.0, 0.0, size), frequency=cycles / duration, cycles=cycles, lead_in=0.1 * duration)


def scene(seed: int, number: int) -> Scene:
    """Scene `number` of a seed, its effects left to `Auto`."""
    draw = Draw(seed, number)
    what = chosen(draw)
    bearing = a_bearing(draw, what)
    top = a_top(draw, what, bearing)
    motion = a_motion(draw, bearing, top)
    return Scene(
        bearing,
        motion,
        top,
        Auto(bouc_wen=what.hysteresis),
        Solver(),
        load=a_load(draw, top, motion.duration),
        name=f"{what.bearing} {number}",
    )


def slow_test(seed: int, number: int) -> Scene:
    """Test `number` of a seed: some cycles along a line at 2 to 200 mHz on a rig without dampers, constant friction."""
    draw = Draw(seed, number)
    what = replace(chosen(draw), law="constant")
    bearing = a_bearing(draw, what)
    held = draw.decades((3e2, 3e3))
    load = draw.decades((200.0, 3000.0)) * GRAVITY * sum(body.mass for body in bearing.bodies)
    top = Top.rig(load, held * load, rotational_stiffness=0.0 if what.bearing == "single-fp" else 10.0 * load)
    size = reach(bearing) * (draw.flat(1.0, 1.15) if draw.chance(0.25) else draw.flat(0.2, 0.8))
    motion = Motion.harmonic(size, draw.decades((0.002, 0.2)), cycles=draw.one([1.25, 2.0]))
    effects = Auto(bouc_wen=what.hysteresis)
    history = a_load(draw, top, motion.duration)
    return Scene(bearing, motion, top, effects, Solver(), load=history, name=f"{what.bearing}, slow {number}")


def demanding(seed: int, number: int) -> Scene:
    """Scene `number` of a seed that needs most of what `Auto` may leave out: surfaces that heat at earthquake velocities,
    rims, varying loads, sprung masses that lift off in the course of the run, heavy sliders.
    """
    draw = Draw(seed, number)
    law = draw.one(["pv"] * 3 + ["velocity", "constant"])
    what = Chosen(draw.one(["single-articulated-fp", "double-fp", "fenz-tfp"]), law, "report")
    bearing = a_bearing(draw, what)
    bearing = bearing.replace(mass=[draw.decades((1.0, 10.0)) * body.mass for body in bearing.bodies])
    load = draw.decades((200.0, 3000.0)) * GRAVITY * sum(body.mass for body in bearing.bodies)
    size = reach(bearing) * draw.one([0.2, 0.5, 0.8, 1.1])
    frequency = min(draw.decades((0.1, 1.0)), FASTEST / (2 * pi * size), float(np.sqrt(STRONGEST / size)) / (2 * pi))
    motion = Motion.harmonic(size, frequency, direction=draw.one([0.0, 0.7]), cycles=2.0)
    if draw.chance(0.3):
        motion = Motion.circle(size, 2 * pi * frequency, cycles=1.5, lead_in=1.0 / frequency)
    effects = Auto(bouc_wen=what.hysteresis)
    name = f"{what.bearing}, demanding {number}"
    if draw.chance(0.5):
        top: Top = Top.rig(load, 1e3 * load, 0.05 * load, 10.0 * load, 0.01 * load)
        return Scene(bearing, motion, top, effects, load=a_load(draw, top, motion.duration), name=name)
    mass, rate = load / GRAVITY, 2 * pi * draw.one([5.0, 10.0])
    top = Top.mass(mass, 0.03 * mass, 0.5, 100.0 * load, 0.1 * load, mass * rate**2, 0.1 * mass * rate)
    if draw.chance(0.6):
        motion += a_jolt(draw, motion.duration, rate)
    return Scene(bearing, motion, top, effects, name=name)


def a_jolt(draw: Draw, duration: float, rate: float) -> Motion:
    """Three vertical cycles of the base at the rate [rad/s] of a sprung mass, which answers with several times their
    acceleration, so that surfaces may open although the motion itself does not announce it.
    """
    time = np.linspace(0.0, duration, 1 + int(20 * rate * duration / (2 * pi)))
    phase = rate * (time - draw.flat(0.3, 0.6) * duration)
    burst = np.where((phase > 0) & (phase < 6 * pi), np.sin(phase) * np.sin(phase / 6) ** 2, 0.0)
    acceleration = draw.flat(0.1, 0.5) * GRAVITY
    return Motion.from_arrays(time, np.outer(acceleration / rate**2 * burst, [0.0, 0.0, 1.0]))


def on_edge(seed: int, number: int) -> Scene:
    """Test `number` of a seed whose sliders have narrow faces, a hundredth to a quarter as wide, so that most of them
    stand on their edges. A rig holds the plate level, also that of a single pendulum, which has its whole face.
    """
    draw = Draw(seed, number)
    what = Chosen(ORDER[number % len(ORDER)], "constant", ("report", "plastic")[number % 2])
    bearing, share = a_bearing(draw, what), draw.decades((0.01, 0.25))
    share = 1.0 if what.bearing == "single-fp" else share
    bearing = bearing.replace(bodies=[replace(body, rim_radius=share * body.rim_radius) for body in bearing.bodies])
    load = draw.decades((200.0, 3000.0)) * GRAVITY * sum(body.mass for body in bearing.bodies)
    size = (0.04 if what.bearing == "single-fp" else reach(bearing)) * draw.flat(0.3, 0.7)
    frequency = min(draw.decades((0.02, 0.3)), FASTEST / (2 * pi * size), float(np.sqrt(STRONGEST / size)) / (2 * pi))
    top = Top.rig(load, 1e3 * load, 0.05 * load, 100.0 * load, 0.5 * load)
    motion = Motion.harmonic(size, frequency, cycles=1.25)
    return Scene(
        bearing, motion, top, Auto(bouc_wen=what.hysteresis, rims=True), name=f"{what.bearing}, on edge {number}"
    )


ORDER = tuple(dict.fromkeys(BEARINGS))  # eight kinds of bearing
DRIVES = ("mass, harmonic", "mass, noise", "mass, eight", "rig, line", "rig, circle")


def campaign(seed: int, number: int) -> Scene:
    """Scene `number` of a seed, of `len(ORDER) * len(DRIVES)`: every kind of bearing with every drive, effects by `Auto`.

    Masses are on vertical springs of 10 to 25 Hz; they shake from 5 to 80 % of the reach, so some hardly slide.
    """
    draw, kind = Draw(seed, number), number % len(ORDER)
    drive = DRIVES[number // len(ORDER) % len(DRIVES)]
    what = Chosen(ORDER[kind], "constant", ("report", "plastic")[kind % 2])
    bearing = a_bearing(draw, what)
    load = draw.decades((200.0, 3000.0)) * GRAVITY * sum(body.mass for body in bearing.bodies)
    size = reach(bearing) * draw.decades((0.05, 0.8))
    frequency = min(draw.decades((0.1, 1.0)), FASTEST / (2 * pi * size), float(np.sqrt(STRONGEST / size)) / (2 * pi))
    motion = {
        "eight": lambda: Motion.figure_eight(size, pi * frequency, cycles=1.5, lead_in=1.0 / frequency),
        "circle": lambda: Motion.circle(size, 2 * pi * frequency, cycles=1.5, lead_in=1.0 / frequency),
        "noise": lambda: noise(draw, size, 0.0, draw.chance(0.5), 0.3),
    }.get(drive.split(", ")[1], lambda: Motion.harmonic(size, frequency, cycles=2.0))()
    mass, rate = load / GRAVITY, 2 * pi * draw.decades((10.0, 25.0))
    top: Top = Top.mass(mass, 0.3 * mass, 0.4, 10.0 * load, 0.05 * load, mass * rate**2, 0.1 * mass * rate)
    if drive.startswith("rig"):
        held = 0.0 if what.bearing == "single-fp" else 10.0 * load  # its plate is the slider
        top = Top.rig(load, 1e3 * load, 0.05 * load, held, 0.01 * held)
    return Scene(bearing, motion, top, Auto(bouc_wen=what.hysteresis), name=f"{what.bearing}, {drive}")


KINDS = (scene, slow_test)
