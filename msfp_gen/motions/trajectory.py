"""Rigid-body motion over time as piecewise polynomials of six channels: evaluation, comparison, plane of motion."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.motions import piecewise
from msfp_gen.motions.checks import checked_pieces, numbers, order, positive, storable
from msfp_gen.motions.piecewise import Metadata
from msfp_gen.motions.time_grid import Resolution

CHANNELS = ("u_g1", "u_g2", "u_g3", "psi_1", "theta_1", "phi_1")
# Which of psi_1, theta_1, phi_1 vary -> azimuth of the only plane that contains this rocking [rad], and the index of
# the displacement channel normal to that plane.
_ROCKING_PLANES: dict[tuple[bool, ...], tuple[float, int]] = {
    (False, True, False): (0.0, 1),
    (True, False, False): (np.pi / 2, 0),
}


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    """Data and evaluation of a `Motion`, whose docstring describes the fields. Raises InputError as `Motion` does."""

    knots: Array
    coefficients: Array
    jumps: Array = field(default_factory=lambda: np.zeros(0))
    max_step: float | None = None
    name: str = ""
    metadata: Metadata = field(default_factory=dict)

    def __post_init__(self) -> None:
        knots, coefficients, jumps = checked_pieces(self.knots, self.coefficients, self.jumps, CHANNELS)
        for key, value in (("knots", knots), ("coefficients", coefficients), ("jumps", jumps)):
            object.__setattr__(self, key, value)
        storable("motion.name", self.name)
        object.__setattr__(self, "metadata", dict(self.metadata))
        if self.max_step is not None:
            positive("max_step", self.max_step)

    def __repr__(self) -> str:
        """Name, duration and number of pieces."""
        return piecewise.summary(self, self.name, self.knots)

    def _key(self) -> tuple[object, ...]:
        arrays = (self.knots, self.coefficients, self.jumps)
        return (*(a.shape for a in arrays), *((a + 0.0).tobytes() for a in arrays), self.max_step, self.name)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Trajectory):
            return NotImplemented
        return self._key() == other._key() and self.metadata == other.metadata

    def __hash__(self) -> int:
        return hash(self._key())

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.knots, self.coefficients, self.jumps, self.max_step, self.name, self.metadata)

    @property
    def duration(self) -> float:
        """Duration [s]; a motion starts at time zero."""
        return float(self.knots[-1])

    @property
    def sampled(self) -> bool:
        """Whether the knots are samples, at which the third derivative jumps.

        Samples are recognised by a longest step of two knot intervals; an analytic motion has many knots in a step.
        """
        return self.max_step is not None and self.max_step <= 2.001 * float(np.median(np.diff(self.knots)))

    @cached_property
    def resolution(self) -> Resolution:
        """Requirements on the steps of a run, from displacement, velocity and acceleration of the base."""
        if self.sampled:
            return Resolution.sampled(self.knots)
        return Resolution.of(self, orders=(0, 1, 2), longest=self.max_step)

    def evaluate(self, t: ArrayLike, derivative: int = 0) -> Array:
        """All six channels or a time derivative of them: ndarray, shape (..., 6), [m] and [rad], per s**derivative.

        At a declared jump the acceleration after it is returned.

        Args:
            t: times, shape (...), [s].
            derivative: order of the derivative.

        Raises:
            InputError: a time lies outside [0, duration], or the order is negative.
        """
        time = numbers("time", t)
        inside = (time >= 0) & (time <= self.knots[-1])
        if not np.all(inside):
            raise InputError(
                f"time: {time[~inside].flat[0]:g} s lies outside the motion, which has [0, {self.duration:g}] s; "
                "shorten the run or use motion.held(duration)"
            )
        return piecewise.evaluate(self.knots, self.coefficients, time, order(derivative))

    def displacement(self, t: ArrayLike) -> Array:
        """Displacement (u_g1, u_g2, u_g3) at `t` [s]: ndarray, shape (..., 3), [m]."""
        return self.evaluate(t)[..., :3]

    def velocity(self, t: ArrayLike) -> Array:
        """Velocity at `t` [s]: ndarray, shape (..., 3), [m/s]."""
        return self.evaluate(t, 1)[..., :3]

    def acceleration(self, t: ArrayLike) -> Array:
        """Acceleration at `t` [s]: ndarray, shape (..., 3), [m/s^2]."""
        return self.evaluate(t, 2)[..., :3]

    def rotation(self, t: ArrayLike) -> Array:
        """Euler angles (psi_1, theta_1, phi_1) of the base at `t` [s]: ndarray, shape (..., 3), [rad]."""
        return self.evaluate(t)[..., 3:]

    def plane(self) -> float | None:
        """Azimuth [rad], in (-pi/2, pi/2], of the vertical plane that contains the whole motion; None if there is none.

        The result is 0 for purely vertical motion, which every vertical plane contains. The motion of a rocking base is
        plane only if it rotates about E2 alone (azimuth 0) or about E1 alone (azimuth pi/2).
        """
        relative = self.coefficients.copy()  # with displacements relative to the start
        relative[:, :, 0] -= relative[0, :, 0]
        rocking = tuple(bool(angle) for angle in np.any(self.coefficients[:, 3:], axis=(0, 2)))
        if not any(rocking):
            return piecewise.azimuth(self.knots, relative[:, :2])
        if rocking not in _ROCKING_PLANES:
            return None
        azimuth, normal = _ROCKING_PLANES[rocking]
        return None if np.any(relative[:, normal]) else azimuth
