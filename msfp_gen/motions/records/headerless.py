"""Files of numbers without a header: the user states the unit, and the time step where the first column is no time."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.motions.records.record import COMPONENTS, UNITS, UNKNOWN, Channel, Record, assemble_record
from msfp_gen.motions.records.text import Lines, even_step

FORMAT = "numbers without a header"
_BETWEEN = re.compile(r"\s*[,;]\s*|\s+")
_SEQUENCE = 4  # columns from which the rows of a file with a time step are one sequence, as in PEER files

NumberedLine = tuple[int, list[str]]  # index of the line, its fields


def matches(lines: Lines) -> bool:
    """Whether the first line that is not a comment has numbers alone."""
    try:
        _, fields = _rows(lines, 1)[0]
        return all(np.isfinite([float(field) for field in fields]))
    except (ValueError, IndexError):
        return False


def read(parts: Sequence[Lines], unit: str | None, time_step: float | None) -> Record:
    """The record in one file, or in several of one recording.

    A file has one to three columns, along E1, E2, E3 in the order of columns and files, after a column of times unless
    `time_step` [s] is given; with it a file of four or more columns is one sequence, row by row. unit: of the values,
    one of `UNITS`. Raises InputError.
    """
    if unit is None:
        raise InputError(f"unit: {parts[0].path.name} has no header that states it; give the unit of its numbers")
    quantity, factor = UNITS.get("".join(unit.lower().split()), ("", 0.0))
    if not quantity:
        raise InputError(f"unit = {unit!r}: no unit of a ground motion; give one of {', '.join(UNITS)}")
    channels: list[Channel] = []
    notes: tuple[str, ...] = ()
    for lines in parts:
        rows = _rows(lines)
        notes += lines.check_end(rows[-1][0], [fields[-1] for _, fields in rows])
        values, step = _values(lines, rows, time_step)
        if len(channels) + values.shape[1] > len(COMPONENTS):
            lines.fail(rows[0][0], "more than 3 columns of values, along E1, E2 and E3; leave some out")
        for column in values.T:
            label = f"column {len(channels) + 1}"  # no direction: their order decides
            channels.append(Channel(lines.path, rows[0][0], quantity, UNKNOWN, step, column * factor, label, unit))
    return assemble_record(channels, FORMAT, notes)


def _values(lines: Lines, rows: list[NumberedLine], time_step: float | None) -> tuple[Array, float]:
    """Values of the rows of a file, shape (k, columns), and its time step [s]."""
    first, width = rows[0][0], len(rows[0][1])
    sequence = time_step is not None and width >= _SEQUENCE
    for number, (index, fields) in enumerate(rows):
        short = sequence and number == len(rows) - 1 and len(fields) < width
        if len(fields) != width and not short:
            lines.fail(index, f"{len(fields)} columns, line {first + 1} has {width}")
    numbers = [lines.numbers(index, fields) for index, fields in rows]
    steps = np.diff([row[0] for row in numbers])
    rises = width > 1 and len(steps) > 0 and bool(np.all(steps > 0))
    if time_step is None:
        if width == 1:
            lines.fail(first, "one column of numbers; give the time_step between them")
        if not rises:
            lines.fail(first, "the first column is no time, as it does not rise; give the time_step between the rows")
        values = np.array(numbers)
        return values[:, 1:], even_step(lines, values[:, 0], [index for index, _ in rows])
    if rises and np.ptp(steps) < 0.1 * steps.mean():
        lines.fail(first, "the first column rises evenly, as times do; leave out time_step")
    if sequence:
        return np.array([value for row in numbers for value in row])[:, None], time_step
    return np.array(numbers), time_step


def _rows(lines: Lines, most: int | None = None) -> list[NumberedLine]:
    """Index and fields of the lines that are neither blank nor comments, at most so many."""
    found: list[NumberedLine] = []
    for index, line in enumerate(lines.lines):
        if (text := line.strip().rstrip(",;")) and not text.startswith(("#", "%")):
            found.append((index, _BETWEEN.split(text)))
        if len(found) == most:
            break
    return found
