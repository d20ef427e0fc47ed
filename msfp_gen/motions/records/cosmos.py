"""COSMOS strong-motion format 1.20, volumes 1 and 2: one or more blocks in a file, each of one channel and quantity."""

from __future__ import annotations

import re

from msfp_gen.motions.records.record import DOWN, QUANTITIES, UNKNOWN, UP, Channel, si_factor
from msfp_gen.motions.records.text import Lines, word

FORMAT = "COSMOS V1, V2"
_TITLE = re.compile(r"\(Format v\d+\.\d+ with (\d{1,3}) text lines\)", re.I)
_REALS = re.compile(r"(\d{1,4})\s+Real-header values follow on\s+(\d{1,3})\s+lines.*\((\d{1,2})F(\d{1,2})\.\d+\)", re.I)
_DATA = re.compile(
    r"\s*(\d{1,9})\s+(?:raw\s+)?(accel|veloc|displ)\w*\.?\s+pts,\s*approx\s+(\S+)\s+secs?,\s*units=\s*([^,(]+?)\s*"
    r"(?:\((\d{1,3})\))?\s*,?\s*Format=\s*\((\d{1,3})[FEI](\d{1,3})(?:\.\d+E?)?\)",
    re.I,
)
_CHANNEL = re.compile(r"Sta Cha[n:]*\s+(\S+?):\s*(?:(\d{1,3})\s+deg|(Up|Down)\b|)", re.I)
_SCNL = re.compile(r"<SCNL>\s*\w*\.\w{2}(\w)\.")  # the last letter of the channel code is the direction
_LETTERS: dict[str, int | str] = {"Z": UP, "N": 0, "E": 90}
_START = re.compile(r"Rcrd start time:\s*(.*?)\s*(?:\(|RcrdId|$)", re.I)
_STATION = re.compile(r"Code:\s*(\S+)", re.I)
_INTERVAL = 61  # index of the sample interval [ms] of the data; the one at index 33 is the recorder's
_END = ("end-of-data", "/&")


def matches(lines: Lines) -> bool:
    """Whether the first line is the title of a COSMOS file."""
    return _TITLE.search(lines[0]) is not None


def read(lines: Lines) -> list[Channel]:
    """The channels of a file."""
    channels: list[Channel] = []
    index = 0
    while index < len(lines):
        if lines[index].strip():
            channel, index = _channel(lines, index)
            channels.append(channel)
        else:
            index += 1
    return channels


def _channel(lines: Lines, top: int) -> tuple[Channel, int]:
    """The channel whose header begins at line `top`, and the index of the line after its end mark."""
    if not _TITLE.search(lines[top]):
        lines.fail(top, f"{lines[top].strip()[:40]!r} where a channel should begin with '... (Format v01.20 with ...'")
    index = top + 1
    while not (match := _DATA.match(lines[index])):
        if lines[index].lower().startswith(_END) or _TITLE.search(lines[index]):
            lines.fail(index, "a channel without a line '... acceleration pts, approx ... secs, units=..., Format=...'")
        index += 1
    head = range(top, index)
    points, unit = int(match[1]), match[4].strip()
    quantity = next(q for q in QUANTITIES if q.startswith(match[2].lower()))
    if unit.lower() == "counts":
        lines.fail(index, "raw counts, whose scale is not in the file; give volume 1 or 2")
    factor = si_factor(lines, index, unit, quantity)
    step = _time_step(lines, head, index, points, lines.positive(index, "the length", match[3]))
    values, after = lines.block(index + 1, points, (int(match[6]), int(match[7])))
    if not lines[after].lower().startswith(_END):
        lines.fail(after, f"more data than the {points} points of the header, or no 'End-of-data' mark")
    direction, label = _direction(lines, head)
    text = [lines[i] for i in head]
    return Channel(
        lines.path,
        top,
        quantity,
        direction,
        step,
        values * factor,
        label,
        unit,
        word(_START, text),
        word(_STATION, text),
    ), after + 1


def _time_step(lines: Lines, head: range, data: int, points: int, length: float) -> float:
    """Sample interval from the real header [s]; fails unless it agrees with the length in the line at `data`."""
    where = next((i for i in head if _REALS.search(lines[i])), None)
    match = _REALS.search(lines[where]) if where is not None else None
    if where is None or match is None:
        lines.fail(head[0], "no line '... Real-header values follow on ...' with its format")
    reals, _ = lines.block(where + 1, int(match[1]), (int(match[3]), int(match[4])))
    if len(reals) <= _INTERVAL or reals[_INTERVAL] <= 0:
        lines.fail(where, f"real-header value {_INTERVAL + 1}, the sample interval in ms, is missing")
    step = float(reals[_INTERVAL]) / 1000
    if abs(points * step - length) > max(1.5, 0.01 * length):
        lines.fail(data, f"{points} points at {step:g} s are {points * step:g} s, but the line says {length:g} s")
    return step


def _direction(lines: Lines, head: range) -> tuple[int | str, str]:
    """Direction and label from the text of the header, else from the channel code."""
    for index in head:
        if match := _CHANNEL.search(lines[index]):
            if match[2]:
                return int(match[2]) % 360, f"{int(match[2])} deg"
            if match[3]:
                return (UP if match[3].lower() == "up" else DOWN), match[3]
    code = next((m[1].upper() for i in head if (m := _SCNL.search(lines[i]))), "")
    return _LETTERS.get(code, UNKNOWN), code or UNKNOWN
