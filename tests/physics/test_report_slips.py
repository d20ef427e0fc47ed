"""The slips of PEER Report 2017/07, one by one: the corrected reading holds, and the printed one does not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from reference import energy, forces
from reference.cases import QUARTER, SOME, random_case, rim_of
from reference.kinematics import State, points, rate, rotation
from reference.parameters import Array, Stack, random_stack
from reference.stack import Load, balances


@pytest.fixture
def triple() -> tuple[Stack, State, Array, Load]:
    return random_case((5, 2, 2), 60)


def test_slip_2_11_bottom_of_body_two_follows_its_own_tilt(triple: tuple[Stack, State, Array, Load]) -> None:
    stack, state, _, _ = triple
    at, turn, R = points(stack, state), rotation(state), stack.surfaces[0].radius
    assert at.r["12"] == pytest.approx(at.r["1c"] - R * turn.t[2][2], abs=1e-15)
    assert np.linalg.norm(at.r["1c"] - R * turn.t[1][2] - at.r["11"]) < 1e-15  # as printed it never leaves r_11


def test_slip_2_20_body_four_is_as_tall_as_its_own_height(triple: tuple[Stack, State, Array, Load]) -> None:
    stack, state, _, _ = triple
    at = points(stack, state)
    for k in range(2, 6):
        height = np.linalg.norm(at.r[f"{k}{k}"] - at.r[f"{k - 1}{k}"])
        assert height == pytest.approx(stack.bodies[k - 2].height, rel=1e-12)
    assert stack.bodies[1].height != pytest.approx(stack.bodies[2].height)


def printed_velocities(stack: Stack, state: State) -> dict[str, Any]:
    """(2.39), (2.41), (2.53) as printed."""
    v, turn, R = points(stack, state).v, rotation(state), [s.radius for s in stack.surfaces]
    assert stack.base_centroid is not None
    return {
        "11": v["1"] + stack.base_centroid * np.cross(turn.w[1], turn.t[1][2]),
        "12": v["1c"] + R[0] * np.cross(turn.w[1], turn.t[1][2]),
        "45": v["4c"] + R[3] * np.cross(turn.w[4], turn.t[4][2]),
    }


@pytest.mark.parametrize("name", ["11", "12", "45"])
def test_slips_2_39_2_41_2_53_are_not_derivatives(triple: tuple[Stack, State, Array, Load], name: str) -> None:
    stack, state, _, _ = triple
    true = rate(lambda s: points(stack, s).r[name], state)
    assert points(stack, state).v[name] == pytest.approx(true, abs=1e-12)
    assert np.abs(printed_velocities(stack, state)[name] - true).max() > 1e-4


def test_slips_3_14_2_90_contact_point_lies_on_its_own_sphere(triple: tuple[Stack, State, Array, Load]) -> None:
    """A normal along t_3 of the body below points at that body's centre of contact: r_gg, for every surface."""
    stack, state, _, _ = triple
    turn, at = rotation(state), points(stack, state)
    touch = forces.contact(stack, turn, at.r, np.zeros((4, 2)))
    for g in range(1, 5):
        assert touch.point[g - 1] == pytest.approx(at.r[f"{g}{g}"], abs=1e-13)
    printed = at.r["3c"] - stack.surfaces[2].radius * touch.basis[2, 2]
    assert np.linalg.norm(printed - at.r["33"]) > 0.1


def test_slip_2_98_slip_lies_in_the_contact_plane(triple: tuple[Stack, State, Array, Load]) -> None:
    stack, state, h, _ = triple
    turn, at = rotation(state), points(stack, state)
    touch = forces.contact(stack, turn, at.r, np.full((4, 2), 0.02))
    assert np.abs((touch.velocity * touch.basis[:, 2]).sum(axis=1)).max() < 1e-14
    assert np.hypot(*touch.slip.T) == pytest.approx(np.linalg.norm(touch.velocity, axis=1), rel=1e-12)
    friction = forces.friction_forces(stack, np.ones(4), h, touch)
    taken = energy.friction_power(stack, h, np.ones(4), touch.slip).total
    assert (friction * touch.velocity).sum(axis=1) == pytest.approx(-taken, rel=1e-10)


def test_slip_2_94_each_surface_uses_its_own_velocity(triple: tuple[Stack, State, Array, Load]) -> None:
    stack, _, h, _ = triple
    slip = np.random.default_rng(3).uniform(-1.0, 1.0, (4, 2))
    before = forces.friction_rates(stack, h, slip)
    slip[1] += 0.5
    assert forces.friction_rates(stack, h, slip)[[0, 2, 3]] == pytest.approx(before[[0, 2, 3]], abs=0.0)


@pytest.mark.parametrize("law", ["report", "isotropic"])
def test_slip_2_94_yield_displacement_is_a_length(triple: tuple[Stack, State, Array, Load], law: str) -> None:
    """Along one axis from rest dY/ds = (1 - Y^2)/d_y: after a slip d_y, Y = tanh(1), whatever R."""
    from scipy.integrate import solve_ivp

    stack, _, _, _ = triple
    d_y = stack.surfaces[1].yield_displacement

    def flow(s: float, Y: Array) -> Array:
        h = np.tile([Y[0], 0.0], (4, 1))
        rates: Array = forces.friction_rates(stack, h, np.tile([1.0, 0.0], (4, 1)), law)[1, :1]
        return rates

    run = solve_ivp(flow, (0.0, d_y), [0.0], rtol=1e-10, atol=1e-12)
    assert run.y[0, -1] == pytest.approx(np.tanh(1.0), rel=1e-8)


@pytest.mark.parametrize("law", ["report", "isotropic"])
def test_friction_power_splits_into_stored_and_lost(triple: tuple[Stack, State, Array, Load], law: str) -> None:
    stack, _, _, _ = triple
    rng = np.random.default_rng(4)
    d_y, mu = (np.array([getattr(s, name) for s in stack.surfaces]) for name in ("yield_displacement", "friction"))
    for _ in range(50):
        h, slip, normal = rng.uniform(-0.7, 0.7, (4, 2)), rng.uniform(-1.0, 1.0, (4, 2)), rng.uniform(1.0, 2.0, 4)
        power = energy.friction_power(stack, h, normal, slip, law)
        stored = mu * normal * d_y * (h * forces.friction_rates(stack, h, slip, law)).sum(axis=1)
        assert power.recoverable == pytest.approx(stored, rel=1e-10, abs=1e-12)
        assert power.dissipated.min() >= 0.0


def test_isotropic_law_turns_with_the_path_and_the_reports_does_not(triple: tuple[Stack, State, Array, Load]) -> None:
    stack, _, _, _ = triple
    rng = np.random.default_rng(5)
    h, slip = rng.uniform(-0.7, 0.7, (4, 2)), rng.uniform(-1.0, 1.0, (4, 2))
    Q, quarter = SOME[:2, :2], QUARTER[:2, :2]

    def gap(law: str, Q: Array) -> float:
        turned_rates = forces.friction_rates(stack, h @ Q.T, slip @ Q.T, law)
        return float(np.abs(turned_rates - forces.friction_rates(stack, h, slip, law) @ Q.T).max())

    assert gap("isotropic", Q) < 1e-9
    assert gap("report", quarter) < 1e-9
    assert gap("report", Q) > 1.0


def test_slip_3_25_rim_of_a_downward_cup_is_touched_on_the_far_side() -> None:
    """Inside its cup the slider sits off centre; the rim it meets is one slider radius and the offset away."""
    stack, state = tilted_triple()
    rim, at = rim_of(stack, state), points(stack, state)
    for g in (1, 2, 3, 4):
        cup = at.r[f"{g}{g}"] if g <= 2 else at.r[f"{g}{g + 1}"]
        near = at.r[f"{g}{g + 1}"] if g <= 2 else at.r[f"{g}{g}"]
        toward = (near - cup) @ (rim.point[g - 1] - near)
        assert toward > 0, "the rim is met on the side the slider has moved to"
    printed = rim.point[2] + 2 * stack.bodies[1].rim_radius * rim.direction[2]
    assert (at.r["33"] - at.r["34"]) @ (printed - at.r["33"]) < 0  # + r f_b: the side it has left


def test_slip_3_25_does_not_change_the_moment() -> None:
    stack, state = tilted_triple()
    rim, at = rim_of(stack, state), points(stack, state)
    assert np.linalg.norm(rim.force, axis=1).min() > 1.0
    for g, body in ((3, stack.bodies[1]), (4, stack.bodies[2])):
        arm = rim.point[g - 1] - at.r[f"{g}"]
        printed = arm + 2 * body.rim_radius * rim.direction[g - 1]
        force = rim.force[g - 1]
        assert np.cross(printed, force) == pytest.approx(np.cross(arm, force), abs=1e-10 * np.abs(force).max())


def tilted_triple() -> tuple[Stack, State]:
    stack = random_stack(np.random.default_rng(7), 5, 2, 2)
    q = np.array([[0.05, 0.3, 0.0], [-0.1, 0.3, 0.0], [0.1, -0.4, 0.0], [-0.2, -0.3, 0.0]])
    return stack, State(q, np.zeros((4, 3)), np.zeros((4, 3)))


def test_slip_3_23_damping_multiplies_the_gap_rate() -> None:
    stack, state = tilted_triple()
    state = replace(state, v=np.array([[0.0, 0.2, 0.0], [0.0, 0.3, 0.0], [0.1, -0.2, 0.0], [0.0, -0.2, 0.0]]))
    rim = rim_of(stack, state)
    assert rim.gap_rate == pytest.approx(rate(lambda s: rim_of(stack, s).gap, state), rel=1e-10)
    for g, surface in enumerate(stack.surfaces):
        magnitude = surface.rim_stiffness * rim.gap[g] + surface.rim_damping * rim.gap_rate[g]
        assert rim.force[g] @ rim.direction[g] == pytest.approx(min(magnitude, 0.0), rel=1e-12)


def test_rims_never_pull() -> None:
    stack, state = tilted_triple()
    surfaces = tuple(replace(s, rim_damping=1e9) for s in stack.surfaces)
    fast_release = replace(state, v=-10.0 * state.q)
    assert not np.any(rim_of(replace(stack, surfaces=surfaces), fast_release).force)


def test_slip_3_29_spin_of_the_top_plate_counts(triple: tuple[Stack, State, Array, Load]) -> None:
    """The rate of J w' is what (3.29) must hold; with w instead of w' it does not."""
    stack, state, h, _ = triple

    def momentum(s: State, total: bool) -> Array:
        frame = rotation(s)
        transverse, axial = stack.bodies[3].inertia
        w = (frame.w_total if total else frame.w)[5]
        parts = (np.array([transverse, transverse, axial]) * (frame.t[5] @ w))[:, None] * frame.t[5]
        moment: Array = parts.sum(axis=0)
        return moment

    without = balances(stack, state, h, np.zeros((4, 2)), np.zeros(4), Load(np.zeros(3), np.zeros(3)), rims=False)
    assert without.angular[3] == pytest.approx(rate(lambda s: momentum(s, True), state), abs=1e-12)
    assert np.abs(without.angular[3] - rate(lambda s: momentum(s, False), state)).max() > 1e-4


def test_slip_2_85_one_contact_basis_per_surface(triple: tuple[Stack, State, Array, Load]) -> None:
    """Four surfaces, four bases t~: only then do (2.110)-(2.117) hold as many equations as unknowns (2.119)."""
    stack, state, h, _ = triple
    touch = forces.contact(stack, rotation(state), points(stack, state).r, np.zeros((4, 2)))
    assert touch.basis.shape == (4, 3, 3)
    found = balances(stack, state, h, np.zeros((4, 2)), np.ones(4), Load(np.zeros(3), np.zeros(3)), rims=False)
    assert found.linear.size + found.angular.size == 3 * 4 + 2 * len(touch.basis) + 4


def test_slip_stage_v_slides_on_two_and_three() -> None:
    """With surfaces 1 and 4 at their rims nothing else is left; the text of section 4.1 says 3 and 4."""
    from msfp_gen import load_scene, simulate

    result = simulate(load_scene("fenz-monotonic"))
    first = {e.surface: e.time for e in reversed(result.events) if e.kind == "rim_contact"}
    history = result.history
    before = np.array([np.interp(first[4], history.time, column) for column in history.sliding.T])
    moved = history.sliding[-1] - before
    assert moved[[1, 2]].min() > 5 * moved[[0, 3]].max() > 0  # the rims give a little


def test_slip_4_1_weight_belongs_to_9_81() -> None:
    from msfp_gen import presets

    bearing = presets.bearing("fenz-tfp")
    mass = sum(body.mass for body in bearing.bodies)
    assert mass * 9.81 == pytest.approx(90.64, abs=0.005)
    assert mass * bearing.gravity == pytest.approx(90.55, abs=0.005)  # appendix A: g = 9.8
