"""A recorded ground motion of three components at common times, the units in files, the assembly of its channels."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import G
from msfp_gen.motions.checks import finite, positive
from msfp_gen.motions.records.text import Lines

COMPONENTS = ("E1", "E2", "E3")
# Unit in the header of a record -> quantity and factor to SI. Case, blanks and a final full stop are ignored.
UNITS: dict[str, tuple[str, float]] = {
    **dict.fromkeys(("g", "g's"), ("acceleration", G)),
    **dict.fromkeys(("cm/sec2", "cm/sec/sec", "cm/sec^2", "cm/s2", "cm/s/s", "cm/s^2", "gal"), ("acceleration", 0.01)),
    **dict.fromkeys(("m/sec2", "m/sec/sec", "m/sec^2", "m/s2", "m/s/s", "m/s^2"), ("acceleration", 1.0)),
    **dict.fromkeys(("cm/sec", "cm/s"), ("velocity", 0.01)),
    **dict.fromkeys(("m/sec", "m/s"), ("velocity", 1.0)),
    "cm": ("displacement", 0.01),
    "m": ("displacement", 1.0),
}


@dataclass(frozen=True, eq=False)
class Record:
    """A ground motion as recorded, converted to SI; for K-NET also with its arbitrary zero removed.

    Attributes:
        name: a label, from the station or the file.
        time_step: sample interval [s].
        acceleration: ndarray, shape (k, 3), [m/s^2], along (E1, E2, E3): first horizontal, second horizontal, up.
        channels: labels in the file of the channels along E1, E2, E3; "" for a missing one, whose values are zero.
        start_time: text of the file for the time of the first sample.
        station: text of the file for the station.
        units: unit in the file.
        metadata: further information on the record.
        notes: decisions made while reading, for example that channels were cut to their common window.
        quantity: quantity in the file: "acceleration", or "velocity" or "displacement", whose spline is differentiated.
        velocity: ndarray, shape (k, 3), [m/s], if the file gives velocity or displacement; else None.
        displacement: ndarray, shape (k, 3), [m], if the file gives it; else None.

    Raises:
        InputError: a shape is wrong, a number is not finite, or all accelerations are zero.
    """

    name: str
    time_step: float
    acceleration: Array
    channels: tuple[str, str, str] = COMPONENTS
    start_time: str = ""
    station: str = ""
    units: str = "m/s^2"
    metadata: Mapping[str, str | float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    quantity: str = "acceleration"
    velocity: Array | None = None
    displacement: Array | None = None

    def __post_init__(self) -> None:
        positive("time_step", self.time_step)
        values = finite("acceleration", self.acceleration)
        if values.ndim != 2 or values.shape[1] != 3 or len(values) < 4:
            raise InputError(f"acceleration: shape {values.shape}; give (k, 3), k >= 4")
        if not np.any(values):
            raise InputError(
                f"acceleration: all {len(values)} rows of {self.name or 'the record'} are zero; give a record"
            )
        object.__setattr__(self, "acceleration", values)
        for name in ("velocity", "displacement"):
            array = getattr(self, name)
            if array is not None and finite(name, array).shape != values.shape:
                raise InputError(f"{name}: shape {array.shape}; give the shape of the acceleration, {values.shape}")

    @property
    def time(self) -> Array:
        """Times of the samples, beginning at zero: ndarray, shape (k,), [s]."""
        return sample_times(len(self.acceleration), self.time_step)

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]."""
        return (len(self.acceleration) - 1) * self.time_step

    def with_components(self, components: Collection[str]) -> Record:
        """The record with these components (E1, E2, E3) as they are, and zero along the others.

        Raises InputError for other names, and where nothing is left.
        """
        if not components or set(components) - set(COMPONENTS):
            raise InputError(f"components = {list(components)!r}: give one or more of {', '.join(COMPONENTS)}")
        kept = np.array([name in components for name in COMPONENTS])
        if not np.any(self.acceleration[:, kept]):
            raise InputError(f"components = {list(components)!r}: {self.name or 'the record'} has nothing along them")
        labels = [
            "" if name not in components else label for name, label in zip(COMPONENTS, self.channels, strict=True)
        ]
        left_out = ", ".join(name for name in COMPONENTS if name not in components)
        note = f"components left out: {left_out}" if left_out else ""
        return self._changed(lambda values: values * kept, (labels[0], labels[1], labels[2]), note)

    def rotated(self, angle: float) -> Record:
        """The record with its horizontal components rotated by `angle` [rad] about E3, from E1 towards E2."""
        c, s = np.cos(angle), np.sin(angle)

        def turn(values: Array) -> Array:
            one, two, three = values.T
            return np.stack([c * one - s * two, s * one + c * two, three], axis=1)

        first, second, up = self.channels
        turned = f"{' and '.join(filter(None, (first, second)))} rotated"
        note = f"horizontal components rotated by {np.degrees(angle):.6g} degrees from E1 towards E2"
        return self._changed(turn, (turned, turned, up), note)

    def _changed(self, change: Callable[[Array], Array], channels: tuple[str, str, str], note: str) -> Record:
        """The record with a linear `change` of the rows of all its quantities."""
        arrays: dict[str, Any] = {name: getattr(self, name) for name in ("acceleration", "velocity", "displacement")}
        values: dict[str, Any] = {name: None if rows is None else change(rows) for name, rows in arrays.items()}
        return replace(self, **values, channels=channels, notes=(*self.notes, *filter(None, [note])))


def sample_times(points: int, time_step: float) -> Array:
    """Times of evenly spaced samples, beginning at zero: ndarray, shape (points,), [s]."""
    return np.arange(points, dtype=np.float64) * time_step


def differentiated(quantity: str, values: Array, time_step: float) -> dict[str, Any]:
    """Acceleration of a record that gives only velocity or displacement: the derivatives of their cubic spline.

    The spline through the velocity has a continuous acceleration whose exact integral is that velocity; the spline
    through the displacement likewise.

    Args:
        quantity: "acceleration" (returned as it is), "velocity" or "displacement".
        values: shape (k, 3), in SI.
        time_step: sample interval [s].

    Returns:
        Field of `Record` -> ndarray, shape (k, 3).

    Raises:
        InputError: there are fewer than 4 samples.
    """
    if quantity == "acceleration":
        return {"acceleration": values}
    from scipy.interpolate import CubicSpline

    if len(values) < 4:
        raise InputError(f"{quantity}: {len(values)} samples; give at least 4")
    times = sample_times(len(values), time_step)
    spline = CubicSpline(times, values)
    if quantity == "velocity":
        return {"acceleration": spline(times, 1), "velocity": values}
    return {"acceleration": spline(times, 2), "velocity": spline(times, 1), "displacement": values}


def derived_note(quantity: str) -> tuple[str, ...]:
    """Note for a record whose acceleration is a derivative; empty where the file gives the acceleration."""
    return () if quantity == "acceleration" else (f"acceleration: derivative of the {quantity} in the file",)


def common_window(columns: list[Array | None]) -> tuple[Array, tuple[str, ...]]:
    """Columns with a common first sample, cut to the length of the shortest; a missing one (None) is zero.

    Returns an ndarray, shape (k, len(columns)), [unit of `columns`], and notes on cut and missing columns.
    """
    lengths = [len(c) for c in columns if c is not None]
    shortest = min(lengths)
    notes = []
    if max(lengths) > shortest:
        were = ", ".join(map(str, lengths))
        notes.append(f"channels cut to their common window of {shortest} points (were {were})")
    missing = [COMPONENTS[i] for i, c in enumerate(columns) if c is None]
    if missing:
        notes.append(f"no channel for {', '.join(missing)}: taken as zero")
    filled = [np.zeros(shortest) if c is None else c[:shortest] for c in columns]
    return np.stack(filled, axis=1), tuple(notes)


def stem(path: Path) -> str:
    """Name of the file without .gz and without the suffix of its format."""
    return Path(path.name.removesuffix(".gz")).stem


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
    """Channels along E1, E2, E3 in a right-handed frame: E1 lies 90 degrees clockwise of E2 as seen from above."""
    # Channels of unknown direction take the remaining places in their order. A component without a channel is None;
    # that is permitted only for files of one channel each.
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
