"""The prescribed motion of the base: piecewise polynomials, so that displacement, velocity and acceleration agree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen import piecewise, samples, waveforms
from msfp_gen.errors import InputError
from msfp_gen.motion_checks import checked_pieces, positive
from msfp_gen.piecewise import Array, Metadata, Pieces

if TYPE_CHECKING:
    from os import PathLike

    from msfp_gen.prescribed import Rotation
    from msfp_gen.records import Record, ScaleTo

CHANNELS = ("u_g1", "u_g2", "u_g3", "psi_1", "theta_1", "phi_1")
# Which of psi_1, theta_1, phi_1 turn -> the only plane such rocking stays in, and the channel across that plane.
_ROCKING_PLANES: dict[tuple[bool, ...], tuple[float, int]] = {
    (False, True, False): (0.0, 1),
    (True, False, False): (np.pi / 2, 0),
}

_BUILDERS = {"displacement": "from_arrays", "velocity": "from_velocity", "acceleration": "from_acceleration"}


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of the ground and of the base plate, twice continuously differentiable but for declared `jumps`.

    Attributes:
        knots: ndarray, shape (k+1,), [s]: ends of the pieces, rising from zero.
        coefficients: ndarray, shape (k, 6, 6): piece, channel (u_g1, u_g2, u_g3 [m], psi_1, theta_1, phi_1 [rad]),
            ascending power of (t - knots[piece]).
        jumps: ndarray, shape (j,), [s]: knots at which the acceleration alone may jump.
        max_step: longest step [s] that still sees what the motion's own sampling resolves; None: no limit.
        name: a label for figures and files.
        metadata: where the motion came from and what was done to it.

    Raises:
        InputError: shapes, order or finiteness are wrong; the displacement or velocity jumps (an impulse), or the
            acceleration jumps at a time that `jumps` does not name.
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
        object.__setattr__(self, "metadata", dict(self.metadata))
        if self.max_step is not None:
            positive("max_step", self.max_step)

    def _key(self) -> tuple[object, ...]:
        arrays = (self.knots, self.coefficients, self.jumps)
        return (*(a.shape for a in arrays), *((a + 0.0).tobytes() for a in arrays), self.max_step, self.name)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Motion):
            return NotImplemented
        return self._key() == other._key() and self.metadata == other.metadata

    def __hash__(self) -> int:
        return hash(self._key())

    def __reduce__(self) -> tuple[Any, ...]:
        return Motion, (self.knots, self.coefficients, self.jumps, self.max_step, self.name, self.metadata)

    @property
    def duration(self) -> float:
        """Length [s]; a motion starts at time zero."""
        return float(self.knots[-1])

    def evaluate(self, t: ArrayLike, derivative: int = 0) -> Array:
        """All six channels, or their time derivative: ndarray, shape (..., 6), [m, rad, per s**derivative].

        At a declared jump the acceleration is the one after it. Times outside [0, duration] raise InputError.
        """
        time = np.asarray(t, dtype=float)
        inside = (time >= 0) & (time <= self.knots[-1])
        if not np.all(inside):
            raise InputError(
                f"time: {time[~inside].flat[0]:g} s lies outside the motion, which has [0, {self.duration:g}] s; "
                "shorten the run or use motion.held(duration)"
            )
        if derivative < 0:
            raise InputError(f"derivative: {derivative}; give 0 (displacement), 1 (velocity) or 2 (acceleration)")
        return piecewise.evaluate(self.knots, self.coefficients, time, derivative)

    def displacement(self, t: ArrayLike) -> Array:
        """(u_g1, u_g2, u_g3): ndarray, shape (..., 3), [m]."""
        return self.evaluate(t)[..., :3]

    def velocity(self, t: ArrayLike) -> Array:
        """ndarray, shape (..., 3), [m/s]."""
        return self.evaluate(t, 1)[..., :3]

    def acceleration(self, t: ArrayLike) -> Array:
        """ndarray, shape (..., 3), [m/s^2]."""
        return self.evaluate(t, 2)[..., :3]

    def rotation(self, t: ArrayLike) -> Array:
        """Euler angles (psi_1, theta_1, phi_1) of the base: ndarray, shape (..., 3), [rad]."""
        return self.evaluate(t)[..., 3:]

    def plane(self) -> float | None:
        """Azimuth [rad], in (-pi/2, pi/2], of the vertical plane that holds the whole motion, or None.

        Vertical motion alone lies in every plane and gives 0. A rocking base stays in a plane only when it turns
        about E2 (plane 0) or about E1 (plane pi/2) and about nothing else.
        """
        moving = self.coefficients.copy()
        moving[:, :, 0] -= moving[0, :, 0]
        turning = tuple(bool(t) for t in np.any(self.coefficients[:, 3:], axis=(0, 2)))
        if not any(turning):
            return piecewise.azimuth(self.knots, moving[:, :2])
        if turning not in _ROCKING_PLANES:
            return None
        azimuth, across = _ROCKING_PLANES[turning]
        return None if np.any(moving[:, across]) else azimuth

    def rocking(self, rotation: Rotation) -> Motion:
        """The motion with the base turned by `rotation` as well: a plate out of level, or one that rocks.

        Raises InputError where the rotation ends while it still turns and the motion goes on.
        """
        whole = rotation.until(self.duration)
        pieces = np.zeros((len(whole.knots) - 1, 6, piecewise.ORDER))
        pieces[:, 3:5] = whole.coefficients
        inside = whole.knots[:-1] < self.duration
        knots = np.append(whole.knots[:-1][inside], self.duration)
        settled = [rotation.duration] if 0 < rotation.duration < self.duration else []
        return self + Motion(knots, pieces[inside], np.array(settled), name=rotation.name)

    def rotated(self, angle: float) -> Motion:
        """The motion with its horizontal channels turned by `angle` [rad] about E3, from E1 towards E2.

        Raises InputError for a rocking base: its Euler angles do not turn like a vector.
        """
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

    def held(self, duration: float) -> Motion:
        """The motion, then a rest of `duration` [s] where it ended, for free vibration.

        Raises InputError if the motion does not end at rest. An acceleration at its end becomes a declared jump.
        """
        positive("duration", duration)
        end, speed, acceleration = (self.evaluate(self.duration, d) for d in range(3))
        peaks = np.max(np.abs(self.coefficients), axis=0)
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
        """Both motions at once, on their merged knots. They must be equally long: lengthen one with `held`."""
        if not isinstance(other, Motion):
            return NotImplemented
        if self.duration != other.duration:
            raise InputError(
                f"motion: durations {self.duration:g} s and {other.duration:g} s differ; "
                "lengthen the shorter one with motion.held(duration)"
            )
        knots = np.union1d(self.knots, other.knots)
        limits = [m.max_step for m in (self, other) if m.max_step is not None]
        return Motion(
            knots,
            piecewise.shifted(self.knots, self.coefficients, knots)
            + piecewise.shifted(other.knots, other.coefficients, knots),
            np.union1d(self.jumps, other.jumps),
            min(limits, default=None),
            " + ".join(n for n in (self.name, other.name) if n),
            {**other.metadata, **self.metadata},
        )

    @classmethod
    def _of(cls, pieces: Pieces, name: str) -> Motion:
        return cls(pieces.knots, pieces.coefficients, max_step=pieces.max_step, name=name, metadata=pieces.metadata)

    @classmethod
    def from_arrays(
        cls, time: ArrayLike, displacement: ArrayLike, rotation: ArrayLike | None = None, *, name: str = ""
    ) -> Motion:
        """Sampled displacement, interpolated by a cubic spline (C2).

        An end at which a channel moves slower than a thousandth of its peak velocity is taken to be at rest and
        clamped. Any other end keeps the velocity of the data: a run then starts with the base already moving and the
        bearing moving along with it, without an impulse; metadata `initial_speed` [m/s] says how fast.

        Args:
            time: shape (k,), [s], rising, k >= 4; a first time other than zero is moved to zero and kept in metadata.
            displacement: shape (k, 3), [m].
            rotation: shape (k, 3), [rad], or None for a base that does not turn.
            name: a label.
        """
        return cls._of(samples.spline(time, displacement, rotation), name)

    @classmethod
    def from_acceleration(cls, time: ArrayLike, acceleration: ArrayLike, *, name: str = "") -> Motion:
        """Piecewise linear acceleration, integrated twice exactly from rest at zero.

        Args:
            time: shape (k,), [s], rising, k >= 4; a first time other than zero is moved to zero and kept in metadata.
            acceleration: shape (k, 3), [m/s^2]; a first value other than zero is a jump at the start of the run.
            name: a label.
        """
        return cls._of(samples.integrated(time, acceleration), name)

    @classmethod
    def from_velocity(cls, time: ArrayLike, velocity: ArrayLike, *, name: str = "") -> Motion:
        """Sampled velocity, interpolated by a cubic spline and integrated from zero displacement.

        Args:
            time: shape (k,), [s], rising, k >= 4; a first time other than zero is moved to zero and kept in metadata.
            velocity: shape (k, 3), [m/s]; where it is not zero at first, a run starts with everything moving along.
            name: a label.
        """
        return cls._of(samples.integrated_once(time, velocity), name)

    @classmethod
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
        """A S(t/lead_in) sin(2 pi f t): the unidirectional tests of section 4.1, from rest at zero.

        With the default lead-in, a quarter period, the motion reaches A at rest at its end and goes on as the report's
        A cos(2 pi f (t - lead_in)) for `cycles` cycles.

        Args:
            amplitude: A [m].
            frequency: f [Hz].
            direction: azimuth from E1 towards E2 [rad].
            cycles: number of full cycles after the lead-in.
            lead_in: length of the smooth start [s].
            name: a label.
        """
        period = 1 / positive("frequency", frequency)
        rise = period / 4 if lead_in is None else lead_in
        sines = [(np.cos(direction), 1.0, 0.0), (np.sin(direction), 1.0, 0.0)]
        return cls._of(waveforms.enveloped(amplitude, sines, period, cycles, rise), name)

    @classmethod
    def circle(
        cls, amplitude: float, angular_frequency: float, *, cycles: float = 2.0, lead_in: float = 20.0, name: str = ""
    ) -> Motion:
        """The circular orbit of section 4.4: A S cos(Omega t), A S sin(Omega t), [m], [rad/s]; S over `lead_in` [s]."""
        period = 2 * np.pi / positive("angular_frequency", angular_frequency)
        sines = [(1.0, 1.0, np.pi / 2), (1.0, 1.0, 0.0)]
        return cls._of(waveforms.enveloped(amplitude, sines, period, cycles, lead_in), name)

    @classmethod
    def figure_eight(
        cls, amplitude: float, angular_frequency: float, *, cycles: float = 2.0, lead_in: float = 20.0, name: str = ""
    ) -> Motion:
        """The figure-eight of section 4.4: A S cos(Omega t), A S sin(2 Omega t), [m], [rad/s]; S over `lead_in` [s]."""
        period = 2 * np.pi / positive("angular_frequency", angular_frequency)
        sines = [(1.0, 1.0, np.pi / 2), (1.0, 2.0, 0.0)]
        return cls._of(waveforms.enveloped(amplitude, sines, period, cycles, lead_in), name)

    @classmethod
    def ramp(cls, acceleration: float, duration: float, *, direction: float = 0.0, name: str = "") -> Motion:
        """Constant acceleration [m/s^2] for `duration` [s] from rest: u = acceleration t^2/2 (section 4.1: 0.1).

        The acceleration jumps at the start, where every run begins anyway, and ends moving: it cannot be `held`.
        """
        knots = np.array([0.0, positive("duration", duration)])
        pieces = np.zeros((1, 6, piecewise.ORDER))
        half = positive("acceleration", acceleration) / 2
        pieces[0, :2, 2] = half * np.cos(direction), half * np.sin(direction)
        return cls(knots, pieces, name=name, metadata={"source": "ramp", "acceleration": acceleration})

    @classmethod
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
        """A recorded acceleration, baseline corrected (`records.baseline_corrected`), as displacement from rest.

        Args:
            record: from `records.read_record` or `records.bundled`.
            scale: multiplies the motion.
            scale_to: a target that the corrected motion is scaled to instead; metadata `scale` says by how much.
            start: first time kept [s]; None with a duration: its strongest part by Arias intensity.
            duration: length kept [s]; None: to the end.
            correct: False takes the record as it is (`records.uncorrected`): for one corrected by its agency.
            corner: of the high-pass [Hz].
            taper: length of the smooth start and end [s].
            name: a label; None: the record's.
        """
        from msfp_gen.records import prepared

        ready, factor = prepared(record, scale, scale_to, start, duration, correct, corner, taper)
        return cls._of(samples.recorded(ready, factor), record.name if name is None else name)

    @classmethod
    def from_csv(cls, path: str | PathLike[str], *, name: str = "") -> Motion:
        """A table over time of displacements, velocities or accelerations with units: see `records.read_table`."""
        from msfp_gen.records import read_table

        table = read_table(path)
        build: Callable[..., Motion] = getattr(cls, _BUILDERS[table.quantity])
        return build(table.time, table.values, name=name or table.name)
