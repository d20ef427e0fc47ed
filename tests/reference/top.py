"""The structure on the top plate: springs of a rig, and a supported mass that rests on a vertical spring."""

from __future__ import annotations

from typing import Any

import numpy as np

from .kinematics import E, Points, Rotation, cross
from .parameters import Array
from .stack import Load


def rig(top: Any, end: float, turn: Rotation, at: Points) -> Load:
    """What a rig exerts on the top plate at r_nn; `end` is the height of the fixed end of its vertical spring [m]."""
    n = len(turn.t) - 1
    r, v = at.r[f"{n}{n}"], at.v[f"{n}{n}"]
    stiffness = np.array([top.stiffness, top.stiffness, top.vertical_stiffness])
    damping = np.array([top.damping, top.damping, top.vertical_damping])
    force = -stiffness * (r - end * E[2]) - damping * v - top.axial_load * E[2]
    return Load(force, _restraint(top, turn, n))


def mass(top: Any, gravity: float, foot: tuple[float, float], turn: Rotation, at: Points) -> Load:
    """What a mass exerts on the top plate at r_nn. foot: height and velocity of its lower end [m], [m/s].

    Its centre has the horizontal motion of the top plate at the height h of the mass. Vertically it rests on a spring:
    the spring carries what the mass exerts, and no acceleration of the plate enters.
    """
    n = len(turn.t) - 1
    height, speed = foot
    t3, w, dw = turn.t[n][2], turn.w[n], turn.dw[n]
    arm = top.height * t3
    acceleration = at.a[f"{n}{n}"] + cross(dw, arm) + cross(w, cross(w, arm))
    shortening = at.r[f"{n}{n}"][2] - height, at.v[f"{n}{n}"][2] - speed
    spring = top.vertical_stiffness * shortening[0] + top.vertical_damping * shortening[1]
    held = np.array([top.mass * acceleration[0], top.mass * acceleration[1], spring])  # on the mass
    transverse, axial = top.inertia
    t1, t2, _ = turn.t[n]
    inertia = transverse * (np.outer(t1, t1) + np.outer(t2, t2)) + axial * np.outer(t3, t3)
    total = turn.w_total[n]
    turning = inertia @ turn.dw_total[n] + cross(total, inertia @ total)
    return Load(-held, _restraint(top, turn, n) - turning - cross(arm, held))


def foot_in_stage(
    top: Any, gravity: float, given: tuple[float, float, float], plate: tuple[float, float], raised: float
) -> Array:
    """y, y', y'' of the foot at the end of a stage with y = P + beta^2 y'', y' = V + beta y''; given: P, V, beta.

    plate: height and velocity of the top plate [m], [m/s]. raised: (h t_3)'' along E3 [m/s^2].
    """
    P, V, beta = given
    k, c, m = top.vertical_stiffness, top.vertical_damping, top.mass
    rows = np.array([[1.0, 0.0, -(beta**2)], [0.0, 1.0, -beta], [k, c, m]])
    return np.linalg.solve(rows, np.array([P, V, k * plate[0] + c * plate[1] - m * (raised + gravity)]))


def _restraint(top: Any, turn: Rotation, n: int) -> Array:
    """Rotational spring and damper against tilt; the spin is zero here."""
    tilt = cross(E[2], turn.t[n][2])
    moment: Array = -top.rotational_stiffness * tilt - top.rotational_damping * turn.w_total[n]
    return moment
