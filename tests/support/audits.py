"""Sound results and results spoiled in named ways, for tests of the audit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from msfp_gen import Bearing, Effects, Load, Motion, Scene, Solver, Top, presets, simulate
from msfp_gen.auditing import Histories
from msfp_gen.auditing.histories import histories_of

WEIGHT = 2e6  # on the bearing of examples/single.toml [N]
STEP = 0.01  # distance of rows [s]
PLANE, LEVEL, SPACE = (1.0, 0.0, 1.0), (1.0, 0.0, 0.0), (1.0, 1.0, 1.0)  # factors of the components of the motion


def ground(scale: float, axes: tuple[float, float, float]) -> Motion:
    """Twenty seconds of ground motion with a smooth start, of some periods along each axis."""
    times = np.arange(0.0, 20.0 + 5e-3, 0.01)
    rise = np.minimum(times / 2.0, 1.0)
    envelope = rise**2 * (3 - 2 * rise) * np.minimum(1.0, (20.0 - times) / 4.0)
    waves = [
        2.0 * np.sin(2 * np.pi * 0.61 * times) + 1.6 * np.sin(2 * np.pi * 1.13 * times),
        1.2 * np.sin(2 * np.pi * 0.53 * times) + 0.9 * np.sin(2 * np.pi * 0.91 * times),
        1.2 * np.sin(2 * np.pi * 2.3 * times) + 1.0 * np.sin(2 * np.pi * 3.7 * times),
    ]
    return Motion.from_acceleration(times, scale * envelope[:, None] * np.array(waves).T * np.array(axes))


def shaken(
    *,
    law: str = "constant",
    scale: float = 1.0,
    axes: tuple[float, float, float] = PLANE,
    inertia: float = 1.0,
    step: float = STEP,
    bearing: str = "single-articulated-fp",
    uplift: bool = False,
    **changes: Any,
) -> Scene:
    """A mass on one bearing, an articulated pendulum unless a preset is named, under `ground`.

    axes: factors of the components. inertia: of the mass, which keeps its weight. changes: of the bearing, or functions
    of its surfaces that make them.
    """
    given = presets.bearing(bearing)
    if law in ("pv", "pvt"):
        given = given.replace(reference_pressure=44.2e6, velocity_rate=100.0)
    given = given.replace(**{name: value(given) if callable(value) else value for name, value in changes.items()})
    mass = WEIGHT / given.gravity
    damper = 0.2 * np.sqrt(600.0 * WEIGHT * mass)
    top = Top.mass(inertia * mass, 1e4, 0.0, 1e10, 1e6, 600.0 * WEIGHT, damper)
    load = Load.constant((0.0, 0.0, (inertia - 1.0) * WEIGHT)) if inertia != 1.0 else None
    # In a plane, these are the models of examples/single.toml and examples/heating.toml.
    dimension: Any = "spatial" if axes[1] else "planar"
    effects = Effects(dimension=dimension, friction=law, uplift=uplift)
    motion, solver = ground(scale, axes), Solver(rtol=1e-4)
    return Scene(given, motion, top, effects, solver, output_step=step, load=load, name="shaken")


@cache
def run_of(**choices: Any) -> Histories:
    """Histories of a shaken mass."""
    return histories_of(simulate(shaken(**choices)))


def with_columns(data: Histories, **columns: np.ndarray) -> Histories:
    """Histories with some columns replaced."""
    return replace(data, columns={**data.columns, **columns})


def with_force(data: Histories, factor: np.ndarray | float, added: np.ndarray | float = 0.0) -> Histories:
    """Histories with the horizontal force multiplied, (T,), and a part added, (T, 2) [N]."""
    force = data.force * np.reshape(factor, (-1, 1)) + added
    return with_columns(data, force_1=force[:, 0], force_2=force[:, 1])


def rows_of(data: Histories, step: int) -> Histories:
    """Every so many rows."""
    return replace(data, columns={name: values[::step] for name, values in data.columns.items()})


def straightened(data: Histories, step: int) -> Histories:
    """Every so many rows, with straight lines between them at the old times."""
    coarse = rows_of(data, step)
    time = data.time[data.time <= coarse.time[-1]]
    return replace(data, columns={n: np.interp(time, coarse.time, v) for n, v in coarse.columns.items()})


def cut(data: Histories, name: str, share: float) -> Histories:
    """A column cut off at a share of its largest size."""
    values = data.columns[name]
    most = share * np.abs(values).max()
    return with_columns(data, **{name: np.clip(values, -most, most)})


def tensile(data: Histories) -> Histories:
    """The axial force of a bearing that holds the mass also when it pulls: five times the variation."""
    axial = data.at_rest + 5.0 * (data.axial - data.at_rest)
    return with_force(with_columns(data, axial=axial), axial / data.axial)


def uncoupled(data: Histories) -> Histories:
    """Friction and restoring force of the axial force at rest."""
    return with_force(data, data.at_rest / data.axial)


def damped(data: Histories, ratio: float = 0.05, radius: float = 2.19) -> Histories:
    """A share of the critical damping of the isolated mass, in the force of the bearing."""
    viscous = 2 * ratio * WEIGHT * np.sqrt(1 / 9.81 / radius)
    return with_force(data, 1.0, viscous * data.velocity)


def frictions(bearing: Bearing) -> list[float]:
    """Coefficients of the surfaces, as given."""
    return [surface.friction for surface in bearing.surfaces]


def other_radii(bearing: Bearing) -> list[float]:
    """The radii with those of the dishes, which are the largest, 23 % larger."""
    radii = [surface.radius for surface in bearing.surfaces]
    return [radius * (1.23 if radius == max(radii) else 1.0) for radius in radii]


class Kind(NamedTuple):
    """What is spoiled: choices of `shaken`, and the distance of its centres [m]."""

    choices: dict[str, Any]
    radius: float

    def run(self, **changes: Any) -> Histories:
        """Its histories."""
        return run_of(**self.choices, **changes)

    def scene(self, **changes: Any) -> Scene:
        """Its scene."""
        return shaken(**self.choices, **changes)


KINDS = {
    "single": Kind({}, 2.19),
    "double": Kind({"bearing": "double-fp"}, 4.2),
    "triple": Kind({"bearing": "building-tfp", "axes": SPACE}, 3.48),
}
# Name of a spoiled result -> histories, what the bearing is said to be, and the check that must name it.
SPOILED: dict[str, Callable[[Kind], tuple[Histories, Scene, str]]] = {
    "mass doubled": lambda kind: (replace(kind.run(inertia=2.0), mass=None), kind.scene(), "mass"),
    "heat off": lambda kind: (kind.run(law="pvt", temperature_ratio=1.0), kind.scene(law="pvt"), "heat"),
    "friction at the pivot": lambda kind: (
        kind.run(friction=frictions, friction_at="pivot"),
        kind.scene(),
        "friction",
    ),
    "sign turned": lambda kind: (with_force(kind.run(), -1.0), kind.scene(), "signs"),
    "clipped": lambda kind: (cut(kind.run(), "force_1", 0.8), kind.scene(), "clipped"),
    "resampled": lambda kind: (rows_of(kind.run(), 15), kind.scene(), "sampling"),
    "unit wrong": lambda kind: (
        kind.run().scaled({"displacement_1": 1e3, "displacement_2": 1e3}),
        kind.scene(),
        "units",
    ),
    "tension allowed": lambda kind: (tensile(kind.run()), kind.scene(), "tension"),
    "vertical coupling off": lambda kind: (uncoupled(kind.run()), kind.scene(), "coupling"),
    "damping of the structure": lambda kind: (damped(kind.run(), radius=kind.radius), kind.scene(), "damping"),
    "half the bearings": lambda kind: (
        with_columns(with_force(kind.run(), 0.5), axial=0.5 * kind.run().axial),
        kind.scene(),
        "weight",
    ),
    "other radius": lambda kind: (kind.run(radius=other_radii), kind.scene(), "radius"),
}
