"""The search of a fit: where it may end, with residuals that are known functions."""

from __future__ import annotations

import numpy as np
import pytest
from support import Array

from msfp_gen.errors import RunError
from msfp_gen.studies.calibration.fit_result import least_squares
from msfp_gen.studies.calibration.residuals import Evaluation

NOISE = 1e-3 * np.random.default_rng(3).standard_normal(60)
SLOPE = np.linspace(-1.0, 1.0, 60)


class Line:
    """Residuals slope (x - 2) with noise; runs fail between two values."""

    def __init__(self, low: float = np.inf, high: float = np.inf) -> None:
        self.low, self.high = low, high

    def at(self, x: Array) -> Evaluation:
        if self.low < x[0] < self.high:
            return Evaluation(np.full(60, 10.0), np.zeros((60, 1)), failure=RunError("stopped", status="newton"))
        return Evaluation(SLOPE * (x[0] - 2.0) + NOISE, SLOPE[:, None])


@pytest.mark.parametrize(("low", "high"), [(1.0, 10.0), (1.2, 1.9)], ids=["all above the start", "a gap"])
def test_a_search_that_failed_runs_stop_is_not_converged(low: float, high: float) -> None:
    """The steps become shorter than the errors, and the minimum is not there."""
    with pytest.raises(RunError, match=r"ended beside values whose runs fail \(stopped\); give bounds"):
        least_squares(Line(low, high), np.array([1.0]), np.array([0.0]), np.array([5.0]), 100)  # type: ignore[arg-type]


def test_a_failed_run_on_the_way_does_not_matter() -> None:
    found, evaluation = least_squares(Line(2.5, 9.0), np.array([1.0]), np.array([0.0]), np.array([5.0]), 50)  # type: ignore[arg-type]
    assert found == pytest.approx([2.0], abs=1e-3)
    assert evaluation.failure is None


def test_a_step_of_no_length_is_within_the_errors_of_an_exact_fit() -> None:
    exact = Evaluation(np.zeros(60), SLOPE[:, None])
    assert exact.step_in_errors(np.zeros(1)) == 0.0
    assert exact.step_in_errors(np.ones(1)) == np.inf
