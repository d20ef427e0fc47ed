"""The vertical plane in which a scene stays: base motion, loads, rotations and initial state.

Each input is described by horizontal vectors that lie in its plane of motion: a displacement, a force, or, for a
rotation or moment about a horizontal axis a, the horizontal direction of tilting a x E3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, pi
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.later import kept
from msfp_gen.motions import piecewise
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.piecewise import ORDER
from msfp_gen.motions.prescribed import Load, Rotation
from msfp_gen.scene.top import PrescribedTop

if TYPE_CHECKING:
    from msfp_gen.scene.scene_fields import SceneFields


@dataclass(frozen=True, eq=False)
class PlaneInput:
    """One input of a scene as a piecewise polynomial over time.

    name: as in messages. knots: shape (k+1,) [s]. coefficients: shape (k, 2, 6) of a horizontal vector, or (k, 1, 6) of
    an axial component, which must vanish in any planar motion. euler_angles: the vector consists of Euler angles, whose
    planar motion the equations describe in the E1-E3 and E2-E3 planes only.
    """

    name: str
    knots: Array
    coefficients: Array
    euler_angles: bool = False

    @cached_property
    def onset(self) -> float:
        """Time from which the input is not zero [s]; inf where it always is."""
        nonzero = np.any(self.coefficients, axis=(1, 2))
        return float(self.knots[int(np.argmax(nonzero))]) if nonzero.any() else inf

    @cached_property
    def plane(self) -> tuple[float | None, float]:
        """Azimuth of the plane in which the input starts [rad], and the time at which it leaves that plane [s].

        The azimuth is None where the input is zero or axial; the time is inf where it stays.
        """
        if self.onset == inf:
            return None, inf
        if self.coefficients.shape[1] == 1:
            return None, self.onset
        azimuth_of_all = piecewise.azimuth(self.knots, self.coefficients)
        if azimuth_of_all is not None:
            return azimuth_of_all, inf
        first, last = int(np.argmax(np.any(self.coefficients, axis=(1, 2)))), len(self.knots) - 1
        plane, low = None, first
        while last - low > 1:  # bisection for the largest number of leading pieces that lie in one plane
            middle = (low + last) // 2
            azimuth = piecewise.azimuth(self.knots[: middle + 1], self.coefficients[:middle])
            low, last, plane = (low, middle, plane) if azimuth is None else (middle, last, azimuth)
        return plane, float(self.knots[low])


def scene_plane(scene: SceneFields) -> tuple[float, float, str]:
    """Vertical plane of a scene: azimuth [rad], in (-pi/2, pi/2]; time at which it is left [s]; name of that input."""
    scene_azimuth: float | None = None
    until, name = inf, "motion"
    for part in plane_inputs(scene):
        azimuth, leaves = part.plane
        if azimuth is not None and scene_azimuth is None:
            scene_azimuth = azimuth
        other_plane = azimuth is not None and scene_azimuth is not None and abs(azimuth - scene_azimuth) > 1e-9
        oblique = part.euler_angles and azimuth is not None and min(abs(azimuth), abs(azimuth - pi / 2)) > 1e-9
        end = part.onset if other_plane or oblique else leaves
        if end < until:
            until, name = end, part.name
    return scene_azimuth or 0.0, until, name


def along(motion: Motion, axis: int) -> Motion:
    """The motion with its vertical channel and the horizontal one of an axis, 0 or 1.

    Raises InputError for a base that rotates.
    """
    if np.any(motion.coefficients[:, 3:]):
        raise InputError("motion: a base that rocks about both axes cannot be split by axis; use the spatial model")
    coefficients = motion.coefficients.copy()
    coefficients[:, 1 - axis] = 0.0
    return replace(motion, coefficients=coefficients)


def plane_inputs(scene: SceneFields) -> Iterator[PlaneInput]:
    """All inputs of a scene that may leave a vertical plane, the base motion first."""
    yield from kept(scene.motion, _of_motion)
    if isinstance(scene.top, PrescribedTop):
        values = np.zeros((1, 6, ORDER))
        values[0, :, 0] = [*scene.top.force, *scene.top.moment]
        yield from _wrench("top.force, top.moment", np.array([0.0, 1.0]), values)
    if scene.load is not None:
        yield from kept(scene.load, _of_load)
    if scene.top_rotation is not None:
        yield kept(scene.top_rotation, _of_rotation)
    state = scene.initial_state
    if state is not None:
        for row in (*state.q, *state.v):
            yield _constant("initial_state", (row[1], -row[0]), euler_angles=True)
            yield _constant("initial_state", row[2:])
        for pair in state.h:
            yield _constant("initial_state", pair)


def _of_motion(motion: Motion) -> tuple[PlaneInput, ...]:
    moving = motion.coefficients.copy()
    moving[:, :, 0] -= moving[0, :, 0]
    return (
        PlaneInput("motion", motion.knots, moving[:, :2]),
        _tilt("rotation of the base", motion.knots, motion.coefficients[:, 3:5]),
        PlaneInput("rotation of the base", motion.knots, motion.coefficients[:, 5:]),
    )


def _of_load(load: Load) -> tuple[PlaneInput, ...]:
    return tuple(_wrench("load", load.knots, load.coefficients))


def _of_rotation(rotation: Rotation) -> PlaneInput:
    return _tilt("top_rotation", rotation.knots, rotation.coefficients)


def _constant(name: str, values: tuple[float, ...], euler_angles: bool = False) -> PlaneInput:
    pieces = np.zeros((1, len(values), ORDER))
    pieces[0, :, 0] = values
    return PlaneInput(name, np.array([0.0, 1.0]), pieces, euler_angles)


def _tilt(name: str, knots: Array, angles: Array) -> PlaneInput:
    """Euler angles psi, theta, shape (k, 2, 6), as the direction of tilting (theta, -psi)."""
    return PlaneInput(name, knots, np.stack([angles[:, 1], -angles[:, 0]], axis=1), euler_angles=True)


def _wrench(name: str, knots: Array, wrench: Array) -> Iterator[PlaneInput]:
    """Horizontal force, direction of tilting of the horizontal moment, and axial moment."""
    yield PlaneInput(name, knots, wrench[:, :2])
    yield PlaneInput(name, knots, np.stack([wrench[:, 4], -wrench[:, 3]], axis=1))
    yield PlaneInput(name, knots, wrench[:, 5:])
