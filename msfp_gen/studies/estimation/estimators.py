"""Estimates of a mean, a variance, a probability or a quantile from runs of several models on the same random draws.

The estimate is a telescoping sum: the mean of the cheapest model's prediction over very many draws, and for every
dearer model the mean difference from that prediction over fewer of them (approximate control variates: Gorodetsky,
Geraci, Eldred and Jakeman, *Journal of Computational Physics* 408 (2020), 109257). A prediction is a line through the
pairs of runs, for a probability the normal law about it. That of a draw is fitted to other draws only, so that no run
is used twice and the estimate has no bias. Exact runs are chosen among the draws with known chances, larger where the
prediction is unsure.

How many runs each model gets is the closed form of multi-fidelity Monte Carlo: Peherstorfer, Willcox and Gunzburger,
"Optimal model management for multifidelity Monte Carlo estimation", *SIAM Journal on Scientific Computing* 38 (2016),
A3163-A3194. Models are ordered from the exact one by falling correlation with it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, combinations, pairwise
from typing import Any

import numpy as np

from msfp_gen.common.arrays import Array

Indices = np.ndarray[Any, np.dtype[np.intp]]
Flags = np.ndarray[Any, np.dtype[np.bool_]]
Fit = Callable[[Array, Array, Array], Callable[[Array], Array]]  # of x, y and the weights of these runs
EXACT = "exact"
FOLDS = 5  # of the draws: a prediction is fitted to those of the other folds
LEVEL = 0.95
LEAST = 0.25  # chance of a draw for a mean, over the mean chance
PRIOR = 1e-3  # weight of the prior of the slopes of a line, in runs
RIDGE = 0.05  # weight of the prior of the slope of a logistic curve, in runs
NORMAL = 1.702  # slope of the logistic curve that is nearest to the normal law


@dataclass(frozen=True)
class Runs:
    """Runs of one model.

    draws: their numbers, rising, shape (k,). values: of the quantity [its unit]; infinite where a run failed. chances:
    with which each draw was chosen [-]; 1 for those of the pilot and where all draws are run.
    """

    draws: Indices
    values: Array
    chances: Array


@dataclass(frozen=True)
class Moment:
    """An estimated mean.

    Attributes:
        value: the estimate.
        variance: of it.
        freedom: degrees of freedom of the variance.
        variances: that each level has to estimate, shape (levels,) [its unit squared], for `optimal_runs`, exact first.
        unseen: whether the variance is mostly that of errors of the prediction which no run showed; it falls with the
            square of the number of exact runs.
    """

    value: float
    variance: float
    freedom: float
    variances: Array
    unseen: bool = False

    @property
    def half(self) -> float:
        """Half the width of the interval of 95 %."""
        return quantile_of_t(self.freedom) * float(np.sqrt(self.variance))


def quantile_of_t(freedom: float) -> float:
    """How many standard errors half the width of an interval of 95 % has."""
    from scipy.special import stdtrit

    return float(stdtrit(max(freedom, 1.0), (1 + LEVEL) / 2))


def bent(x: Array, y: Array, weights: Array) -> Callable[[Array], Array]:
    """The regression of y on x and, where all are above 0, its logarithm; level beyond the range of x."""
    return _within(x, _extended(x, y, weights))


def _extended(x: Array, y: Array, weights: Array) -> Callable[[Array], Array]:
    """The same, extended beyond the range of x."""
    low = float(x.min())
    if low <= 0:
        return _regression(x, y, weights, [np.asarray])
    return _regression(x, y, weights, [np.asarray, lambda at: np.log(np.maximum(at, low / 100))])


def _within(x: Array, function: Callable[[Array], Array]) -> Callable[[Array], Array]:
    low, high = float(x.min()), float(x.max())
    return lambda at: function(np.clip(at, low, high))


def _regression(
    x: Array, y: Array, weights: Array, functions: Sequence[Callable[[Array], Array]]
) -> Callable[[Array], Array]:
    """Least squares of y on functions of x, with a prior of their scaled slopes that is worth next to nothing."""
    columns = np.stack([function(x) for function in functions], axis=-1)
    share = weights / weights.sum()
    centre, level = share @ columns, float(share @ y)
    spread = np.sqrt(share @ (columns - centre) ** 2)
    scaled = (columns - centre) / np.where(spread > 0, spread, 1.0)
    worth = len(y) * share
    normal = scaled.T * worth @ scaled + np.diag(np.where(spread > 0, PRIOR, 1.0))
    slopes = np.linalg.solve(normal, scaled.T * worth @ (y - level)) / np.where(spread > 0, spread, 1.0)

    def predict(at: Array) -> Array:
        return np.asarray(level + (np.stack([function(at) for function in functions], axis=-1) - centre) @ slopes)

    return predict


def parabola(x: Array, y: Array, weights: Array) -> Callable[[Array], Array]:
    """The regression parabola of y on x."""
    centre = float(x.mean())
    return _within(x, _regression(x, y, weights, [np.asarray, lambda at: (at - centre) ** 2]))


def logistic(x: Array, y: Array, _: Array) -> Callable[[Array], Array]:
    """The logistic curve of shares y in [0, 1] over x, whose slope has a weak prior."""
    standard = _standard(x)
    level = np.log((y.sum() + 0.5) / (len(y) - y.sum() + 0.5))
    rows = np.stack([np.ones(len(x)), standard(x)], axis=-1)
    solution = _newton(rows, y, np.zeros(len(x)), np.array([level, 0.0]), np.array([1e-3, RIDGE]))
    return lambda at: _expit(solution[0] + solution[1] * standard(at))


def exceedance(threshold: float, extended: bool = False) -> Fit:
    """A fit of values y over x, of which comes the probability that y is at least a threshold.

    It is the normal law about the regression line of the logarithms, which uses how far every run is from the
    threshold; its level and slope are then fitted to the runs that exceed it, with a prior worth some runs. extended:
    beyond the range of x too, where otherwise it is level.
    """

    def fit(x: Array, y: Array, weights: Array) -> Callable[[Array], Array]:
        finite = np.isfinite(y)
        if finite.sum() < 4:
            return logistic(x, (y >= threshold).astype(float), weights)
        logs = threshold > 0 and float(y[finite].min()) > 0
        heights, bound = (np.log(y[finite]), np.log(threshold)) if logs else (y[finite], threshold)
        standard = _standard(x)
        fitted = standard(x[finite])
        straight = _regression(fitted, heights, np.ones(len(heights)), [np.asarray])
        regression = straight if extended else _within(fitted, straight)
        left = heights - regression(fitted)
        deviation = max(float(left.std()), 1e-3 * (float(heights.std()) or 1.0), 1e-12)

        def offset(at: Array) -> Array:
            return NORMAL * (regression(standard(at)) - bound) / deviation

        own = offset(x)
        rows = np.stack([np.ones(len(x)), own], axis=-1)
        solution = _newton(rows, (y >= threshold).astype(float), own, np.zeros(2), np.array([1.0, 4.0]))
        return lambda at: _expit(solution[0] + (1 + solution[1]) * offset(at))

    return fit


def _standard(x: Array) -> Callable[[Array], Array]:
    """Values less the mean of x, over its standard deviation; of logarithms where all x are above 0."""
    low = float(x.min())

    def scaled(at: Array) -> Array:
        return np.asarray(np.log(np.maximum(at, low / 100)) if low > 0 else at)

    z = scaled(x)
    centre, spread = float(z.mean()), float(z.std()) or 1.0
    return lambda at: (scaled(at) - centre) / spread


def _expit(eta: Array) -> Array:
    from scipy.special import expit

    return np.asarray(expit(eta))


def _newton(rows: Array, y: Array, offset: Array, start: Array, prior: Array) -> Array:
    """Coefficients of a logistic regression of shares y with an offset, and a normal prior of these weights about 0."""
    solution = start
    for _ in range(30):
        share = _expit(offset + rows @ solution)
        gradient = rows.T @ (y - share) - prior * solution
        information = (rows * (share * (1 - share))[:, None]).T @ rows + np.diag(prior)
        step = np.linalg.solve(information, gradient)
        most = float(np.abs(step).max())
        solution = solution + step * min(1.0, 2.0 / (most + 1e-300))
        if most < 1e-8:
            break
    return solution


def feature(values: Array) -> Array:
    """Values of a model for the fit of a prediction, shape (runs,) [unit of `values`]; of a failed run the largest."""
    finite = values[np.isfinite(values)]
    most = float(finite.max()) if len(finite) else 0.0
    return np.where(np.isfinite(values), values, most)


def predictions(
    fit: Fit, draws: Indices, x: Array, target_draws: Indices, target: Array, weights: Array | None = None
) -> Array:
    """For every draw the prediction of a target from x, fitted to other folds; shape of `draws` [unit of `target`].

    target_draws are among `draws`. weights: of the targets in the fit; None: equal.
    """
    known = x[np.searchsorted(draws, target_draws)]
    weights = np.ones(len(target)) if weights is None else weights
    out = np.empty(len(draws))
    for fold in range(FOLDS):
        others, here = target_draws % FOLDS != fold, draws % FOLDS == fold
        out[here] = fit(known[others], target[others], weights[others])(x[here])
    return out


def telescoped(
    target: Array, levels: Sequence[Runs], pilot: int, population: int | None = None, fit: Fit = bent,
    threshold: float | None = None,
) -> Moment:  # fmt: skip
    """The mean of a target that is known at the exact runs.

    levels: exact first; the draws of each are among those of the next, and the last has all. pilot: number of draws
    that all levels have. population: number of all draws that there are; None: no end of them. fit: of predictions.
    threshold: the target is the values, and their mean the probability that they are at least this.
    """
    count = len(levels[-1].draws)
    parts, current, fitted = [], target if threshold is None else (target >= threshold).astype(float), target
    for upper, lower in pairwise(levels):
        first = fit if threshold is None else exceedance(threshold) if upper is levels[0] else logistic
        predicted = predictions(first, lower.draws, feature(lower.values), upper.draws, fitted, 1 / upper.chances)
        difference = current - predicted[np.searchsorted(lower.draws, upper.draws)]
        parts.append(_contributions(upper, difference, pilot, count))
        current = fitted = predicted
    parts.append(current)
    groups = [slice(0, pilot), slice(pilot, count)] if 1 < pilot < count - 1 else [slice(0, count)]
    unseen = 0.0
    if threshold is not None:  # that none of n runs errs does not mean that none does: variance by Jeffreys' prior
        inverse = 1 / levels[0].chances[levels[0].draws >= pilot]
        unseen = 0.5 / (pilot + inverse.sum() ** 2 / max(inverse @ inverse, 1.0)) ** 2
    ends = [len(level.draws) for level in levels]
    left = np.array([1.0 if population is None else max(1 - end / population, 0.0) for end in ends])
    own = [_variance(part, groups) for part in parts]
    variances = left * np.array([max(own[0], unseen), *own[1:]])
    variance = max(_variance(sum(parts, np.zeros(count)), groups) if population is None else 0.0, variances.sum())
    freedom = np.maximum(np.minimum(np.array(ends) - 2.0, [_freedom(part, groups) for part in parts]), 1.0)
    total = float(variance**2 / max(np.sum(variances**2 / freedom), 1e-300)) if variance > 0 else np.inf
    planned = variances * ends * variance / max(float(variances.sum()), 1e-300)
    value = float(np.mean(sum(parts, np.zeros(count))))
    return Moment(value, float(variance), total, planned, bool(unseen > variance / 2))


def _contributions(level: Runs, difference: Array, pilot: int, count: int) -> Array:
    """What every draw adds to `count` times the mean of a difference that is known at some of them; shape (count,).

    The means over the pilot and over the other draws are weighted by the numbers of runs that they are worth, of the
    others with chances in proportion to what predictions leave.
    """
    out = np.zeros(count)
    first = level.draws < pilot
    main, runs = level.chances[~first], float(first.sum())
    if not len(main):
        out[level.draws] = difference * count / max(runs, 1.0)
        return out
    share = runs / (runs + (count - pilot) * float(main.mean()))
    out[level.draws[first]] = difference[first] * share * count / max(pilot, 1)
    out[level.draws[~first]] = difference[~first] / main * (1 - share) * count / (count - pilot)
    return out


def _variance(contributions: Array, groups: Sequence[slice]) -> float:
    """Variance of the mean of contributions, of draws that are alike within each group."""
    count = len(contributions)
    parts = [contributions[group] for group in groups]
    return float(sum(len(part) * part.var(ddof=1) for part in parts if len(part) > 1)) / count**2


def _freedom(contributions: Array, groups: Sequence[slice]) -> float:
    """Degrees of freedom of `_variance`: twice its square over its own variance (Satterthwaite, 1946).

    The variance of a sample variance follows from the fourth moment: a few large contributions among many small ones
    say little about the variance, which the number of runs alone does not tell.
    """
    parts = [contributions[group] for group in groups]
    deviations = [(part - part.mean()) ** 2 for part in parts if len(part) > 1]
    own = sum(float(((squares - squares.mean()) ** 2).sum()) for squares in deviations)
    return 2 * float(sum(squares.sum() for squares in deviations)) ** 2 / own if own > 0 else np.inf


def exceeding(levels: Sequence[Runs], threshold: float, pilot: int, population: int | None = None) -> Moment:
    """The probability that the exact value is at least a threshold."""
    return telescoped(levels[0].values, levels, pilot, population, threshold=threshold)


def variance_of(levels: Sequence[Runs], pilot: int, population: int | None = None) -> Moment:
    """The variance of the exact value."""
    mean = telescoped(levels[0].values, levels, pilot, population)
    squares = telescoped((levels[0].values - mean.value) ** 2, levels, pilot, population, parabola)
    return Moment(squares.value + mean.variance, squares.variance, squares.freedom, squares.variances)


def quantile_of(
    levels: Sequence[Runs], share: float, pilot: int, population: int | None = None
) -> tuple[float, tuple[float, float], Moment]:
    """The value below which a share of all lies, its interval, and the probability to be above it.

    The interval contains the values whose estimated probability differs from the share by less than half the width of
    its own interval (Woodruff, 1952).
    """
    from scipy.optimize import brentq

    values = np.sort(levels[0].values[np.isfinite(levels[0].values)])
    ends = float(values[0]), float(values[-1])

    def above(at: float) -> Moment:
        return exceeding(levels, at, pilot, population)

    def place(probability: float) -> float:
        if above(ends[0]).value <= probability:
            return ends[0]
        if above(ends[1]).value >= probability:
            return ends[1]
        root = brentq(lambda at: above(at).value - probability, *ends, xtol=1e-4 * (ends[1] - ends[0]))
        return float(root)

    quantile = place(1 - share)
    moment = above(quantile)
    low, high = (place(float(np.clip(1 - share + sign * moment.half, 0.0, 1.0))) for sign in (1, -1))
    return quantile, (low, high), moment


def uncertainty(x: Array, values: Array, threshold: float | None, at: Array) -> Array:
    """In proportion to which chance a draw should be run exactly [-]: shape of `at` (Neyman, 1934).

    threshold: of a probability: the deviation of a yes or no with the predicted share, at least a fifth of the
    largest; a rare event lies beyond the range of the pilot, so an extended prediction counts as well. None: for a
    mean the predicted distance from the prediction, at least a quarter of its mean, and beyond the range of the pilot
    what an extended prediction would add. So a model that errs is found out.
    """
    equal = np.ones(len(x))
    if threshold is not None:
        level, extended = (exceedance(threshold, far)(x, values, equal)(at) for far in (False, True))
        return np.clip(np.sqrt(np.maximum(level * (1 - level), extended * (1 - extended))), 0.1, 0.5)
    left = np.abs(values - bent(x, values, equal)(x))
    mean = float(left.mean())
    if not mean > 0:
        return np.ones(len(at))
    beyond = np.abs(_extended(x, values, equal)(at) - bent(x, values, equal)(at)) / mean
    return np.maximum(bent(x, left, equal)(at) / mean, LEAST) + beyond


@dataclass(frozen=True)
class Chain:
    """Models that are used together, the exact one first, and what they save.

    work: seconds that they need for a variance, over those of the exact model alone.
    """

    models: tuple[str, ...]
    work: float


def shares_of_variance(correlations: Array) -> Array:
    """The part of the variance of the exact model that each level of a chain has to estimate, shape (k,) [-].

    correlations: of every model with the exact one, which comes first, falling, shape (k,). Each level estimates its
    difference from the next; the last one estimates its own mean.
    """
    squares = np.append(np.asarray(correlations, dtype=float) ** 2, 0.0)
    shares: Array = squares[:-1] - squares[1:]
    return shares


def work_of(shares: Array, costs: Array) -> float:
    """Seconds times variance of a chain with optimal numbers of runs, over those of plain Monte Carlo.

    shares: of variance, shape (k,). costs: of a run of each model [s], shape (k,).
    """
    return float(np.sum(np.sqrt(shares * costs)) ** 2 / costs[0])


def optimal_runs(
    variances: Array, costs: Array, *, variance: float | None = None, seconds: float | None = None
) -> Array:
    """Numbers of runs of each level, not rounded, for a variance of the estimate or for a time [s]; shape (k,).

    variances: that each level has to estimate. They are in proportion to sqrt(variance / cost), and a level has no
    fewer runs than the one before it.
    """
    ratios = np.maximum.accumulate(np.sqrt(np.maximum(variances, 0.0) / costs) + 1e-300)
    if variance is not None:
        return np.asarray(ratios * float(np.sum(variances / ratios)) / variance)
    assert seconds is not None
    return np.asarray(ratios * seconds / float(np.sum(ratios * costs)))


def factor_for(weights: Array, wanted: float, least: float) -> float:
    """The factor with which chances in proportion to weights choose as many draws as wanted on average.

    Chances are at most 1. least: what is added to each of them.
    """
    from scipy.optimize import brentq

    if wanted <= least * len(weights) or not len(weights):
        return 0.0
    most = float(1 / weights.min())
    if wanted >= len(weights):
        return most

    def excess(factor: float) -> float:
        return float(np.minimum(factor * weights + least, 1.0).sum()) - wanted

    return float(brentq(excess, 0.0, most, xtol=1e-12 * most))


def best_chain(correlations: Mapping[str, float], costs: Mapping[str, float]) -> Chain:
    """The models whose use together is cheapest: all subsets are compared by the closed form.

    correlations: model -> that with the exact one. costs: model -> seconds of a run, the exact one's included.
    """
    cheaper = sorted((name for name in correlations if name != EXACT), key=lambda name: -abs(correlations[name]))
    best = Chain((EXACT,), 1.0)
    for chosen in chain.from_iterable(combinations(cheaper, count + 1) for count in range(len(cheaper))):
        shares = shares_of_variance(np.array([1.0, *(abs(correlations[name]) for name in chosen)]))
        paid = np.array([costs[name] for name in (EXACT, *chosen)])
        rising = (shares >= 0).all() and (np.diff(shares / paid) > 0).all()  # numbers of runs along the chain
        if rising and (work := work_of(shares, paid)) < best.work:
            best = Chain((EXACT, *chosen), work)
    return best
