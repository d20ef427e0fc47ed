"""The two-port against runs of a rig, momentum and energy balances, and linear elastic stacks in closed form."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.interpolate import BPoly, PPoly
from scipy.spatial.transform import Rotation as Turn
from support import Array, model_of
from support.ends import BEARING, INTERFACE, LOAD, STILL, SWING, advance, port, swing

from msfp_gen import Bearing, Effects, Load, Motion, Rotation, Scene, Solver, Top, TwoPort, simulate

STEP, COUNT = 0.01, 200  # of the committed steps [s]
AXES = [0, 1, 2, 3], [0, 1, 2, 4]  # the lower end moves and turns about E1, the upper end about E2
ROCKING = SWING * [1.0, 1.0, 1.0, 4.0, 4.0, 4.0]  # rotation vectors of up to 0.1 rad
ONE_AXIS = SWING * [[axis in axes for axis in range(6)] for axes in AXES]


def pieces(values: Array) -> Array:
    """Quintic pieces through values and derivatives at the committed times: shape (steps, 6) for one channel."""
    time = STEP * np.arange(COUNT + 1)
    curve = PPoly.from_bernstein_basis(BPoly.from_derivatives(time, values))
    return np.asarray(curve.c[::-1].T)


def histories(interface: Top) -> tuple[Motion, Load, Rotation]:
    """Motion of both ends as base motion, load of the springs of a rig with fixed ends, and rotation of its head."""
    ends = np.array([swing(STEP * i, ONE_AXIS) for i in range(COUNT + 1)])  # times, ends, orders, freedoms
    lower, upper = (np.stack([pieces(ends[:, end, :, i]) for i in range(6)], axis=1) for end in (0, 1))
    rates = upper * np.arange(6)
    rates = np.concatenate([rates[..., 1:], np.zeros_like(rates[..., :1])], axis=-1)
    load = np.zeros_like(upper)
    for channels, k, c in (
        (slice(2), interface.stiffness, interface.damping),
        (slice(2, 3), interface.vertical_stiffness, interface.vertical_damping),
    ):
        load[:, channels] = k * upper[:, channels] + c * rates[:, channels]
    knots = STEP * np.arange(COUNT + 1)
    return Motion(knots, lower), Load.of(knots, load), Rotation.of(knots, upper[:, 3:5])


@cache
def wrenches(rtol: float, count: int = COUNT) -> Array:
    return advance(port(rtol), 0, count, STEP, ONE_AXIS)


def test_committed_steps_equal_a_run_of_a_rig():
    """The same histories, given to a run as base motion, load and top rotation."""
    motion, load, rotation = histories(INTERFACE)
    parts = {name: getattr(INTERFACE, name) for name in vars(INTERFACE)}
    top = Top.rig(LOAD, **parts)
    effects, solver = Effects(top_rotation=True), Solver(rtol=1e-6, max_step=STEP)
    scene = Scene(BEARING, motion, top, effects, solver, load=load, top_rotation=rotation, output_step=STEP)
    history = simulate(scene).history
    found = wrenches(1e-6)
    assert found[:, 1, :3] == pytest.approx(-history.top_force[1:], abs=2e-3 * LOAD)
    # The moment of the upper end is about its own position, which lies from r_nn as far as the springs are strained.
    place = history.top_displacement[1:] - history.top_displacement[0]
    place -= np.array([swing(STEP * i, ONE_AXIS)[1, 0, :3] for i in range(1, COUNT + 1)])
    moment = -history.top_moment[1:] - np.cross(place, history.top_force[1:])
    assert found[:, 1, 3:] == pytest.approx(moment, abs=2e-3 * LOAD * 0.5)
    assert np.abs(found[:, 1]).max() > 0.5 * LOAD


def angles(time: float, end: int) -> Array:
    """psi, theta, phi (2.1) of an end with two derivatives, shape (3, 3), by SciPy and differences in time."""
    h = 1e-3
    low, now, high = (
        Turn.from_rotvec(swing(t, ROCKING)[end, 0, 3:]).as_euler("XYZ") for t in (time - h, time, time + h)
    )
    return np.array([now, (high - low) / (2 * h), (high - 2 * now + low) / h**2])


def named_vectors(two_port: TwoPort, time: float) -> dict[str, Array]:
    """Points, velocities and accelerations of the bodies at the end of the last trial."""
    row = two_port.model.unpack(two_port._port.row)
    base = swing(time, ROCKING)[0]
    base[:, 3:] = angles(time, 0)
    return model_of((5, 2, 2)).kinematics(two_port.bearing, row["q"], row["v"], row["a"], base=base)


def momentum_rates(bearing: Bearing, named: dict[str, Array]) -> tuple[Array, Array]:
    """Rates of the momentum and of the moment of momentum about the origin, less weights and their moments."""
    force, moment = np.zeros(3), np.zeros(3)
    for k, body in enumerate(bearing.bodies, start=2):
        transverse, axial = body.moments
        axis, spin, turn = named[f"t_{k}"][2], named[f"omega'_{k}"], named[f"alpha'_{k}"]
        moved = np.cross(spin, axis)
        along = (turn @ axis + spin @ moved) * axis + (spin @ axis) * moved
        change = body.mass * (named[f"a_{k}"] + [0, 0, bearing.gravity])
        force += change
        moment += np.cross(named[f"r_{k}"], change) + transverse * turn + (axial - transverse) * along
    return force, moment


def sums(wrench: Array, ends: Array, plate: Array) -> tuple[Array, Array]:
    """Sum of the forces of both ends, and of their moments about the origin."""
    places = ends[0, 0, :3], plate + ends[1, 0, :3]
    moments = [np.cross(place, w[:3]) + w[3:] for place, w in zip(places, wrench, strict=True)]
    return wrench[:, :3].sum(axis=0), np.sum(moments, axis=0)


def test_both_ends_and_the_weights_balance_all_inertia():
    """In a general motion of both ends; the moment of the upper end is that of its rotated axis."""
    two_port = TwoPort(BEARING, replace(INTERFACE, rotational_damping=0.0), LOAD, solver=Solver(rtol=1e-6))
    plate = two_port.model.unpack(two_port._port.row)["top"].copy()
    for i in range(1, 120):
        ends = swing(i * STEP, ROCKING)
        wrench = two_port.trial(i * STEP, *ends).wrench
        two_port.commit()
        if i % 10:
            continue
        named = named_vectors(two_port, i * STEP)
        for found, expected in zip(sums(wrench, ends, plate), momentum_rates(BEARING, named), strict=True):
            assert found == pytest.approx(expected, abs=1e-6 * LOAD)
        axis = Turn.from_rotvec(ends[1, 0, 3:]).as_matrix()[:, 2]
        row = two_port.model.unpack(two_port._port.row)
        held = INTERFACE.rotational_stiffness * np.cross(axis, named["t_5"][2])
        assert row["top_moment"] == pytest.approx(held, abs=1e-6 * LOAD)


def test_both_ends_balance_with_separation():
    """Of a stack with unilateral contacts, up to the inertia and the weight of its light bodies."""
    two_port = port(1e-6, effects=Effects(uplift=True))
    plate = two_port.model.unpack(two_port._port.row)["top"].copy()
    weight = BEARING.gravity * sum(body.mass for body in BEARING.bodies)
    for i in range(1, 60):
        ends = swing(i * STEP)
        wrench = two_port.trial(i * STEP, *ends).wrench
        two_port.commit()
        force, moment = sums(wrench, ends, plate)
        assert force == pytest.approx([0, 0, weight], abs=1e-3 * LOAD)
        assert moment == pytest.approx(np.zeros(3), abs=3e-4 * LOAD)
    assert np.abs(wrench[:, 3:]).max() > 0.01 * LOAD


def test_work_of_the_ends_is_stored_or_dissipated():
    """Without dampers in the interface, over a cycle of the upper end in translation."""
    amplitude = np.array([[0.0] * 6, [0.06, -0.02, 0.0005, 0.0, 0.0, 0.0]])
    interface = replace(INTERFACE, damping=0.0, vertical_damping=0.0, rotational_damping=0.0)
    two_port = TwoPort(BEARING, interface, LOAD)
    step, work, power, stored = 0.0025, 0.0, 0.0, []

    def energy() -> float:
        row = two_port.model.unpack(two_port._port.row)
        force, moment = row["top_force"], row["top_moment"]
        springs = (force[:2] @ force[:2]) / interface.stiffness + force[2] ** 2 / interface.vertical_stiffness
        springs += moment[:2] @ moment[:2] / interface.rotational_stiffness
        return float(row["kinetic"] + row["potential"] + row["work"][1] + 0.5 * springs)

    stored.append(energy())
    for i in range(1, 801):
        ends = swing(i * step, amplitude)
        response = two_port.trial(i * step, *ends)
        two_port.commit()
        now = float(response.wrench[1, :3] @ ends[1, 1, :3])
        work, power = work + 0.5 * step * (power + now), now
        stored.append(energy())
    assert response.dissipated > 1000.0
    assert work == pytest.approx(response.dissipated + stored[-1] - stored[0], rel=5e-3)


def elastic_stiffness(bearing: Bearing, two_port: TwoPort) -> Array:
    """Stiffness of the upper end against displacement along E1 and rotation about E2, shape (2, 2), of a stuck stack.

    A surface that sticks is a rotational spring mu N R^2/d_y at its sphere centre. The parts between the centres lean
    by the sum of the rotations below; a load N that stays vertical does work N L (1 - cos lean) on a part of length L.
    """
    model = model_of((5, 2, 2))
    zero = np.zeros((bearing.layout.surfaces, 3))
    named = model.kinematics(bearing, zero, zero, zero)
    count = bearing.layout.n
    centres = [named[f"r_{k}c"][2] for k in range(1, count)] + [named[f"r_{count}{count}"][2]]
    k, kr = two_port.interface.stiffness, two_port.interface.rotational_stiffness
    surfaces = bearing.surfaces
    springs = np.array([s.friction * LOAD * s.radius**2 / s.yield_displacement for s in surfaces])
    lever = centres[-1] - np.array(centres[:-1])  # of each rotation about the top
    hessian = np.diag(springs) + k * np.outer(lever, lever) + kr
    for i, length in enumerate(np.diff(centres)):
        below = (np.arange(count - 1) <= i).astype(float)
        hessian -= LOAD * length * np.outer(below, below)
    coupling = np.stack([k * lever, kr * np.ones(count - 1)])
    return np.diag([k, kr]) - coupling @ np.linalg.solve(hessian, coupling.T)


def test_the_tangent_of_a_stuck_stack_is_that_of_springs_in_series():
    bearing = BEARING.replace(gravity=0.0, contact_damping=0.0, friction=0.5)
    two_port = TwoPort(bearing, INTERFACE, LOAD, solver=Solver(rtol=1e-8))
    response = two_port.trial(100.0, STILL, STILL)  # slow enough for the response to be elastic
    tangent, expected = response.tangent[6:, 6:], elastic_stiffness(bearing, two_port)
    assert tangent[2, 2] == pytest.approx(INTERFACE.vertical_stiffness, rel=1e-6)
    # The moment about the upper end has the load at the arm by which it moves away from the plate.
    assert tangent[np.ix_([0, 4], [0, 4])][0] == pytest.approx(expected[0], rel=2e-6)
    assert tangent[4, 4] == pytest.approx(expected[1, 1] - LOAD * expected[0, 1] / INTERFACE.stiffness, rel=2e-6)
    assert tangent[0, 0] == pytest.approx(tangent[1, 1], rel=1e-6)  # no direction is preferred
    assert 0.1 * INTERFACE.stiffness < tangent[0, 0] < 0.9 * INTERFACE.stiffness


def test_a_uniform_motion_of_both_ends_changes_nothing():
    """Only the relative motion counts, and the acceleration of the base by the inertia of the light sliders."""
    common = np.array([0.3, -0.2, 0.1])
    one, two = port(1e-6), port(1e-6)
    for i in range(1, 81):
        ends = swing(i * STEP, ONE_AXIS)
        shared = np.outer(swing(i * STEP, np.ones((2, 6)))[0, :, 0], common)
        moved = ends.copy()
        moved[:, :, :3] += shared
        found, expected = two.trial(i * STEP, *moved).wrench, one.trial(i * STEP, *ends).wrench
        one.commit()
        two.commit()
    inertia = 10.0 * np.abs(shared[2]).max()  # of about 9 kg of sliders and plate
    assert np.abs(found - expected)[:, :3].max() < inertia + 2e-3 * LOAD
