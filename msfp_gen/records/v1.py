"""COSMOS/CSMIP volume 1: uncorrected acceleration, several channels a file, fixed-width columns."""

from __future__ import annotations

import re
from dataclasses import dataclass

from msfp_gen.piecewise import Array
from msfp_gen.records.record import G, Record, common_window, stem
from msfp_gen.records.text import Lines, column

TITLE = "uncorrected accelerogram data"
_CHANNEL = re.compile(r"Chan\s+(\S+):\s+(?:(\d{1,3})\s+Deg|(Up))\s*$", re.I)
_DATA = re.compile(
    r"\s*(\d{1,9})\s+Accelerogram points at\s+(\S+)\s+pts/sec in units of\s+(\S+?)\.?\s+"
    r"Format:\s*\((\d{1,3})f(\d{1,3})\.\d+\)",
    re.I,
)
_COUNT = re.compile(r"No\. of Points\s*=\s*(\d{1,9})", re.I)
_UNITS = {"g": G, "cm/sec2": 0.01, "cm/sec/sec": 0.01}
_END = "/&"


@dataclass(frozen=True)
class _Channel:
    line: int
    label: str
    azimuth: int | None  # degrees clockwise from north; None: up
    rate: float
    unit: str
    start: str
    station: str
    values: Array


def understands(lines: Lines) -> bool:
    """Whether the file opens like a volume 1 file."""
    return lines[0].strip().lower().startswith(TITLE)


def read(lines: Lines) -> Record:
    """The record of a volume 1 file: east is E1 and north E2, or whichever pair of horizontals is right-handed."""
    channels, index = [], 0
    while index < len(lines):
        if lines[index].strip():
            channel, index = _channel(lines, index)
            channels.append(channel)
        else:
            index += 1
    ordered = _ordered(lines, channels)
    first = ordered[0]
    for other in ordered[1:]:
        for what in ("rate", "unit", "start", "station"):
            if getattr(other, what) != getattr(first, what):
                mine, theirs = getattr(other, what), getattr(first, what)
                lines.fail(
                    other.line, f"{what} {mine!r} differs from the first channel's {theirs!r}; give one recording"
                )
    values, notes = common_window([c.values for c in ordered])
    return Record(
        name=stem(lines.path),
        time_step=1 / first.rate,
        acceleration=values * _UNITS[first.unit],
        channels=(ordered[0].label, ordered[1].label, ordered[2].label),
        start_time=first.start,
        station=first.station,
        units=first.unit,
        metadata={"format": "COSMOS/CSMIP V1", "file": lines.path.name},
        notes=notes,
    )


def _channel(lines: Lines, top: int) -> tuple[_Channel, int]:
    """The channel whose header begins at line `top`, and the line after its end mark."""
    if not lines[top].strip().lower().startswith(TITLE):
        lines.fail(
            top, f"{lines[top].strip()[:40]!r} where a channel should begin with 'Uncorrected Accelerogram Data'"
        )
    index, found = top, None
    while found is None:
        found = _DATA.match(lines[index])
        if lines[index].startswith(_END):
            lines.fail(index, "a channel ends without a line '... Accelerogram points at ... in units of ...'")
        index += 1
    head = range(top, index)
    label = next((m for i in head if (m := _CHANNEL.search(lines[i]))), None)
    count = next((m for i in head if (m := _COUNT.search(lines[i]))), None)
    if label is None:
        lines.fail(top, "no 'Chan n: <azimuth> Deg' or 'Chan n: Up' in this channel's header")
    points, unit = int(found[1]), found[3].lower()
    if unit not in _UNITS:
        lines.fail(index - 1, f"unknown unit {found[3]!r}; known: {', '.join(_UNITS)}")
    if count is not None and int(count[1]) != points:
        lines.fail(index - 1, f"{points} points here, but the header says {count[1]}")
    rate = lines.positive(index - 1, "the sampling rate", found[2])
    values, after = _fixed_width(lines, index, points, int(found[4]), int(found[5]))
    start = next((lines[i].split("Start time:")[1].strip() for i in head if "Start time:" in lines[i]), "")
    station = next((lines[i].split("Station Id.")[1].split()[:1] for i in head if "Station Id." in lines[i]), [""])
    azimuth = None if label[3] else int(label[2]) % 360
    text = "Up" if label[3] else f"{int(label[2])} Deg"
    return _Channel(top, text, azimuth, rate, unit, start, "".join(station), values), after


def _fixed_width(lines: Lines, top: int, points: int, per_line: int, width: int) -> tuple[Array, int]:
    """`points` numbers from line `top` on, and the line after the end mark that must follow them."""
    if not (points and per_line and width):
        lines.fail(top - 1, f"{points} points in {per_line} columns of width {width}; nothing to read")
    values: list[float] = []
    index = top
    while len(values) < points:
        row = lines[index].rstrip()
        want = min(per_line, points - len(values))
        if row.startswith(_END) or len(row) != want * width:
            lines.fail(index, f"{want} columns of width {width} expected after {len(values)} of {points} points")
        values += lines.numbers(index, [row[i : i + width] for i in range(0, len(row), width)])
        index += 1
    if not lines[index].startswith(_END):
        lines.fail(index, f"more data than the {points} points of the header, or no '/&' end mark")
    return column(values), index + 1


def _ordered(lines: Lines, channels: list[_Channel]) -> tuple[_Channel, _Channel, _Channel]:
    """Channels along E1, E2, E3, right-handed: E1 lies 90 degrees clockwise of E2 as seen from above."""
    up = [c for c in channels if c.azimuth is None]
    flat = [c for c in channels if c.azimuth is not None]
    if len(up) != 1 or len(flat) != 2:
        names = ", ".join(c.label for c in channels)
        lines.fail(0, f"channels {names}; two horizontal ones and one Up are needed")
    first, second = flat
    turn = ((first.azimuth or 0) - (second.azimuth or 0)) % 360
    if turn not in (90, 270):
        lines.fail(second.line, f"horizontal channels {first.label} and {second.label} are not 90 degrees apart")
    return (first, second, up[0]) if turn == 90 else (second, first, up[0])
