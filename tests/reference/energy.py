"""Energy and power of a stack, and the split of friction into stored and dissipated."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .forces import switches
from .kinematics import State, points, rotation
from .parameters import Array
from .stack import Load, Solution, inertia, interfaces


class FrictionPower(NamedTuple):
    """Power taken from the motion by friction, per surface (n-1,) [W]: total = recoverable + dissipated."""

    total: Array
    recoverable: Array
    dissipated: Array


def kinetic_energy(bearing: Any, state: State) -> Any:
    """Sum of m v.v/2 + w'.J w'/2 over bodies 2..n [J]."""
    turn = rotation(state)
    at = points(bearing, state, turn)
    total: Any = 0.0
    for k in range(2, bearing.layout.n + 1):
        v, w = at.v[f"{k}"], turn.w_total[k]
        total = total + bearing.bodies[k - 2].mass * (v @ v) / 2 + w @ inertia(bearing, turn, k) @ w / 2
    return total


def potential_energy(bearing: Any, state: State) -> Any:
    """Sum of m g r_k . E_3 over bodies 2..n [J]."""
    at = points(bearing, state)
    return sum(body.mass * bearing.gravity * at.r[f"{k}"][2] for k, body in enumerate(bearing.bodies, start=2))


def friction_power(bearing: Any, h: Array, normal: Array, slip: Array, law: str = "report") -> FrictionPower:
    """mu N (Y u + Z v): mu N (Y^2 + Z^2)(a Y u + b Z v) is lost, the rest, mu N d_y (|f|^2/2)', is stored."""
    limit = np.array([s.friction for s in bearing.surfaces]) * normal
    power = h * slip
    total = limit * power.sum(axis=1)
    dissipated = limit * (h**2).sum(axis=1) * (switches(h, slip, law) * power).sum(axis=1)
    return FrictionPower(total, total - dissipated, dissipated)


def powers(
    bearing: Any, state: State, h: Array, found: Solution, load: Load, spin: str = "free", rims: bool = True
) -> dict[str, float]:
    """Power into bodies 2..n from each source at a solved state [W]; their sum is d(T + V)/dt.

    "base" is the work of the moving base, "lock" that of the moments which keep phi'' = 0 under spin="locked".
    """
    turn = rotation(state)
    at = points(bearing, state, turn)
    act = interfaces(bearing, turn, at, h, found.contact_angles, found.normal_force, spin, rims)
    n, first = bearing.layout.n, act.normal[0] + act.friction[0]
    centre = at.r["1c"]  # carried by the base
    moment = np.cross(act.touch.point[0] - centre, first) + np.cross(act.rim.point[0] - centre, act.rim.force[0])
    relative = np.array([turn.w_total[g + 1] - turn.w_total[g] for g in range(1, n)])
    arm = act.rim.point - np.array([at.r[f"{g}c"] for g in range(1, n)])
    return {
        "top": load.force @ at.v[f"{n}{n}"] + load.moment @ turn.w_total[n],
        "base": (first + act.rim.force[0]) @ at.v["1c"] + (moment + act.drilling[0]) @ turn.w_total[1],
        "friction": -friction_power(bearing, h, found.normal_force, act.touch.slip).total.sum(),
        "rims": float((act.rim.force * np.cross(relative, arm)).sum()),
        "drilling": float((act.drilling * relative).sum()),
        "lock": sum(found.balances.angular[k - 2] @ turn.w_total[k] for k in range(2, n + 1)),
    }
