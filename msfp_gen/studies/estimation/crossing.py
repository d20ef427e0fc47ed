"""The intensity at which the quantity of a draw reaches a threshold: the next run goes where it decides most.

The runs of a draw are at the scales of the study. They close in on the two neighbours between which the threshold lies,
and power laws between neighbours give the crossing (Vamvatsikos and Cornell, 2002, trace and fill an IDA curve alike).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array

if TYPE_CHECKING:
    from msfp_gen.studies.estimation.estimators import Indices
    from msfp_gen.studies.estimation.source import Source


@dataclass(frozen=True)
class Crossings:
    """Logarithms of scales at which draws reach a threshold, shape (k,) [-], and how many are beyond the study.

    runs: that the draws took, all together.
    """

    logarithms: Array
    beyond: int
    runs: int


def crossings(source: Source, level: str, draws: Indices, scales: Array, threshold: float, guess: Array) -> Crossings:
    """Find where draws reach a threshold.

    scales: rising. guess: of the logarithm of the scale of each crossing, with which the search begins.
    """
    count, most = len(draws), len(scales)
    low, high = np.full(count, -1), np.full(count, most)  # neighbours: below, and at or above the threshold
    values = np.full((count, most), np.nan)
    following = np.searchsorted(np.log(scales), guess).clip(0, most - 1)
    runs = 0
    while (open_ := np.flatnonzero(high - low > 1)).size:
        at = following[open_]
        reached, early = source.values(level, draws[open_], at)
        values[open_, at] = np.where(early & (reached < threshold), np.inf, reached)
        runs += len(open_)
        over = values[open_, at] >= threshold
        high[open_] = np.where(over, np.minimum(at, high[open_]), high[open_])
        low[open_] = np.where(over, low[open_], np.maximum(at, low[open_]))
        following = _following(low, high, following, most)
    logs = np.array(
        [_crossing(np.log(scales), row, lo, hi, threshold) for row, lo, hi in zip(values, low, high, strict=True)]
    )
    return Crossings(logs, int(((low < 0) | (high >= most)).sum()), runs)


def _following(low: Indices, high: Indices, last: Indices, most: int) -> Indices:
    """The scale to run next: a neighbour of the last one as long as one side is not known, else the middle."""
    step = np.where(last == low, low + 1, high - 1)
    middle = (low + high) // 2
    known = (low >= 0) & (high < most)
    return np.where(known, middle, step).clip(0, most - 1)


def _crossing(logs: Array, values: Array, low: int, high: int, threshold: float) -> float:
    """The crossing between two neighbours, by a power law; beyond the scales half a step from the last one."""
    if low < 0:
        return float(logs[0] - (logs[1] - logs[0]) / 2)
    if high >= len(logs):
        return float(logs[-1] + (logs[-1] - logs[-2]) / 2)
    below, above = values[low], values[high]
    if not np.isfinite(above) or not 0 < below < above:
        return float((logs[low] + logs[high]) / 2)
    share = np.log(threshold / below) / np.log(above / below)
    return float(logs[low] + share * (logs[high] - logs[low]))
