"""The rows of all segments of a run whose rows are on disk, and the result file that is written from them.

The file is written block by block. It holds what `to_netcdf` writes: variables, attributes and digest are the same.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import reduce
from hashlib import file_digest
from operator import or_
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.output import replacing
from msfp_gen.results.dataset import ROWS, rows_of, to_dataset
from msfp_gen.results.extremes import Extremes
from msfp_gen.results.files import DIGEST, digest_of_dataset
from msfp_gen.results.history import History
from msfp_gen.results.joining import BLOCK, Joint, blocks, concatenated, taken, thinned
from msfp_gen.results.row_unpacking import finite_rows, history_of
from msfp_gen.results.run_data import RunData
from msfp_gen.results.stored_group import ArrayDigest, seal
from msfp_gen.scene.top import is_sprung
from msfp_gen.simulation.segment import Segment, start_temperatures

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene
    from msfp_gen.simulation.result import Result


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
        parts, before = [], 0
        for index, (begin, stop) in enumerate(self._joint.kept):
            first, last = max(start - before, 0), min(end - before, stop - begin)
            if last > first:
                rows = self._parts[index].history(begin + first, begin + last)
                parts.append(self._joint.continued(index, rows))
            before += stop - begin
        return concatenated(parts)

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


def write_blocks(result: RunData, path: Path, count: int, blocks: Iterable[History]) -> None:
    """Write a result with other rows than its own, completely or not at all.

    result: scene, events, status and the rest. count: number of all rows. blocks: these rows in order. Raises OSError
    where the disk is full.
    """
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    from msfp_gen.scene.file.stored_motion import COMPRESSED, GROUP, needs_pieces, to_pieces

    first = to_dataset(replace(result, history=taken(result.history, slice(0, 1))))
    pieces = to_pieces(result.scene.motion) if needs_pieces(result.scene) else None
    along_time = {str(name): v for name, v in first.variables.items() if "time" in v.dims}
    encoding: dict[str, dict[str, Any]] = {
        name: {"chunksizes": (min(count, BLOCK), *variable.shape[1:])} for name, variable in along_time.items()
    }
    for name in encoding.keys() - {"time"}:
        encoding[name] |= {"zlib": True, "complevel": 1}
    with replacing(path) as temporary, _Disk(temporary) as disk:
        with h5netcdf.File(disk, "w") as file:
            first.dump_to_store(H5NetCDFStore(file), encoding=encoding, unlimited_dims=["time"])
            if pieces is not None:
                pieces.dump_to_store(H5NetCDFStore(file, group=GROUP), encoding=COMPRESSED)
            file.resize_dimension("time", count)
            digests = _write_rows(file, disk, blocks)
            file.attrs[DIGEST] = digest_of_dataset(first, {} if pieces is None else {GROUP: pieces}, digests)
        disk.finish()


def _write_rows(file: Any, disk: _Disk, blocks: Iterable[History]) -> dict[str, ArrayDigest]:
    """Write all rows; the digest of each variable."""
    digests: dict[str, ArrayDigest] = {}
    start = 0
    for block in blocks:
        end = start + len(block.time)
        arrays = rows_of(block)
        for name, variable in ROWS.items():
            if variable.field in arrays:
                file[name][start:end] = values = variable.of(arrays)
                digests.setdefault(name, ArrayDigest()).add(values)
        disk.raise_failure()
        start = end
    return digests


class _Disk(io.FileIO):
    """A file for HDF5, which ends the process where a write fails or where it reads otherwise than it wrote.

    A failure is kept and raised between the blocks. Until then what HDF5 writes is kept in memory.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path, "w+")
        self._failure: OSError | None = None
        self._kept: list[tuple[int, bytes]] = []  # place and bytes of every write after a failure

    def write(self, data: Any) -> int:
        """Write all bytes, in memory from a failure on."""
        view, start, done = memoryview(data).cast("B"), self.tell(), 0
        try:
            while self._failure is None and done < len(view):
                done += super().write(view[done:])
        except OSError as error:
            self._failure = error
        if self._failure is not None:
            self._kept.append((start + done, bytes(view[done:])))
        return len(view)

    def readinto(self, buffer: Any) -> int:
        """Read as many bytes as fit; after a failure those that were kept, and zeros where nothing was written."""
        view, start = memoryview(buffer).cast("B"), self.tell()
        count = super().readinto(view) or 0
        if self._failure is None:
            return count
        view[count:] = bytes(len(view) - count)
        for place, data in self._kept:
            low, high = max(place, start), min(place + len(data), start + len(view))
            if low < high:
                view[low - start : high - start] = data[low - place : high - place]
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        """Change the size of the file; after a failure nothing."""
        try:
            return self.tell() if self._failure else super().truncate(size)
        except OSError as error:
            self._failure = error
            return self.tell()

    def raise_failure(self) -> None:
        """Raise the OSError of an earlier write."""
        if self._failure is not None:
            raise self._failure

    def finish(self) -> None:
        """Seal the file and flush it to the disk; raises OSError where that fails or an earlier write did."""
        self.raise_failure()
        self.seek(0)
        self.write(seal(file_digest(self, "sha256")))
        self.raise_failure()
        os.fsync(self.fileno())
