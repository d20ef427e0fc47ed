"""Outlines of bodies: half their meridian, for solids of revolution and sections.

Faces, edges of sliders and positions of rims follow from the data of the bearing (radii, heights, rim radii,
capacities). The height of a rim, the thickness of its wall, and the width of a slider without a rim radius are not
part of the data; they are assumed for drawing only.
"""

from __future__ import annotations

from math import asin, cos, sin
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array

if TYPE_CHECKING:
    from msfp_gen.scene.bearing import Bearing

POINTS = 60  # number of points of a face
RIM_HEIGHT = 0.15  # over the thickness of the slider at its edge
RIM_THICKNESS = 0.06  # over the radius of the rim


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
    """Half meridian of the face of the slider of a surface (index from 0), shape (k, 2) [m], as of `outline`."""
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
    """Radius of the rim of a surface (index from 0) about the axis of its dish [m]: that of the slider at capacity."""
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
    """Height of the rim of a surface [m]: a share of the thickness of its slider at the edge."""
    body = bearing.slider(surface)
    thickness = float(bearing.arrays()["height"][body])
    for other in (body - 1, body):
        if 0 <= other < bearing.layout.surfaces:
            thickness -= float(_face(bearing, other, body)[-1, 1])
    return RIM_HEIGHT * max(thickness, 0.0)


def _flat_face(face: Array, other: Array) -> Array:
    """A face that has one point becomes a flat face as wide as the other face of its body."""
    return np.vstack([face, (other[-1, 0], 0.0)]) if len(face) == 1 else face
