"""Symmetries as properties: space turned and mirrored, a stack upside down, a body cut in two."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import strategies as st
from support import Array
from support.random_scenes import LAYOUTS, bearings, between, capacity, motions
from support.stacks import LOAD, PLANAR, a_rig, a_stack, holds

from msfp_gen import Bearing, Body, Effects, Layout, Motion, Scene, Solver, Top, simulate
from msfp_gen.results.history import History

MIRRORS = {"E1-E3": np.diag([1.0, -1.0]), "E2-E3": np.diag([-1.0, 1.0])}


@st.composite
def spatial(draw, law: str = "report", layouts=LAYOUTS):  # type: ignore[no-untyped-def]
    """A stack led about within the reach of its outer surfaces, rows a hundredth of the run apart."""
    layout = draw(st.sampled_from(layouts))
    bearing = draw(bearings(layout))
    motion = draw(motions(0.9 * capacity(bearing)))
    top = Top.rig(LOAD, 1e8, 0.0, 0.0 if layout == (2, 1, 0) else 1e6)
    return Scene(bearing, motion, top, Effects(bouc_wen=law), Solver(rtol=1e-6), output_step=motion.duration / 100)


def turn(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def carried(motion: Motion, matrix: Array) -> Motion:
    """The motion with its horizontal channels carried over by a turn or a mirror."""
    coefficients = motion.coefficients.copy()
    coefficients[:, :2] = np.einsum("ij,kjp->kip", matrix, motion.coefficients[:, :2])
    return replace(motion, coefficients=coefficients)


def apart(scene: Scene, matrix: Array) -> tuple[float, float]:
    """Largest difference of the forces once carried over, over the peak; and the square of the largest tilt."""
    here = simulate(scene).history
    there = simulate(replace(scene, motion=carried(scene.motion, matrix))).history
    force = here.top_force[:, :2] @ matrix.T
    worst = np.abs(force - there.top_force[:, :2]).max() / np.linalg.norm(force, axis=1).max()
    return float(worst), float(largest_tilt(here) ** 2)


def largest_tilt(history: History) -> float:
    """Of any body to the one below or to the vertical [rad]."""
    return float(max(np.abs(history.tilt_angles).max(), np.abs(history.tilt_angles.cumsum(axis=1)).max()))


@holds(4, 100, scene=spatial(), mirror=st.sampled_from(sorted(MIRRORS)))
def test_mirrored_motion_mirrors_the_force(scene: Scene, mirror: str) -> None:
    """Exact with either law: psi or theta changes its sign, and Y or Z. What is left is the tolerance."""
    assert apart(scene, MIRRORS[mirror])[0] < 2e-3


@holds(4, 100, scene=spatial())
def test_half_a_turn_turns_the_force(scene: Scene) -> None:
    assert apart(scene, turn(np.pi))[0] < 2e-3


@holds(4, 100, scene=spatial())
def test_quarter_turn_holds_to_the_square_of_the_tilt(scene: Scene) -> None:
    """The report's law knows its axes and a quarter turn swaps them; the bases of Y, Z twist by psi' sin(theta)."""
    worst, square = apart(scene, turn(np.pi / 2))
    assert worst < square + 2e-3


@holds(
    4, 100, quick={"scene": spatial("isotropic", [(5, 2, 2)])}, scene=spatial("isotropic"), angle=st.floats(0.1, 6.2)
)
def test_any_turn_of_the_isotropic_law_holds_to_the_square_of_the_tilt(scene: Scene, angle: float) -> None:
    worst, square = apart(scene, turn(angle))
    assert worst < square + 2e-3


@pytest.mark.parametrize(("law", "exact"), [("report", False), ("isotropic", True)])
def test_the_laws_differ_under_an_eighth_of_a_turn(law: str, exact: bool) -> None:
    """A path that stays small turns corners: the isotropic law turns with it to 1e-3, the report's does not."""
    bearing = a_stack((5, 2, 2), [2.0, 0.6, 0.6, 2.0], yield_displacement=2e-3)
    motion = Motion.figure_eight(0.006, 1.0, cycles=1.0, lead_in=2.0)
    scene = Scene(bearing, motion, a_rig(), Effects(bouc_wen=law), Solver(rtol=1e-6), output_step=0.05)  # type: ignore[arg-type]
    assert (apart(scene, turn(np.pi / 4))[0] < 1e-3) == exact


# ---- upside down -----------------------------------------------------------------------------------------------


def weightless(bearing: Bearing) -> Bearing:
    """The same with sliders of a gram and without gravity, so that up and down are words only."""
    bodies = [Body(b.height, b.height / 2, 1e-3, (1e-6, 1e-6), b.rim_radius, 0.0) for b in bearing.bodies]
    return replace(bearing, bodies=bodies, gravity=0.0)


def upside_down(bearing: Bearing) -> Bearing:
    """Surfaces and bodies in the other order, the base becoming the top plate; concave up is concave down then."""
    top = replace(bearing.bodies[-1], height=bearing.base_height, centroid=bearing.base_height / 2)
    return replace(
        bearing,
        layout=Layout(bearing.layout.n, bearing.layout.p, bearing.layout.m),
        surfaces=bearing.surfaces[::-1],
        bodies=[*bearing.bodies[-2::-1], top],
        base_height=bearing.bodies[-1].height,
    )


@pytest.mark.slow
@holds(6, 100, layout=st.sampled_from([(3, 1, 1), (5, 2, 2), (5, 3, 1)]), data=st.data())
def test_a_stack_upside_down_gives_the_same_loop(layout: tuple[int, int, int], data: st.DataObject) -> None:
    """Level plates, no weights: force and sliding of every surface, rims included."""
    bearing = weightless(data.draw(bearings(layout)))
    bearing = bearing.replace(rim_damping=0.0)
    motion = Motion.harmonic(1.2 * capacity(bearing), 0.02, cycles=1.0)
    scene = Scene(bearing, motion, a_rig(LOAD, 1e10, 1e9), PLANAR, Solver(rtol=1e-6), output_step=0.5)
    here, there = (simulate(replace(scene, bearing=b)).history for b in (bearing, upside_down(bearing)))
    force = here.top_force[:, 0]
    assert np.abs(force - there.top_force[:, 0]).max() < 1e-3 * np.abs(force).max()
    assert np.abs(here.sliding - there.sliding[:, ::-1]).max() < 1e-3 * here.sliding.max()


# ---- cut in two ------------------------------------------------------------------------------------------------


@holds(5, 100, radius=between(0.1, 100.0), friction=st.floats(0.5, 2.0), share=st.floats(0.2, 0.8), data=st.data())
def test_a_body_cut_in_two_is_still_one(radius: float, friction: float, share: float, data: st.DataObject) -> None:
    """The slider of a double pendulum cut by a surface of any radius that its friction keeps stuck: the same loop, and
    the cut moves by what its yield displacement allows."""
    whole = weightless(data.draw(bearings((3, 1, 1))))
    lower, upper = whole.surfaces
    cut = replace(lower, radius=radius, capacity=0.3 * radius, friction=friction, yield_displacement=1e-7)
    slider, top = whole.bodies
    halves = [replace(slider, height=x * slider.height, centroid=x * slider.height / 2) for x in (share, 1 - share)]
    parts = replace(whole, layout=Layout(4, 2, 1), surfaces=[lower, cut, upper], bodies=[*halves, top])
    motion = Motion.harmonic(0.9 * capacity(whole), 0.02, cycles=1.0)
    scene = Scene(whole, motion, a_rig(), PLANAR, Solver(rtol=1e-6), output_step=0.5)
    one, two = (simulate(replace(scene, bearing=b)).history for b in (whole, parts))
    force = one.top_force[:, 0]
    assert np.abs(force - two.top_force[:, 0]).max() < 1e-3 * np.abs(force).max()
    assert two.sliding[:, 1].max() < 1e-6
