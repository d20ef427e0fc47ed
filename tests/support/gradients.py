"""Scenes whose runs are differentiated, and differences of runs with other values of a parameter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from msfp_gen import Effects, Load, Motion, Scene, Top, load_scene
from msfp_gen.scene.effect_selection import quasistatic
from msfp_gen.scene.parameters import Parameter

from . import Array, scene_of

DAMPED = {"contact_damping": 1e-3}


def single(hysteresis: str = "report") -> Scene:
    """A single pendulum without masses and dampers in the plane, under two cycles: its steps are quasi-static."""
    scene, motion = load_scene("single-push"), Motion.harmonic(0.1, 0.5, cycles=2.0)
    effects = Effects(dimension="planar", sliders="massless", bouc_wen=hysteresis)
    bearing = scene.bearing.replace(rim_damping=0.0, mass=1e-3, inertia=1e-3)
    scene = replace(scene, bearing=bearing, top=replace(scene.top, damping=0.0, stiffness=1e9))
    scene = replace(
        scene, motion=motion, duration=None, stop=None, motion_table=None, output_step=None, effects=effects
    )
    assert quasistatic(scene, effects)
    return scene


def double() -> Scene:
    """A double pendulum with friction that depends on velocity below a mass on a vertical spring, under a load."""
    scene = load_scene("double-push")
    bearing = scene.bearing.replace(friction_slow=[0.02, 0.03], velocity_rate=20.0, **DAMPED)
    top = Top.mass(2e4, (3e3, 5e3), 0.7, rotational_stiffness=1e6, vertical_stiffness=5e7, vertical_damping=2e4)
    motion, load = Motion.harmonic(0.05, 0.5, cycles=2.0), Load.harmonic((500, 0, 300), frequency=0.7, cycles=2.0)
    effects = Effects(friction="velocity", rims=False)
    scene = replace(scene, bearing=bearing, top=top, motion=motion, load=load, effects=effects, stop=None)
    return replace(scene, duration=None, motion_table=None, output_step=None)


def heated(patch_radius: float) -> Scene:
    """The double pendulum, with friction that depends on pressure, velocity and temperature: its surfaces warm up."""
    scene = double()
    bearing = scene.bearing.replace(
        friction_slow=None,
        reference_pressure=50e6 * (0.03 / patch_radius) ** 2,
        velocity_rate=100.0,
        patch_radius=patch_radius,
        conductivity=18.0 * (0.03 / patch_radius) ** 2,
    )
    return replace(scene, bearing=bearing, effects=Effects(friction="pvt", rims=False))


def triple(duration: float = 6.0, **solver: Any) -> Scene:
    """The triple pendulum of PEER 2017/07 with damped contacts, at the start of test 2."""
    scene = scene_of("fenz-test2", duration=duration)
    scene = replace(scene, bearing=scene.bearing.replace(**DAMPED), output_step=None)
    return replace(scene, solver=replace(scene.solver, **solver))


STEPS = (1, 2, 4)
SCALE = {"q": 1e-2, "v": 0.1, "h": 0.5}
"""Sizes of the numbers of an initial state: those of a parameter that is zero."""


def step_of(parameter: Parameter, size: float) -> float:
    """The step of a difference: `size` times the value, or the natural size of a parameter that is zero."""
    return size * (abs(parameter.value) or SCALE.get(parameter.field, 1.0))


def values_around(parameter: Parameter, step: float) -> list[float]:
    """Values for `derivative`."""
    return [parameter.value + sign * k * step for k in STEPS for sign in (1, -1)]


def derivative(values: Sequence[Array], step: float) -> tuple[Array, Array]:
    """The derivative of sixth order from values at 1, -1, 2, -2, 4, -4 steps (Richardson), and its uncertainty.

    The uncertainty is the difference of two derivatives of fourth order, from small and from large steps: truncation
    and noise of the runs.
    """
    pairs = zip(STEPS, values[::2], values[1::2], strict=True)
    one, two, four = ((above - below) / (2 * k * step) for k, above, below in pairs)
    fine, coarse = one + (one - two) / 3, two + (two - four) / 3
    return fine + (fine - coarse) / 15, abs(fine - coarse)


def lifting(acceleration: float, duration: float = 0.25, **effects: Any) -> Scene:
    """The double pendulum above a base that heaves at 4 Hz and moves in two directions.

    acceleration: vertical, over that of gravity; surfaces open from about 0.19 on, and land at strong damping.
    """
    scene = double()
    bearing = scene.bearing.replace(friction_slow=None, velocity_rate=None, seat_damping=100.0)
    time = np.linspace(0.0, duration, round(400 * duration) + 1)
    heave = acceleration * scene.bearing.gravity / (8 * np.pi) ** 2 * np.sin(8 * np.pi * time) ** 3
    across = 0.02 * np.sin(2 * np.pi * time), 0.01 * np.sin(1.5 * np.pi * time) ** 2
    if effects.get("dimension") == "planar":
        across = 0.0 * time, 0.0 * time
    motion = Motion.from_arrays(time, np.column_stack([*across, heave]))
    chosen = Effects(**({"rims": False, "uplift": True} | effects))
    return replace(scene, bearing=bearing, effects=chosen, motion=motion, load=None, duration=duration)
