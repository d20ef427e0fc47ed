"""Covariance of fitted values from the Jacobian (Laplace), and what the tests cannot identify."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array

UNSEEN = 1e-6  # of the largest column: a parameter that changes the forces less is not seen
SINGULAR = 1e4  # condition of the Jacobian from which a combination is not identified; runs err by about 1e-4
PART = 0.3  # of a singular vector: a smaller component takes no part in the combination
ALIKE = 0.98  # correlation from which two parameters are named
UNCERTAIN = 0.5  # half width of an interval over the value from which the value is named
CORRELATED = 0.5  # correlation of consecutive residuals from which intervals are named as too narrow


class Spread(NamedTuple):
    """covariance: of the unknowns over their scales, infinite variance where not determined, shape (k, k).

    condition: of the Jacobian with columns of unit length. unidentified: lines.
    """

    covariance: Array
    condition: float
    unidentified: tuple[str, ...]


def spread_of(jacobian: Array, variance: float, names: Sequence[str]) -> Spread:
    """Covariance `variance (J'J)^-1` by the singular values of J, whose columns are scaled to unit length.

    Combinations with a singular value below 1e-4 of the largest are taken as not determined: their parameters are named
    and have an infinite variance.
    """
    lengths = np.linalg.norm(jacobian, axis=0)
    seen = lengths > UNSEEN * lengths.max()
    lines = [f"not seen by the tests: {name}" for name, at in zip(names, seen, strict=True) if not at]
    covariance = np.diag(np.where(seen, 0.0, np.inf))
    if not seen.any():
        return Spread(covariance, np.inf, tuple(lines))
    known = np.flatnonzero(seen)
    _, singular, vectors = np.linalg.svd(jacobian[:, known] / lengths[known], full_matrices=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 and seen.all() else np.inf
    clear = singular > singular[0] / SINGULAR
    inverse = (vectors[clear].T / singular[clear] ** 2) @ vectors[clear]
    inner = variance * inverse / np.outer(lengths[known], lengths[known])
    for vector in vectors[~clear]:
        part = np.abs(vector) > PART * np.abs(vector).max()
        group = [names[i] for i in known[part]]
        lines.append(f"cannot be told apart by these tests: {', '.join(group)}; fit fewer, or add another amplitude")
        inner[part, part] = np.inf
    covariance[np.ix_(known, known)] = inner
    return Spread(covariance, condition, tuple(lines))


def correlation_of(covariance: Array) -> Array:
    """Correlation matrix; NaN in the rows of a value that is not determined."""
    deviation = np.sqrt(np.diag(covariance))
    deviation = np.where(np.isfinite(deviation) & (deviation > 0), deviation, np.nan)
    with np.errstate(invalid="ignore"):
        found: Array = covariance / np.outer(deviation, deviation)
    return found


def weak(names: Sequence[str], values: Array, half: Array, correlation: Array) -> list[str]:
    """Lines that name values of wide intervals, and sets of which each is nearly one with another.

    half: half width of the interval of each value.
    """
    from scipy.sparse.csgraph import connected_components

    lines, (count, sets) = [], connected_components(np.abs(correlation) > ALIKE, directed=False)
    for group in (np.flatnonzero(sets == number) for number in range(count)):
        if len(group) > 1:
            largest = np.abs(np.triu(correlation[np.ix_(group, group)], 1)).max()
            members = " and ".join(names[int(i)] for i in group)
            lines.append(f"nearly one parameter to these tests: {members} (correlation up to {largest:.3f})")
    for name, value, width in zip(names, values, half, strict=True):
        if np.isfinite(width) and width > UNCERTAIN * abs(value):
            lines.append(f"hardly determined: {name}, 95 % interval of ±{100 * width / abs(value):.0f} %")
    return lines


def lag_one(residuals: Sequence[Array]) -> float:
    """Correlation of consecutive residuals, over all tests; 0 where there are none."""
    whole = sum(float(r @ r) for r in residuals)
    return sum(float(r[1:] @ r[:-1]) for r in residuals) / whole if whole else 0.0
