"""Closed forms of the planar quasi-static stack: against elementary formulas, the full balances, and each other."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from reference.cases import LAYOUTS
from reference.forces import concave
from reference.friction_circle import Push, Transition, advance, centres, force_at, transitions
from reference.kinematics import State
from reference.parameters import Array, Body, Counts, Stack, Surface, fenz, random_stack
from reference.quasi_static import follow, friction_share
from reference.stack import Load, solve

N, K_THETA = 112e3, 1e6  # Table 4.1, Table A.4
LEVEL = 1e10  # [N m/rad] a plate that cannot tilt


def plain(radius: float, friction: float) -> Surface:
    return Surface(radius, 1.0, friction, 1e-4, 1e7, 0.0)


def test_single_pendulum_by_hand() -> None:
    """A free top plate on one surface: the line through r_nn touches the circle about c_1, at any tilt."""
    R, mu, top = 0.5, 0.05, Body(0.02, 0.01, 1.0, (1.0, 1.0), 0.0, 0.0)
    stack = Stack(Counts(2, 1, 0), (plain(R, mu),), (top,), 0.01)
    d, arm = np.array([0.001, 0.02, 0.1, 0.2]), R - 0.02
    tilt, circle = np.arcsin(d / arm), np.arcsin(mu * R / np.hypot(1, mu) / arm)
    force = force_at(Push(stack, N), list(d))
    assert force == pytest.approx(N * np.tan(tilt + circle), rel=1e-10)
    textbook = N * (d / arm + mu * R / arm)
    assert force[:2] == pytest.approx(textbook[:2], rel=5e-3)


def test_double_pendulum_by_hand() -> None:
    """Equal surfaces, level plates: the line crosses the slider's link half-way, tangent to both circles."""
    R, mu, height = 0.5, 0.05, 0.04
    slider, top = (Body(h, h / 2, 1.0, (1.0, 1.0), 0.0, 0.0) for h in (height, 0.02))
    stack = Stack(Counts(3, 1, 1), (plain(R, mu), plain(R, mu)), (slider, top), 0.01)
    d, link = np.array([0.01, 0.1, 0.3]), 2 * R - height
    angle = np.arcsin(d / link) + np.arcsin(2 * mu * R / np.hypot(1, mu) / link)
    assert force_at(Push(stack, N, LEVEL), list(d)) == pytest.approx(N * np.tan(angle), rel=1e-5)


@cache
def story(rotational_stiffness: float) -> dict[tuple[str, int], Transition]:
    told = transitions(Push(fenz(), N, rotational_stiffness), 0.14)
    return {(t.what, t.surface): t for t in told}


@pytest.mark.slow
def test_triple_pendulum_with_level_plates() -> None:
    """u** = 47.3 mm (formulas with effective radii give 39), and the five stages of Section 4.1 in order."""
    told = story(LEVEL)
    assert set(list(told)[:2]) == {("slides", 2), ("slides", 3)}
    assert list(told)[2:] == [("slides", 1), ("slides", 4), ("rim", 1), ("rim", 4)]
    assert told["slides", 4].at.displacement == pytest.approx(0.0473, abs=5e-5)


def test_triple_pendulum_on_the_rig() -> None:
    """Stage transitions of A.1 at k_theta = 1e6 N m/rad, rigid-plastic, sliders without weight: what came out."""
    told = story(K_THETA)
    found = {key: (1e3 * t.at.displacement, t.at.force / N) for key, t in told.items()}
    assert found["slides", 4] == pytest.approx((46.739, 0.12804), rel=1e-4)
    assert found["rim", 1] == pytest.approx((85.947, 0.17287), rel=1e-4)
    assert found["rim", 4] == pytest.approx((130.709, 0.26298), rel=1e-4)


def test_plate_tilt_moves_the_first_rim_by_two_millimetres() -> None:
    shift = story(K_THETA)["rim", 1].at.displacement - story(LEVEL)["rim", 1].at.displacement
    assert shift == pytest.approx(0.002, abs=2e-4)


def test_stuck_surfaces_two_and_three_stay_exactly_at_yield() -> None:
    """In stages II and III, seen as a line: tangent to circles whose centres ride on one rigid body."""
    push, told = Push(fenz(), N, K_THETA), story(K_THETA)
    for key, resting in ((("slides", 1), [1]), (("slides", 4), [1, 2])):
        here = told[key].at
        there = advance(push, here, here.displacement + 0.02)
        assert there.delta[resting] == pytest.approx(here.delta[resting], abs=1e-9)


@pytest.mark.parametrize("displacement", [0.0005, 0.03, 0.06])
def test_line_of_force_touches_the_circles(displacement: float) -> None:
    """Distances measured on the line itself, through the point of the top plane where the moment puts it."""
    push = Push(fenz(), N, K_THETA)
    last = [t.at for t in transitions(push, displacement)][-1]
    here = advance(push, last, displacement)
    spots, along = centres(push.bearing, here.delta), np.array([-here.force, N])
    point = spots[-1] + np.array([here.moment / N, 0.0])
    x, z = (point - spots[:-1]).T
    distance = np.abs(z * along[0] - x * along[1]) / np.hypot(*along)
    rho = np.array([s.friction * s.radius / np.hypot(1, s.friction) for s in push.bearing.surfaces])
    sliding = here.direction != 0
    assert distance[sliding] == pytest.approx(rho[sliding], rel=1e-9)
    assert np.all(distance[~sliding] < rho[~sliding])


def as_state(stack: Stack, delta: Array, Y: Array) -> tuple[State, Array]:
    """The same configuration for the full balances: theta = delta; u~ = -R theta' on concave-up surfaces (3.19)."""
    q, h = np.zeros((len(delta), 3)), np.zeros((len(delta), 2))
    q[:, 1], h[:, 0] = delta, -np.array(concave(stack)) * Y
    return State(q, np.zeros_like(q), np.zeros_like(q)), h


def nested(layout: tuple[int, int, int]) -> Stack:
    """A random stack whose radii shrink towards the middle, as in any real one (else it snaps through), early rims."""
    stack, m = random_stack(np.random.default_rng([*layout, 9]), *layout), layout[1]
    radii = [s.radius for s in stack.surfaces]
    ordered = sorted(radii[:m], reverse=True) + sorted(radii[m:])
    surfaces = tuple(replace(s, radius=R, capacity=0.01) for s, R in zip(stack.surfaces, ordered, strict=True))
    return replace(stack, surfaces=surfaces)


@pytest.mark.parametrize("layout", LAYOUTS, ids=str)
def test_quasi_static_path_leaves_the_full_balances_at_rest(layout: tuple[int, int, int]) -> None:
    """Weights, rims and plate tilt included: no acceleration is left, whatever the layout."""
    stack = nested(layout)
    push = Push(stack, 1e5, 1e5, weights=True)
    path = follow(push, [0.004, 0.03, 0.02], stride=5e-4)
    travel = np.abs(path[1].delta) * [s.radius for s in stack.surfaces]
    assert travel.max() > 0.0101, "no rim is pressed: this test would not see them"
    for here in path:
        state, h = as_state(stack, here.delta, here.Y)
        load = Load(np.array([here.force, 0.0, -1e5]), np.array([0.0, here.moment, 0.0]))
        found = solve(stack, state, h, load, "locked")
        inertia = min(body.inertia[0] for body in stack.bodies)
        assert np.abs(found.acceleration).max() * inertia < 1e-6  # [N m] of some 1e4
        assert here.moment == pytest.approx(-1e5 * here.delta.sum(), rel=1e-6, abs=1e-6)


@pytest.mark.slow
def test_small_yield_displacement_tends_to_the_closed_form() -> None:
    d = [0.02, 0.03, 0.06, 0.075, 0.1]
    exact = force_at(Push(fenz(), N, K_THETA), d)
    error = []
    for scale in (1.0, 0.1):
        surfaces = tuple(replace(s, yield_displacement=scale * s.yield_displacement) for s in fenz().surfaces)
        path = follow(Push(replace(fenz(), surfaces=surfaces), N, K_THETA), d, stride=2.5e-4)
        error.append(np.abs(np.array([here.force for here in path]) - exact).max() / N)
    assert error[1] < 0.2 * error[0] < 1e-3


@pytest.mark.slow
def test_rounded_corners_move_the_transitions_little() -> None:
    """A.1 with the report's R_0 and the weights of all bodies: rims 1 and 4 at 86.5 and 130.9 mm."""
    push = Push(fenz(), N, K_THETA, weights=True)
    d = [0.0863, 0.0865, 0.1307, 0.1309]
    path = follow(push, d, stride=2.5e-4)
    travel = np.array([np.abs(p.delta) * [s.radius for s in push.bearing.surfaces] for p in path])
    F = np.array([p.force / N for p in path])
    first = np.interp(0.065, travel[:2, 0], d[:2]), np.interp(0.065, travel[:2, 0], F[:2])
    fourth = np.interp(0.065, travel[2:, 3], d[2:]), np.interp(0.065, travel[2:, 3], F[2:])
    assert first == pytest.approx((0.08649, 0.17369), rel=3e-4)
    assert fourth == pytest.approx((0.13089, 0.26398), rel=3e-4)


@pytest.mark.slow
def test_loop_closes_and_is_odd() -> None:
    """After a full cycle the loop repeats, and the half loop at -d is the mirror image."""
    push = Push(fenz(), N, K_THETA)
    A = 0.02
    path = follow(push, [A, 0.0, -A, 0.0, A, 0.0, -A], stride=2.5e-4)
    force = np.array([p.force for p in path])
    assert force[6] == pytest.approx(force[2], rel=1e-6)
    assert force[4:6] == pytest.approx(-force[2:4], rel=1e-3)  # surfaces left at rest off centre keep a memory
    assert force[1] < -0.02 * N  # coming back through zero it still resists: hysteresis


def test_friction_share_is_the_flow_of_3_18() -> None:
    from scipy.integrate import solve_ivp

    start, slip = np.array([0.8, -0.6, 0.3, 0.0]), np.array([-2.5, 0.2, 1.5, -0.7])

    def flow(s: float, Y: Array) -> Array:
        u = slip
        rates: Array = u * (1 - np.where(Y * u > 0, Y**2, 0.0))
        return rates

    run = solve_ivp(flow, (0.0, 1.0), start, rtol=1e-9, atol=1e-11, max_step=0.01)
    assert friction_share(start, slip) == pytest.approx(run.y[:, -1], abs=1e-6)
