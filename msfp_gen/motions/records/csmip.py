"""CSMIP volumes 1 and 2: uncorrected and corrected accelerograms, several channels in a file, fixed-width columns."""

from __future__ import annotations

import re
from typing import Any

from msfp_gen.motions.records.record import DOWN, QUANTITIES, UNKNOWN, UP, Channel, si_factor
from msfp_gen.motions.records.text import Lines, search, word

FORMAT = "CSMIP V1, V2"
_TITLES = ("uncorrected accelerogram data", "corrected accelerogram")
_CHANNEL = re.compile(r"Chan\s+(\S+):\s*((\d{1,3})\s+Deg|Up|Down|H[12])\s*$", re.I)
_DIRECTIONS = {"up": UP, "down": DOWN}
_COLUMNS = r"(?:\((\d{1,3})f(\d{1,3})\.\d+\))?\s*$"
# The line before the numbers of volume 1, and before each of the three quantities of volume 2.
_RAW = re.compile(
    r"\s*(?P<points>\d{1,9})\s+Accelerogram points at\s+(?P<rate>\S+)\s+pts/sec\s+in units of\s+(?P<unit>.+?)\.?\s+"
    rf"Format:\s*{_COLUMNS}",
    re.I,
)
_CORRECTED = re.compile(
    r"\s*(?P<points>\d{1,9})\s+points of\s+(?P<quantity>accel|veloc|displ)\s+data equally spaced at\s+(?P<step>\S+)"
    rf"\s+sec[.,\s]*(?:in|\(units:)\s*(?P<unit>[^\s()]+?)[.)]?\s*{_COLUMNS}",
    re.I,
)
_DEFAULT_LAYOUT = (8, 10)  # (8f10.x), for volume 2 files whose line names no format
_COUNT = re.compile(r"No\. of Points\s*=\s*(\d{1,9})", re.I)
_START = re.compile(r"(?:Start|Trigger) time:\s*(.*?)\s*$", re.I)
_STATION = re.compile(r"Station (?:Id|No)\.\s*(\S+)", re.I)
_END = "/&"


def matches(lines: Lines) -> bool:
    """Whether the first line is the title of a CSMIP file of volume 1 or 2."""
    return lines[0].strip().lower().startswith(_TITLES)


def read(lines: Lines) -> list[Channel]:
    """The channels of a file; in volume 2 each has acceleration, velocity and displacement."""
    channels: list[Channel] = []
    index = 0
    while index < len(lines):
        if lines[index].strip():
            quantities, index = _channel(lines, index)
            channels += quantities
        else:
            index += 1
    return channels


def _channel(lines: Lines, top: int) -> tuple[list[Channel], int]:
    """Quantities of the channel whose header begins at line `top`, and the index of the line after its end mark."""
    if not lines[top].strip().lower().startswith(_TITLES):
        lines.fail(
            top, f"{lines[top].strip()[:40]!r} where a channel should begin with 'Uncorrected Accelerogram Data'"
        )
    index = _first_data_line(lines, top)
    head = [lines[i] for i in range(top, index)]
    label = search(_CHANNEL, head)
    if label is None:
        lines.fail(top, "no 'Chan n: <azimuth> Deg' or 'Chan n: Up' in this channel's header")
    shared: dict[str, Any] = {
        "direction": int(label[3]) % 360 if label[3] else _DIRECTIONS.get(label[2].lower(), UNKNOWN),
        "label": " ".join(label[2].split()),
        "start": word(_START, head),
        "station": word(_STATION, head),
    }
    count = search(_COUNT, head)
    channels = []
    while match := _RAW.match(lines[index]) or _CORRECTED.match(lines[index]):
        if count is not None and count[1] != match["points"]:
            lines.fail(index, f"{match['points']} points here, but the header says {count[1]}")
        channel, index = _series(lines, index, match, shared)
        channels.append(channel)
    if not lines[index].startswith(_END):
        lines.fail(index, f"more data than the {len(channels[-1].values)} points of the header, or no '/&' end mark")
    return channels, index + 1


def _first_data_line(lines: Lines, top: int) -> int:
    """Index of the line before the first numbers of the channel whose header begins at line `top`."""
    index = top
    while not (_RAW.match(lines[index]) or _CORRECTED.match(lines[index])):
        if lines[index].startswith(_END):
            lines.fail(
                index,
                "a channel ends without a line '... Accelerogram points at ... in units of ...' "
                "or '... points of accel data equally spaced at ...'",
            )
        index += 1
    return index


def _series(lines: Lines, top: int, match: re.Match[str], shared: dict[str, Any]) -> tuple[Channel, int]:
    """One quantity of a channel, whose numbers follow the line at `top`, and the index of the line after them."""
    groups = match.groupdict()
    if "rate" in groups:
        quantity, step = "acceleration", 1 / lines.positive(top, "the sampling rate", match["rate"])
    else:
        quantity = next(q for q in QUANTITIES if q.startswith(match["quantity"].lower()))
        step = lines.positive(top, "the time step", match["step"])
    unit = match["unit"].strip()
    factor = si_factor(lines, top, unit, quantity)
    columns, width = match.groups()[-2:]
    layout = (int(columns), int(width)) if columns else _DEFAULT_LAYOUT
    values, after = lines.block(top + 1, int(match["points"]), layout)
    return Channel(lines.path, top, quantity, time_step=step, values=values * factor, unit=unit, **shared), after
