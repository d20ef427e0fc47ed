"""What drives a scene, and the vertical plane it stays in: motion of the base, loads, rotations, initial state.

Each drive is a track, a horizontal vector over time that lies in the plane it drives: a displacement, a force, or, of a
rotation or a moment about the horizontal axis a, the direction a x E3 in which it leans.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf, pi
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen import piecewise
from msfp_gen.piecewise import ORDER, Array
from msfp_gen.top import PrescribedTop

if TYPE_CHECKING:
    from msfp_gen.scene import Scene


@dataclass(frozen=True, eq=False)
class Track:
    """A horizontal vector over time, or what no plane holds.

    turning: Euler angles, which turn with the frame in the E1-E3 and E2-E3 planes alone. coefficients: shape
    (k, 2, 6), or (k, 1, 6) of an axial component that must be nothing in every plane.
    """

    name: str
    knots: Array
    coefficients: Array
    turning: bool = False

    def onset(self) -> float:
        """Time from which it is not nothing [s]."""
        moving = np.any(self.coefficients, axis=(1, 2))
        return float(self.knots[int(np.argmax(moving))]) if moving.any() else inf

    def line(self) -> tuple[float | None, float]:
        """Azimuth [rad] of the line it first moves along (None: it is nothing), and until when it stays on it [s]."""
        if self.onset() == inf:
            return None, inf
        if self.coefficients.shape[1] == 1:
            return None, self.onset()
        found = piecewise.azimuth(self.knots, self.coefficients)
        if found is not None:
            return found, inf
        first, last = int(np.argmax(np.any(self.coefficients, axis=(1, 2)))), len(self.knots) - 1
        straight, low = None, first
        while last - low > 1:  # the longest beginning that is straight
            middle = (low + last) // 2
            azimuth = piecewise.azimuth(self.knots[: middle + 1], self.coefficients[:middle])
            low, last, straight = (low, middle, straight) if azimuth is None else (middle, last, azimuth)
        return straight, float(self.knots[low])


def plane_of(scene: Scene) -> tuple[float, float, str]:
    """Azimuth [rad], in (-pi/2, pi/2], of the vertical plane of a scene; until when it holds [s]; what leaves it."""
    plane: float | None = None
    until, culprit = inf, "motion"
    for track in tracks(scene):
        azimuth, straight = track.line()
        if azimuth is not None and plane is None:
            plane = azimuth
        apart = azimuth is not None and plane is not None and abs(azimuth - plane) > 1e-9
        oblique = track.turning and azimuth is not None and min(abs(azimuth), abs(azimuth - pi / 2)) > 1e-9
        holds = track.onset() if apart or oblique else straight
        if holds < until:
            until, culprit = holds, track.name
    return plane or 0.0, until, culprit


def tracks(scene: Scene) -> Iterator[Track]:
    """All that drives a scene, the base first."""
    motion = scene.motion
    moving = motion.coefficients.copy()
    moving[:, :, 0] -= moving[0, :, 0]
    yield Track("motion", motion.knots, moving[:, :2])
    yield from _rocking("rotation of the base", motion.knots, motion.coefficients[:, 3:5])
    yield Track("rotation of the base", motion.knots, motion.coefficients[:, 5:])
    if isinstance(scene.top, PrescribedTop):
        values = np.zeros((1, 6, ORDER))
        values[0, :, 0] = [*scene.top.force, *scene.top.moment]
        yield from _wrench("top.force, top.moment", np.array([0.0, 1.0]), values)
    if scene.load is not None:
        yield from _wrench("load", scene.load.knots, scene.load.coefficients)
    if scene.top_rotation is not None:
        yield from _rocking("top_rotation", scene.top_rotation.knots, scene.top_rotation.coefficients)
    state = scene.initial_state
    if state is not None:
        for row in (*state.q, *state.v):
            yield _constant("initial_state", (row[1], -row[0]), turning=True)
            yield _constant("initial_state", row[2:])
        for pair in state.h:
            yield _constant("initial_state", pair)


def _constant(name: str, values: tuple[float, ...], turning: bool = False) -> Track:
    pieces = np.zeros((1, len(values), ORDER))
    pieces[0, :, 0] = values
    return Track(name, np.array([0.0, 1.0]), pieces, turning)


def _rocking(name: str, knots: Array, angles: Array) -> Iterator[Track]:
    yield Track(name, knots, np.stack([angles[:, 1], -angles[:, 0]], axis=1), turning=True)


def _wrench(name: str, knots: Array, wrench: Array) -> Iterator[Track]:
    yield Track(name, knots, wrench[:, :2])
    yield Track(name, knots, np.stack([wrench[:, 4], -wrench[:, 3]], axis=1))
    yield Track(name, knots, wrench[:, 5:])
