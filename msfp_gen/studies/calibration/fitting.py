"""`fit`: calibrates numbers of a scene to laboratory tests by nonlinear least squares with exact Jacobians."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError, RunError
from msfp_gen.studies.calibration.fitted_test import FittedTest
from msfp_gen.studies.calibration.intervals import CORRELATED, correlation_of, lag_one, spread_of, weak
from msfp_gen.studies.calibration.measurement import Measurement, read_measurement
from msfp_gen.studies.calibration.outcome import Estimate, Fit
from msfp_gen.studies.calibration.residuals import Progress, Residuals, scenes_of
from msfp_gen.studies.calibration.unknowns import changed_scene, unknowns_of

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene

CONFIDENCE = 0.95
TOLERANCE = 1e-5  # relative change of cost and values at which the fit ends; errors of runs hide smaller ones
AT_BOUND = 1e-3  # of the range: distance from a bound within which a value is at it
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

    Every evaluation runs every test once, with the derivatives of its force (docs/gradients.md), and
    `scipy.optimize.least_squares` makes the next step within the bounds (method "trf").

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
        Called during a run with the number of the evaluation, its share that is done and the last deviation [N].
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
    from scipy.optimize import least_squares

    residuals = start_fit(scene, tests, parameters, bounds, offset, columns, progress)
    start, low, high = _range(residuals)
    first = residuals.at(start)
    if first.failure is not None:
        raise first.failure
    found = least_squares(
        lambda x: residuals.at(x).residuals,
        start,
        lambda x: residuals.at(x).jacobian,
        bounds=(low, high),
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        gtol=None,
        max_nfev=max_evaluations,
    )
    if found.status == 0:
        raise RunError(
            f"fit: not converged after {max_evaluations} evaluations; give tighter bounds, fewer parameters, or more "
            "evaluations",
            status="fit",
        )
    return _outcome(scene, residuals, found.x, (low, high))


def _range(residuals: Residuals) -> tuple[Array, Array, Array]:
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
    sampled = tuple(test.sampled() for test in read)
    scenes = scenes_of(scene, sampled)
    unknowns = unknowns_of(scenes[0], parameters, bounds)
    if any(test.axial_load is not None for test in sampled):
        for unknown in unknowns:
            if any(member.path == "top.axial_load" for member in unknown.members):
                raise InputError("parameters = 'top.axial_load': a test gives its own load; leave out one of them")
    return Residuals(sampled, scenes, unknowns, offset, progress)


def _outcome(scene: Scene, residuals: Residuals, x: Array, limits: tuple[Array, Array]) -> Fit:
    """The fit at x, with its intervals. limits: bounds of x."""
    from scipy.stats import t

    end, scale, size = residuals.at(x), residuals.scale, len(residuals.unknowns)
    if end.failure is not None:
        raise end.failure
    names = [u.name for u in residuals.unknowns]
    names += [f"offset of {test.name}" for test in residuals.tests if residuals.with_offset]
    units = [u.unit for u in residuals.unknowns] + ["N"] * residuals.offsets
    starts = [u.start for u in residuals.unknowns] + [0.0] * residuals.offsets
    freedom = max(len(end.residuals) - len(x), 1)
    spread = spread_of(end.jacobian, float(end.residuals @ end.residuals) / freedom, names)
    deviation = np.sqrt(np.diag(spread.covariance)) * scale
    half = t.ppf(0.5 + CONFIDENCE / 2, freedom) * deviation
    values, correlation = x * scale, correlation_of(spread.covariance)
    near = np.minimum(x - limits[0], limits[1] - x) < AT_BOUND * (limits[1] - limits[0])
    near &= np.isfinite(limits[0])
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
        notes=tuple(_notes(estimates, tests, float(scene.top.stiffness))),  # type: ignore[attr-defined]
        evaluations=residuals.count,
    )


def _notes(estimates: Sequence[Estimate], tests: Sequence[FittedTest], stiffness: float) -> list[str]:
    """What limits the fit. stiffness: of the rig [N/m]."""
    bound = "is at its bound; its interval, and those of the others, have no meaning"
    lines = [f"{estimate.name} {bound}" for estimate in estimates if estimate.at_bound]
    for test in tests:
        share = np.abs(test.force).max() / max(stiffness, 1e-9) / np.abs(test.measured.displacement).max()
        if share > GIVES_WAY:
            lines.append(
                f"{test.measured.name}: the rig of the scene gives way by {100 * share:.2g} % of the displacement; "
                "raise top.stiffness where the test measured the displacement across the bearing"
            )
    if (correlation := lag_one([test.residual for test in tests])) > CORRELATED:
        lines.append(
            f"residuals are correlated ({correlation:.2f}), so the model misses part of the tests and the intervals "
            "are too narrow"
        )
    return lines
