"""`study`: runs what is missing of a study, on any engine: each chunk in a worker, whose rows are kept as it ends."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from msfp_gen.common.errors import InputError, RunError
from msfp_gen.common.inputs import Files, expecting
from msfp_gen.common.output import make_folder, write_bytes
from msfp_gen.common.tables import parquet_bytes
from msfp_gen.studies.batch import BAD_INPUT, ENDED, OUT_OF_TIME, build_models, check_method, run_to_end
from msfp_gen.studies.columns import Column, Keep
from msfp_gen.studies.pool import Pool, pool_from
from msfp_gen.studies.study.axes import INTENSITY, Recipe, SceneFactory
from msfp_gen.studies.study.chunks import Chunks, chunks_in, failures, parts_in
from msfp_gen.studies.study.definition import Study, Task
from msfp_gen.studies.study.loader import load_study

if TYPE_CHECKING:
    from msfp_gen.buildings.file import AnyScene

Progress = Callable[[int, int], None]


class Outcome(NamedTuple):
    """What a call of `study` did: runs (of the shard), done before, done now, and failed in all."""

    runs: int
    before: int
    done: int
    failed: int


def study(
    source: Study | str | Path | Mapping[str, Any],
    output: str | Path,
    *,
    workers: int | None = None,
    threads: bool = False,
    executor: Executor | None = None,
    dask: str | None = None,
    mpi: bool = False,
    shard: tuple[int, int] = (1, 1),
    progress: Progress | None = None,
) -> Outcome:
    """Run a study: what is missing in its folder is computed, and each chunk is one Parquet file there.

    The same call continues a study that was interrupted, at any time and by anything; a chunk per worker is lost at
    most. A run that fails is a row with its status and message. With processes, a script must make this call under
    `if __name__ == "__main__":`.

    Parameters
    ----------
    source
        A study file (docs/studies.md), a table of the same keys, or a `Study`.
    output
        The folder of the study: `part-*.parquet` and `study.toml`. It is made if it does not exist.
    workers
        Runs at the same time; None: one for each core.
    threads
        Threads instead of processes: they start at once, and suit few and long runs.
    executor
        An executor (`concurrent.futures`) to run on, such as that of Parsl; it stays open.
    dask
        Address or scheduler file of a Dask cluster to run on.
    mpi
        Run on the other processes of `mpiexec ... -m mpi4py.futures`.
    shard
        (i, n): only every n-th chunk, from the i-th; for job arrays that share `output`.
    progress
        Called with the runs that are done, earlier ones included, and all (of the shard).

    Returns
    -------
    Outcome
        Numbers of runs: all, done before, done now, and failed, in this call and before.

    Raises
    ------
    InputError
        Invalid input, or a folder with another study; nothing was computed.
    RunError
        Workers died, or more runs failed than `limits.failures` permits. What is done is kept.

    """
    _check_shard(shard)
    definition = source if isinstance(source, Study) else load_study(source)
    with pool_from(workers, threads, executor, dask, mpi) as pool:
        return run_on(pool, definition, Path(output), shard, progress)


def run_on(
    pool: Pool, study: Study, folder: Path, shard: tuple[int, int] = (1, 1), progress: Progress | None = None
) -> Outcome:
    """Compute what is missing of a study on a pool. Arguments and errors are those of `study`."""
    make_folder(folder, "output")
    chunks = chunks_in(study, folder)
    chunks.open()
    return _run(chunks, pool, shard, progress)


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


def _run(chunks: Chunks, pool: Pool, shard: tuple[int, int], progress: Progress | None) -> Outcome:
    study, present = chunks.study, set(parts_in(chunks.folder))
    numbers = range(shard[0] - 1, study.chunks, shard[1])
    total, missing, before, failed = 0, [], 0, 0
    for task in map(study.task, numbers):
        total += len(task)
        if (path := chunks.path(task)).name in present:
            before, failed = before + len(task), failed + failures(path)
        else:
            missing.append(task.number)
    _check_failures(study, failed, before, chunks.folder)
    if missing:
        build_models([study.scene(1)])  # local workers find its model in the cache; other hosts build their own
        chunks.started()
    if progress is not None:
        progress(before, total)
    done = 0
    timed = "listed" in study.table.get("accuracy", {})
    order = Order(
        chunks.identity, chunks.digest, study.recipe, study.files, study.keep, study.limits.run_seconds, timed
    )  # fmt: skip
    calls = ((task, (order, task)) for task in map(study.task, missing))
    for task, (part, bad) in pool.results(run_chunk, calls):
        write_bytes(chunks.path(task), [part], tidy=False)
        done, failed = done + len(task), failed + bad
        if progress is not None:
            progress(before + done, total)
        _check_failures(study, failed, before + done, chunks.folder)
    return Outcome(total, before, done, failed)


def _check_failures(study: Study, failed: int, done: int, folder: Path) -> None:
    """Raise RunError where more runs have failed than the study permits."""
    limit = study.limits.failures
    if limit is not None and failed > limit:
        raise RunError(
            f"{failed} of {done} runs failed, more than limits.failures = {limit}; see the column message in {folder}, "
            "where they are kept"
        )


class Order(NamedTuple):
    """What workers need for any chunk of a study.

    identity: of the whole study. digest: of what its parts have in common. files: path -> sha256 of those that its
    scenes open. timed: whether parts state their seconds, for an estimate; otherwise equal rows have equal bytes.
    """

    identity: str
    digest: str
    recipe: Recipe
    files: Files
    keep: Keep
    run_seconds: float | None
    timed: bool = False


_factories: dict[str, SceneFactory] = {}  # of the last study only


def run_chunk(order: Order, task: Task) -> tuple[bytes, int]:
    """The part of a chunk as the bytes of a Parquet file, and how many of its runs failed.

    Raises ChangedFileError where a file is not as it was when the study was checked.
    """
    with expecting(order.files):
        return _chunk(order, task)


def _chunk(order: Order, task: Task) -> tuple[bytes, int]:
    factory = _factories.get(order.identity)
    if factory is None:
        factory = SceneFactory(order.recipe)
        _factories.clear()
        _factories[order.identity] = factory
    begin = time.thread_time()
    axes = order.recipe.axes
    rows = []
    for offset, (values, labels) in enumerate(task.rows(axes), start=1):
        at = {axis.name: label for axis, label in zip(axes, labels, strict=True)}
        intensity = order.recipe.intensity(at)
        numbers = {**{axis.name: at[axis.name] for axis in axes if axis.numeric}, **intensity}
        status, message, kept = _row(partial(factory.scene, values), order, numbers)
        rows.append({"run": task.first + offset, **at, "status": status, "message": message, **intensity, **kept})
    failed = sum(row["status"] not in ENDED for row in rows)
    seconds = time.thread_time() - begin
    return _part(order, rows, failed, {"seconds": f"{seconds:.4g}"} if order.timed else {}), failed


def _row(make: Callable[[], AnyScene], order: Order, at: dict[str, float]) -> tuple[str, str, dict[str, Any]]:
    """Status, message and quantities of one run."""
    try:
        scene = make()
        check_method(scene)
        result = run_to_end(scene, seconds=order.run_seconds)
    except InputError as error:
        return BAD_INPUT, str(error), {}
    except RunError as error:  # without rows, or with those that a slow computer reaches
        remedy = "; see limits.run_seconds" if error.status == OUT_OF_TIME else ""
        return error.status, f"{error}{remedy}", {}
    kept, problem = order.keep.values(result, at)
    return result.status, result.message or problem, kept


def _part(order: Order, rows: list[dict[str, Any]], failed: int, more: dict[str, str]) -> bytes:
    """The columns of every part: run, axes, status, message, intensity, quantities. more: metadata."""
    axes = [Column(axis.name, "", not axis.numeric) for axis in order.recipe.axes]
    intensity = [Column(INTENSITY, "m/s^2")] if order.recipe.intensities else []
    texts = [Column("status", "", text=True), Column("message", "", text=True)]
    columns = [*axes, *texts, *intensity, *order.keep.columns()]
    types = {"run": "int64", **{name: "string" if text else "double" for name, _, text in columns}}
    values = {(name, unit): [row.get(name) for row in rows] for name, unit, _ in (Column("run", ""), *columns)}
    return parquet_bytes(values, types, {"digest": order.digest, "failed": str(failed), **more})
