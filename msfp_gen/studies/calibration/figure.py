"""Figures of a fit: measured and fitted loops of every test with the residuals over time; and where residuals lie."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.figures import COLOURS, INK, displacement, displacement_label, engineering, force, page
from msfp_gen.figures.style import FAINT, HAIR, THIN, headline, plain
from msfp_gen.results.sign import shown_sign

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from msfp_gen.figures.style import Scale
    from msfp_gen.studies.calibration.measurement import FittedTest

ACROSS = 4  # tests beside each other
DRAWN = 24  # tests; more would make a picture that few programs open


def plot_fit(tests: Sequence[FittedTest], title: str = "fit", path: str | Path | None = None) -> Figure:
    """Measured and fitted loops, and below each the residual over time, for the first 24 tests.

    Raises InputError for a path that cannot be written.
    """
    drawn, across = tests[:DRAWN], min(len(tests), ACROSS)
    rows = -(-len(drawn) // across)
    with page(max(4.2 * across, 6.0), 6.4 * rows, path, "fit") as figure:
        first = f", the first {DRAWN} of them" if len(tests) > DRAWN else ""
        headline(figure, f"{title} of {len(tests)} test{'' if len(tests) == 1 else 's'}{first}")
        grid = figure.subplots(2 * rows, across, squeeze=False, height_ratios=(2, 1) * rows)
        pairs = [pair for row in range(rows) for pair in zip(grid[2 * row], grid[2 * row + 1], strict=True)]
        for loop, below in pairs[len(drawn) :]:
            loop.remove()
            below.remove()
        for test, (loop, below) in zip(drawn, pairs, strict=False):
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
    """Residuals of all tests: over the displacement, over the force, and against those of a normal distribution.

    Where the model is right they are a band about zero without a pattern, and the last curve follows its line. Raises
    InputError for a path that cannot be written.
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
