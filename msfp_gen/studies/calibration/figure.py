"""Figure of a fit: measured and fitted loops of every test, and the residuals over time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from msfp_gen.figures import COLOURS, INK, displacement, displacement_label, engineering, force, page
from msfp_gen.figures.style import HAIR, THIN, headline, plain
from msfp_gen.results.sign import shown_sign

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from msfp_gen.studies.calibration.fitted_test import FittedTest

DRAWN = 6  # tests; more do not fit on a page


def plot_fit(tests: Sequence[FittedTest], title: str = "fit", path: str | Path | None = None) -> Figure:
    """Loops above, residuals below, one column for each of the first six tests.

    Raises InputError for a path that cannot be written.
    """
    drawn = tests[:DRAWN]
    with page(max(4.2 * len(drawn), 6.0), 6.4, path, "fit") as figure:
        headline(figure, f"{title} of {len(tests)} test{'' if len(tests) == 1 else 's'}")
        grid = figure.subplots(2, len(drawn), squeeze=False, height_ratios=(2, 1))
        for test, loop, below in zip(drawn, *grid, strict=True):
            measured = test.measured
            scale, small = engineering(measured.force, "N"), engineering(test.residual, "N")
            u = displacement(measured.displacement)
            loop.plot(u, force(measured.force, scale), color=COLOURS[0], linewidth=THIN, label="measured")
            loop.plot(u, force(test.force, scale), color=COLOURS[1], linewidth=THIN, label="fitted")
            loop.set(title=plain(measured.name), xlabel=displacement_label(0))
            loop.set_ylabel(f"force {shown_sign().force} [{scale.unit}]")
            loop.legend(loc="upper left")
            below.plot(measured.time, force(test.residual, small), color=INK, linewidth=HAIR)
            below.set(xlabel="time t [s]", ylabel=f"fitted − measured [{small.unit}]")
    return figure
