"""One evaluation with uplift against plain vectors (tests/reference/uplift.py), differences, and rows of a run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from reference import kinematics
from reference.stack import Load
from reference.uplift import Separation, balances, separated
from scipy.integrate import solve_ivp
from support import Array, bearing_of, differences, model_of
from support.flights import shaken
from support.random_states import inputs, sensible

from msfp_gen import InputError, Motion, Scene, Solver, Top, build_model, presets, simulate
from msfp_gen.model.compiled import separations_at_rest
from msfp_gen.scene.standing import seat_stiffness

LAYOUT = (5, 2, 2)
COUNT = LAYOUT[0] - 1
STANDS = ("closed", "edge", "open")


def a_state(stand: str, planar: bool = False) -> tuple[Any, ...]:
    """A reference stack of random bodies, its state, separations, friction and load; no rim is reached."""
    values, state, h, load = sensible(LAYOUT, 1)
    values = replace(values, surfaces=tuple(replace(s, capacity=s.radius) for s in values.surfaces))
    rng = np.random.default_rng(3)
    d = np.concatenate([rng.uniform(-2e-6, 2e-6, (COUNT, 2)), rng.uniform(-3e-5, -1e-5, (COUNT, 1))], axis=1)
    if stand != "closed":
        d[1] = {"edge": (2e-5, -4e-5, -4e-5), "open": (2e-6, 1e-6, 3e-4)}[stand]
        d[2] = {"edge": (5e-5, 2e-5, -3e-5), "open": (1e-6, 0.0, 1e-4)}[stand]
    gap = Separation(d, rng.uniform(-2e-3, 2e-3, (COUNT, 3)), rng.uniform(-5.0, 5.0, (COUNT, 3)))
    if planar:
        keep = np.array([0.0, 1.0, 0.0])
        b = state.base
        base = replace(b, angles=b.angles * keep, rates=b.rates * keep, rate_rates=b.rate_rates * keep)
        base = replace(base, acceleration=b.acceleration * (1 - keep))
        state = replace(state, q=state.q * keep, v=state.v * keep, a=state.a * keep, base=base)
        gap = Separation(*(part * (1 - keep) for part in gap))
        h, load = h * [1.0, 0.0], Load(load.force * (1 - keep), load.moment * keep)
    return values, state, gap, h, load


def joined(state: Any, gap: Separation) -> tuple[Array, Array, Array]:
    """Coordinates, rates and accelerations as a model with uplift takes them."""
    return tuple(np.hstack(pair) for pair in zip((state.q, state.v, state.a), gap, strict=True))  # type: ignore[return-value]


@pytest.mark.parametrize("stand", STANDS)
@pytest.mark.parametrize("spin", ["locked", pytest.param("free", marks=pytest.mark.slow)])
def test_balances_with_uplift_equal_plain_vectors(spin: str, stand: str) -> None:
    values, state, gap, h, load = a_state(stand)
    bearing, model = bearing_of(values), model_of(LAYOUT, uplift=True, spin=spin)
    rng = np.random.default_rng(5)
    angles, normal = rng.uniform(-0.05, 0.05, (COUNT, 2)), rng.uniform(5e4, 1e5, COUNT)
    seats = np.array([seat_stiffness(bearing, None), [s.seat_damping for s in bearing.surfaces]])
    linear, angular, excess = balances(values, state, gap, h, angles, normal, load, seats)
    if spin == "locked":
        angular[:, 2] = state.a[:, 2]
    q, v, a = joined(state, gap)
    unknowns = np.concatenate([a.ravel(), angles.ravel(), normal])
    found = model.residual(bearing, q, v, h, unknowns, **inputs(state, load))
    want = np.concatenate([np.hstack([linear, angular]).ravel(), excess.ravel()])
    assert found.shape == (9 * COUNT,)
    assert np.abs(found - want).max() < 1e-10 * np.abs(want).max()


@pytest.mark.parametrize("stand", STANDS)
@pytest.mark.parametrize(
    "effects", [{}, pytest.param({"spin": "free"}, marks=pytest.mark.slow), {"dimension": "planar"}], ids=str
)
def test_accelerations_with_uplift_solve_the_balances(effects: dict[str, Any], stand: str) -> None:
    """Both formulations are one, and the reference is satisfied by what they find."""
    planar = effects.get("dimension") == "planar"
    values, state, gap, h, load = a_state(stand, planar)
    bearing, model = bearing_of(values), model_of(LAYOUT, uplift=True, **effects)
    q, v, _ = joined(state, gap)
    given = inputs(state, load)
    found = model.evaluate(bearing, q, v, h, **given)
    full = model.evaluate(bearing, q, v, h, formulation="report", **given)
    assert found.acceleration is not None and full.acceleration is not None and found.unknowns is not None
    assert found.acceleration.shape == (COUNT, 6) and full.residual_norm < 1e-9
    assert np.abs(found.acceleration - full.acceleration).max() < 1e-9 * np.abs(found.acceleration).max()
    assert np.abs(found.normal_force - full.normal_force).max() < 1e-9 * found.normal_force.max()
    assert (found.normal_force[1] < 1e-5) == (stand == "open")
    left = model.residual(bearing, q, v, h, found.unknowns, **given)
    assert len(left) == (5 if planar else 9) * COUNT and np.abs(left).max() < 1e-9 * found.normal_force.max()
    seats = np.array([seat_stiffness(bearing, None), [s.seat_damping for s in bearing.surfaces]])
    at = replace(state, a=found.acceleration[:, :3])
    moving = gap._replace(rate_rate=found.acceleration[:, 3:])
    linear, angular, excess = balances(values, at, moving, h, found.contact_angles, found.normal_force, load, seats)
    axial = 2 if not planar and effects.get("spin") == "free" else 1
    size = found.normal_force.max()
    for rest in (linear, angular[:, : axial + 1], excess):
        assert np.abs(rest).max() < 1e-9 * size


@pytest.mark.parametrize("stand", STANDS)
@pytest.mark.parametrize("wrt", ["unknowns", "state", "inputs"])
@pytest.mark.parametrize("planar", [False, True])
def test_jacobian_with_uplift_against_differences(planar: bool, wrt: str, stand: str) -> None:
    values, state, gap, h, load = a_state(stand, planar)
    bearing = bearing_of(values)
    model = model_of(LAYOUT, uplift=True, **({"dimension": "planar"} if planar else {}))
    q, v, _ = joined(state, gap)
    given = inputs(state, load)
    unknowns = model.evaluate(bearing, q, v, h, **given).unknowns
    assert unknowns is not None
    found = model.jacobian(bearing, q, v, h, unknowns, wrt=wrt, **given)
    sizes = {"unknowns": len(unknowns), "state": 14 * COUNT, "inputs": 24}
    assert found.shape == (len(unknowns), sizes[wrt])

    def along(x: Array) -> Array:
        if wrt == "unknowns":
            return model.residual(bearing, q, v, h, x, **given)
        if wrt == "inputs":
            changed = given | {"base_acceleration": x[6:9], "top_force": x[18:21], "top_moment": x[21:24]}
            changed["base_rotation"] = tuple(x[9:18].reshape(3, 3))
            return model.residual(bearing, q, v, h, unknowns, **changed)
        parts = x[: 6 * COUNT].reshape(-1, 6), x[6 * COUNT : 12 * COUNT].reshape(-1, 6), x[12 * COUNT :].reshape(-1, 2)
        return model.residual(bearing, *parts, unknowns, **given)

    base = state.base
    start = {
        "unknowns": unknowns,
        "state": np.concatenate([q.ravel(), v.ravel(), h.ravel()]),
        "inputs": np.concatenate(
            [np.zeros(6), base.acceleration, base.angles, base.rates, base.rate_rates, load.force, load.moment]
        ),
    }[wrt]
    # Small where a contact would pass from its face to its edge, large where the residual is linear.
    steps = {
        "unknowns": np.r_[
            np.full(len(unknowns) - (2 if planar else 3) * COUNT, 1e3),
            np.full((1 if planar else 2) * COUNT, 1e-3),
            np.full(COUNT, 1e2),
        ],
        "state": np.r_[
            np.tile([1e-4] * 3 + [2e-9] * 3, COUNT), np.tile([1e-3] * 3 + [1e-5] * 3, COUNT), np.full(2 * COUNT, 1e-4)
        ],
        "inputs": np.r_[np.full(9, 1e2), np.full(3, 1e-3), np.full(3, 1e-2), np.full(9, 1e2)],
    }[wrt]
    moving = [i for i, column in enumerate(found.T) if column.any()]  # of a planar model those of its plane
    assert len(moving) > len(start) // 4

    def part(x: Array) -> Array:
        full = start.copy()
        full[moving] = x
        return along(full)

    want = differences(part, start[moving], steps[moving])
    size = np.abs(want).max(axis=1, keepdims=True) + 1e-9
    assert (np.abs(found[:, moving] - want) / size).max() < 1e-6


def test_named_vectors_with_uplift_are_displaced_by_the_separations() -> None:
    values, state, gap, _, _ = a_state("open")
    bearing, model = bearing_of(values), model_of(LAYOUT, uplift=True)
    b = state.base
    base = np.array([np.r_[b.displacement, b.angles], np.r_[b.velocity, b.rates], np.r_[b.acceleration, b.rate_rates]])
    found = model.kinematics(bearing, *joined(state, gap), base=base)
    want = separated(values, kinematics.points(values, state), gap)
    assert {f"r_{name}" for name in want.r} == {name for name in found if name.startswith("r_")}
    for kind, vectors in zip("rva", want, strict=True):
        for name, vector in vectors.items():
            assert np.abs(found[f"{kind}_{name}"] - vector).max() < 1e-11 * (1 + np.abs(vector).max()), (kind, name)


def test_a_planar_model_with_uplift_in_the_other_plane() -> None:
    """A state in the E2-E3 plane is that of the E1-E3 plane, turned."""
    values, state, gap, h, load = a_state("edge", planar=True)
    bearing, model = bearing_of(values), model_of(LAYOUT, uplift=True, dimension="planar")
    q, v, _ = joined(state, gap)
    force = (0.0, 0.0, load.force[2])
    first = model.evaluate(bearing, q, v, h, top_force=force)
    second = [np.zeros_like(x) for x in (q, v)]
    for turned, given in zip(second, (q, v), strict=True):
        turned[:, 0], turned[:, 4], turned[:, 5] = -given[:, 1], given[:, 3], given[:, 5]
    found = model.evaluate(bearing, *second, h[:, ::-1], top_force=force)
    assert found.acceleration is not None and first.acceleration is not None
    assert found.acceleration[:, 0] == pytest.approx(-first.acceleration[:, 1], rel=1e-12)
    assert found.acceleration[:, 4] == pytest.approx(first.acceleration[:, 3], rel=1e-12)
    assert found.acceleration[:, 5] == pytest.approx(first.acceleration[:, 5], rel=1e-12)
    second[0][:, 3] = 1e-5
    with pytest.raises(InputError, match="separation leaves the vertical plane"):
        model.evaluate(bearing, *second, h[:, ::-1], top_force=force)


def test_wrong_shapes_with_uplift_are_named_with_their_units() -> None:
    bearing = presets.bearing("fenz-tfp")
    model = model_of(LAYOUT, uplift=True)
    angles, friction = np.zeros((COUNT, 3)), np.zeros((COUNT, 2))
    with pytest.raises(InputError, match=r"q has shape \(4, 3\): give shape \(4, 6\) \[rad; separation .*: m\]"):
        model.evaluate(bearing, angles, angles, friction)
    with pytest.raises(InputError, match=r"q has shape \(4, 3\): give shape \(4, 6\)"):
        model.kinematics(bearing, angles, angles, angles)


RIG = Top.rig(112e3, 1e7, 5e3, 1e6, 5e3)


def test_an_ode_with_uplift_starts_at_rest_on_its_contacts() -> None:
    still = Motion(knots=[0.0, 1.0], coefficients=np.zeros((1, 6, 6)))
    bearing = presets.bearing("fenz-tfp")
    ode = model_of(LAYOUT, uplift=True).as_ode(bearing, still, RIG)
    assert ode.y0.shape == (14 * COUNT,)
    assert np.array_equal(ode.y0[: 6 * COUNT].reshape(-1, 6)[:, 3:], separations_at_rest(bearing, RIG))
    assert np.abs(ode.fun(0.0, ode.y0)).max() < 1e-4  # of stiffnesses of 5e9 N/m


@pytest.mark.parametrize("effects", [{}, {"dimension": "planar"}], ids=str)
def test_jacobian_of_an_ode_with_uplift_against_differences(effects: dict[str, Any]) -> None:
    planar = bool(effects)
    ode = model_of(LAYOUT, uplift=True, **effects).as_ode(
        presets.bearing("fenz-tfp"), Motion.harmonic(0.005, 1.0, cycles=0.25), RIG
    )
    rng = np.random.default_rng(2)
    q, v, h = ode._split(ode.y0.copy())
    q[:, :3], v[:, :3] = rng.uniform(-0.03, 0.03, (COUNT, 3)), rng.uniform(0.05, 0.3, (COUNT, 3))
    h[:] = rng.uniform(-0.6, 0.6, (COUNT, 2))
    if planar:
        q, v, h = q * [0, 1, 0, 1, 0, 1], v * [0, 1, 0, 1, 0, 1], h * [1, 0]
    y, t = np.concatenate([q.ravel(), v.ravel(), h.ravel()]), 0.1
    free = [1, 3, 5] if planar else range(6)
    moving = np.array(
        [c + 6 * k + 24 * order for order in (0, 1) for k in range(COUNT) for c in free]
        + [48 + 2 * k + i for k in range(COUNT) for i in ([0] if planar else [0, 1])]
    )
    steps = np.concatenate([np.tile([1e-4 if c < 3 else 1e-7 for c in free], 2 * COUNT), np.full(len(moving), 1e-4)])

    def fun(x: Array) -> Array:
        full = y.copy()
        full[moving] = x
        rates: Array = ode.fun(t, full)[moving]
        return rates

    found = ode.jac(t, y)[np.ix_(moving, moving)]
    want = differences(fun, y[moving], steps[: len(moving)])
    size = np.abs(want).max(axis=1, keepdims=True) + 1e-9
    assert (np.abs(found - want) / size).max() < 1e-6


def test_an_ode_with_uplift_has_the_rows_of_a_run_that_flies() -> None:
    """At states of a run, closed and open: its normal forces, contact forces and slip."""
    scene = shaken(1.4, sideways=0.03, duration=0.8)
    run = simulate(scene).history
    ode = build_model(scene.bearing.layout, scene.modelled).as_ode(scene.bearing, scene.motion, scene.top)
    flown = np.flatnonzero(run.lift.max(axis=1) > 1e-4)
    assert len(flown) > 5
    for row in [len(run.time) // 4, len(run.time) // 3, *flown[:: max(1, len(flown) // 6)]]:
        q = np.hstack([run.tilt_angles[row], run.separation[row]])
        rates = np.hstack([run.tilt_rates[row], np.zeros((COUNT, 3))])
        y = np.concatenate([q.ravel(), rates.ravel(), run.friction_state[row].ravel()])
        seen = ode.observe(run.time[row], y)
        assert seen["sliding"] == pytest.approx(run.sliding[row], rel=1e-9, abs=1e-12)
        assert seen["slip"] == pytest.approx(run.slip_velocity[row], rel=1e-6, abs=1e-9)
        # The rate of the separation, which rows do not have, acts on the damping of the contact alone.
        opened = run.normal_force[row] == 0
        assert (seen["normal"][opened] < 1e-5).all()


@pytest.mark.slow
def test_radau_with_uplift_goes_where_simulate_goes() -> None:
    scene = Scene(
        presets.bearing("fenz-tfp"),
        Motion.harmonic(0.005, 1.0, cycles=0.05),
        Top.rig(112e3, 1e7, 5e3, 1e6, 5e3),
        replace(Scene(presets.bearing("fenz-tfp"), Motion.harmonic(0.005, 1.0), RIG).modelled, uplift=True),
        solver=Solver(rtol=1e-7),
        output_step=0.005,
    )
    run = simulate(scene).history
    model = build_model(scene.bearing.layout, scene.modelled)
    fun, jac, y0 = model.as_ode(scene.bearing, scene.motion, scene.top)
    answer = solve_ivp(fun, (0.0, scene.end), y0, "Radau", run.time, rtol=1e-6, atol=1e-10, jac=jac)
    assert answer.success, answer.message
    q = answer.y.T[:, : 6 * COUNT].reshape(-1, COUNT, 6)
    friction = answer.y.T[:, 12 * COUNT :].reshape(-1, COUNT, 2)
    assert np.abs(q[..., :3] - run.tilt_angles).max() < 1e-3 * np.abs(run.tilt_angles).max()
    assert np.abs(q[..., 3:] - run.separation).max() < 1e-2 * np.abs(run.separation).max()
    assert np.abs(friction - run.friction_state).max() < 5e-3 and np.abs(run.friction_state).max() > 0.9
