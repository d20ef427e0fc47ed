"""The histories of consecutive segments as one, and rows at other times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.results.history import History, row_fields

Ends = tuple[History, History]


class Joint:
    """How segments become one history.

    The first row of a later segment repeats the last row of the one before it and is left out. Where a run begins with
    segments that took no step, the first model that went on gives the row of its start: forces of massless sliders at a
    start out of balance are not forces of the run. Energies continue from their last values.

    ends: of each segment its first and its last row, each a history of one row. counts: number of rows of each segment.
    output_step: distance of rows [s]; rows at the end of a segment between them are left out; None: rows of every step.
    before: values of what only later models record, in the rows of earlier ones: name -> row; others have their first
    value. Attribute kept: of each segment the rows that remain, as first and end.
    """

    def __init__(
        self,
        ends: Sequence[Ends],
        counts: Sequence[int],
        output_step: float | None = None,
        before: Mapping[str, Array] = MappingProxyType({}),
    ) -> None:
        self._before = before
        self._first = [first for first, _ in ends]
        end = {name: values[0] for name, values in ends[0][1].energy.items()} if ends else {}
        self._added = [end]  # energies at the end of the segment before; the first one's are not used
        for first, last in ends[1:]:  # a segment that took no step adds no value
            self._added.append(end)
            end = {name: value + last.energy[name][0] - first.energy[name][0] for name, value in end.items()}
        times = [first.time[0] for first, _ in ends]
        beginning = (
            sum(time == times[0] for time in times) - 1
        )  # the first segment that took a step, or the last of all
        self.kept: list[tuple[int, int]] = []
        for index, ((_, last), count) in enumerate(zip(ends, counts, strict=True)):
            steps = 0.0 if output_step is None else last.time[0] / output_step
            between = index < len(counts) - 1 and abs(steps - round(steps)) > 1e-6  # the even times of rows
            begin = int(index > beginning)
            self.kept.append((begin, max(begin, count - int(between))) if index >= beginning else (0, 0))

    def continued(self, index: int, rows: History) -> History:
        """Rows of segment `index` as rows of the whole."""
        if len(self._first) == 1:
            return rows
        recorded, last = rows.arrays(), self._first[-1].arrays()
        missing = {name: self._before.get(name, last[name][0]) for name in last if name not in recorded}
        columns: dict[str, Any] = dict.fromkeys(row_fields())
        columns |= {name: recorded[name] for name in last if name in recorded}
        columns |= {name: np.tile(value, (len(rows.time), 1)) for name, value in missing.items()}
        start = self._first[0]
        columns["displacement"] = rows.base_displacement - rows.top_displacement
        columns["displacement"] -= start.base_displacement[0] - start.top_displacement[0]
        energy = {name: self._continued(index, name, values) for name, values in rows.energy.items()}
        return replace(rows, **columns, energy=energy)

    def _continued(self, index: int, name: str, values: Array) -> Array:
        if index == 0:
            return values
        continued: Array = self._added[index][name] + values - self._first[index].energy[name][0]
        return continued


def joined(
    parts: Sequence[History], output_step: float | None = None, before: Mapping[str, Array] = MappingProxyType({})
) -> History:
    """The histories of consecutive segments as one; see `Joint`."""
    if len(parts) == 1:
        return parts[0]
    ends = [(taken(part, slice(0, 1)), taken(part, slice(-1, None))) for part in parts]
    joint = Joint(ends, [len(part.time) for part in parts], output_step, before)
    return concatenated(
        [
            joint.continued(index, taken(part, slice(*rows)))
            for index, (part, rows) in enumerate(zip(parts, joint.kept, strict=True))
            if rows[1] > rows[0]
        ]
    )


def taken(history: History, rows: Any) -> History:
    """Some rows of a history: a slice, or an array of indices."""
    columns = {name: values[rows] for name, values in history.arrays().items()}
    return replace(history, **columns, energy={name: values[rows] for name, values in history.energy.items()})


def concatenated(parts: Sequence[History]) -> History:
    """The rows of all parts in the order of their time; all have the same quantities."""
    if len(parts) == 1:
        return parts[0]
    times = np.concatenate([part.time for part in parts])
    order: Any = slice(None) if (np.diff(times) > 0).all() else np.argsort(times)

    def whole(columns: Sequence[Array]) -> Array:
        rows: Array = np.concatenate(columns)[order]
        return rows

    columns: dict[str, Any] = {name: whole([getattr(part, name) for part in parts]) for name in parts[0].arrays()}
    return History(**columns, energy={name: whole([part.energy[name] for part in parts]) for name in parts[0].energy})


def at_times(rows: Any, times: ArrayLike) -> Any:
    """`rows`, a dataclass with arrays along its field `time` [s], at other times; see `AnyResult.at_times`."""
    new_times = checked_times(rows.time, times)

    def at(values: Any) -> Any:
        if isinstance(values, dict):
            return {name: at(column) for name, column in values.items()}
        return interpolated(rows.time, values, new_times) if isinstance(values, np.ndarray) else values

    return replace(rows, **{field.name: at(getattr(rows, field.name)) for field in fields(rows)} | {"time": new_times})


def checked_times(rows: Array, times: ArrayLike) -> Array:
    """`times` as an array, shape (t,), [s]. Raises InputError for one outside of `rows`, the times of a run."""
    new_times = np.atleast_1d(np.asarray(times, dtype=float))
    inside = (new_times >= rows[0]) & (new_times <= rows[-1])
    if not np.all(inside):
        raise InputError(
            f"time = {new_times[~inside][0]:g} s: the run holds {rows[0]:g} to {rows[-1]:g} s; give a time in between"
        )
    return new_times


def interpolated(time: Array, values: Array, new_times: Array) -> Array:
    """Rows of `values`, shape (k, ...) [unit of `values`] at `time`, at other times by linear interpolation."""
    columns = values.reshape(len(time), -1).T
    return np.stack([np.interp(new_times, time, column) for column in columns], axis=-1).reshape(-1, *values.shape[1:])
