"""The model as an ordinary differential equation: for scipy's integrators, and its Jacobian."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import Array, differences, model_of, thinned

from msfp_gen import Effects, InputError, Motion, RunError, Scene, Solver, Top, build_model, presets, simulate

TFP = (5, 2, 2)
RIG = Top.rig(112e3, 1e8, 5.0, 1e6, 5.0)
MASS = Top.mass(112e3 / 9.8, 300.0, 0.5, 1e7, 1e4)
CALM = 0.1
SLOW = pytest.mark.slow
EFFECTS: list[dict[str, Any]] = [
    {},
    {"spin": "patch"},
    {"spin": "free"},
    {"bouc_wen": "isotropic"},
    {"dimension": "planar"},
]


def wave(cycles: float = 0.25) -> Motion:
    return Motion.harmonic(0.005, 1.0, cycles=cycles)


def a_state(seed: int, planar: bool) -> Array:
    """A sliding stack, away from the kinks of friction and of the rims; a mass on it is thrown about by this."""
    rng = np.random.default_rng(seed)
    q, v = rng.uniform(-0.03, 0.03, (4, 3)), rng.uniform(0.05, 0.3, (4, 3)) * rng.choice([-1.0, 1.0], (4, 3))
    h = rng.uniform(-0.6, 0.6, (4, 2))
    if planar:
        q, v, h = q * [0, 1, 0], v * [0, 1, 0], h * [1, 0]
    return np.concatenate([q.ravel(), v.ravel(), h.ravel()])


@pytest.mark.parametrize("top", [RIG, MASS], ids=["rig", "mass"])
@pytest.mark.parametrize("effects", EFFECTS, ids=str)
def test_jacobian_against_differences(effects: dict[str, Any], top: Top) -> None:
    planar = effects.get("dimension") == "planar"
    ode = model_of(TFP, **effects).as_ode(presets.bearing("fenz-tfp"), wave(), top)
    y, t = a_state(2, planar) * (CALM if top is MASS else 1.0), 0.1
    moving = np.array([*[1, 4, 7, 10], *[13, 16, 19, 22], *[24, 26, 28, 30]]) if planar else np.arange(32)

    def fun(x: Array) -> Array:
        full = y.copy()
        full[moving] = x
        rates: Array = ode.fun(t, full)[moving]
        return rates

    found = ode.jac(t, y)[np.ix_(moving, moving)]
    want = differences(fun, y[moving], np.full(len(moving), 1e-4))
    size = np.abs(want).max(axis=1, keepdims=True) + 1e-9
    assert (np.abs(found - want) / size).max() < 1e-6


@pytest.mark.parametrize("effects", thinned([{}, {"dimension": "planar"}], lambda effects: not effects), ids=str)
def test_radau_goes_where_simulate_goes(effects: dict[str, Any]) -> None:
    """From rest into sliding. Explicitly stated Jacobian; planar models are stiff in the same way."""
    scene = Scene(presets.bearing("fenz-tfp"), wave(0.05), RIG, Effects(), solver=Solver(rtol=1e-6), output_step=0.01)
    scene = replace(scene, effects=replace(scene.effects, **effects))
    run = simulate(scene).history
    fun, jac, y0 = model_of(TFP, **effects).as_ode(scene.bearing, scene.motion, scene.top)
    answer = solve_ivp(fun, (0.0, scene.end), y0, "Radau", run.time, rtol=1e-6, atol=1e-9, jac=jac)
    assert answer.success, answer.message
    tilt = answer.y.T[:, :12].reshape(-1, 4, 3)
    friction = answer.y.T[:, 24:].reshape(-1, 4, 2)
    assert np.abs(tilt - run.tilt_angles).max() < 1e-3 * np.abs(run.tilt_angles).max()
    assert np.abs(friction - run.friction_state).max() < 5e-3
    assert np.abs(run.friction_state).max() > 0.9


def test_start_and_slope_at_rest() -> None:
    still = Motion(knots=[0.0, 1.0], coefficients=np.zeros((1, 6, 6)))
    ode = model_of(TFP).as_ode(presets.bearing("fenz-tfp"), still, RIG)
    assert ode.y0.shape == (32,) and not ode.y0.any()
    assert np.abs(ode.fun(0.0, ode.y0)).max() < 1e-9


def test_what_is_no_ordinary_differential_equation_is_refused() -> None:
    bearing = presets.bearing("fenz-tfp")
    with pytest.raises(InputError, match="massless"):
        model_of(TFP, dimension="planar", sliders="massless").as_ode(bearing, wave(), RIG)
    with pytest.raises(InputError, match="E1-E3 plane"):
        model_of(TFP, dimension="planar").as_ode(bearing, wave().rotated(np.pi / 2), RIG)


def test_a_state_that_is_no_number_is_an_error() -> None:
    ode = model_of(TFP).as_ode(presets.bearing("fenz-tfp"), wave(), RIG)
    for rates in (ode.fun, ode.jac):
        with pytest.raises(RunError):
            rates(0.0, np.full(32, np.nan))


@pytest.mark.parametrize(
    ("name", "method"),
    [("double-fp", "Radau"), ("prototype-tfp", "BDF"), pytest.param("fenz-tfp", "Radau", marks=SLOW)],
)
def test_through_lift_off_and_landing(name: str, method: str) -> None:
    """A mass shaken sideways, and vertically by 1.1 g; trials far from the motion have no accelerations."""
    time = np.linspace(0.0, 0.8, 321)
    share = np.clip(time / 0.5, 0.0, 1.0)
    growth = share**3 * (10 - 15 * share + 6 * share**2)
    path = np.zeros((len(time), 3))
    path[:, 0] = 0.03 * growth * np.sin(2 * np.pi * time)
    path[:, 2] = 1.1 * 9.8 / (4 * np.pi) ** 2 * growth * np.sin(4 * np.pi * time)
    top = Top.mass("11.4 t", inertia="300 kg m^2", height="0.5 m", rotational_stiffness=1e7, rotational_damping=1e4)
    bearing, motion = presets.bearing(name), Motion.from_arrays(time, path)
    effects = Effects(dimension="planar", uplift=True)
    fun, jac, y0 = build_model(bearing.layout, effects).as_ode(bearing, motion, top)

    def tried(t: float, y: Array) -> Array:
        try:
            return fun(t, y)
        except RunError:
            return np.full_like(y, np.nan)

    rows = np.linspace(0.0, 0.75, 151)
    found = solve_ivp(tried, (0, 0.75), y0, method, rows, jac=jac, rtol=1e-5, atol=1e-8, first_step=1e-4)
    assert found.success and np.isfinite(found.y).all()
    rise = found.y[: y0.size * 6 // 14].reshape(-1, 6, len(rows))[:, 5].sum(axis=0)
    scene = Scene(bearing, motion, top, effects=effects, duration=0.75, output_step=0.005)
    result = simulate(scene)
    assert [event.kind for event in result.events][:1] == ["lift_off"]
    want = result.history.separation[:, :, 2].sum(axis=1)
    assert want.max() > 2e-3
    assert rise == pytest.approx(want, abs=0.01 * want.max())
