"""From channels, as files hold them, to a record of three components in a right-handed frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from msfp_gen.errors import InputError
from msfp_gen.piecewise import Array
from msfp_gen.records.record import UNITS, Record, common_window, derived_note, differentiated, stem
from msfp_gen.records.text import Lines

UP, DOWN, UNKNOWN = "up", "down", "unknown"
QUANTITIES = ("acceleration", "velocity", "displacement")
_SQUARE = 2  # degrees by which two horizontal channels may miss a right angle


@dataclass(frozen=True, eq=False)
class Channel:
    """One component of one quantity, in SI.

    Attributes:
        path, line: where it begins, for messages.
        quantity: one of `QUANTITIES`.
        direction: degrees clockwise from north, `UP`, `DOWN`, or `UNKNOWN`: then the order of the files decides.
        values: ndarray, shape (k,), [m/s^2], [m/s] or [m].
        label, unit, start, station: the file's own words; channels of one recording share start and station where
            they are given.
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
    """The factor to SI of a unit that must be one of `quantity`; fails at `line` for any other."""
    kind, factor = UNITS.get("".join(unit.lower().split()).rstrip(".,"), ("", 0.0))
    if kind != quantity:
        known = ", ".join(name for name, (other, _) in UNITS.items() if other == quantity)
        problem = f"unknown unit {unit.strip()!r}" if not kind else f"{unit.strip()!r} is no unit of {quantity}"
        lines.fail(line, f"{problem}; known: {known}")
    return factor


def assembled(channels: Sequence[Channel], form: str, notes: tuple[str, ...] = ()) -> Record:
    """The record of all channels of one recording. `form` names the file format.

    Raises InputError naming file, line and reason where they are not of one recording or not three components.
    """
    _check_together(channels)
    groups = {q: parts for q in QUANTITIES if (parts := [c for c in channels if c.quantity == q])}
    given, first = next(iter(groups)), channels[0]
    arrays, remarks = {}, dict.fromkeys(notes)
    for quantity, parts in groups.items():
        if len(parts) != len(groups[given]):
            parts[0].fail(f"{len(parts)} channels of {quantity}, {len(groups[given])} of {given}; give as many of each")
        columns = [None if c is None else _upwards(c) for c in _ordered(parts)]
        arrays[quantity], cut = common_window(columns)
        remarks |= dict.fromkeys(cut)
    shortest = min(map(len, arrays.values()))
    arrays = {quantity: values[:shortest] for quantity, values in arrays.items()}
    if given != "acceleration":
        arrays |= differentiated(given, arrays[given], first.time_step)
        remarks |= dict.fromkeys(derived_note(given))
    if any(c.direction == DOWN for c in channels):
        remarks["vertical channel is positive downwards: its sign is turned"] = None
    labels = ["" if c is None else c.label for c in _ordered(groups[given])]
    return Record(
        name=stem(first.path), time_step=first.time_step, channels=(labels[0], labels[1], labels[2]),
        start_time=first.start, station=first.station, units=groups[given][0].unit, notes=tuple(remarks),
        quantity=given, **arrays,
        metadata={"format": form, "file": ", ".join(dict.fromkeys(c.path.name for c in channels))},
    )  # fmt: skip


def _check_together(channels: Sequence[Channel]) -> None:
    first = channels[0]
    for other in channels[1:]:
        for what, unit in (("time_step", " s"), ("start", ""), ("station", "")):
            mine, theirs = getattr(other, what), getattr(first, what)
            if mine != theirs and mine and theirs:
                other.fail(
                    f"{what.replace('_', ' ')} {mine!r}{unit} differs from the first channel's {theirs!r}{unit} "
                    f"in {first.path.name}; give one recording"
                )


def _ordered(channels: list[Channel]) -> tuple[Channel | None, Channel | None, Channel | None]:
    """Channels along E1, E2, E3, right-handed: E1 lies 90 degrees clockwise of E2 as seen from above.

    Channels of unknown direction keep their order and fill what is free. A file of one channel may stand alone.
    """
    vertical = [c for c in channels if c.direction in (UP, DOWN)]
    flat = [c for c in channels if isinstance(c.direction, int)]
    free = [c for c in channels if c.direction == UNKNOWN]
    several = len({c.path for c in channels}) < len(channels)
    partial = several and not free and (len(vertical), len(flat)) != (1, 2)
    if len(vertical) > 1 or len(flat) > 2 or len(channels) > 3 or partial:
        names = ", ".join(c.label for c in channels)
        raise InputError(
            f"{channels[0].path.name}: channels {names}; two horizontal ones and one Up are needed, each once"
        )
    if len(flat) == 2:
        flat = _right_handed(flat[0], flat[1])
    places: list[Channel | None] = [None, None, vertical[0] if vertical else None]
    places[: len(flat)] = flat
    for channel in free:
        places[places.index(None)] = channel
    return places[0], places[1], places[2]


def _right_handed(first: Channel, second: Channel) -> list[Channel]:
    turn = (int(first.direction) - int(second.direction)) % 360
    if abs(turn - 90) <= _SQUARE:
        return [first, second]
    if abs(turn - 270) <= _SQUARE:
        return [second, first]
    second.fail(f"horizontal channels {first.label} and {second.label} are not 90 degrees apart")


def _upwards(channel: Channel) -> Array:
    return -channel.values if channel.direction == DOWN else channel.values
