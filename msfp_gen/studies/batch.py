"""Batches: many scenes at the same time, each run as by `simulate`, in threads or processes (docs/batch.md)."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from typing import Any

from msfp_gen.buildings.file import AnyScene
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.cores import usable_cores
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.model.model import build_model
from msfp_gen.scene.effect_switching import check
from msfp_gen.scene.scene import Scene
from msfp_gen.simulation.memory import require_memory
from msfp_gen.simulation.simulate import simulate, state_at_start
from msfp_gen.studies.estimation.backbone_run import check_backbone, run_backbone
from msfp_gen.studies.pool import SharedProgress, local_pool, raise_if_stopped, worker_count

Proceed = Callable[[float, float], None]
ENDED = ("ok", "stopped")  # statuses of runs that did not fail
BAD_INPUT, OUT_OF_TIME = "input", "limit"  # statuses that only runs of studies have


def simulate_batch(
    scenes: Iterable[AnyScene],
    *,
    workers: int | None = None,
    processes: bool = False,
    strict: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> list[Any]:
    """Integrate many scenes at the same time; every result is bit by bit that of `simulate`.

    The models of all are built before the first run starts. Ctrl-C ends all runs within a few thousand steps.

    Parameters
    ----------
    scenes
        The scenes; all of their fields may differ.
    workers
        Number of runs at the same time; None: the number of cores that this process may use.
    processes
        Use processes instead of threads: faster for short runs, where assembling the result in Python takes longer than
        the integration in C. A script must then make this call under `if __name__ == "__main__":`.
    strict
        As in `simulate`.
    progress
        Called in the thread of the caller with the number of completed scenes, and of all scenes.

    Returns
    -------
    list of Result, or of BuildingResult for buildings
        In the order of the scenes. A run that fails raises no error: its `status` and `message` describe the failure,
        and its history has the rows until then.

    Raises
    ------
    InputError
        An entry is no scene, or its method does not support its effects; the message starts with its index, as in
        `scenes[3]`; or the rows of all do not fit into memory. No scene is run.
    RunError
        A scene failed at its start, so that it has no rows, or a worker process died. The other runs are ended.

    """
    if isinstance(scenes, Scene | BuildingScene):
        raise InputError("scenes: this is one scene; give a list of them")
    scenes = list(scenes)
    labels = [f"scenes[{index}]" for index in range(len(scenes))]
    for label, scene in zip(labels, scenes, strict=True):
        if not isinstance(scene, Scene | BuildingScene):
            raise InputError(f"{label}: a {type(scene).__name__} is no scene; give what load_scene returns")
    runs = completed_runs(scenes, workers, processes=processes, strict=strict, labels=labels)
    require_memory([scene for scene in scenes if isinstance(scene, Scene)])
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
    scenes: Sequence[AnyScene],
    workers: int | None = None,
    *,
    processes: bool = False,
    strict: bool = False,
    labels: Sequence[str] | None = None,
    progress: Proceed | None = None,
) -> Generator[tuple[int, Any], None, None]:
    """Run scenes at the same time; yields (index, result) in the order in which the runs end.

    Arguments and results are those of `simulate_batch`, but the result of a run that failed before its first row is
    its RunError, and no result is kept, so that the rows of all need not fit into memory. Closing the iterator, or an
    exception in its consumer (use `contextlib.closing`), ends the other runs. Raises InputError before the first run,
    and RunError where a worker process died.

    labels: of the scenes in messages; None: their names. progress: of all runs, called in their threads with the share
    that is done, and 1; not with processes.
    """
    count = worker_count(workers)
    labels = [scene.name for scene in scenes] if labels is None else labels
    for label, scene in zip(labels, scenes, strict=True):
        with _located(label):
            check_method(scene)
            if strict and (scene.fidelity == "backbone" or not isinstance(scene, Scene)):
                raise InputError("strict: only runs of one bearing have it, not of the level 'backbone'; leave it out")
    return _completed(scenes, count, processes, strict, labels, progress)


def _completed(
    scenes: Sequence[AnyScene],
    workers: int,
    processes: bool,
    strict: bool,
    labels: Sequence[str],
    progress: Proceed | None,
) -> Generator[tuple[int, Any], None, None]:
    shared = None if progress is None else SharedProgress(len(scenes), progress)
    threads = max(1, usable_cores() // max(1, min(workers, len(scenes))))
    build_models(scenes)
    # Long runs start first, so that all workers end at about the same time.
    order = sorted(range(len(scenes)), key=lambda index: -scenes[index].end)
    calls = ((i, (labels[i], scenes[i], strict, None if shared is None else shared.of(i), threads)) for i in order)
    with local_pool(workers, processes) as pool:
        for index, result in pool.results(_run, calls):
            yield index, result if isinstance(result, RunError) else replace(result, scene=scenes[index])
            del result


def check_method(scene: AnyScene) -> None:
    """Raise InputError where the method, or the level "backbone", does not run a scene; that of a building runs any."""
    if scene.fidelity == "backbone":  # which selects no effects
        check_backbone(scene)
    elif isinstance(scene, Scene):
        check(scene, scene.modelled)


def build_models(scenes: Iterable[AnyScene]) -> None:
    """Build the models with which these scenes start, unless the cache of this host has them; a backbone has none."""
    for spec in dict.fromkeys(spec for scene in scenes if scene.fidelity != "backbone" for spec in scene.specs):
        build_model(spec.layout, spec.effects)


class _OutOfTime(KeyboardInterrupt):
    """Ends a run as Ctrl-C does, so that its result has the rows until then."""


def run_to_end(
    scene: AnyScene, *, progress: Proceed = raise_if_stopped, seconds: float | None = None, **options: Any
) -> Any:
    """The result of a run of any scene, also of one that fails: here runs of studies start.

    progress, options: of `simulate`. seconds: wall time of the run at most [s]; None: no limit. Raises InputError as
    `simulate`; RunError: there are no rows, or the time is over (status "limit"; `.result` has the rows until then).
    """
    if scene.fidelity == "backbone":
        return run_backbone(scene)
    begin, expired = time.perf_counter(), False

    def proceed(reached: float, end: float) -> None:
        nonlocal expired
        progress(reached, end)
        if seconds is not None and time.perf_counter() - begin > seconds and reached < end:
            expired = True
            raise _OutOfTime

    try:
        return simulate(scene, progress=proceed, **options)
    except RunError as error:
        if expired:
            raise RunError(f"ended after {seconds:g} s of wall time", status=OUT_OF_TIME, result=error.result) from None
        if error.result is not None:
            return error.result
        if not isinstance(scene, Scene) or error.status == "interrupted":
            raise
    return state_at_start(scene, options.get("strict", False))


@contextmanager
def _located(label: str) -> Iterator[None]:
    """Start the messages of errors of a scene with its label."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{label}: {error}") from error
    except RunError as error:
        raise RunError(f"{label}: {error}", status=error.status, result=error.result) from error


def _run(label: str, scene: AnyScene, strict: bool, proceed: Proceed | None, threads: int) -> Any:
    """One run of a batch, in a worker; a RunError if it has no rows."""
    try:
        with _located(label):
            options = {"strict": strict} if isinstance(scene, Scene) else {"threads": threads}
            return run_to_end(scene, progress=proceed or raise_if_stopped, **options)
    except RunError as error:
        return error
    except InputError as error:  # such as rows for which other runs leave no memory
        return RunError(str(error), status=BAD_INPUT)
