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

from msfp_gen.errors import InputError, RunError
from msfp_gen.model.model import build_model
from msfp_gen.scene.scene import Scene
from msfp_gen.simulation.effect_switching import check
from msfp_gen.simulation.memory import require_memory
from msfp_gen.simulation.settling import needs_settling
from msfp_gen.simulation.simulate import RunSequence, settle

if TYPE_CHECKING:
    from types import TracebackType

    from msfp_gen.result import Result

Progress = Callable[[int, int], None]
T = TypeVar("T")


def simulate_batch(
    scenes: Iterable[Scene],
    *,
    workers: int | None = None,
    processes: bool = False,
    strict: bool = False,
    progress: Progress | None = None,
) -> list[Result]:
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
    list of Result
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
    results: dict[int, Result] = {}
    with Workers(worker_count(workers), processes) as pool:
        settled = dict(enumerate(given))
        settled |= pool.results(settle, {index: (scene,) for index, scene in settled.items() if needs_settling(scene)})
        for spec in dict.fromkeys(scene.spec for scene in settled.values()):
            build_model(spec.layout, spec.effects)
        # Long runs start first, so that all workers end at about the same time.
        order = sorted(settled, key=lambda index: -settled[index].end)
        calls = {index: (given[index], settled[index], strict) for index in order}
        for index, result in pool.results(_run, calls):
            results[index] = replace(result, scene=given[index])
            if progress is not None:
                progress(len(results), len(given))
    return [results[index] for index in range(len(given))]


def _checked(scenes: Iterable[Scene]) -> list[Scene]:
    """The scenes as a list; raises InputError where one is no scene or its method does not support its effects."""
    if isinstance(scenes, Scene):
        raise InputError("scenes: this is one scene; give a list of them")
    given = list(scenes)
    for index, scene in enumerate(given):
        if not isinstance(scene, Scene):
            raise InputError(f"scenes[{index}]: a {type(scene).__name__} is no scene; give what load_scene returns")
        with _located(index):
            check(scene, scene.modelled)
    require_memory(given)
    return given


def usable_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def worker_count(requested: int | None) -> int:
    """Number of runs at the same time; None: one for each core. Raises InputError for an invalid number."""
    if requested is None:
        return usable_cores()
    if isinstance(requested, bool) or not isinstance(requested, int) or requested < 1:
        raise InputError(f"workers = {requested!r}: give a whole number of runs at the same time, 1 or more")
    return requested


def run_to_end(scene: Scene, settled: Scene, strict: bool, proceed: Callable[[float, float], None]) -> Result:
    """The result of `simulate`, also for a run that fails. proceed: called often; its exceptions end the run."""
    sequence = RunSequence.of(scene, strict, settled)
    while sequence.effects is not None:
        sequence.run_segment(proceed)
    return sequence.result(with_initial_row=True)


@contextmanager
def _located(index: int) -> Iterator[None]:
    """Start the messages of errors of a scene with its index."""
    try:
        yield
    except InputError as error:
        raise InputError(f"scenes[{index}]: {error}") from error
    except RunError as error:
        raise RunError(f"scenes[{index}]: {error}", status=error.status, result=error.result) from error


def _run(scene: Scene, settled: Scene, strict: bool) -> Result:
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
