"""PEER .AT2: one component of acceleration a file, in g."""

from __future__ import annotations

import re
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from msfp_gen.errors import InputError
from msfp_gen.piecewise import Array
from msfp_gen.records.record import G, Record, common_window, stem
from msfp_gen.records.text import Lines, column, read_lines

_HEADER_LINES = 10
_NUMBER = r"(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)"
# The line of counts "has changed multiple times": NPTS= 4000, DT= .0100 SEC and 4000 .0100 NPTS, DT are both common.
_COUNTS = (
    re.compile(rf"NPTS\s*[=:]?\s*(\d{{1,9}})(?!\d)\s*,?\s*DT\s*[=:]?\s*{_NUMBER}(?![\w.])", re.I),
    re.compile(rf"^\s*(\d{{1,9}})(?!\d)\s*,?\s+{_NUMBER}\s*,?\s*NPTS\s*,\s*DT", re.I),
)
_UNIT = re.compile(r"UNITS\s+OF\s+(\S+)", re.I)
_STUCK = re.compile(r"(?<=[\d.])(?=[+-])")  # between the numbers of 1.2-3.4, not inside 1.2E-3


@dataclass(frozen=True)
class _Component:
    path: Path
    title: str
    time_step: float
    values: Array


def understands(lines: Lines) -> bool:
    """Whether one of the first lines gives NPTS."""
    return any("NPTS" in line.upper() for line in lines.lines[:_HEADER_LINES])


def read_at2(
    h1: str | PathLike[str], h2: str | PathLike[str] | None = None, up: str | PathLike[str] | None = None
) -> Record:
    """A record from up to three .AT2 files, for E1, E2 and E3; a missing component is zero and noted.

    Raises InputError naming file, line and reason; also if the files' time steps differ.
    """
    paths = [None if p is None else Path(p) for p in (h1, h2, up)]
    return _joined([None if p is None else _component(read_lines(p)) for p in paths])


def read(lines: Lines) -> Record:
    """A record whose only component, E1, is in the file."""
    return _joined([_component(lines), None, None])


def _joined(parts: list[_Component | None]) -> Record:
    present = [p for p in parts if p is not None]
    first = present[0]
    for part in present[1:]:
        if part.time_step != first.time_step:
            raise InputError(
                f"{part.path.name}: time step {part.time_step:g} s, but {first.path.name} has {first.time_step:g} s; "
                "give components of one recording"
            )
    values, notes = common_window([None if p is None else p.values for p in parts])
    titles = [p.title if p else "" for p in parts]
    return Record(
        name=stem(first.path),
        time_step=first.time_step,
        acceleration=values * G,
        channels=(titles[0], titles[1], titles[2]),
        station=first.title,
        units="g",
        metadata={"format": "PEER AT2", "file": ", ".join(p.path.name for p in present)},
        notes=notes,
    )


def _component(lines: Lines) -> _Component:
    head = next((i for i in range(min(_HEADER_LINES, len(lines))) if "NPTS" in lines[i].upper()), None)
    if head is None:
        lines.fail(0, f"no NPTS and DT in the first {_HEADER_LINES} lines; not a PEER .AT2 file")
    counts = next((m for pattern in _COUNTS if (m := pattern.search(lines[head]))), None)
    if counts is None:
        lines.fail(head, f"{lines[head].strip()[:40]!r} does not give NPTS and DT")
    quantity = next((i for i in range(head) if _UNIT.search(lines[i])), None)
    if quantity is None:
        lines.fail(head, "no line before this one says ACCELERATION ... IN UNITS OF G")
    unit = _UNIT.search(lines[quantity])
    if unit is None or unit[1].upper().rstrip(".,") != "G" or "ACC" not in lines[quantity].upper():
        lines.fail(quantity, f"{lines[quantity].strip()[:60]!r} is not acceleration in g; give the .AT2 file")
    points, step = int(counts[1]), lines.positive(head, "DT", counts[2])
    values: list[float] = []
    for index in range(head + 1, len(lines)):
        values += lines.numbers(index, _STUCK.sub(" ", lines[index]).split())
    if len(values) != points:
        lines.fail(head, f"NPTS promises {points} values, the file holds {len(values)}; fetch it again")
    title = lines[quantity - 1].strip() if quantity else ""
    return _Component(lines.path, title, step, column(values))
