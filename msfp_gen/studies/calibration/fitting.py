"""`fit`: calibrates values of a scene to laboratory tests by nonlinear least squares with exact Jacobians.

A scene, measurements and paths of parameters come in; residuals are minimised; a `Fit` goes out. After the search the
tolerance of the runs falls until their error is small against the intervals.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from msfp_gen.common.aliases import FitProgress
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.scene.plausibility import require_meant
from msfp_gen.studies.calibration.fit_result import Fit, FittedValue
from msfp_gen.studies.calibration.intervals import Identified, Spread, identified, lag_one, noise_of, spread_of, weak
from msfp_gen.studies.calibration.measurement import FittedTest, Measurement, read_measurement
from msfp_gen.studies.calibration.residuals import (
    EvaluatedResiduals,
    Residuals,
    scene_at,
    scenes_of,
    unknowns_of,
)

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene

CORRELATED = 0.5  # correlation of consecutive residuals above which the fit has a note
GIVES_WAY = 0.02  # movement of the rig over the largest displacement, above which the fit has a note


def fit(
    scene: Scene,
    tests: Sequence[str | Path | Measurement],
    parameters: Sequence[str],
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    offset: bool = False,
    columns: Mapping[str, str] | None = None,
    progress: FitProgress | None = None,
    max_evaluations: int = 100,
    force: bool = False,
) -> Fit:
    """Fit parameters of a scene so that its runs give the measured forces of tests.

    An evaluation runs every test once, with the derivatives of its force (docs/gradients.md), on all cores.
    `scipy.optimize.least_squares` makes the next step within the bounds (method "trf"). The first runs have the
    tolerance of the scene; the tolerance then falls until the error of the runs is small against the intervals.

    Args:
        scene: the bearing on its test rig, with the values at the start. The displacement of each test replaces the
            motion.
        tests: files with the columns time, displacement and force, or measurements.
        parameters: paths, such as `bearing.surfaces[*].friction`; `A=B` gives the same value to both.
        bounds: path -> least and largest value [SI]; by default a tenth and ten times the value in the scene.
        offset: whether to fit an offset of the force of each test too.
        columns: names of the columns: see `read_measurement`.
        progress: called during the runs, in other threads, with the number of the evaluation, the share of it that is
            done, and the last deviation [N]. An exception in it ends the fit.
        max_evaluations: largest number of evaluations in the search; the runs with smaller tolerances after the search
            are not counted.
        force: whether to start also from values of the scene that are implausible in any unit.

    Raises InputError of one line: a file, a parameter or a bound is wrong, or runs of the scene have no gradients.
    RunError: a run of the given scene fails, or the fit has not converged after `max_evaluations`.
    """
    residuals = start_fit(scene, tests, parameters, bounds, offset, columns, progress, force)
    return end_fit(scene, residuals, max_evaluations)


def end_fit(scene: Scene, residuals: Residuals, max_evaluations: int = 100) -> Fit:
    """The fit of the residuals of `start_fit`; arguments and RunError as in `fit`."""
    start, low, high = search_range(residuals)
    return _fit_of(scene, residuals, solve(residuals, start, low, high, max_evaluations), (low, high))


def search_range(residuals: Residuals) -> tuple[Array, Array, Array]:
    """Start, least and largest value of every unknown over its scale, shape (k,) [-]; offsets have no bounds."""
    values = np.array([(u.start, u.low, u.high) for u in residuals.unknowns]).reshape(-1, 3)
    offsets = np.tile([0.0, -np.inf, np.inf], (residuals.offsets, 1))
    start, low, high = np.vstack([values, offsets]).T / residuals.scale
    return start, low, high


def start_fit(
    scene: Scene,
    tests: Sequence[str | Path | Measurement],
    parameters: Sequence[str],
    bounds: Mapping[str, tuple[float, float]] | None = None,
    offset: bool = False,
    columns: Mapping[str, str] | None = None,
    progress: FitProgress | None = None,
    force: bool = False,
) -> Residuals:
    """Check the input of a fit; returns its residuals. Arguments and InputError as in `fit`."""
    if isinstance(tests, str | Path | Measurement) or not tests:
        raise InputError(f"tests = {tests!r}: give a list of files or measurements")
    measured = [test if isinstance(test, Measurement) else read_measurement(test, columns) for test in tests]
    sampled = tuple(test.sampled() for test in _with_distinct_names(measured))
    require_meant(scene, force=force)
    scenes = scenes_of(scene, sampled)
    unknowns = unknowns_of(scenes[0], parameters, bounds)
    if any(test.axial_load is not None for test in sampled):
        for unknown in unknowns:
            if any(member.path == "top.axial_load" for member in unknown.members):
                raise InputError("parameters = 'top.axial_load': a test gives its own load; leave out one of them")
    return Residuals(sampled, scenes, unknowns, offset, progress)


def _with_distinct_names(tests: Sequence[Measurement]) -> list[Measurement]:
    """The tests; a number follows a name that an earlier test has, such as a file of another folder."""
    names = [test.name for test in tests]
    counts = [names[: i + 1].count(name) for i, name in enumerate(names)]
    return [
        replace(test, name=f"{test.name} ({count})") if count > 1 else test
        for test, count in zip(tests, counts, strict=True)
    ]


def _fit_of(scene: Scene, residuals: Residuals, solution: Solution, limits: tuple[Array, Array]) -> Fit:
    """The fit of a solution. limits: bounds of the unknowns over their scales, each shape (k,)."""
    scale, size = residuals.scale, len(residuals.unknowns)
    units = [u.unit for u in residuals.unknowns] + ["N"] * residuals.offsets
    starts = [u.start for u in residuals.unknowns] + [0.0] * residuals.offsets
    values, half = solution.x * scale, solution.half * scale
    bounds = list(zip(*((limit * scale).tolist() for limit in limits), strict=True))
    deviation, run_error = solution.spread.deviation * scale, solution.run_error * scale
    columns = [column.tolist() for column in (deviation, values - half, values + half, run_error)]
    rows = zip(
        residuals.names, units, values.tolist(), starts, *columns, bounds, solution.at_bound.tolist(), strict=True
    )
    estimates = tuple(FittedValue(*row) for row in rows)
    tests = tuple(FittedTest(test, force) for test, force in zip(residuals.tests, solution.end.forces, strict=True))
    lines = weak(residuals.names[:size], values[:size], half[:size], solution.spread.correlation[:size, :size])
    return Fit(
        scene=scene_at(scene, residuals.unknowns, values[:size]),
        estimates=estimates,
        correlation=solution.spread.correlation,
        condition=solution.known.condition,
        tests=tests,
        unidentified=(*solution.known.lines, *lines),
        notes=(*_notes(estimates, tests, float(scene.top.stiffness)), *_error_notes(residuals, solution)),
        evaluations=residuals.count,
        rtol=solution.rtol,
    )


def _notes(estimates: Sequence[FittedValue], tests: Sequence[FittedTest], stiffness: float) -> list[str]:
    """Lines on values at a bound and on tests in which the rig moves. stiffness: of the rig [N/m]."""
    bound = "is at its bound; its interval, and the intervals of the others, have no meaning"
    lines = [f"{estimate.name} {bound}" for estimate in estimates if estimate.at_bound]
    for test in tests:
        share = np.abs(test.force).max() / max(stiffness, 1e-9) / np.abs(test.measured.displacement).max()
        if share > GIVES_WAY:
            lines.append(
                f"{test.measured.name}: the rig of the scene gives way by {100 * share:.2g} % of the displacement; "
                "raise top.stiffness where the test measured the displacement across the bearing"
            )
    return lines


def _error_notes(residuals: Residuals, solution: Solution) -> list[str]:
    """Lines on what makes the intervals wider than uncorrelated noise: errors of the runs, correlated residuals."""
    lines, spread = [], solution.spread
    if not np.isfinite(solution.run_error).all():
        lines.append(
            f"the errors of the runs could not be measured, so values have no interval: runs with "
            f"rtol = {residuals.rtol:g} fail ({solution.failure})"
        )
    else:
        determined = np.isfinite(spread.half) & ~solution.at_bound
        wider = solution.run_error[determined] / np.maximum(spread.half[determined], np.finfo(float).tiny)
        if (wider > SMALL).any():
            failure = solution.failure
            remedy = f"runs with a smaller one fail ({failure})" if failure else "give a smaller solver.rtol"
            lines.append(
                f"the errors of the runs limit this fit: intervals are wider by up to {100 * wider.max():.2g} % for "
                f"them, with rtol = {solution.rtol:g}; {remedy}"
            )
    if (correlation := lag_one(residuals.split(solution.end.residuals))) > CORRELATED:
        independent = np.sqrt(solution.end.variance) * np.linalg.norm(solution.known.factors, axis=1)
        determined = np.isfinite(spread.deviation) & (independent > 0)
        factor = (spread.deviation[determined] / independent[determined]).max(initial=1.0)
        lines.append(
            f"residuals are correlated ({correlation:.2f}): intervals are wider for it, by a factor of up to "
            f"{factor:.2g}, and contain no other error of a model that misses part of the tests"
        )
    return lines


TOLERANCE = 1e-5  # relative change of cost and values that ends the search; errors of runs hide smaller changes
WITHIN = 0.1  # length of a step in standard errors below which the search ends (Bates and Watts 1981)
FIRST, NEXT = 100.0, 10.0  # divisors of the tolerance, first and later; see docs/properties.md
LEAST = 1e-7  # least tolerance after the first division
REST = 0.5  # error left after a division, over the change by the division: at most, in random fits
SMALL = 0.1  # error of the runs that is small, over half the width of the interval
STEPS = 3  # at one tolerance, with the Jacobian of the search
AT_BOUND = 1e-3  # distance from a bound within which a value is at the bound, over the range


@dataclass(frozen=True, eq=False)
class Solution:
    """Values of the unknowns and their errors.

    x: unknowns over their scales, shape (k,) [-]. end: the evaluation at x. known: the combinations of unknowns that
    its Jacobian determines. spread: deviations of x under the noise of the tests. at_bound: whether each unknown is at
    a bound, shape (k,). rtol: of the runs. run_error: error of x from the errors of the runs, shape (k,) [-]; infinite
    where it could not be measured. failure: why runs at the next tolerance failed.
    """

    x: Array
    end: EvaluatedResiduals
    known: Identified
    spread: Spread
    at_bound: NDArray[np.bool_]
    rtol: float
    run_error: Array
    failure: RunError | InputError | None = None

    @property
    def half(self) -> Array:
        """Half the widths of the intervals, with the error of the runs, shape (k,) [-]."""
        return self.spread.half + self.run_error


def solve(residuals: Residuals, start: Array, low: Array, high: Array, most: int) -> Solution:
    """The unknowns between two bounds for which the sum of squares is least.

    After the search the tolerance of the runs is divided by 100, and then by 10 until the error of the runs is below a
    tenth of half the width of each interval, or the next tolerance would be below 1e-7. Steps at these tolerances use
    the Jacobian of the search (simplified Newton steps). The change of the values by a division measures the error of
    the runs; half of it is taken as left.

    most: number of evaluations of the search. Raises RunError as `least_squares`; where runs at a smaller tolerance
    fail, the solution before is returned.
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
        # The remaining step is an error too, which no smaller tolerance removes: derivatives contain ringing.
        solution = replace(solution, run_error=remainder + np.abs(end.step(~solution.at_bound)))
        small = (remainder <= SMALL * solution.spread.half) | solution.at_bound
        if small.all() or solution.rtol / NEXT < LEAST * (1 - 1e-9):
            return solution


def _steps(
    residuals: Residuals, x: Array, at: EvaluatedResiduals, free: NDArray[np.bool_], low: Array, high: Array
) -> tuple[Array, EvaluatedResiduals]:
    """Step from an evaluation at x, with its Jacobian, until a step is within the errors or reduces nothing."""
    # free: the unknowns that move. Returns the last x, and the evaluation there.
    for _ in range(STEPS):
        step = np.clip(x + at.step(free), low, high) - x
        if at.step_in_errors(step) < WITHIN:
            break
        trial = residuals.evaluate(x + step, at.jacobian)
        if trial.failure is not None or trial.square >= at.square:
            break
        x, at = x + step, trial
    return x, at


def _solution(residuals: Residuals, x: Array, end: EvaluatedResiduals, low: Array, high: Array) -> Solution:
    """The solution at x from its evaluation `end`; the error of the runs is infinite, since it is not measured yet."""
    known = identified(end.jacobian, residuals.names)
    noises = noise_of(residuals.split(end.residuals), residuals.split(known.basis))
    near = np.isfinite(low) & (np.minimum(x - low, high - x) < AT_BOUND * (high - low))
    minimum = x + end.step(~near)  # of the linearised sum of squares, without bounds
    at_bound, unmeasured = near | (minimum < low) | (minimum > high), np.full(len(x), np.inf)
    return Solution(x, end, known, spread_of(known, noises), at_bound, residuals.rtol, unmeasured)


class _WithinError(Exception):
    """Ends the search: the next step is within the errors of the values."""


def least_squares(
    residuals: Residuals, start: Array, low: Array, high: Array, most: int
) -> tuple[Array, EvaluatedResiduals]:
    """The unknowns between two bounds, shape (k,) [-], for which the sum of squares is least, and the evaluation there.

    The search also ends where the next step is shorter than a tenth of the standard errors: the noise of the tests
    makes smaller steps meaningless, and the error of runs, which varies irregularly with the values, hides them.

    most: number of evaluations. Raises RunError where the start fails, the search has not ended after `most`
    evaluations, or it ends beside values whose runs fail.
    """
    from scipy.optimize import least_squares as search

    best, at_best, started = start, residuals.at(start), False
    failure: RunError | InputError | None = None  # of the last trial
    if at_best.failure is not None:
        raise at_best.failure

    def values(x: Array) -> Array:
        nonlocal best, at_best, failure
        # After a failed run the next step is short because the search shortens it, not because it converges.
        if started and failure is None and not np.array_equal(x, best) and at_best.step_in_errors(x - best) < WITHIN:
            raise _WithinError
        at = residuals.at(x)
        failure = at.failure
        if failure is None and at.square < at_best.square:
            best, at_best = x.copy(), at
        return at.residuals

    def jacobian(x: Array) -> Array:
        nonlocal started
        started = True  # before the first Jacobian, the search moves a start that is nearly at a bound
        return (at_best if np.array_equal(x, best) else residuals.at(x)).jacobian

    limits = {"ftol": TOLERANCE, "xtol": TOLERANCE, "gtol": None, "max_nfev": most}
    try:
        found = search(values, start, jacobian, bounds=(low, high), **limits)
    except _WithinError:
        return best, at_best
    if found.status == 0:
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
