"""A fit of known residuals: where its search may end, intervals under noise, tighter runs until errors are small."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from support import Array

from msfp_gen.common.errors import RunError
from msfp_gen.studies.calibration.fitting import LEAST, SMALL, Solution, least_squares, solve
from msfp_gen.studies.calibration.intervals import identified, lag_one, noise_of, spread_of
from msfp_gen.studies.calibration.residuals import EvaluatedResiduals

ROWS = 60
TIMES = np.linspace(0, 1, ROWS)
# Three tests; the last two columns are slow, as the effect of a friction coefficient in a cycle.
BLOCKS = [np.column_stack([np.ones(ROWS), np.sign(np.cos(6.3 * TIMES)), a * np.sin(6.3 * TIMES)]) for a in (1, 2, 4)]


def process(correlation: float, rng: np.random.Generator) -> Array:
    """Unit noise of one test: an autoregression of order one."""
    values = rng.standard_normal(ROWS)
    for i in range(1, ROWS):
        values[i] = correlation * values[i - 1] + np.sqrt(1 - correlation**2) * values[i]
    return values


@pytest.mark.parametrize(
    ("correlations", "sizes"),
    [
        ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),
        pytest.param((0.0, 0.0, 0.0), (1.0, 2.0, 4.0), marks=pytest.mark.slow),
        pytest.param((0.57, 0.57, 0.57), (1.0, 1.0, 1.0), marks=pytest.mark.slow),
        ((0.0, 0.57, 0.0), (1.0, 3.0, 1.0)),
    ],
    ids=["white", "noise by test", "correlated", "correlated in one test"],
)
def test_intervals_of_linear_fits_contain_the_truth(correlations: tuple[float, ...], sizes: tuple[float, ...]) -> None:
    """Of 100 fits; intervals of independent noise of one size contain it in 70 % where it is correlated."""
    jacobian, rng, hits = np.vstack(BLOCKS), np.random.default_rng(0), []
    known = identified(jacobian, "abc")
    bases, inverse = np.split(known.basis, 3), np.linalg.pinv(jacobian)
    for _ in range(100):
        errors = np.concatenate([s * process(c, rng) for c, s in zip(correlations, sizes, strict=True)])
        moved = inverse @ errors
        spread = spread_of(known, noise_of(np.split(errors - jacobian @ moved, 3), bases))
        hits.append(np.abs(moved) <= spread.half)
    assert 0.90 <= np.mean(hits) <= 0.99
    assert np.mean(hits, axis=0).min() >= 0.88


def test_the_noise_of_a_test_is_estimated_without_the_bias_of_its_residuals() -> None:
    """Mean of 150 sets of one test, of which the fit takes a large part: residuals are smaller and less correlated."""
    rng, basis = np.random.default_rng(1), identified(BLOCKS[0], "abc").basis
    corrected, raw, freedom = [], [], []
    for _ in range(150):
        errors = process(0.57, rng)
        residuals = errors - basis @ (basis.T @ errors)
        noise = noise_of([residuals], [basis])[0]
        corrected.append((noise.variance, noise.correlation[1]))
        raw.append((residuals @ residuals / ROWS, lag_one([residuals])))
        freedom.append(noise.freedom)
    bias = np.abs(np.mean(raw, axis=0) - [1.0, 0.57])
    assert (bias > 0.1).all() and (np.abs(np.mean(corrected, axis=0) - [1.0, 0.57]) < 0.5 * bias).all()
    assert np.mean(freedom) < ROWS / 2


def test_exact_tests_have_no_noise() -> None:
    noise = noise_of([np.zeros(ROWS)], [BLOCKS[0][:, :0]])[0]
    assert noise.variance == 0 and noise.correlation[0] == 1


SLOPE = np.column_stack([np.linspace(-1.0, 1.0, ROWS), np.ones(ROWS)])
TRUE = np.array([2.0, 0.5])


@dataclass
class Runs:
    """Residuals of a line with noise; runs have an error that falls with the fourth root of their tolerance.

    error: of the first value at rtol = 1e-4, in standard errors. slip: relative error of the Jacobian, as of forward
    differences. fails: tolerance below which runs fail.
    """

    noise: float
    error: float
    rtol: float = 1e-4
    slip: float = 0.0
    fails: float = 0.0
    count: int = 0

    @property
    def deviation(self) -> float:
        """Standard error of the first value."""
        return float(self.noise / np.linalg.norm(SLOPE[:, 0]))

    names = ("a", "b")

    def tighten(self, factor: float) -> None:
        self.rtol /= factor

    def split(self, rows: Array) -> list[Array]:
        return [rows]

    def at(self, x: Array) -> EvaluatedResiduals:
        return self.evaluate(x)

    def evaluate(self, x: Array, jacobian: Array | None = None) -> EvaluatedResiduals:
        self.count += 1
        if self.rtol < self.fails:
            return EvaluatedResiduals(np.full(ROWS, 10.0), np.zeros_like(SLOPE), (), RunError("no", status="newton"))
        wrong = self.error * self.deviation * (self.rtol / 1e-4) ** 0.25
        noise = self.noise * np.random.default_rng(5).standard_normal(ROWS)
        noise -= SLOPE @ np.linalg.lstsq(SLOPE, noise)[0]
        residuals = SLOPE @ (x - TRUE) + wrong * SLOPE[:, 0] + noise
        return EvaluatedResiduals(residuals, SLOPE * (1 + self.slip) if jacobian is None else jacobian)


def solved(runs: Runs) -> Solution:
    start, low, high = np.array([1.0, 0.2]), np.zeros(2), np.full(2, 9.0)
    return solve(runs, start, low, high, 50)  # type: ignore[arg-type]


@pytest.mark.parametrize("slip", [0.0, 0.05], ids=["exact Jacobian", "by differences"])
@pytest.mark.parametrize(
    ("error", "rtol"), [(0.2, 1e-6), (10.0, 1e-7)], ids=["small from the start", "not at the least tolerance"]
)
def test_runs_are_tighter_until_their_error_is_small(error: float, rtol: float, slip: float) -> None:
    """The distance of the truth, with noise that moves nothing, is the error of the runs, within what is stated."""
    runs = Runs(1e-3, error, slip=slip)
    found = solved(runs)
    assert found.rtol == pytest.approx(rtol) and found.failure is None
    wrong = np.abs(found.x - TRUE)
    assert (wrong <= 3 * found.run_error + 0.1 * found.spread.deviation).all()
    assert (wrong <= found.half).all()
    small = found.run_error <= 2 * SMALL * found.spread.half
    assert small.all() or found.rtol == pytest.approx(LEAST)


def test_a_step_is_made_with_the_jacobian_of_the_search() -> None:
    """Two evaluations at the tighter tolerance: one measures the error, one is at the values that follow."""
    still, moved = Runs(1e-3, 0.02), Runs(1e-3, 0.5)
    assert solved(still).rtol == solved(moved).rtol == pytest.approx(1e-6)
    assert moved.count == still.count + 1


def test_the_values_before_are_kept_where_tighter_runs_fail() -> None:
    first = solved(Runs(1e-3, 10.0, fails=5e-6))
    assert first.rtol == 1e-4 and np.isinf(first.half).all() and first.failure is not None
    second = solved(Runs(1e-3, 10.0, fails=5e-7))
    assert second.rtol == pytest.approx(1e-6) and np.isfinite(second.half).all() and second.failure is not None
    assert (np.abs(second.x - TRUE) <= second.half).all()


LINE_NOISE = 1e-3 * np.random.default_rng(3).standard_normal(60)
LINE_SLOPE = np.linspace(-1.0, 1.0, 60)


class Line:
    """Residuals slope (x - 2) with noise; runs fail between two values."""

    def __init__(self, low: float = np.inf, high: float = np.inf) -> None:
        self.low, self.high = low, high

    def at(self, x: Array) -> EvaluatedResiduals:
        if self.low < x[0] < self.high:
            return EvaluatedResiduals(
                np.full(60, 10.0), np.zeros((60, 1)), failure=RunError("stopped", status="newton")
            )
        return EvaluatedResiduals(LINE_SLOPE * (x[0] - 2.0) + LINE_NOISE, LINE_SLOPE[:, None])


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
    exact = EvaluatedResiduals(np.zeros(60), LINE_SLOPE[:, None])
    assert exact.step_in_errors(np.zeros(1)) == 0.0
    assert exact.step_in_errors(np.ones(1)) == np.inf
