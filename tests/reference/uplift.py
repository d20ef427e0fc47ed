"""A stack whose surfaces may open (docs/uplift.md) in plain vectors: separations, contact forces, momentum balances.

Rims are left out: states are compared in which none is reached.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from . import forces
from .kinematics import E, Points, Rotation, State, cross, joint, points, rotation
from .parameters import Array
from .stack import Load, inertia

LEAST_FORCE = 1e-6  # of an open surface, along its axis [N]


class Separation(NamedTuple):
    """Of the sphere centres of every surface, along E, shape (n-1, 3) [m], with its rate and acceleration."""

    d: Array
    rate: Array
    rate_rate: Array


def separated(bearing: Any, at: Points, gap: Separation) -> Points:
    """The named points of a stack whose body g+1, with all above it, is displaced by the separation of surface g."""
    moved = Points(dict(at.r), dict(at.v), dict(at.a))
    for g in range(1, bearing.layout.n):
        k = g + 1
        for name in (joint(bearing, g, k), f"{k}", joint(bearing, k), f"{k}c"):
            for vectors, by in zip(moved, gap, strict=True):
                if name in vectors:
                    vectors[name] = vectors[name] + by[:g].sum(axis=0)
    return moved


def in_footprint(s: Array, axis: Array, half: float) -> Array:
    """Projection of a vector on the cone of directions within `half` [rad] of an axis."""
    along, across = s @ axis, s - (s @ axis) * axis
    if np.arctan2(np.linalg.norm(across), along) <= half:
        return s
    normal = np.cos(half) * axis + np.sin(half) * across / np.linalg.norm(across)
    return max(0.0, float(s @ normal)) * normal


def contact_force(bearing: Any, turn: Rotation, gap: Separation, stiffness: Array, damping: Array) -> Array:
    """Force of every unilateral contact on the body above, shape (n-1, 3) [N]."""
    out = np.zeros_like(gap.d)
    for g, surface in enumerate(bearing.surfaces, start=1):
        k, radius, _ = forces.slider(bearing, g)
        axis, half = turn.t[k][2], np.arcsin(radius / surface.radius) + np.arctan(surface.friction)
        s = -gap.d[g - 1]
        depth = np.linalg.norm(in_footprint(s, axis, half))
        rate = -gap.rate[g - 1] - cross(turn.w[k], s)  # relative to the slider
        if depth > 0:
            out[g - 1] = stiffness[g - 1] * in_footprint(s + damping[g - 1] * depth * rate, axis, half)
    return out


def balances(
    bearing: Any, state: State, gap: Separation, h: Array, angles: Array, normal: Array, load: Load, seats: Array
) -> tuple[Array, Array, Array]:
    """Residuals at given unknowns, each (n-1, 3): linear [N], angular along t^k [N m], and of the contact forces [N].

    The last is the force (3.15)-(3.17) of psi~, theta~ and N less that of the unilateral contact. seats: stiffness
    [N/m] and damping [s/m] of the contacts, shape (2, n-1).
    """
    turn = rotation(state)
    closed = points(bearing, state, turn)
    at = separated(bearing, closed, gap)
    touch = forces.contact(bearing, turn, closed.r, angles)
    given = forces.normal_forces(normal, touch) + forces.friction_forces(bearing, normal, h, touch)
    pressed = contact_force(bearing, turn, gap, *seats)
    linear, angular = [], []
    for k in range(2, bearing.layout.n + 1):
        mass, J, w = bearing.bodies[k - 2].mass, inertia(bearing, turn, k), turn.w_total[k]
        force, moment = -mass * bearing.gravity * E[2], np.zeros(3)
        for g, sign in ((k - 1, 1.0), *(((k, -1.0),) if k < bearing.layout.n else ())):
            own = at.r[f"{g}c"] + (gap.d[g - 1] if sign > 0 else 0.0)  # the sphere centre of this body
            friction = cross(touch.point[g - 1] - closed.r[f"{g}c"], given[g - 1])
            # On its edge a slider receives the moment of the force by the separation.
            by_separation = cross(-gap.d[g - 1], pressed[g - 1]) if forces.slider(bearing, g)[0] == k else np.zeros(3)
            force = force + sign * pressed[g - 1]
            moment = moment + sign * (cross(own - at.r[f"{k}"], pressed[g - 1]) + friction) + by_separation
        if k == bearing.layout.n:
            force = force + load.force
            moment = moment + cross(at.r[joint(bearing, k)] - at.r[f"{k}"], load.force) + load.moment
        linear.append(mass * at.a[f"{k}"] - force)
        angular.append(turn.t[k] @ (J @ turn.dw_total[k] + cross(w, J @ w) - moment))
    axes = np.array([turn.t[g][2] for g in range(1, bearing.layout.n)])
    return np.array(linear), np.array(angular), given - pressed - LEAST_FORCE * axes
