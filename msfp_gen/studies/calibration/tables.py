"""Tables of a fit for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.tables import Table

if TYPE_CHECKING:
    from msfp_gen.studies.calibration.outcome import Estimate, Fit


def fit_tables(found: Fit) -> list[Table]:
    """Estimates, correlations, tests, and what limits the fit."""
    numbers = [str(i) for i in range(1, len(found.estimates) + 1)]
    columns = ("parameter", "value", "95 % interval", "start", "unit")
    tables = [Table(f"fitted in {found.evaluations} evaluations", columns, [_row(e) for e in found.estimates])]
    if len(numbers) > 1:
        rows = [
            (estimate.name, *(f"{value:+.3f}" if np.isfinite(value) else "-" for value in line))
            for estimate, line in zip(found.estimates, found.correlation, strict=True)
        ]
        title = f"correlation, in the same order; condition {found.condition:.3g}"
        tables.append(Table(title, ("parameter", *numbers), rows))
    shares = [
        (test.measured.name, f"{test.deviation:.4g}", f"{100 * test.share:.2f}", str(len(test.force)))
        for test in found.tests
    ]
    tables.append(Table("residuals", ("test", "deviation [N]", "over the peak [%]", "rows"), shares))
    remarks = [(text,) for text in (*found.unidentified, *found.notes)]
    return [*tables, Table("what limits this fit", (), remarks)] if remarks else tables


def _row(estimate: Estimate) -> tuple[str, ...]:
    spread = f"{estimate.low:.4g} to {estimate.high:.4g}" if np.isfinite(estimate.deviation) else "not determined"
    value = f"{estimate.value:.5g}" + (" (bound)" if estimate.at_bound else "")
    return estimate.name, value, spread, f"{estimate.start:.4g}", estimate.unit or "-"
