"""Hard angles: none at all, hardly any, near the singularity; and radii from 5 cm to nearly flat."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support import failure_of, model_of
from support.stacks import (
    LOAD,
    PLANAR,
    a_pendulum,
    a_rig,
    a_stack,
    arm_and_inertia,
    off_the_reference,
    pendulum_angle,
    pushed,
    swing,
)

from msfp_gen import Bearing, Effects, Motion, Scene, Solver, Top, simulate
from msfp_gen.results.result import Result
from msfp_gen.scene.scene_fields import InitialState

TINY = [1e-3, 1e-6, 1e-8, 1e-9, 1e-12]
TFP = (5, 2, 2)


@pytest.mark.parametrize("angle", TINY)
def test_sliding_of_a_tiny_tilt_is_exact(angle: float) -> None:
    """s = R delta, whatever the direction; where acos of the report loses every digit below 1e-8 rad."""
    bearing = a_stack(TFP, [1.0, 0.3, 0.3, 1.0])
    q = np.zeros((4, 3))
    q[:, 0], q[:, 1] = 0.6 * angle, 0.8 * angle
    found = model_of(TFP).evaluate(bearing, q, 0 * q, q[:, :2] * 0, top_force=(0, 0, -LOAD))
    relative = np.arctan2(
        np.hypot(np.sin(q[:, 0]) * np.cos(q[:, 1]), np.sin(q[:, 1])), np.cos(q[:, 0]) * np.cos(q[:, 1])
    )
    assert found.sliding == pytest.approx(np.array([1.0, 0.3, 0.3, 1.0]) * relative, rel=4e-16)


@pytest.mark.parametrize("angle", TINY)
def test_acceleration_at_a_tiny_tilt_has_all_its_digits(angle: float) -> None:
    """A frictionless pendulum: theta'' = -m g r sin(theta)/(J + m r^2), to the last digits of the smallest tilt."""
    bearing = a_pendulum()
    arm, inertia = arm_and_inertia(bearing)
    for planar in (True, False):
        model = model_of((2, 1, 0), **({"dimension": "planar"} if planar else {}))
        found = model.evaluate(bearing, [[0.0, angle, 0.0]], np.zeros((1, 3)), np.zeros((1, 2)))
        want = -bearing.bodies[0].mass * 9.8 * arm * np.sin(angle) / inertia
        assert found.acceleration[0, 1] == pytest.approx(want, rel=1e-12)


@pytest.mark.parametrize("effects", [{}, {"spin": "patch"}, {"spin": "free"}, {"bouc_wen": "isotropic"}], ids=str)
def test_no_tilt_no_slip_no_number_missing(effects: dict[str, str]) -> None:
    """The centre itself, where contact direction, spin and slip direction are all 0/0: everything is zero, exactly."""
    bearing, zero = a_stack(TFP, [1.0, 0.3, 0.3, 1.0]), np.zeros((4, 3))
    found = model_of(TFP, **effects).evaluate(bearing, zero, zero, zero[:, :2], top_force=(0, 0, -LOAD))
    for values in (found.acceleration, found.contact_angles, found.friction_rate, found.slip_velocity, found.sliding):
        assert not np.any(values)
    weights = 9.8 * np.array([body.mass for body in bearing.bodies])
    assert found.normal_force == pytest.approx(LOAD + np.cumsum(weights[::-1])[::-1], rel=1e-13)


@pytest.mark.parametrize("angle", [1e-3, 1e-6, 1e-9, 1e-12])
def test_tiny_swing_is_the_pendulum_to_the_floor_of_newton(angle: float) -> None:
    """Three seconds against elliptic functions. Below 1e-10 rad, the floor of the residual test, nothing is promised
    of the shape, but nothing grows either."""
    run = simulate(swing(a_pendulum(), angle, 3.0, solver=Solver(rtol=1e-8, atol_angle=1e-7 * angle))).history
    off = np.abs(run.tilt_angles[:, 0, 1] - pendulum_angle(a_pendulum(), angle, run.time)).max()
    assert off < 1e-4 * angle + 1e-11


@pytest.mark.parametrize("dimension", ["planar", "spatial"])
def test_a_tilt_near_ninety_degrees_is_named_before_the_singularity(dimension: str) -> None:
    """A hemisphere tips over. The run stops beyond 1.5 rad, short of pi/2, its rows finite and below."""
    scene = Scene(hemisphere(), Motion.ramp(1.0, 3.0), a_rig(1e4), effects=Effects(dimension=dimension))
    error = failure_of(scene)
    assert error.status == "angle" and "90 degrees" in str(error)
    assert isinstance(error.result, Result)
    angles = error.result.history.tilt_angles
    assert np.isfinite(angles).all() and 1.0 < np.abs(angles).max() < np.pi / 2


@pytest.mark.parametrize("azimuth", [0.0, np.pi / 2], ids=["theta", "psi"])
def test_a_start_beyond_the_angle_is_refused_by_name(azimuth: float) -> None:
    still = Motion(knots=[0.0, 1.0], coefficients=np.zeros((1, 6, 6)))
    start = InitialState([[1.55 * np.sin(azimuth), 1.55 * np.cos(azimuth), 0.0]], [[0.0] * 3], [[0.0] * 2])
    scene = Scene(hemisphere(), still, Top.prescribed((0.0, 0.0, -1e4)), Effects(), initial_state=start)
    assert failure_of(scene).status == "angle"


def hemisphere() -> Bearing:
    """A bowl whose rim lies at 1.56 rad, beyond the angle at which a run stops."""
    body = {"height": 0.01, "rim_radius": 1e-3}
    return a_stack((2, 1, 0), [0.3], friction=0.01, capacity=1.56 * 0.3, body=body)


# ---- radii -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("radius", [0.05, 0.5, pytest.param(5.0, marks=pytest.mark.slow)])
def test_radii_of_real_bearings_follow_the_reference(radius: float) -> None:
    bearing = a_stack(
        TFP,
        [radius, 0.3 * radius, 0.3 * radius, radius],
        friction=[0.03, 0.015, 0.015, 0.1],
        capacity=0.06 * radius,
        body={"height": min(0.02, 0.1 * radius)},
    )
    reach = min(0.1, 0.1 * radius)
    assert off_the_reference(pushed(bearing, [reach, -reach / 2, reach / 4], rtol=1e-5), rows=25) < 1e-3


@pytest.mark.parametrize("radius", [100.0, 1e4, 1e6])
def test_nearly_flat_surfaces_slide_like_a_block(radius: float) -> None:
    """Two of them under a level plate: F/N = mu tanh(u/2 d_y) + u/2R. Heights between sphere centres cancel to 1e-16 R;
    even at 1000 km what that leaves is below a thousandth of the friction."""
    bearing = a_stack((3, 1, 1), [radius, radius], capacity=1.0, body={"mass": 1e-3})
    run = pushed(bearing, [-0.02], tilt=1e6 * radius, rtol=1e-6)
    u, force = np.abs(run.history.displacement[:, 0]), np.abs(run.history.top_force[:, 0])
    want = 0.05 * np.tanh(u / 1e-3) + u / (2 * radius)
    assert u[-1] == pytest.approx(0.02, rel=1e-3)
    assert np.abs(force / LOAD - want).max() < 1e-3 * 0.05


def test_a_frictionless_bowl_of_a_hundred_metres_keeps_time() -> None:
    """A quarter period is 5 s; half of it against elliptic functions."""
    bearing = a_pendulum(radius=100.0)
    run = simulate(replace(swing(bearing, 0.3, 10.0, solver=Solver(rtol=1e-7)), effects=PLANAR)).history
    assert np.abs(run.tilt_angles[:, 0, 1] - pendulum_angle(bearing, 0.3, run.time)).max() < 1e-5
