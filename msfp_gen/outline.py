"""What bodies look like: half their meridian, to be turned about the axis or cut by a plane.

Faces, the edges of sliders and the places of rims follow from the data of a bearing (radii, heights, rim radii,
capacities). How high a rim stands, how thick its wall is, and how wide a slider without a rim radius is are not in the
data: they are drawn for the eye.
"""

from __future__ import annotations

from math import asin, cos, sin
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.history import Array

if TYPE_CHECKING:
    from msfp_gen.bearing import Bearing

POINTS = 60  # on a face
LIP = 0.15  # height of a rim over the thickness of the slider at its edge
WALL = 0.06  # thickness of a rim over its radius


def outline(bearing: Bearing, body: int) -> Array:
    """Half meridian of a body (index from 0, base first), ndarray, shape (k, 2), [m].

    Distance from the axis and height above the middle of the lower face, from the axis below, round the edge, to the
    axis above.
    """
    height = float(bearing.arrays()["height"][body])
    lower, upper = (_rimmed(bearing, surface, body) for surface in (body - 1, body))
    lower, upper = _widened(lower, upper), _widened(upper, lower)
    upper = np.stack([upper[:, 0], height - upper[:, 1]], axis=1)
    return np.concatenate([lower, upper[::-1]])


def slider_face(bearing: Bearing, surface: int) -> Array:
    """Half meridian of the spherical face that slides in a surface (index from 0), as `outline` measures its body."""
    body = bearing.slider(surface)
    face = _face(bearing, surface, body)
    if bearing.layout.signs[surface] > 0:
        return face
    return np.stack([face[:, 0], bearing.arrays()["height"][body] - face[:, 1]], axis=1)


def slider_radius(bearing: Bearing, surface: int) -> float:
    """Radius of the face that slides in a surface (index from 0) [m]; without a rim radius, one that looks right."""
    here = bearing.surfaces[surface]
    room = here.radius * cos(here.capacity / here.radius)  # a wider slider at capacity would leave the hemisphere
    return bearing.slider_rim_radius(surface) or min(here.capacity, room / 2)


def cup_radius(bearing: Bearing, surface: int) -> float:
    """Distance of the rim of a surface (index from 0) from the axis of its cup [m]: the slider's edge at capacity."""
    here = bearing.surfaces[surface]
    return here.radius * sin(here.capacity / here.radius + asin(slider_radius(bearing, surface) / here.radius))


def _face(bearing: Bearing, surface: int, body: int) -> Array:
    """Spherical face of a body from its middle to its edge: distance from the axis, and depth into the body."""
    slides = bearing.slider(surface) == body
    radius = bearing.surfaces[surface].radius
    edge = slider_radius(bearing, surface) if slides else cup_radius(bearing, surface)
    angle = np.linspace(0.0, asin(edge / radius), POINTS)
    depth = 2 * radius * np.sin(angle / 2) ** 2
    return np.stack([radius * np.sin(angle), depth if slides else -depth], axis=1)


def _rimmed(bearing: Bearing, surface: int, body: int) -> Array:
    """A face with what stands at its edge: the rim of a cup, the side of a slider; flat outside the stack."""
    if not 0 <= surface < bearing.layout.surfaces:
        return np.zeros((1, 2))
    face = _face(bearing, surface, body)
    (radius, depth), lip = face[-1], _lip(bearing, surface)
    if bearing.slider(surface) == body:
        return np.vstack([face, (radius, depth + 1.2 * lip)])
    return np.vstack([face, (radius, depth - lip), (radius * (1 + WALL), depth - lip)])


def _lip(bearing: Bearing, surface: int) -> float:
    """Height of the rim of a surface [m]: a share of the thickness that its slider has at the edge."""
    body = bearing.slider(surface)
    thickness = float(bearing.arrays()["height"][body])
    for other in (body - 1, body):
        if 0 <= other < bearing.layout.surfaces:
            thickness -= float(_face(bearing, other, body)[-1, 1])
    return LIP * max(thickness, 0.0)


def _widened(face: Array, other: Array) -> Array:
    """A flat face is as wide as the other side of its body."""
    return np.vstack([face, (other[-1, 0], 0.0)]) if len(face) == 1 else face
