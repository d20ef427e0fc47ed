"""Rows of a run on disk while it runs, so that its memory does not grow."""

from __future__ import annotations

import os
import tempfile
import zlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.row_unpacking import finite_rows

if TYPE_CHECKING:
    from msfp_gen.model.compiled import Run
    from msfp_gen.model.model import Model

ROWS_HELD = 4096  # rows in memory after which they are written


def rows_beside(checkpoint: Path) -> Path:
    """The file with the rows of a segment that has this checkpoint."""
    return checkpoint.with_name(f"{checkpoint.name}.rows")


class RowFile:
    """The rows of one segment in a file, but for the last, which the run holds.

    Parameters
    ----------
    path
        The file, which stays; None: one without a name in `folder`, which goes with this object.
    folder
        Of the result.
    size
        Numbers in a row.
    resume
        Continue with the rows in the file; otherwise they are removed.

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

    @classmethod
    def of_segment(cls, checkpoint: Path | None, folder: Path, model: Model, resume: bool) -> RowFile:
        """That of a new segment: beside its checkpoint, if it has one, else in `folder`."""
        path = None if checkpoint is None else rows_beside(checkpoint)
        return cls(path, folder, model.extension.ROW_SIZE, resume)

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
