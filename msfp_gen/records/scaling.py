"""Scaling a motion to a target: a peak, a spectral ordinate, or a design spectrum over a range of periods."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.errors import InputError
from msfp_gen.fields import Quantity, check_fields, ruled_fields
from msfp_gen.motion_checks import finite, positive
from msfp_gen.piecewise import Array
from msfp_gen.records.correction import Corrected, baseline_corrected, uncorrected
from msfp_gen.records.spectrum import DAMPING, Progress, measure_index, response_spectrum

if TYPE_CHECKING:
    from msfp_gen.motion import Motion
    from msfp_gen.records.record import Record

_ACCELERATION = Quantity("m/s^2", above=0.0)
_PERIOD = Quantity("s", above=0.0)
_POINTS = 100  # periods of a fit, evenly spaced on a logarithmic axis
_WAYS = ("pga", "sa and period", "sds, sd1 and between")


@dataclass(frozen=True, kw_only=True)
class ScaleTo:
    """A target: give `pga`, or `sa` and `period`, or `sds`, `sd1` and `between`.

    All three components get one factor, so that their ratios stay.

    Attributes:
        pga: peak ground acceleration [m/s^2].
        sa, period: a pseudo-acceleration [m/s^2] at a period [s].
        sds, sd1: the design spectrum of ASCE 7 by its ordinates at short periods and at 1 s [m/s^2].
        long_period: its transition to constant displacement T_L [s].
        between: two periods [s], between which the design spectrum is met in the least squares of the logarithms.
        component: what of the motion meets the target: E1, E2, E3, geomean, rotd50 or rotd100.
        damping: of the spectra, as a ratio.
    """

    pga: Annotated[float | None, _ACCELERATION] = None
    sa: Annotated[float | None, _ACCELERATION] = None
    period: Annotated[float | None, _PERIOD] = None
    sds: Annotated[float | None, _ACCELERATION] = None
    sd1: Annotated[float | None, _ACCELERATION] = None
    long_period: Annotated[float, _PERIOD] = 8.0
    between: Annotated[tuple[float, float] | None, Quantity("s", above=0.0, shape=(2,))] = None
    component: Literal["E1", "E2", "E3", "geomean", "rotd50", "rotd100"] = "rotd50"
    damping: Annotated[float, Quantity("", above=0.0)] = DAMPING

    def __post_init__(self) -> None:
        check_fields(self, "scale_to")
        given = tuple(n for n in ("pga", "sa", "period", "sds", "sd1", "between") if getattr(self, n) is not None)
        if given not in (("pga",), ("sa", "period"), ("sds", "sd1", "between")):
            raise InputError(f"scale_to: {', '.join(given) or 'nothing'} given; give {', or '.join(_WAYS)}")
        if self.between is not None and self.between[0] >= self.between[1]:
            raise InputError(f"scale_to.between = {list(self.between)}: give the shorter period first")

    def factor(self, motion: Record | Corrected | Motion, progress: Progress | None = None) -> float:
        """What `motion` must be multiplied by to meet the target; `progress` as of `response_spectrum`.

        Raises InputError for a component that is zero.
        """
        column = measure_index(self.component)
        if self.pga is not None:
            spectrum = response_spectrum(motion, [1.0])
            return self._ratio(np.array([self.pga]), spectrum.pga[[column]])
        if self.between is None:
            periods = np.array([self.period], dtype=float)
            target = np.array([self.sa], dtype=float)
        else:
            periods = np.geomspace(*self.between, _POINTS)
            target = asce7_spectrum(periods, self.sds or 0.0, self.sd1 or 0.0, self.long_period)
        found = response_spectrum(motion, periods, damping=self.damping, progress=progress)
        return self._ratio(target, found.psa[:, column])

    def curve(self, period: Array) -> tuple[Array, Array] | None:
        """The target to draw beside a spectrum: periods [s] and ordinates [m/s^2]; None for a peak acceleration."""
        if self.pga is not None:
            return None
        if self.between is None:
            level = np.full(2, float(self.sa or 0.0))
            return np.array([0.8, 1.25]) * float(self.period or 0.0), level
        return period, asce7_spectrum(period, self.sds or 0.0, self.sd1 or 0.0, self.long_period)

    @classmethod
    def parse(cls, text: str) -> ScaleTo:
        """From text such as "sa=0.6 g, period=2.5 s" or "sds=1 g, sd1=0.6 g, between=0.5:4". Raises InputError."""
        rules = {name: rule for name, rule, _ in ruled_fields(cls)}
        values: dict[str, Any] = {}
        for part in text.split(","):
            name, equals, value = (piece.strip() for piece in part.partition("="))
            if not equals or name not in rules:
                raise InputError(f"scale_to: {part.strip()!r}; give name=value with a name of {', '.join(rules)}")
            given = value.split(":") if ":" in value else value
            numbers = [_number(v) for v in given] if isinstance(given, list) else _number(given)
            try:
                values[name] = rules[name].parse(numbers, text=True)
            except ValueError as error:
                raise InputError(f"scale_to.{name} = {value!r}: {error}") from None
        return cls(**values)

    def _ratio(self, target: Array, found: Array) -> float:
        if not np.all(found > 0):
            raise InputError(f"scale_to.component = {self.component!r}: the motion has none; choose another component")
        return float(np.exp(np.mean(np.log(target / found))))

    def __str__(self) -> str:
        """The target in words."""
        if self.pga is not None:
            return f"{self.component} peak acceleration {self.pga:.4g} m/s^2"
        if self.between is None:
            return f"{self.component} pseudo-acceleration {self.sa:.4g} m/s^2 at {self.period:g} s"
        low, high = self.between
        return (
            f"{self.component} to the ASCE 7 spectrum of {self.sds:.4g} and {self.sd1:.4g} m/s^2, "
            f"least squares from {low:g} to {high:g} s"
        )


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text.strip()


def prepared(
    record: Record,
    scale: float,
    scale_to: ScaleTo | None,
    start: float | None,
    duration: float | None,
    correct: bool,
    corner: float,
    taper: float,
    progress: Progress | None = None,
) -> tuple[Corrected, float]:
    """The record ready to drive a bearing, and its scale: the arguments of `Motion.from_record`.

    progress: of a scale that has to be found, as of `response_spectrum`.
    """
    if correct:
        ready = baseline_corrected(record, start=start, duration=duration, corner=corner, taper=taper)
    else:
        ready = uncorrected(record, start=start, duration=duration)
    if scale_to is None:
        return ready, positive("scale", scale)
    if scale != 1:
        raise InputError(f"scale = {scale!r}: scale_to is given too; give one of them")
    return replace(ready, metadata={**ready.metadata, "scaled_to": str(scale_to)}), scale_to.factor(ready, progress)


def asce7_spectrum(period: ArrayLike, sds: float, sd1: float, long_period: float = 8.0) -> Array:
    """Design response spectrum of ASCE 7-16 section 11.4.6 (equations 11.4-5 to 11.4-7): pseudo-acceleration.

    The MCE_R spectrum (11.4.7) has 1.5 times the ordinates: give S_MS and S_M1 for it.

    Args:
        period: shape (p,), [s].
        sds: ordinate at short periods, in any unit of acceleration.
        sd1: ordinate at 1 s, in the same unit.
        long_period: T_L [s].

    Returns:
        ndarray, shape (p,), in the unit of `sds` and `sd1`.
    """
    t = finite("period", period)
    if not (sds > 0 and sd1 > 0 and long_period > 0 and np.all(t >= 0)):
        raise InputError(f"sds = {sds:g}, sd1 = {sd1:g}, long_period = {long_period:g}: give positive numbers")
    corner = sd1 / sds
    safe = np.maximum(t, 1e-12)
    rising = sds * (0.4 + 0.6 * t / (0.2 * corner))
    pieces = [t < 0.2 * corner, t <= corner, t <= long_period]
    return np.select(pieces, [rising, np.full_like(t, sds), sd1 / safe], sd1 * long_period / safe**2)
