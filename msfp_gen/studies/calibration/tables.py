"""Tables of a fit, for the terminal and for its page."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.tables import Table

if TYPE_CHECKING:
    from msfp_gen.studies.calibration.fit_result import Estimate, Fit


def fit_tables(found: Fit) -> list[Table]:
    """Estimates, correlations, tests, and what limits the fit."""
    tables = [estimate_table(found)]
    if len(found.estimates) > 1:
        tables.append(correlation_table(found))
    tables.append(residual_table(found))
    remarks = [(text,) for text in (*found.unidentified, *found.notes)]
    return [*tables, Table("what limits this fit", (), remarks)] if remarks else tables


def estimate_table(found: Fit) -> Table:
    """Values, intervals and starts."""
    columns = ("parameter", "value", "95 % interval", "start", "unit")
    title = f"fitted in {found.evaluations} evaluations, the last with rtol {found.rtol:g}"
    return Table(title, columns, [_row(e) for e in found.estimates])


def correlation_table(found: Fit) -> Table:
    """Correlations of the estimates, in their order."""
    numbers = [str(i) for i in range(1, len(found.estimates) + 1)]
    rows = [
        (estimate.name, *(f"{value:+.3f}" if np.isfinite(value) else "-" for value in line))
        for estimate, line in zip(found.estimates, found.correlation, strict=True)
    ]
    return Table(
        f"correlation, in the same order; condition {found.condition:.3g}",
        ("parameter", *numbers),
        rows,
    )


def residual_table(found: Fit) -> Table:
    """Deviation of every test."""
    shares = [
        (test.measured.name, f"{test.deviation:.4g}", f"{100 * test.share:.2f}", str(len(test.force)))
        for test in found.tests
    ]
    return Table("residuals", ("test", "deviation [N]", "over the peak [%]", "rows"), shares)


def _row(estimate: Estimate) -> tuple[str, ...]:
    spread = f"{estimate.low:.4g} to {estimate.high:.4g}" if np.isfinite(estimate.high) else "not determined"
    value = f"{estimate.value:.5g}" + (" (bound)" if estimate.at_bound else "")
    return estimate.name, value, spread, f"{estimate.start:.4g}", estimate.unit or "-"
