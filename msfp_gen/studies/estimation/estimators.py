"""The mathematics of an estimate: the mean of an exact model from few of its runs and many of a cheap one.

Control variates with estimated coefficients: Glasserman, *Monte Carlo Methods in Financial Engineering*, Springer 2004,
section 4.1; in sampling the regression estimator (Cochran, *Sampling Techniques*, 3rd edition, 1977, section 12.6). The
exact model runs the first n draws, the cheap one the first m of the same draws; what the cheap model gives over all m
corrects the mean over n by a linear regression. A probability is the mean of the exceedances, 0 or 1, of both models,
and its interval is Wilson's for as many independent draws as have its variance (Franco, Little, Louis and Slud,
*Journal of Survey Statistics and Methodology* 7 (2019), 334-364).

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
UNSEEN = 2.0  # events more than were seen, in variances


@dataclass(frozen=True)
class Moment:
    """An estimated mean.

    Attributes:
        value: the estimate of the mean.
        variance: variance of the estimate.
        freedom: degrees of freedom of the variance.
        residual, explained: variance of a run of the exact and of the cheap model, for `optimal_runs`.
        plain: variance of an exact run, without a cheap model.
        unseen: whether most of the variance is the allowance for what no run showed; such a variance falls with the
            square of the number of exact runs.
        draws: of a probability, the number of independent exact runs with its variance [-]; None: of a mean.
    """

    value: float
    variance: float
    freedom: float
    residual: float
    explained: float
    plain: float
    unseen: bool = False
    draws: float | None = None

    @property
    def quantile(self) -> float:
        """Of Student's t, for an interval of 95 %."""
        from scipy.special import stdtrit

        return float(stdtrit(max(self.freedom, 1.0), (1 + CONFIDENCE) / 2))

    @property
    def interval(self) -> tuple[float, float]:
        """Low and high end of the interval of 95 %."""
        if self.draws is None:
            half = self.quantile * sqrt(self.variance)
            return self.value - half, self.value + half
        share = self.quantile**2 / self.draws
        middle = (self.value + share / 2) / (1 + share)
        half = sqrt(share * self.value * (1 - self.value) + share**2 / 4) / (1 + share)
        return middle - half, middle + half

    @property
    def half(self) -> float:
        """Half the width of the interval of 95 %."""
        return (self.interval[1] - self.interval[0]) / 2

    @property
    def correlation(self) -> float:
        """Multiple correlation of the exact with the cheap model [-]."""
        return sqrt(max(1 - self.residual / self.plain, 0.0)) if self.plain > 0 else 0.0


def mean_of(
    exact: Array, cheap: Array | None = None, population: float = inf, *, allowed: float = UNSEEN, share: bool = False
) -> Moment:
    """The mean of the exact model.

    exact: values at the first n draws, shape (n,). cheap: at the first m >= n draws, shape (m, k); None: without.
    population: number of draws that exist. allowed: draws that no run showed, with the largest deviation from the
    regression that was seen, which count in the variance, as in the intervals of Agresti and Coull (*The American
    Statistician* 52 (1998), 119-126). share: whether the values are 0 or 1; their deviation is one at most.
    """
    n, mean = len(exact), float(exact.mean())
    centred = np.zeros((n, 0)) if cheap is None else cheap[:n] - cheap[:n].mean(axis=0)
    varied = np.ptp(centred, axis=0) > 0
    own, k = centred[:, varied], int(varied.sum())
    slope = np.linalg.lstsq(own, exact - mean, rcond=None)[0]
    errors = exact - mean - own @ slope
    seen = float(errors @ errors) / max(n - 1 - k, 1)
    allowance = allowed / n * (1.0 if share else float(np.abs(errors).max())) ** 2
    residual, explained, shift = seen + allowance, 0.0, np.zeros(k)
    left = max(1 / n - 1 / population, 0.0)
    variance = residual * left
    if cheap is not None and k:
        m, every = len(cheap), cheap[:, varied]
        shift = every.mean(axis=0) - cheap[:n, varied].mean(axis=0)
        explained = float((every @ slope).var(ddof=1))
        variance += residual * float(shift @ np.linalg.pinv(own.T @ own, hermitian=True) @ shift)
        variance += explained * max(1 / m - 1 / population, 0.0)
    value, plain, draws = mean + float(slope @ shift), float(exact.var(ddof=1)), None
    if share:  # without controls the interval has its own allowance
        value = min(max(value, 0.0), 1.0)
        error = variance / plain if k and plain > 0 else left
        draws = 1 / error if error > 0 else inf
    return Moment(value, variance, n - 1 - k, residual, explained, plain, seen < allowance, draws)


def work(correlation: float, cost: float) -> float:
    """Time for a given variance, over the time of exact runs alone. cost: of a cheap run, over an exact one's [-]."""
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
