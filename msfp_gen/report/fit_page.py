"""The HTML page of a fit: values and intervals, what the tests do not tell, loops, residuals, the fitted scene."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.output import check_output, write_bytes
from msfp_gen.common.tables import Table
from msfp_gen.report.content import KILO, MILLI, picture, render
from msfp_gen.studies.calibration.fit_result import correlation_table, estimate_table, residual_table
from msfp_gen.studies.calibration.intervals import lag_one
from msfp_gen.version import __version__

if TYPE_CHECKING:
    from msfp_gen.studies.calibration import Estimate, Fit, FittedTest

TERMS = (
    ("value, start", "the number after the fit, and before it, in the scene that was given."),
    ("95 % interval", "where the true value lies in 95 of 100 such fits, if the model is right. It contains the noise "
     "of the tests, also where it is correlated, and the error of the runs; no error of the model, of the load cell or "
     "of the gauges."),
    ("error of the runs", "of a value, from the errors of the runs at the stated rtol and of their derivatives. By so "
     "much the interval is longer at both ends."),
    ("bounds", "between which the value was sought."),
    ("correlation", "of the errors of two values. Near +1 or −1 the tests determine only one combination of both."),
    ("condition", "of the Jacobian, with columns of unit length: 1 where every value has an effect of its own; above "
     "1e4 a combination of values is not determined."),
    ("residual", "fitted less measured force. In the figures it should be a band about zero without a pattern; where "
     "there is one, the model misses something, which the intervals contain as correlated noise and nothing more."),
    ("deviation", "root mean square of the residuals."),
    ("correlation of consecutive residuals", "near 0 for independent noise; from 0.5 the page has a note."),
    ("weight", "of the residuals of a test: 2 counts as a standard deviation half as large."),
    ("offset", "constant that is added to the force of the run of one test."),
    ("u", "displacement across the bearing: base less top. The axis of a figure states its sign."),
)  # fmt: skip


def write_fit_report(fit: Fit, path: str | Path) -> Path:
    """Write the page of a fit to `path`; the file appears only when complete, and loads no other file.

    Raises InputError for a path that does not end in .html or cannot be written.
    """
    from msfp_gen.report.page import REPORT_SUFFIXES

    path = check_output(path, REPORT_SUFFIXES)
    write_bytes(path, [fit_html(fit).encode()])
    return path


def fit_html(fit: Fit) -> str:
    """The page of a fit as text."""
    from msfp_gen.buildings.explain import explain
    from msfp_gen.scene.file.loader import scene_text
    from msfp_gen.studies.calibration.fit_result import plot_fit, plot_residuals

    limits = {"What the tests do not tell": fit.unidentified, "Notes": fit.notes}
    return render(
        "fit.html.jinja",
        name=f"{fit.scene.name or 'unnamed scene'}: calibration to tests",
        kind="fit",
        lead=_lead(fit),
        values=_values(fit),
        limits=[(title, lines) for title, lines in limits.items() if lines],
        correlation=correlation_table(fit) if len(fit.estimates) > 1 else None,
        tests=_tests(fit),
        figures=[
            picture("Measured and fitted loops, and residuals over time", plot_fit(fit.tests)),
            picture("Where the residuals lie", plot_residuals(fit.tests)),
        ],
        settings=explain(fit.scene),
        scene=scene_text(fit.scene),
        provenance=_provenance(fit),
        terms=TERMS,
    )


def _lead(fit: Fit) -> str:
    """What was fitted to what, in one sentence."""
    rows, offsets = (
        sum(len(test.force) for test in fit.tests),
        sum(not np.isfinite(e.bounds[1]) for e in fit.estimates),
    )
    values = _count(len(fit.estimates) - offsets, "value")
    shifts = f" and {_count(offsets, 'offset')} of force" if offsets else ""
    return (
        f"{values} of the scene{shifts} fitted to "
        f"{_count(len(fit.tests), 'laboratory test')} of {_count(rows, 'row')}, by least squares of the force with "
        f"exact derivatives, in {_count(fit.evaluations, 'evaluation')}, by msfp-gen {__version__}."
    )


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _values(fit: Fit) -> Table:
    """The table of estimates with the change from the start and the bounds."""
    table = estimate_table(fit)
    pairs = zip(table.rows, fit.estimates, strict=True)
    rows = [(*row, _run_error(estimate), _change(estimate), _bounds(estimate)) for row, estimate in pairs]
    return Table(table.title, (*table.columns, "error of the runs", "change", "bounds"), rows)


def _run_error(estimate: Estimate) -> str:
    return f"{estimate.run_error:.2g}" if np.isfinite(estimate.run_error) else "not measured"


def _change(estimate: Estimate) -> str:
    return f"{100 * (estimate.value / estimate.start - 1):+.1f} %" if estimate.start else "-"


def _bounds(estimate: Estimate) -> str:
    return "{:.4g} to {:.4g}".format(*estimate.bounds) if np.isfinite(estimate.bounds).all() else "none"


def _tests(fit: Fit) -> Table:
    """The table of deviations with what was tested."""
    table = residual_table(fit)
    rows = [
        (
            *row,
            f"{np.abs(test.measured.displacement).max() * MILLI:.4g}",
            f"{np.abs(test.measured.force).max() * KILO:.4g}",
            _load(fit, test),
            f"{test.measured.weight:g}",
            f"{lag_one([test.residual]):.2f}",
        )
        for row, test in zip(table.rows, fit.tests, strict=True)
    ]
    more = ("largest u [mm]", "largest force [kN]", "axial load [kN]", "weight", "correlation of consecutive residuals")
    return Table(table.title, (*table.columns, *more), rows)


def _load(fit: Fit, test: FittedTest) -> str:
    """Axial load of a test, or that of the scene [kN]."""
    load = test.measured.axial_load
    return f"{(fit.scene.top.axial_load if load is None else load) * KILO:.5g}"  # type: ignore[attr-defined]


def _provenance(fit: Fit) -> Table:
    """Versions and methods."""
    import scipy

    solver = fit.scene.solver
    rows = [
        ("msfp gen", __version__),
        ("numpy", np.__version__),
        ("scipy", scipy.__version__),
        ("optimiser", 'scipy.optimize.least_squares, method "trf", exact Jacobian'),
        ("intervals", "Laplace with autocorrelated noise of each test, Student's t, and the error of the runs"),
        ("method of the runs", solver.method),
        ("rtol of the runs", f"{solver.rtol:g} in the search, {fit.rtol:g} at its end"),
    ]
    return Table("versions and methods", (), rows)
