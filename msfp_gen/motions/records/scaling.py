"""Scaling of a motion to a peak, a spectral ordinate or a design spectrum, and of a suite to a mean spectrum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import inf
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.aliases import Progress
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Quantity, Text, check_fields, require_type, ruled_fields, to_si
from msfp_gen.motions.checks import finite, positive
from msfp_gen.motions.records.correction import Corrected, baseline_corrected, uncorrected
from msfp_gen.motions.records.csv_table import COLUMN, first_line
from msfp_gen.motions.records.record import Record
from msfp_gen.motions.records.spectrum import DAMPING, ContinuousMotion, measure_index, response_spectrum
from msfp_gen.motions.records.text import read_lines

_ACCELERATION = Quantity("m/s^2", above=0.0)
_PERIOD = Quantity("s", above=0.0)
_FIT_POINTS = 100  # number of periods of a fit to a design spectrum, evenly spaced on a logarithmic axis
_KEYS = ("pga", "sa", "period", "sds", "sd1", "ag", "ground", "spectrum", "between")
ORDINATES = ("pga", "sa", "sds", "ag")  # of a target [m/s^2], which the metadata of a scaled motion keep
_TARGETS = {
    "pga": ("pga",),
    "sa and period": ("sa", "period"),
    "sds, sd1 and between": ("sds", "sd1", "between"),
    "ag, ground and between": ("ag", "ground", "between"),
    "spectrum and between": ("spectrum", "between"),
}


@dataclass(frozen=True, kw_only=True)
class ScaleTo:
    """Target of scaling: `pga`; `sa` and `period`; or a spectrum with `between`: `sds` and `sd1`, `ag` and `ground`, or
    `spectrum`.

    All three components are multiplied by the same factor, so their ratios do not change.

    Attributes:
        pga: peak ground acceleration [m/s^2].
        sa: pseudo-acceleration at `period` [m/s^2].
        period: period of `sa` [s].
        sds: ordinate of the design spectrum of ASCE 7 at short periods [m/s^2].
        sd1: ordinate of the same spectrum at 1 s [m/s^2].
        long_period: its transition period to constant displacement, T_L [s].
        ag: design ground acceleration of EN 1998-1 on ground of type A, gamma_I a_gR [m/s^2].
        ground: type of the ground of EN 1998-1, A to E.
        spectrum_type: type of its spectrum, 1, or 2 for magnitudes of at most 5.5.
        spectrum: path of a CSV file with the header `period [s], Sa [g]` or other units, or pairs [s], [m/s^2].
        between: shortest and longest period of the fit to a spectrum [s], by least squares of the logarithms.
        component: component or measure that meets the target: E1, E2, E3, geomean, rotd50 or rotd100.
        damping: damping ratio of the spectra [-].

    Raises:
        InputError: a value is not permitted, or the values do not form one of these targets.
    """

    pga: Annotated[float | None, _ACCELERATION] = None
    sa: Annotated[float | None, _ACCELERATION] = None
    period: Annotated[float | None, _PERIOD] = None
    sds: Annotated[float | None, _ACCELERATION] = None
    sd1: Annotated[float | None, _ACCELERATION] = None
    long_period: Annotated[float, _PERIOD] = 8.0
    ag: Annotated[float | None, _ACCELERATION] = None
    ground: Literal["", "A", "B", "C", "D", "E"] = ""
    spectrum_type: Annotated[int, Quantity("", least=1, whole=True)] = 1
    spectrum: Annotated[str | Pairs | None, Tabulated()] = None
    between: Annotated[tuple[float, float] | None, Quantity("s", above=0.0, shape=(2,))] = None
    component: Literal["E1", "E2", "E3", "geomean", "rotd50", "rotd100"] = "rotd50"
    damping: Annotated[float, Quantity("", above=0.0)] = DAMPING

    def __post_init__(self) -> None:
        check_fields(self, "scale_to")
        keys = tuple(name for name in _KEYS if getattr(self, name) not in (None, ""))
        if keys not in _TARGETS.values():
            raise InputError(f"scale_to: {', '.join(keys) or 'nothing'} given; give {', or '.join(_TARGETS)}")
        if self.between is not None and self.between[0] >= self.between[1]:
            raise InputError(f"scale_to.between = {list(self.between)}: give the shorter period first")
        if isinstance(self.spectrum, str):
            object.__setattr__(self, "spectrum", read_spectrum(self.spectrum))
        if self.spectrum is not None:
            check_pairs(self._pairs)
        if self.spectrum_type > 2:
            raise InputError(f"scale_to.spectrum_type = {self.spectrum_type}: give 1, or 2 for magnitudes up to 5.5")
        if self.between is not None and not self.shortest <= self.between[0] < self.between[1] <= self.longest:
            raise InputError(
                f"scale_to.between = {list(self.between)}: the target has periods from {self.shortest:g} to "
                f"{self.longest:g} s; stay within"
            )

    @property
    def _pairs(self) -> Pairs:
        assert isinstance(self.spectrum, tuple)
        return self.spectrum

    @property
    def shortest(self) -> float:
        """Shortest period of the target [s]."""
        return 0.0 if self.spectrum is None else self._pairs[0][0]

    @property
    def longest(self) -> float:
        """Longest period of the target [s]."""
        if self.spectrum is not None:
            return self._pairs[-1][0]
        return inf if self.ag is None else EN1998_END

    def shape(self, period: Array) -> Array:
        """The target spectrum at periods within its range, shape (p,) [m/s^2]."""
        if self.spectrum is not None:
            return tabulated_spectrum(period, self._pairs)
        if self.ag is not None:
            return en1998_spectrum(period, self.ag, self.ground, self.spectrum_type, self.damping)
        return asce7_spectrum(period, self.sds or 0.0, self.sd1 or 0.0, self.long_period)

    def factor(self, motion: Record | Corrected | ContinuousMotion, progress: Progress | None = None) -> float:
        """Factor by which `motion` must be multiplied to meet the target; `progress` as in `response_spectrum`.

        Raises InputError if the component is zero.
        """
        column = measure_index(self.component)
        if self.pga is not None:
            spectrum = response_spectrum(motion, [1.0])
            return self.ratio(np.array([self.pga]), spectrum.pga[[column]])
        periods, target = self.ordinates()
        spectrum = response_spectrum(motion, periods, damping=self.damping, progress=progress)
        return self.ratio(target, spectrum.psa[:, column])

    def ordinates(self) -> tuple[Array, Array]:
        """Periods at which a spectrum is compared with the target [s], and the target there [m/s^2], shape (p,) both.

        A target of peak acceleration has none.
        """
        if self.between is None:
            return np.array([self.period], dtype=float), np.array([self.sa], dtype=float)
        periods = np.geomspace(*self.between, _FIT_POINTS)
        return periods, self.shape(periods)

    def curve(self, period: Array) -> tuple[Array, Array] | None:
        """The target as a curve for a plot of spectra; None for a peak acceleration.

        Args:
            period: periods of the plot, shape (p,), [s].

        Returns:
            Periods [s] and pseudo-accelerations [m/s^2], ndarrays of one shape.
        """
        if self.pga is not None:
            return None
        if self.between is None:
            level = np.full(2, float(self.sa or 0.0))
            return np.array([0.8, 1.25]) * float(self.period or 0.0), level
        period = period[(period >= self.shortest) & (period <= self.longest)]
        return period, self.shape(period)

    @classmethod
    def parse(cls, text: str) -> ScaleTo:
        """Target from a text such as "sa=0.6 g, period=2.5 s" or "sds=1 g, sd1=0.6 g, between=0.5:4".

        Raises InputError for an unknown name or an invalid value.
        """
        rules = {name: rule for name, rule, _ in ruled_fields(cls)}
        values: dict[str, Any] = {}
        for part in text.split(","):
            name, equals, value = (piece.strip() for piece in part.partition("="))
            if not equals or name not in rules:
                raise InputError(f"scale_to: {part.strip()!r}; give name=value with a name of {', '.join(rules)}")
            parts = value.split(":") if ":" in value else value
            numbers = [_number(v) for v in parts] if isinstance(parts, list) else _number(parts)
            try:
                values[name] = rules[name].parse(numbers, text=True)
            except ValueError as error:
                raise InputError(f"scale_to.{name} = {value!r}: {error}") from None
        return cls(**values)

    def ratio(self, target: Array, values: Array) -> float:
        """Geometric mean of target/found, the factor of least squares of the logarithms."""
        if not np.all(values > 0):
            raise InputError(f"scale_to.component = {self.component!r}: the motion has none; choose another component")
        return float(np.exp(np.mean(np.log(target / values))))

    def __str__(self) -> str:
        """Description of the target."""
        if self.pga is not None:
            return f"{self.component} peak acceleration {self.pga:.4g} m/s^2"
        if self.between is None:
            return f"{self.component} pseudo-acceleration {self.sa:.4g} m/s^2 at {self.period:g} s"
        low, high = self.between
        if self.spectrum is not None:
            target = f"a spectrum of {len(self._pairs)} periods"
        elif self.ag is not None:
            target = f"the spectrum of EN 1998-1, type {self.spectrum_type}, ground {self.ground}, {self.ag:.4g} m/s^2"
        else:
            target = f"the ASCE 7 spectrum of {self.sds:.4g} and {self.sd1:.4g} m/s^2"
        return f"{self.component} to {target}, least squares from {low:g} to {high:g} s"


def _number(text: str) -> float | str:
    try:
        return int(text) if text.strip().isdecimal() else float(text)
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
    """The processed record and its scale factor; arguments as in `Motion.from_record`.

    `progress` reports the spectrum that `scale_to` needs; see `response_spectrum`. Raises InputError.
    """
    require_type(record, Record, "record")
    arguments = record, start, duration, correct, corner, taper
    try:
        corrected = _kept(*arguments)
    except TypeError:  # what cannot be hashed is refused by the correction
        corrected = _corrected(*arguments)
    if scale_to is None:
        return corrected, positive("scale", scale)
    if scale != 1:
        raise InputError(f"scale = {scale!r}: scale_to is given too; give one of them")
    ordinates = {name: value for name in ORDINATES if (value := getattr(scale_to, name)) is not None}
    metadata = {**corrected.metadata, "scaled_to": str(scale_to), **ordinates}
    return replace(corrected, metadata=metadata), scale_to.factor(corrected, progress)


def _corrected(
    record: Record, start: float | None, duration: float | None, correct: bool, corner: float, taper: float
) -> Corrected:
    """The processed record."""
    if correct:
        return baseline_corrected(record, start=start, duration=duration, corner=corner, taper=taper)
    return uncorrected(record, start=start, duration=duration)


_kept = lru_cache(maxsize=8)(
    _corrected
)  # for several scales of one record; records are equal only if they are the same


def asce7_spectrum(period: ArrayLike, sds: float, sd1: float, long_period: float = 8.0) -> Array:
    """Design response spectrum of ASCE 7-16, section 11.4.6 (equations 11.4-5 to 11.4-7): pseudo-acceleration.

    The ordinates of the MCE_R spectrum (11.4.7) are 1.5 times larger: give S_MS and S_M1 to obtain it.

    Args:
        period: shape (p,), [s].
        sds: ordinate at short periods, in any unit of acceleration.
        sd1: ordinate at 1 s, in the same unit.
        long_period: T_L [s].

    Returns:
        ndarray, shape (p,), in the unit of `sds` and `sd1`.

    Raises:
        InputError: a value is not positive, or a period is negative.
    """
    t = finite("period", period)
    if not (sds > 0 and sd1 > 0 and long_period > 0 and np.all(t >= 0)):
        raise InputError(f"sds = {sds:g}, sd1 = {sd1:g}, long_period = {long_period:g}: give positive numbers")
    corner = sd1 / sds
    safe = np.maximum(t, 1e-12)
    rising = sds * (0.4 + 0.6 * t / (0.2 * corner))
    pieces = [t < 0.2 * corner, t <= corner, t <= long_period]
    return np.select(pieces, [rising, np.full_like(t, sds), sd1 / safe], sd1 * long_period / safe**2)


@dataclass(frozen=True, eq=False)
class ScaledSuite:
    """Factors of a suite, and the spectra that they give.

    Attributes:
        factors: one for each motion, ndarray, shape (r,), [-].
        period: periods of the target, ndarray, shape (p,), [s].
        spectra: pseudo-acceleration of each scaled motion, ndarray, shape (r, p), [m/s^2].
        target: ndarray, shape (p,), [m/s^2].
    """

    factors: Array
    period: Array
    spectra: Array
    target: Array

    @property
    def mean(self) -> Array:
        """Arithmetic mean of the scaled spectra, ndarray, shape (p,), [m/s^2]."""
        return np.asarray(self.spectra.mean(axis=0))

    @property
    def least_share(self) -> float:
        """Least ratio of the mean to the target [-]."""
        return float((self.mean / self.target).min())


def scaled_suite(
    motions: Sequence[ContinuousMotion],
    target: ScaleTo,
    least_share: float | None = None,
    progress: Progress | None = None,
) -> ScaledSuite:
    """Factors of motions for a target of their mean spectrum.

    Each motion is first scaled to the target by itself, by least squares of the logarithms (`ScaleTo.factor`), so that
    none dominates the mean. One more factor, the same for all, then makes the mean meet the target: the least one for
    which the mean is nowhere below `least_share` times the target, or, without it, the factor of least squares of the
    logarithms.

    Args:
        motions: of at least one record, corrected.
        target: a spectrum (sds, sd1 and between) or an ordinate (sa and period); `component` is the measure averaged.
        least_share: of the target that the mean must reach at every period [-]; ASCE 7-16 requires 1 in 17.3.3.
        progress: called with the number of completed motions and of all.

    Raises:
        InputError: the target is a peak acceleration, or a motion has nothing along the component.
    """
    if target.pga is not None:
        raise InputError("scale_to.pga: a mean spectrum has no peak; give sds, sd1 and between, or sa and period")
    if not motions:
        raise InputError("suite: there are no motions; give at least one")
    period, wanted = target.ordinates()
    column, spectra = measure_index(target.component), []
    for done, motion in enumerate(motions, start=1):
        spectra.append(response_spectrum(motion, period, damping=target.damping).psa[:, column])
        if progress is not None:
            progress(done, len(motions))
    single = np.array([target.ratio(wanted, psa) for psa in spectra])
    mean = (single[:, None] * np.array(spectra)).mean(axis=0)
    common = target.ratio(wanted, mean) if least_share is None else least_share * float((wanted / mean).max())
    factors = common * single
    return ScaledSuite(factors, period, factors[:, None] * np.array(spectra), wanted)


Pairs = tuple[tuple[float, float], ...]  # period [s] and pseudo-acceleration [m/s^2]
# EN 1998-1, tables 3.2 (type 1) and 3.3 (type 2), recommended values: type, ground -> S, T_B, T_C, T_D [s].
EN1998 = {
    (1, "A"): (1.00, 0.15, 0.40, 2.0), (1, "B"): (1.20, 0.15, 0.50, 2.0), (1, "C"): (1.15, 0.20, 0.60, 2.0),
    (1, "D"): (1.35, 0.20, 0.80, 2.0), (1, "E"): (1.40, 0.15, 0.50, 2.0),
    (2, "A"): (1.00, 0.05, 0.25, 1.2), (2, "B"): (1.35, 0.05, 0.25, 1.2), (2, "C"): (1.50, 0.10, 0.25, 1.2),
    (2, "D"): (1.80, 0.10, 0.30, 1.2), (2, "E"): (1.60, 0.05, 0.25, 1.2),
}  # fmt: skip
EN1998_END = 4.0  # longest period of the formulas [s]
ROWS = "give the path of a CSV file (`period [s], Sa [g]`), or two or more pairs of a period [s] and m/s^2"


@dataclass(frozen=True)
class Tabulated(Text):
    """Rule of a field that takes a table of periods and accelerations: the path of a file, or pairs."""

    def parse(self, value: object, *, text: bool = False) -> Any:
        """A path as it is, pairs as tuples of numbers; raises ValueError whose text is the remedy."""
        if isinstance(value, str):
            return super().parse(value, text=text)
        try:
            pairs = tuple((float(period), float(acceleration)) for period, acceleration in value)  # type: ignore[attr-defined]
        except (TypeError, ValueError):
            raise ValueError(ROWS) from None
        if len(pairs) < 2:
            raise ValueError(ROWS)
        return pairs


def read_spectrum(path: str | Path) -> Pairs:
    """The target spectrum in a CSV file: columns of the period and of one acceleration, with units in the header.

    Lines that begin with # are comments; further columns are an error. Raises InputError that names file and line.
    """
    lines = read_lines(Path(path))
    head, header = first_line(lines, "period [s], Sa [g]")
    matches = [COLUMN.fullmatch(text) for text in header.split(",")]
    if len(matches) != 2 or None in matches or matches[0] is None or matches[0][1].lower() not in ("period", "t"):
        lines.fail(head, f"the header is {header.strip()[:48]!r}; give two columns with units: period [s], Sa [g]")
    factors = []
    for match, unit in zip(matches, ("s", "m/s^2"), strict=True):
        assert match is not None
        try:
            factors.append(to_si(f"1 {(match[2] or match[3] or '').strip()}", unit))
        except ValueError as error:
            lines.fail(head, f"column {match[1]}: {error}")
    rows = []
    for index in range(head + 1, len(lines)):
        if lines[index].strip() and not lines[index].lstrip().startswith("#"):
            fields = lines[index].split(",")
            if len(fields) != 2:
                lines.fail(index, f"{len(fields)} columns, the header names 2")
            period, acceleration = lines.numbers(index, fields)
            rows.append((period * factors[0], acceleration * factors[1]))
    return tuple(rows)


def check_pairs(pairs: Pairs) -> None:
    """Raise InputError unless periods rise and all numbers are positive."""
    table = np.array(pairs, dtype=float).reshape(-1, 2)
    positive = np.all(np.isfinite(table)) and np.all(table > 0)
    if len(table) < 2 or not positive or not np.all(np.diff(table[:, 0]) > 0):
        raise InputError("scale_to.spectrum: give two or more rows of rising periods, and accelerations above zero")


def tabulated_spectrum(period: ArrayLike, pairs: Pairs) -> Array:
    """The acceleration at periods within a table, linear between its rows in logarithms: shape (p,), [m/s^2]."""
    table = np.log(np.array(pairs))
    return np.asarray(np.exp(np.interp(np.log(np.asarray(period, dtype=float)), *table.T)))


def en1998_spectrum(period: ArrayLike, ag: float, ground: str, spectrum_type: int = 1, damping: float = 0.05) -> Array:
    """Horizontal elastic response spectrum of EN 1998-1:2004, 3.2.2.2 (3.2)-(3.6): pseudo-acceleration.

    Args:
        period: shape (p,), at most 4 [s].
        ag: design ground acceleration on ground of type A, a_g = gamma_I a_gR, in any unit of acceleration.
        ground: type of the ground, A to E.
        spectrum_type: 1, or 2 for magnitudes of at most 5.5.
        damping: ratio [-]; it gives eta = sqrt(10/(5 + 100 damping)), at least 0.55.

    Returns:
        ndarray, shape (p,), in the unit of `ag`.

    Raises:
        InputError: an unknown ground or type, or a period below 0 or above 4 s.
    """
    t = finite("period", period)
    if (spectrum_type, ground) not in EN1998:
        raise InputError(f"ground = {ground!r}, spectrum_type = {spectrum_type!r}: give A to E, and 1 or 2")
    if not np.all((t >= 0) & (t <= EN1998_END * (1 + 1e-12))):
        raise InputError(f"period: EN 1998-1 gives the spectrum from 0 to {EN1998_END:g} s; give periods within")
    soil, t_b, t_c, t_d = EN1998[spectrum_type, ground]
    plateau = 2.5 * max(np.sqrt(10.0 / (5.0 + 100.0 * damping)), 0.55)
    safe = np.maximum(t, 1e-12)
    pieces = [t <= t_b, t <= t_c, t <= t_d]
    shapes = [1.0 + t / t_b * (plateau - 1.0), np.full_like(t, plateau), plateau * t_c / safe]
    return np.asarray(ag * soil * np.select(pieces, shapes, plateau * t_c * t_d / safe**2))
