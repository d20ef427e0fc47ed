"""The histories of consecutive segments as one, whole or block by block with the same numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.history import History, quantities

Ends = tuple[History, History]


class Joint:
    """How segments become one history.

    The first row of a later segment repeats the last row of the one before it and is left out. Where a run begins with
    segments that took no step, the row of its start is that of the first model that went on: forces of massless sliders
    at a start out of balance are not those of the run. Energies continue from their last values.

    Parameters
    ----------
    ends
        Of each segment its first and its last row, each a history of one row.
    counts
        Number of rows of each segment.
    output_step
        Distance of rows [s]; rows at the end of a segment between them are left out. None: rows of every step.
    before
        Values of what only later models record, in the rows of earlier ones: name -> row. Others have their first
        value.

    Attributes
    ----------
    kept
        Of each segment the rows that remain, as first and end.

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
        self._added = [end]  # energies at the end of the segment before; those of the first are not used
        for first, last in ends[1:]:  # a segment that took no step adds no value
            self._added.append(end)
            end = {name: value + last.energy[name][0] - first.energy[name][0] for name, value in end.items()}
        times = [first.time[0] for first, _ in ends]
        beginning = (
            sum(time == times[0] for time in times) - 1
        )  # the first segment that took a step, or the last of all
        self.kept: list[tuple[int, int]] = []
        for index, ((_, last), count) in enumerate(zip(ends, counts, strict=True)):
            between = index < len(counts) - 1 and output_step is not None and _between(last.time[0], output_step)
            begin = int(index > beginning)
            self.kept.append((begin, max(begin, count - int(between))) if index >= beginning else (0, 0))

    def continued(self, index: int, rows: History) -> History:
        """Rows of segment `index` as rows of the whole."""
        if len(self._first) == 1:
            return rows
        given, last = rows.arrays(), self._first[-1].arrays()
        missing = {name: self._before.get(name, last[name][0]) for name in last if name not in given}
        columns: dict[str, Any] = dict.fromkeys(quantities())
        columns |= {name: given[name] for name in last if name in given}
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


def _between(time: float, output_step: float) -> bool:
    """Whether a time lies between the even times of rows."""
    steps = time / output_step
    return bool(abs(steps - round(steps)) > 1e-6)
