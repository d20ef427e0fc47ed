"""How many runs each model gets: the closed form of multi-fidelity Monte Carlo.

Peherstorfer, Willcox and Gunzburger, "Optimal model management for multifidelity Monte Carlo estimation", *SIAM Journal
on Scientific Computing* 38 (2016), A3163-A3194. Models are ordered from the exact one by falling correlation with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from msfp_gen.common.arrays import Array

EXACT = "exact"


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


def factor_for(weights: Array, wanted: float, least: float = 0.0) -> float:
    """The factor with which chances in proportion to weights choose as many draws as wanted on average.

    Chances are at most 1. least: what is added to each of them.
    """
    from scipy.optimize import brentq

    if wanted <= least * len(weights) or not len(weights):
        return 0.0
    most = float(1 / weights.min())
    if wanted >= len(weights):
        return most

    def chosen(factor: float) -> float:
        return float(np.minimum(factor * weights + least, 1.0).sum())

    return float(brentq(lambda factor: chosen(factor) - wanted, 0.0, most, xtol=1e-12 * most))


def best_chain(correlations: Mapping[str, float], costs: Mapping[str, float]) -> Chain:
    """The models whose use together is cheapest: all subsets are compared by the closed form.

    correlations: model -> that with the exact one. costs: model -> seconds of a run, the exact one's included.
    """
    cheaper = sorted((name for name in correlations if name != EXACT), key=lambda name: -abs(correlations[name]))
    best = Chain((EXACT,), 1.0)
    for count in range(1, len(cheaper) + 1):
        for chosen in combinations(cheaper, count):
            models = (EXACT, *chosen)
            work = _work(models, correlations, costs)
            if work is not None and work < best.work:
                best = Chain(models, work)
    return best


def _work(models: Sequence[str], correlations: Mapping[str, float], costs: Mapping[str, float]) -> float | None:
    """The work of a chain; None where its optimal numbers of runs do not rise along it."""
    shares = shares_of_variance(np.array([1.0, *(abs(correlations[name]) for name in models[1:])]))
    paid = np.array([costs[name] for name in models])
    ratios = shares / paid
    if not (shares >= 0).all() or not (ratios[1:] > ratios[:-1]).all():
        return None
    return work_of(shares, paid)
