"""Positions of the bodies of a stack in the rows of a run, and the line of force of every surface.

They follow from the recorded angles and the dimensions of the bearing, without a compiled model: the sphere centres act
as joints (2.1)-(2.25), (3.4)-(3.11), and with uplift the recorded separations of the centres are added
(docs/uplift.md). Axes are E1, E2, E3; the origin is the centre of the lower face of the base and moves with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.sliding import Flags, separated

if TYPE_CHECKING:
    from msfp_gen.results.history import History
    from msfp_gen.results.run_data import RunData
    from msfp_gen.scene.bearing import Bearing


@dataclass(frozen=True, eq=False)
class Poses:
    """Positions of a stack in T rows. Bodies 1..n, base first, and surfaces 1..n-1, bottom first; positions in [m].

    Attributes:
        basis: ndarray, shape (T, n, 3, 3): rows t_1, t_2, t_3 of every body, without its spin (2.1)-(2.6).
        spin: ndarray, shape (T, n), [rad]: phi of every body about its own t_3 (2.27).
        bottom, top: ndarray, shape (T, n, 3): centres of the lower and upper face of every body.
        centre: ndarray, shape (T, n-1, 3): sphere centres r_gc; with uplift, those of the sliders.
        contact: ndarray, shape (T, n-1, 3): contact points (3.14).
        rim: ndarray, shape (T, n-1, 3): point of the slider nearest to the rim (3.25); on its axis where centred.
        at_rim: ndarray of bool, shape (T, n-1): whether the rim is in contact.
        force: ndarray, shape (T, n-1, 3), [N]: interface force on the body above; 0 while the surface is separated.
        line: ndarray, shape (T, n-1, 3): point of the line of force that is nearest to the sphere centre.
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


def poses(result: RunData) -> Poses:
    """The stack of `result` in every row; `resample.at_times` gives a result with rows at other times."""
    history, bearing, motion = result.history, result.scene.bearing, result.scene.motion
    base = motion.rotation(np.clip(history.time, 0.0, motion.duration))
    angles = np.concatenate([base[:, None], history.tilt_angles], axis=1)
    basis = body_bases(angles)
    bottom, top, centre = body_positions(bearing, basis, history.separation)
    signs = np.array(bearing.layout.signs, float)[:, None]
    normal = _rotated(history.contact_angles, basis[:, :-1])[..., 2, :]  # t~_3 (3.13)
    contact = centre - signs * bearing.arrays()["radius"][:, None] * normal  # (3.14); concave down: + R
    rim_direction = _rim_directions(bearing, basis[:, :, 2])
    rim = _rim_points(bearing, basis[:, :, 2], bottom, top, rim_direction)
    force = np.where(separated(history)[..., None], 0.0, history.interface_force)
    rim_force = -history.rim_force[..., None] * rim_direction  # (3.22), on the body above
    moment = np.cross(contact - centre, force - rim_force) + np.cross(rim - centre, rim_force)
    square = np.sum(force * force, axis=-1, keepdims=True)
    line = np.divide(np.cross(force, moment), square, out=contact - centre, where=square > 0) + centre
    at_rim = history.rim_force > 0
    return Poses(basis, angles[..., 2], bottom, top, centre, contact, rim, at_rim, force, line)


def body_bases(angles: Array) -> Array:
    """Bases of bodies 1..n from their angles psi, theta, phi, each relative to the body below (2.1)-(2.6).

    angles: ndarray, shape (T, n, 3), [rad]. Returns ndarray, shape (T, n, 3, 3), rows t_1, t_2, t_3. These bases do not
    spin: phi rotates the body relative to its basis (2.27).
    """
    basis = np.empty((*angles.shape, 3))
    below = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for body in range(angles.shape[1]):
        below = basis[:, body] = _rotated(angles[:, body, :2], below)
    return basis


def body_positions(bearing: Bearing, basis: Array, separation: Array) -> tuple[Array, Array, Array]:
    """Centres of the lower and upper faces, each shape (T, n, 3), and sphere centres, shape (T, n-1, 3) [m].

    basis: ndarray, shape (T, n, 3, 3), from `body_bases`. separation: of the sphere centre of the body above from that
    of the body below, ndarray, shape (T, n-1, 3) [m]; zero without uplift. The sphere centres are those of the sliders.
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


def contact_offsets(bearing: Bearing, history: History) -> Array:
    """Distance of the contact point (3.14) from the axis of the slider, ndarray, shape (T, n-1) [m].

    The normal force of a surface acts there. Beyond the radius of the slider's face it could not.
    """
    upright = np.broadcast_to(np.eye(3), (*history.contact_angles.shape[:-1], 3, 3))
    normal = _rotated(history.contact_angles, upright)[..., 2, :]  # t~_3 (3.13), in the basis of the body below
    above = _rotated(history.tilt_angles[..., :2], upright)[..., 2, :]
    concave_up = np.array(bearing.layout.signs)[:, None] > 0
    offsets: Array = np.linalg.norm(np.cross(normal, np.where(concave_up, above, upright[..., 2, :])), axis=-1)
    return offsets * bearing.arrays()["radius"]


def friction_circles(result: RunData) -> Array:
    """Radius mu R/sqrt(1 + mu^2) of the friction circle of every surface, ndarray, shape (T, n-1) [m].

    While the surface slides, the line of force is tangent to this circle about the sphere centre (docs/model.md).
    """
    mu = result.friction_coefficient
    radii: Array = result.scene.bearing.arrays()["radius"] * mu / np.sqrt(1 + mu**2)
    return radii


def _rotated(angles: Array, below: Array) -> Array:
    """Bases `below`, shape (..., 3, 3), rotated by R(psi, theta) (2.3)-(2.6)."""
    cosine, sine = np.cos(angles)[..., None], np.sin(angles)[..., None]
    t1, t2, t3 = below[..., 0, :], below[..., 1, :], below[..., 2, :]
    second = cosine[..., 0, :] * t2 + sine[..., 0, :] * t3
    between = cosine[..., 0, :] * t3 - sine[..., 0, :] * t2
    first = cosine[..., 1, :] * t1 - sine[..., 1, :] * between
    return np.stack([first, second, cosine[..., 1, :] * between + sine[..., 1, :] * t1], axis=-2)


def rim_forces(bearing: Bearing, angles: Array, size: Array) -> Array:
    """Rim forces on the bodies above (3.22), ndarray, shape (T, n-1, 3) [N].

    angles: of bodies 1..n, shape (T, n, 3) [rad]. size: of the forces, shape (T, n-1) [N].
    """
    forces: Array = -size[..., None] * _rim_directions(bearing, body_bases(angles)[:, :, 2])
    return forces


def _rim_directions(bearing: Bearing, axis: Array) -> Array:
    """Directions from the sliders towards the rims (3.24), shape (T, n-1, 3); zero where the slider is centred."""
    directions = np.empty_like(axis[:, 1:])
    for surface in range(bearing.layout.surfaces):
        body = bearing.slider(surface)
        own, other = axis[:, body], axis[:, surface if body == surface + 1 else surface + 1]
        along = other - np.sum(own * other, axis=-1, keepdims=True) * own
        norm = np.linalg.norm(along, axis=-1, keepdims=True)
        directions[:, surface] = np.divide(along, norm, out=np.zeros_like(along), where=norm > 1e-12)
    return directions


def _rim_points(bearing: Bearing, axis: Array, bottom: Array, top: Array, direction: Array) -> Array:
    """Point of every slider nearest to the rim (3.25), shape (T, n-1, 3) [m]."""
    lengths, points = bearing.arrays(), np.empty_like(direction)
    for surface, sign in enumerate(bearing.layout.signs):
        body = bearing.slider(surface)
        middle = bottom[:, body] if sign > 0 else top[:, body]
        radius, offset = lengths["rim_radius"][body], lengths["rim_offset"][body]
        points[:, surface] = middle + sign * (radius * direction[:, surface] + offset * axis[:, body])
    return points
