"""Prescribed histories beside the motion of the base: forces on the top plate, and how plates turn."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen import piecewise
from msfp_gen.errors import InputError
from msfp_gen.motion_checks import finite, positive, rising
from msfp_gen.piecewise import ORDER, Array
from msfp_gen.waveforms import product, sampling, sine, smoothstep


@dataclass(frozen=True, eq=False)
class Prescribed:
    """Piecewise polynomials in time of a few channels; held at their last value after their end.

    Attributes:
        knots: ndarray, shape (k+1,), [s]: ends of the pieces, rising from zero.
        coefficients: ndarray, shape (k, channels, 6): ascending powers of (t - knots[piece]).
        name: a label.

    Raises:
        InputError: shapes, order or finiteness are wrong, or a channel jumps that may not.
    """

    CHANNELS: ClassVar[tuple[str, ...]] = ()
    WORD: ClassVar[str] = ""
    MAY_JUMP: ClassVar[bool] = False

    knots: Array
    coefficients: Array
    name: str = ""

    def __post_init__(self) -> None:
        knots, coefficients = (finite(f"{self.WORD}.{n}", getattr(self, n)) for n in ("knots", "coefficients"))
        if knots.ndim != 1 or len(knots) < 2 or knots[0] != 0:
            raise InputError(f"{self.WORD}.knots: shape {knots.shape}; give at least two times, the first of them zero")
        rising(f"{self.WORD}.knots", knots)
        shape = (len(knots) - 1, len(self.CHANNELS), ORDER)
        if coefficients.shape != shape:
            raise InputError(f"{self.WORD}.coefficients: shape {coefficients.shape}; give {shape}")
        for key, value in (("knots", knots), ("coefficients", coefficients)):
            frozen = value.copy()
            frozen.setflags(write=False)
            object.__setattr__(self, key, frozen)
        if not self.MAY_JUMP and len(self.jumps):
            raise InputError(f"{self.WORD}: an angle jumps at t = {self.jumps[0]:g} s; make it continuous")

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[object, ...]:
        return (self.knots.shape, self.knots.tobytes(), (self.coefficients + 0.0).tobytes(), self.name)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.knots, self.coefficients, self.name)

    @property
    def duration(self) -> float:
        """Time after which nothing changes [s]."""
        return float(self.knots[-1])

    @property
    def jumps(self) -> Array:
        """Knots at which a channel jumps, ndarray, shape (j,), [s]."""
        width = np.diff(self.knots)[:-1, None]
        left = np.sum(self.coefficients[:-1] * width[..., None] ** np.arange(ORDER), axis=2)
        size = np.abs(self.coefficients[:, :, 0]).max(axis=0)
        return self.knots[1:-1][np.any(np.abs(self.coefficients[1:, :, 0] - left) > 1e-9 * size, axis=1)]

    @staticmethod
    def unit(channel: str) -> str:
        """Of a channel."""
        return {"F": "N", "M": "N m"}.get(channel[0], "rad")

    def evaluate(self, t: ArrayLike, derivative: int = 0) -> Array:
        """All channels or a time derivative of them: ndarray, shape (..., channels)."""
        time = np.asarray(t, dtype=float)
        inside = np.minimum(time, self.duration)
        value = piecewise.evaluate(self.knots, self.coefficients, inside, derivative)
        return value if derivative == 0 else np.where((time < self.duration)[..., None], value, 0.0)

    def until(self, end: float) -> Self:
        """The same, as pieces that reach `end` [s]."""
        if end <= self.duration:
            return self
        rest = np.zeros((1, len(self.CHANNELS), ORDER))
        rest[0, :, 0] = self.evaluate(self.duration)
        return replace(
            self, knots=np.append(self.knots, end), coefficients=np.concatenate([self.coefficients, rest])
        )

    def __add__(self, other: Self) -> Self:
        """Both at once."""
        if type(self) is not type(other):
            return NotImplemented
        end = max(self.duration, other.duration)
        one, two = self.until(end), other.until(end)
        knots = np.union1d(one.knots, two.knots)
        pieces = [piecewise.shifted(each.knots, each.coefficients, knots) for each in (one, two)]
        return type(self)(knots, pieces[0] + pieces[1], " + ".join(n for n in (self.name, other.name) if n))

    @classmethod
    def of(cls, knots: ArrayLike, coefficients: ArrayLike, name: str = "") -> Self:
        """From its pieces."""
        return cls(np.asarray(knots, dtype=float), np.asarray(coefficients, dtype=float), name)

    @classmethod
    def _constant(cls, values: ArrayLike) -> Self:
        pieces = np.zeros((1, len(cls.CHANNELS), ORDER))
        pieces[0, :, 0] = finite(cls.WORD, values)
        return cls(np.array([0.0, 1.0]), pieces)

    @classmethod
    def _ramp(cls, values: ArrayLike, duration: float) -> Self:
        knots = np.linspace(0.0, positive(f"{cls.WORD}.duration", duration), 17)
        rows = np.array(smoothstep(knots, float(knots[-1])))[:, :, None] * finite(cls.WORD, values)
        return cls(knots, piecewise.hermite5(knots, *rows))

    @classmethod
    def _harmonic(cls, values: ArrayLike, frequency: float, cycles: float, phase: float, lead_in: float | None) -> Self:
        period = 1 / positive(f"{cls.WORD}.frequency", frequency)
        rise = positive(f"{cls.WORD}.lead_in", period if lead_in is None else lead_in)
        knots = sampling(rise, rise + positive(f"{cls.WORD}.cycles", cycles) * period, period)
        wave = np.array(product(smoothstep(knots, rise), sine(knots, 2 * np.pi * frequency, phase)))
        return cls(knots, piecewise.hermite5(knots, *(wave[:, :, None] * finite(cls.WORD, values))))


def _sampled_linear(word: str, time: ArrayLike, values: Array) -> tuple[Array, Array]:
    """Straight lines between samples; two samples at one time are a jump there."""
    times = finite(f"{word}.time", time)
    if times.ndim != 1 or len(times) < 2 or times[0] != 0 or np.any(np.diff(times) < 0):
        raise InputError(f"{word}.time: give at least two times, from zero, none before the one above it")
    if len(values) != len(times):
        raise InputError(f"{word}: {len(values)} rows for {len(times)} times; give one row for each time")
    wide = np.diff(times) > 0
    pieces = np.zeros((int(wide.sum()), values.shape[1], ORDER))
    pieces[:, :, 0] = values[:-1][wide]
    pieces[:, :, 1] = (np.diff(values, axis=0)[wide]) / np.diff(times)[wide, None]
    if not len(pieces):
        raise InputError(f"{word}.time: all times are {times[0]:g} s; give a later one")
    return np.append(times[:-1][wide], times[1:][wide][-1]), pieces


@dataclass(frozen=True, eq=False)
class Load(Prescribed):
    """Force F1, F2, F3 [N] and moment M1, M2, M3 [N m] on the top plate at r_nn, beside what the top itself applies.

    What overturning, cranes, wind or a jack do to a bearing: F_top, M_top of (3.28), (3.29) as functions of time. Make
    one with `constant`, `from_arrays`, `harmonic` or `ramp`; loads add. A load may jump.
    """

    CHANNELS: ClassVar[tuple[str, ...]] = ("F1", "F2", "F3", "M1", "M2", "M3")
    WORD: ClassVar[str] = "load"
    MAY_JUMP: ClassVar[bool] = True

    @classmethod
    def constant(cls, force: ArrayLike, moment: ArrayLike = (0.0, 0.0, 0.0)) -> Load:
        """force, moment: shape (3,), [N], [N m]."""
        return cls._constant(np.concatenate([finite("load.force", force), finite("load.moment", moment)]))

    @classmethod
    def ramp(cls, force: ArrayLike, moment: ArrayLike = (0.0, 0.0, 0.0), *, duration: float) -> Load:
        """From nothing to `force`, `moment` [N], [N m] in `duration` [s], smoothly."""
        return cls._ramp(np.concatenate([finite("load.force", force), finite("load.moment", moment)]), duration)

    @classmethod
    def harmonic(
        cls,
        force: ArrayLike,
        moment: ArrayLike = (0.0, 0.0, 0.0),
        *,
        frequency: float,
        cycles: float,
        phase: float = 0.0,
        lead_in: float | None = None,
    ) -> Load:
        """Amplitudes [N], [N m] times sin(2 pi f t + phase) after a smooth start of `lead_in` [s]: one period."""
        values = np.concatenate([finite("load.force", force), finite("load.moment", moment)])
        return cls._harmonic(values, frequency, cycles, phase, lead_in)

    @classmethod
    def from_arrays(cls, time: ArrayLike, force: ArrayLike, moment: ArrayLike | None = None, *, name: str = "") -> Load:
        """Straight lines between samples.

        time: shape (k,), [s], from zero; one time twice is a jump. force, moment: shape (k, 3), [N], [N m].
        """
        rows = [finite("load.force", force)]
        rows.append(np.zeros_like(rows[0]) if moment is None else finite("load.moment", moment))
        for word, row in zip(("force", "moment"), rows, strict=True):
            if row.ndim != 2 or row.shape[1] != 3:
                raise InputError(f"load.{word}: shape {row.shape}; give (k, 3), one row for each time")
        if len(rows[0]) != len(rows[1]):
            raise InputError(f"load.moment: {len(rows[1])} rows, load.force {len(rows[0])}; give as many of either")
        return cls(*_sampled_linear("load", time, np.hstack(rows)), name)


@dataclass(frozen=True, eq=False)
class Rotation(Prescribed):
    """How a plate is turned: psi about E1, then theta about the turned E2 [rad], as functions of time (2.1).

    Make one with `constant`, `ramp`, `harmonic` or `from_arrays`; rotations add (angles, exact where they are small).
    """

    CHANNELS: ClassVar[tuple[str, ...]] = ("psi", "theta")
    WORD: ClassVar[str] = "rotation"

    def __post_init__(self) -> None:
        super().__post_init__()
        steepest = float(np.abs(self.coefficients[:, :, 0]).max())
        if steepest > 1.0:
            raise InputError(f"rotation = {steepest:.4g}: plates turn by less than 1 rad; give radians")

    @classmethod
    def constant(cls, psi: float = 0.0, theta: float = 0.0) -> Rotation:
        """A plate that was built out of level: psi, theta [rad]."""
        return cls._constant([psi, theta])

    @classmethod
    def ramp(cls, psi: float = 0.0, theta: float = 0.0, *, duration: float) -> Rotation:
        """From level to psi, theta [rad] in `duration` [s], smoothly."""
        return cls._ramp([psi, theta], duration)

    @classmethod
    def harmonic(
        cls,
        psi: float = 0.0,
        theta: float = 0.0,
        *,
        frequency: float,
        cycles: float,
        phase: float = 0.0,
        lead_in: float | None = None,
    ) -> Rotation:
        """Amplitudes [rad] times sin(2 pi f t + phase) after a smooth start of `lead_in` [s]: one period."""
        return cls._harmonic([psi, theta], frequency, cycles, phase, lead_in)

    @classmethod
    def from_arrays(cls, time: ArrayLike, angles: ArrayLike, *, name: str = "") -> Rotation:
        """A cubic spline at rest at both ends. time: shape (k,), [s], from zero, rising. angles: (k, 2), [rad]."""
        from scipy.interpolate import CubicSpline

        times, values = rising("rotation.time", finite("rotation.time", time)), finite("rotation.angles", angles)
        if times.ndim != 1 or len(times) < 2 or values.shape != (len(times), 2):
            raise InputError(f"rotation.angles: shape {values.shape}; give ({len(times)}, 2), psi and theta a time")
        pieces = np.zeros((len(times) - 1, 2, ORDER))
        pieces[:, :, :4] = CubicSpline(times, values, bc_type="clamped").c[::-1].transpose(1, 2, 0)
        return cls(times, pieces, name)
