"""`fit`: calibrates numbers of a scene to laboratory tests by nonlinear least squares with exact Jacobians."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.studies.calibration.fit_result import Estimate, Fit
from msfp_gen.studies.calibration.intervals import lag_one, weak
from msfp_gen.studies.calibration.measurement import FittedTest, Measurement, read_measurement
from msfp_gen.studies.calibration.residuals import Progress, Residuals, changed_scene, scenes_of, unknowns_of
from msfp_gen.studies.calibration.solution import SMALL, Solution, solve

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene

CORRELATED = 0.5  # correlation of consecutive residuals from which the fit has a note
GIVES_WAY = 0.02  # of the largest displacement: movement of the rig from which the fit has a note


def fit(
    scene: Scene,
    tests: Sequence[str | Path | Measurement],
    parameters: Sequence[str],
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    offset: bool = False,
    columns: Mapping[str, str] | None = None,
    progress: Progress | None = None,
    max_evaluations: int = 100,
) -> Fit:
    """Values of some parameters for which runs of a scene give the forces that tests have measured.

    Every evaluation runs every test once, with the derivatives of its force (docs/gradients.md), in threads on all
    cores. `scipy.optimize.least_squares` makes the next step within the bounds (method "trf"). Runs begin with the
    tolerance of the scene, and go on with smaller ones until their error is small against the intervals.

    Parameters
    ----------
    scene
        The bearing on its test rig, with the values at the start. The displacement of each test replaces its motion.
    tests
        Files with the columns time, displacement and force, or measurements.
    parameters
        Paths, such as `bearing.surfaces[*].friction`; `A=B` gives the same value to both.
    bounds
        Path -> least and largest value [SI]; by default a tenth and ten times the value in the scene.
    offset
        Fit an offset of the force of each test too.
    columns
        Names of the columns: see `read_measurement`.
    progress
        Called during the runs, in their threads, with the number of the evaluation, its share that is done and the
        last deviation [N]. An exception in it ends the fit.
    max_evaluations
        At most so many evaluations in the search; tighter runs at its end are not counted.

    Returns
    -------
    Fit
        Estimates with 95 % intervals, correlations, what the tests cannot identify, and the fitted scene.

    Raises
    ------
    InputError
        A file, a parameter or a bound is wrong, or runs of the scene have no gradients: one line.
    RunError
        A run of the scene as it was given fails, or the fit has not converged after `max_evaluations`.

    """
    return end_fit(scene, start_fit(scene, tests, parameters, bounds, offset, columns, progress), max_evaluations)


def end_fit(scene: Scene, residuals: Residuals, max_evaluations: int = 100) -> Fit:
    """The fit of the residuals of `start_fit`; arguments and RunError as of `fit`."""
    start, low, high = search_range(residuals)
    solution = solve(residuals, start, low, high, max_evaluations)
    return _outcome(scene, residuals, solution, (low, high))


def search_range(residuals: Residuals) -> tuple[Array, Array, Array]:
    """Start, least and largest value of every unknown over its scale; offsets of force have no bounds."""
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
    progress: Progress | None = None,
) -> Residuals:
    """The residuals of a fit, all input checked; arguments and InputError as of `fit`."""
    if isinstance(tests, str | Path | Measurement) or not tests:
        raise InputError(f"tests = {tests!r}: give a list of files or measurements")
    read = [test if isinstance(test, Measurement) else read_measurement(test, columns) for test in tests]
    sampled = tuple(test.sampled() for test in _distinct(read))
    scenes = scenes_of(scene, sampled)
    unknowns = unknowns_of(scenes[0], parameters, bounds)
    if any(test.axial_load is not None for test in sampled):
        for unknown in unknowns:
            if any(member.path == "top.axial_load" for member in unknown.members):
                raise InputError("parameters = 'top.axial_load': a test gives its own load; leave out one of them")
    return Residuals(sampled, scenes, unknowns, offset, progress)


def _distinct(tests: Sequence[Measurement]) -> list[Measurement]:
    """The tests, with a number behind a name that an earlier one has, such as a file of another folder."""
    names = [test.name for test in tests]
    counts = [names[: i + 1].count(name) for i, name in enumerate(names)]
    return [
        replace(test, name=f"{test.name} ({count})") if count > 1 else test
        for test, count in zip(tests, counts, strict=True)
    ]


def _outcome(scene: Scene, residuals: Residuals, solution: Solution, limits: tuple[Array, Array]) -> Fit:
    """The fit of a solution, with its intervals. limits: bounds of the unknowns over their scales."""
    scale, size = residuals.scale, len(residuals.unknowns)
    units = [u.unit for u in residuals.unknowns] + ["N"] * residuals.offsets
    starts = [u.start for u in residuals.unknowns] + [0.0] * residuals.offsets
    values, half = solution.x * scale, solution.half * scale
    bounds = list(zip(*((limit * scale).tolist() for limit in limits), strict=True))
    estimates = tuple(
        Estimate(*row)
        for row in zip(
            residuals.names,
            units,
            values.tolist(),
            starts,
            (solution.spread.deviation * scale).tolist(),
            (values - half).tolist(),
            (values + half).tolist(),
            (solution.run_error * scale).tolist(),
            bounds,
            solution.at_bound.tolist(),
            strict=True,
        )
    )
    tests = tuple(FittedTest(test, force) for test, force in zip(residuals.tests, solution.end.forces, strict=True))
    lines = weak(residuals.names[:size], values[:size], half[:size], solution.spread.correlation[:size, :size])
    return Fit(
        scene=changed_scene(scene, residuals.unknowns, values[:size]),
        estimates=estimates,
        correlation=solution.spread.correlation,
        condition=solution.known.condition,
        tests=tests,
        unidentified=(*solution.known.lines, *lines),
        notes=(*_notes(estimates, tests, float(scene.top.stiffness)), *_error_notes(residuals, solution)),  # type: ignore[attr-defined]
        evaluations=residuals.count,
        rtol=solution.rtol,
    )


def _notes(estimates: Sequence[Estimate], tests: Sequence[FittedTest], stiffness: float) -> list[str]:
    """What limits the values of the fit. stiffness: of the rig [N/m]."""
    bound = "is at its bound; its interval, and those of the others, have no meaning"
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
    """What makes the intervals wider than noise without correlation would."""
    lines, spread = [], solution.spread
    if not np.isfinite(solution.run_error).all():
        lines.append(
            f"the errors of the runs could not be measured, so values have no interval: runs with "
            f"rtol = {residuals.rtol:g} fail ({solution.failure})"
        )
    else:
        some = np.isfinite(spread.half) & ~solution.at_bound
        wider = solution.run_error[some] / np.maximum(spread.half[some], np.finfo(float).tiny)
        if (wider > SMALL).any():
            remedy = (
                f"runs with a smaller one fail ({solution.failure})"
                if solution.failure
                else "give a smaller solver.rtol"
            )
            lines.append(
                f"the errors of the runs limit this fit: intervals are wider by up to {100 * wider.max():.2g} % for "
                f"them, with rtol = {solution.rtol:g}; {remedy}"
            )
    if (correlation := lag_one(residuals.split(solution.end.residuals))) > CORRELATED:
        independent = np.sqrt(solution.end.variance) * np.linalg.norm(solution.known.factors, axis=1)
        some = np.isfinite(spread.deviation) & (independent > 0)
        wider = (spread.deviation[some] / independent[some]).max(initial=1.0)
        lines.append(
            f"residuals are correlated ({correlation:.2f}): intervals are wider for it, by a factor of up to "
            f"{wider:.2g}, and contain no other error of a model that misses part of the tests"
        )
    return lines
