"""Intervals of fitted values from the Jacobian and the residuals, and the parameters that the tests do not identify.

The residuals of each test show its noise: a variance and an autocorrelation. Consecutive residuals are correlated where
the noise was filtered, or where the model misses part of a test. The noise of a test is taken as a stationary
autoregression. The covariance of the fitted values is then the covariance of ordinary least squares with correlated
errors (Seber and Wild 1989, chapter 6), in the autoregressive form of a heteroscedasticity and autocorrelation
consistent covariance (den Haan and Levin 1997).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from msfp_gen.common.arrays import Array

CORRECTIONS = 3  # of the sums over lags for the bias of residuals; the third changes the sums by percents
LEAST_SHARE = 1e-3  # least corrected sum of squares, over the measured sum
CONFIDENCE = 0.95
UNSEEN = 1e-6  # length of a column of the Jacobian, over the largest, below which its parameter is not seen
SINGULAR = 1e4  # condition above which a combination of parameters is not identified; runs err by about 1e-4
PART = 0.3  # component of a singular vector, over the largest, above which its parameter is in the combination
ALIKE = 0.98  # correlation above which two parameters are named
UNCERTAIN = 0.5  # half the width of an interval over the value, above which the value is named


class Noise(NamedTuple):
    """Stationary noise of one test.

    variance: of a weighted residual [-]. correlation: at lags of 0, 1, ... rows, shape (T,) [-]. freedom: effective
    number of rows, reduced by the unknowns that this test determines.
    """

    variance: float
    correlation: Array
    freedom: float

    def covariance_times(self, columns: Array) -> Array:
        """The covariance matrix of all rows times columns, shape (T, m) [unit of `columns`]."""
        from scipy.linalg import matmul_toeplitz

        return self.variance * np.asarray(matmul_toeplitz(self.correlation, columns))


def noise_of(residuals: Sequence[Array], bases: Sequence[Array]) -> list[Noise]:
    """The noise of each test, without the bias of residuals.

    The unknowns of a fit follow part of the noise, so that sums over lags of the residuals M e are too small. Their
    expectation under the noise of the previous estimate, from M Omega M, corrects the sums, three times.

    residuals: of each test, shape (T,) [-]. bases: rows of each test in an orthonormal basis of the Jacobian, shape
    (T, m).
    """
    orders = [max(int(min(10 * np.log10(len(r)), len(r) // 4)), 1) for r in residuals]
    measured = [_lag_sums(r[:, None], r[:, None])[: order + 1] for r, order in zip(residuals, orders, strict=True)]
    noises = [_noise(sums, basis) for sums, basis in zip(measured, bases, strict=True)]
    for _ in range(CORRECTIONS):
        spread = [noise.covariance_times(basis) for noise, basis in zip(noises, bases, strict=True)]
        inner = np.sum([basis.T @ columns for basis, columns in zip(bases, spread, strict=True)], axis=0)
        noises = [
            _noise(sums + _bias(basis, columns, inner)[: len(sums)], basis, LEAST_SHARE * sums[0])
            for sums, basis, columns in zip(measured, bases, spread, strict=True)
        ]
    return noises


def _noise(sums: Array, basis: Array, least: float = 0.0) -> Noise:
    """The noise of a test. sums: over lags. basis: its rows in the orthonormal basis of the Jacobian."""
    # Two autoregressions are compared: of order one, which is stable with few rows, and of the order by the
    # information criterion of Akaike, which sees slow parts below white noise. The noise has the fewer effective rows
    # of the two.
    rows = len(basis)
    if sums[0] <= 0:
        return Noise(least / rows, np.eye(1, rows)[0], 1.0)
    lags = sums / sums[0]
    first = np.clip(lags[1], 0.0, 0.999) ** np.arange(rows)
    taper = 2 * (1 - np.arange(rows) / rows)
    taper[0] = 1.0
    repeats, correlation = max(
        ((float(taper @ candidate), candidate) for candidate in (first, _by_akaike(lags, rows))), key=lambda p: p[0]
    )
    free_share = 1 - float(np.sum(basis**2)) / rows
    return Noise(max(float(sums[0]), least) / rows, correlation, max(rows / max(repeats, 1.0) * free_share, 1.0))


def _by_akaike(lags: Array, rows: int) -> Array:
    """Autocorrelation at all lags, shape (rows,) [-], of the autoregression with these first lags (Yule-Walker)."""
    # Of the stationary orders (Levinson and Durbin), its order has the least criterion of Akaike.
    weights = best = np.zeros(0)
    remainder, least = 1.0, 0.0
    for order in range(1, len(lags)):
        reflection = (lags[order] - weights @ lags[order - 1 : 0 : -1]) / remainder
        if abs(reflection) >= 1:
            break
        weights = np.r_[weights - reflection * weights[::-1], reflection]
        remainder *= 1 - reflection**2
        criterion = rows * np.log(remainder) + 2 * order
        if criterion < least:
            least, best = criterion, weights
    order = len(best)
    correlation = np.zeros(rows)
    correlation[: order + 1] = lags[: order + 1]
    for lag in range(order + 1, rows if order else 0):
        correlation[lag] = best @ correlation[lag - order : lag][::-1]
    return correlation


def _bias(basis: Array, spread: Array, inner: Array) -> Array:
    """Bias of the sums over lags of one test, shape (T,): sums of Omega - M Omega M with M = 1 - Q Q'."""
    # basis: Q. spread: Omega Q. inner: Q' Omega Q.
    return _lag_sums(basis, spread) + _lag_sums(spread, basis) - _lag_sums(basis @ inner, basis)


def _lag_sums(first: Array, second: Array) -> Array:
    """Sums over i and columns of first[i] second[i + lag] for every lag from 0, shape (T,)."""
    rows = len(first)
    product = np.conj(np.fft.rfft(first, 2 * rows, axis=0)) * np.fft.rfft(second, 2 * rows, axis=0)
    return np.fft.irfft(product.sum(axis=1), 2 * rows)[:rows]


class Identified(NamedTuple):
    """The combinations of unknowns that a Jacobian determines.

    basis: orthonormal changes of the residuals by these combinations, shape (N, m) [-]. factors: shape (k, m) [-]; the
    pseudo-inverse of the Jacobian is `factors @ basis.T`. undetermined: whether each unknown has no interval, (k,).
    condition: of the Jacobian with columns of unit length. lines: on unknowns that are not identified.
    """

    basis: Array
    factors: Array
    undetermined: NDArray[np.bool_]
    condition: float
    lines: tuple[str, ...]


class Spread(NamedTuple):
    """Errors of the unknowns over their scales.

    deviation: standard deviations, shape (k,) [-]. half: half the widths of the intervals, shape (k,) [-]. correlation:
    shape (k, k) [-]. Where an unknown is not determined, the first two are infinite, and its correlations NaN.
    """

    deviation: Array
    half: Array
    correlation: Array


def identified(jacobian: Array, names: Sequence[str]) -> Identified:
    """The combinations of unknowns that a Jacobian, shape (N, k), determines, by its singular values.

    The columns are scaled to unit length. Combinations with a singular value below 1e-4 of the largest are not
    determined: `lines` names their parameters, which have no interval. names: of the unknowns.
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
        members = known[np.abs(vector) > PART * np.abs(vector).max()]
        group = ", ".join(names[i] for i in members)
        lines.append(f"cannot be told apart by these tests: {group}; fit fewer, or add another amplitude")
        undetermined[members] = True
    return Identified(basis[:, clear], factors, undetermined, condition, tuple(lines))


def spread_of(known: Identified, noises: Sequence[Noise]) -> Spread:
    """Errors of least-squares values under the noise of each test; the basis has the rows of the tests in turn.

    With the pseudo-inverse P the covariance is the sum of P_t Omega_t P_t' over tests t. The degrees of freedom of
    Student's t for such a sum follow Welch and Satterthwaite.
    """
    from scipy.stats import t

    bases = np.split(known.basis, np.cumsum([len(noise.correlation) for noise in noises])[:-1])
    inner = [basis.T @ noise.covariance_times(basis) for basis, noise in zip(bases, noises, strict=True)]
    of_tests = np.array([known.factors @ matrix @ known.factors.T for matrix in inner])
    covariance, variances = of_tests.sum(axis=0), np.einsum("tkk->tk", of_tests)
    covariance[known.undetermined, known.undetermined] = np.inf
    deviation = np.sqrt(np.diag(covariance))
    freedom = np.ones(len(deviation))
    determined = np.isfinite(deviation) & (deviation > 0)
    squares = variances[:, determined] ** 2 / np.array([[noise.freedom] for noise in noises])
    freedom[determined] = np.maximum(deviation[determined] ** 4 / squares.sum(axis=0), 1.0)
    divisor = np.where(determined, deviation, np.nan)
    with np.errstate(invalid="ignore"):
        correlation = covariance / np.outer(divisor, divisor)
    return Spread(deviation, t.ppf(0.5 + CONFIDENCE / 2, freedom) * deviation, correlation)


def weak(names: Sequence[str], values: Array, half: Array, correlation: Array) -> list[str]:
    """Lines that name strongly correlated parameters, and parameters with a wide interval.

    values, half: of each parameter, and half the width of its interval, shape (k,) [its unit]. correlation: (k, k).
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
    """Correlation of consecutive residuals over all tests [-]; 0 where all residuals are 0."""
    squares = sum(float(r @ r) for r in residuals)
    return sum(float(r[1:] @ r[:-1]) for r in residuals) / squares if squares else 0.0
