"""Pools of workers, and batches of scenes: scenes come in, results go out as the runs end (docs/batch.md).

Studies run their chunks on the same pools. A pool is an executor in the sense of `concurrent.futures`: threads or
processes of this machine, an executor of the caller, or Dask.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, Protocol, TypeVar

from msfp_gen.common.cores import usable_cores
from msfp_gen.common.errors import InputError, MsfpError, RunError
from msfp_gen.model.model import build_model, working_time
from msfp_gen.scene.effect_switching import check
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.system import System, is_system
from msfp_gen.simulation.memory import require_memory
from msfp_gen.simulation.simulate import integrate

T = TypeVar("T")
S = TypeVar("S")
AHEAD = 2  # calls in flight for each worker, so that no worker is idle
CONNECT = "20s"  # time in which a Dask scheduler must answer
UNKNOWN = 64  # workers that are assumed of an executor that does not state their number
Proceed = Callable[[float, float], None]  # (simulated time, end), or (share done, 1)
ENDED = ("ok", "stopped")  # statuses of runs that did not fail
BAD_INPUT, OUT_OF_TIME = "input", "limit"  # statuses that only runs of studies have


@dataclass(frozen=True)
class Pool:
    """An executor. in_flight: number of calls that it may hold at the same time. word: its name in messages."""

    executor: Executor
    in_flight: Callable[[], int]
    word: str

    def results(self, function: Callable[..., T], calls: Iterable[tuple[S, tuple[Any, ...]]]) -> Iterator[tuple[S, T]]:
        """Call `function` on the workers; yields the key of each call and the returned value, in order of completion.

        calls: (key, arguments). Few calls for each worker are in flight, so that memory does not grow with the number
        of calls. Raises RunError where workers died.
        """
        pending: dict[Future[T], S] = {}
        try:
            for key, arguments in calls:
                pending[self.executor.submit(function, *arguments)] = key
                while len(pending) >= self.in_flight():
                    yield from self._completed(pending)
            while pending:
                yield from self._completed(pending)
        finally:
            for future in pending:
                future.cancel()

    def _completed(self, pending: dict[Future[T], S]) -> Iterator[tuple[S, T]]:
        done, _ = wait(pending, return_when=FIRST_COMPLETED)
        while done:
            future = done.pop()
            key = pending.pop(future)
            try:
                value = future.result()
            except (MsfpError, MemoryError):
                raise
            except Exception as error:
                if not isinstance(error, BrokenExecutor | CancelledError) and not type(error).__module__.startswith(
                    "distributed"
                ):
                    raise
                raise RunError(
                    f"workers died ({self.word}: {type(error).__name__}); check their memory, and run the same command "
                    "again: a study keeps what is done. A script starts processes under if __name__ == '__main__'"
                ) from error
            del future  # holds the value
            yield key, value


def worker_count(requested: int | None) -> int:
    """Number of runs at the same time; None: one for each core. Raises InputError for an invalid number."""
    if requested is None:
        return usable_cores()
    if isinstance(requested, bool) or not isinstance(requested, int) or requested < 1:
        raise InputError(f"workers = {requested!r}: give a whole number of runs at the same time, 1 or more")
    return requested


class _Flag(Protocol):
    """An event of `threading` or of `multiprocessing`."""

    def set(self) -> None: ...
    def is_set(self) -> bool: ...


class _StoppedError(Exception):
    """Ends a run in a worker after the block of its pool has ended."""


_worker = threading.local()  # attribute `stop`: the flag that ends the runs of this thread or process


def _start_worker(stop: _Flag, own_process: bool) -> None:
    """Prepare a new thread or process of a pool; its executor calls this. stop: set where the runs must end."""
    _worker.stop = stop
    if own_process:  # a terminal sends Ctrl-C to all processes, but only the main process handles it
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when its parent dies, even by `kill -9`; otherwise it would wait for work for ever."""
    if (parent := multiprocessing.parent_process()) is not None:
        parent.join()
        os._exit(1)


def raise_if_stopped(_: float, __: float) -> None:
    """The `progress` callback of a run: ends the run once the flag of its worker is set; does nothing elsewhere."""
    stop: _Flag | None = getattr(_worker, "stop", None)
    if stop is not None and stop.is_set():
        raise _StoppedError


class SharedProgress:
    """Progress of a batch in threads.

    report: called with the mean share that the runs have done, and 1, by one thread at a time; an exception in it ends
    the runs.
    """

    def __init__(self, runs: int, report: Callable[[float, float], None] | None) -> None:
        self._shares = [0.0] * runs
        self._report = report
        self._lock = threading.Lock()

    def of(self, run: int) -> Callable[[float, float], None]:
        """The `progress` callback of a run by its index; it also ends the run as `raise_if_stopped` does."""

        def update(reached: float, end: float) -> None:
            raise_if_stopped(reached, end)
            if self._report is not None:
                with self._lock:
                    self._shares[run] = reached / end
                    self._report(sum(self._shares) / len(self._shares), 1.0)

        return update


def pool_from(
    workers: int | None = None,
    threads: bool = False,
    executor: Executor | None = None,
    dask: str | None = None,
) -> AbstractContextManager[Pool]:
    """The pool for these arguments, as of `study`. Raises InputError where they name two engines."""
    engines = {"executor": executor, "dask": dask, "threads": threads}
    named = [name for name, value in engines.items() if value]
    if len(named) > 1:
        raise InputError(f"{named[0]} and {named[1]}: give one engine")
    if executor is not None:  # the caller closes it
        count = worker_count(workers) if workers is not None else getattr(executor, "_max_workers", UNKNOWN)
        return nullcontext(Pool(executor, lambda: AHEAD * count, type(executor).__name__))
    if dask is not None:
        return dask_pool(dask)
    return local_pool(workers, processes=not threads)


@contextmanager
def local_pool(workers: int | None = None, processes: bool = False) -> Iterator[Pool]:
    """Threads or processes of this machine. Leaving the block by an error ends all runs.

    workers: their number; None: one for each core. Raises InputError.
    """
    count = worker_count(workers)
    stop: _Flag
    executor: Executor
    if processes:
        context = multiprocessing.get_context("spawn")
        stop = context.Event()
        executor = ProcessPoolExecutor(count, context, _start_worker, (stop, True))
    else:
        stop = threading.Event()
        executor = ThreadPoolExecutor(count, "msfp-gen", _start_worker, (stop, False))
    try:
        yield Pool(executor, lambda: AHEAD * count, "processes" if processes else "threads")
    except BaseException:
        stop.set()
        raise
    finally:
        executor.shutdown(cancel_futures=True)


@contextmanager
def dask_pool(address: str) -> Iterator[Pool]:
    """Workers of a Dask cluster. address: of its scheduler, or a scheduler file. Raises InputError, RunError."""
    require("distributed", "--dask")
    from distributed import Client

    scheduler = {"scheduler_file": address} if address.endswith(".json") else {"address": address}
    try:
        client = Client(**scheduler, timeout=CONNECT)
    except (OSError, ValueError) as error:
        raise InputError(
            f"--dask = {address!r}: no scheduler answers there ({error}); start one: dask scheduler"
        ) from None
    try:
        # More workers may join later. The scheduler gives the calls of a worker that died to other workers.
        executor = client.get_executor(pure=False)
        yield Pool(executor, lambda: AHEAD * max(1, sum(client.ncores().values())), f"Dask at {address}")
    finally:
        client.close()


def require(module: str, what: str) -> None:
    """Raise InputError with the remedy where an optional module is not installed."""
    if find_spec(module) is None:
        raise InputError(f"{what} needs {module}; pip install {module.lower()}")


def simulate_batch(
    scenes: Iterable[System],
    *,
    workers: int | None = None,
    processes: bool = False,
    strict: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> list[Any]:
    """Integrate many scenes at the same time; every result is equal to the result of `simulate`, bit by bit.

    All models are built before the first run starts. Ctrl-C ends all runs within a few thousand steps.

    Args:
        scenes: the scenes; all of their fields may differ.
        workers: number of runs at the same time; None: the number of cores that this process may use.
        processes: use processes instead of threads: faster for short runs, where assembling the result in Python takes
            longer than the integration in C. A script must then make this call under `if __name__ == "__main__":`.
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
    scenes: Sequence[System],
    workers: int | None = None,
    *,
    processes: bool = False,
    strict: bool = False,
    labels: Sequence[str] | None = None,
    progress: Proceed | None = None,
) -> Generator[tuple[int, Any], None, None]:
    """Run scenes at the same time; yields (index, result) in the order in which the runs end.

    Arguments and results are as in `simulate_batch`, with two differences. The result of a run that failed before its
    first row is its RunError. No result is kept, so that the rows of all runs need not fit into memory. Closing the
    iterator, or an exception in its consumer (use `contextlib.closing`), ends the other runs. Raises InputError before
    the first run, and RunError where a worker process died.

    labels: of the scenes in messages; None: the names of the scenes. progress: as `report` of `SharedProgress`; not
    with processes.
    """
    count = worker_count(workers)
    labels = [scene.name for scene in scenes] if labels is None else labels
    for label, scene in zip(labels, scenes, strict=True):
        with _located(label):
            check_method(scene)
            if strict and "strict" not in scene.run_options:
                raise InputError("strict: only runs of one bearing have it; leave it out")
    shared = None if progress is None else SharedProgress(len(scenes), progress)
    threads = max(1, usable_cores() // max(1, min(count, len(scenes))))

    def results() -> Generator[tuple[int, Any], None, None]:
        build_models(scenes)
        # Long runs start first, so that all workers end at about the same time.
        order = sorted(range(len(scenes)), key=lambda index: -scenes[index].end)
        calls = ((i, (labels[i], scenes[i], strict, None if shared is None else shared.of(i), threads)) for i in order)
        with local_pool(count, processes) as pool:
            for index, result in pool.results(_run, calls):
                if processes and not isinstance(result, RunError) and type(result.scene) is type(scenes[index]):
                    # The one of the caller, not a copy; `replace` would make history and notes here, one by one.
                    object.__setattr__(result, "scene", scenes[index])
                yield index, result
                del result

    return results()


def check_method(scene: System) -> None:
    """Raise InputError where the method does not run a scene; a building needs no check."""
    if isinstance(scene, Scene):
        check(scene, scene.modelled)


def build_models(scenes: Iterable[System]) -> None:
    """Build the compiled models with which scenes start, where the cache of this host lacks them."""
    for spec in dict.fromkeys(spec for scene in scenes for spec in scene.specs):
        build_model(spec.layout, spec.effects)


class _OutOfTime(KeyboardInterrupt):
    """Ends a run in the way of Ctrl-C, so that its result has the rows until then."""


def run_to_end(
    scene: Any, *, progress: Proceed = raise_if_stopped, seconds: float | None = None, **options: Any
) -> Any:
    """Run one scene of a batch or a study; a run that fails after its first row returns its result too.

    progress, options: of `simulate`. seconds: longest wall time of the run, without builds [s]; None: no limit. Raises
    InputError as `simulate`; RunError: there are no rows, or the time is over (status "limit"; `.result` has the rows
    until then).
    """
    begin, expired = working_time(), False

    def proceed(reached: float, end: float) -> None:
        nonlocal expired
        progress(reached, end)
        if seconds is not None and working_time() - begin > seconds and reached < end:
            expired = True
            raise _OutOfTime

    try:
        result = integrate(scene, progress=proceed, with_initial_row=True, **options)
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


def _run(label: str, scene: System, strict: bool, proceed: Proceed | None, threads: int) -> Any:
    """The result of one run of a batch, in a worker; its RunError if it has no rows."""
    try:
        with _located(label):
            options = {"strict": strict, "threads": threads}
            options = {name: value for name, value in options.items() if name in scene.run_options}
            return run_to_end(scene, progress=proceed or raise_if_stopped, **options)
    except RunError as error:
        return error
    except InputError as error:  # such as: other runs leave no memory for its rows
        return RunError(str(error), status=BAD_INPUT)
