"""A selection of the rows of a long run that fits into memory and keeps its extremes.

The same rows are selected whether the run is in memory or read block by block from a file. Of every group of rows the
first is kept, and that of the fastest slip, so that no short sliding is missed; and the rows of all extremes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.history import History, first_peak
from msfp_gen.results.joining import concatenated, taken

BLOCK = 2**13  # rows that are looked at together
GROUPS = 2**15  # most groups; a run of up to twice as many rows is kept whole

Reader = Callable[[int, int], History]


def thinned(count: int, rows: Reader) -> History:
    """At most about 2 `GROUPS` of `count` rows. rows: gives those from one number to another."""
    if count <= 2 * GROUPS:
        return rows(0, count)
    group = 2 ** int(np.ceil(np.log2(count / GROUPS)))
    kept: list[History] = []
    extremes: History | None = None
    for block in blocks(count, rows, max(BLOCK, group)):
        kept.append(taken(block, _of_groups(block, group)))
        candidates = block if extremes is None else concatenated([extremes, block])
        extremes = taken(candidates, _of_extremes(candidates))
    assert extremes is not None
    regular = concatenated(kept)
    others = ~np.isin(extremes.time, regular.time)
    return concatenated([regular, taken(extremes, others)]) if others.any() else regular


def thinned_history(history: History) -> History:
    """The same of rows that are in memory."""
    if len(history.time) <= 2 * GROUPS:
        return history
    return thinned(len(history.time), lambda start, end: taken(history, slice(start, end)))


def blocks(count: int, rows: Reader, size: int = BLOCK) -> Iterator[History]:
    """`count` rows in blocks of `size`; the last is shorter."""
    for start in range(0, count, size):
        yield rows(start, min(start + size, count))


def _of_groups(block: History, group: int) -> Any:
    """Rows of a block: the first of each group, and that of the fastest slip."""
    speed = np.square(block.slip_velocity).sum(axis=2).max(axis=1)
    starts = np.arange(0, len(speed), group)
    fastest = [start + int(speed[start : start + group].argmax()) for start in starts]
    return np.union1d(starts, fastest)


def _of_extremes(rows: History) -> Any:
    """Rows with the least and the largest of each number, the first of equal ones, and the ends."""
    found = [0, len(rows.time) - 1]
    numbers = [_columns(values) for name, values in rows.arrays().items() if name != "time"]
    for column in np.concatenate([*numbers, *(_columns(values) for values in rows.energy.values())], axis=1).T:
        found += [int(column.argmin()), int(column.argmax())]
    return np.unique([*found, int(rows.horizontal.argmax()), first_peak(rows.horizontal)])


def _columns(values: Array) -> Array:
    return values.reshape(len(values), -1)
