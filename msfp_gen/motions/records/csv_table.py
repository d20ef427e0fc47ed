"""CSV tables whose header names times, components and units: `time [s], a1 [m/s^2], a2 [g]` or `time [s], u1 [mm]`."""

from __future__ import annotations

import re
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.output import check_output, replacing
from msfp_gen.motions.records.record import Record, common_window, derived_note, differentiated, stem
from msfp_gen.motions.records.text import Lines, column, even_step, read_lines

COLUMN = re.compile(r"\s*(\w+)\s*(?:\[([^\]]*)\]|\(([^)]*)\))\s*")
_QUANTITIES = {"a": ("acceleration", "m/s^2"), "v": ("velocity", "m/s"), "u": ("displacement", "m")}


@dataclass(frozen=True, eq=False)
class RecordTable:
    """Times and three components of one quantity.

    Attributes:
        name: name of the file without its suffix.
        quantity: "acceleration", "velocity" or "displacement".
        time: ndarray, shape (k,), [s].
        values: ndarray, shape (k, 3), [m/s^2], [m/s] or [m].
        units: units in the header.
        notes: on missing components, whose values are zero, and on a last number that may be cut.
        lines: index of the line of every row.
    """

    name: str
    quantity: str
    time: Array
    values: Array
    units: str
    notes: tuple[str, ...]
    lines: tuple[int, ...]


def matches(lines: Lines) -> bool:
    """Whether all columns of the first line that is not a comment have the form `name [unit]`."""
    return all(COLUMN.fullmatch(c) for c in first_line(lines)[1].split(","))


def read_table(path: str | PathLike[str]) -> RecordTable:
    """Read a table of accelerations (a1, a2, a3), velocities (v1, ...) or displacements (u1, ...).

    Lines that begin with # are comments. Raises InputError that names file, line and reason.
    """
    return _table(read_lines(Path(path)))


def read(lines: Lines) -> Record:
    """The record in a table. Raises InputError unless its times are evenly spaced."""
    table = _table(lines)
    step = even_step(lines, table.time, table.lines)
    return Record(
        name=table.name,
        time_step=step,
        units=table.units,
        notes=table.notes + derived_note(table.quantity),
        metadata={"format": "CSV", "file": lines.path.name},
        quantity=table.quantity,
        **differentiated(table.quantity, table.values, step),
    )


def write_csv(record: Record, path: str | PathLike[str]) -> Path:
    """Write times and accelerations of a record, with units in the header and its origin in comments.

    `read_record` reproduces the numbers exactly. Raises InputError for a path that cannot be written.
    """
    target = check_output(Path(path), (".csv",))
    about = {"record": record.name, "station": record.station, "start": record.start_time, **record.metadata}
    lines = [f"# {key}: {' '.join(str(value).split())}" for key, value in about.items() if value]
    lines += [f"# note: {note}" for note in record.notes]
    lines.append("time [s], " + ", ".join(f"a{i} [m/s^2]" for i in (1, 2, 3)))
    rows = np.column_stack([record.time, record.acceleration]).tolist()
    lines += [", ".join(map(repr, row)) for row in rows]
    with replacing(target) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return target


def first_line(lines: Lines, header: str = "time [s], a1 [m/s^2], ...") -> tuple[int, str]:
    """Index and text of the first line that is neither blank nor a comment. header: what it should be."""
    for index, line in enumerate(lines.lines):
        if line.strip() and not line.lstrip().startswith("#"):
            return index, line
    lines.fail(0, f"no header; begin with: {header}")


def _table(lines: Lines) -> RecordTable:
    head, header = first_line(lines)
    names, units, factors = _columns(lines, head, header)
    rows, last, places = [], [], []
    for index in range(head + 1, len(lines)):
        if lines[index].strip() and not lines[index].lstrip().startswith("#"):
            fields = lines[index].split(",")
            if len(fields) != len(names):
                lines.fail(index, f"{len(fields)} columns, the header names {len(names)}")
            rows.append(lines.numbers(index, fields))
            last.append(fields[-1])
            places.append(index)
    if not rows:
        lines.fail(head, "no rows of numbers after the header")
    notes = lines.check_end(places[-1], last)
    data = {name: column([row[i] for row in rows]) * factors[i] for i, name in enumerate(names)}
    letter = next(n[0] for n in names if n != "time")
    values, missing = common_window([data.get(f"{letter}{i}") for i in (1, 2, 3)])
    return RecordTable(
        stem(lines.path), _QUANTITIES[letter][0], data["time"], values, ", ".join(units), missing + notes, tuple(places)
    )


def _columns(lines: Lines, head: int, header: str) -> tuple[list[str], list[str], list[float]]:
    """Names, units and factors to SI of the columns; `head` is the index of the line of the header."""
    from msfp_gen.common.fields import to_si

    matches = [COLUMN.fullmatch(c) for c in header.split(",")]
    for text, match in zip(header.split(","), matches, strict=True):
        if match is None:
            lines.fail(
                head, f"column {text.strip()[:24]!r} is not of the form `name [unit]`, as in: time [s], a1 [m/s^2]"
            )
    columns = [m for m in matches if m is not None]
    names, units = [m[1].lower() for m in columns], [(m[2] or m[3] or "").strip() for m in columns]
    parts = [n for n in names if n != "time"]
    if "time" not in names or not parts or len(set(names)) < len(names):
        lines.fail(head, f"columns {', '.join(names)}; give time and at least one of a1, a2, a3, each once")
    letter = parts[0][:1]
    if letter not in _QUANTITIES or any(p not in {f"{letter}{i}" for i in (1, 2, 3)} for p in parts):
        lines.fail(head, f"columns {', '.join(parts)}; give a1, a2, a3 or v1, v2, v3 or u1, u2, u3")
    factors = []
    for name, unit in zip(names, units, strict=True):
        try:
            factors.append(to_si(f"1 {unit}", "s" if name == "time" else _QUANTITIES[letter][1]))
        except ValueError as error:
            lines.fail(head, f"column {name}: {error}")
    return names, units, factors
