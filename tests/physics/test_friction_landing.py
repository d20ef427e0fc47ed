"""A friction coefficient that moves the contact point, and with it the slip that it depends on (docs/friction.md)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from reference import friction_laws as reference
from support import Array, differences, model_of

from msfp_gen import Bearing, Body, Effects, Layout, Motion, Scene, Solver, Surface, Top, simulate

pytestmark = pytest.mark.slow  # models that no other test needs

FAST, SLOW, RATE, YIELD, DAMPING = 0.1, 0.05, 200.0, 5e-4, 1e-4


def bearing(gravity: float = 9.81, **law: Any) -> Bearing:
    """A large single pendulum with an articulated slider."""
    shared = {"contact_damping": DAMPING, "seat_damping": 10.0, "velocity_rate": RATE}
    dish = Surface(radius=1.0, capacity=0.7, friction=FAST, yield_displacement=YIELD, friction_slow=SLOW, **shared)
    ball = Surface(radius=0.3, capacity=0.25, friction=1e-3, yield_displacement=1e-4, friction_slow=1e-3, **shared)
    slider = Body(height=0.3, centroid=0.15, mass=260.0, inertia=(4.0, 5.2), rim_radius=0.2)
    plate = Body(height=0.1, centroid=0.05, mass=300.0, inertia=(10.0, 20.0))
    found = Bearing(
        layout=Layout(3, 1, 1), base_height=0.05, surfaces=[dish, ball], bodies=[slider, plate], gravity=gravity
    )
    return found.replace(**law)


def turning(seed: int) -> tuple[Array, Array, Array, Array]:
    """Angles, rates, friction state and load of a slider that turns about the contact normal."""
    rng = np.random.default_rng(seed)
    q, v = np.zeros((2, 3)), np.zeros((2, 3))
    q[0, :2] = rng.uniform(-0.25, 0.25, 2)
    v[0, :2] = rng.uniform(-2.5, 2.5, 2)
    q[1], v[1] = -q[0], -v[0]
    phi = rng.uniform(0, 2 * np.pi, 2)
    f = np.c_[np.cos(phi), np.sin(phi)] * 0.95
    return q, v, f, np.array([3e5 * rng.uniform(-1, 1), 3e5 * rng.uniform(-1, 1), -1e6])


@pytest.mark.parametrize("seed", [3421, 4070, 19272])
def test_a_coefficient_that_moves_its_own_contact_is_found(seed: int) -> None:
    """Where mu changes with mu nearly as fast as itself, in numpy by the plastic slip of a returned trial force."""
    q, v, f, load = turning(seed)
    model = model_of((3, 1, 1), friction="velocity", bouc_wen="plastic", rims=False)
    found = model.evaluate(bearing(), q, v, f, top_force=load)
    trial = f[0] + DAMPING * found.slip_velocity[0] / YIELD
    plastic = max(float(np.hypot(*trial)) - 1, 0) * YIELD / DAMPING
    assert found.friction_coefficient is not None
    assert found.friction_coefficient[0] == pytest.approx(reference.velocity(FAST, SLOW, RATE, plastic), rel=1e-9)


def test_the_tangent_there_agrees_with_differences() -> None:
    q, v, f, load = turning(3421)
    stack = model_of((3, 1, 1), friction="velocity", bouc_wen="plastic", rims=False).stack(bearing())
    cq, cv, ca, beta = 1e-6, 1.0, 1e6, 1e-6

    def at(x: Array) -> Any:
        d = np.zeros((2, 3))
        d[:, :2] = x.reshape(2, 2)
        external = np.r_[load, np.zeros(3)]
        out = stack.condensed(q + cq * d, v + cv * d, ca * d, f, np.zeros((3, 6)), external, cq, cv, ca, beta)
        assert out[0] == "ok"
        return out

    want = differences(lambda x: at(x)[1], np.zeros(4), np.full(4, 1e-6))
    assert np.abs(at(np.zeros(4))[2] - want).max() < 1e-5 * np.abs(want).max()


def test_a_landing_under_pressure_and_velocity_ends() -> None:
    """One of seventy bearings below a heavy mass: it lands turning, and its friction follows pressure and velocity."""
    rng = np.random.default_rng(15)
    frequency, phase, rise = rng.uniform(0.5, 1.5, 2), rng.uniform(0, 6.28, 2), rng.uniform(2.0, 5.0)
    support = 78.53e9 / float(rng.choice([2.0, 5.0, 10.0]))
    time = np.linspace(0, 2, 401)
    across = [6 * np.sin(2 * np.pi * f * time + p) for f, p in zip(frequency, phase, strict=True)]
    shaking = np.c_[*across, 8 * np.sin(2 * np.pi * rise * time)] * np.clip(time / 0.3, 0, 1)[:, None]
    weight, area = 98.75 * 68.75 * 11040.0 * 9.81 / 70, np.pi * 0.04
    sliding = 0.06 * 0.7 ** ((weight / area - 100e6) / 50e6) * 0.5
    values = {
        "friction": [0.06, 1e-3],
        "friction_slow": None,
        "pressure_ratio": [0.7, 1.0],
        "velocity_drop": [0.5, 0.0],
        "velocity_rate": 100.0,
        "reference_pressure": 100e6,
        "patch_radius": 0.2,
        "yield_displacement": [sliding * weight / (100e6 * area * 60 - weight), 1e-4],
    }
    scene = Scene(
        bearing(9.81 / 2, **values),
        Motion.from_acceleration(time, shaking),
        Top.mass(
            2 * weight / 9.81,
            1e5,
            0.5,
            rotational_stiffness=1e9,
            rotational_damping=1e7,
            vertical_stiffness=support,
            vertical_damping=0.0019 * support,
        ),
        Effects(friction="pv", uplift=True, rims=False, bouc_wen="plastic"),
        Solver(rtol=1e-4),
        duration=0.65,
        output_step=0.01,
    )
    result = simulate(scene)
    assert result.status == "ok"
    assert any(event.kind == "landing" for event in result.events)
    assert abs(result.history.energy["numerical"]).max() < 1e-3 * result.history.energy["input"].max()
