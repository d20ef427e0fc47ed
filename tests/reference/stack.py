"""Momentum balances (3.26)-(3.29) of a stack, a dense solver for the unknowns (2.119), and energy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from . import forces
from .kinematics import E, Points, Rotation, State, cross, joint, points, rotation
from .parameters import Array


@dataclass(frozen=True)
class Load:
    """What the outside applies to the top plate at r_nn: force [N] and moment [N m], shape (3,)."""

    force: Array
    moment: Array


Top = Load | Callable[[Rotation, Points], Load]
"""A load, or what a structure exerts on the top plate that moves like this."""


class Interfaces(NamedTuple):
    """Everything that acts between bodies: (n-1, 3) arrays, ON body g+1."""

    touch: forces.Contact
    rim: forces.Rim
    normal: Array
    friction: Array
    drilling: Array


class Balances(NamedTuple):
    """Residuals, rate of momentum minus what acts: linear [N] and angular [N m] in E, angular also in t^k; (n-1, 3)."""

    linear: Array
    angular: Array
    angular_body: Array


class Solution(NamedTuple):
    """Unknowns (2.119): accelerations (n-1, 3), angles psi~, theta~ (n-1, 2), N (n-1,); what is left, iterations."""

    acceleration: Array
    contact_angles: Array
    normal_force: Array
    balances: Balances
    iterations: int


def interfaces(
    bearing: Any,
    turn: Rotation,
    at: Points,
    h: Array,
    angles: Array,
    normal: Array,
    spin: str,
    rims: bool = True,
    law: str = "report",
) -> Interfaces:
    """Contact, friction, rim and drilling action at every surface; spin is "free", "locked" or one of DRILLING."""
    touch, rim = forces.contact(bearing, turn, at.r, angles), forces.rim(bearing, turn, at.r)
    return Interfaces(
        touch,
        rim if rims else rim._replace(force=np.zeros_like(rim.force)),
        forces.normal_forces(normal, touch),
        forces.friction_forces(bearing, normal, h, touch, law),
        forces.drilling_moments(bearing, normal, turn, touch, spin),
    )


def inertia(bearing: Any, turn: Rotation, k: int) -> Array:
    """J_k (2.118) in E, shape (3, 3) [kg m^2]."""
    transverse, axial = np.broadcast_to(bearing.bodies[k - 2].inertia, 2)  # one number means both
    t1, t2, t3 = turn.t[k]
    J: Array = transverse * (np.outer(t1, t1) + np.outer(t2, t2)) + axial * np.outer(t3, t3)
    return J


def balances(
    bearing: Any,
    state: State,
    h: Array,
    angles: Array,
    normal: Array,
    load: Top,
    spin: str = "free",
    rims: bool = True,
    law: str = "report",
) -> Balances:
    """(3.26)-(3.29) at given unknowns: state.a, contact angles (n-1, 2) [rad], normal (n-1,) [N]."""
    turn = rotation(state)
    at = points(bearing, state, turn)
    load = load if isinstance(load, Load) else load(turn, at)
    act = interfaces(bearing, turn, at, h, angles, normal, spin, rims, law)
    linear, angular = [], []
    for k in range(2, bearing.layout.n + 1):
        force, moment = _applied(bearing, at, act, load, k)
        mass, J, w = bearing.bodies[k - 2].mass, inertia(bearing, turn, k), turn.w_total[k]
        linear.append(mass * at.a[f"{k}"] - force)  # (3.26), (3.28)
        angular.append(J @ turn.dw_total[k] + cross(w, J @ w) - moment)  # (3.27), (3.29) with w'_n
    body = [turn.t[k] @ angular[k - 2] for k in range(2, bearing.layout.n + 1)]
    return Balances(np.array(linear), np.array(angular), np.array(body))


def _applied(bearing: Any, at: Points, act: Interfaces, load: Load, k: int) -> tuple[Array, Array]:
    """Right-hand sides of (3.26)-(3.29): force and moment about r_k on body k."""
    force, moment = -bearing.bodies[k - 2].mass * bearing.gravity * E[2], np.zeros(3)
    sides = [(k - 1, 1)] + ([(k, -1)] if k < bearing.layout.n else [])
    for surface, sign in sides:
        i = surface - 1
        here, there = act.normal[i] + act.friction[i], act.rim.force[i]
        force = force + sign * (here + there)
        moment = moment + sign * (
            cross(act.touch.point[i] - at.r[f"{k}"], here)
            + cross(act.rim.point[i] - at.r[f"{k}"], there)
            + act.drilling[i]
        )
    if k == bearing.layout.n:
        force = force + load.force
        moment = moment + cross(at.r[joint(bearing, k)] - at.r[f"{k}"], load.force) + load.moment
    return force, moment


def solve(
    bearing: Any, state: State, h: Array, load: Top, spin: str = "free", rims: bool = True, law: str = "report"
) -> Solution:
    """The unknowns (2.119) at a state (its `a` is the first guess), by a damped Newton with complex-step Jacobian.

    spin="locked" replaces the angular balance about t_3^k by phi_k'' = 0.
    """
    count = bearing.layout.n - 1
    turn = rotation(state)
    carried = load if isinstance(load, Load) else load(turn, points(bearing, state, turn))
    size = max(float(np.linalg.norm(carried.force)), 1.0)

    def parts(x: Array) -> tuple[State, Array, Array]:
        return (
            replace(state, a=x[: 3 * count].reshape(count, 3)),
            x[3 * count : 5 * count].reshape(count, 2),
            x[5 * count :] * size,
        )

    def residual(x: Array) -> Array:
        trial, angles, normal = parts(x)
        left = balances(bearing, trial, h, angles, normal, load, spin, rims, law)
        angular = left.angular_body / size
        if spin == "locked":
            angular[:, 2] = trial.a[:, 2]
        return np.concatenate([(left.linear / size).ravel(), angular.ravel()])

    start = np.concatenate([state.a.ravel(), np.zeros(2 * count), np.ones(count)])
    x, iterations = newton(residual, start)
    trial, angles, normal = parts(x)
    left = balances(bearing, trial, h, angles, normal, load, spin, rims, law)
    return Solution(trial.a, angles, normal, left, iterations)


def newton(
    residual: Callable[[Array], Array], x: Array, tolerance: float = 1e-12, limit: int = 60
) -> tuple[Array, int]:
    """Root of an analytic residual; stops when it is below tolerance, or raises ArithmeticError."""
    r = residual(x)
    for iteration in range(limit):
        if np.abs(r).max() < tolerance:
            return x, iteration
        step = np.linalg.solve(complex_jacobian(residual, x), -r)
        for fraction in (0.5**i for i in range(12)):
            new = residual(x + fraction * step)
            if np.linalg.norm(new) < np.linalg.norm(r) or fraction < 1e-3:
                break
        x, r = x + fraction * step, new
    raise ArithmeticError(f"Newton stopped at residual {np.abs(r).max():.2e} after {limit} iterations")


def complex_jacobian(function: Callable[[Array], Array], x: Array, step: float = 1e-30) -> Array:
    """Jacobian by complex steps, shape (size of function, size of x)."""
    columns = [np.imag(function(x + 1j * step * unit)) / step for unit in np.eye(x.size)]
    return np.stack(columns, axis=1)
