"""The mathematics of an estimate: a mean, variance, probability or quantile from runs of several models on equal draws.

Arrays come in and numbers go out; `estimate.py` decides which runs are made. The models form a chain: the exact model
first, then cheaper models by falling correlation with it. Each model of a chain is a level.

The estimate is a telescoping sum (approximate control variates: Gorodetsky, Geraci, Eldred and Jakeman, *Journal of
Computational Physics* 408 (2020), 109257). Its last term is the mean of the cheapest model over very many draws. Every
other level adds the mean difference between its values and the prediction from the next cheaper level, over fewer
draws. A prediction is a regression on pairs of runs of the same draw; for a probability it is a normal law about a
regression line. The prediction for a draw is fitted to other draws only, so that the estimate has no bias. Draws for
exact runs are chosen with known chances, which are larger where the prediction is uncertain.

The number of runs of each level is the closed form of multi-fidelity Monte Carlo: Peherstorfer, Willcox and Gunzburger,
"Optimal model management for multifidelity Monte Carlo estimation", *SIAM Journal on Scientific Computing* 38 (2016),
A3163-A3194.
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
Function = Callable[[Array], Array]  # of x, elementwise
Fit = Callable[[Array, Array, Array], Function]  # (x, y, weights of the runs) -> prediction of y
EXACT = "exact"
FOLDS = 5  # groups of draws: the prediction for a draw is fitted to the other groups
CONFIDENCE = 0.95
LEAST = 0.25  # smallest weight of a draw, over the mean weight, for a mean
PRIOR = 1e-3  # weight of the prior of the slopes of a line, in runs
RIDGE = 0.05  # weight of the prior of the slope of a logistic curve, in runs
NORMAL = 1.702  # slope of the logistic curve that is nearest to the normal law


@dataclass(frozen=True)
class Runs:
    """Runs of one model.

    draws: numbers of the draws, rising, shape (k,). values: of the quantity, shape (k,) [its unit]; infinite where a
    run failed. chances: probability with which each draw was chosen, shape (k,) [-]; 1 in the pilot and where all draws
    are run.
    """

    draws: Indices
    values: Array
    chances: Array


@dataclass(frozen=True)
class Moment:
    """An estimated mean.

    Attributes:
        value: the estimate of the mean.
        variance: variance of the estimate.
        freedom: degrees of freedom of the variance.
        variances: variance of one run of each level, exact first, shape (levels,) [its unit squared], for
            `optimal_runs`.
        unseen: whether most of the variance is an allowance for errors of the prediction that no run showed; such a
            variance falls with the square of the number of exact runs.
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
    """Half the width of an interval of 95 %, over the standard error: the quantile of Student's t distribution."""
    from scipy.special import stdtrit

    return float(stdtrit(max(freedom, 1.0), (1 + CONFIDENCE) / 2))


def curve(x: Array, y: Array, weights: Array) -> Function:
    """The regression of y on x and, where all x are above 0, on log x; constant beyond the range of x."""
    return _constant_beyond(x, _extended_curve(x, y, weights))


def _extended_curve(x: Array, y: Array, weights: Array) -> Function:
    """The regression of `curve`, extended beyond the range of x."""
    low = float(x.min())
    if low <= 0:
        return _regression(x, y, weights, [np.asarray])
    return _regression(x, y, weights, [np.asarray, lambda at: np.log(np.maximum(at, low / 100))])


def _constant_beyond(x: Array, function: Function) -> Function:
    """The function, with its values at the ends of the range of x beyond that range."""
    low, high = float(x.min()), float(x.max())
    return lambda at: function(np.clip(at, low, high))


def _regression(x: Array, y: Array, weights: Array, terms: Sequence[Function]) -> Function:
    """Weighted least squares of y on a constant and terms of x; the slopes have a prior of nearly no weight."""
    columns = np.stack([term(x) for term in terms], axis=-1)
    shares = weights / weights.sum()
    centre, mean = shares @ columns, float(shares @ y)
    spread = np.sqrt(shares @ (columns - centre) ** 2)
    scaled = (columns - centre) / np.where(spread > 0, spread, 1.0)
    counts = len(y) * shares
    normal = scaled.T * counts @ scaled + np.diag(np.where(spread > 0, PRIOR, 1.0))
    slopes = np.linalg.solve(normal, scaled.T * counts @ (y - mean)) / np.where(spread > 0, spread, 1.0)

    def predict(at: Array) -> Array:
        return np.asarray(mean + (np.stack([term(at) for term in terms], axis=-1) - centre) @ slopes)

    return predict


def parabola(x: Array, y: Array, weights: Array) -> Function:
    """The regression parabola of y on x; constant beyond the range of x."""
    centre = float(x.mean())
    return _constant_beyond(x, _regression(x, y, weights, [np.asarray, lambda at: (at - centre) ** 2]))


def logistic(x: Array, y: Array, _: Array) -> Function:
    """The logistic curve through shares y in [0, 1] over x, whose slope has a weak prior; without weights."""
    standardised = _standardised(x)
    intercept = np.log((y.sum() + 0.5) / (len(y) - y.sum() + 0.5))
    rows = np.stack([np.ones(len(x)), standardised(x)], axis=-1)
    solution = _newton(rows, y, np.zeros(len(x)), np.array([intercept, 0.0]), np.array([1e-3, RIDGE]))
    return lambda at: _expit(solution[0] + solution[1] * standardised(at))


def exceedance(threshold: float, extended: bool = False) -> Fit:
    """A fit that takes values y and predicts the probability that y is at least a threshold.

    The prediction is a normal law about the regression line of log y, which uses the distance of every run from the
    threshold. Intercept and slope of the law are then corrected by a logistic regression on which runs exceed, with a
    prior worth some runs. extended: the line continues beyond the range of x, where otherwise it is constant.
    """

    def fit(x: Array, y: Array, weights: Array) -> Function:
        finite = np.isfinite(y)
        if finite.sum() < 4:
            return logistic(x, (y >= threshold).astype(float), weights)
        positive = threshold > 0 and float(y[finite].min()) > 0
        heights, bound = (np.log(y[finite]), np.log(threshold)) if positive else (y[finite], threshold)
        standardised = _standardised(x)
        fitted = standardised(x[finite])
        straight = _regression(fitted, heights, np.ones(len(heights)), [np.asarray])
        line = straight if extended else _constant_beyond(fitted, straight)
        residuals = heights - line(fitted)
        deviation = max(float(residuals.std()), 1e-3 * (float(heights.std()) or 1.0), 1e-12)

        def offset(at: Array) -> Array:
            return NORMAL * (line(standardised(at)) - bound) / deviation

        offsets = offset(x)
        rows = np.stack([np.ones(len(x)), offsets], axis=-1)
        solution = _newton(rows, (y >= threshold).astype(float), offsets, np.zeros(2), np.array([1.0, 4.0]))
        return lambda at: _expit(solution[0] + (1 + solution[1]) * offset(at))

    return fit


def _standardised(x: Array) -> Function:
    """The function that subtracts the mean of x and divides by its deviation; of log x where all x are above 0."""
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
    """Coefficients, shape (k,), of a logistic regression of shares y, shape (runs,), on rows, shape (runs, k).

    offset: added to the predictor, shape (runs,). prior: weights of a normal prior about 0, shape (k,).
    """
    solution = start
    for _ in range(30):
        share = _expit(offset + rows @ solution)
        gradient = rows.T @ (y - share) - prior * solution
        information = (rows * (share * (1 - share))[:, None]).T @ rows + np.diag(prior)
        step = np.linalg.solve(information, gradient)
        largest = float(np.abs(step).max())
        solution = solution + step * min(1.0, 2.0 / (largest + 1e-300))
        if largest < 1e-8:
            break
    return solution


def feature(values: Array) -> Array:
    """The values of a model, a failed run with the largest of all others, shape (runs,) [unit of `values`]."""
    finite = values[np.isfinite(values)]
    largest = float(finite.max()) if len(finite) else 0.0
    return np.where(np.isfinite(values), values, largest)


def predictions(
    fit: Fit, draws: Indices, x: Array, target_draws: Indices, target: Array, weights: Array | None = None
) -> Array:
    """The prediction of a target at every draw from x, fitted to the other folds; shape of `draws` [unit of `target`].

    target_draws: draws at which the target is known, a subset of `draws`. weights: of the targets in the fit; None:
    equal.
    """
    fitted = x[np.searchsorted(draws, target_draws)]
    weights = np.ones(len(target)) if weights is None else weights
    predicted = np.empty(len(draws))
    for fold in range(FOLDS):
        others, inside = target_draws % FOLDS != fold, draws % FOLDS == fold
        predicted[inside] = fit(fitted[others], target[others], weights[others])(x[inside])
    return predicted


def telescoped(
    target: Array, levels: Sequence[Runs], pilot: int, population: int | None = None, fit: Fit = curve,
    threshold: float | None = None,
) -> Moment:  # fmt: skip
    """The mean of a target that is known at the exact runs, as a telescoping sum over the levels.

    levels: exact first; the draws of a level are a subset of the draws of the next, and the last level has all draws.
    pilot: number of draws that every level runs. population: number of draws that exist; None: unlimited. fit: of the
    predictions. threshold: the target holds values, and the mean is the probability that they are at least this.
    """
    count = len(levels[-1].draws)
    terms, current, fitted = [], target if threshold is None else (target >= threshold).astype(float), target
    for upper, lower in pairwise(levels):
        own_fit = fit if threshold is None else exceedance(threshold) if upper is levels[0] else logistic
        predicted = predictions(own_fit, lower.draws, feature(lower.values), upper.draws, fitted, 1 / upper.chances)
        difference = current - predicted[np.searchsorted(lower.draws, upper.draws)]
        terms.append(_contributions(upper, difference, pilot, count))
        current = fitted = predicted
    terms.append(current)
    groups = [slice(0, pilot), slice(pilot, count)] if 1 < pilot < count - 1 else [slice(0, count)]
    unseen = 0.0
    if threshold is not None:  # n runs without an error do not exclude errors: variance by Jeffreys' prior
        inverse = 1 / levels[0].chances[levels[0].draws >= pilot]
        unseen = 0.5 / (pilot + inverse.sum() ** 2 / max(inverse @ inverse, 1.0)) ** 2
    runs = [len(level.draws) for level in levels]
    remaining = np.array([1.0 if population is None else max(1 - number / population, 0.0) for number in runs])
    sampled = [_variance(term, groups) for term in terms]
    variances = remaining * np.array([max(sampled[0], unseen), *sampled[1:]])
    variance = max(_variance(sum(terms, np.zeros(count)), groups) if population is None else 0.0, variances.sum())
    freedoms = np.maximum(np.minimum(np.array(runs) - 2.0, [_freedom(term, groups) for term in terms]), 1.0)
    freedom = float(variance**2 / max(np.sum(variances**2 / freedoms), 1e-300)) if variance > 0 else np.inf
    planned = variances * runs * variance / max(float(variances.sum()), 1e-300)
    value = float(np.mean(sum(terms, np.zeros(count))))
    return Moment(value, float(variance), freedom, planned, bool(unseen > variance / 2))


def _contributions(level: Runs, difference: Array, pilot: int, count: int) -> Array:
    """The contribution of every draw to a mean difference, times `count`, shape (count,); 0 where a draw has no run.

    The means over the pilot and over the chosen draws are weighted by the numbers of runs that they are worth. A chosen
    draw is weighted by the inverse of its chance.
    """
    contributions = np.zeros(count)
    in_pilot = level.draws < pilot
    chances, runs = level.chances[~in_pilot], float(in_pilot.sum())
    if not len(chances):
        contributions[level.draws] = difference * count / max(runs, 1.0)
        return contributions
    share = runs / (runs + (count - pilot) * float(chances.mean()))
    contributions[level.draws[in_pilot]] = difference[in_pilot] * share * count / max(pilot, 1)
    contributions[level.draws[~in_pilot]] = difference[~in_pilot] / chances * (1 - share) * count / (count - pilot)
    return contributions


def _variance(contributions: Array, groups: Sequence[slice]) -> float:
    """Variance of the mean of contributions; the draws of one group have the same distribution."""
    count = len(contributions)
    samples = [contributions[group] for group in groups]
    return float(sum(len(sample) * sample.var(ddof=1) for sample in samples if len(sample) > 1)) / count**2


def _freedom(contributions: Array, groups: Sequence[slice]) -> float:
    """Degrees of freedom of `_variance`: twice its square over its own variance (Satterthwaite, 1946).

    The variance of a sample variance follows from the fourth moment. So a few large contributions among many small
    contributions give few degrees of freedom, whatever the number of runs.
    """
    samples = [contributions[group] for group in groups]
    deviations = [(sample - sample.mean()) ** 2 for sample in samples if len(sample) > 1]
    variance = sum(float(((squares - squares.mean()) ** 2).sum()) for squares in deviations)
    return 2 * float(sum(squares.sum() for squares in deviations)) ** 2 / variance if variance > 0 else np.inf


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
    """The value below which a share of all draws lies, its interval, and the probability of exceeding the value.

    The interval contains the values whose estimated probability of exceedance differs from 1 - share by less than half
    the width of the interval of that probability (Woodruff, 1952).
    """
    from scipy.optimize import brentq

    values = np.sort(levels[0].values[np.isfinite(levels[0].values)])
    ends = float(values[0]), float(values[-1])

    def above(at: float) -> Moment:
        return exceeding(levels, at, pilot, population)

    def value_at(probability: float) -> float:
        if above(ends[0]).value <= probability:
            return ends[0]
        if above(ends[1]).value >= probability:
            return ends[1]
        root = brentq(lambda at: above(at).value - probability, *ends, xtol=1e-4 * (ends[1] - ends[0]))
        return float(root)

    quantile = value_at(1 - share)
    moment = above(quantile)
    low, high = (value_at(float(np.clip(1 - share + sign * moment.half, 0.0, 1.0))) for sign in (1, -1))
    return quantile, (low, high), moment


def uncertainty(x: Array, values: Array, threshold: float | None, at: Array) -> Array:
    """Weights in proportion to which draws are chosen for exact runs, shape of `at` [-] (Neyman, 1934).

    x, values: of the cheap and of the exact model in the pilot. at: values of the cheap model at all draws.
    threshold: for a probability; the weight is the standard deviation of the exceedance (0 or 1) at its predicted
    probability, and at least a fifth of the largest. A rare event lies beyond the range of the pilot, so the
    prediction is also extended, and the larger deviation counts.
    None: for a mean; the weight is the predicted error of the prediction, and at least a quarter of its mean. Beyond
    the range of the pilot the change by an extended prediction is added, so that errors of the cheap model show.
    """
    equal = np.ones(len(x))
    if threshold is not None:
        constant, extended = (exceedance(threshold, far)(x, values, equal)(at) for far in (False, True))
        return np.clip(np.sqrt(np.maximum(constant * (1 - constant), extended * (1 - extended))), 0.1, 0.5)
    errors = np.abs(values - curve(x, values, equal)(x))
    mean = float(errors.mean())
    if not mean > 0:
        return np.ones(len(at))
    beyond = np.abs(_extended_curve(x, values, equal)(at) - curve(x, values, equal)(at)) / mean
    return np.maximum(curve(x, errors, equal)(at) / mean, LEAST) + beyond


@dataclass(frozen=True)
class Chain:
    """Models that are used together, the exact model first.

    work: time of the chain for a given variance, over the time of the exact model alone.
    """

    models: tuple[str, ...]
    work: float


def shares_of_variance(correlations: Array) -> Array:
    """The share of the variance of the exact model that each level of a chain has to estimate, shape (k,) [-].

    correlations: of every level with the exact model, which comes first; falling, shape (k,). Each level estimates its
    difference from the next level; the last level estimates its own mean.
    """
    squares = np.append(np.asarray(correlations, dtype=float) ** 2, 0.0)
    shares: Array = squares[:-1] - squares[1:]
    return shares


def work_of(shares: Array, costs: Array) -> float:
    """Time of a chain for a given variance, with optimal numbers of runs, over the time of plain Monte Carlo.

    shares: as of `shares_of_variance`. costs: of a run of each level, shape (k,) [s].
    """
    return float(np.sum(np.sqrt(shares * costs)) ** 2 / costs[0])


def optimal_runs(
    variances: Array, costs: Array, *, variance: float | None = None, seconds: float | None = None
) -> Array:
    """Numbers of runs of each level, not rounded, shape (k,) [-], for a variance of the estimate or for a time.

    variances: of one run of each level, shape (k,). costs: of a run, shape (k,) [s]. The numbers are in proportion to
    sqrt(variance / cost), and a level has no fewer runs than the level before it. seconds: of all runs [s].
    """
    ratios = np.maximum.accumulate(np.sqrt(np.maximum(variances, 0.0) / costs) + 1e-300)
    if variance is not None:
        return np.asarray(ratios * float(np.sum(variances / ratios)) / variance)
    assert seconds is not None
    return np.asarray(ratios * seconds / float(np.sum(ratios * costs)))


def factor_for(weights: Array, wanted: float, least: float) -> float:
    """The factor for which the chances min(factor * weights + least, 1) choose `wanted` draws on average.

    weights: of the draws, shape (draws,) [-].
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
    """The cheapest chain of models; all subsets are compared by the closed form.

    correlations: model -> correlation with the exact model. costs: model -> cost of a run [s], with the exact model.
    """
    cheaper = sorted((name for name in correlations if name != EXACT), key=lambda name: -abs(correlations[name]))
    best = Chain((EXACT,), 1.0)
    for chosen in chain.from_iterable(combinations(cheaper, count + 1) for count in range(len(cheaper))):
        shares = shares_of_variance(np.array([1.0, *(abs(correlations[name]) for name in chosen)]))
        seconds = np.array([costs[name] for name in (EXACT, *chosen)])
        rising = (shares >= 0).all() and (np.diff(shares / seconds) > 0).all()  # numbers of runs along the chain
        if rising and (work := work_of(shares, seconds)) < best.work:
            best = Chain((EXACT, *chosen), work)
    return best
