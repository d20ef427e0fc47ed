"""`fit`: calibrates numbers of a scene to laboratory tests by nonlinear least squares with exact Jacobians."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.studies.calibration.fitted_test import FittedTest
from msfp_gen.studies.calibration.intervals import CORRELATED, correlation_of, lag_one, spread_of, weak
from msfp_gen.studies.calibration.measurement import Measurement, read_measurement
from msfp_gen.studies.calibration.outcome import Estimate, Fit
from msfp_gen.studies.calibration.residuals import Evaluation, Progress, Residuals, scenes_of
from msfp_gen.studies.calibration.search import least_squares
from msfp_gen.studies.calibration.unknowns import changed_scene, unknowns_of

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene

CONFIDENCE = 0.95
AT_BOUND = 1e-3  # of the range: distance from a bound within which a value is at it
NOISY_RUNS = 1.0  # standard errors of the step that is left at the end, from which the fit has a note
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
    cores. `scipy.optimize.least_squares` makes the next step within the bounds (method "trf").

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
        At most so many evaluations.

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
    residuals = start_fit(scene, tests, parameters, bounds, offset, columns, progress)
    start, low, high = search_range(residuals)
    x, end = least_squares(residuals, start, low, high, max_evaluations)
    return _outcome(scene, residuals, x, end, (low, high))


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


def _outcome(scene: Scene, residuals: Residuals, x: Array, end: Evaluation, limits: tuple[Array, Array]) -> Fit:
    """The fit at x, with its intervals. end: the evaluation there. limits: bounds of x."""
    from scipy.stats import t

    scale, size = residuals.scale, len(residuals.unknowns)
    names = [u.name for u in residuals.unknowns]
    names += [f"offset of {test.name}" for test in residuals.tests if residuals.with_offset]
    units = [u.unit for u in residuals.unknowns] + ["N"] * residuals.offsets
    starts = [u.start for u in residuals.unknowns] + [0.0] * residuals.offsets
    freedom = max(len(end.residuals) - len(x), 1)
    spread = spread_of(end.jacobian, end.variance, names)
    deviation = np.sqrt(np.diag(spread.covariance)) * scale
    half = t.ppf(0.5 + CONFIDENCE / 2, freedom) * deviation
    values, correlation = x * scale, correlation_of(spread.covariance)
    near = _at_bound(x, end, *limits)
    bounds = list(zip(*((limit * scale).tolist() for limit in limits), strict=True))
    estimates = tuple(
        Estimate(*row)
        for row in zip(
            names,
            units,
            values.tolist(),
            starts,
            deviation.tolist(),
            (values - half).tolist(),
            (values + half).tolist(),
            bounds,
            near.tolist(),
            strict=True,
        )
    )
    tests = tuple(FittedTest(test, force) for test, force in zip(residuals.tests, end.forces, strict=True))
    lines = weak(names[:size], values[:size], half[:size], correlation[:size, :size])
    return Fit(
        scene=changed_scene(scene, residuals.unknowns, values[:size]),
        estimates=estimates,
        correlation=correlation,
        condition=spread.condition,
        tests=tests,
        unidentified=(*spread.unidentified, *lines),
        notes=tuple(_notes(estimates, tests, float(scene.top.stiffness), end.step_in_errors(end.step(~near)))),  # type: ignore[attr-defined]
        evaluations=residuals.count,
    )


def _at_bound(x: Array, end: Evaluation, low: Array, high: Array) -> NDArray[np.bool_]:
    """Which unknowns are at a bound, or have their minimum beyond it."""
    near = np.isfinite(low) & (np.minimum(x - low, high - x) < AT_BOUND * (high - low))
    beyond = x + end.step(~near)
    found: NDArray[np.bool_] = near | (beyond < low) | (beyond > high)
    return found


def _notes(estimates: Sequence[Estimate], tests: Sequence[FittedTest], stiffness: float, step_left: float) -> list[str]:
    """What limits the fit. stiffness: of the rig [N/m]. step_left: in standard errors, at the end of the search."""
    bound = "is at its bound; its interval, and those of the others, have no meaning"
    lines = [f"{estimate.name} {bound}" for estimate in estimates if estimate.at_bound]
    for test in tests:
        share = np.abs(test.force).max() / max(stiffness, 1e-9) / np.abs(test.measured.displacement).max()
        if share > GIVES_WAY:
            lines.append(
                f"{test.measured.name}: the rig of the scene gives way by {100 * share:.2g} % of the displacement; "
                "raise top.stiffness where the test measured the displacement across the bearing"
            )
    if step_left > NOISY_RUNS:
        lines.append(
            f"the errors of the runs limit this fit: its last step would be {step_left:.2g} standard errors; give a "
            "smaller solver.rtol"
        )
    if (correlation := lag_one([test.residual for test in tests])) > CORRELATED:
        lines.append(
            f"residuals are correlated ({correlation:.2f}), so the model misses part of the tests and the intervals "
            "are too narrow"
        )
    return lines
