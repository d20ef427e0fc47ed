"""Nonlinear least squares, at tolerances at which the error of the runs is small against the intervals."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError, RunError
from msfp_gen.studies.calibration.intervals import Identified, Spread, identified, noise_of, spread_of
from msfp_gen.studies.calibration.residuals import Evaluation, Residuals

TOLERANCE = 1e-5  # relative change of cost and values at which the search ends; errors of runs hide smaller ones
WITHIN = 0.1  # standard errors: the next step that ends the search (Bates and Watts 1981)
FIRST, NEXT = 100.0, 10.0  # by which the tolerance is divided, first and later; see docs/fit.md
LEAST = 1e-7  # tolerance beyond which a second division does not go
REST = 0.5  # of what the last division changed: the most that is left, in random fits
SMALL = 0.1  # of the half width of an interval: error of the runs that is small
STEPS = 3  # at one tolerance, with the Jacobian of the search
AT_BOUND = 1e-3  # of the range: distance from a bound within which a value is at it


@dataclass(frozen=True, eq=False)
class Solution:
    """Unknowns x over their scales, shape (k,), and what is known of their errors.

    end: the evaluation at x. known: what its Jacobian tells. spread: under the noise of the tests. at_bound: which are
    at a bound. rtol: of the runs. run_error: of x, from the errors of the runs, shape (k,); infinite where it could not
    be measured. failure: why runs at the next tolerance failed.
    """

    x: Array
    end: Evaluation
    known: Identified
    spread: Spread
    at_bound: NDArray[np.bool_]
    rtol: float
    run_error: Array
    failure: RunError | InputError | None = None

    @property
    def half(self) -> Array:
        """Half widths of the intervals, which contain the error of the runs, shape (k,)."""
        return self.spread.half + self.run_error


def solve(residuals: Residuals, start: Array, low: Array, high: Array, most: int) -> Solution:
    """The unknowns between two bounds for which the sum of squares is least.

    After the search runs are tighter: by a factor of 100, then by 10 until their error is below a tenth of the half
    width of each interval, or the next tolerance would be below 1e-7. The Jacobian stays that of the search (simplified
    Newton steps): the change of the values under it measures the error of the runs, of which half is taken as left.

    most: evaluations of the search. Raises RunError as `least_squares`; where tighter runs fail, the solution is that
    of the runs before.
    """
    x, end = least_squares(residuals, start, low, high, most)
    solution, factor = _solution(residuals, x, end, low, high), FIRST
    while True:
        residuals.tighten(factor)
        first = residuals.evaluate(solution.x, solution.end.jacobian)
        if first.failure is not None:
            return replace(solution, failure=first.failure)
        free, factor = ~solution.at_bound, NEXT
        remainder = REST * np.abs(first.step(free) - solution.end.step(free))
        x, end = _steps(residuals, solution.x, first, free, low, high)
        solution = _solution(residuals, x, end, low, high)
        # A step that is left is an error too, which smaller tolerances do not mend: derivatives contain ringing.
        solution = replace(solution, run_error=remainder + np.abs(end.step(~solution.at_bound)))
        small = (remainder <= SMALL * solution.spread.half) | solution.at_bound
        if small.all() or solution.rtol / NEXT < LEAST * (1 - 1e-9):
            return solution


def _steps(
    residuals: Residuals, x: Array, at: Evaluation, free: NDArray[np.bool_], low: Array, high: Array
) -> tuple[Array, Evaluation]:
    """Steps with the Jacobian of an evaluation at x until one is within the errors, or the next is no better."""
    for _ in range(STEPS):
        step = np.clip(x + at.step(free), low, high) - x
        if at.step_in_errors(step) < WITHIN:
            break
        trial = residuals.evaluate(x + step, at.jacobian)
        if trial.failure is not None or trial.square >= at.square:
            break
        x, at = x + step, trial
    return x, at


def _solution(residuals: Residuals, x: Array, end: Evaluation, low: Array, high: Array) -> Solution:
    """What an evaluation tells of the errors of x, where that of its runs is not measured."""
    known = identified(end.jacobian, residuals.names)
    noises = noise_of(residuals.split(end.residuals), residuals.split(known.basis))
    at_bound, unmeasured = _at_bound(x, end, low, high), np.full(len(x), np.inf)
    return Solution(x, end, known, spread_of(known, noises), at_bound, residuals.rtol, unmeasured)


def _at_bound(x: Array, end: Evaluation, low: Array, high: Array) -> NDArray[np.bool_]:
    """Which unknowns are at a bound, or have their minimum beyond it."""
    near = np.isfinite(low) & (np.minimum(x - low, high - x) < AT_BOUND * (high - low))
    beyond = x + end.step(~near)
    at_bound: NDArray[np.bool_] = near | (beyond < low) | (beyond > high)
    return at_bound


class _WithinError(Exception):
    """Ends the search: the next step is within the errors of the values."""


def least_squares(residuals: Residuals, start: Array, low: Array, high: Array, most: int) -> tuple[Array, Evaluation]:
    """The unknowns between two bounds for which the sum of squares is least, and the evaluation there.

    The search also ends where the next step is shorter than a tenth of the standard errors: the noise of the tests
    makes smaller ones meaningless, and the error of runs, which varies irregularly with the values, hides them.

    most: number of evaluations. Raises RunError where the start fails, the search has not ended by then, or it ends
    beside values whose runs fail.
    """
    from scipy.optimize import least_squares as search

    best, at_best, begun = start, residuals.at(start), False
    failure: RunError | InputError | None = None  # of the last trial
    if at_best.failure is not None:
        raise at_best.failure

    def values(x: Array) -> Array:
        nonlocal best, at_best, failure
        # After a failed run the next step is short because the search was thrown back, not because it ends.
        if begun and failure is None and not np.array_equal(x, best) and at_best.step_in_errors(x - best) < WITHIN:
            raise _WithinError
        at = residuals.at(x)
        failure = at.failure
        if failure is None and at.square < at_best.square:
            best, at_best = x.copy(), at
        return at.residuals

    def jacobian(x: Array) -> Array:
        nonlocal begun
        begun = True  # before, x differs from the start where that is nearly at a bound
        return (at_best if np.array_equal(x, best) else residuals.at(x)).jacobian

    limits = {"ftol": TOLERANCE, "xtol": TOLERANCE, "gtol": None, "max_nfev": most}
    try:
        ended = search(values, start, jacobian, bounds=(low, high), **limits)
    except _WithinError:
        return best, at_best
    if ended.status == 0:
        raise RunError(
            f"fit: not converged after {most} evaluations; give tighter bounds, fewer parameters, or more evaluations",
            status="fit",
        )
    free = (best > low) & (best < high)
    if failure is not None and at_best.step_in_errors(at_best.step(free)) > 1.0:
        raise RunError(
            f"fit: the search ended beside values whose runs fail ({failure}); give bounds without them, or "
            "other values to start from",
            status="fit",
        )
    return best, at_best
