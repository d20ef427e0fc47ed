"""Intervals of fitted values from the Jacobian and the noise of the tests, and what the tests cannot identify."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from msfp_gen.common.arrays import Array
from msfp_gen.studies.calibration.noise import Noise

CONFIDENCE = 0.95
UNSEEN = 1e-6  # of the largest column: a parameter that changes the forces less is not seen
SINGULAR = 1e4  # condition of the Jacobian from which a combination is not identified; runs err by about 1e-4
PART = 0.3  # of a singular vector: a smaller component takes no part in the combination
ALIKE = 0.98  # correlation from which two parameters are named
UNCERTAIN = 0.5  # half width of an interval over the value from which the value is named


class Identified(NamedTuple):
    """What a Jacobian J tells of the unknowns.

    basis: orthonormal, of the combinations that change the residuals, shape (N, m). factors: of the pseudo-inverse,
    which is `factors @ basis.T`, shape (k, m). undetermined: unknowns without an interval, shape (k,). condition: of
    the Jacobian with columns of unit length. lines: on what is not identified.
    """

    basis: Array
    factors: Array
    undetermined: NDArray[np.bool_]
    condition: float
    lines: tuple[str, ...]


class Spread(NamedTuple):
    """Of the unknowns over their scales, infinite where they are not determined.

    deviation: standard deviations, shape (k,). half: half widths of the intervals, shape (k,). correlation: shape
    (k, k), NaN in the rows of a value that is not determined.
    """

    deviation: Array
    half: Array
    correlation: Array


def identified(jacobian: Array, names: Sequence[str]) -> Identified:
    """What the Jacobian, shape (N, k), tells of the unknowns, by its singular values with columns of unit length.

    Combinations with a singular value below 1e-4 of the largest are taken as not determined: their parameters are named
    and have no interval.
    """
    lengths = np.linalg.norm(jacobian, axis=0)
    seen = lengths > UNSEEN * lengths.max()
    lines = [f"not seen by the tests: {name}" for name, at in zip(names, seen, strict=True) if not at]
    undetermined, known = ~seen, np.flatnonzero(seen)
    if not seen.any():
        return Identified(jacobian[:, :0], np.zeros((len(seen), 0)), undetermined, np.inf, tuple(lines))
    basis, singular, vectors = np.linalg.svd(jacobian[:, known] / lengths[known], full_matrices=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 and seen.all() else np.inf
    clear = singular > singular[0] / SINGULAR
    factors = np.zeros((len(seen), int(clear.sum())))
    factors[known] = vectors[clear].T / singular[clear] / lengths[known][:, None]
    for vector in vectors[~clear]:
        part = known[np.abs(vector) > PART * np.abs(vector).max()]
        group = ", ".join(names[i] for i in part)
        lines.append(f"cannot be told apart by these tests: {group}; fit fewer, or add another amplitude")
        undetermined[part] = True
    return Identified(basis[:, clear], factors, undetermined, condition, tuple(lines))


def spread_of(known: Identified, noises: Sequence[Noise]) -> Spread:
    """Spread of least-squares values under the noise of each test; rows of the basis are those of the tests in turn.

    With P the pseudo-inverse the covariance is the sum of P_t Omega_t P_t' over tests t, and the degrees of freedom of
    Student's t are those of Welch and Satterthwaite for such a sum.
    """
    from scipy.stats import t

    bases = _split(known.basis, noises)
    inner = [basis.T @ noise.covariance_times(basis) for basis, noise in zip(bases, noises, strict=True)]
    parts = np.array([known.factors @ each @ known.factors.T for each in inner])
    covariance, variances = parts.sum(axis=0), np.einsum("tkk->tk", parts)
    covariance[known.undetermined, known.undetermined] = np.inf
    deviation = np.sqrt(np.diag(covariance))
    freedom = np.ones(len(deviation))
    some = np.isfinite(deviation) & (deviation > 0)
    each = variances[:, some] ** 2 / np.array([[noise.freedom] for noise in noises])
    freedom[some] = np.maximum(deviation[some] ** 4 / each.sum(axis=0), 1.0)
    return Spread(deviation, t.ppf(0.5 + CONFIDENCE / 2, freedom) * deviation, _correlation(covariance))


def _split(rows: Array, noises: Sequence[Noise]) -> list[Array]:
    """Rows of all tests as those of each."""
    return np.split(rows, np.cumsum([len(noise.correlation) for noise in noises])[:-1])


def _correlation(covariance: Array) -> Array:
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
