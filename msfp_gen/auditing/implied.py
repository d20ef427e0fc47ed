"""The friction coefficients that rows of full sliding imply: their range by speed, by axial force, and by time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from msfp_gen.auditing.case import NONE, AuditCase, Drawing, Finding, si
from msfp_gen.auditing.sliding import FEWEST_ROWS
from msfp_gen.common.arrays import Array

PARTS = 3  # into which the rows are divided by a quantity, alike in number
VARIES = 0.1  # spread of a quantity over its median, 5 to 95 % of the rows, from which on they are divided


class ImpliedRange(NamedTuple):
    """Friction coefficients in some of the rows.

    quantity: "speed", "axial force" or "time". unit: its unit. low, high: its range in these rows [unit]. rows: their
    number. least, median, most: of the implied coefficient, 5, 50 and 95 % of the rows [-]. law: median by the law [-].
    """

    quantity: str
    unit: str
    low: float
    high: float
    rows: int
    least: float
    median: float
    most: float
    law: float

    @property
    def cells(self) -> tuple[str, ...]:
        """A row of a table."""
        place = f"{si(self.low, self.unit)} to {si(self.high, self.unit)}"
        spread = f"{self.least:.4g} to {self.most:.4g}"
        return (self.quantity, place, f"{self.rows}", f"{self.median:.4g}", spread, f"{self.law:.4g}")


def _quantities(case: AuditCase) -> dict[str, tuple[str, Array]]:
    """Name of a quantity -> its unit, and its values in the rows of full sliding, where they vary enough to tell."""
    data, rows = case.data, case.sliding.rows
    speed = np.hypot(*data.velocity.T)
    found = {"speed": ("m/s", speed[rows]), "axial force": ("N", data.axial[rows]), "time": ("s", data.time[rows])}
    spread = {name: np.quantile(values, [0.05, 0.5, 0.95]) for name, (_, values) in found.items()}
    return {name: found[name] for name, (low, middle, high) in spread.items() if high - low > VARIES * abs(middle)}


def implied_ranges(case: AuditCase) -> tuple[ImpliedRange, ...]:
    """The ranges of the coefficient; none where the rows are too few, or lack columns."""
    if case.lacks("displacement", "force", "axial") or len(case.sliding.rows) < PARTS * FEWEST_ROWS:
        return ()
    found, implied, law = [], case.sliding.implied, case.sliding.law.heated[case.sliding.rows]
    for name, (unit, values) in _quantities(case).items():
        for part in np.array_split(np.argsort(values, kind="stable"), PARTS):
            low, high = values[part[[0, -1]]].tolist()
            least, median, most = np.quantile(implied[part], [0.05, 0.5, 0.95]).tolist()
            stated = float(np.median(law[part]))
            found.append(ImpliedRange(name, unit, low, high, len(part), least, median, most, stated))
    return tuple(found)


def implied_figures(case: AuditCase, ranges: tuple[ImpliedRange, ...]) -> tuple[Finding, ...]:
    """The coefficients drawn over every quantity, each with its ranges in a sentence."""
    found, sliding = [], case.sliding
    for name, (unit, values) in _quantities(case).items() if ranges else ():
        own = [one for one in ranges if one.quantity == name]
        said = "; ".join(f"{one.median:.4g} at {one.cells[1]}, where the law has {one.law:.4g}" for one in own)
        scale, shown = (1e-3, "kN") if unit == "N" else (1.0, unit)
        x = scale * values
        curves = [("implied", x, sliding.implied), ("law", x, sliding.law.heated[sliding.rows])]
        drawing = Drawing(curves, f"{name} [{shown}]", "friction coefficient", None, True)
        found.append(Finding(f"by_{name}", f"coefficient by {name}", NONE, f"median {said}", drawing=drawing))
    return tuple(found)
