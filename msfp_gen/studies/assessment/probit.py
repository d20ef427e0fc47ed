"""Maximum likelihood fit of P = Phi(a + b ln x) to numbers of exceedances: a concave problem with one solution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError

ITERATIONS = 100
CONVERGED = 1e-10  # of the Newton decrement


@dataclass(frozen=True)
class Fit:
    """A fitted curve.

    coefficients: a and b, ndarray, shape (2,). covariance: the inverse of their Fisher information, shape (2, 2).
    """

    coefficients: Array
    covariance: Array

    @property
    def median(self) -> float:
        """exp(-a/b): where the probability is one half."""
        return float(np.exp(-self.coefficients[0] / self.coefficients[1]))

    @property
    def dispersion(self) -> float:
        """1/b."""
        return float(1 / self.coefficients[1])

    def errors(self) -> tuple[float, float]:
        """Standard errors of the logarithms of median and dispersion, to first order."""
        a, b = self.coefficients
        of_median, of_dispersion = np.array([-1 / b, a / b**2]), np.array([0.0, -1 / b])
        found = [float(np.sqrt(slope @ self.covariance @ slope)) for slope in (of_median, of_dispersion)]
        return found[0], found[1]

    def probability(self, log_x: Array) -> Array:
        """Phi(a + b ln x)."""
        from scipy.special import ndtr

        return np.asarray(ndtr(self.coefficients[0] + self.coefficients[1] * log_x))

    def band(self, log_x: Array, level: float) -> tuple[Array, Array]:
        """Pointwise confidence bounds of the probability, from those of a + b ln x."""
        from scipy.special import ndtr, ndtri

        rows = np.stack([np.ones_like(log_x), log_x], axis=-1)
        centre = rows @ self.coefficients
        error = np.sqrt(np.einsum("...i,ij,...j->...", rows, self.covariance, rows))
        z = ndtri((1 + level) / 2)
        return np.asarray(ndtr(centre - z * error)), np.asarray(ndtr(centre + z * error))


def fitted(log_x: Array, runs: Array, over: Array, where: str, start: Fit | None = None) -> Fit:
    """The fit to `over` exceedances of `runs` at each ln x, all ndarrays, shape (levels,).

    Raises InputError that begins with `where`: runs that determine no curve with a positive slope.
    """
    used = runs > 0
    log_x, runs, over = log_x[used], np.asarray(runs[used], dtype=float), np.asarray(over[used], dtype=float)
    _check(log_x, runs, over, where)
    middle, width = float(np.average(log_x, weights=runs)), float(np.ptp(log_x))
    scaled = (log_x - middle) / width  # between -1 and 1, for the conditioning of the normal equations
    given = np.array([0.0, 1.0]) if start is None else _scaled(start.coefficients, middle, width)
    rows = np.stack([np.ones_like(scaled), scaled], axis=-1)
    found, information = _newton(rows, runs, over, given, where)
    back = np.array([[1.0, -middle / width], [0.0, 1 / width]])
    coefficients = back @ found
    if not coefficients[1] > 0:
        raise InputError(f"{where}: exceedances do not grow with the intensity; there is no fragility curve")
    return Fit(coefficients, back @ np.linalg.inv(information) @ back.T)


def _scaled(coefficients: Array, middle: float, width: float) -> Array:
    a, b = coefficients
    return np.array([a + b * middle, b * width])


def _check(log_x: Array, runs: Array, over: Array, where: str) -> None:
    total, exceeded = int(runs.sum()), int(over.sum())
    if exceeded in (0, total):
        word = "none" if exceeded == 0 else "all"
        raise InputError(f"{where}: {word} of {total} runs exceed it; give another threshold or other intensities")
    least_over, most_below = log_x[over > 0].min(), log_x[over < runs].max()
    if least_over >= most_below:
        raise InputError(
            f"{where}: no run below {np.exp(least_over):.4g} exceeds it and every run above {np.exp(most_below):.4g} "
            "does, so that the dispersion is not determined; give intensities between, or more records or samples"
        )
    if log_x[over > 0].max() <= log_x[over < runs].min():
        raise InputError(f"{where}: exceedances do not grow with the intensity; there is no fragility curve")


def _newton(rows: Array, runs: Array, over: Array, start: Array, where: str) -> tuple[Array, Array]:
    """Fisher scoring with steps that are halved until the likelihood grows; returns solution and information."""
    from scipy.special import log_ndtr

    def likelihood(x: Array) -> float:
        eta = rows @ x
        return float(over @ log_ndtr(eta) + (runs - over) @ log_ndtr(-eta))

    x, value = start, likelihood(start)
    for _ in range(ITERATIONS):
        eta = rows @ x
        log_density = -0.5 * (eta**2 + np.log(2 * np.pi))
        ratio, rest = np.exp(log_density - log_ndtr(eta)), np.exp(log_density - log_ndtr(-eta))
        gradient = rows.T @ (over * ratio - (runs - over) * rest)
        information = (rows * (runs * ratio * rest)[:, None]).T @ rows
        step = np.linalg.solve(information, gradient)
        if gradient @ step < CONVERGED:
            return x, information
        size = 1.0
        while not likelihood(x + size * step) > value and size > 1e-12:
            size /= 2
        if size <= 1e-12:  # no growth that roundoff can show
            return x, information
        x = x + size * step
        value = likelihood(x)
    raise InputError(f"{where}: the likelihood has no maximum that could be found; give more runs near the threshold")
