"""The reference against itself: derivatives, symmetry, energy, elementary pendulums."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from reference import energy, forces
from reference.cases import LAYOUTS, MIRROR, QUARTER, SOME, random_case, rim_of
from reference.kinematics import State, along, points, rate, rotate, rotation
from reference.parameters import Array, Body, Counts, Stack, Surface
from reference.stack import Load, Solution, interfaces, solve
from support import thinned

SPINS = ["free", "patch", "locked"]


@pytest.fixture(params=LAYOUTS, ids=str)
def layout(request: pytest.FixtureRequest) -> tuple[int, int, int]:
    return request.param  # type: ignore[no-any-return]


def reader(stack: Stack, kind: str, name: str) -> Callable[[State], Array]:
    """The position ("r") or velocity ("v") of one named point as a function of the state."""
    return lambda state: getattr(points(stack, state), kind)[name]


def test_velocities_and_accelerations_are_derivatives(layout: tuple[int, int, int]) -> None:
    stack, state, _, _ = random_case(layout, 0)
    here = points(stack, state)
    assert len(here.r) == 3 + 4 * (layout[0] - 1)
    for name in here.r:
        assert here.v[name] == pytest.approx(rate(reader(stack, "r", name), state), abs=1e-12)
        assert here.a[name] == pytest.approx(rate(reader(stack, "v", name), state), abs=1e-11)


def test_bases_are_the_printed_rotation_tensors() -> None:
    """(2.3)-(2.5) as dyads, applied to a basis that is already turned."""
    psi, theta, e = 0.3, -0.2, rotate(0.5, 0.4, np.eye(3))

    def tensor(angle: float, axis: int, basis: Array) -> Array:
        i, j, k = (basis[(axis + shift) % 3] for shift in range(3))  # turns j to k about i
        turning: Array = np.cos(angle) * (np.outer(j, j) + np.outer(k, k))
        turning += np.sin(angle) * (np.outer(k, j) - np.outer(j, k)) + np.outer(i, i)
        return turning

    first = tensor(psi, 0, e)
    assert rotate(psi, theta, e) == pytest.approx(e @ (tensor(theta, 1, e @ first.T) @ first).T, abs=1e-15)


def test_complex_step_agrees_with_central_differences() -> None:
    stack, state, _, _ = random_case((5, 2, 2), 1)
    d = 1e-3
    r = {i: points(stack, along(state, i * d)).r["55"] for i in (-2, -1, 1, 2)}
    central = (8 * (r[1] - r[-1]) - (r[2] - r[-2])) / (12 * d)
    assert points(stack, state).v["55"] == pytest.approx(central, abs=1e-8)


def spinning_basis(state: State, k: int) -> Array:
    """Rows fixed in the material of body k: the basis t^k turned by phi_k about t_3^k."""
    t1, t2, t3 = rotation(state).t[k]
    phi = np.vstack([state.base.angles, state.q])[k - 1, 2]
    return np.array([np.cos(phi) * t1 + np.sin(phi) * t2, np.cos(phi) * t2 - np.sin(phi) * t1, t3])


def total_spin(state: State, k: int) -> Array:
    return rotation(state).w_total[k]


def test_angular_velocity_turns_the_material(layout: tuple[int, int, int]) -> None:
    """(2.29) and (3.12) with phi'_1 t_3^1 for every body, and (2.57) ff.; the printed phi'_1 t_2^1 fails."""
    _, state, _, _ = random_case(layout, 2)
    turn = rotation(state)
    for k in range(1, layout[0] + 1):
        basis, moved = spinning_basis(state, k), rate(partial(spinning_basis, k=k), state)
        assert moved == pytest.approx(np.cross(turn.w_total[k], basis), abs=1e-12)
        assert turn.dw_total[k] == pytest.approx(rate(partial(total_spin, k=k), state), abs=1e-12)
    printed = state.base.rates[2] * turn.t[1][1] + turn.w[1]
    moved = rate(lambda s: spinning_basis(s, 1), state)
    assert np.abs(moved - np.cross(printed, spinning_basis(state, 1))).max() > 1e-3


@pytest.mark.parametrize("seed", thinned(range(3), lambda seed: seed == 0))
@pytest.mark.parametrize("spin", SPINS)
def test_energy_balances(layout: tuple[int, int, int], spin: str, seed: int) -> None:
    stack, state, h, load = random_case(layout, 10 + seed)
    found = solve(stack, replace(state, a=np.zeros_like(state.q)), h, load, spin)
    state = replace(state, a=found.acceleration)
    stored = rate(lambda s: energy.kinetic_energy(stack, s) + energy.potential_energy(stack, s), state)
    power = energy.powers(stack, state, h, found, load, spin)
    assert stored == pytest.approx(sum(power.values()), abs=1e-8 * max(map(abs, power.values())))
    if spin != "locked":
        assert abs(power["lock"]) < 1e-6
    else:
        assert np.abs(found.acceleration[:, 2]).max() < 1e-9


def test_energy_cases_reach_the_rims() -> None:
    """Otherwise the test above would say nothing about them: k s_c = 1e4 N, angles up to 0.08 rad x 0.6 m > 0.02 m."""
    pressed = [np.any(rim_of(*random_case(layout, 10 + seed)[:2]).force) for layout in LAYOUTS for seed in range(3)]
    assert sum(pressed) >= 6


@pytest.mark.slow
def test_drilling_dissipates_and_rims_push_back() -> None:
    for seed in range(6):
        stack, state, h, load = random_case((5, 2, 2), 30 + seed)
        found = solve(stack, replace(state, a=np.zeros_like(state.q)), h, load, "patch")
        power = energy.powers(stack, state, h, found, load, "patch")
        assert power["drilling"] < 0
        rim = rim_of(stack, state)
        for g, force in enumerate(rim.force, start=1):
            pulled = points(stack, state).r[f"{g}{g + 1}"] - points(stack, state).r[f"{g}{g}"]
            assert force @ pulled <= 0  # back to the centre, or nothing


def turned(stack: Stack, state: State, h: Array, found: Solution, Q: Array) -> tuple[State, Array]:
    """The same motion with space turned (or mirrored) by Q; Euler angles, spins and Y, Z are worked out anew."""
    proper = np.linalg.det(Q)
    turn = rotation(state)
    touch = interfaces(stack, turn, points(stack, state), h, found.contact_angles, found.normal_force, "free").touch
    q, v, n = np.zeros_like(state.q), np.zeros_like(state.v), stack.layout.n
    blank = State(q, v, np.zeros_like(q))
    for k in range(2, n + 1):
        q[k - 2, :2] = angles_of(Q @ turn.t[k][2], rotation(blank).t[k - 1])
        frame = rotation(blank)
        axes = np.array([frame.t[k - 1][0], frame.t[k][1], frame.t[k][2]]).T
        v[k - 2] = np.linalg.solve(axes, proper * Q @ turn.w_total[k] - frame.w[k - 1])
    frame = rotation(blank)
    new = np.array([angles_of(Q @ touch.basis[g - 1, 2], frame.t[g]) for g in range(1, n)])
    basis = forces.contact(stack, frame, points(stack, blank).r, new).basis
    vectors = np.einsum("gi,gij->gj", h, touch.basis[:, :2]) @ Q.T
    return blank, np.einsum("gij,gj->gi", basis[:, :2], vectors)


def angles_of(direction: Array, basis: Array) -> Array:
    """psi, theta such that R(psi, theta) carries basis[2] to direction."""
    x, y, z = basis @ direction
    return np.array([np.arctan2(-y, z), np.arcsin(x)])


@pytest.mark.parametrize(
    "Q", thinned([QUARTER, MIRROR, SOME], lambda Q: Q is not QUARTER), ids=["quarter turn", "mirror", "any turn"]
)
@pytest.mark.parametrize("spin", ["free", "patch"])
def test_space_has_no_preferred_azimuth(layout: tuple[int, int, int], spin: str, Q: Array) -> None:
    stack, state, h, load = random_case(layout, 40)
    state = State(state.q, state.v, np.zeros_like(state.q))
    found = solve(stack, state, h, load, spin)
    other, other_h = turned(stack, state, h, found, Q)
    other_load = Load(Q @ load.force, np.linalg.det(Q) * Q @ load.moment)
    again = solve(stack, other, other_h, other_load, spin)
    assert again.normal_force == pytest.approx(found.normal_force, rel=1e-9)
    here = points(stack, replace(state, a=found.acceleration)).a
    there = points(stack, replace(other, a=again.acceleration)).a
    scale = max(np.abs(a).max() for a in here.values())
    for name in here:
        assert there[name] == pytest.approx(Q @ here[name], abs=1e-8 * scale)


def test_planar_motion_reads_the_same_in_both_planes(layout: tuple[int, int, int]) -> None:
    """A motion in E1-E3 (theta, Y) and the same in E2-E3 (psi = -theta, Z = Y): model choice 8, exact."""
    stack, state, h, _ = random_case(layout, 50)
    rows = len(h)
    theta, rate_, Y = state.q[:, 1], state.v[:, 1], h[:, 0]
    flat = np.zeros((rows, 3))
    one = solve(
        stack,
        State(columns(rows, 1, theta), columns(rows, 1, rate_), flat),
        pair(Y, 0),
        Load(np.array([3e2, 0.0, -1e4]), np.array([0.0, 40.0, 0.0])),
    )
    two = solve(
        stack,
        State(columns(rows, 0, -theta), columns(rows, 0, -rate_), flat),
        pair(Y, 1),
        Load(np.array([0.0, 3e2, -1e4]), np.array([-40.0, 0.0, 0.0])),
    )
    assert two.normal_force == pytest.approx(one.normal_force, rel=1e-11)
    assert two.acceleration[:, 0] == pytest.approx(-one.acceleration[:, 1], rel=1e-9)
    assert two.contact_angles[:, 0] == pytest.approx(-one.contact_angles[:, 1], rel=1e-9)
    assert np.abs(one.acceleration[:, ::2]).max() < 1e-9


def columns(rows: int, column: int, values: Array) -> Array:
    table = np.zeros((rows, 3))
    table[:, column] = values
    return table


def pair(values: Array, column: int) -> Array:
    return columns(len(values), column, values)[:, :2]


def test_the_packages_own_bearing_is_understood() -> None:
    """The records here and `scene.bearing` share their field names, so tests can pass one bearing to both sides."""
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.bearing import Body as RealBody
    from msfp_gen.scene.bearing import Surface as RealSurface
    from msfp_gen.specification.layout import Layout

    stack, state, _, _ = random_case((5, 3, 1), 3)
    values = {name: value for name, value in vars(stack).items() if name not in ("layout", "surfaces", "bodies")}
    bearing = Bearing(
        layout=Layout(5, 3, 1),
        surfaces=[RealSurface(**vars(s)) for s in stack.surfaces],
        bodies=[RealBody(**vars(b)) for b in stack.bodies],
        **values,
    )
    ours, theirs = points(stack, state), points(bearing, state)
    assert all(np.array_equal(ours.a[name], theirs.a[name]) for name in ours.a)


# Elementary pendulums ---------------------------------------------------------------------------------------------


def pendulum(mu: float = 0.0, centroid: float = 1e-9) -> Stack:
    """A point-like puck in a bowl of 0.5 m."""
    body = Body(height=2e-9, centroid=centroid, mass=2.0, inertia=(1e-12, 1e-12), rim_radius=0.0, rim_offset=0.0)
    return Stack(Counts(2, 1, 0), (Surface(0.5, 1.0, mu, 1e-4, 1e6, 0.0),), (body,), 0.01)


NO_LOAD = Load(np.zeros(3), np.zeros(3))


def test_frictionless_puck_is_a_pendulum() -> None:
    theta, swing = 0.4, 0.9
    state = State(np.array([[0.0, theta, 0.0]]), np.array([[0.0, swing, 0.0]]), np.zeros((1, 3)))
    found = solve(pendulum(), state, np.zeros((1, 2)), NO_LOAD)
    assert found.acceleration[0] == pytest.approx([0.0, -9.8 / 0.5 * np.sin(theta), 0.0], abs=1e-6)
    assert found.normal_force[0] == pytest.approx(2.0 * (9.8 * np.cos(theta) + 0.5 * swing**2), rel=1e-7)


def test_compound_pendulum_by_hand() -> None:
    """J theta'' + m (R - z)^2 theta'' = -m g (R - z) sin(theta), any slider size."""
    body = Body(0.1, 0.06, 3.0, (0.02, 0.03), 0.05, 0.0)
    stack = replace(pendulum(), bodies=(body,))
    found = solve(
        stack,
        State(np.array([[0.3, 0.0, 0.0]]), np.zeros((1, 3)), np.zeros((1, 3))),
        np.zeros((1, 2)),
        NO_LOAD,
        "locked",
    )
    arm = 0.5 - 0.06
    assert found.acceleration[0, 0] == pytest.approx(-3.0 * 9.8 * arm * np.sin(0.3) / (0.02 + 3.0 * arm**2), rel=1e-10)


@pytest.mark.slow
def test_period_is_the_elliptic_integral() -> None:
    from scipy.integrate import solve_ivp
    from scipy.special import ellipk

    theta, bowl = 0.6, pendulum()

    def motion(t: float, y: Array) -> list[float]:
        state = State(np.array([[0.0, y[0], 0.0]]), np.array([[0.0, y[1], 0.0]]), np.zeros((1, 3)))
        return [y[1], float(solve(bowl, state, np.zeros((1, 2)), NO_LOAD).acceleration[0, 1])]

    def bottom(t: float, y: Array) -> float:
        return float(y[0])

    bottom.terminal = True  # type: ignore[attr-defined]
    run = solve_ivp(motion, (0.0, 2.0), [theta, 0.0], method="DOP853", rtol=1e-8, atol=1e-10, events=bottom)
    quarter = np.sqrt(0.5 / 9.8) * ellipk(np.sin(theta / 2) ** 2)
    assert run.t_events[0][0] == pytest.approx(quarter, rel=1e-7)


def test_sliding_puck_slows_by_mu_g() -> None:
    """At the bottom of the bowl with Y = 1: N = m g + m v^2/R, and the acceleration is -mu N/m."""
    mu, speed = 0.1, -0.4  # body 2 tilts by -theta as it moves to +E1
    state = State(np.zeros((1, 3)), np.array([[0.0, speed, 0.0]]), np.zeros((1, 3)))
    bowl = pendulum(mu)
    found = solve(bowl, state, np.array([[1.0, 0.0]]), NO_LOAD, "locked")
    at = points(bowl, replace(state, a=found.acceleration))
    assert at.v["2"][0] == pytest.approx(0.2, rel=1e-6)
    # the interface acts along the line through the puck: friction mu N at the contact, N through the sphere centre
    P = 2.0 * (at.a["2"] + [0.0, 0.0, 9.8])
    assert np.hypot(P[0], P[2]) == pytest.approx(found.normal_force[0] * np.hypot(1.0, mu), rel=1e-9)
    assert at.a["2"][0] == pytest.approx(-mu * (9.8 + 0.5 * speed**2), rel=1e-5)
