"""Prescribed motion of the base as piecewise polynomials, with consistent displacement, velocity and acceleration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import quantities, require_type
from msfp_gen.motions import piecewise, sources
from msfp_gen.motions.checks import checked_pieces, number, numbers, order, positive, storable
from msfp_gen.motions.piecewise import Metadata, Pieces
from msfp_gen.motions.prescribed import Rotation
from msfp_gen.motions.time_grid import Resolution, matched, snapped

if TYPE_CHECKING:
    from os import PathLike

    from msfp_gen.motions.records import Record, ScaleTo

CHANNELS = ("u_g1", "u_g2", "u_g3", "psi_1", "theta_1", "phi_1")
# Which of psi_1, theta_1, phi_1 vary -> azimuth of the only plane that contains this rocking [rad], and the index of
# the displacement channel normal to that plane.
_ROCKING_PLANES: dict[tuple[bool, ...], tuple[float, int]] = {
    (False, True, False): (0.0, 1),
    (True, False, False): (np.pi / 2, 0),
}
_BUILDERS = {"displacement": "from_arrays", "velocity": "from_velocity", "acceleration": "from_acceleration"}


@dataclass(frozen=True, eq=False, repr=False)
class Motion(piecewise.PickledByFields):
    """Motion of the ground and of the base, twice continuously differentiable except at declared `jumps`.

    Attributes:
        knots: ndarray, shape (k+1,), [s]: ends of the pieces, increasing from zero.
        coefficients: ndarray, shape (k, 6, 6): piece, channel (u_g1, u_g2, u_g3 [m], psi_1, theta_1, phi_1 [rad]),
            ascending power of (t - knots[piece]).
        jumps: ndarray, shape (j,), [s]: knots at which the acceleration may be discontinuous.
        max_step: longest step of a run that resolves the motion [s]; None: determined from the pieces.
        name: a label for figures and files.
        metadata: origin and processing of the motion.

    Raises:
        InputError: shapes, order or finiteness are wrong; the displacement or the velocity jumps (an impulse), or the
            acceleration jumps at a time that is not in `jumps`.
    """

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
        if not isinstance(other, Motion):
            return NotImplemented
        return self._key() == other._key() and self.metadata == other.metadata

    def __hash__(self) -> int:
        return hash(self._key())

    @property
    def duration(self) -> float:
        """Duration [s]; a motion starts at time zero."""
        return float(self.knots[-1])

    @cached_property
    def sampled(self) -> bool:
        """Whether the knots are samples, at which the third derivative jumps.

        Samples are recognised by a longest step of two knot intervals; an analytic motion has many knots in a step.
        """
        between = np.sort(np.diff(self.knots))
        median = (between[(len(between) - 1) // 2] + between[len(between) // 2]) / 2  # np.median imports masked arrays
        return self.max_step is not None and self.max_step <= 2.001 * float(median)

    @cached_property
    def resolution(self) -> Resolution:
        """Requirements on the steps of a run, from displacement, velocity and acceleration of the base."""
        if self.sampled:
            return Resolution.sampled(self.knots)
        return Resolution.of(self, orders=(0, 1, 2), longest=self.max_step)

    @cached_property
    def start(self) -> Array:
        """All six channels at time zero: ndarray, shape (6,), [m] and [rad]."""
        values = self.evaluate(0.0)
        values.setflags(write=False)
        return values

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

    def rocking(self, rotation: Rotation) -> Motion:
        """The motion with an additional rotation of the base: a base that is not level, or one that rocks.

        Raises InputError if the rotation ends with a nonzero rate before the motion ends.
        """
        require_type(rotation, Rotation, "rotation")
        whole = rotation.until(self.duration)
        pieces = np.zeros((len(whole.knots) - 1, 6, piecewise.ORDER))
        pieces[:, 3:5] = whole.coefficients
        inside = whole.knots[:-1] < self.duration
        knots = np.append(whole.knots[:-1][inside], self.duration)
        end = [rotation.duration] if 0 < rotation.duration < self.duration else []
        return self + Motion(knots, pieces[inside], np.array(end), name=rotation.name)

    @quantities(angle="rad")
    def rotated(self, angle: float) -> Motion:
        """The motion with its horizontal components rotated by `angle` [rad] about E3, from E1 towards E2.

        Raises InputError for a rocking base, whose Euler angles do not transform like a vector.
        """
        angle = number("angle", angle)
        if np.any(self.coefficients[:, 3:5]):
            raise InputError(
                f"rotated: angle {angle:g} on a motion that rocks the base (psi_1 or theta_1 not zero); "
                "build the motion in the turned axes"
            )
        c, s = np.cos(angle), np.sin(angle)
        coefficients = self.coefficients.copy()
        coefficients[:, 0] = c * self.coefficients[:, 0] - s * self.coefficients[:, 1]
        coefficients[:, 1] = s * self.coefficients[:, 0] + c * self.coefficients[:, 1]
        return replace(self, coefficients=coefficients)

    @quantities(duration="s")
    def held(self, duration: float) -> Motion:
        """The motion followed by `duration` [s] without motion at its final position, for free vibration.

        A nonzero acceleration at the end of the motion becomes a declared jump. Raises InputError if the motion does
        not end at rest.
        """
        positive("duration", duration)
        end, speed, acceleration = (self.evaluate(self.duration, d) for d in range(3))
        # Relative to all displacements, or all angles: a component may be the rounding of a cosine.
        peaks = np.repeat(np.abs(self.coefficients).reshape(-1, 2, 3, piecewise.ORDER).max(axis=(0, 2)), 3, axis=0)
        if np.any(np.abs(speed) > 1e-9 * peaks[:, 1]):
            worst = int(np.argmax(np.abs(speed)))
            raise InputError(
                f"held: the motion ends with {CHANNELS[worst]} moving at {speed[worst]:.3g} per second; "
                "end it at rest (whole half cycles, a taper) before holding it"
            )
        rest = np.zeros((1, 6, piecewise.ORDER))
        rest[0, :, 0] = end
        jumps = bool(np.any(np.abs(acceleration) > 2e-9 * peaks[:, 2]))
        return replace(
            self,
            knots=np.append(self.knots, self.duration + duration),
            coefficients=np.concatenate([self.coefficients, rest]),
            jumps=np.append(self.jumps, self.duration) if jumps else self.jumps,
        )

    def __add__(self, other: Motion) -> Motion:
        """Sum of two motions on their merged knots. Raises InputError unless both have the same duration (`held`).

        Durations that differ by less than any step are the same; the sum has the duration of the first.
        """
        if not isinstance(other, Motion):
            return NotImplemented
        end = self.knots[-1:]
        if other.duration != self.duration and matched(other.knots[-1:], end) == end:
            knots, coefficients = snapped(other.knots, other.coefficients, end)
            other = replace(other, knots=knots, coefficients=coefficients, jumps=matched(other.jumps, end))
        if self.duration != other.duration:
            raise InputError(
                f"motion: durations {self.duration:g} s and {other.duration:g} s differ; "
                "lengthen the shorter one with motion.held(duration)"
            )
        knots = np.union1d(self.knots, other.knots)
        known = self.max_step is not None and other.max_step is not None
        return Motion(
            knots,
            piecewise.refined(self.knots, self.coefficients, knots)
            + piecewise.refined(other.knots, other.coefficients, knots),
            np.union1d(self.jumps, other.jumps),
            min(self.max_step or 0.0, other.max_step or 0.0) if known else None,
            " + ".join(n for n in (self.name, other.name) if n),
            {**other.metadata, **self.metadata},
        )

    @classmethod
    def _of(cls, pieces: Pieces, name: str) -> Motion:
        return cls(pieces.knots, pieces.coefficients, max_step=pieces.max_step, name=name, metadata=pieces.metadata)

    @classmethod
    @quantities(time="s", displacement="m", rotation="rad")
    def from_arrays(
        cls, time: ArrayLike, displacement: ArrayLike, rotation: ArrayLike | None = None, *, name: str = ""
    ) -> Motion:
        """Motion from sampled displacements, interpolated by cubic splines (twice continuously differentiable).

        A channel is taken to be at rest at an end, and its spline clamped there, if its velocity is at most a
        thousandth of its peak velocity. Otherwise it keeps the velocity of the data. A run then starts with base and
        bearing moving at this velocity, without an impulse; metadata `initial_speed` is its magnitude [m/s].

        Args:
            time: shape (k,), [s], increasing, k >= 4; times count from the first, which is stored as metadata if not 0.
            displacement: shape (k, 3), [m].
            rotation: shape (k, 3), [rad]: psi_1, theta_1, phi_1; None for a base that does not rotate.
            name: a label.
        """
        return cls._of(sources.from_displacement(time, displacement, rotation), name)

    @classmethod
    @quantities(time="s", acceleration="m/s^2")
    def from_acceleration(cls, time: ArrayLike, acceleration: ArrayLike, *, name: str = "") -> Motion:
        """Motion from sampled accelerations, piecewise linear and integrated twice exactly from rest at zero.

        Args:
            time: shape (k,), [s], increasing, k >= 4; times count from the first, which is stored as metadata if not 0.
            acceleration: shape (k, 3), [m/s^2]; a nonzero first value is a jump at the start of the run.
            name: a label.
        """
        return cls._of(sources.from_acceleration(time, acceleration), name)

    @classmethod
    @quantities(time="s", velocity="m/s")
    def from_velocity(cls, time: ArrayLike, velocity: ArrayLike, *, name: str = "") -> Motion:
        """Motion from sampled velocities, interpolated by cubic splines and integrated from zero displacement.

        Args:
            time: shape (k,), [s], increasing, k >= 4; times count from the first, which is stored as metadata if not 0.
            velocity: shape (k, 3), [m/s]; if the first value is not zero, a run starts with base and bearing moving.
            name: a label.
        """
        return cls._of(sources.from_velocity(time, velocity), name)

    @classmethod
    @quantities(amplitude="m", frequency="Hz", direction="rad", lead_in="s")
    def harmonic(
        cls,
        amplitude: float,
        frequency: float,
        *,
        direction: float = 0.0,
        cycles: float = 2.0,
        lead_in: float | None = None,
        name: str = "",
    ) -> Motion:
        """A S(t/lead_in) sin(2 pi f t) from rest at zero: the unidirectional tests of PEER 2017/07, section 4.1.

        With the default lead-in of a quarter period the motion reaches A with zero velocity at the end of the lead-in.
        It continues as A cos(2 pi f (t - lead_in)), as in PEER 2017/07, for `cycles` cycles.

        Args:
            amplitude: A [m].
            frequency: f [Hz].
            direction: azimuth from E1 towards E2 [rad].
            cycles: number of full cycles after the lead-in.
            lead_in: duration of the smooth start [s]; None: a quarter period.
            name: a label.
        """
        period = 1 / positive("frequency", frequency)
        rise = period / 4 if lead_in is None else lead_in
        azimuth = number("direction", direction)
        sines = [(float(np.cos(azimuth)), 1.0, 0.0), (float(np.sin(azimuth)), 1.0, 0.0)]
        return cls._of(sources.enveloped_sines(amplitude, sines, period, cycles, rise), name)

    @classmethod
    @quantities(amplitude="m", angular_frequency="rad/s", lead_in="s")
    def circle(
        cls, amplitude: float, angular_frequency: float, *, cycles: float = 2.0, lead_in: float = 20.0, name: str = ""
    ) -> Motion:
        """Circular orbit A S cos(Omega t), A S sin(Omega t) of PEER 2017/07, section 4.3.

        Args:
            amplitude: A [m].
            angular_frequency: Omega [rad/s].
            cycles: number of periods after the smooth start.
            lead_in: duration of the smooth start S [s].
            name: a label.
        """
        period = 2 * np.pi / positive("angular_frequency", angular_frequency)
        sines = [(1.0, 1.0, np.pi / 2), (1.0, 1.0, 0.0)]
        return cls._of(sources.enveloped_sines(amplitude, sines, period, cycles, lead_in), name)

    @classmethod
    @quantities(amplitude="m", angular_frequency="rad/s", lead_in="s")
    def figure_eight(
        cls, amplitude: float, angular_frequency: float, *, cycles: float = 2.0, lead_in: float = 20.0, name: str = ""
    ) -> Motion:
        """Figure-eight orbit A S cos(Omega t), A S sin(2 Omega t) of PEER 2017/07, section 4.3.

        Args:
            amplitude: A [m].
            angular_frequency: Omega [rad/s].
            cycles: number of periods 2 pi/Omega after the smooth start.
            lead_in: duration of the smooth start S [s].
            name: a label.
        """
        period = 2 * np.pi / positive("angular_frequency", angular_frequency)
        sines = [(1.0, 1.0, np.pi / 2), (1.0, 2.0, 0.0)]
        return cls._of(sources.enveloped_sines(amplitude, sines, period, cycles, lead_in), name)

    @classmethod
    @quantities(acceleration="m/s^2", duration="s", direction="rad")
    def ramp(cls, acceleration: float, duration: float, *, direction: float = 0.0, name: str = "") -> Motion:
        """Constant acceleration from rest, u = acceleration t^2/2 (PEER 2017/07, section 4.1, with 0.1 m/s^2).

        The motion does not end at rest, so it cannot be `held`.

        Args:
            acceleration: [m/s^2].
            duration: [s].
            direction: azimuth from E1 towards E2 [rad].
            name: a label.
        """
        knots = np.array([0.0, positive("duration", duration)])
        pieces = np.zeros((1, 6, piecewise.ORDER))
        half, azimuth = positive("acceleration", acceleration) / 2, number("direction", direction)
        pieces[0, :2, 2] = half * np.cos(azimuth), half * np.sin(azimuth)
        return cls(knots, pieces, name=name, metadata={"source": "ramp", "acceleration": acceleration})

    @classmethod
    @quantities(start="s", duration="s", corner="Hz", taper="s")
    def from_record(
        cls,
        record: Record,
        *,
        scale: float = 1.0,
        scale_to: ScaleTo | None = None,
        start: float | None = None,
        duration: float | None = None,
        correct: bool = True,
        corner: float = 0.05,
        taper: float = 1.0,
        name: str | None = None,
    ) -> Motion:
        """Motion from a recorded ground motion, baseline corrected by `records.baseline_corrected`.

        Args:
            record: from `records.read_record` or `records.bundled`.
            scale: factor on the motion.
            scale_to: target to which the corrected motion is scaled instead; metadata `scale` is the factor.
            start: start of the window that is used [s]; None with a duration: the window of largest Arias intensity.
            duration: length of the window [s]; None: to the end of the record.
            correct: False uses the record without correction (`records.uncorrected`), if its agency has corrected it.
            corner: corner frequency of the high-pass filter [Hz].
            taper: duration of the smooth start and end [s].
            name: a label; None: the name of the record.
        """
        from msfp_gen.motions.records import prepared

        corrected, factor = prepared(record, scale, scale_to, start, duration, correct, corner, taper)
        return cls._of(corrected.pieces(factor), record.name if name is None else name)

    @classmethod
    def from_csv(cls, path: str | PathLike[str], *, name: str = "") -> Motion:
        """Motion from a CSV table of displacements, velocities or accelerations: see `records.read_table`.

        Metadata `notes` are the notes of the table.
        """
        from msfp_gen.motions.records import read_table

        table = read_table(path)
        build: Callable[..., Motion] = getattr(cls, _BUILDERS[table.quantity])
        motion = build(table.time, table.values, name=name or table.name)
        notes = {"notes": "; ".join(table.notes)} if table.notes else {}
        return replace(motion, metadata={**motion.metadata, **notes})
