"""`Fit`: values, intervals and correlations of a calibration, what it cannot identify, and the search behind them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.output import make_folder, write_bytes
from msfp_gen.errors import InputError, RunError
from msfp_gen.studies.calibration.fitted_test import FittedTest
from msfp_gen.studies.calibration.residuals import Evaluation, Residuals

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene

SHOWN, LINES = 4, 10  # parameters, and lines, in the text of a fit


@dataclass(frozen=True)
class Estimate:
    """One fitted value.

    Attributes:
        name: path of the parameter, tied paths separated by `=`; `offset of FILE` for an offset of force.
        unit: SI unit.
        value, start: after and before the fit [unit].
        deviation: standard deviation from the noise of the tests [unit]; infinite where the value is not determined.
        low, high: 95 % interval [unit], which contains the error of the runs.
        run_error: of the value, from the error of the runs [unit]; infinite where it could not be measured.
        bounds: between which the value was sought [unit]; infinite for an offset.
        at_bound: whether the value is at one of its bounds, where the interval has no meaning.
    """

    name: str
    unit: str
    value: float
    start: float
    deviation: float
    low: float
    high: float
    run_error: float = 0.0
    bounds: tuple[float, float] = (-np.inf, np.inf)
    at_bound: bool = False

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        spread = f"{self.low:.4g} ... {self.high:.4g}" if np.isfinite(self.high) else "not determined"
        return f"{self.name} = {self.value:.5g}{unit} ({spread}){', at its bound' if self.at_bound else ''}"


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of `fit`.

    Attributes:
        scene: the scene with the fitted values; its motion is that of the given scene.
        estimates: of the parameters, then of the offsets.
        correlation: of the estimates, ndarray, shape (k, k); NaN where one is not determined.
        condition: largest over least singular value of the Jacobian of unit columns.
        tests: measured and fitted forces.
        unidentified: one line for each set of parameters that the tests do not tell apart, or do not see.
        notes: lines on what limits the intervals.
        evaluations: number of times that all tests were run.
        rtol: relative tolerance of the last runs.
    """

    scene: Scene
    estimates: tuple[Estimate, ...]
    correlation: Array
    condition: float
    tests: tuple[FittedTest, ...]
    unidentified: tuple[str, ...]
    notes: tuple[str, ...]
    evaluations: int
    rtol: float

    def __getitem__(self, name: str) -> Estimate:
        """The estimate of a parameter, by its path. Raises KeyError."""
        return {estimate.name: estimate for estimate in self.estimates}[name]

    def __repr__(self) -> str:
        """The fit in ten lines at most."""
        rows = sum(len(test.force) for test in self.tests)
        plural = "" if len(self.tests) == 1 else "s"
        lines = [
            f"fit of {len(self.tests)} test{plural}, {rows} rows, {self.evaluations} evaluations, rtol {self.rtol:g}"
        ]
        lines += [f"  {estimate}" for estimate in self.estimates[:SHOWN]]
        if len(self.estimates) > SHOWN:
            lines.append(f"  and {len(self.estimates) - SHOWN} more in .estimates")
        shares = ", ".join(f"{test.measured.name} {100 * test.share:.2g} %" for test in self.tests[:3])
        lines.append(f"  deviation of force over its peak: {shares}{', ...' if len(self.tests) > 3 else ''}")
        lines.append(f"  condition {self.condition:.3g}; 95 % intervals in brackets")
        extra = [f"  {text}" for text in (*self.unidentified, *self.notes)]
        room = LINES - len(lines)
        if len(extra) > room:
            extra[room - 1 :] = [f"  and {len(extra) - room + 1} more in .unidentified and .notes"]
        return "\n".join([*lines, *extra])

    def as_dict(self) -> dict[str, Any]:
        """All numbers in SI as plain values; None where a value is not determined."""
        names = ("name", "unit", "value", "start", "deviation", "low", "high", "run_error", "bounds", "at_bound")
        return {
            "estimates": [{n: _plain(getattr(e, n)) for n in names} for e in self.estimates],
            "correlation": [[_plain(float(value)) for value in row] for row in self.correlation],
            "condition": _plain(self.condition),
            "tests": [
                {"name": t.measured.name, "deviation": t.deviation, "share": t.share, "weight": t.measured.weight}
                for t in self.tests
            ],
            "unidentified": list(self.unidentified),
            "notes": list(self.notes),
            "evaluations": self.evaluations,
            "rtol": self.rtol,
        }

    def save(self, folder: str | Path) -> list[Path]:
        """Write the fitted scene (`scene.toml`), the numbers (`fit.json`), rows (`residuals.csv`) and `fit.png`.

        Returns the paths. Raises InputError for a folder that cannot be written to.
        """
        from msfp_gen.scene.file.loader import scene_text
        from msfp_gen.studies.calibration.figure import plot_fit

        folder = Path(folder)
        make_folder(folder, "output")
        texts = {
            "scene.toml": scene_text(self.scene),
            "fit.json": json.dumps(self.as_dict(), indent=2, allow_nan=False) + "\n",
            "residuals.csv": self._rows(),
        }
        for name, text in texts.items():
            write_bytes(folder / name, [text.encode()])
        plot_fit(self.tests, f"{self.scene.name or 'unnamed scene'}: fit", folder / "fit.png")
        return [folder / name for name in (*texts, "fit.png")]

    def _rows(self) -> str:
        lines = ["test,time [s],displacement [m],measured force [N],fitted force [N],residual [N]"]
        for test in self.tests:
            name = '"' + test.measured.name.replace('"', '""') + '"'
            columns = (test.measured.time, test.measured.displacement, test.measured.force, test.force, test.residual)
            lines += [f"{name}," + ",".join(map(repr, row)) for row in np.column_stack(columns).tolist()]
        return "\n".join(lines) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


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
