"""Random scenes that an engineer would call sensible: what the properties draw from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from hypothesis import strategies as st

from msfp_gen import Bearing, Effects, Layout, Motion, Scene, Solver, Top
from support.stacks import a_body, a_surface, nested_radii

LAYOUTS = [(2, 1, 0), (3, 1, 1), (5, 2, 2)]


def between(low: float, high: float) -> st.SearchStrategy[float]:
    """A number, evenly spread over its logarithm."""
    return st.floats(np.log(low), np.log(high), allow_nan=False).map(lambda x: float(np.exp(x)))


@st.composite
def bearings(draw: Any, layout: tuple[int, int, int], friction: float = 0.15) -> Bearing:
    """Radii that shrink inwards from 0.4-2 m, friction of 0.5 % and more, sliders of 0.05-5 kg, rims within reach."""
    radii = nested_radii(layout, outer=draw(between(0.4, 2.0)), ratio=draw(st.floats(0.3, 0.8)))
    surfaces = [
        a_surface(
            radius,
            friction=draw(between(0.005, friction)),
            yield_displacement=draw(between(1e-4, 2e-3)),
            capacity=draw(st.floats(0.06, 0.25)) * radius,
            rim_stiffness=draw(between(1e6, 1e8)),
            rim_damping=draw(st.sampled_from([0.0, 5.0, 1e3])),
        )
        for radius in radii
    ]
    bodies = [a_body(mass=draw(between(0.05, 5.0)), height=draw(st.floats(0.01, 0.03))) for _ in radii]
    return Bearing(layout=Layout(*layout), base_height=0.02, base_rim_radius=0.01, surfaces=surfaces, bodies=bodies)


@st.composite
def motions(draw: Any, reach: float, straight: bool = False) -> Motion:
    """A sine along some azimuth, or an orbit or figure of eight, of up to `reach` [m]."""
    amplitude, frequency = draw(st.floats(0.1, 1.0)) * reach, draw(between(0.05, 0.5))
    kind = "line" if straight else draw(st.sampled_from(["line", "circle", "eight"]))
    if kind == "line":
        azimuth = 0.0 if straight else draw(st.floats(0.0, np.pi))
        return Motion.harmonic(amplitude, frequency, cycles=1.25, direction=azimuth)
    orbit = Motion.circle if kind == "circle" else Motion.figure_eight
    return orbit(amplitude, 2 * np.pi * frequency, cycles=1.0, lead_in=0.5 / frequency)


def capacity(bearing: Bearing) -> float:
    """What the outer surfaces can travel without a rim [m]."""
    return min(surface.capacity for surface in (bearing.surfaces[0], bearing.surfaces[-1]))


def tops(load: float) -> st.SearchStrategy[Top]:
    """A rig, or a rigid mass of that weight whose tilt its neighbours resist."""
    rig = Top.rig(load, 1e3 * load, 0.0, 10 * load)
    mass = Top.mass(load / 9.8, 0.05 * load / 9.8, 0.5, 100 * load, load)
    return st.sampled_from([rig, mass])


@st.composite
def scenes(
    draw: Any,
    planar: bool = False,
    law: str = "report",
    rtol: float = 1e-5,
    over: float = 1.3,
    layouts: Sequence[tuple[int, int, int]] = LAYOUTS,
) -> Scene:
    """A bearing under 10 kN to 5 MN, led up to `over` times what its outer surfaces can travel."""
    layout = draw(st.sampled_from(layouts))
    bearing = draw(bearings(layout))
    top: Top = draw(tops(draw(between(1e4, 5e6))))
    if layout == (2, 1, 0):  # its plate is its slider: nothing may hold its tilt
        top = Top.rig(draw(between(1e4, 5e6)), 1e8)
    motion = draw(motions(over * capacity(bearing), straight=planar))
    effects = Effects(dimension="planar" if planar else "spatial", bouc_wen=law)
    return Scene(bearing, motion, top, effects, Solver(rtol=rtol))
