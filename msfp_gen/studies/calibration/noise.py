"""Noise of the tests as the residuals of a fit show it: of each test a variance and an autocorrelation.

Consecutive residuals are correlated where the noise was filtered, or where the model misses part of a test. Each test
is a stationary process of its own (an autoregression), so that the covariance of the fitted values is that of ordinary
least squares with correlated errors (Seber and Wild 1989, chapter 6), the autoregressive form of a heteroscedasticity
and autocorrelation consistent covariance (den Haan and Levin 1997).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array

CORRECTIONS = 3  # of the sums over lags for what the fit took out of the residuals; the third changes them by percents
LEAST_SHARE = 1e-3  # of a measured sum of squares, below which no correction lowers it


class Noise(NamedTuple):
    """Stationary noise of one test.

    variance: of a weighted residual. correlation: at lags of 0, 1, ... rows, shape (T,). freedom: effective number of
    rows, less the share of the unknowns that this test determines.
    """

    variance: float
    correlation: Array
    freedom: float

    def covariance_times(self, columns: Array) -> Array:
        """The covariance matrix of all rows times columns, shape (T, m)."""
        from scipy.linalg import matmul_toeplitz

        return self.variance * np.asarray(matmul_toeplitz(self.correlation, columns))


def noise_of(residuals: Sequence[Array], bases: Sequence[Array]) -> list[Noise]:
    """The noise of each test, without the bias of residuals.

    A fit takes out of the noise what its unknowns can follow: sums over lags of the residuals M e are too small. Their
    expectation under the noise as estimated before, from M Omega M, corrects them, in three turns.

    residuals: of each test, shape (T,). bases: rows of each test of an orthonormal basis of the Jacobian, shape (T, m).
    """
    orders = [max(int(min(10 * np.log10(len(r)), len(r) // 4)), 1) for r in residuals]
    measured = [_lag_sums(r[:, None], r[:, None])[: order + 1] for r, order in zip(residuals, orders, strict=True)]
    noises = [_noise(sums, basis) for sums, basis in zip(measured, bases, strict=True)]
    for _ in range(CORRECTIONS):
        spread = [noise.covariance_times(basis) for noise, basis in zip(noises, bases, strict=True)]
        inner = np.sum([basis.T @ columns for basis, columns in zip(bases, spread, strict=True)], axis=0)
        noises = [
            _noise(sums + _taken(basis, columns, inner)[: len(sums)], basis, LEAST_SHARE * sums[0])
            for sums, basis, columns in zip(measured, bases, spread, strict=True)
        ]
    return noises


def _noise(sums: Array, basis: Array, least: float = 0.0) -> Noise:
    """The noise of a test with these sums over lags; basis: its rows of the orthonormal basis of the Jacobian.

    Of an autoregression of order one, and of the order by the information criterion of Akaike, it is the one with the
    fewer effective rows: the first is stable with few rows, the second sees slow parts below white noise.
    """
    rows = len(basis)
    if sums[0] <= 0:
        return Noise(least / rows, np.eye(1, rows)[0], 1.0)
    lags = sums / sums[0]
    first = np.clip(lags[1], 0.0, 0.999) ** np.arange(rows)
    taper = 2 * (1 - np.arange(rows) / rows)
    taper[0] = 1.0
    repeats, correlation = max(
        ((float(taper @ each), each) for each in (first, _by_akaike(lags, rows))), key=lambda p: p[0]
    )
    own = 1 - float(np.sum(basis**2)) / rows
    return Noise(max(float(sums[0]), least) / rows, correlation, max(rows / max(repeats, 1.0) * own, 1.0))


def _by_akaike(lags: Array, rows: int) -> Array:
    """Autocorrelation at all lags, shape (rows,), of the autoregression that these first lags give (Yule-Walker).

    Its order has the least criterion of Akaike among those that are stationary (Levinson and Durbin).
    """
    weights = chosen = np.zeros(0)
    remainder, least = 1.0, 0.0
    for order in range(1, len(lags)):
        reflection = (lags[order] - weights @ lags[order - 1 : 0 : -1]) / remainder
        if abs(reflection) >= 1:
            break
        weights = np.r_[weights - reflection * weights[::-1], reflection]
        remainder *= 1 - reflection**2
        criterion = rows * np.log(remainder) + 2 * order
        if criterion < least:
            least, chosen = criterion, weights
    order = len(chosen)
    found = np.zeros(rows)
    found[: order + 1] = lags[: order + 1]
    for lag in range(order + 1, rows if order else 0):
        found[lag] = chosen @ found[lag - order : lag][::-1]
    return found


def _taken(basis: Array, spread: Array, inner: Array) -> Array:
    """Sums over lags of Omega - M Omega M in one test, with M = 1 - Q Q', spread = Omega Q and inner = Q' Omega Q."""
    return _lag_sums(basis, spread) + _lag_sums(spread, basis) - _lag_sums(basis @ inner, basis)


def _lag_sums(first: Array, second: Array) -> Array:
    """Sums over i and columns of first[i] second[i + lag] for every lag from 0, shape (T,)."""
    rows = len(first)
    product = np.conj(np.fft.rfft(first, 2 * rows, axis=0)) * np.fft.rfft(second, 2 * rows, axis=0)
    sums: Array = np.fft.irfft(product.sum(axis=1), 2 * rows)[:rows]
    return sums
