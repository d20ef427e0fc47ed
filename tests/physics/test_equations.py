"""The emitted C against the report's equations assembled independently in plain vectors (tests/reference)."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from reference import forces, kinematics, stack
from support import ROOT, bearing_of, differences, model_of, thinned
from support.random_states import inputs, sensible

from msfp_gen import Body, Top
from msfp_gen.specification import contract

LAYOUTS = [(2, 1, 0), (2, 0, 1), (3, 1, 1), (3, 2, 0), (5, 2, 2), (5, 3, 1), (7, 3, 3)]
SPINS = ["locked", "patch", "free"]
SPUN = (5, 2, 2)  # the layout whose bodies may spin with every change
# No case of their own: concave down is in (3, 1, 1), one way only in (2, 1, 0), several inner surfaces in (5, 2, 2).
RARE = [(2, 0, 1), (3, 2, 0), (5, 3, 1), (7, 3, 3)]


def often(layout, spin):
    return layout not in RARE if spin == "locked" else layout == SPUN


LAYOUTS_AND_SPINS = thinned(product(LAYOUTS, SPINS), often)
OFTEN_LAYOUTS = thinned([(layout,) for layout in LAYOUTS], lambda layout: layout not in RARE)
SEEDS = [0, 1]


def unknowns_of(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return rng.uniform(-5, 5, (count, 3)), rng.uniform(-0.1, 0.1, (count, 2)), rng.uniform(8e3, 1.2e4, count)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("layout", "spin"), LAYOUTS_AND_SPINS)
def test_balances_equal_the_report_in_plain_vectors(layout, spin, seed):
    values, state, h, load = sensible(layout, seed)
    a, angles, normal = unknowns_of(np.random.default_rng(seed), layout[0] - 1)
    expected = stack.balances(values, replace(state, a=a), h, angles, normal, load, spin)
    body = expected.angular_body.copy()
    if spin == "locked":
        body[:, 2] = a[:, 2]
    unknowns = np.concatenate([a.ravel(), angles.ravel(), normal])
    found = model_of(layout, spin=spin).residual(
        bearing_of(values), state.q, state.v, h, unknowns, **inputs(state, load)
    )
    want = np.concatenate([expected.linear, body], axis=1).ravel()
    assert np.abs(found - want).max() < 1e-10 * max(1.0, np.abs(want).max())


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("layout", "spin"), LAYOUTS_AND_SPINS)
def test_condensed_form_equals_full_newton_and_reference(layout, spin, seed):
    values, state, h, load = sensible(layout, seed)
    bearing, model = bearing_of(values), model_of(layout, spin=spin)
    condensed = model.evaluate(bearing, state.q, state.v, h, **inputs(state, load))
    full = model.evaluate(bearing, state.q, state.v, h, formulation="report", **inputs(state, load))
    reference = stack.solve(values, replace(state, a=np.zeros_like(state.a)), h, load, spin)
    scale = 1.0 + np.abs(full.acceleration).max()
    for other in (full.acceleration, reference.acceleration):
        assert np.abs(condensed.acceleration - other).max() < 1e-9 * scale
    for other in (full, reference):
        assert np.abs(condensed.normal_force - other.normal_force).max() < 1e-9 * condensed.normal_force.max()
        assert np.abs(condensed.contact_angles - other.contact_angles).max() < 1e-9
    if spin == "locked":
        assert not condensed.acceleration[:, 2].any()


def sheared(values: Any) -> Any:
    """A reference stack with contact damping whose force is a tenth to a half of mu N at the slip of these states."""
    times = np.linspace(2e-4, 1e-3, len(values.surfaces))
    surfaces = tuple(replace(s, contact_damping=float(T)) for s, T in zip(values.surfaces, times, strict=True))
    return replace(values, surfaces=surfaces)


LAWS = ("report", "isotropic", "plastic")
DAMPED = [((2, 0, 1), "report"), *(((5, 2, 2), law) for law in LAWS)]


@pytest.mark.parametrize("damped", [True, False], ids=("damped", "undamped"))
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    ("layout", "law"), thinned(DAMPED, lambda layout, law: layout not in RARE and law != "isotropic")
)
def test_laws_of_hysteresis_and_contact_damping_equal_the_reference(layout, law, seed, damped):
    """Condensed and full equations and rates of friction; in the plastic law some of the surfaces slip."""
    values, state, h, load = sensible(layout, seed)
    values = sheared(values) if damped else values
    h = h / np.maximum(1.0, np.linalg.norm(h, axis=1, keepdims=True))
    h[0] /= np.linalg.norm(h[0])  # on the edge of the disc, where the plastic law slips or lets go
    bearing, model = bearing_of(values), model_of(layout, bouc_wen=law)
    found = model.evaluate(bearing, state.q, state.v, h, **inputs(state, load))
    full = model.evaluate(bearing, state.q, state.v, h, formulation="report", **inputs(state, load))
    want = stack.solve(values, replace(state, a=np.zeros_like(state.a)), h, load, "locked", law=law)
    scale = 1.0 + np.abs(want.acceleration).max()
    for other in (full, want):
        assert np.abs(found.acceleration - other.acceleration).max() < 1e-9 * scale
        assert np.abs(found.normal_force - other.normal_force).max() < 1e-9 * found.normal_force.max()
    turn = kinematics.rotation(state)
    touch = forces.contact(values, turn, kinematics.points(values, state, turn).r, found.contact_angles)
    rates = forces.friction_rates(values, h, touch.slip, law)
    for other in (found, full):
        assert np.abs(other.friction_rate - rates).max() < 1e-8 * np.abs(rates).max()


@pytest.mark.parametrize(
    ("layout", "law"),
    thinned([*product(LAYOUTS, ["report"]), ((5, 2, 2), "isotropic")], lambda layout, law: layout not in RARE),
)
def test_friction_rates_and_slip_equal_the_reference(layout, law):
    values, state, h, load = sensible(layout, 3)
    found = model_of(layout, bouc_wen=law).evaluate(bearing_of(values), state.q, state.v, h, **inputs(state, load))
    turn = kinematics.rotation(state)
    touch = forces.contact(values, turn, kinematics.points(values, state, turn).r, found.contact_angles)
    assert np.abs(found.slip_velocity - touch.slip).max() < 1e-12
    want = forces.friction_rates(values, h, touch.slip, law)
    assert np.abs(found.friction_rate - want).max() < 1e-9 * np.abs(want).max()


@pytest.mark.parametrize("layout", OFTEN_LAYOUTS)
def test_named_vectors_equal_the_report(layout):
    values, state, _, _ = sensible(layout, 4)
    base = state.base
    motion = np.array(
        [
            np.r_[base.displacement, base.angles],
            np.r_[base.velocity, base.rates],
            np.r_[base.acceleration, base.rate_rates],
        ]
    )
    found = model_of(layout).kinematics(bearing_of(values), state.q, state.v, state.a, base=motion)
    expected = kinematics.points(values, state)
    assert {f"r_{name}" for name in expected.r} == {name for name in found if name.startswith("r_")}
    for kind, vectors in (("r", expected.r), ("v", expected.v), ("a", expected.a)):
        for name, vector in vectors.items():
            assert np.abs(found[f"{kind}_{name}"] - vector).max() < 1e-11 * (1 + np.abs(vector).max()), (kind, name)
    turn = kinematics.rotation(state)
    for k in range(1, layout[0] + 1):
        assert np.abs(found[f"omega'_{k}"] - turn.w_total[k]).max() < 1e-12
        assert np.abs(found[f"alpha'_{k}"] - turn.dw_total[k]).max() < 1e-11
        assert np.abs(found[f"t_{k}"] - turn.t[k]).max() < 1e-14


@pytest.mark.parametrize("layout", OFTEN_LAYOUTS)
def test_the_centroid_is_where_all_texts_say(layout: tuple[int, int, int]) -> None:
    """z from the bottom of a body above a concave-up surface (3.6), from the top of one above a concave-down (3.10).

    No preset shows it: their bodies have z = l/2.
    """
    values, state, h, load = sensible(layout, 5)
    z = [0.3 * body.height for body in values.bodies]
    values = replace(
        values, bodies=tuple(replace(body, centroid=each) for body, each in zip(values.bodies, z, strict=True))
    )
    bearing, model = bearing_of(values), model_of(layout)
    found = model.kinematics(bearing, state.q, state.v, state.a)
    for k in range(2, layout[0] + 1):
        face = f"r_{k - 1}{k}" if k <= layout[1] + 1 else f"r_{k}{k}"
        assert np.linalg.norm(found[f"r_{k}"] - found[face]) == pytest.approx(z[k - 2], rel=1e-9), k
    condensed = model.evaluate(bearing, state.q, state.v, h, **inputs(state, load))
    want = stack.solve(values, replace(state, a=np.zeros_like(state.a)), h, load, "locked")
    scale = 1.0 + np.abs(want.acceleration).max()
    assert np.abs(condensed.acceleration - want.acceleration).max() < 1e-9 * scale
    other = tuple(replace(body, centroid=body.height - body.centroid) for body in values.bodies)
    turned = stack.solve(replace(values, bodies=other), replace(state, a=np.zeros_like(state.a)), h, load, "locked")
    assert np.abs(turned.acceleration - want.acceleration).max() > 1e-3 * scale
    told = {value.name: value.meaning for value in contract.BODY}["centroid"]
    page = (ROOT / "docs" / "scene.md").read_text(encoding="utf-8")
    for text in (told, Body.__doc__ or "", page):
        assert "(3.6)" in text and "(3.10)" in text


@pytest.mark.parametrize("layout", OFTEN_LAYOUTS)
def test_velocity_and_acceleration_are_rates_of_position(layout):
    """v = dr/dt and a = dv/dt of the emitted C, by sixth-order differences along q(t) = q + v t + a t^2/2."""
    values, state, _, _ = sensible(layout, 5)
    bearing, model = bearing_of(values), model_of(layout)
    base = state.base
    start = np.array(
        [
            np.r_[base.displacement, base.angles],
            np.r_[base.velocity, base.rates],
            np.r_[base.acceleration, base.rate_rates],
        ]
    )

    def at(t: float) -> dict[str, np.ndarray]:
        moved = np.array([start[0] + t * start[1] + t**2 / 2 * start[2], start[1] + t * start[2], start[2]])
        return model.kinematics(
            bearing, state.q + t * state.v + t**2 / 2 * state.a, state.v + t * state.a, state.a, base=moved
        )

    step, weights = 1e-3, {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
    around, here = {i: at(i * step) for k in weights for i in (k, -k)}, at(0.0)
    for name, vector in here.items():
        if name[0] not in "rv" or "_" not in name:
            continue
        rate = sum(w * (around[k][name] - around[-k][name]) for k, w in weights.items()) / step
        want = here["va"["rv".index(name[0])] + name[1:]]
        assert np.abs(rate - want).max() < 1e-10 * (1 + np.abs(want).max()), name
        assert np.isfinite(vector).all()


@pytest.mark.parametrize(
    ("layout", "spin"),
    thinned(product([(2, 1, 0), (3, 2, 0), (5, 2, 2), (5, 3, 1)], SPINS), often),
)
def test_report_jacobians_against_differences(layout, spin):
    # The steps of the differences must not cross a kink: in state 6 of (5,2,2) one is 0.3 to 1 mrad away.
    values, state, h, load = sensible(layout, 7 if layout == SPUN else 6)
    bearing, model, count = bearing_of(values), model_of(layout, spin=spin), layout[0] - 1
    a, angles, normal = unknowns_of(np.random.default_rng(1), count)
    u = np.concatenate([a.ravel(), angles.ravel(), normal])
    s = np.concatenate([state.q.ravel(), state.v.ravel(), h.ravel()])
    base = state.base
    e = np.concatenate(
        [np.zeros(6), base.acceleration, base.angles, base.rates, base.rate_rates, load.force, load.moment]
    )

    def residual(u: np.ndarray, s: np.ndarray, e: np.ndarray) -> np.ndarray:
        q, v, f = s[: 3 * count].reshape(-1, 3), s[3 * count : 6 * count].reshape(-1, 3), s[6 * count :].reshape(-1, 2)
        return model.residual(
            bearing,
            q,
            v,
            f,
            u,
            base_acceleration=e[6:9],
            base_rotation=(e[9:12], e[12:15], e[15:18]),
            top_force=e[18:21],
            top_moment=e[21:24],
        )

    # The patch is smooth over w0 = 0.01 rad/s only: there the differences need short steps, and rounding leaves less.
    step, accuracy = (1e-3, 3e-7) if spin == "patch" else (1e-2, 1e-8)
    checks = {
        "unknowns": (
            lambda x: residual(x, s, e),
            u,
            np.where(np.abs(u) > 1e3, 10.0, np.where(np.abs(u) < 0.2, step / 10, step)),
        ),
        "state": (lambda x: residual(u, x, e), s, np.full(len(s), step / 10)),
        "inputs": (lambda x: residual(u, s, x), e, np.where(np.arange(len(e)) >= 18, 10.0, step)),
    }
    for wrt, (function, x, steps) in checks.items():
        found = model.jacobian(bearing, state.q, state.v, h, u, wrt=wrt, **inputs(state, load))
        want = differences(function, x, steps)
        scale = np.abs(want).max(axis=1, keepdims=True) + np.abs(found).max(axis=1, keepdims=True) + 1e-9
        assert np.abs((found - want) / scale).max() < accuracy, wrt


@pytest.mark.parametrize("beta", [0.0, 1e-3])
@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"spin": "patch"},
        {"spin": "free"},
        pytest.param({"bouc_wen": "isotropic"}, marks=pytest.mark.slow),
        {"bouc_wen": "plastic"},
        pytest.param({"sliders": "massless"}, marks=pytest.mark.slow),
        {"dimension": "planar"},
        {"dimension": "planar", "sliders": "massless"},
    ],
    ids=str,
)
@pytest.mark.parametrize("damped", [False, True], ids=("undamped", "damped"))
def test_combined_tangent_of_the_condensed_step(effects, beta, damped):
    """The tangent of the implicit step, seeded with its own factors, against differences of its residual."""
    tangent, want, _ = tangents((5, 2, 2), effects, beta, damped=damped)
    assert np.abs(tangent - want).max() < 1e-7 * np.abs(want).max()


STACKS = (
    {},
    {"spin": "free"},
    {"spin": "patch"},
    {"dimension": "planar"},
    {"sliders": "massless"},
    {"dimension": "planar", "sliders": "massless"},
)
TOPS = (
    Top.rig(0.0, 1e6, 1e4, 1e7, 1e5),
    Top.mass(3e3, 2e3, 0.3, rotational_stiffness=1e7),
    Top.rig(0.0, 1e6, 1e4, 1e7, 1e5, vertical_stiffness=1e5, vertical_damping=1e3),
    Top.mass(3e3, 2e3, 0.3, rotational_stiffness=1e7, vertical_stiffness=1e5, vertical_damping=1e3),
)
FOOT = np.array([0.0, 0.1])  # of the supported mass, far below the top plate: the springs press the stack together


BELOW = [*product([(2, 1, 0), (4, 2, 1), (5, 2, 2), (5, 1, 3), (11, 5, 5)], STACKS), ((7, 3, 3), {})]


def other_tests_build(layout, effects):
    """Every effect in one layout, and one surface.

    The others: numbers of surfaces that do not fill the vectors, and ten surfaces where friction follows the slip of a
    step, whose tangent gcc 12.2 compiled wrongly for AVX-512.
    """
    return (layout == (5, 2, 2) and effects != {"sliders": "massless"}) or (layout == (2, 1, 0) and not effects)


@pytest.mark.parametrize("top", TOPS, ids=str)
@pytest.mark.parametrize(("layout", "effects"), thinned(BELOW, other_tests_build), ids=str)
def test_tangent_in_any_stack_below_any_top(layout, effects, top):
    """On a base that moves and turns, with every rim met."""
    tangent, want, away = tangents(layout, effects, 1e-3, top=top, base_moves=True, capacity=1e-4)
    assert np.abs(tangent - want).max() < 1e-7 * np.abs(want).max()
    assert np.abs(away - tangent).max() > 1e-5 * np.abs(tangent).max(), "rims are met"


def tangents(layout, effects, beta, top=None, base_moves=False, capacity=None, damped=False):
    """The tangent, the same by differences of the residual, and the tangent with every rim far away."""
    values, state, h, load = sensible(layout, 7)
    values = sheared(values) if damped else values
    model = model_of(layout, **effects)
    bearing = bearing_of(values)
    if capacity:
        bearing = bearing.replace(capacity=[capacity] * (layout[0] - 1))
    compiled = model.stack(bearing, top)
    planar = effects.get("dimension") == "planar"
    keep = np.array([0.0, 1.0, 0.0]) if planar else np.ones(3)
    q, v, a = (np.ascontiguousarray(x * keep) for x in (state.q, state.v, state.a))
    f = np.ascontiguousarray(0.5 * h * [1.0, 0.0 if planar else 1.0])
    in_plane = np.array([1, 0, 1, 0, 1, 0]) if planar else np.ones(6)
    base = np.random.default_rng(1).uniform(-0.1, 0.1, (3, 6)) * in_plane * base_moves
    ld = np.r_[load.force, load.moment] * in_plane
    cq, cv, ca = 1e-3, 1.0, 1e3
    angles = [1] if planar else [0, 1] if effects.get("spin", "locked") == "locked" else [0, 1, 2]

    def residual(x: np.ndarray) -> np.ndarray:
        d = np.zeros_like(q)
        d[:, angles] = x.reshape(-1, len(angles))
        moved = q + cq * d, v + cv * d, a + ca * d
        status, r, _, _ = compiled.condensed(*moved, f, base, ld, cq, cv, ca, beta, foot=FOOT)
        assert status == "ok"
        return r

    n = (layout[0] - 1) * len(angles)
    _, _, tangent, _ = compiled.condensed(q, v, a, f, base, ld, cq, cv, ca, beta, foot=FOOT)
    want = differences(residual, np.zeros(n), np.full(n, 1e-5))
    away = model.stack(bearing_of(values), top).condensed(q, v, a, f, base, ld, cq, cv, ca, beta, foot=FOOT)[2]
    return tangent, want, away


@pytest.mark.parametrize("plane", ["E1-E3", "E2-E3"])
@pytest.mark.parametrize("layout", [pytest.param((3, 1, 1), marks=pytest.mark.slow), (5, 2, 2)])
def test_planar_equals_spatial(layout, plane):
    values, state, h, load = sensible(layout, 8)
    second = plane == "E2-E3"
    angle = np.array([1.0, 0.0, 0.0] if second else [0.0, 1.0, 0.0])
    q, v, f = state.q * angle, state.v * angle, h * ([0.0, 1.0] if second else [1.0, 0.0])
    axis = np.array([0.0, 1.0, 1.0] if second else [1.0, 0.0, 1.0])
    given = {
        "base_acceleration": state.base.acceleration * axis,
        "top_force": load.force * axis,
        "top_moment": load.moment * angle,
        "base_rotation": (state.base.angles * angle, state.base.rates * angle, state.base.rate_rates * angle),
    }
    bearing = bearing_of(values)
    flat = model_of(layout, dimension="planar").evaluate(bearing, q, v, f, **given)
    full = model_of(layout).evaluate(bearing, q, v, f, **given)
    assert np.abs(flat.acceleration - full.acceleration).max() < 1e-9 * np.abs(full.acceleration).max()
    assert np.abs(flat.normal_force - full.normal_force).max() < 1e-10 * full.normal_force.max()
    assert np.abs(flat.contact_angles - full.contact_angles).max() < 1e-12
    assert np.abs(flat.friction_rate - full.friction_rate).max() < 1e-9 * np.abs(full.friction_rate).max()


def test_a_column_costs_a_body_a_third_of_what_its_fields_would():
    """Operations of one column at one body: of rigid bodies on each other, and field by field."""
    from msfp_gen.generator.derive import derive
    from msfp_gen.generator.drivers import variable_kernels
    from msfp_gen.generator.lower import lower
    from msfp_gen.specification.layout import Effects, Layout, ModelSpec

    equations = derive(ModelSpec(Layout.tfp(), Effects()))
    fast = [lower(program) for program in equations.programs]
    kernels = {kernel.program.name: kernel.tangent_operations for kernel in (*fast, *variable_kernels(equations))}
    fields = tuple(
        f"{name}_by_variables"
        for name in ("forward", "surface_local", "moment_to_world", "interface_force", "angular_balance")
    )
    twists = ("variation_of_rates", "transported_force", "force_to_local", "turning_balance")
    assert 3 * sum(kernels[name] for name in twists) < sum(kernels[name] for name in fields)
