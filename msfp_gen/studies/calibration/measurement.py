"""First step of a calibration: `Measurement`, the time, displacement and force of a laboratory test, from a text file.

`FittedTest` has a measurement beside the force of the fitted run.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import to_si
from msfp_gen.motions.checks import finite
from msfp_gen.motions.records.text import Lines, read_lines

UNITS = {"time": "s", "displacement": "m", "force": "N"}
LEAST_ROWS, MOST_ROWS = 20, 2000  # rows of a test; more rows are averaged in blocks
_AT_CENTRE = 0.05  # permitted first displacement, as a share of the largest
_CELL = re.compile(r"\s*(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\))?\s*")


@dataclass(frozen=True, eq=False)
class Measurement:
    """One test: a prescribed displacement along E1, and the measured force.

    Attributes:
        name: in messages, tables and figures.
        time: ndarray, shape (k,), [s], increasing.
        displacement: across the bearing, base less top, ndarray, shape (k,), [m].
        force: of the bearing on the support of the top plate, ndarray, shape (k,), [N]. In a loop it has the sign of
            the displacement. If both have the other sign, the fitted values are the same.
        axial_load: [N]; None: the axial load of the scene.
        weight: of the residuals of this test [-]; 2 counts as a standard deviation half as large.

    Raises:
        InputError: fewer than 20 rows, numbers that are not finite, times that do not increase, a displacement that
            does not begin at the centre, or a loop that gives energy.
    """

    name: str
    time: Array
    displacement: Array
    force: Array
    axial_load: float | None = None
    weight: float = 1.0

    def __post_init__(self) -> None:
        for name in UNITS:
            values = finite(f"{self.name}: {name}", getattr(self, name))
            if values.ndim != 1 or values.shape != np.shape(self.time):
                raise InputError(f"{self.name}: {name} has shape {values.shape}; give one number for each time")
            object.__setattr__(self, name, values)
        for name in ("axial_load", "weight"):
            value = getattr(self, name)
            if value is not None and not 0 < value < np.inf:
                raise InputError(f"{self.name}: {name} = {value}: give a positive number")
        self._check_test()

    def _check_test(self) -> None:
        if len(self.time) < LEAST_ROWS:
            raise InputError(f"{self.name}: {len(self.time)} rows; give at least {LEAST_ROWS}")
        back = np.flatnonzero(np.diff(self.time) <= 0)
        if len(back):
            raise InputError(
                f"{self.name}, row {back[0] + 2}: time = {self.time[back[0] + 1]:g} s does not increase; sort or cut it"
            )
        for name in ("displacement", "force"):
            if not np.ptp(getattr(self, name)):
                raise InputError(f"{self.name}: {name} is constant; give the column that was measured")
        first, largest = abs(self.displacement[0]), np.abs(self.displacement).max()
        if first > _AT_CENTRE * largest:
            raise InputError(
                f"{self.name}, row 1: displacement = {self.displacement[0]:g} m; a run starts at the centre of the "
                "bearing, so cut the data to begin there, or subtract the offset of the gauge"
            )
        if np.trapezoid(self.force, self.displacement) <= 0:
            raise InputError(
                f"{self.name}: the loop gives energy, so force and displacement have opposite signs; change one of them"
            )

    def sampled(self) -> Measurement:
        """The test with at most 2000 rows: the first row, then means of blocks of rows."""
        size = -(-(len(self.time) - 1) // (MOST_ROWS - 1))
        if size == 1:
            return self
        starts = np.r_[0, np.arange(1, len(self.time), size)]
        counts = np.diff(np.r_[starts, len(self.time)])
        changes: dict[str, Any] = {name: np.add.reduceat(getattr(self, name), starts) / counts for name in UNITS}
        return replace(self, **changes)


def read_measurement(
    path: str | Path,
    columns: Mapping[str, str] | None = None,
    *,
    axial_load: float | None = None,
    weight: float = 1.0,
) -> Measurement:
    """Read a test from a text table with a header; columns are separated by commas, semicolons or tabs.

    path: of the file; lines that begin with # are comments. columns: `time`, `displacement`, `force` -> name in the
    header, with a unit in brackets where the header has none, such as {"force": "Load cell 1 [kN]"}; without an entry
    the name is the same. axial_load, weight: see `Measurement`.

    Raises InputError of one line that names file, row and column.
    """
    lines = read_lines(Path(path))
    unknown = sorted(set(columns or {}) - set(UNITS))
    if unknown:
        raise InputError(f"columns: {unknown[0]!r} is no column of a test; give {', '.join(UNITS)}")
    head = next((i for i, text in enumerate(lines.lines) if text.strip() and not text.lstrip().startswith("#")), None)
    if head is None:
        lines.fail(0, "no header; begin with: time [s], displacement [mm], force [kN]")
    separator = next((mark for mark in ("\t", ";") if mark in lines[head]), ",")
    header = [text.strip().strip('"') for text in lines[head].split(separator)]
    places = {name: _place(lines, head, header, name, (columns or {}).get(name, name)) for name in UNITS}
    rows = _rows(lines, head, separator, header, places)
    values = dict(zip(UNITS, np.array(rows).T * [[factor] for _, factor in places.values()], strict=True))
    return Measurement(Path(path).name, **values, axial_load=axial_load, weight=weight)


def _rows(
    lines: Lines, head: int, separator: str, header: list[str], places: Mapping[str, tuple[int, float]]
) -> list[list[float]]:
    """Time, displacement and force of every row [units of the file]. head: index of the header line."""
    # places: name -> (index of the column, factor of its unit to SI). Raises InputError.
    rows, last_cells, end = [], [], head
    for index in range(head + 1, len(lines)):
        if not lines[index].strip() or lines[index].lstrip().startswith("#"):
            continue
        cells = lines[index].split(separator)
        if len(cells) != len(header):
            lines.fail(index, f"{len(cells)} columns, the header names {len(header)}")
        last_cells.append(cells[-1])
        end = index
        rows.append([_number(lines, index, header[at], cells[at]) for at, _ in places.values()])
        if len(rows) > 1 and rows[-1][0] <= rows[-2][0]:
            at = places["time"][0]
            lines.fail(index, f"column {header[at]!r}: {cells[at].strip()} does not increase; sort or cut the data")
    if not rows:
        lines.fail(head, "no rows of numbers after the header")
    lines.check_end(end, last_cells)
    return rows


def _number(lines: Lines, index: int, column: str, text: str) -> float:
    try:
        return lines.number(index, text)
    except InputError:
        lines.fail(index, f"column {column!r}: {text.strip()[:24]!r} is not a finite number; repair or cut the data")


def _place(lines: Lines, head: int, header: list[str], name: str, column: str) -> tuple[int, float]:
    """(index of a column in the header, factor of its unit to SI). Raises InputError."""
    column_name, unit = _split(column)
    places = [i for i, text in enumerate(header) if text.lower() == column.strip().lower()]
    places = places or [i for i, text in enumerate(header) if _split(text)[0].lower() == column_name.lower()]
    if len(places) != 1:
        what = "no column" if not places else f"{len(places)} columns"
        names = ", ".join(repr(text[:24]) for text in header[:12])
        lines.fail(head, f"{what} {column!r} among {names}; name the one with columns {name}=NAME")
    unit = unit or _split(header[places[0]])[1]
    if not unit:
        lines.fail(
            head,
            f"column {header[places[0]]!r} has no unit; write {column_name} [{UNITS[name]}], here or in the columns",
        )
    try:
        return places[0], to_si(f"1 {unit}", UNITS[name])
    except ValueError as error:
        lines.fail(head, f"column {header[places[0]]!r}: {error}")


def _split(text: str) -> tuple[str, str]:
    """Name and unit of a header cell such as `force [kN]`."""
    match = _CELL.fullmatch(text)
    assert match is not None  # the pattern matches every text of one line
    return match[1], (match[2] or match[3] or "").strip()


@dataclass(frozen=True, eq=False)
class FittedTest:
    """A test beside the run of the fitted bearing.

    Attributes:
        measured: the test, sampled to at most 2000 rows.
        force: of the run, with the offset of the test, ndarray, shape (T,), [N].
    """

    measured: Measurement
    force: Array

    @property
    def residual(self) -> Array:
        """Force of the run less measured force, ndarray, shape (T,), [N]."""
        return self.force - self.measured.force

    @property
    def deviation(self) -> float:
        """Root mean square of the residual [N]."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def share(self) -> float:
        """`deviation` over the largest measured force [-]."""
        return self.deviation / float(np.abs(self.measured.force).max())
