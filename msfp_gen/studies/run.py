"""`study`: runs the missing chunks of a study on a pool, and writes their rows into the folder of the study.

Last step of a study: a worker runs a chunk, and the rows become one file, the part of the chunk. The name of the part
contains a digest of everything that determines its rows. So the parts in the folder state how far a study has come
(`study_status`).
"""

from __future__ import annotations

import json
import os
import re
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from hashlib import sha256
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from msfp_gen.common.aliases import Progress
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.common.identity import fingerprint
from msfp_gen.common.inputs import Files, expecting
from msfp_gen.common.output import clear_all_leftovers, make_folder, write_bytes
from msfp_gen.common.tables import Table, parquet_bytes
from msfp_gen.common.version import __version__
from msfp_gen.jit.cache import digest_sources
from msfp_gen.scene.file.loader import dumps, toml_file
from msfp_gen.scene.plausibility import require_meant
from msfp_gen.studies.axes import INTENSITY, SceneFactory, StudyInputs
from msfp_gen.studies.batch import (
    BAD_INPUT,
    ENDED,
    OUT_OF_TIME,
    build_models,
    run_to_end,
)
from msfp_gen.studies.columns import Column, Keep
from msfp_gen.studies.definition import Study, Task, load_study
from msfp_gen.studies.workers import Pool, pool_from

if TYPE_CHECKING:
    from msfp_gen.scene.system import System

FORMAT = 1  # version of the format of a part
STUDY_FILE = "study.toml"
PARTS = "part-*.parquet"
_NAME = re.compile(r"part-(\d{7})-[0-9a-f]{16}\.parquet")
IDLE = 3  # a study without a new part for this many times the longest interval between parts is not running
LEAST_IDLE = 10.0  # shortest time without a new part after which a study is not running [s]


class Outcome(NamedTuple):
    """What a call of `study` did, as numbers of runs.

    runs: of the shard. before: done by earlier calls. done: by this call. failed: of all runs that are done.
    """

    runs: int
    before: int
    done: int
    failed: int


def study(
    source: Study | str | Path | Mapping[str, Any],
    output: str | Path,
    *,
    workers: int | None = None,
    executor: Executor | None = None,
    dask: str | None = None,
    shard: tuple[int, int] = (1, 1),
    force: bool = False,
    progress: Progress | None = None,
) -> Outcome:
    """Run the missing chunks of a study; each chunk becomes one Parquet file in the folder of the study.

    The same call continues a study that was interrupted at any time; each worker loses one chunk at most. A run that
    fails is a row with its status and message.

    Args:
        source: a study file (docs/studies.md), a table of the same keys, or a `Study`.
        output: the folder of the study, for `part-*.parquet` and `study.toml`; made if it does not exist.
        workers: runs at the same time; None: one for each core.
        executor: an executor (`concurrent.futures`) to run on, such as one of mpi4py or Parsl; it stays open.
        dask: address or scheduler file of a Dask cluster to run on.
        shard: (i, n): only every n-th chunk, from the i-th; for job arrays that share `output`.
        force: whether to run also with values of the first or the last run that are implausible in any unit.
        progress: called with the number of runs done, by earlier calls too, and the number of runs of the shard.

    Raises InputError before any run: invalid input, or a folder with another study; RunError: workers died, or more
    runs failed than `limits.failures` permits. The parts that are written are kept.
    """
    _check_shard(shard)
    definition = source if isinstance(source, Study) else load_study(source)
    require_meant(*definition.ends, force=force)
    with pool_from(workers, executor, dask) as pool:
        return run_on(pool, definition, Path(output), shard, progress)


def run_on(
    pool: Pool,
    study: Study,
    folder: Path,
    shard: tuple[int, int] = (1, 1),
    progress: Progress | None = None,
    without: Collection[int] = (),
) -> Outcome:
    """Run the missing chunks of a study on a pool. Arguments, result and errors: see `study`.

    without: numbers of chunks, from 0, that are not run, and not part of the result.
    """
    make_folder(folder, "output")
    chunks = Chunks(study, folder)
    chunks.open()
    study, present = chunks.study, set(parts_in(chunks.folder))
    numbers = [number for number in range(shard[0] - 1, study.chunks, shard[1]) if number not in without]
    total, missing, before, failed = 0, [], 0, 0
    for task in map(study.task, numbers):
        total += len(task)
        if (path := chunks.path(task)).name in present:
            before, failed = before + len(task), failed + failures(path)
        else:
            missing.append(task.number)
    _check_failures(study, failed, before, chunks.folder)
    if missing:
        build_models([study.scene(1)])  # workers on this host find the model in the cache; other hosts build their own
        chunks.started()
    if progress is not None:
        progress(before, total)
    done = 0
    timed = "draws" in study.table.get("accuracy", {})
    common = study.inputs, study.files, study.keep, study.limits.run_seconds
    job = ChunkJob(chunks.identity, chunks.digest, *common, timed)
    calls = ((task, (job, task)) for task in map(study.task, missing))
    for task, (part, bad) in pool.results(run_chunk, calls):
        write_bytes(chunks.path(task), [part], tidy=False)
        done, failed = done + len(task), failed + bad
        if progress is not None:
            progress(before + done, total)
        _check_failures(study, failed, before + done, chunks.folder)
    return Outcome(total, before, done, failed)


def parsed_shard(text: str) -> tuple[int, int]:
    """(i, n) of a text i/n. Raises InputError."""
    first, _, count = text.partition("/")
    try:
        shard = int(first), int(count)
    except ValueError:
        raise InputError(f"--shard = {text!r}: give i/n, such as 3/16 for the third of 16 jobs") from None
    _check_shard(shard)
    return shard


def _check_shard(shard: tuple[int, int]) -> None:
    numbers = tuple(shard) if isinstance(shard, Sequence) else ()
    if len(numbers) != 2 or not all(isinstance(n, int) for n in numbers) or not 1 <= numbers[0] <= numbers[1]:
        raise InputError(f"shard = {'/'.join(map(str, numbers)) or shard!r}: give i/n with i from 1 to n")


def _check_failures(study: Study, failed: int, done: int, folder: Path) -> None:
    """Raise RunError where more runs have failed than the study permits."""
    limit = study.limits.failures
    if limit is not None and failed > limit:
        raise RunError(
            f"{failed} of {done} runs failed, more than limits.failures = {limit}; see the column message in {folder}, "
            "where they are kept"
        )


class ChunkJob(NamedTuple):
    """All that a worker needs for any chunk of a study.

    identity, digest: see `Chunks`. files: path -> sha256 of the files that the scenes open. timed: whether a part
    states its core time, for an estimate; without it equal rows have equal bytes.
    """

    identity: str
    digest: str
    inputs: StudyInputs
    files: Files
    keep: Keep
    run_seconds: float | None
    timed: bool = False


_factories: dict[str, SceneFactory] = {}  # identity of a study -> its factory; of the last study only


def run_chunk(job: ChunkJob, task: Task) -> tuple[bytes, int]:
    """Run a chunk in a worker; returns its part as the bytes of a Parquet file, and the number of failed runs.

    Raises ChangedFileError where a file has changed since the study was checked.
    """
    with expecting(job.files):
        factory = _factories.get(job.identity)
        if factory is None:
            factory = SceneFactory(job.inputs)
            _factories.clear()
            _factories[job.identity] = factory
        begin = time.thread_time()
        axes = job.inputs.axes
        rows = []
        for offset, (values, labels) in enumerate(task.rows(axes), start=1):
            at = {axis.name: label for axis, label in zip(axes, labels, strict=True)}
            intensity = job.inputs.intensity(at)
            numbers = {**{axis.name: at[axis.name] for axis in axes if axis.numeric}, **intensity}
            status, message, columns = _row(partial(factory.scene, values), job, numbers)
            about = {"run": task.first + offset, **at, "status": status, "message": message}
            rows.append({**about, **intensity, **columns})
    failed = sum(row["status"] not in ENDED for row in rows)
    seconds = time.thread_time() - begin
    return _part(job, rows, failed, {"seconds": f"{seconds:.4g}"} if job.timed else {}), failed


def _row(make: Callable[[], System], job: ChunkJob, at: dict[str, float]) -> tuple[str, str, dict[str, Any]]:
    """Status, message and kept columns of one run. make: makes its scene. at: numbers of the axes, for formulas."""
    try:
        scene = make()
        scene.check_method()
        result = run_to_end(scene, seconds=job.run_seconds, cores=1)
    except InputError as error:
        return BAD_INPUT, str(error), {}
    except RunError as error:  # a run without rows, or out of time: its rows would depend on the computer
        remedy = "; see limits.run_seconds" if error.status == OUT_OF_TIME else ""
        return error.status, f"{error}{remedy}", {}
    columns, problem = job.keep.values(result, at)
    return result.status, result.message or problem, columns


def _part(job: ChunkJob, rows: list[dict[str, Any]], failed: int, more: dict[str, str]) -> bytes:
    """A part as bytes. Its columns: run, axes, status, message, intensity, kept quantities. more: metadata."""
    axes = [Column(axis.name, "", not axis.numeric) for axis in job.inputs.axes]
    intensity = [Column(INTENSITY, "m/s^2")] if job.inputs.intensities else []
    texts = [Column("status", "", text=True), Column("message", "", text=True)]
    columns = [*axes, *texts, *intensity, *job.keep.columns]
    types = {"run": "int64", **{name: "string" if text else "double" for name, _, text in columns}}
    values = {(name, unit): [row.get(name) for row in rows] for name, unit, _ in (Column("run", ""), *columns)}
    sides = {name: job.keep.side(name) for name in job.keep.numbers}
    about = {"digest": job.digest, "failed": str(failed), "sides": json.dumps(sides), **more}
    return parquet_bytes(values, types, about)


class Chunks:
    """The chunks of a study in a folder, with the size of the parts that are there, unless the study file gives one.

    study: with that size. folder: of the study.
    """

    def __init__(self, study: Study, folder: Path) -> None:
        size = _read(folder).get("about", {}).get("chunk")
        if study.given_chunk is None and isinstance(size, int) and size > 0 and parts_in(folder):
            study = replace(study, given_chunk=size)
        self.study, self.folder = study, folder

    def path(self, task: Task) -> Path:
        """The file of the part of a chunk."""
        digest = self._common.copy()
        digest.update(f"{task.first} {len(task)}".encode())
        for codes, digests in zip(task.codes, self._digests, strict=True):
            digest.update(digests[codes].tobytes())
        digest.update(np.ascontiguousarray(task.drawn, dtype="<f8").tobytes())
        return self.folder / f"part-{task.number:07d}-{digest.hexdigest()[:16]}.parquet"

    @cached_property
    def digest(self) -> str:
        """Digest of everything that all rows have in common: scene, quantities, limits and equations."""
        return str(self._common.hexdigest())

    @cached_property
    def _common(self) -> Any:
        """The running digest of everything that all rows have in common."""
        study = self.study
        common = {
            "format": FORMAT,
            "version": __version__,
            "equations": digest_sources(),
            "scene": study.inputs.scene,
            "base": study.base,
            "factors": study.inputs.factors,
            "axes": [(axis.name, axis.change, axis.paths, axis.surfaces, axis.random) for axis in study.axes],
            "keep": [study.keep.names, study.keep.formulas, sorted(study.keep.known)],
            "intensity": study.table.get("records", {}).get("intensity"),
            "run_seconds": study.limits.run_seconds,
        }
        return sha256(fingerprint(common, study.files).encode())

    @cached_property
    def _digests(self) -> list[Any]:
        """For each gridded axis the digests of its values and labels, array of 16 bytes, shape (values,)."""
        study, digests_of_axes = self.study, []
        for index, axis in enumerate(study.axes):
            if axis.values is None:
                continue
            contents = [
                (study.inputs.records[value] if axis.change == "record" else value, label, study.opened.get((index, k)))
                for k, (value, label) in enumerate(zip(axis.values, axis.labels, strict=True))
            ]
            digests = [bytes.fromhex(fingerprint(value, study.files))[:16] for value in contents]
            digests_of_axes.append(np.array(digests, dtype="V16"))
        return digests_of_axes

    @cached_property
    def identity(self) -> str:
        """Digest of everything that any row of the study depends on."""
        return fingerprint((self.digest, [digests.tobytes() for digests in self._digests]))

    def open(self) -> None:
        """Write `study.toml`, and remove the part of a shorter last chunk that a study has outgrown.

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
        """Set the time of `study.toml` to now, since the rate of runs is counted from it."""
        os.utime(self.folder / STUDY_FILE)

    def _check(self, present: dict[str, int]) -> None:
        """Remove the part of an outgrown last chunk; raise InputError where any other part is not of this study."""
        chunks = self.study.chunks
        foreign = [
            name
            for name, number in present.items()
            if number >= chunks or self.path(self.study.task(number)).name != name
        ]
        before = _read(self.folder).get("about", {})
        old_runs, old_chunk = int(before.get("runs", 0)), int(before.get("chunk", 1))
        shorter = old_runs // old_chunk if old_runs % old_chunk else -1  # number of a last chunk that was not full
        for name in foreign:
            if present[name] != shorter or old_runs >= self.study.runs:
                raise InputError(
                    f"output = {str(self.folder)!r}: this folder has parts of another study "
                    f"({self._difference(before)}); give another folder"
                )
        for name in foreign:
            (self.folder / name).unlink()

    def _difference(self, before: dict[str, Any]) -> str:
        """In what the study in the folder differs, for a message. before: table `about` of its `study.toml`."""
        if before.get("msfp_gen", __version__) != __version__:
            return f"computed by msfp-gen {before['msfp_gen']}"
        old = _read(self.folder)
        new = {"about": {}, **self.study.table, "chunk": self.study.chunk}
        return next(
            (
                f"{key} differs"
                for key in (*new, *old)
                if key != "about" and dumps({key: old.get(key)}) != dumps({key: new.get(key)})
            ),
            "its files or the equations have changed",
        )


def parts_in(folder: Path) -> dict[str, int]:
    """Name of every part in a folder -> number of its chunk."""
    return {path.name: int(match[1]) for path in folder.glob(PARTS) if (match := _NAME.fullmatch(path.name))}


@contextmanager
def readable_parts(path: Path) -> Iterator[None]:
    """Raise InputError where reading a part fails. path: of the part, or of the folder, for the message."""
    from pyarrow import ArrowException

    try:
        yield
    except (ArrowException, OSError, LookupError, ValueError) as error:
        raise InputError(
            f"{str(path)!r}: a part of the study is damaged ({error}); remove it and run the study again"
        ) from error


def _read(folder: Path) -> dict[str, Any]:
    """The table of `study.toml` in a folder; empty where there is none."""
    path = folder / STUDY_FILE
    return toml_file(path) if path.is_file() else {}


def study_table(folder: Path) -> dict[str, Any]:
    """The table of `study.toml` in the folder of a study. Raises InputError where there is none."""
    if not (folder / STUDY_FILE).is_file():
        raise InputError(
            f"{str(folder)!r}: no {STUDY_FILE} here; give the folder of a study (`msfp-gen study FILE -o DIR`)"
        )
    try:
        table = toml_file(folder / STUDY_FILE)
        counts = {key: int(table["about"][key]) for key in ("runs", "chunk", "samples")}
        if min(counts["runs"], counts["chunk"]) < 1:
            raise ValueError("runs and chunk are above 0")
    except (InputError, KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{folder / STUDY_FILE}: not written by msfp-gen ({error}); run the study again") from None
    return {**table, "about": {**table["about"], **counts}}


@dataclass(frozen=True)
class StudyStatus:
    """How far a study has come.

    Attributes:
        name: of the study.
        runs, done, failed: number of all runs, of runs in parts, and of runs in parts that did not end with `ok` or
            `stopped`.
        parts, chunks: number of parts that are written, and of all chunks.
        rate: runs per second on all workers since the study was last started [1/s]; None before the first part.
        running: whether parts still appear.
        seconds_left: time left at `rate` [s]; None without a rate.
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


def study_status(folder: str | Path) -> StudyStatus:
    """How far the study in a folder has come. Raises InputError where the folder has no study."""
    folder = Path(folder)
    table = study_table(folder)
    runs, chunk = table["about"]["runs"], table["about"]["chunk"]
    parts = parts_in(folder)
    written = {name: min(chunk, runs - number * chunk) for name, number in parts.items()}
    done = sum(written.values())
    rate, running = _rate(folder, written)
    return StudyStatus(
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
    """Runs per second since the study was last started, and whether parts still appear."""
    # Workers end their chunks in bunches, so that the time between two parts is no measure: the rate counts from the
    # start, which is the time of `study.toml`. written: name of a part -> number of its runs.
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
    """The number of failed runs of a part. Raises InputError where the part is damaged."""
    import pyarrow.parquet as pq

    with readable_parts(part):
        return int((pq.read_schema(part).metadata or {})[b"failed"])


def status_table(status: StudyStatus) -> Table:
    """The status of a study as a table for a terminal."""
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
