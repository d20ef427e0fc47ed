"""Planar quasi-static stack with the report's Bouc-Wen friction, any path: what massless sliders must give.

Same balances as `friction_circle` (moments about the sphere centres, finite rotations, rims at rest), but the friction
share Y follows (3.18) exactly between the points of the path, so loops and rounded corners come out.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .friction_circle import Push, centres, contact_moments
from .parameters import Array
from .stack import newton


class Point(NamedTuple):
    """Top over base [m], rig force [N] and moment [N m], relative tilts (n-1,) [rad], Y with the sign of the tilt."""

    displacement: float
    force: float
    moment: float
    delta: Array
    Y: Array


def friction_share(Y: Array, slip: Array) -> Array:
    """Y after a slip in units of d_y, any size: (3.18) along one axis, integrated exactly.

    Loading (Y u > 0) is tanh; unloading (a = 0) is linear until Y changes sign, the rest loads the other way.
    """
    left = np.where(Y * np.real(slip) < 0, Y + slip, 0.0)  # Y after unloading only, if it unloads
    back = (Y * np.real(slip) < 0) & (Y * np.real(left) > 0)
    loading = np.where(Y * np.real(slip) < 0, left, slip)
    start = np.where(Y * np.real(slip) < 0, 0.0, Y)
    tanh = np.tanh(loading)
    share: Array = np.where(back, left, (start + tanh) / (1 + start * tanh))
    return share


def follow(push: Push, displacements: Sequence[float], stride: float = 1e-4) -> list[Point]:
    """The stack at each displacement [m] in turn, from rest at zero, by steps of at most stride [m]."""
    n = push.bearing.layout.n
    radius, d_y = (
        np.array([getattr(s, key) for s in push.bearing.surfaces]) for key in ("radius", "yield_displacement")
    )
    here = Point(0.0, 0.0, 0.0, np.zeros(n - 1), np.zeros(n - 1))
    path = []
    for target in displacements:
        pieces = max(1, int(np.ceil(abs(target - here.displacement) / stride - 1e-9)))
        for d in np.linspace(here.displacement, target, pieces + 1)[1:]:
            here = _step(push, here, float(d), radius / d_y)
        path.append(here)
    return path


def _step(push: Push, here: Point, displacement: float, slip_scale: Array) -> Point:
    size, stiffness = push.load, push.rotational_stiffness
    start = centres(push.bearing, np.zeros(len(here.delta)))[-1, 0]

    def residual(y: Array) -> Array:
        delta, force, moment = y[:-2], y[-2] * size, y[-1] * size
        share = friction_share(here.Y, (delta - here.delta) * slip_scale)
        about = contact_moments(push, delta, force, moment, share)
        tilt = (moment + stiffness * delta.sum()) / (size + stiffness)
        moved: Any = centres(push.bearing, delta)[-1, 0] - start - displacement
        return np.concatenate([(about.moment + about.bound) / size, [tilt, moved]])

    y, _ = newton(residual, np.array([*here.delta, here.force / size, here.moment / size]), tolerance=1e-13)
    share = friction_share(here.Y, (y[:-2] - here.delta) * slip_scale)
    return Point(displacement, float(y[-2]) * size, float(y[-1]) * size, y[:-2], share)
