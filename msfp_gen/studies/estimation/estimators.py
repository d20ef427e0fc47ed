"""The mathematics of an estimate: the mean of an exact model from few of its runs and many of a cheap one.

It is the regression estimator of double sampling (Cochran, *Sampling Techniques*, 3rd edition, 1977, section 12.6), in
simulation a control variate with estimated coefficient (Lavenberg and Welch, *Management Science* 27 (1981), 322-335).
The exact model runs the first n draws, the cheap one the first m of the same draws; its mean over all m corrects the
mean over n by the slope of a regression line. A probability is the mean of the exceedances, 0 or 1, of both models.

Numbers of runs are the optimum of two-level Monte Carlo: Peherstorfer, Willcox and Gunzburger, *SIAM Journal on
Scientific Computing* 38 (2016), A3163-A3194.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt

import numpy as np

from msfp_gen.common.arrays import Array

EXACT = "exact"
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Moment:
    """An estimated mean.

    Attributes:
        value: the estimate of the mean.
        variance: variance of the estimate.
        freedom: degrees of freedom of the variance.
        residual, explained: variance of a run of the exact and of the cheap model, for `optimal_runs`.
        unseen: whether most of the variance is an allowance for what no run showed; such a variance falls with the
            square of the number of exact runs.
    """

    value: float
    variance: float
    freedom: float
    residual: float
    explained: float
    unseen: bool = False

    @property
    def half(self) -> float:
        """Half the width of the interval of 95 %."""
        return quantile_of_t(self.freedom) * sqrt(self.variance)


def quantile_of_t(freedom: float) -> float:
    """Half the width of an interval of 95 %, over the standard error: the quantile of Student's t distribution."""
    from scipy.special import stdtrit

    return float(stdtrit(max(freedom, 1.0), (1 + CONFIDENCE) / 2))


def mean_of(exact: Array, cheap: Array | None = None, population: float = inf, added: float = 0.0) -> Moment:
    """The mean of the exact model.

    exact: values at the first n draws, shape (n,). cheap: at the first m >= n draws, shape (m,); None: without. What
    the regression line adds at cheap values beyond those of the exact runs counts as an error: no run shows it.
    population: number of draws that exist. added: to variances, over the number of runs.
    """
    n, value = len(exact), float(exact.mean())
    if cheap is None or not np.ptp(cheap[:n]) > 0:
        seen = float(exact.var(ddof=1))
        residual = seen + added / n
        return Moment(value, residual * max(1 / n - 1 / population, 0.0), n - 1, residual, 0.0, seen < added / n)
    m, own = len(cheap), cheap[:n] - cheap[:n].mean()
    squares = float(own @ own)
    slope = float(own @ (exact - value)) / squares
    shift = float(cheap.mean() - cheap[:n].mean())
    errors = exact - value - slope * own
    seen, explained = float(errors @ errors) / max(n - 2, 1), slope**2 * (float(cheap.var(ddof=1)) + added / m)
    beyond = slope * float(np.abs(cheap - np.clip(cheap, cheap[:n].min(), cheap[:n].max())).mean())
    residual = seen + added / n + n * beyond**2
    variance = residual * max(1 / n - 1 / population + shift**2 / squares, 0.0)
    variance += explained * max(1 / m - 1 / population, 0.0)
    return Moment(value + slope * shift, variance, n - 2, residual, explained, seen < added / n)


def exceeding(exact: Array, cheap: Array | None, threshold: float, population: float = inf) -> Moment:
    """The probability that the exact value is at least a threshold; arguments as of `mean_of`.

    Two events more than were seen count in the variances (Agresti and Coull, *The American Statistician* 52 (1998),
    119-126): of an event that no run shows the interval reaches to 2.8/n.
    """
    over = None if cheap is None else (cheap >= threshold).astype(float)
    return mean_of((exact >= threshold).astype(float), over, population, added=2.0)


def work(correlation: float, cost: float) -> float:
    """Time for a given variance, over that of exact runs alone; cost: of a cheap run, over that of an exact one [-]."""
    return float((sqrt(max(1 - correlation**2, 0.0)) + abs(correlation) * sqrt(cost)) ** 2)


def optimal_runs(
    variances: Array, costs: Array, *, variance: float | None = None, seconds: float | None = None
) -> Array:
    """Numbers of runs of each model, not rounded, shape (k,) [-], for a variance of the estimate or for a time.

    variances: of one run of each model, the exact one first, shape (k,). costs: of a run, shape (k,) [s]. The numbers
    are in proportion to sqrt(variance / cost), and a model has no fewer runs than the one before it. seconds: of all
    runs [s].
    """
    ratios = np.maximum.accumulate(np.sqrt(np.maximum(variances, 0.0) / costs) + 1e-300)
    if variance is not None:
        return np.asarray(ratios * float(np.sum(variances / ratios)) / variance)
    assert seconds is not None
    return np.asarray(ratios * seconds / float(np.sum(ratios * costs)))
