"""K-NET and KiK-net ASCII of NIED: one channel in a file, 17 header lines, counts with a scale factor in gal."""

from __future__ import annotations

import re
from datetime import datetime, timedelta

import numpy as np

from msfp_gen.motions.records.record import UP, Channel
from msfp_gen.motions.records.text import Lines, column

FORMAT = "K-NET"
NOTE = "K-NET: mean of each channel removed, start is 15 s before the file's Record Time"
_HEADER = 17
_FIRST = "Origin Time"
_DELAY = timedelta(seconds=15)  # trigger delay of the recorder, included in Record Time
_TIME = "%Y/%m/%d %H:%M:%S"
_SCALE = re.compile(r"([\d.]+)\s*\(gal\)\s*/\s*([\d.]+)", re.I)
# Field Dir.: a word in K-NET files, a number in KiK-net files, 1-3 in the borehole and 4-6 at the surface.
_DIRECTIONS: dict[str, tuple[int | str, str]] = {
    **{"N-S": (0, ""), "E-W": (90, ""), "U-D": (UP, "")},
    **{"1": (0, "borehole"), "2": (90, "borehole"), "3": (UP, "borehole")},
    **{"4": (0, "surface"), "5": (90, "surface"), "6": (UP, "surface")},
}
_LABELS = {0: "N-S", 90: "E-W", UP: "U-D"}
_ROUNDING = 0.01  # relative tolerance of the maximum in the header, which has few digits


def matches(lines: Lines) -> bool:
    """Whether the first line is the origin time of the earthquake."""
    return lines[0].startswith(_FIRST)


def read(lines: Lines) -> list[Channel]:
    """The one channel of a file."""
    scale = _SCALE.search(_field(lines, "Scale Factor"))
    if scale is None:
        lines.fail(_line(lines, "Scale Factor"), "the scale factor is not of the form 3920(gal)/6182761")
    where = _line(lines, "Dir.")
    word = _field(lines, "Dir.")
    if word not in _DIRECTIONS:
        lines.fail(where, f"unknown direction {word!r}; known: {', '.join(_DIRECTIONS)}")
    direction, level = _DIRECTIONS[word]
    rate_line = _line(lines, "Sampling Freq")
    rate = lines.positive(rate_line, "the sampling rate", _field(lines, "Sampling Freq").lower().removesuffix("hz"))
    counts = _counts(lines, rate)
    divisor = lines.positive(_line(lines, "Scale Factor"), "the divisor of the scale factor", scale[2])
    factor = lines.positive(_line(lines, "Scale Factor"), "the scale factor", scale[1]) / divisor
    gal = (counts - counts.mean()) * factor
    _check_peak(lines, float(np.max(np.abs(gal))))
    return [
        Channel(
            lines.path,
            where,
            "acceleration",
            direction,
            1 / rate,
            0.01 * gal,
            _LABELS[direction],
            "gal",
            _start(lines),
            " ".join([_field(lines, "Station Code"), level]).strip(),
        )
    ]


def _line(lines: Lines, name: str) -> int:
    """Index of the header line that begins with `name`."""
    for index in range(min(_HEADER, len(lines))):
        if lines[index].startswith(name):
            return index
    lines.fail(0, f"no line '{name}' in the {_HEADER} header lines of a K-NET file")


def _field(lines: Lines, name: str) -> str:
    """Text of the header line after `name` and a unit in brackets, if there is one."""
    return re.sub(r"^\s*\([^)]*\)", "", lines[_line(lines, name)].removeprefix(name)).strip()


def _counts(lines: Lines, rate: float) -> np.ndarray:
    """Counts of all samples; fails unless their number agrees with duration and sampling rate [Hz]."""
    where = _line(lines, "Duration Time")
    points = round(lines.positive(where, "the duration", _field(lines, "Duration Time")) * rate)
    values: list[float] = []
    for index in range(_HEADER, len(lines)):
        values += lines.numbers(index, lines[index].split())
    if len(values) != points:
        lines.fail(where, f"duration and sampling rate promise {points} values, the file holds {len(values)}")
    lines.check_columns(_HEADER)
    return column(values)


def _check_peak(lines: Lines, peak: float) -> None:
    """Raise InputError unless `peak` [gal] agrees with the maximum in the header."""
    where = _line(lines, "Max. Acc.")
    maximum = lines.number(where, _field(lines, "Max. Acc."))
    if abs(peak - maximum) > _ROUNDING * maximum + 1e-3:
        lines.fail(where, f"the data peak at {peak:.3f} gal, the header says {maximum:.3f}; fetch the file again")


def _start(lines: Lines) -> str:
    """Time of the first sample, without the trigger delay."""
    where = _line(lines, "Record Time")
    try:
        time = datetime.strptime(_field(lines, "Record Time"), _TIME)
    except ValueError:
        lines.fail(where, f"{_field(lines, 'Record Time')!r} is no time of the form 2018/01/24 19:51:43")
    return f"{time - _DELAY:{_TIME}} JST"
