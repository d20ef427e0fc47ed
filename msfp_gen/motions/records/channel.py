"""Assembly of the channels of a recording to a record of three components in a right-handed frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.motions.records.record import UNITS, Record, common_window, derived_note, differentiated, stem
from msfp_gen.motions.records.text import Lines

UP, DOWN, UNKNOWN = "up", "down", "unknown"
QUANTITIES = ("acceleration", "velocity", "displacement")
_RIGHT_ANGLE_TOLERANCE = 2  # permitted deviation of two horizontal channels from a right angle [deg]


@dataclass(frozen=True, eq=False)
class Channel:
    """One component of one quantity, in SI.

    Attributes:
        path: the file.
        line: index of the line at which the channel begins, for messages.
        quantity: one of `QUANTITIES`.
        direction: azimuth clockwise from north [deg], `UP`, `DOWN`, or `UNKNOWN`: then the order of the files decides.
        time_step: sample interval [s].
        values: ndarray, shape (k,), [m/s^2], [m/s] or [m].
        label, unit, start, station: texts of the file for channel, unit, start time and station. Start time and station
            of the channels of one recording must agree where they are given.
    """

    path: Path
    line: int
    quantity: str
    direction: int | str
    time_step: float
    values: Array
    label: str
    unit: str
    start: str = ""
    station: str = ""

    def fail(self, reason: str) -> NoReturn:
        """Raise InputError at the line where this channel begins."""
        raise InputError(f"{self.path.name}, line {self.line + 1}: {reason}")


def si_factor(lines: Lines, line: int, unit: str, quantity: str) -> float:
    """Factor from `unit` to SI. Raises InputError at `line` unless it is a known unit of `quantity`."""
    kind, factor = UNITS.get("".join(unit.lower().split()).rstrip(".,"), ("", 0.0))
    if kind != quantity:
        known = ", ".join(name for name, (other, _) in UNITS.items() if other == quantity)
        problem = f"unknown unit {unit.strip()!r}" if not kind else f"{unit.strip()!r} is no unit of {quantity}"
        lines.fail(line, f"{problem}; known: {known}")
    return factor


def assemble_record(channels: Sequence[Channel], file_format: str, notes: tuple[str, ...] = ()) -> Record:
    """Record of all channels of one recording.

    Args:
        channels: of one to three components and one to three quantities.
        file_format: name of the file format.
        notes: notes on the format, for the record.

    Raises:
        InputError: the channels are not of one recording, or not of suitable directions. The message names file, line
            and reason.
    """
    _check_one_recording(channels)
    groups = {q: parts for q in QUANTITIES if (parts := [c for c in channels if c.quantity == q])}
    measured, first = next(iter(groups)), channels[0]
    arrays, all_notes = {}, dict.fromkeys(notes)  # a dict keeps the order and drops repeated notes
    for quantity, parts in groups.items():
        if len(parts) != len(groups[measured]):
            parts[0].fail(
                f"{len(parts)} channels of {quantity}, {len(groups[measured])} of {measured}; give as many of each"
            )
        columns = [None if c is None else _upwards(c) for c in _ordered(parts)]
        arrays[quantity], cut = common_window(columns)
        all_notes |= dict.fromkeys(cut)
    shortest = min(map(len, arrays.values()))
    arrays = {quantity: values[:shortest] for quantity, values in arrays.items()}
    if measured != "acceleration":
        arrays |= differentiated(measured, arrays[measured], first.time_step)
        all_notes |= dict.fromkeys(derived_note(measured))
    if any(c.direction == DOWN for c in channels):
        all_notes["vertical channel is positive downwards: its sign is reversed"] = None
    labels = ["" if c is None else c.label for c in _ordered(groups[measured])]
    return Record(
        name=stem(first.path),
        time_step=first.time_step,
        channels=(labels[0], labels[1], labels[2]),
        start_time=first.start,
        station=first.station,
        units=groups[measured][0].unit,
        notes=tuple(all_notes),
        quantity=measured,
        **arrays,
        metadata={"format": file_format, "file": ", ".join(dict.fromkeys(c.path.name for c in channels))},
    )


def _check_one_recording(channels: Sequence[Channel]) -> None:
    """Raise InputError unless time step, start time and station agree where they are given."""
    first = channels[0]
    for other in channels[1:]:
        for name, unit in (("time_step", " s"), ("start", ""), ("station", "")):
            value, expected = getattr(other, name), getattr(first, name)
            if value != expected and value and expected:
                other.fail(
                    f"{name.replace('_', ' ')} {value!r}{unit} differs from the first channel's {expected!r}{unit} "
                    f"in {first.path.name}; give one recording"
                )


def _ordered(channels: list[Channel]) -> tuple[Channel | None, Channel | None, Channel | None]:
    """Channels along E1, E2, E3 in a right-handed frame: E1 lies 90 degrees clockwise of E2 as seen from above.

    Channels of unknown direction take the remaining places in their order. A component without a channel is None; that
    is permitted only for files of one channel each.
    """
    vertical = [c for c in channels if c.direction in (UP, DOWN)]
    horizontal = [c for c in channels if isinstance(c.direction, int)]
    undirected = [c for c in channels if c.direction == UNKNOWN]
    share_a_file = len({c.path for c in channels}) < len(channels)
    incomplete = share_a_file and not undirected and (len(vertical), len(horizontal)) != (1, 2)
    if len(vertical) > 1 or len(horizontal) > 2 or len(channels) > 3 or incomplete:
        names = ", ".join(c.label for c in channels)
        raise InputError(
            f"{channels[0].path.name}: channels {names}; two horizontal ones and one Up are needed, each once"
        )
    if len(horizontal) == 2:
        horizontal = _right_handed(horizontal[0], horizontal[1])
    places: list[Channel | None] = [None, None, vertical[0] if vertical else None]
    places[: len(horizontal)] = horizontal
    for channel in undirected:
        places[places.index(None)] = channel
    return places[0], places[1], places[2]


def _right_handed(first: Channel, second: Channel) -> list[Channel]:
    """Two horizontal channels in the order E1, E2. Raises InputError unless they are 90 degrees apart."""
    angle = (int(first.direction) - int(second.direction)) % 360
    if abs(angle - 90) <= _RIGHT_ANGLE_TOLERANCE:
        return [first, second]
    if abs(angle - 270) <= _RIGHT_ANGLE_TOLERANCE:
        return [second, first]
    second.fail(f"horizontal channels {first.label} and {second.label} are not 90 degrees apart")


def _upwards(channel: Channel) -> Array:
    return -channel.values if channel.direction == DOWN else channel.values
