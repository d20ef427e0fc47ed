"""Fragility from the rows of a study: probability that a demand exceeds a threshold, a lognormal law of the intensity.

The maximum likelihood estimate of J. W. Baker, "Efficient analytical fragility function fitting using dynamic
structural analysis", Earthquake Spectra 31 (2015), 579-599, for stripes, IDA runs and single runs. The log-likelihood
of P = Phi(a + b ln x) is concave, so that it has one maximum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Choice
from msfp_gen.common.tables import Table
from msfp_gen.figures.style import COLOURS, headline, page, plain
from msfp_gen.results.quantities import Side
from msfp_gen.scene.file.catalogue import parsed
from msfp_gen.studies.assessment.rows import (
    SIZE,
    check_columns,
    check_share,
    complete,
    demands,
    intensities,
    labelled,
    scale_of,
    side_of,
    unit_of,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ITERATIONS = 100
CONVERGED = 1e-10  # Newton decrement at which the fit ends
EARLY = {
    "leave-out": "left out, and counted",
    "exceed": "count as runs that exceed the threshold",
    "refuse": "an error",
}
LEAST_BOOTSTRAPS = 100
POINTS = 200  # of a curve in a file
DRAWN = 300  # points of a curve in a figure
SHADE = 0.16  # opacity of a confidence band
Interval = tuple[float, float]


@dataclass(frozen=True)
class FragilityFit:
    """A fitted curve P = Phi(a + b ln x).

    coefficients: a and b, ndarray, shape (2,), [-]. covariance: inverse of the Fisher information of a and b, (2, 2)
    [-].
    """

    coefficients: Array
    covariance: Array

    @property
    def median(self) -> float:
        """The intensity at which the probability is one half, exp(-a/b) [unit of the intensity]."""
        return float(np.exp(-self.coefficients[0] / self.coefficients[1]))

    @property
    def dispersion(self) -> float:
        """Standard deviation of the logarithm of the intensity, 1/b [-]."""
        return float(1 / self.coefficients[1])

    @property
    def errors(self) -> Array:
        """Standard errors of ln median and ln dispersion, to first order, shape (2,) [-]."""
        a, b = self.coefficients
        slopes = np.array([[-1 / b, a / b**2], [0.0, -1 / b]])
        return np.sqrt(np.diag(slopes @ self.covariance @ slopes.T))

    def probability(self, log_x: Array) -> Array:
        """Phi(a + b ln x) [-], of the shape of `log_x`."""
        from scipy.special import ndtr

        return np.asarray(ndtr(self.coefficients[0] + self.coefficients[1] * log_x))

    def band(self, log_x: Array, level: float) -> tuple[Array, Array]:
        """Pointwise confidence bounds of the probability [-], of the shape of `log_x`, from bounds of a + b ln x."""
        from scipy.special import ndtr, ndtri

        rows = np.stack([np.ones_like(log_x), log_x], axis=-1)
        centre = rows @ self.coefficients
        error = np.sqrt(np.einsum("...i,ij,...j->...", rows, self.covariance, rows))
        z = ndtri((1 + level) / 2)
        return np.asarray(ndtr(centre - z * error)), np.asarray(ndtr(centre + z * error))


def fitted(log_x: Array, runs: Array, over: Array, where: str, start: FragilityFit | None = None) -> FragilityFit:
    """The fit to `over` exceedances among `runs` runs at each ln x, all ndarrays, shape (levels,).

    start: a fit to begin with. Raises InputError that begins with `where`: the runs determine no curve with a positive
    slope.
    """
    used = runs > 0
    log_x, runs, over = log_x[used], np.asarray(runs[used], dtype=float), np.asarray(over[used], dtype=float)
    _check(log_x, runs, over, where)
    middle, width = float(np.average(log_x, weights=runs)), float(np.ptp(log_x))
    scaled = (log_x - middle) / width  # between -1 and 1, for the conditioning of the normal equations
    unscale = np.array([[1.0, -middle / width], [0.0, 1 / width]])
    guess = np.array([0.0, 1.0]) if start is None else np.linalg.solve(unscale, start.coefficients)
    rows = np.stack([np.ones_like(scaled), scaled], axis=-1)
    solution, information = _newton(rows, runs, over, guess, where)
    coefficients = unscale @ solution
    if not coefficients[1] > 0:
        raise InputError(f"{where}: exceedances do not grow with the intensity; there is no fragility curve")
    return FragilityFit(coefficients, unscale @ np.linalg.inv(information) @ unscale.T)


def _check(log_x: Array, runs: Array, over: Array, where: str) -> None:
    """Raise InputError where the runs determine no curve: none or all exceed, or the intensities do not overlap."""
    total, exceeded = int(runs.sum()), int(over.sum())
    if exceeded in (0, total):
        word = "none" if exceeded == 0 else "all"
        raise InputError(f"{where}: {word} of {total} runs exceed it; give another threshold or other intensities")
    least_over, most_below = log_x[over > 0].min(), log_x[over < runs].max()
    if least_over >= most_below:
        raise InputError(
            f"{where}: no run below {np.exp(least_over):.4g} exceeds it and every run above {np.exp(most_below):.4g} "
            "does, so that the dispersion is not determined; give intensities between, or more records or samples"
        )
    if log_x[over > 0].max() <= log_x[over < runs].min():
        raise InputError(f"{where}: exceedances do not grow with the intensity; there is no fragility curve")


def _newton(rows: Array, runs: Array, over: Array, start: Array, where: str) -> tuple[Array, Array]:
    """Maximise the likelihood by Fisher scoring, with steps halved until it grows; returns solution and information."""
    # rows: of the design matrix, shape (levels, 2). where: of the fit, for a message.
    from scipy.special import log_ndtr

    def likelihood(x: Array) -> float:
        eta = rows @ x
        return float(over @ log_ndtr(eta) + (runs - over) @ log_ndtr(-eta))

    x, value = start, likelihood(start)
    for _ in range(ITERATIONS):
        eta = rows @ x
        log_density = -0.5 * (eta**2 + np.log(2 * np.pi))
        ratio, rest = np.exp(log_density - log_ndtr(eta)), np.exp(log_density - log_ndtr(-eta))
        gradient = rows.T @ (over * ratio - (runs - over) * rest)
        information = (rows * (runs * ratio * rest)[:, None]).T @ rows
        step = np.linalg.solve(information, gradient)
        if gradient @ step < CONVERGED:
            return x, information
        factor = 1.0
        while not likelihood(x + factor * step) > value and factor > 1e-12:
            factor /= 2
        if factor <= 1e-12:  # any growth is below roundoff
            return x, information
        x = x + factor * step
        value = likelihood(x)
    raise InputError(f"{where}: the likelihood has no maximum that could be found; give more runs near the threshold")


@dataclass(frozen=True)
class DamageState:
    """The fragility of one damage state.

    Attributes:
        threshold: of the demand [its unit].
        median: intensity at which the probability is one half [unit of the intensity].
        dispersion: standard deviation of the logarithm of the intensity [-].
        median_interval, dispersion_interval: confidence intervals of median and dispersion.
        runs, exceeded: number of runs used in the fit, and number of runs at or above the threshold.
        left_out: number of runs that ended early below the threshold and are not in the fit.
        intensity, runs_at, exceeded_at: intensities, shape (k,) [its unit], and at each the numbers of runs as above.
        fit: the fit, for curves and bands.
        samples: pairs (a, b) of the bootstrap, ndarray, shape (bootstraps, 2), [-]; None without bootstrap.
        level: of confidence [-].
        case: value of the column `by`; "" without `by`.
    """

    threshold: float
    median: float
    dispersion: float
    median_interval: Interval
    dispersion_interval: Interval
    runs: int
    exceeded: int
    left_out: int
    intensity: Array
    runs_at: Array
    exceeded_at: Array
    fit: FragilityFit
    samples: Array | None
    level: float
    case: str = ""

    def probability(self, intensity: Array) -> Array:
        """Probability of exceedance [-], ndarray of the shape of `intensity`."""
        return self.fit.probability(np.log(intensity))

    def band(self, intensity: Array) -> tuple[Array, Array]:
        """Pointwise lower and upper confidence bound of the probability [-], of the shape of `intensity`."""
        if self.samples is None:
            return self.fit.band(np.log(intensity), self.level)
        from scipy.special import ndtr

        curves = ndtr(self.samples[:, :1] + self.samples[:, 1:] * np.log(intensity))
        low, high = np.quantile(curves, [(1 - self.level) / 2, (1 + self.level) / 2], axis=0)
        return low, high


@dataclass(frozen=True)
class Fragility:
    """Result of `fragility`.

    measure, demand, measure_unit, unit: names and units of the columns of intensity and demand. states: by case, then
    by rising threshold.
    """

    measure: str
    demand: str
    measure_unit: str
    unit: str
    states: tuple[DamageState, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON."""
        names = [
            "case", "threshold", "median", "dispersion", "median_interval", "dispersion_interval", "runs", "exceeded",
            "left_out", "level",
        ]  # fmt: skip
        states = [{name: getattr(state, name) for name in names} for state in self.states]
        return {**vars(self), "states": states}


def fragility(
    rows: Any,
    measure: str,
    demand: str,
    thresholds: Sequence[float],
    *,
    early: str = "leave-out",
    level: float = 0.95,
    bootstrap: int = 0,
    cluster: str = "record",
    seed: int = 0,
    by: str | None = None,
) -> Fragility:
    """Fragility curves by maximum likelihood, one for each threshold of the demand.

    A run exceeds a threshold if its demand is at least the threshold; of a demand that is the least value over a run,
    such as a gap, if it is at most the threshold. The demand of a run that ended early is a bound: the run exceeds
    every threshold up to it, or from it on, and `early` states how it counts for the others. It is no bound of a demand
    that is no extreme over the run, such as a residual displacement.

    rows: DataFrame of `read_study`, or a part of it. measure, demand: columns of the intensity measure, such as
    `scale`, and of the demand. thresholds: damage states. early: a key of EARLY. level: of confidence of intervals and
    bands. bootstrap: number of samples; 0: intervals from the Fisher information, which takes all runs as independent.
    cluster: column whose values the bootstrap draws, each with all its runs, since the runs of one record depend on
    each other. seed: of the bootstrap. by: column, such as `bounds`; the curves are fitted for each of its values.

    Raises InputError: unknown columns, or runs that determine no curve: none or all exceed, or the intensities of runs
    that exceed and of runs that do not exceed do not overlap.
    """
    if not thresholds or len(set(thresholds)) < len(thresholds):
        raise InputError(f"thresholds = {list(thresholds)}: give one or more different values of {demand}")
    check_share("level", level)
    parsed(Choice(EARLY), early, "early")
    states: list[DamageState] = []
    for case, case_rows in _cases(rows, by):
        x, y, ended = intensities(case_rows, measure), demands(case_rows, demand), complete(case_rows)
        groups = _groups(case_rows, cluster, bootstrap)
        for threshold in sorted(thresholds):
            exceeded, known = _exceedance(y, ended, threshold, early, demand, side_of(rows, demand))
            resampling = None if groups is None else (groups[known], bootstrap, seed)
            where = f"threshold {threshold:g} of {demand}" + (f", {by} = {case}" if by else "")
            state = _state(x[known], exceeded[known], threshold, int((~known).sum()), level, resampling, where)
            states.append(replace(state, case=case))
    return Fragility(measure, demand, unit_of(rows, measure), unit_of(rows, demand), tuple(states))


def _cases(rows: Any, by: str | None) -> list[tuple[str, Any]]:
    """(value, rows with this value) for each value of a column, in order of occurrence; all rows without a column."""
    if by is None:
        return [("", rows)]
    check_columns([by], rows.columns)
    return [(str(value), rows[rows[by] == value]) for value in rows[by].unique()]


def _groups(rows: Any, cluster: str, bootstrap: int) -> Any:
    """The number of the cluster of each run, shape (runs,); None without a bootstrap. Raises InputError."""
    import pandas as pd

    if not bootstrap:
        return None
    if bootstrap < LEAST_BOOTSTRAPS:
        raise InputError(f"bootstrap = {bootstrap}: give at least {LEAST_BOOTSTRAPS} samples, or 0")
    check_columns([cluster], rows.columns)
    groups = pd.factorize(rows[cluster])[0]
    if groups.max(initial=0) < 1:
        raise InputError(f"cluster = {cluster!r}: all runs have the same; give another column")
    return groups


def _exceedance(y: Array, ended: Any, threshold: float, early: str, demand: str, side: Side) -> tuple[Any, Any]:
    """Whether each run exceeds the threshold, and whether this is known, both shape (runs,). Raises InputError."""
    exceeded = y <= threshold if side == "least" else y >= threshold
    unknown = ~ended & ~exceeded if side else ~ended
    if early == "refuse" and unknown.any():
        where = {"most": "below", "least": "above", "": "and do not bound"}[side]
        raise InputError(
            f"{int(unknown.sum())} runs ended early {where} {demand} = {threshold:g}; see their status and message, "
            "and give early = 'leave-out' or 'exceed'"
        )
    if early == "exceed":
        return exceeded | unknown, np.ones_like(unknown)
    return exceeded, ~unknown


def _state(
    x: Array, exceeded: Any, threshold: float, left_out: int, level: float, resampling: Any, where: str
) -> DamageState:
    """The damage state of runs at intensities x. resampling: last arguments of `_bootstrap`, None without bootstrap."""
    from scipy.special import ndtri

    log_levels, level_of_run = np.unique(np.log(x), return_inverse=True)
    runs = np.asarray(np.bincount(level_of_run), dtype=float)
    over = np.asarray(np.bincount(level_of_run, weights=exceeded), dtype=float)
    fit = fitted(log_levels, runs, over, where)
    tails = np.array([(1 - level) / 2, (1 + level) / 2])
    samples = None if resampling is None else _bootstrap(log_levels, level_of_run, exceeded, fit, *resampling)
    if samples is None:
        ratios = [np.exp(ndtri(tails) * error) for error in fit.errors]
        intervals = [fit.median * ratios[0], fit.dispersion * ratios[1]]
    else:
        intervals = [np.quantile(np.exp(-samples[:, 0] / samples[:, 1]), tails), np.quantile(1 / samples[:, 1], tails)]
    of_median, of_dispersion = (tuple(interval.tolist()) for interval in intervals)
    return DamageState(
        threshold, fit.median, fit.dispersion, of_median, of_dispersion, len(x), int(over.sum()), left_out,
        np.exp(log_levels), runs, over, fit, samples, level,
    )  # fmt: skip


def _bootstrap(
    levels: Array, level_of_run: Any, exceeded: Any, fit: FragilityFit, groups: Any, count: int, seed: int
) -> Array:
    """Coefficients of `count` fits to clusters drawn with replacement, shape (count, 2) [-]."""
    # levels: ln x. level_of_run, exceeded, groups: of every run, its index in `levels`, whether it exceeds, and its
    # cluster. Clusters that determine no curve are drawn again. Raises InputError.
    clusters, cluster_of_run = np.unique(groups, return_inverse=True)
    shape = (len(clusters), len(levels))
    runs, over = np.zeros(shape), np.zeros(shape)
    np.add.at(runs, (cluster_of_run, level_of_run), 1)
    np.add.at(over, (cluster_of_run, level_of_run), exceeded)
    rng, failed = np.random.default_rng(seed), 0
    fits: list[Array] = []
    while len(fits) < count:
        times = np.bincount(rng.integers(len(clusters), size=len(clusters)), minlength=len(clusters))
        try:
            fits.append(fitted(levels, times @ runs, times @ over, "bootstrap", fit).coefficients)
        except InputError:
            failed += 1
            if failed > 10 * count:
                raise InputError("bootstrap: most draws of clusters determine no curve; give more records") from None
    return np.array(fits)


def fragility_frame(result: Fragility) -> Any:
    """Points of curves and bands as a DataFrame: case, threshold, intensity, probability, low, high."""
    import pandas as pd

    frames = []
    for state in result.states:
        x = np.geomspace(state.intensity.min(), state.intensity.max(), POINTS)
        low, high = state.band(x)
        columns = {"case": state.case, "threshold": state.threshold, result.measure: x}
        frames.append(pd.DataFrame({**columns, "probability": state.probability(x), "low": low, "high": high}))
    return pd.concat(frames, ignore_index=True)


def fragility_table(result: Fragility) -> Table:
    """The damage states as a table for a terminal."""
    unit = f" [{result.unit}]" if result.unit else ""
    columns = (f"{result.demand}{unit}", "median", "interval", "dispersion", "interval", "runs", "exceeded", "left out")
    rows = [
        (
            f"{state.case} {state.threshold:g}".strip(),
            f"{state.median:.4g}",
            "{:.4g} to {:.4g}".format(*state.median_interval),
            f"{state.dispersion:.3g}",
            "{:.3g} to {:.3g}".format(*state.dispersion_interval),
            str(state.runs),
            str(state.exceeded),
            str(state.left_out),
        )
        for state in result.states
    ]
    level = f"{100 * result.states[0].level:g} %"
    measure = f" [{result.measure_unit}]" if result.measure_unit else ""
    return Table(f"fragility by {result.measure}{measure}, lognormal, intervals of {level}", columns, rows)


def plot_fragility(result: Fragility, path: str | Path | None = None, title: str = "") -> Figure:
    """Probability of exceedance over intensity: curve, band and shares of every damage state. path: see `page`."""
    intensity = np.concatenate([state.intensity for state in result.states])
    x = np.geomspace(intensity.min(), intensity.max(), DRAWN)
    scale = scale_of([state.threshold for state in result.states], result.unit)
    with page(*SIZE, path) as figure:
        headline(figure, title or "fragility")
        axes = figure.subplots()
        for state, colour in zip(result.states, COLOURS * len(result.states), strict=False):
            name = f"{state.case} {state.threshold * scale.factor:.4g} {scale.unit}".strip()
            text = f"{plain(name)}: θ = {state.median:.3g}, β = {state.dispersion:.2g}"
            axes.plot(x, state.probability(x), color=colour, label=text)
            axes.fill_between(x, *state.band(x), color=colour, alpha=SHADE, linewidth=0)
            if state.runs_at.max() > 1:  # intensities with several runs have an observed share
                axes.plot(state.intensity, state.exceeded_at / state.runs_at, "o", color=colour, markersize=3.5)
        axes.set(
            xlabel=labelled(result.measure, result.measure_unit),
            ylabel=f"probability that {labelled(result.demand, '')} exceeds",
            ylim=(0, 1),
        )
        axes.legend(title=f"threshold, with bands of {100 * result.states[0].level:g} %")
    return figure
