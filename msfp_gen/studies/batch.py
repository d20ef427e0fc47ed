"""Batches of scenes: scenes come in, results go out as the runs end (docs/studies.md)."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from typing import Any

from msfp_gen.common.aliases import Progress
from msfp_gen.common.cores import usable_cores
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.model.model import build_model, working_time
from msfp_gen.scene.system import System, is_system
from msfp_gen.simulation.memory import require_memory
from msfp_gen.simulation.simulate import integrate
from msfp_gen.studies.workers import SharedProgress, local_pool, proceed, worker_count

ENDED = ("ok", "stopped")  # statuses of runs that did not fail
BAD_INPUT, OUT_OF_TIME = "input", "limit"  # statuses that only runs of studies have


def simulate_batch(
    scenes: Iterable[System],
    *,
    workers: int | None = None,
    strict: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> list[Any]:
    """Integrate many scenes at the same time; every result is equal to the result of `simulate`, bit by bit.

    All models are built before the first run starts. Ctrl-C ends all runs within a few thousand steps.

    Args:
        scenes: the scenes; all of their fields may differ.
        workers: number of runs at the same time; None: the number of cores that this process may use.
        strict: as in `simulate`.
        progress: called in the thread of the caller with the number of completed scenes and the number of all scenes.

    Returns a list of Result, or of BuildingResult for buildings, in the order of the scenes. A run that fails raises no
    error: its `status` and `message` describe the failure, and its history has the rows until then.

    Raises InputError before any run: an entry is no scene, its method does not support its effects (the message starts
    with the index, as in `scenes[3]`), or the rows of all runs do not fit into memory. RunError: a scene failed at its
    start, so that it has no rows, or a worker process died; the other runs are ended.
    """
    if is_system(scenes):
        raise InputError("scenes: this is one scene; give a list of them")
    scenes = list(scenes)
    labels = [f"scenes[{index}]" for index in range(len(scenes))]
    for label, scene in zip(labels, scenes, strict=True):
        if not is_system(scene):
            raise InputError(f"{label}: a {type(scene).__name__} is no scene; give what load_scene returns")
    runs = completed_runs(scenes, workers, strict=strict, labels=labels)
    require_memory(scenes)
    results: dict[int, Any] = {}
    with closing(runs):
        for index, result in runs:
            if isinstance(result, RunError):
                raise result
            results[index] = result
            if progress is not None:
                progress(len(results), len(scenes))
    return [results[index] for index in range(len(scenes))]


def completed_runs(
    scenes: Sequence[System],
    workers: int | None = None,
    *,
    strict: bool = False,
    labels: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> Generator[tuple[int, Any], None, None]:
    """Run scenes at the same time; yields (index, result) in the order in which the runs end.

    Arguments and results are as in `simulate_batch`, with two differences. The result of a run that failed before its
    first row is its RunError. No result is kept, so that the rows of all runs need not fit into memory. Closing the
    iterator, or an exception in its consumer (use `contextlib.closing`), ends the other runs. Raises InputError before
    the first run, and RunError where a worker process died.

    labels: of the scenes in messages; None: the names of the scenes. progress: as `report` of `SharedProgress`.
    """
    count = worker_count(workers)
    labels = [scene.name for scene in scenes] if labels is None else labels
    for label, scene in zip(labels, scenes, strict=True):
        with _located(label):
            scene.check_method()
            if strict and "strict" not in scene.run_options:
                raise InputError("strict: only runs of one bearing have it; leave it out")
    report = None if progress is None else SharedProgress(len(scenes), progress).of
    cores = max(1, usable_cores() // max(1, min(count, len(scenes))))  # of each run

    def results() -> Generator[tuple[int, Any], None, None]:
        build_models(scenes)
        # Long runs start first, so that all workers end at about the same time.
        order = sorted(range(len(scenes)), key=lambda index: -scenes[index].end)
        calls = ((index, (labels[index], scenes[index], strict, cores)) for index in order)
        with local_pool(count) as pool:
            yield from pool.results(_run, calls, report)

    return results()


def build_models(scenes: Iterable[System]) -> None:
    """Build the compiled models with which scenes start, where the cache of this host lacks them."""
    for spec in dict.fromkeys(spec for scene in scenes for spec in scene.specs):
        build_model(spec.layout, spec.effects)


class _OutOfTime(KeyboardInterrupt):
    """Ends a run in the way of Ctrl-C, so that its result has the rows until then."""


def run_to_end(scene: Any, *, seconds: float | None = None, **options: Any) -> Any:
    """Run one scene of a batch or a study; a run that fails after its first row returns its result too.

    options: of `simulate`, for the scenes that have them. seconds: longest wall time of the run, without builds [s];
    None: no limit. Raises InputError as `simulate`; RunError: there are no rows, or the time is over (status "limit";
    `.result` has the rows until then).
    """
    begin, expired = working_time(), False
    options = {name: value for name, value in options.items() if name in scene.run_options}

    def progress(reached: float, end: float) -> None:
        nonlocal expired
        proceed(reached, end)
        if seconds is not None and working_time() - begin > seconds and reached < end:
            expired = True
            raise _OutOfTime

    try:
        result = integrate(scene, progress=progress, with_initial_row=True, **options)
    except RunError:
        if expired:
            raise RunError(f"ended after {seconds:g} s of wall time", status=OUT_OF_TIME) from None
        raise
    if expired:
        raise RunError(f"ended after {seconds:g} s of wall time", status=OUT_OF_TIME, result=result)
    return result


@contextmanager
def _located(label: str) -> Iterator[None]:
    """Let the message of every error of a scene start with the label of the scene."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{label}: {error}") from error
    except RunError as error:
        raise RunError(f"{label}: {error}", status=error.status, result=error.result) from error


def _run(label: str, scene: System, strict: bool, cores: int) -> Any:
    """The result of one run of a batch, in a worker; its RunError if it has no rows."""
    try:
        with _located(label):
            return run_to_end(scene, strict=strict, cores=cores)
    except RunError as error:
        return error
    except InputError as error:  # such as: other runs leave no memory for its rows
        return RunError(str(error), status=BAD_INPUT)
