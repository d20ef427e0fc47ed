"""Prescribed histories other than the base motion: loads on the top plate and rotations of the plates."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import quantities
from msfp_gen.motions import piecewise
from msfp_gen.motions.checks import finite, increasing, number, numbers, order, positive, storable, vector
from msfp_gen.motions.piecewise import ORDER, powers
from msfp_gen.motions.sources import product, sampled_linear, sine, smoothstep, wave_knots
from msfp_gen.motions.time_grid import Resolution


@dataclass(frozen=True, eq=False, repr=False)
class Prescribed(piecewise.PickledByFields):
    """Piecewise polynomials in time; after their end the channels keep the last value.

    Attributes:
        knots: ndarray, shape (k+1,), [s]: ends of the pieces, increasing from zero.
        coefficients: ndarray, shape (k, channels, 6), [SI]: ascending powers of (t - knots[piece]).
        name: a label.

    Subclasses define the names of the channels, the word for error messages, and whether a channel may jump.

    Raises:
        InputError: shapes, order or finiteness are wrong, or a channel jumps that must be continuous.
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
        increasing(f"{self.WORD}.knots", knots)
        storable(f"{self.WORD}.name", self.name)
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

    @property
    def duration(self) -> float:
        """Time after which all channels are constant [s]."""
        return float(self.knots[-1])

    @property
    def jumps(self) -> Array:
        """Knots at which a channel jumps, ndarray, shape (j,), [s]."""
        width = np.diff(self.knots)[:-1, None]
        left = np.sum(self.coefficients[:-1] * powers(width), axis=2)
        # Relative to all forces, all moments or all angles: a component may be the rounding of a cosine.
        values = np.abs(self.coefficients[:, :, 0]).max(axis=0)
        size = np.concatenate([np.full(len(part), part.max()) for part in np.split(values, max(1, len(values) // 3))])
        return self.knots[1:-1][np.any(np.abs(self.coefficients[1:, :, 0] - left) > 1e-9 * size, axis=1)]

    @cached_property
    def resolution(self) -> Resolution:
        """Requirements on the steps of a run, from the values (loads) and first derivatives (rotation rates).

        The constant value after the end is part of the history: a load that still rises has a kink there.
        """
        return Resolution.of(self.until(self.duration + 1.0), orders=(0, 1))

    @staticmethod
    def unit(channel: str) -> str:
        """SI unit of a channel."""
        return {"F": "N", "M": "N m"}.get(channel[0], "rad")

    def evaluate(self, t: ArrayLike, derivative: int = 0) -> Array:
        """All channels or a time derivative of them at `t` [s]: ndarray, shape (..., channels)."""
        time = numbers("time", t)
        inside = np.minimum(time, self.duration)
        value = piecewise.evaluate(self.knots, self.coefficients, inside, order(derivative))
        return value if derivative == 0 else np.where((time < self.duration)[..., None], value, 0.0)

    def until(self, end: float) -> Self:
        """The history extended by a constant piece to `end` [s]; unchanged where it already reaches that time."""
        if number("end", end) <= self.duration:
            return self
        rest = np.zeros((1, len(self.CHANNELS), ORDER))
        rest[0, :, 0] = self.evaluate(self.duration)
        return replace(self, knots=np.append(self.knots, end), coefficients=np.concatenate([self.coefficients, rest]))

    def __repr__(self) -> str:
        """Name, duration and number of pieces."""
        return piecewise.summary(self, self.name, self.knots)

    def __add__(self, other: Self) -> Self:
        """Sum of two histories of the same kind; the result lasts as long as the longer one."""
        if type(self) is not type(other):
            return NotImplemented
        end = max(self.duration, other.duration)
        one, two = self.until(end), other.until(end)
        knots = np.union1d(one.knots, two.knots)
        pieces = [piecewise.refined(history.knots, history.coefficients, knots) for history in (one, two)]
        return type(self)(knots, pieces[0] + pieces[1], " + ".join(n for n in (self.name, other.name) if n))

    @classmethod
    def of(cls, knots: ArrayLike, coefficients: ArrayLike, name: str = "") -> Self:
        """History from knots, shape (k+1,), [s], and coefficients, shape (k, channels, 6)."""
        return cls(np.asarray(knots, dtype=float), np.asarray(coefficients, dtype=float), name)

    @classmethod
    def _constant(cls, values: ArrayLike) -> Self:
        pieces = np.zeros((1, len(cls.CHANNELS), ORDER))
        pieces[0, :, 0] = vector(cls.WORD, values, len(cls.CHANNELS))
        return cls(np.array([0.0, 1.0]), pieces)

    @classmethod
    def _ramp(cls, values: ArrayLike, duration: float) -> Self:
        knots = np.linspace(0.0, positive(f"{cls.WORD}.duration", duration), 17)
        rows = np.array(smoothstep(knots, float(knots[-1])))[:, :, None] * vector(cls.WORD, values, len(cls.CHANNELS))
        return cls(knots, piecewise.hermite5(knots, *rows))

    @classmethod
    def _harmonic(cls, values: ArrayLike, frequency: float, cycles: float, phase: float, lead_in: float | None) -> Self:
        period = 1 / positive(f"{cls.WORD}.frequency", frequency)
        rise = positive(f"{cls.WORD}.lead_in", period if lead_in is None else lead_in)
        knots = wave_knots(rise, rise + positive(f"{cls.WORD}.cycles", cycles) * period, period)
        shift = number(f"{cls.WORD}.phase", phase)
        wave = np.array(product(smoothstep(knots, rise), sine(knots, 2 * np.pi * frequency, shift)))
        return cls(knots, piecewise.hermite5(knots, *(wave[:, :, None] * vector(cls.WORD, values, len(cls.CHANNELS)))))


@dataclass(frozen=True, eq=False, repr=False)
class Load(Prescribed):
    """Force F1, F2, F3 [N] and moment M1, M2, M3 [N m] on the top plate at r_nn, in addition to the load of the `Top`.

    They represent, for example, overturning, cranes, wind or a jack: F_top, M_top of (3.28), (3.29) as functions of
    time. Construct a load with `constant`, `from_arrays`, `harmonic` or `ramp`; loads can be added. A load may jump.
    """

    CHANNELS: ClassVar[tuple[str, ...]] = ("F1", "F2", "F3", "M1", "M2", "M3")
    WORD: ClassVar[str] = "load"
    MAY_JUMP: ClassVar[bool] = True

    @classmethod
    @quantities(force="N", moment="N m")
    def constant(cls, force: ArrayLike, moment: ArrayLike = (0.0, 0.0, 0.0)) -> Load:
        """Constant load. force: shape (3,) [N]. moment: shape (3,) [N m]."""
        return cls._constant(np.concatenate([vector("load.force", force), vector("load.moment", moment)]))

    @classmethod
    @quantities(force="N", moment="N m", duration="s")
    def ramp(cls, force: ArrayLike, moment: ArrayLike = (0.0, 0.0, 0.0), *, duration: float) -> Load:
        """Smooth increase from zero. force: at its end, shape (3,) [N]. moment: shape (3,) [N m]. duration: [s]."""
        return cls._ramp(np.concatenate([vector("load.force", force), vector("load.moment", moment)]), duration)

    @classmethod
    @quantities(force="N", moment="N m", frequency="Hz", phase="rad", lead_in="s")
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
        """Harmonic load with a smooth start.

        Args:
            force: amplitude, shape (3,), [N].
            moment: amplitude, shape (3,), [N m].
            frequency: f of sin(2 pi f t + phase) [Hz].
            cycles: number of periods after the smooth start.
            phase: [rad].
            lead_in: duration of the smooth start [s]; None: one period.
        """
        values = np.concatenate([vector("load.force", force), vector("load.moment", moment)])
        return cls._harmonic(values, frequency, cycles, phase, lead_in)

    @classmethod
    @quantities(time="s", force="N", moment="N m")
    def from_arrays(cls, time: ArrayLike, force: ArrayLike, moment: ArrayLike | None = None, *, name: str = "") -> Load:
        """Linear interpolation of samples.

        Args:
            time: shape (k,), [s], from zero; two samples at one time define a jump.
            force: shape (k, 3), [N].
            moment: shape (k, 3), [N m]; None: zero.
            name: a label.
        """
        rows = [finite("load.force", force)]
        rows.append(np.zeros_like(rows[0]) if moment is None else finite("load.moment", moment))
        for word, row in zip(("force", "moment"), rows, strict=True):
            if row.ndim != 2 or row.shape[1] != 3:
                raise InputError(f"load.{word}: shape {row.shape}; give (k, 3), one row for each time")
        if len(rows[0]) != len(rows[1]):
            raise InputError(f"load.moment: {len(rows[1])} rows, load.force {len(rows[0])}; give as many of either")
        return cls(*sampled_linear("load", time, np.hstack(rows)), name)


@dataclass(frozen=True, eq=False, repr=False)
class Rotation(Prescribed):
    """Rotation of a plate as a function of time: psi about E1, then theta about the rotated axis E2 [rad] (2.1).

    Construct one with `constant`, `ramp`, `harmonic` or `from_arrays`. The sum of two rotations adds their angles,
    which is exact for small angles only.
    """

    CHANNELS: ClassVar[tuple[str, ...]] = ("psi", "theta")
    WORD: ClassVar[str] = "rotation"

    def __post_init__(self) -> None:
        super().__post_init__()
        largest = float(np.abs(self.coefficients[:, :, 0]).max())
        if largest > 1.0:
            raise InputError(f"rotation = {largest:.4g}: plates turn by less than 1 rad; give radians")

    @classmethod
    @quantities(psi="rad", theta="rad")
    def constant(cls, psi: float = 0.0, theta: float = 0.0) -> Rotation:
        """Constant inclination psi, theta [rad] of a plate."""
        return cls._constant([psi, theta])

    @classmethod
    @quantities(psi="rad", theta="rad", duration="s")
    def ramp(cls, psi: float = 0.0, theta: float = 0.0, *, duration: float) -> Rotation:
        """Smooth rotation from level to psi, theta [rad] in `duration` [s]."""
        return cls._ramp([psi, theta], duration)

    @classmethod
    @quantities(psi="rad", theta="rad", frequency="Hz", phase="rad", lead_in="s")
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
        """Harmonic rotation with a smooth start.

        Args:
            psi: amplitude [rad].
            theta: amplitude [rad].
            frequency: f of sin(2 pi f t + phase) [Hz].
            cycles: number of periods after the smooth start.
            phase: [rad].
            lead_in: duration of the smooth start [s]; None: one period.
        """
        return cls._harmonic([psi, theta], frequency, cycles, phase, lead_in)

    @classmethod
    @quantities(time="s", angles="rad")
    def from_arrays(cls, time: ArrayLike, angles: ArrayLike, *, name: str = "") -> Rotation:
        """Cubic spline with zero rates at both ends.

        Args:
            time: shape (k,), [s], from zero, increasing.
            angles: shape (k, 2), [rad]: psi and theta.
            name: a label.
        """
        from scipy.interpolate import CubicSpline

        times, values = increasing("rotation.time", finite("rotation.time", time)), finite("rotation.angles", angles)
        if times.ndim != 1 or len(times) < 2 or values.shape != (len(times), 2):
            raise InputError(f"rotation.angles: shape {values.shape}; give ({len(times)}, 2), psi and theta a time")
        pieces = np.zeros((len(times) - 1, 2, ORDER))
        pieces[:, :, :4] = CubicSpline(times, values, bc_type="clamped").c[::-1].transpose(1, 2, 0)
        return cls(times, pieces, name)
