"""The rows of segments: in the frame of the user, on disk while the run goes on, and the file written from them.

The file is written block by block. It holds what `to_netcdf` writes: variables, attributes and digest are the same.
"""

from __future__ import annotations

import io
import os
import tempfile
import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from hashlib import file_digest
from operator import or_
from pathlib import Path
from typing import Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.output import replacing
from msfp_gen.model.compiled import Run
from msfp_gen.model.model import Model
from msfp_gen.model.plane import out_of_plane
from msfp_gen.results.dataset import ROWS, groups_of, rows_of, to_dataset
from msfp_gen.results.files import DIGEST, digest_of_dataset, dump_groups
from msfp_gen.results.history import Event, Extremes, History
from msfp_gen.results.joining import BLOCK, Joint, blocks, concatenated, taken, thinned
from msfp_gen.results.result import Result
from msfp_gen.results.run_data import RunData
from msfp_gen.results.stored_group import ArrayDigest, seal
from msfp_gen.scene.effect_switching import Ending
from msfp_gen.scene.friction_parameters import law_parameters
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.top import is_sprung
from msfp_gen.specification.contract import EVENT_KINDS, WORKS, names

_EVENT_KINDS = names(EVENT_KINDS)


def finite_rows(rows: Array) -> Array:
    """The rows of a segment, shape (T, row size) [SI], up to the first that is not finite."""
    finite = np.isfinite(rows).all(axis=1)
    return rows if finite.all() else rows[: int(finite.argmin())]


def history_of(model: Model, rows: Array, azimuth: float, sprung: bool, first: Array | None = None) -> History:
    """Rows of a segment in the frame of the user.

    rows: of `finite_rows`, one or more. azimuth: of the frame of the model [rad]. sprung: whether the top has a
    vertical spring. first: the first row of the segment, shape (row size,), from which displacement and stored energies
    count; None: that of `rows`.
    """
    return History(**unpacked(model, rows, azimuth, sprung, first))


def unpacked(model: Model, rows: Array, azimuth: float, sprung: bool, first: Array | None = None) -> dict[str, Any]:
    """The fields of `History` from rows of a segment, or from derivatives of rows: they are linear in the rows."""
    f = model.unpack(rows)
    start = model.unpack(rows[0] if first is None else first)
    turn = azimuth
    separation = f["q"][..., 3:] if model.effects.uplift else np.zeros_like(f["force"])
    lift = np.maximum(0.0, -f["compression"]) if model.effects.uplift else np.zeros_like(f["normal"])
    base, top = out_of_plane(f["base"], turn, "vector"), out_of_plane(f["top"], turn, "vector")
    across = base - top
    across_start = out_of_plane(start["base"], turn, "vector") - out_of_plane(start["top"], turn, "vector")
    work = dict(zip(names(WORKS), np.moveaxis(f["work"], -1, 0), strict=True))
    energy = {
        "input": work["input"],
        "kinetic": f["kinetic"] - start["kinetic"],
        "potential": f["potential"] - start["potential"],
        "restraint": f["restraint"] - start["restraint"],
        "friction_stored": work["friction_stored"],
        "friction_dissipated": work["friction_dissipated"],
        "contact_dissipated": work["contact_dissipated"],
        "rim_stored": f["rim_stored"] - start["rim_stored"],
        "rim_dissipated": work["rim_dissipated"],
        "top_dissipated": work["top_dissipated"],
        "seat_stored": f["seat_stored"] - start["seat_stored"],
        "seat_dissipated": work["seat_dissipated"],
    }
    # One term after the other: the digits of a sum by NumPy depend on the number of rows.
    energy["numerical"] = energy["input"] - reduce(np.add, [v for k, v in energy.items() if k != "input"])
    return {
        "time": f["time"],
        "tilt_angles": out_of_plane(f["q"][..., :3], turn, "angles"),
        "tilt_rates": out_of_plane(f["v"][..., :3], turn, "angles"),
        "tilt_accelerations": out_of_plane(f["a"][..., :3], turn, "angles"),
        "friction_state": out_of_plane(f["f"], turn, "pair"),
        "normal_force": f["normal"],
        "contact_angles": out_of_plane(f["angles"], turn, "pair_angles"),
        "sliding": f["sliding"],
        "gap": f["gap"],
        "rim_force": f["rim"],
        "separation": out_of_plane(separation, turn, "vector"),
        "lift": lift,
        "interface_force": out_of_plane(f["force"], turn, "vector"),
        "slip_velocity": out_of_plane(f["slip"], turn, "pair"),
        "base_displacement": base,
        "top_displacement": top,
        "displacement": across - across_start,
        "top_force": out_of_plane(f["top_force"], turn, "vector"),
        "top_moment": out_of_plane(f["top_moment"], turn, "axial"),
        "energy": energy,
        "friction_coefficient": f.get("mu"),
        "temperature": f.get("temperature"),
        "memory": f.get("memory"),
        "top_settlement": f["top_settlement"] if sprung else None,
    }


def events_of(run: Run, azimuth: float) -> tuple[Event, ...]:
    """The events of a segment in the frame of the user."""
    return tuple(
        Event(
            time=t,
            surface=surface,
            kind=_EVENT_KINDS[kind],  # type: ignore[arg-type]
            displacement=out_of_plane(np.array(u), azimuth, "vector"),
            top_force=out_of_plane(np.array(force), azimuth, "vector"),
        )
        for t, surface, kind, u, force in run.events
    )


ROWS_HELD = 4096  # rows in memory after which they are written


def rows_beside(checkpoint: Path) -> Path:
    """The file with the rows of a segment that has this checkpoint."""
    return checkpoint.with_name(f"{checkpoint.name}.rows")


class RowFile:
    """The rows of one segment in a file, but for the last, which the run holds.

    path: the file, which stays; None: one without a name in `folder`, that of the result, which goes with this object.
    size: numbers in a row. resume: continue with the rows in the file; otherwise they are removed.
    """

    def __init__(self, path: Path | None, folder: Path, size: int, resume: bool = False) -> None:
        self.path, self.count, self.checksum = path, 0, 0
        self.ended = False  # a row was not finite: those after it do not count
        self._size = size
        self._named = str(path or folder.absolute())
        if path is None:
            self._file = tempfile.TemporaryFile("w+b", buffering=0, dir=folder)  # noqa: SIM115
        else:
            self._file = path.open("r+b" if resume and path.exists() else "w+b", buffering=0)

    def __del__(self) -> None:
        if hasattr(self, "_file"):
            self._file.close()

    def take(self, run: Run) -> None:
        """Move the rows of a run to the file, but for the last. Raises OSError where the disk is full."""
        rows = finite_rows(run.rows[:-1])
        if len(rows) and not self.ended:
            content = rows.data.cast("B")
            self._write(content)
            self.checksum = zlib.crc32(content, self.checksum)
            self.count += len(rows)
        self.ended = self.ended or len(rows) < run.row_count - 1
        run.drop_rows()

    def sync(self) -> None:
        """Flush the rows to the disk."""
        os.fsync(self._file.fileno())

    def restore(self, count: int, checksum: object) -> None:
        """Continue after `count` rows, and forget those after them. Raises ValueError where they are not there."""
        computed, step = 0, 2**24
        end = count * self._row_bytes
        if os.fstat(self._file.fileno()).st_size < end:
            raise ValueError("rows are missing")
        self._file.seek(0)
        for start in range(0, end, step):
            computed = zlib.crc32(self._file.read(min(step, end - start)) or b"", computed)
        if computed != checksum:
            raise ValueError("rows were changed")
        self._file.truncate(end)
        self._file.seek(end)
        self.count, self.checksum = count, computed

    def read(self, start: int, end: int) -> Array:
        """Rows from one number to another, shape (T, row size) [SI]."""
        at = self._file.tell()
        self._file.seek(start * self._row_bytes)
        rows = np.empty((max(0, end - start), self._size))
        view = rows.data.cast("B") if len(rows) else memoryview(b"")
        while view:
            size = self._file.readinto(view)
            if not size:
                raise OSError(f"{self._named}: rows of the run are missing; another program has changed this file")
            view = view[size:]
        self._file.seek(at)
        return rows

    @property
    def _row_bytes(self) -> int:
        return 8 * self._size

    def _write(self, view: memoryview) -> None:
        try:
            while view:
                view = view[self._file.write(view) :]
        except OSError as error:  # a full disk names no file
            raise OSError(error.errno, error.strerror or str(error), self._named) from error


@dataclass(frozen=True, eq=False)
class Segment:
    """A compiled run that has ended, with its model.

    azimuth: of the frame of the model [rad]. status: how the run ended. wall, setup: wall time of the integration, and
    of build and preparation before it [s]. stored: its rows on disk but for the last, where they are streamed.
    """

    model: Model
    run: Run
    azimuth: float
    status: str
    wall: float
    setup: float
    stored: RowFile | None = None

    @property
    def ending(self) -> Ending:
        """How it ended."""
        _, surface, value = self.run.status
        return Ending(self.model.effects, self.status, self.run.time, surface, value, self.run.trips)


def start_temperatures(segments: Sequence[Segment], scene: Scene) -> dict[str, Array]:
    """The temperature of every surface at the start as "temperature", shape (n-1,) [degC]; nothing without one.

    It is that of the rows of earlier models without heat, and of the friction law in them.
    """
    law = segments[-1].model.effects.law
    if law is None or not law.depends_on_temperature:
        return {}
    parameters = [law_parameters(law, scene.bearing, index) for index in range(scene.bearing.layout.surfaces)]
    return {"temperature": np.array([of_surface["start_temperature"] for of_surface in parameters])}


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

    first = to_dataset(replace(result, history=taken(result.history, slice(0, 1))))
    groups = groups_of(result)
    along_time = {str(name): v for name, v in first.variables.items() if "time" in v.dims}
    encoding: dict[str, dict[str, Any]] = {
        name: {"chunksizes": (min(count, BLOCK), *variable.shape[1:])} for name, variable in along_time.items()
    }
    for name in encoding.keys() - {"time"}:
        encoding[name] |= {"zlib": True, "complevel": 1}
    with replacing(path) as temporary, _Disk(temporary) as disk:
        with h5netcdf.File(disk, "w") as file:
            first.dump_to_store(H5NetCDFStore(file), encoding=encoding, unlimited_dims=["time"])
            dump_groups(file, groups)
            file.resize_dimension("time", count)
            digests = _write_rows(file, disk, blocks)
            file.attrs[DIGEST] = digest_of_dataset(first, groups, digests)
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
