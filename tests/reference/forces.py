"""Forces of the report: normal and friction (2.85)-(2.99), (3.13)-(3.19); rims (2.100)-(2.109), (3.20)-(3.25).

Arrays over surfaces 1..n-1 come in order; every force is the one ON body g+1, its opposite acts on body g.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .kinematics import Rotation, cross, joint, rotate
from .parameters import Array

SPIN_RATE = 0.01  # w_0 [rad/s], the drilling moment of spin="patch"


class Contact(NamedTuple):
    """Per surface: basis t~ (n-1, 3, 3) rows, point r~ (n-1, 3) [m], v~ (n-1, 3) and (u~, v~) (n-1, 2) [m/s]."""

    basis: Array
    point: Array
    velocity: Array
    slip: Array


class Rim(NamedTuple):
    """Per surface: gap [m], its rate [m/s], force on body g+1 (n-1, 3) [N], r_bar (n-1, 3) [m], f_bar (n-1, 3)."""

    gap: Array
    gap_rate: Array
    force: Array
    point: Array
    direction: Array


def concave(bearing: Any) -> list[int]:
    """+1 for surfaces concave up (alpha), -1 for concave down (beta): chapter 3."""
    return [1] * bearing.layout.m + [-1] * bearing.layout.p


def slider(bearing: Any, surface: int) -> tuple[int, float, float]:
    """Body that touches the cup, with its rim radius r [m] and rim offset p [m] (3.25): g+1 on cups below, g above."""
    k = surface + 1 if surface <= bearing.layout.m else surface
    if k == 1:
        return k, bearing.base_rim_radius, bearing.base_rim_offset
    return k, bearing.bodies[k - 2].rim_radius, bearing.bodies[k - 2].rim_offset


def contact(bearing: Any, turn: Rotation, r: dict[str, Array], angles: Array) -> Contact:
    """Where the normal forces act, at angles (psi~, theta~) (n-1, 2) [rad]."""
    basis, point, velocity, slip = [], [], [], []
    for g, (sign, surface) in enumerate(zip(concave(bearing), bearing.surfaces, strict=True), start=1):
        R = surface.radius
        tilde = rotate(angles[g - 1, 0], angles[g - 1, 1], turn.t[g])  # (3.13), (2.86)
        relative = turn.w_total[g + 1] - turn.w_total[g]
        basis.append(tilde)
        point.append(r[f"{g}c"] - sign * R * tilde[2])  # (3.14) with (2.89): + R for concave down
        velocity.append(-sign * R * cross(relative, tilde[2]))  # (3.19)
        slip.append([velocity[-1] @ tilde[0], velocity[-1] @ tilde[1]])  # (2.98), in-plane pair t~_1, t~_2
    return Contact(np.array(basis), np.array(point), np.array(velocity), np.array(slip))


def normal_forces(normal: Array, touch: Contact) -> Array:
    """N_g t~_3 (3.15), shape (n-1, 3) [N]."""
    return normal[:, None] * touch.basis[:, 2]


def friction_forces(bearing: Any, normal: Array, h: Array, touch: Contact, law: str = "report") -> Array:
    """-mu N (Y t~_1 + Z t~_2): (3.16), (3.17), and T times the rates of Y, Z beside them; h = (Y, Z), (n-1, 2)."""
    mu = np.array([s.friction for s in bearing.surfaces])
    T = np.array([s.contact_damping for s in bearing.surfaces])
    h = h + T[:, None] * friction_rates(bearing, h, touch.slip, law)
    direction = h[:, :1] * touch.basis[:, 0] + h[:, 1:] * touch.basis[:, 1]
    force: Array = -(mu * normal)[:, None] * direction
    return force


def switches(h: Array, slip: Array, law: str) -> Array:
    """(a, b) of (3.18), shape (n-1, 2): per axis ("report"), or one for both axes on f . v ("isotropic")."""
    power = h * slip
    if law == "isotropic":
        power = np.repeat(power.sum(axis=1, keepdims=True), 2, axis=1)
    return np.where(power.real > 0, 1.0, 0.0)


def friction_rates(bearing: Any, h: Array, slip: Array, law: str = "report") -> Array:
    """(Y', Z') of (3.18) with 1/d_y for the printed factor, shape (n-1, 2) [1/s]; "plastic": see below."""
    if law == "plastic":
        return np.array([_plastic_rate(s, f, v) for s, f, v in zip(bearing.surfaces, h, slip, strict=True)])
    (Y, Z), (u, v), (a, b) = h.T, slip.T, switches(h, slip, law).T
    d_y = np.array([s.yield_displacement for s in bearing.surfaces])
    return np.stack([((1 - a * Y**2) * u - b * Y * Z * v) / d_y, ((1 - b * Z**2) * v - a * Y * Z * u) / d_y], axis=1)


def _plastic_rate(surface: Any, h: Array, slip: Array) -> Array:
    """A spring of stiffness 1/d_y and a damper T/d_y beside it, in line with a slider that slips at |h + T h'| = 1."""
    elastic, T = slip / surface.yield_displacement, surface.contact_damping
    if T > 0:
        force = h + T * elastic
        size = np.sqrt(force @ force)
        return (force / size - h) / T if size.real > 1 else elastic
    outward = h @ elastic
    return elastic - h * outward if (h @ h).real > 1 - 1e-9 and outward.real > 0 else elastic


def rim(bearing: Any, turn: Rotation, r: dict[str, Array]) -> Rim:
    """Rim contact of every surface, clamped to compression; nothing acts at a gap above zero."""
    rows = [_rim(bearing, turn, r, g) for g in range(1, bearing.layout.n)]
    gap, gap_rate, force, point, direction = (np.array(column) for column in zip(*rows, strict=True))
    return Rim(gap, gap_rate, force, point, direction)


def _rim(bearing: Any, turn: Rotation, r: dict[str, Array], g: int) -> tuple[Any, Any, Array, Array, Array]:
    surface, (lower, upper) = bearing.surfaces[g - 1], (turn.t[g], turn.t[g + 1])
    cosine = lower[2] @ upper[2]
    none = np.zeros(3)
    if np.real(cosine) >= np.cos(1e-9):  # centred: the direction (3.24) is 0/0, and no rim is near
        return surface.capacity, 0.0, none, none, none
    gap = surface.capacity - surface.radius * np.arccos(cosine)  # (3.20), (3.21)
    cosine_rate = cross(turn.w[g], lower[2]) @ upper[2] + lower[2] @ cross(turn.w[g + 1], upper[2])
    gap_rate = surface.radius * cosine_rate / np.sqrt(1 - cosine**2)  # (2.102)
    k, radius, offset = slider(bearing, g)
    own, other = (upper, lower) if k == g + 1 else (lower, upper)
    along = (other[2] @ own[0]) * own[0] + (other[2] @ own[1]) * own[1]
    direction = along / np.sqrt(along @ along)  # (3.24)
    if k == g + 1:
        point = radius * direction + offset * own[2] + r[joint(bearing, g, g + 1)]  # (3.25)
    else:
        point = (
            -radius * direction - offset * own[2] + r[joint(bearing, g)]
        )  # (3.25), - r f: the rim touches on the far side
    magnitude = surface.rim_stiffness * gap + surface.rim_damping * gap_rate  # (3.23) read as k g + c dg/dt
    pressed = np.real(gap) <= 0 and np.real(magnitude) < 0
    return gap, gap_rate, magnitude * direction if pressed else none, point, direction  # (3.22)


DRILLING = {
    "patch": lambda surface, N, r, w: -surface.friction * N * (2 / 3) * r * w / np.sqrt(w**2 + SPIN_RATE**2),
}
"""Moment about t~_3 on body g+1 [N m] by word of `spin`: of a surface, N, radius r of the slider's rim, spin rate w."""


def drilling_moments(bearing: Any, normal: Array, turn: Rotation, touch: Contact, spin: str) -> Array:
    """Moments that resist spin on body g+1, shape (n-1, 3) [N m]; zero where `spin` has none."""
    moments = np.zeros((bearing.layout.n - 1, 3), dtype=np.result_type(normal, touch.basis, *turn.w_total))
    for g, surface in enumerate(bearing.surfaces, start=1) if spin in DRILLING else ():
        axis, (_, radius, _) = touch.basis[g - 1, 2], slider(bearing, g)
        w = (turn.w_total[g + 1] - turn.w_total[g]) @ axis
        moments[g - 1] = DRILLING[spin](surface, normal[g - 1], radius, w) * axis
    return moments
