"""PEER .AT2, .VT2 and .DT2: one component of acceleration, velocity or displacement in a file."""

from __future__ import annotations

import re
from dataclasses import replace
from os import PathLike
from pathlib import Path

from msfp_gen.common.errors import InputError
from msfp_gen.motions.records.record import (
    DOWN,
    QUANTITIES,
    UNKNOWN,
    UP,
    Channel,
    Record,
    assemble_record,
    si_factor,
    stem,
)
from msfp_gen.motions.records.text import Lines, column, read_lines

FORMAT = "PEER AT2, VT2, DT2"
_HEADER_LINES = 10
_NUMBER = r"(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)"
# The line with NPTS and DT has had several forms: NPTS= 4000, DT= .0100 SEC and 4000 .0100 NPTS, DT are both common.
_COUNTS = (
    re.compile(rf"NPTS\s*[=:]?\s*(\d{{1,9}})(?!\d)\s*,?\s*DT\s*[=:]?\s*{_NUMBER}(?![\w.])", re.I),
    re.compile(rf"^\s*(\d{{1,9}})(?!\d)\s*,?\s+{_NUMBER}\s*,?\s*NPTS\s*,\s*DT", re.I),
)
# "ACCELERATION TIME HISTORY IN UNITS OF G", or in files with seven header lines "ACCELERATION TIME HISTORY (G'S)".
_QUANTITY = re.compile(r"\b(ACCELERATION|VELOCITY|DISPLACEMENT)\b.*?(?:UNITS?\s+OF\s+([^\s,]+)|\(([^)]+)\))", re.I)
_MISSING_BLANK = re.compile(r"(?<=[\d.])(?=[+-])")  # between the numbers of 1.2-3.4, not inside 1.2E-3
_AZIMUTH = re.compile(r"(\d{1,3})(?!\d)")
_LETTERS = {"N": 0, "E": 90, "S": 180, "W": 270}
# Marks of a vertical component at the end of a title or of a file name; channel codes of networks end in Z.
_VERTICAL = re.compile(r"(?:^|[-_. ])(?:(UP|VER|VERT|VERTICAL|V|Z|[BH][HNL]Z\d*)|(DWN|DN|DOWN))$", re.I)


def matches(lines: Lines) -> bool:
    """Whether one of the header lines contains NPTS."""
    return any("NPTS" in line.upper() for line in lines.lines[:_HEADER_LINES])


def read_peer(
    h1: str | PathLike[str], h2: str | PathLike[str] | None = None, up: str | PathLike[str] | None = None
) -> Record:
    """Read a record from up to three PEER files of one quantity.

    `read_record(h1, h2, up)` assigns the horizontal components by the azimuths in the files instead.

    Args:
        h1: file of the component along E1.
        h2: file of the component along E2; None: zero, with a note.
        up: file of the component along E3; None: zero, with a note.

    Raises:
        InputError: a file is damaged, or quantities or time steps differ. The message names file, line and reason.
    """
    horizontal = [replace(read(read_lines(Path(p)))[0], direction=d) for p, d in ((h1, 90), (h2, 0)) if p is not None]
    vertical = [] if up is None else [_as_vertical(read(read_lines(Path(up)))[0])]
    quantities = {c.quantity for c in (*horizontal, *vertical)}
    if len(quantities) > 1:
        raise InputError(f"{horizontal[0].path.name}: {' and '.join(sorted(quantities))}; give files of one quantity")
    return assemble_record([*horizontal, *vertical], FORMAT)


def _as_vertical(channel: Channel) -> Channel:
    """The channel as a vertical one: downwards if its file says so, else upwards."""
    return channel if channel.direction == DOWN else replace(channel, direction=UP)


def read(lines: Lines) -> list[Channel]:
    """The one channel of a file."""
    head = next((i for i in range(min(_HEADER_LINES, len(lines))) if "NPTS" in lines[i].upper()), None)
    if head is None:
        lines.fail(0, f"no NPTS and DT in the first {_HEADER_LINES} lines; not a PEER file")
    counts = next((m for pattern in _COUNTS if (m := pattern.search(lines[head]))), None)
    if counts is None:
        lines.fail(head, f"{lines[head].strip()[:40]!r} does not give NPTS and DT")
    where = next((i for i in range(head) if _QUANTITY.search(lines[i])), None)
    match = _QUANTITY.search(lines[where]) if where is not None else None
    if where is None or match is None:
        lines.fail(head, "no line before this one says ACCELERATION (VELOCITY, DISPLACEMENT) ... IN UNITS OF ...")
    quantity = next(q for q in QUANTITIES if q == match[1].lower())
    unit = (match[2] or match[3]).strip()
    factor = si_factor(lines, where, unit, quantity)
    points, step = int(counts[1]), lines.positive(head, "DT", counts[2])
    words: list[str] = []
    values: list[float] = []
    for index in range(head + 1, len(lines)):
        row = _MISSING_BLANK.sub(" ", lines[index]).split()
        words += row
        values += lines.numbers(index, row)
    if len(values) != points:
        lines.fail(head, f"NPTS promises {points} values, the file holds {len(values)}; fetch it again")
    lines.check_columns(head + 1)
    lines.check_end(len(lines) - 1, words)
    title = lines[where - 1].strip() if where else ""
    direction, station = _direction(title, stem(lines.path))
    si, label = column(values) * factor, title or lines.path.name
    return [Channel(lines.path, where, quantity, direction, step, si, label, unit, station=station)]


def _direction(title: str, name: str) -> tuple[int | str, str]:
    """Direction and station from a title such as "..., EL CENTRO ARRAY #9, 180", else direction from the file name."""
    station, comma, last = (part.strip() for part in title.rpartition(","))
    for text, found_station in ((last if comma else "", station), (name, "")):
        if match := _VERTICAL.search(text):
            return (DOWN if match[2] else UP), found_station
    if comma and last.upper() in _LETTERS:
        return _LETTERS[last.upper()], station
    match = _AZIMUTH.match(last) if comma else None
    return (int(match[1]) % 360, station) if match and int(match[1]) <= 360 else (UNKNOWN, "")
