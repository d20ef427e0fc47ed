"""Search of the least squares by `scipy.optimize.least_squares`, which ends where a step is within the errors."""

from __future__ import annotations

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError, RunError
from msfp_gen.studies.calibration.residuals import Evaluation, Residuals

TOLERANCE = 1e-5  # relative change of cost and values at which the search ends; errors of runs hide smaller ones
WITHIN = 0.1  # standard errors: the next step that ends the search (Bates and Watts 1981)


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

    best, found, begun = start, residuals.at(start), False
    failure: RunError | InputError | None = None  # of the last trial
    if found.failure is not None:
        raise found.failure

    def values(x: Array) -> Array:
        nonlocal best, found, failure
        # After a failed run the next step is short because the search was thrown back, not because it ends.
        if begun and failure is None and not np.array_equal(x, best) and found.step_in_errors(x - best) < WITHIN:
            raise _WithinError
        at = residuals.at(x)
        failure = at.failure
        if failure is None and at.square < found.square:
            best, found = x.copy(), at
        return at.residuals

    def jacobian(x: Array) -> Array:
        nonlocal begun
        begun = True  # before, x differs from the start where that is nearly at a bound
        return (found if np.array_equal(x, best) else residuals.at(x)).jacobian

    limits = {"ftol": TOLERANCE, "xtol": TOLERANCE, "gtol": None, "max_nfev": most}
    try:
        ended = search(values, start, jacobian, bounds=(low, high), **limits)
    except _WithinError:
        return best, found
    if ended.status == 0:
        raise RunError(
            f"fit: not converged after {most} evaluations; give tighter bounds, fewer parameters, or more evaluations",
            status="fit",
        )
    free = (best > low) & (best < high)
    if failure is not None and found.step_in_errors(found.step(free)) > 1.0:
        raise RunError(
            f"fit: the search ended beside values whose runs fail ({failure}); give bounds without them, or "
            "other values to start from",
            status="fit",
        )
    return best, found
