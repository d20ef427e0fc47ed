"""Where the bodies of a stack are at any instant of a run, and the line of the force that each surface carries.

Everything follows from the recorded angles and the lengths of the bearing: sphere centres are joints, so the bodies
fit at any angles (report (2.1)-(2.25), (3.4)-(3.11)); where bodies may part, the recorded separation of the two
centres comes on top (docs/uplift.md). No compiled model is needed. The frame is that of E1, E2, E3 with its origin in
the bottom middle of the base, which it follows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.history import Array
from msfp_gen.stages import Flags, parted

if TYPE_CHECKING:
    from msfp_gen.bearing import Bearing
    from msfp_gen.result import Result


@dataclass(frozen=True, eq=False)
class Poses:
    """A stack in T rows. Bodies 1..n, base first, and surfaces 1..n-1, bottom first; positions in [m].

    Attributes:
        basis: ndarray, shape (T, n, 3, 3): rows t_1, t_2, t_3 of every body, without its spin (2.1)-(2.6).
        spin: ndarray, shape (T, n), [rad]: phi of every body about its own t_3 (2.27).
        bottom, top: ndarray, shape (T, n, 3): middles of the lower and upper face of every body.
        centre: ndarray, shape (T, n-1, 3): sphere centres r_gc; where bodies may part, that of the slider.
        contact: ndarray, shape (T, n-1, 3): where the normal force acts (3.14).
        rim: ndarray, shape (T, n-1, 3): the point of the slider next to the rim (3.25); on its axis where centred.
        at_rim: ndarray of bool, shape (T, n-1): whether the rim pushes.
        force: ndarray, shape (T, n-1, 3), [N]: what the surface exerts on the body above; 0 while it is open.
        line: ndarray, shape (T, n-1, 3): the point of that force's line of action next to the sphere centre.
    """

    basis: Array
    spin: Array
    bottom: Array
    top: Array
    centre: Array
    contact: Array
    rim: Array
    at_rim: Flags
    force: Array
    line: Array

    def __len__(self) -> int:
        return len(self.basis)


def poses(result: Result) -> Poses:
    """The stack of `result` in every row; `resample.at_times` gives a result with rows at other times."""
    history, bearing, motion = result.history, result.scene.bearing, result.scene.motion
    base = motion.rotation(np.clip(history.time, 0.0, motion.duration))
    angles = np.concatenate([base[:, None], history.tilt_angles], axis=1)
    basis = turned(angles)
    bottom, top, centre = stacked(bearing, basis, history.separation)
    signs = np.array(bearing.layout.signs, float)[:, None]
    normal = _rotated(history.contact_angles, basis[:, :-1])[..., 2, :]  # t~_3 (3.13)
    contact = centre - signs * bearing.arrays()["radius"][:, None] * normal  # (3.14), concave down: + R
    rim, toward = _rims(bearing, basis, bottom, top)
    force = np.where(parted(history)[..., None], 0.0, history.interface_force)
    pushed = -history.rim_force[..., None] * toward  # (3.22) on the body above
    moment = np.cross(contact - centre, force - pushed) + np.cross(rim - centre, pushed)
    size = np.sum(force * force, axis=-1, keepdims=True)
    line = np.divide(np.cross(force, moment), size, out=contact - centre, where=size > 0) + centre
    at_rim = history.rim_force > 0
    return Poses(basis, angles[..., 2], bottom, top, centre, contact, rim, at_rim, force, line)


def turned(angles: Array) -> Array:
    """Bases from angles psi, theta, phi of bodies 1..n, each against the one below: (2.1)-(2.6).

    angles: ndarray, shape (T, n, 3), [rad]. Returns ndarray, shape (T, n, 3, 3), rows t_1, t_2, t_3. The spin phi turns
    the body on this basis, not the basis (2.27).
    """
    basis = np.empty((*angles.shape, 3))
    below = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for body in range(angles.shape[1]):
        below = basis[:, body] = _rotated(angles[:, body, :2], below)
    return basis


def stacked(bearing: Bearing, basis: Array, separation: Array) -> tuple[Array, Array, Array]:
    """Middles of the lower and upper faces, each shape (T, n, 3), and sphere centres, shape (T, n-1, 3), [m].

    basis: ndarray, shape (T, n, 3, 3), as of `turned`. separation: ndarray, shape (T, n-1, 3), [m], of the sphere
    centre of the body above from that of the body below; zero where they are joined. Centres are those of the sliders.
    """
    lengths = bearing.arrays()
    axis = basis[:, :, 2]
    bottom, top, centre = np.zeros_like(axis), np.zeros_like(axis), np.zeros_like(axis[:, 1:])
    for body, height in enumerate(lengths["height"]):
        if body:
            arm = bearing.layout.signs[body - 1] * lengths["radius"][body - 1]
            below = top[:, body - 1] + arm * axis[:, body - 1]
            above = below + separation[:, body - 1]
            centre[:, body - 1] = above if bearing.slider(body - 1) == body else below
            bottom[:, body] = above - arm * axis[:, body]
        top[:, body] = bottom[:, body] + height * axis[:, body]
    return bottom, top, centre


def friction_circles(result: Result) -> Array:
    """Radius mu R / sqrt(1 + mu^2) of the friction circle of every surface, ndarray, shape (T, n-1), [m].

    The line of force touches the circle about the sphere centre while the surface slides (docs/model.md).
    """
    mu = result.friction_coefficient
    radii: Array = result.scene.bearing.arrays()["radius"] * mu / np.sqrt(1 + mu**2)
    return radii


def _rotated(angles: Array, below: Array) -> Array:
    """R(psi, theta) applied to bases, shape (..., 3, 3): (2.3)-(2.6)."""
    cosine, sine = np.cos(angles)[..., None], np.sin(angles)[..., None]
    t1, t2, t3 = below[..., 0, :], below[..., 1, :], below[..., 2, :]
    second = cosine[..., 0, :] * t2 + sine[..., 0, :] * t3
    between = cosine[..., 0, :] * t3 - sine[..., 0, :] * t2
    first = cosine[..., 1, :] * t1 - sine[..., 1, :] * between
    return np.stack([first, second, cosine[..., 1, :] * between + sine[..., 1, :] * t1], axis=-2)


def _rims(bearing: Bearing, basis: Array, bottom: Array, top: Array) -> tuple[Array, Array]:
    """Point of every slider next to the rim (3.25), shape (T, n-1, 3) [m], and the direction of (3.24)."""
    lengths, axis = bearing.arrays(), basis[:, :, 2]
    points, directions = np.empty_like(axis[:, 1:]), np.empty_like(axis[:, 1:])
    for surface, sign in enumerate(bearing.layout.signs):
        body = bearing.slider(surface)
        own, other = axis[:, body], axis[:, surface if body == surface + 1 else surface + 1]
        along = other - np.sum(own * other, axis=-1, keepdims=True) * own
        size = np.linalg.norm(along, axis=-1, keepdims=True)
        direction = np.divide(along, size, out=np.zeros_like(along), where=size > 1e-12)  # 0/0 where centred
        middle = bottom[:, body] if sign > 0 else top[:, body]
        radius, offset = lengths["rim_radius"][body], lengths["rim_offset"][body]
        points[:, surface] = middle + sign * (radius * direction + offset * own)
        directions[:, surface] = direction
    return points, directions
