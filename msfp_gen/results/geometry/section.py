"""Sections of the deformed stack by a vertical plane, for figures and movies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.geometry.outline import outline, slider_face
from msfp_gen.results.geometry.shape import poses

if TYPE_CHECKING:
    from msfp_gen.results.run_data import RunData


@dataclass(frozen=True, eq=False)
class Plane:
    """A vertical plane through `origin`, shape (3,) [m], along `azimuth` [rad] from E1."""

    origin: Array
    azimuth: float

    @property
    def along(self) -> Array:
        """Horizontal unit vector in the plane, ndarray, shape (3,)."""
        return np.array([np.cos(self.azimuth), np.sin(self.azimuth), 0.0])

    @property
    def normal(self) -> Array:
        """Unit vector across the plane, ndarray, shape (3,)."""
        return np.array([-np.sin(self.azimuth), np.cos(self.azimuth), 0.0])

    def project(self, points: Array) -> Array:
        """Points, shape (..., 3) [m], seen along the normal: shape (..., 2) [m], along the plane and up."""
        return np.stack([points @ self.along, points[..., 2]], axis=-1)


@dataclass(frozen=True, eq=False)
class Section:
    """Section of one row. Coordinates [m]: along the plane from the centre of the base, and above its lower face.

    Attributes:
        azimuth: of the plane, from E1 [rad].
        bodies: closed polygon of every body, base first, each ndarray, shape (k, 2); empty if the plane misses it.
        faces: the face of the slider of every surface, from edge to edge, each ndarray, shape (k, 2).
        contacts, centres: ndarray, shape (n-1, 2): contact points and sphere centres.
        points: ndarray, shape (n-1, 2): a point of the line of force of every surface.
        forces: ndarray, shape (n-1, 2), [N]: interface force of every surface on the body above.
    """

    azimuth: float
    bodies: list[Array]
    faces: list[Array]
    contacts: Array
    centres: Array
    points: Array
    forces: Array


def sections(result: RunData, azimuth: float | None = None) -> list[Section]:
    """The section of `result` in every row, along `azimuth` [rad] from E1; None: along the largest displacement.

    The plane passes through the mean position of the sliders, so that it also cuts all bodies of a stack that has moved
    sideways, as far as possible. The sections of bodies are exact; contact points, centres and lines of force, which
    may lie beside the plane, are projected on it.
    """
    bearing, stack = result.scene.bearing, poses(result)
    angle = azimuth_of(result) if azimuth is None else azimuth
    shapes = [outline(bearing, body) for body in range(bearing.layout.n)]
    faces = [(bearing.slider(surface), slider_face(bearing, surface)) for surface in range(bearing.layout.surfaces)]
    found = []
    for row in range(len(stack)):
        bottom, basis = stack.bottom[row], stack.basis[row]
        plane = Plane((bottom + stack.top[row])[1 : max(2, bearing.layout.n - 1)].mean(axis=0) / 2, angle)
        bodies = [_closed(*cut(shape, bottom[k], basis[k], plane)) for k, shape in enumerate(shapes)]
        arcs = [_open(*cut(face, bottom[k], basis[k], plane)) for k, face in faces]
        projected = (stack.contact, stack.centre, stack.line, stack.force)
        found.append(Section(angle, bodies, arcs, *(plane.project(x[row]) for x in projected)))
    return found


def azimuth_of(result: RunData) -> float:
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


def _closed(left: Array, right: Array) -> Array:
    """Both branches as a closed polygon."""
    return np.concatenate([right, left[::-1]])


def _open(left: Array, right: Array) -> Array:
    """Both branches as an open line from edge to edge."""
    return np.concatenate([left[::-1], right])
