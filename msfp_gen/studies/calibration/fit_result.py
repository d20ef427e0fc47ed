"""`Fit`: values, intervals and correlations of a calibration, and the parameters that its tests do not identify.

Last step of a calibration: text, tables, files and figures of a fit.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.output import make_folder, write_bytes
from msfp_gen.common.tables import Table, write_columns
from msfp_gen.figures.style import (
    COLOURS,
    FAINT,
    HAIR,
    INK,
    THIN,
    displacement,
    displacement_label,
    engineering,
    force,
    headline,
    page,
    plain,
)
from msfp_gen.results.sign import shown_sign
from msfp_gen.studies.calibration.measurement import FittedTest

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from msfp_gen.figures.style import Scale
    from msfp_gen.scene.scene import Scene

SHOWN, LINES = 4, 10  # parameters and lines in the text of a fit, at most


@dataclass(frozen=True)
class FittedValue:
    """One fitted value.

    Attributes:
        name: path of the parameter, tied paths separated by `=`; `offset of FILE` for an offset of force.
        unit: SI unit.
        value, start: after and before the fit [unit].
        deviation: standard deviation of the value from the noise of the tests [unit]; infinite where the tests do not
            determine the value.
        low, high: 95 % interval, with the error of the runs [unit].
        run_error: error of the value from the error of the runs [unit]; infinite where it could not be measured.
        bounds: of the search [unit]; infinite for an offset.
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
        scene: the given scene with the fitted values.
        estimates: of the parameters, then of the offsets.
        correlation: of the estimates, ndarray, shape (k, k), [-]; NaN in the rows of an estimate that is not
            determined.
        condition: largest over least singular value of the Jacobian with columns of unit length [-].
        tests: measured and fitted forces.
        unidentified: one line for each set of parameters that the tests do not tell apart, or do not see.
        notes: one line for each thing that limits the intervals.
        evaluations: number of times that all tests were run.
        rtol: relative tolerance of the last runs [-].
    """

    scene: Scene
    estimates: tuple[FittedValue, ...]
    correlation: Array
    condition: float
    tests: tuple[FittedTest, ...]
    unidentified: tuple[str, ...]
    notes: tuple[str, ...]
    evaluations: int
    rtol: float

    def __getitem__(self, name: str) -> FittedValue:
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
        """All numbers in SI as plain values, ready for JSON; None where a number is infinite or NaN."""
        return {
            "estimates": [{name: _plain(number) for name, number in vars(value).items()} for value in self.estimates],
            "correlation": [[_plain(float(value)) for value in row] for row in self.correlation],
            "condition": _plain(self.condition),
            "tests": [
                {
                    "name": test.measured.name,
                    "deviation": test.deviation,
                    "share": test.share,
                    "weight": test.measured.weight,
                }
                for test in self.tests
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

        folder = Path(folder)
        make_folder(folder, "output")
        texts = {
            "scene.toml": scene_text(self.scene),
            "fit.json": json.dumps(self.as_dict(), indent=2, allow_nan=False) + "\n",
        }
        for name, text in texts.items():
            write_bytes(folder / name, [text.encode()])
        write_columns(folder / "residuals.csv", self._columns())
        plot_fit(self.tests, f"{self.scene.name or 'unnamed scene'}: fit", folder / "fit.png")
        return [folder / name for name in (*texts, "residuals.csv", "fit.png")]

    def _columns(self) -> dict[tuple[str, str], list[Any]]:
        """(name, unit) of a column of `residuals.csv` -> values of all tests, in the sign of outputs."""
        sign = shown_sign().factor
        rows: dict[tuple[str, str], Any] = {
            ("time", "s"): [test.measured.time for test in self.tests],
            ("displacement", "m"): [sign * test.measured.displacement for test in self.tests],
            ("measured force", "N"): [sign * test.measured.force for test in self.tests],
            ("fitted force", "N"): [sign * test.force for test in self.tests],
            ("residual", "N"): [sign * test.residual for test in self.tests],
        }
        names = [test.measured.name for test in self.tests for _ in test.force]
        return {("test", ""): names, **{key: np.concatenate(values).tolist() for key, values in rows.items()}}


def _plain(value: Any) -> Any:
    """A value for JSON: tuples as lists, None for a number that is not finite."""
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def fit_tables(fit: Fit) -> list[Table]:
    """Tables of estimates, correlations and tests, and of what limits the fit."""
    tables = [fitted_values_table(fit)]
    if len(fit.estimates) > 1:
        tables.append(correlation_table(fit))
    tables.append(residual_table(fit))
    remarks = [(text,) for text in (*fit.unidentified, *fit.notes)]
    return [*tables, Table("what limits this fit", (), remarks)] if remarks else tables


def fitted_values_table(fit: Fit) -> Table:
    """Values, intervals and starts of the estimates."""
    rows = []
    for estimate in fit.estimates:
        interval = f"{estimate.low:.4g} to {estimate.high:.4g}" if np.isfinite(estimate.high) else "not determined"
        value = f"{estimate.value:.5g}" + (" (bound)" if estimate.at_bound else "")
        rows.append((estimate.name, value, interval, f"{estimate.start:.4g}", estimate.unit or "-"))
    title = f"fitted in {fit.evaluations} evaluations, the last with rtol {fit.rtol:g}"
    return Table(title, ("parameter", "value", "95 % interval", "start", "unit"), rows)


def correlation_table(fit: Fit) -> Table:
    """Correlations of the estimates, in the order of the estimates."""
    numbers = [str(i) for i in range(1, len(fit.estimates) + 1)]
    rows = [
        (estimate.name, *(f"{value:+.3f}" if np.isfinite(value) else "-" for value in line))
        for estimate, line in zip(fit.estimates, fit.correlation, strict=True)
    ]
    return Table(f"correlation, in the same order; condition {fit.condition:.3g}", ("parameter", *numbers), rows)


def residual_table(fit: Fit) -> Table:
    """Deviation and number of rows of every test."""
    rows = [
        (test.measured.name, f"{test.deviation:.4g}", f"{100 * test.share:.2f}", str(len(test.force)))
        for test in fit.tests
    ]
    return Table("residuals", ("test", "deviation [N]", "over the peak [%]", "rows"), rows)


ACROSS = 4  # tests beside each other in a figure
DRAWN = 24  # tests in a figure, at most: few programs open a larger picture


def plot_fit(tests: Sequence[FittedTest], title: str = "fit", path: str | Path | None = None) -> Figure:
    """Measured and fitted loops of the first 24 tests, each above its residual over time. path: see `page`."""
    plotted, across = tests[:DRAWN], min(len(tests), ACROSS)
    rows = -(-len(plotted) // across)
    with page(max(4.2 * across, 6.0), 6.4 * rows, path, "fit") as figure:
        first = f", the first {DRAWN} of them" if len(tests) > DRAWN else ""
        headline(figure, f"{title} of {len(tests)} test{'' if len(tests) == 1 else 's'}{first}")
        grid = figure.subplots(2 * rows, across, squeeze=False, height_ratios=(2, 1) * rows)
        pairs = [pair for row in range(rows) for pair in zip(grid[2 * row], grid[2 * row + 1], strict=True)]
        for loop, below in pairs[len(plotted) :]:
            loop.remove()
            below.remove()
        for test, (loop, below) in zip(plotted, pairs, strict=False):
            _draw_test(test, loop, below)
    return figure


def _draw_test(test: FittedTest, loop: Axes, below: Axes) -> None:
    measured = test.measured
    scale, small = engineering(measured.force, "N"), engineering(test.residual, "N")
    u = displacement(measured.displacement)
    loop.plot(u, force(measured.force, scale), color=COLOURS[0], linewidth=THIN, label="measured")
    loop.plot(u, force(test.force, scale), color=COLOURS[1], linewidth=THIN, label="fitted")
    loop.set(title=plain(measured.name), xlabel=displacement_label(0))
    loop.set_ylabel(f"force {shown_sign().force} [{scale.unit}]")
    loop.legend(loc="upper left")
    below.plot(measured.time, force(test.residual, small), color=INK, linewidth=HAIR)
    below.set(xlabel="time t [s]", ylabel=_residual_label(small))


def plot_residuals(tests: Sequence[FittedTest], path: str | Path | None = None) -> Figure:
    """Residuals of all tests over the displacement and over the force, and their quantiles over normal quantiles.

    For a model without error the residuals are a band about zero without a pattern, and the quantiles follow the line.
    Raises InputError for a path that cannot be written.
    """
    from scipy.stats import norm

    small = engineering(np.concatenate([test.residual for test in tests]), "N")
    large = engineering(np.concatenate([test.measured.force for test in tests]), "N")
    points: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 2.5}
    with page(12.6, 4.0, path, "residuals") as figure:
        over_u, over_force, normal = figure.subplots(1, 3)
        for number, test in enumerate(tests):
            colour, name = COLOURS[number % len(COLOURS)], plain(test.measured.name)
            residual = force(test.residual, small)
            over_u.plot(displacement(test.measured.displacement), residual, color=colour, label=name, **points)
            over_force.plot(force(test.measured.force, large), residual, color=colour, **points)
        over_u.set(title="over the displacement", xlabel=displacement_label(0), ylabel=_residual_label(small))
        over_force.set(title="over the force", xlabel=f"measured force {shown_sign().force} [{large.unit}]")
        ordered = np.sort(np.concatenate([test.measured.weight * test.residual for test in tests]))
        ordered /= float(np.sqrt(np.mean(ordered**2))) or 1.0
        expected = norm.ppf((np.arange(len(ordered)) + 0.5) / len(ordered))
        normal.axline((0, 0), slope=1, color=FAINT, linewidth=HAIR)
        normal.plot(expected, ordered, color=INK, **points)
        normal.set(title="all, in order", xlabel="of a normal distribution", ylabel="over their standard deviation")
        if len(tests) <= len(COLOURS):
            over_u.legend(loc="best", markerscale=3)
        for axes in (over_u, over_force):
            axes.axhline(0, color=FAINT, linewidth=HAIR)
    return figure


def _residual_label(scale: Scale) -> str:
    return f"fitted − measured [{scale.unit}]"
