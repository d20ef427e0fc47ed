"""Planar models in any vertical plane: inputs rotated into its frame, results back (docs/model.md, choice 8)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import asin, atan2
from typing import TYPE_CHECKING, Literal

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError

if TYPE_CHECKING:
    from msfp_gen.motions.motion import Motion

PlanarKind = Literal["angles", "pair_angles", "pair", "vector", "axial"]


@dataclass(frozen=True, eq=False)
class State:
    """State, base motion and load as arguments of a compiled stack.

    Shapes: q, v (n-1, 3) [rad], [rad/s], with uplift (n-1, 6), separations [m], [m/s] last; f (n-1, 2); base (3, 6),
    displacements, velocities and accelerations with rotations, SI; load (6,) [N], [N m]. azimuth: of the E1 axis of
    their frame in the frame of the user [rad].
    """

    q: Array
    v: Array
    f: Array
    base: Array
    load: Array
    azimuth: float = 0.0


def rotated(vectors: Array, angle: float) -> Array:
    """Components, shape (..., 3), of vectors in a frame that is rotated by `angle` [rad] about E3."""
    c, s = np.cos(angle), np.sin(angle)
    one, two, three = np.moveaxis(vectors, -1, 0)
    # Component by component: the digits of a product of matrices depend on the number of vectors.
    return np.stack([c * one + s * two, c * two - s * one, three], axis=-1)


def tilts_into_plane(q: Array, azimuth: float, name: str) -> Array:
    """Angles psi, theta, phi of tilts in the E1-E3 plane (azimuth 0) or the E2-E3 plane (pi/2) as theta alone.

    q: shape (..., 3) [rad]; `name` is used in messages. Raises InputError for tilts outside the plane.
    """
    across, along, sign = (0, 1, 1.0) if abs(azimuth) < 1e-9 else (1, 0, -1.0)
    if min(abs(azimuth), abs(azimuth - np.pi / 2)) > 1e-9 and np.any(q):
        raise InputError(
            f"{name}: a planar model accepts a tilted state in the E1-E3 or E2-E3 plane only; use dimension = 'spatial'"
        )
    if np.any(q[..., [across, 2]]):
        raise InputError(
            f"{name} leaves the vertical plane of the model: give angles of that plane, or dimension = 'spatial'"
        )
    out = np.zeros_like(q)
    out[..., 1] = sign * q[..., along]
    return out


def motion_in_plane(motion: Motion, azimuth: float) -> Motion:
    """A motion in the frame of its vertical plane."""
    if not azimuth:
        return motion
    coefficients = motion.coefficients.copy()
    coefficients[:, :3] = rotated(coefficients[:, :3].transpose(0, 2, 1), azimuth).transpose(0, 2, 1)
    coefficients[:, 3:] = tilt_pieces(coefficients[:, 3:], azimuth)
    return replace(motion, coefficients=coefficients)


def wrench_in_plane(wrench: Array, azimuth: float) -> Array:
    """Polynomials of force and moment, shape (k, 6, 6) [SI], in the frame of a vertical plane."""
    rows = wrench.transpose(0, 2, 1)
    return np.ascontiguousarray(
        np.concatenate([rotated(rows[..., :3], azimuth), rotated(rows[..., 3:], azimuth)], axis=-1).transpose(0, 2, 1)
    )


def tilt_pieces(angles: Array, azimuth: float) -> Array:
    """Polynomials of psi, theta and further angles, (k, c, 6) [SI], of tilts in the E1-E3 or E2-E3 plane as theta.

    Other components are not checked: a planar model uses theta only, and its run ends where the plane is left.
    """
    if abs(azimuth - np.pi / 2) > 1e-9:
        return angles
    out = np.zeros_like(angles)
    out[:, 1] = -angles[:, 0]
    return out


def into_plane(state: State) -> State:
    """A state in the frame of its vertical plane, E1-E3 or E2-E3. Raises InputError if it lies in neither."""
    base, across = state.base.copy(), [0, *range(4, state.q.shape[1], 3)]
    in_second = any(
        np.any(x) for x in (state.q[:, across], state.v[:, across], state.f[:, 1], base[:, [1, 3]], state.load[[1, 3]])
    )
    azimuth = np.pi / 2 if in_second else 0.0
    base[:, :3] = rotated(base[:, :3], azimuth) if in_second else base[:, :3]
    base[:, 3:] = tilts_into_plane(base[:, 3:], azimuth, "base_rotation")
    force, moment = (rotated(x, azimuth) if in_second else x for x in (state.load[:3], state.load[3:]))
    f = rotated_pairs(state.f, azimuth)
    for name, value in (
        ("h", f[:, 1]),
        ("base_acceleration", base[:, 1]),
        ("top_force", force[1:2]),
        ("top_moment", moment[[0, 2]]),
        ("q, separation", rotated(state.q[:, 3:], azimuth)[:, 1] if state.q.shape[1] > 3 else 0.0),
        ("v, separation", rotated(state.v[:, 3:], azimuth)[:, 1] if state.v.shape[1] > 3 else 0.0),
    ):
        if np.any(np.abs(value) > 1e-12 * (1 + np.abs(np.concatenate([force, moment])).max())):
            raise InputError(f"{name} leaves the vertical plane of the state: give one plane, or dimension = 'spatial'")
    base[:, 1] = 0.0
    return replace(
        state,
        q=_coordinates_into_plane(state.q, azimuth, "q"),
        v=_coordinates_into_plane(state.v, azimuth, "v"),
        f=np.ascontiguousarray(f * [1.0, 0.0]),
        base=base,
        load=np.concatenate([force, moment]),
        azimuth=azimuth,
    )


def _coordinates_into_plane(q: Array, azimuth: float, name: str) -> Array:
    """Angles, and with uplift separations, (n-1, 3) or (n-1, 6), in the frame of their plane."""
    angles = tilts_into_plane(q[:, :3], azimuth, name)
    if q.shape[1] == 3:
        return angles
    return np.hstack([angles, rotated(q[:, 3:], azimuth) * [1.0, 0.0, 1.0]])


def coordinates_out_of_plane(q: Array, azimuth: float) -> Array:
    """Angles, and with uplift separations, shape (..., 3) or (..., 6) [unit of `q`], in the frame of the user."""
    angles = out_of_plane(q[..., :3], azimuth, "angles")
    return np.concatenate([angles, out_of_plane(q[..., 3:], azimuth, "vector")], axis=-1) if q.shape[-1] > 3 else angles


def rotated_pairs(pairs: Array, angle: float) -> Array:
    """Components, shape (..., 2), along t_1, t_2 in a frame that is rotated by `angle` [rad]."""
    if not angle:
        return pairs
    padded = np.concatenate([pairs, np.zeros((*pairs.shape[:-1], 1))], axis=-1)
    return np.ascontiguousarray(rotated(padded, angle)[..., :2])


def out_of_plane(values: Array, azimuth: float, kind: PlanarKind) -> Array:
    """Results of a planar model in the frame of the user; angles are exact at azimuth 0 and pi/2, else to order tilt^2.

    values: shape (..., 2) or (..., 3), as those returned [unit of `values`]; `kind` says whether they are Euler
    angles, contact angles, components along t_1 and t_2, a vector or an axial vector.
    """
    if not azimuth:
        return values
    if kind in ("vector", "axial"):
        return rotated(values, -azimuth)
    if kind == "pair":
        return rotated_pairs(values, -azimuth)
    first = 1 if kind in ("angles", "pair_angles") else 0
    out = np.array(values)
    out[..., 0] = -np.sin(azimuth) * values[..., first]
    out[..., 1] = np.cos(azimuth) * values[..., first]
    if abs(azimuth - np.pi / 2) < 1e-9:
        out[..., 1] = 0.0
    return out


def tilts_out_of_plane(q: Array, v: Array, azimuth: float) -> tuple[Array, Array, Array]:
    """Angles psi, theta and rates of a stack that tilts in a vertical plane above a level base: exact at any azimuth.

    q, v: theta of bodies 2..n in the frame of the plane, shape (n-1, 3) [rad], [rad/s]. Returns both without spin, with
    the axes t_3 and their rates of the planar stack; and the twist of bodies 1..n-1 about t_3, shape (n-1,) [rad], by
    which their t_1 is turned from where a rotation in the plane has it.
    """
    along, up = np.array([np.cos(azimuth), np.sin(azimuth), 0.0]), np.array([0.0, 0.0, 1.0])
    side = np.cross(up, along)
    angles, rates, twist = np.zeros_like(q), np.zeros_like(v), np.zeros(len(q))
    t, w = np.eye(3), np.zeros(3)  # rows t_1, t_2, t_3 of the body below, and its angular velocity
    for k, (tilt, speed) in enumerate(zip(np.cumsum(q[:, 1]), np.cumsum(v[:, 1]), strict=True)):
        axis = np.sin(tilt) * along + np.cos(tilt) * up
        x, y, z = np.sum(t * axis, axis=1)
        psi, theta, before = atan2(-y, z), asin(x), t[0]
        second = np.cos(psi) * t[1] + np.sin(psi) * t[2]  # (2.4)
        t = np.array([np.cross(second, axis), second, axis])
        rest = np.cross(speed * side - w, axis)
        rate = -np.sum(rest * t[1]) / np.cos(theta), np.sum(rest * t[0])
        w = w + rate[0] * before + rate[1] * t[1]  # (3.12)
        angles[k, :2], rates[k, :2] = (psi, theta), rate
        if k + 1 < len(q):
            radial = np.cross(side, axis)  # of the plane, turned with the body
            along_radial, along_side = np.sum(t[0] * radial), np.sum(t[0] * side)
            twist[k + 1] = atan2(
                np.sin(azimuth) * along_radial + np.cos(azimuth) * along_side,
                np.cos(azimuth) * along_radial - np.sin(azimuth) * along_side,
            )
    return angles, rates, twist
