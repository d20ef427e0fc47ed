"""The stack cut by a vertical plane, in its true deformed shape: what figures and movies of it draw."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.history import Array
from msfp_gen.outline import outline, slider_face
from msfp_gen.shape import poses

if TYPE_CHECKING:
    from msfp_gen.result import Result


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
        """Points (..., 3) seen along the normal: (..., 2), along the plane and up."""
        return np.stack([points @ self.along, points[..., 2]], axis=-1)


@dataclass(frozen=True, eq=False)
class Section:
    """One instant. Positions along the plane from the middle of the base, and above its lower face, [m].

    Attributes:
        azimuth: of the plane, from E1 [rad].
        bodies: closed polygon of every body, base first, each ndarray, shape (k, 2); empty where the plane misses it.
        faces: the spherical face that slides in every surface, from edge to edge, each ndarray, shape (k, 2).
        contacts, centres: ndarray, shape (n-1, 2): where the normal forces act, and the sphere centres.
        points: ndarray, shape (n-1, 2): a point of the line of force of every surface.
        forces: ndarray, shape (n-1, 2), [N]: the force of every surface on the body above.
    """

    azimuth: float
    bodies: list[Array]
    faces: list[Array]
    contacts: Array
    centres: Array
    points: Array
    forces: Array


def sections(result: Result, azimuth: float | None = None) -> list[Section]:
    """The section of `result` in every row, along `azimuth` [rad] from E1; None: along the largest displacement.

    The plane runs through the middle of the sliders, so that a stack that has moved out of the plane is cut through
    every body as long as possible. The cut is exact; what lies beside the plane (contacts, centres, lines of force) is
    projected on it.
    """
    bearing, where = result.scene.bearing, poses(result)
    angle = azimuth_of(result) if azimuth is None else azimuth
    shapes = [outline(bearing, body) for body in range(bearing.layout.n)]
    faces = [(bearing.slider(surface), slider_face(bearing, surface)) for surface in range(bearing.layout.surfaces)]
    found = []
    for row in range(len(where)):
        bottom, basis = where.bottom[row], where.basis[row]
        plane = Plane((bottom + where.top[row])[1 : max(2, bearing.layout.n - 1)].mean(axis=0) / 2, angle)
        bodies = [_closed(*cut(shape, bottom[k], basis[k], plane)) for k, shape in enumerate(shapes)]
        arcs = [_open(*cut(face, bottom[k], basis[k], plane)) for k, face in faces]
        seen = (where.contact, where.centre, where.line, where.force)
        found.append(Section(angle, bodies, arcs, *(plane.project(x[row]) for x in seen)))
    return found


def azimuth_of(result: Result) -> float:
    """Azimuth [rad] of the vertical plane of the largest displacement, in (-pi/2, pi/2]; 0 where nothing moved."""
    history = result.history
    u1, u2 = history.displacement[history.peak_row, :2]
    angle = float(np.arctan2(u2, u1)) if u1 or u2 else 0.0
    return float(angle - np.pi * np.ceil(angle / np.pi - 0.5))


def cut(meridian: Array, bottom: Array, basis: Array, plane: Plane) -> tuple[Array, Array]:
    """Where the surface of revolution of `meridian` (k, 2) meets a plane: its two branches, each shape (j, 2), [m].

    meridian: distance from the axis and height above the bottom of the body, which stands at `bottom`, shape (3,), on
    `basis`, shape (3, 3). Branches run like the meridian; circles that the plane misses are left out, so j <= k. Exact:
    each circle of the body meets the plane in two points.
    """
    axis, across = basis[2], plane.normal
    lean = axis @ across
    upright = np.sqrt(1 - lean**2)
    second = (across - lean * axis) / upright
    first = np.cross(second, axis)
    middles = bottom + meridian[:, 1:] * axis
    off = (middles - plane.origin) @ across / upright
    square = meridian[:, 0] ** 2 - off**2
    met = square >= -1e-18  # on the axis, but for rounding
    half = np.sqrt(np.maximum(square[met], 0.0))[:, None]
    spine = middles[met] - off[met, None] * second
    return plane.project(spine - half * first), plane.project(spine + half * first)


def _closed(left: Array, right: Array) -> Array:
    return np.concatenate([right, left[::-1]])


def _open(left: Array, right: Array) -> Array:
    return np.concatenate([left[::-1], right])
