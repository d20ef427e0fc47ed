"""The rows of all segments of a run whose rows are on disk, and the result file that is written from them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import reduce
from operator import or_
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.extremes import Extremes
from msfp_gen.results.history import History
from msfp_gen.results.joining import Joint, concatenated
from msfp_gen.results.row_unpacking import finite_rows, history_of
from msfp_gen.results.streaming import write_blocks
from msfp_gen.results.thinning import blocks, thinned
from msfp_gen.scene.top import is_sprung
from msfp_gen.simulation.segment import Segment, start_temperatures

if TYPE_CHECKING:
    from msfp_gen.result import Result
    from msfp_gen.scene.scene import Scene


class StreamedRows:
    """The rows of all segments of a run, those in files and the last ones that the runs hold.

    Without a row, `count` is 0.
    """

    def __init__(self, segments: Sequence[Segment], scene: Scene) -> None:
        parts = [_SegmentRows(segment, is_sprung(scene.top)) for segment in segments if segment.run.row_count]
        self._parts = [part for part in parts if part.count]
        ends = [(part.history(0, 1), part.history(part.count - 1, part.count)) for part in self._parts]
        before = start_temperatures(segments, scene)
        self._joint = Joint(ends, [part.count for part in self._parts], scene.output_step, before)

    @property
    def count(self) -> int:
        """Number of rows of the whole run."""
        return sum(end - begin for begin, end in self._joint.kept)

    def read(self, start: int, end: int) -> History:
        """Rows of the whole run, from one number to another."""
        found, before = [], 0
        for index, (begin, stop) in enumerate(self._joint.kept):
            first, last = max(start - before, 0), min(end - before, stop - begin)
            if last > first:
                rows = self._parts[index].history(begin + first, begin + last)
                found.append(self._joint.continued(index, rows))
            before += stop - begin
        return concatenated(found)

    def written(self, result_of: Callable[[History], Result], path: Path) -> Result:
        """Write all rows and the rest of the result; the result with a selection of the rows.

        result_of: makes the result of the whole run with these rows.
        """
        result = result_of(thinned(self.count, self.read))
        extremes = reduce(or_, map(Extremes.of_rows, blocks(self.count, self.read)))
        result = replace(result, recorded_extremes=extremes | result.extremes)
        write_blocks(result, path, self.count, blocks(self.count, self.read))
        return result


class _SegmentRows:
    def __init__(self, segment: Segment, sprung: bool) -> None:
        assert segment.stored is not None
        self._segment, self._stored, self._sprung = segment, segment.stored, sprung
        self._stored.take(segment.run)
        self._held = finite_rows(segment.run.rows)[: 0 if self._stored.ended else None]
        self.count = self._stored.count + len(self._held)
        self._first = self._rows(0, 1)[0] if self.count else None

    def history(self, start: int, end: int) -> History:
        """Rows of the segment in the frame of the user."""
        model, azimuth = self._segment.model, self._segment.azimuth
        return history_of(model, self._rows(start, end), azimuth, self._sprung, self._first)

    def _rows(self, start: int, end: int) -> Array:
        stored = self._stored.read(start, min(end, self._stored.count))
        return np.concatenate([stored, self._held]) if end > self._stored.count else stored
