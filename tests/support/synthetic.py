"""Results made up for tests of what looks at results: rows with known answers, no solver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from msfp_gen.motions.motion import Motion
from msfp_gen.results.history import ENERGY, Counters, Event, History
from msfp_gen.results.result import Result
from msfp_gen.scene.bearing import Bearing, Body, Surface
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.top import Top
from msfp_gen.specification.layout import Effects, Layout

CAPACITIES = (0.065, 0.019, 0.019, 0.065)
LOAD = 112e3


def history(
    u: Any, force: Any, sliding: Any, capacities: Sequence[float] = CAPACITIES, duration: float = 10.0
) -> History:
    """Rows with displacement `u` and `force` (T, 3) and `sliding` (T, NB); the rest consistent in shape."""
    rows, surfaces = np.shape(sliding)
    body, axis, surface = np.zeros((rows, surfaces, 3)), np.zeros((rows, 3)), np.zeros((rows, surfaces))
    pair = np.zeros((rows, surfaces, 2))
    energy = {name: np.zeros(rows) for name in ENERGY}
    energy["input"] = np.linspace(0, 2000.0, rows)
    energy["friction_dissipated"] = 0.9 * energy["input"]
    energy["restraint"] = 0.0995 * energy["input"]
    energy["numerical"] = energy["input"] - energy["friction_dissipated"] - energy["restraint"]
    return History(
        time=np.linspace(0, duration, rows),
        tilt_angles=body,
        tilt_rates=body,
        tilt_accelerations=body,
        friction_state=pair + np.array([0.25, -0.5]),
        normal_force=surface + LOAD,
        contact_angles=pair,
        sliding=np.asarray(sliding),
        gap=np.asarray(capacities) - sliding,
        rim_force=surface,
        separation=body,
        lift=surface,
        interface_force=body,
        slip_velocity=pair,
        base_displacement=axis,
        top_displacement=axis,
        displacement=np.asarray(u),
        top_force=np.asarray(force),
        top_moment=axis,
        energy=energy,
    )


def scene(name: str = "made-up", capacities: Sequence[float] = CAPACITIES, kind: str = "harmonic") -> Scene:
    """A scene whose motion is of a `kind` and whose stack has surfaces of these capacities, all concave up."""
    count = len(capacities)
    motion = Motion.ramp(0.1, 2.0) if kind == "ramp" else Motion.harmonic(0.1, 0.1)
    surfaces = [Surface(radius=10.0, capacity=c, friction=0.05, yield_displacement=1e-4) for c in capacities]
    bodies = [Body(height=0.02, centroid=0.01, mass=1.0, inertia=1e-3)] * count
    bearing = Bearing(Layout(count + 1, count, 0), base_height=0.02, surfaces=surfaces, bodies=bodies)
    top = Top.rig(axial_load=LOAD, stiffness=1e8)
    return Scene(bearing, motion, top, Effects(rims=False), name=name)


def contact(rows: History, surface: int) -> Event:
    """The event of the first row in which the gap of `surface` is closed."""
    row = int(np.flatnonzero(rows.gap[:, surface - 1] <= 0)[0])
    return Event(float(rows.time[row]), surface, "rim_contact", rows.displacement[row], rows.top_force[row])


def ramp(stop2: float = 0.002, stop3: float = 0.048, rim1: float = 0.088, rim4: float = 0.134) -> Result:
    """A monotonic run along E1 to 145 mm with the five stages of a triple pendulum at given displacements [m]."""
    u1 = np.linspace(0, 0.145, 1451)
    stages = np.searchsorted([stop2, stop3, rim1, rim4], u1, side="right")
    rates = np.array(
        [[0, 0.5, 0.5, 0], [0.5, 0.01, 0.5, 0], [0.5, 0.01, 0.01, 0.5], [0, 0.3, 0.01, 0.7], [0, 0.5, 0.5, 0]]
    )
    steps = np.diff(u1, prepend=0.0)[:, None] * rates[stages]
    sliding = np.cumsum(steps, axis=0)
    vector = np.stack([u1, 0 * u1, 0 * u1], axis=1)
    force = np.array([2e5, 0, 0]) * vector + [3e3, 0, LOAD]
    capacities = tuple(float(np.interp(u, u1, sliding[:, i])) for u, i in ((rim1, 0), (1, 1), (1, 2), (rim4, 3)))
    capacities = (capacities[0], 0.2, 0.2, capacities[3])
    rows = history(vector, force, sliding, capacities)
    return Result(scene("ramp", capacities, "ramp"), rows, (contact(rows, 1), contact(rows, 4)), Counters(steps=1450))


def loops(both: bool = False, name: str = "fenz-test5") -> Result:
    """Two cycles with rounded bilinear loops, along E1 or along both axes, with rims 1 and 4 met."""
    t = np.linspace(0, 20, 2001)
    grow = np.minimum(t / 5, 1)
    u = np.zeros((len(t), 3))
    u[:, 0] = 0.14 * grow * np.sin(2 * np.pi * t / 10)
    u[:, 1] = 0.1 * grow * np.sin(4 * np.pi * t / 10) if both else 0
    speed = np.gradient(u, t, axis=0)
    force = 1.9e5 * u + 9e3 * np.tanh(speed / 0.01) + np.array([0, 0, LOAD])
    radial = np.hypot(u[:, 0], u[:, 1])
    shares = (0.5, 0.1, 0.1, 0.5)
    sliding = np.stack([np.minimum(radial * r, c + 1e-4) for r, c in zip(shares, CAPACITIES, strict=True)], 1)
    rows = history(u, force, sliding, duration=20.0)
    met = tuple(contact(rows, surface) for surface in (1, 4))
    counters = Counters(steps=2000, newton_iterations=9000, wall_time=0.25)
    return Result(replace(scene(name), duration=20.0), rows, met, counters, provenance={"version": "0"})


def opened(path: Path, group: str | None = None) -> xr.Dataset:
    """The dataset in a netCDF file, as any other program reads it."""
    return xr.load_dataset(path, engine="h5netcdf", group=group)
