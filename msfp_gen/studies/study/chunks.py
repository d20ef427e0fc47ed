"""Chunks of a study, their files in its folder, and how far it has come.

Each part is named after a digest of everything that determines its rows.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from hashlib import sha256
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from msfp_gen.common.errors import InputError
from msfp_gen.common.identity import fingerprint
from msfp_gen.common.output import clear_all_leftovers, write_bytes
from msfp_gen.common.tables import Table
from msfp_gen.common.version import __version__
from msfp_gen.jit.cache import digest_sources
from msfp_gen.scene.file.loader import dumps, toml_file
from msfp_gen.studies.study.definition import Study, Task

FORMAT = 1  # of the rows of a part
STUDY_FILE = "study.toml"
PARTS = "part-*.parquet"
_NAME = re.compile(r"part-(\d{7})-[0-9a-f]{16}\.parquet")
IDLE = 3  # times the longest interval between parts, after which a study counts as not running
LEAST_IDLE = 10.0  # that time at least [s]


class Chunks:
    """The chunks of a study and their parts in a folder."""

    def __init__(self, study: Study, folder: Path) -> None:
        self.study = study
        self.folder = folder

    def path(self, task: Task) -> Path:
        """The file of the part of a chunk."""
        total = self._base.copy()
        total.update(f"{task.first} {len(task)}".encode())
        codes = iter(task.codes)
        for digests in self._digests:
            total.update(digests[next(codes)].tobytes() if digests is not None else b"")
        total.update(np.ascontiguousarray(task.drawn, dtype="<f8").tobytes())
        return self.folder / f"part-{task.number:07d}-{total.hexdigest()[:16]}.parquet"

    @cached_property
    def digest(self) -> str:
        """Digest of everything that all rows have in common: scene, quantities, limits and equations."""
        return str(self._base.hexdigest())

    @cached_property
    def _base(self) -> Any:
        study = self.study
        common = {
            "format": FORMAT,
            "version": __version__,
            "equations": digest_sources(),
            "scene": study.recipe.scene,
            "base": study.base,
            "factors": study.recipe.factors,
            "axes": [(axis.name, axis.change, axis.paths, axis.surfaces, axis.random) for axis in study.axes],
            "keep": [study.keep.names, study.keep.formulas, study.keep.counts.surfaces],
            "intensity": study.table.get("records", {}).get("intensity"),
            "run_seconds": study.limits.run_seconds,
        }
        return sha256(fingerprint(common, study.files).encode())

    @cached_property
    def _digests(self) -> list[Any]:
        """Of each grid axis the digests of its values and labels, as an array of 16 bytes each."""
        study, digests_of_axes = self.study, []
        for index, axis in enumerate(study.axes):
            if axis.values is None:
                continue
            contents = [
                (study.recipe.records[value] if axis.change == "record" else value, label, study.opened.get((index, k)))
                for k, (value, label) in enumerate(zip(axis.values, axis.labels, strict=True))
            ]
            digests = [bytes.fromhex(fingerprint(value, study.files))[:16] for value in contents]
            digests_of_axes.append(np.array(digests, dtype="V16"))
        return digests_of_axes

    @cached_property
    def identity(self) -> str:
        """Digest of everything that any row of the study depends on; that of what workers keep for it."""
        return fingerprint((self.digest, [digests.tobytes() for digests in self._digests]))

    def open(self) -> None:
        """Write `study.toml`; parts of a last, shorter chunk that the study has outgrown are removed.

        Raises InputError where the folder has parts of another study, or of another version.
        """
        clear_all_leftovers(self.folder, ".parquet")
        present = parts_in(self.folder)
        if present:
            self._check(present)
        about = {
            "runs": self.study.runs,
            "chunk": self.study.chunk,
            "samples": len(self.study.samples),
            "msfp_gen": __version__,
            "digest": self.digest,
        }
        text = dumps({"about": about, **self.study.table, "chunk": self.study.chunk})
        path = self.folder / STUDY_FILE
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            write_bytes(path, [text.encode()])

    def started(self) -> None:
        """Note that runs start now: the time of `study.toml`, from which their rate is counted."""
        os.utime(self.folder / STUDY_FILE)

    def _check(self, present: dict[str, int]) -> None:
        chunks = self.study.chunks
        other = [
            name
            for name, number in present.items()
            if number >= chunks or self.path(self.study.task(number)).name != name
        ]
        before = _about(self.folder)
        old_runs, old_chunk = int(before.get("runs", 0)), int(before.get("chunk", 1))
        short = old_runs // old_chunk if old_runs % old_chunk else -1  # the last chunk, unless it was a whole one
        for name in other:
            if present[name] != short or old_runs >= self.study.runs:
                raise InputError(
                    f"output = {str(self.folder)!r}: this folder has parts of another study "
                    f"({self._difference(before)}); give another folder"
                )
        for name in other:
            (self.folder / name).unlink()

    def _difference(self, before: dict[str, Any]) -> str:
        """Where the study in the folder differs."""
        if before.get("msfp_gen", __version__) != __version__:
            return f"computed by msfp-gen {before['msfp_gen']}"
        old = _read(self.folder)
        new = {"about": {}, **self.study.table, "chunk": self.study.chunk}
        return next(
            (f"{key} differs" for key in (*new, *old) if key != "about" and _text(old.get(key)) != _text(new.get(key))),
            "its files or the equations have changed",
        )


def chunks_in(study: Study, folder: Path) -> Chunks:
    """The chunks of a study in a folder: of the size that they have there, unless the study file gives one."""
    size = _about(folder).get("chunk")
    if study.given_chunk is None and isinstance(size, int) and size > 0 and parts_in(folder):
        study = replace(study, given_chunk=size)
    return Chunks(study, folder)


def _text(value: Any) -> str:
    return dumps({"value": value})


def parts_in(folder: Path) -> dict[str, int]:
    """Name -> number of the chunk, of every part in a folder."""
    return {path.name: int(match[1]) for path in folder.glob(PARTS) if (match := _NAME.fullmatch(path.name))}


@contextmanager
def readable_parts(path: Path) -> Iterator[None]:
    """Raise InputError that names a part, or the folder of all, where reading shows that it is damaged."""
    from pyarrow import ArrowException

    try:
        yield
    except (ArrowException, OSError, LookupError, ValueError) as error:
        raise InputError(
            f"{str(path)!r}: a part of the study is damaged ({error}); remove it and run the study again"
        ) from error


def _read(folder: Path) -> dict[str, Any]:
    path = folder / STUDY_FILE
    return toml_file(path) if path.is_file() else {}


def _about(folder: Path) -> dict[str, Any]:
    return dict(_read(folder).get("about", {}))


def study_table(folder: Path) -> dict[str, Any]:
    """The table of `study.toml` in the folder of a study. Raises InputError where there is none."""
    if not (folder / STUDY_FILE).is_file():
        raise InputError(
            f"{str(folder)!r}: no {STUDY_FILE} here; give the folder of a study (`msfp-gen study FILE -o DIR`)"
        )
    try:
        table = toml_file(folder / STUDY_FILE)
        counts = {key: int(table["about"][key]) for key in ("runs", "chunk", "samples")}
    except (InputError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{folder / STUDY_FILE}: not written by msfp-gen ({error}); run the study again") from None
    return {**table, "about": {**table["about"], **counts}}


@dataclass(frozen=True)
class Status:
    """How far a study has come.

    Attributes:
        name: of the study.
        runs, done, failed: numbers of runs: all, in parts, and of these not ended with `ok` or `stopped`.
        parts, chunks: numbers of parts that are written, and of all.
        rate: runs per second since the study was last started, on all its workers [1/s]; None before the first part.
        running: whether parts still appear.
        seconds_left: time left at that rate [s]; None where it is not known.
    """

    name: str
    runs: int
    done: int
    failed: int
    parts: int
    chunks: int
    rate: float | None
    running: bool
    seconds_left: float | None

    def as_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON."""
        return asdict(self)


def study_status(folder: str | Path) -> Status:
    """How far the study in a folder has come. Raises InputError where there is none."""
    folder = Path(folder)
    table = study_table(folder)
    runs, chunk = table["about"]["runs"], table["about"]["chunk"]
    parts = parts_in(folder)
    written = {name: min(chunk, runs - number * chunk) for name, number in parts.items()}
    done = sum(written.values())
    rate, running = _rate(folder, written)
    return Status(
        name=str(table.get("name", "")),
        runs=runs,
        done=done,
        failed=sum(failures(folder / name) for name in parts),
        parts=len(parts),
        chunks=-(-runs // chunk),
        rate=rate,
        running=running and done < runs,
        seconds_left=None if rate is None else (runs - done) / rate,
    )


def _rate(folder: Path, written: dict[str, int]) -> tuple[float | None, bool]:
    """Runs per second since the study was last started, and whether parts still appear.

    Workers end their chunks in bunches, so that the time between two parts says nothing: the rate counts from the
    start, which is the time of `study.toml`.
    """
    begin = (folder / STUDY_FILE).stat().st_mtime
    stamps = ((folder / name).stat().st_mtime for name in written)
    times = sorted((stamp, count) for stamp, count in zip(stamps, written.values(), strict=True) if stamp > begin)
    if not times:
        return None, False
    ends = [begin, *(stamp for stamp, _ in times)]
    longest = max(after - before for before, after in pairwise(ends))
    rate = sum(count for _, count in times) / (ends[-1] - begin)
    return rate, time.time() - ends[-1] < max(IDLE * longest, LEAST_IDLE)


def failures(part: Path) -> int:
    """The number of failed runs of a part. Raises InputError where it is damaged."""
    import pyarrow.parquet as pq

    with readable_parts(part):
        return int((pq.read_schema(part).metadata or {})[b"failed"])


def status_table(status: Status) -> Table:
    """The status for a terminal."""
    rows = [
        ("runs", f"{status.done} of {status.runs} done ({100 * status.done / status.runs:.1f} %)"),
        ("failed", f"{status.failed}; see the columns status and message" if status.failed else "0"),
        ("parts", f"{status.parts} of {status.chunks}"),
    ]
    if status.rate is not None:
        rows.append(("rate", f"{status.rate:.3g} runs per second"))
    if status.done == status.runs:
        rows.append(("state", "complete"))
    elif status.running and status.seconds_left is not None:
        rows.append(("state", f"running, {status.seconds_left:.0f} s left"))
    elif status.rate is None and status.parts < status.chunks:
        rows.append(("state", "no part since it was started; the same command continues it if it stopped"))
    else:
        rows.append(("state", "not running; the same command continues it"))
    return Table(status.name or "study", (), rows)
