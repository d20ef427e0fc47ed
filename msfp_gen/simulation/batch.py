"""Batches: many scenes at the same time, each run as by `simulate`, in threads or processes (docs/batch.md)."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from msfp_gen.buildings.load import AnyScene
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.cores import usable_cores
from msfp_gen.errors import InputError, RunError
from msfp_gen.model.model import build_model
from msfp_gen.scene.effect_switching import check
from msfp_gen.scene.scene import Scene
from msfp_gen.simulation.memory import require_memory
from msfp_gen.simulation.run_any import simulate
from msfp_gen.simulation.settling import needs_settling
from msfp_gen.simulation.simulate import RunSequence, settle

if TYPE_CHECKING:
    from types import TracebackType

    from msfp_gen.specification.layout import ModelSpec

Progress = Callable[[int, int], None]
T = TypeVar("T")


def simulate_batch(
    scenes: Iterable[AnyScene],
    *,
    workers: int | None = None,
    processes: bool = False,
    strict: bool = False,
    progress: Progress | None = None,
) -> list[Any]:
    """Integrate many scenes at the same time; every result is bit by bit that of `simulate`.

    All models are built before the first run starts. Ctrl-C ends all runs within a few thousand steps.

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
    given = _checked(scenes)
    results: dict[int, Any] = {}
    with Workers(worker_count(workers), processes) as pool:
        settled = dict(enumerate(given))
        loose = {i: (each,) for i, each in settled.items() if isinstance(each, Scene) and needs_settling(each)}
        settled |= pool.results(settle, loose)
        for spec in dict.fromkeys(spec for scene in settled.values() for spec in specs_of(scene)):
            build_model(spec.layout, spec.effects)
        # Long runs start first, so that all workers end at about the same time.
        order = sorted(settled, key=lambda index: -settled[index].end)
        calls = {index: (given[index], settled[index], strict) for index in order}
        for index, result in pool.results(_run, calls):
            results[index] = replace(result, scene=given[index])
            if progress is not None:
                progress(len(results), len(given))
    return [results[index] for index in range(len(given))]


def _checked(scenes: Iterable[AnyScene]) -> list[AnyScene]:
    """The scenes as a list; raises InputError where one is no scene or its method does not support its effects."""
    if isinstance(scenes, Scene | BuildingScene):
        raise InputError("scenes: this is one scene; give a list of them")
    given = list(scenes)
    for index, scene in enumerate(given):
        if not isinstance(scene, Scene | BuildingScene):
            raise InputError(f"scenes[{index}]: a {type(scene).__name__} is no scene; give what load_scene returns")
        with _located(index):
            check_method(scene)
    require_memory([scene for scene in given if isinstance(scene, Scene)])
    return given


def check_method(scene: AnyScene) -> None:
    """Raise InputError where the method of a scene does not support its effects; that of a building always does."""
    if isinstance(scene, Scene):
        check(scene, scene.modelled)


def specs_of(scene: AnyScene) -> tuple[ModelSpec, ...]:
    """The models with which a run starts: one, or those of the bearings of a building."""
    return (scene.spec,) if isinstance(scene, Scene) else scene.specs


def worker_count(requested: int | None) -> int:
    """Number of runs at the same time; None: one for each core. Raises InputError for an invalid number."""
    if requested is None:
        return usable_cores()
    if isinstance(requested, bool) or not isinstance(requested, int) or requested < 1:
        raise InputError(f"workers = {requested!r}: give a whole number of runs at the same time, 1 or more")
    return requested


def run_to_end(scene: AnyScene, settled: AnyScene, strict: bool, proceed: Callable[[float, float], None]) -> Any:
    """The result of `simulate`, also for a run that fails. proceed: called often; its exceptions end the run."""
    if isinstance(scene, BuildingScene):
        return _building_to_end(scene, proceed)
    assert isinstance(settled, Scene)
    sequence = RunSequence.of(scene, strict, settled)
    while sequence.effects is not None:
        sequence.run_segment(proceed)
    return sequence.result(with_initial_row=True)


def _building_to_end(scene: BuildingScene, proceed: Callable[[float, float], None]) -> Any:
    try:
        return simulate(scene, progress=proceed, threads=1)  # the runs have the cores
    except RunError as error:
        if error.result is None:
            raise
        return error.result


@contextmanager
def _located(index: int) -> Iterator[None]:
    """Start the messages of errors of a scene with its index."""
    try:
        yield
    except InputError as error:
        raise InputError(f"scenes[{index}]: {error}") from error
    except RunError as error:
        raise RunError(f"scenes[{index}]: {error}", status=error.status, result=error.result) from error


def _run(scene: AnyScene, settled: AnyScene, strict: bool) -> Any:
    """One run of a batch, in a worker."""
    return run_to_end(scene, settled, strict, raise_if_stopped)


class _Flag(Protocol):
    """An event of `threading` or of `multiprocessing`."""

    def set(self) -> None: ...
    def is_set(self) -> bool: ...


class _StoppedError(Exception):
    """Ends a run in a worker after the batch has ended."""


_worker = threading.local()  # attribute `stop`: the flag that ends the runs of this thread or process


def _start_worker(stop: _Flag, own_process: bool) -> None:
    """Called by the executor in each new thread or process."""
    _worker.stop = stop
    if own_process:  # a terminal sends Ctrl-C to all processes, but only the main process handles it
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when its parent dies, even by `kill -9`: it would wait for work for ever."""
    if (parent := multiprocessing.parent_process()) is not None:
        parent.join()
        os._exit(1)


def raise_if_stopped(_: float, __: float) -> None:
    """The `progress` callback of a run in a worker: ends the run once the flag is set. Elsewhere it does nothing."""
    stop: _Flag | None = getattr(_worker, "stop", None)
    if stop is not None and stop.is_set():
        raise _StoppedError


class Workers:
    """A pool of threads or processes, as a context manager; an exception inside its block ends all runs."""

    def __init__(self, count: int, processes: bool) -> None:
        self.stop: _Flag
        self.executor: Executor
        if processes:
            context = multiprocessing.get_context("spawn")
            self.stop = context.Event()
            self.executor = ProcessPoolExecutor(count, context, _start_worker, (self.stop, True))
        else:
            self.stop = threading.Event()
            self.executor = ThreadPoolExecutor(count, "msfp-gen-batch", _start_worker, (self.stop, False))

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, kind: type[BaseException] | None, _: BaseException | None, __: TracebackType | None) -> None:
        if kind is not None:
            self.stop.set()
        self.executor.shutdown(cancel_futures=True)

    def results(self, function: Callable[..., T], calls: Mapping[int, tuple[Any, ...]]) -> Iterator[tuple[int, T]]:
        """Call `function` with the arguments of every index; (index, returned value) in the order of completion."""
        indices = {self.executor.submit(function, *arguments): index for index, arguments in calls.items()}
        for future in as_completed(indices):
            index = indices.pop(future)
            with _located(index):
                value = _value_of(future)
            yield index, value


def _value_of(future: Future[T]) -> T:
    """The value of a completed call; raises RunError where its process died."""
    try:
        return future.result()
    except BrokenExecutor as error:
        raise RunError(
            "a worker process died; check that there is enough memory, and that a script calls simulate_batch "
            "under if __name__ == '__main__'"
        ) from error
