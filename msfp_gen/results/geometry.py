"""Geometry of the deformed stack: places and axes of its bodies, their outlines, sections, friction circles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import asin, cos, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.scene.bearing import Bearing

if TYPE_CHECKING:
    from msfp_gen.results.result import Result


@dataclass(frozen=True, eq=False)
class Poses:
    """Positions of a stack in T rows. Bodies 1..n, base first, and surfaces 1..n-1, bottom first.

    Attributes:
        basis: ndarray, shape (T, n, 3, 3), [-]: rows t_1, t_2, t_3 of every body, without its spin (2.1)-(2.6).
        spin: ndarray, shape (T, n), [rad]: phi of every body about its own t_3 (2.27).
        bottom, top: ndarray, shape (T, n, 3), [m]: centres of the lower and upper face of every body.
        centre: ndarray, shape (T, n-1, 3), [m]: sphere centres r_gc; with uplift, of the sliders.
        contact: ndarray, shape (T, n-1, 3), [m]: contact points (3.14).
        rim: ndarray, shape (T, n-1, 3), [m]: point of the slider nearest to the rim (3.25); on its axis where centred.
        force: ndarray, shape (T, n-1, 3), [N]: interface force on the body above; 0 while the surface is separated.
        line: ndarray, shape (T, n-1, 3), [m]: point of the line of force that is nearest to the sphere centre.
    """

    basis: Array
    spin: Array
    bottom: Array
    top: Array
    centre: Array
    contact: Array
    rim: Array
    force: Array
    line: Array

    def __len__(self) -> int:
        return len(self.basis)


def poses(result: Result) -> Poses:
    """The stack of `result` in every row; `Result.at_times` gives one with rows at other times."""
    (scene, history, _), bearing = result.alone, result.bearing
    motion = scene.motion
    base = motion.rotation(np.clip(history.time, 0.0, motion.duration))
    angles = np.concatenate([base[:, None], history.tilt_angles], axis=1)
    basis = body_bases(angles)
    bottom, top, centre = body_positions(bearing, basis, history.separation)
    signs = np.array(bearing.layout.signs, float)[:, None]
    normal = _rotated(history.contact_angles, basis[:, :-1])[..., 2, :]  # t~_3 (3.13)
    contact = centre - signs * bearing.arrays()["radius"][:, None] * normal  # (3.14); concave down: + R
    rim_direction = _rim_directions(bearing, basis[:, :, 2])
    rim = _rim_points(bearing, basis[:, :, 2], bottom, top, rim_direction)
    force = np.where(history.separated[..., None], 0.0, history.interface_force)
    rim_force = -history.rim_force[..., None] * rim_direction  # (3.22), on the body above
    moment = np.cross(contact - centre, force - rim_force) + np.cross(rim - centre, rim_force)
    square = np.sum(force * force, axis=-1, keepdims=True)
    line = np.divide(np.cross(force, moment), square, out=contact - centre, where=square > 0) + centre
    return Poses(basis, angles[..., 2], bottom, top, centre, contact, rim, force, line)


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

    basis: ndarray, shape (T, n, 3, 3), from `body_bases`. separation: from the sphere centre of the body below to that
    centre of the body above, ndarray, shape (T, n-1, 3) [m]; zero without uplift. The sphere centres belong to the
    sliders.
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


def contact_offsets(bearing: Bearing, contact_angles: Array, tilt_angles: Array) -> Array:
    """Distance of the contact point (3.14) from the axis of the slider, ndarray, shape (T, n-1) [m].

    The normal force of a surface acts there. Beyond the radius of the slider's face it could not.

    Args:
        bearing: the bearing.
        contact_angles: of a history, shape (T, n-1, 2) [rad].
        tilt_angles: of a history, shape (T, n-1, 3) [rad].
    """
    upright = np.broadcast_to(np.eye(3), (*contact_angles.shape[:-1], 3, 3))
    normal = _rotated(contact_angles, upright)[..., 2, :]  # t~_3 (3.13), in the basis of the body below
    above = _rotated(tilt_angles[..., :2], upright)[..., 2, :]
    concave_up = np.array(bearing.layout.signs)[:, None] > 0
    offsets: Array = np.linalg.norm(np.cross(normal, np.where(concave_up, above, upright[..., 2, :])), axis=-1)
    return offsets * bearing.arrays()["radius"]


def friction_circles(result: Result) -> Array:
    """Radius mu R/sqrt(1 + mu^2) of the friction circle of every surface, ndarray, shape (T, n-1) [m].

    While the surface slides, the line of force is tangent to this circle about the sphere centre (docs/model.md).
    """
    mu = result.friction_coefficient
    radii: Array = result.bearing.arrays()["radius"] * mu / np.sqrt(1 + mu**2)
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


POINTS = 60  # number of points of a face
RIM_HEIGHT = 0.15  # over the thickness of the slider at its edge
RIM_THICKNESS = 0.06  # over the radius of the rim
RIM_GAP = 1 / 3  # largest height of a rim over the gap to the dish that it faces: a third stays open between two


def outline(bearing: Bearing, body: int) -> Array:
    """Half meridian of a body (index from 0, base first), ndarray, shape (k, 2) [m].

    Each point has its distance from the axis and its height above the centre of the lower face. The points go from the
    centre of the lower face around the edge to the centre of the upper face.
    """
    height = float(bearing.arrays()["height"][body])
    lower, upper = (_face_and_edge(bearing, surface, body) for surface in (body - 1, body))
    lower, upper = _flat_face(lower, upper), _flat_face(upper, lower)
    upper = np.stack([upper[:, 0], height - upper[:, 1]], axis=1)
    return np.concatenate([lower, upper[::-1]])


def slider_face(bearing: Bearing, surface: int) -> Array:
    """Half meridian of the face of the slider of a surface (index from 0), shape (k, 2) [m], as in `outline`."""
    body = bearing.slider(surface)
    face = _face(bearing, surface, body)
    if bearing.layout.signs[surface] > 0:
        return face
    return np.stack([face[:, 0], bearing.arrays()["height"][body] - face[:, 1]], axis=1)


def slider_radius(bearing: Bearing, surface: int) -> float:
    """Radius of the face of the slider of a surface (index from 0) [m]: its rim radius, else an assumed value."""
    data = bearing.surfaces[surface]
    largest = data.radius * cos(data.capacity / data.radius)  # a wider slider at capacity would leave the hemisphere
    return bearing.slider_rim_radius(surface) or min(data.capacity, largest / 2)


def dish_radius(bearing: Bearing, surface: int) -> float:
    """Radius of the rim of a surface (index from 0) about the axis of its dish [m]: where the slider is at capacity."""
    data = bearing.surfaces[surface]
    return data.radius * sin(data.capacity / data.radius + asin(slider_radius(bearing, surface) / data.radius))


def _face(bearing: Bearing, surface: int, body: int) -> Array:
    """Spherical face of a body from its centre to its edge: distance from the axis, and depth into the body [m]."""
    slides = bearing.slider(surface) == body
    radius = bearing.surfaces[surface].radius
    edge = slider_radius(bearing, surface) if slides else dish_radius(bearing, surface)
    angle = np.linspace(0.0, asin(edge / radius), POINTS)
    depth = 2 * radius * np.sin(angle / 2) ** 2
    return np.stack([radius * np.sin(angle), depth if slides else -depth], axis=1)


def _face_and_edge(bearing: Bearing, surface: int, body: int) -> Array:
    """A face with the rim of a dish or the side of a slider; one point where the body has no surface."""
    if not 0 <= surface < bearing.layout.surfaces:
        return np.zeros((1, 2))
    face = _face(bearing, surface, body)
    (radius, depth), height = face[-1], _rim_height(bearing, surface)
    if bearing.slider(surface) == body:
        return np.vstack([face, (radius, depth + 1.2 * height)])
    return np.vstack([face, (radius, depth - height), (radius * (1 + RIM_THICKNESS), depth - height)])


def _rim_height(bearing: Bearing, surface: int) -> float:
    """Height of the rim of a surface [m]: a share of the thickness of its slider at the edge, at most of its gaps."""
    body = bearing.slider(surface)
    thickness = float(bearing.arrays()["height"][body])
    for other in (body - 1, body):
        if 0 <= other < bearing.layout.surfaces:
            thickness -= float(_face(bearing, other, body)[-1, 1])
    return max(0.0, min([RIM_HEIGHT * thickness, *(RIM_GAP * gap for gap in _gaps(bearing, surface))]))


def _gaps(bearing: Bearing, surface: int) -> Iterator[float]:
    """Distance at rest of the edge of a dish from every dish that faces it there [m]."""
    edge, signs = dish_radius(bearing, surface), bearing.layout.signs
    levels = np.cumsum(bearing.arrays()["height"])  # of the surfaces, on the axis
    for other, sign in enumerate(signs):
        facing = dish_radius(bearing, other)
        if sign != signs[surface] and facing * (1 + RIM_THICKNESS) >= edge:
            radii = bearing.surfaces[surface].radius, bearing.surfaces[other].radius
            deep = sum(radius - sqrt(radius**2 - min(edge, facing) ** 2) for radius in radii)
            yield abs(float(levels[other] - levels[surface])) - deep


def _flat_face(face: Array, other: Array) -> Array:
    """A face that has one point becomes a flat face as wide as the other face of its body."""
    return np.vstack([face, (other[-1, 0], 0.0)]) if len(face) == 1 else face


@dataclass(frozen=True, eq=False)
class Plane:
    """A vertical plane through `origin`, shape (3,) [m], along `azimuth` [rad] from E1."""

    origin: Array
    azimuth: float

    @property
    def along(self) -> Array:
        """Horizontal unit vector in the plane, ndarray, shape (3,), [-]."""
        return np.array([np.cos(self.azimuth), np.sin(self.azimuth), 0.0])

    @property
    def normal(self) -> Array:
        """Unit vector across the plane, ndarray, shape (3,), [-]."""
        return np.array([-np.sin(self.azimuth), np.cos(self.azimuth), 0.0])

    def project(self, points: Array) -> Array:
        """Points, shape (..., 3) [m], seen along the normal: shape (..., 2) [m], along the plane and up."""
        return np.stack([points @ self.along, points[..., 2]], axis=-1)


@dataclass(frozen=True, eq=False)
class StackSection:
    """Section of one row. Coordinates [m]: along the plane from the centre of the base, and above its lower face.

    Attributes:
        azimuth: of the plane, from E1 [rad].
        bodies: closed polygon of every body, base first, each ndarray, shape (k, 2), [m]; empty if the plane misses it.
        faces: the face of the slider of every surface, from edge to edge, each ndarray, shape (k, 2), [m].
        contacts, centres: ndarray, shape (n-1, 2), [m]: contact points and sphere centres.
        points: ndarray, shape (n-1, 2), [m]: a point of the line of force of every surface.
        forces: ndarray, shape (n-1, 2), [N]: interface force of every surface on the body above.
    """

    azimuth: float
    bodies: list[Array]
    faces: list[Array]
    contacts: Array
    centres: Array
    points: Array
    forces: Array


def sections(result: Result, azimuth: float | None = None) -> list[StackSection]:
    """The section of `result` in every row, along `azimuth` [rad] from E1; None: along the largest displacement.

    The plane passes through the mean position of the sliders, so that it also cuts all bodies of a stack that has moved
    sideways, as far as possible. The sections of bodies are exact; contact points, centres and lines of force, which
    may lie beside the plane, are projected on it.
    """
    bearing, stack = result.bearing, poses(result)
    angle = azimuth_of(result) if azimuth is None else azimuth
    shapes = [outline(bearing, body) for body in range(bearing.layout.n)]
    faces = [(bearing.slider(surface), slider_face(bearing, surface)) for surface in range(bearing.layout.surfaces)]
    sections = []
    for row in range(len(stack)):
        bottom, basis = stack.bottom[row], stack.basis[row]
        plane = Plane((bottom + stack.top[row])[1 : max(2, bearing.layout.n - 1)].mean(axis=0) / 2, angle)
        branches = [cut(shape, bottom[k], basis[k], plane) for k, shape in enumerate(shapes)]
        bodies = [np.concatenate([right, left[::-1]]) for left, right in branches]
        branches = [cut(face, bottom[k], basis[k], plane) for k, face in faces]
        arcs = [np.concatenate([left[::-1], right]) for left, right in branches]
        projected = (stack.contact, stack.centre, stack.line, stack.force)
        sections.append(StackSection(angle, bodies, arcs, *(plane.project(x[row]) for x in projected)))
    return sections


def azimuth_of(result: Result) -> float:
    """Azimuth [rad] of the vertical plane of the largest displacement, in (-pi/2, pi/2]; 0 without displacement."""
    history = result.history
    u1, u2 = history.displacement[history.peak_row, :2]
    angle = float(np.arctan2(u2, u1)) if u1 or u2 else 0.0
    return float(angle - np.pi * np.ceil(angle / np.pi - 0.5))


def cut(meridian: Array, bottom: Array, basis: Array, plane: Plane) -> tuple[Array, Array]:
    """Intersection of a surface of revolution with a plane: its two branches, each ndarray, shape (j, 2) [m].

    meridian: distance from the axis and height above the bottom, shape (k, 2) [m]. bottom: its position, shape (3,)
    [m]. basis: t_1, t_2, t_3 of the body, shape (3, 3). Each circle of the surface meets the plane in two points, one
    of each branch; circles that the plane does not meet are left out, so j <= k. The points are exact.
    """
    axis, normal = basis[2], plane.normal
    cosine = axis @ normal
    sine = np.sqrt(1 - cosine**2)
    second = (normal - cosine * axis) / sine  # in the plane of the circles, perpendicular to the chords
    first = np.cross(second, axis)  # direction of the chords
    centres = bottom + meridian[:, 1:] * axis
    distance = (centres - plane.origin) @ normal / sine
    square = meridian[:, 0] ** 2 - distance**2
    met = square >= -1e-18  # the tolerance keeps points on the axis, where rounding may give a negative value
    half_chord = np.sqrt(np.maximum(square[met], 0.0))[:, None]
    middle = centres[met] - distance[met, None] * second
    return plane.project(middle - half_chord * first), plane.project(middle + half_chord * first)
