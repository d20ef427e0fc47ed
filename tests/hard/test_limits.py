"""Where the model has limits: free spin, loss of regularity, no load, light and heavy sliders, low and high stacks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from support import Array, failure_of, model_of, thinned
from support.stacks import (
    PLANAR,
    a_rig,
    a_stack,
    arm_and_inertia,
    nested_radii,
    off_the_reference,
    pushed,
    slow_path,
)

from msfp_gen import Bearing, Effects, Motion, RunError, Scene, Solver, Top, load_scene, simulate
from msfp_gen.results.result import Result
from msfp_gen.scene.scene_fields import InitialState

TFP, RADII = (5, 2, 2), [1.0, 0.3, 0.3, 1.0]
USUAL = {"friction": [0.03, 0.015, 0.015, 0.1], "capacity": [0.2, 0.06, 0.06, 0.2]}
PATH = [0.1, -0.05, 0.02]


# ---- free spin -------------------------------------------------------------------------------------------------


def spun(seed: float, rtol: float = 1e-5, method: str = "implicit", duration: float = 6.0) -> Array:
    """Largest spin rate of the inner sliders every half second in the report's circle of 50 mm, from `seed` [rad/s]."""
    rates = np.zeros((4, 3))
    rates[:, 2] = seed
    start = InitialState(np.zeros((4, 3)), rates, np.zeros((4, 2)))
    scene = replace(
        load_scene("becker-circle-50"),
        effects=Effects(spin="free", bouc_wen="report"),
        initial_state=start,
        duration=duration,
        output_step=0.5,
        solver=Solver(rtol=rtol, method=method),
    )  # type: ignore[arg-type]
    return np.abs(simulate(scene).history.tilt_rates[:, 1:3, 2]).max(axis=1)


def test_free_spin_is_an_instability_of_the_equations() -> None:
    """From the third second on the spin grows thirtyfold a second, along one curve, whether it started from 1e-7 or
    from 1e-5 rad/s, at either tolerance. The circle drives it; noise of an integrator would know of neither."""
    curve = spun(1e-7)
    assert curve[-1] > 1.0 and curve[0] == 1e-7
    grown = slice(6, None)  # 3 s and later
    assert np.log(curve[9] / curve[7]) > 3.0  # from 3.5 to 4.5 s
    for other in (spun(1e-5), spun(1e-7, 1e-6)):
        assert other[grown] == pytest.approx(curve[grown], rel=0.05)


@pytest.mark.slow
def test_free_spin_grows_the_same_under_the_explicit_method() -> None:
    explicit, implicit = spun(1e-7, 1e-6, "dopri5", 4.0), spun(1e-7, 1e-6, duration=4.0)
    assert explicit[6:] == pytest.approx(implicit[6:], rel=0.05)


# ---- regularity ------------------------------------------------------------------------------------------------


def deep_bowl(friction: float) -> Bearing:
    """One slider whose centre of mass is near the sphere centre: the friction circle holds it at mu = 0.5."""
    body = {"mass": 1.0, "height": 0.09, "centroid": 0.08, "inertia": (1e-4, 1e-4)}
    return a_stack((2, 1, 0), [0.1], friction=friction, capacity=0.14, body=body)


def accelerations(bearing: Bearing, tilt: float, share: float, moment: float) -> tuple[list[float], bool]:
    """All roots of I a + m g r sin(theta) - M = -rho(Y) |P(a)|, by its square, and whether I > |rho| m r."""
    surface, mass, g = bearing.surfaces[0], bearing.bodies[0].mass, bearing.gravity
    arm, inertia = arm_and_inertia(bearing)
    rho = -surface.radius * surface.friction * share / np.hypot(1.0, surface.friction * share)  # u~ = -R theta'
    left = Polynomial([mass * g * arm * np.sin(tilt) - moment, inertia])
    force = (mass * Polynomial([g * np.sin(tilt), arm])) ** 2 + (mass * g * np.cos(tilt)) ** 2
    roots = [x.real for x in (left**2 - rho**2 * force).roots() if abs(x.imag) < 1e-9 * (1 + abs(x))]
    return [x for x in roots if left(x) * rho <= 1e-12], bool(inertia > abs(rho) * mass * arm)


MOMENTS = [-1.0, -0.5, -0.3, -0.1, 0.0, 0.1, 0.3, 0.5, 1.0]


@pytest.mark.parametrize("friction", [0.05, 0.2, 0.5, 1.0])
def test_regularity_is_lost_where_the_closed_form_loses_it(friction: float) -> None:
    """Regular: the one root there is. Beyond: no root is named, and of two the one that low friction leads to, where
    the determinant is positive, is given. Never a third number."""
    bearing, model = deep_bowl(friction), model_of((2, 1, 0), dimension="planar")
    seen = set()
    for share in (-1.0, 1.0):
        for moment in MOMENTS:
            roots, regular = accelerations(bearing, -0.3, share, moment)
            assert len(roots) == 1 if regular else len(roots) in (0, 2)
            q = [[0.0, -0.3, 0.0]]
            try:
                found = model.evaluate(bearing, q, np.zeros((1, 3)), [[share, 0.0]], top_moment=(0.0, moment, 0.0))
            except RunError as error:
                assert error.status == "uplift" or not regular
                seen.add("named")
                continue
            acceleration = float(found.acceleration[0, 1])
            assert min(abs(acceleration - root) for root in roots) < 1e-8 * (1 + abs(acceleration))
            assert found.determinant == 1
            seen.add(len(roots))
    assert seen <= {1, "named"} if friction < 0.3 else "named" in seen


@pytest.mark.parametrize("method", ["implicit", "dopri5"])
@pytest.mark.parametrize("moment", [-0.3, 0.0, 0.3])
def test_run_from_a_state_without_an_acceleration_is_named(moment: float, method: str) -> None:
    """Fully developed friction in the same bowl: the closed form has no root, and no row is written."""
    bearing, still = deep_bowl(0.5), Motion(knots=[0.0, 1.0], coefficients=np.zeros((1, 6, 6)))
    assert not accelerations(bearing, -0.3, 1.0, moment)[0]
    start = InitialState([[0.0, -0.3, 0.0]], [[0.0] * 3], [[1.0, 0.0]])
    top = Top.prescribed((0.0, 0.0, 0.0), (0.0, moment, 0.0))
    scene = Scene(bearing, still, top, PLANAR, Solver(method=method), initial_state=start)  # type: ignore[arg-type]
    error = failure_of(scene)
    assert error.status in ("irregular", "newton") and error.result is None


# ---- load ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("load", thinned([1.0, 1e3, 1e5, 1e7], lambda load: load == 1e7))
def test_any_load_follows_the_reference(load: float) -> None:
    """From less than the weight of its own plates (20 N) to 1000 t. Light ones ring at some hertz: push slowly."""
    speed = 5e-3 if load > 100 else 5e-4
    run = pushed(a_stack(TFP, RADII, **USUAL), PATH, load=load, tilt=max(10 * load, 100.0), speed=speed, rtol=1e-5)
    assert off_the_reference(run, rows=25) < 2e-3
    assert run.history.normal_force.min() > 0


@pytest.mark.slow
def test_no_load_at_all_is_the_weight_of_the_top_plate() -> None:
    """N = 0 on a plate whose centre of mass is at its top is a load of its weight on a plate that weighs nothing."""
    bearing = a_stack(TFP, RADII, **USUAL)
    top = replace(bearing.bodies[-1], centroid=0.0)
    nothing = replace(top, mass=1e-9, inertia=(1e-12, 1e-12))
    run = pushed(
        replace(bearing, bodies=[*bearing.bodies[:-1], top]), PATH, load=0.0, tilt=100.0, speed=5e-4, rtol=1e-5
    )
    same = replace(bearing, bodies=[*bearing.bodies[:-1], nothing])
    seen = replace(run, scene=replace(run.scene, bearing=same, top=a_rig(9.8 * top.mass, 100.0)))
    assert off_the_reference(seen, rows=25) < 2e-3
    assert run.history.normal_force.min() > 0


@pytest.mark.parametrize("load", [1e3, 1e5, 1e7])
def test_force_goes_with_the_load(load: float) -> None:
    """Without weights and with springs in proportion nothing but the unit changes."""
    bearing = a_stack(TFP, RADII, gravity=0.0, body={"mass": 1e-6 * load}, **USUAL)
    scene = Scene(
        bearing,
        slow_path([0.1, -0.05], 5e-3),
        Top.rig(load, 1e3 * load, 0.0, 10 * load),
        effects=PLANAR,
        output_step=0.5,
        solver=Solver(rtol=1e-6),
    )
    one = replace(
        scene, bearing=a_stack(TFP, RADII, gravity=0.0, body={"mass": 1e-2}, **USUAL), top=Top.rig(1e4, 1e7, 0.0, 1e5)
    )
    here, there = simulate(scene).history.top_force[:, 0] / load, simulate(one).history.top_force[:, 0] / 1e4
    assert here == pytest.approx(there, abs=1e-4 * np.abs(there).max())


def test_a_load_that_passes_through_zero_is_named_at_the_moment_it_does() -> None:
    """A base that falls away ever faster under a mass: N = m (g - a) is gone when a reaches g, and no sooner."""
    t = np.linspace(0.0, 2.0, 401)
    fall = Motion.from_acceleration(t, np.outer(6.0 * t, [0.0, 0.0, -1.0]))
    bearing = a_stack((2, 1, 0), [1.0], body={"mass": 5.0})
    scene = Scene(bearing, fall, Top.mass(1e3, 50.0, 0.2, 1e6), effects=PLANAR)
    error = failure_of(scene)
    assert error.status == "uplift" and isinstance(error.result, Result)
    history = error.result.history
    assert history.time[-1] == pytest.approx(9.8 / 6.0, rel=0.01)
    assert history.normal_force[:, 0] == pytest.approx(1005.0 * (9.8 - 6.0 * history.time), abs=1.0)


# ---- mass ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("mass", thinned([1e-6, 1e-3, 1.0, 10.0], lambda mass: mass == 1e-6))
def test_any_slider_mass_follows_the_reference(mass: float) -> None:
    """Stuck modes from 300 Hz to a megahertz; the work does not grow with them."""
    run = pushed(a_stack(TFP, RADII, body={"mass": mass}, **USUAL), PATH, speed=5e-3, rtol=1e-4)
    assert off_the_reference(run, rows=25) < 1e-3
    assert run.counters.steps < 1000


# ---- height ----------------------------------------------------------------------------------------------------


def layout_of(surfaces: int) -> tuple[int, int, int]:
    return surfaces + 1, (surfaces + 1) // 2, surfaces // 2


@pytest.mark.parametrize(
    "surfaces", [1, 2, 4, *(pytest.param(n, marks=pytest.mark.slow) for n in (3, 5, 6, 7, 8, 9, 10))]
)
def test_stacks_of_one_to_ten_surfaces_follow_the_reference(surfaces: int) -> None:
    layout = layout_of(surfaces)
    bearing = a_stack(layout, nested_radii(layout, ratio=0.8))
    assert off_the_reference(pushed(bearing, [0.05, -0.03], speed=2e-3, rtol=1e-5), rows=20) < 1e-3
