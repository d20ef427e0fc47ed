"""Pools of workers: calls come in, their values go out as they end (docs/batch.md).

A pool is an executor in the sense of `concurrent.futures`: the workers of this machine, an executor of the caller, or
Dask. A worker of this machine is a thread, and has a process of its own where measurement shows that this is faster.
"""

from __future__ import annotations

import atexit
import os
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from importlib.util import find_spec
from queue import SimpleQueue
from typing import Any, TypeVar

from msfp_gen.common.cores import usable_cores
from msfp_gen.common.errors import InputError, MsfpError, RunError
from msfp_gen.studies.process import EndedError, Process, Report, StoppedError, UnsuitedError, reporting, worker

T = TypeVar("T")
S = TypeVar("S")
AHEAD = 2  # calls in flight for each worker, so that no worker is idle
CONNECT = "20s"  # time in which a Dask scheduler must answer
UNKNOWN = 64  # workers that are assumed of an executor that does not state their number
START = 1.0  # time that calls in threads wait [s], for all workers together, after which processes are tried
TRIED = 2, 0.1  # calls of each worker, and their processor time [s], by which threads and then processes are measured


@dataclass(frozen=True)
class Pool:
    """An executor. in_flight: number of calls that it may hold at the same time. word: its name in messages."""

    executor: Executor
    in_flight: Callable[[], int]
    word: str

    def results(
        self,
        function: Callable[..., T],
        calls: Iterable[tuple[S, tuple[Any, ...]]],
        report: Callable[[S], Report] | None = None,
    ) -> Iterator[tuple[S, T]]:
        """Call `function` on the workers; yields the key of each call and the returned value, in order of completion.

        calls: (key, arguments). Few calls for each worker are in flight, so that memory does not grow with the number
        of calls. report: key -> what is called with the progress of this call; on workers of this machine only. Raises
        RunError where workers died.
        """
        pending: dict[Future[T], S] = {}
        ended: SimpleQueue[Future[T]] = SimpleQueue()
        try:
            for key, arguments in calls:
                told = {} if report is None else {"report": report(key)}
                future = self.executor.submit(function, *arguments, **told)
                pending[future] = key
                future.add_done_callback(ended.put)
                while len(pending) >= self.in_flight():
                    yield self._completed(pending, ended)
            while pending:
                yield self._completed(pending, ended)
        finally:
            for future in pending:
                future.cancel()

    def _completed(self, pending: dict[Future[T], S], ended: SimpleQueue[Future[T]]) -> tuple[S, T]:
        """Key and value of the call that ends next."""
        future = ended.get()
        key = pending.pop(future)
        try:
            return key, future.result()
        except (MsfpError, MemoryError):
            raise
        except Exception as error:
            if not isinstance(error, BrokenExecutor | CancelledError) and not type(error).__module__.startswith(
                "distributed"
            ):
                raise
            raise RunError(
                f"workers died ({self.word}: {type(error).__name__}); check their memory, and run the same command "
                "again: a study keeps what is done"
            ) from error


def worker_count(requested: int | None) -> int:
    """Number of runs at the same time; None: one for each core. Raises InputError for an invalid number."""
    if requested is None:
        return usable_cores()
    if isinstance(requested, bool) or not isinstance(requested, int) or requested < 1:
        raise InputError(f"workers = {requested!r}: give a whole number of runs at the same time, 1 or more")
    return requested


def pool_from(
    workers: int | None = None, executor: Executor | None = None, dask: str | None = None
) -> AbstractContextManager[Pool]:
    """The pool for these arguments, as of `study`. Raises InputError where they name two engines."""
    if executor is not None and dask is not None:
        raise InputError("executor and dask: give one engine")
    if executor is not None:  # the caller closes it
        count = worker_count(workers) if workers is not None else getattr(executor, "_max_workers", UNKNOWN)
        return nullcontext(Pool(executor, lambda: AHEAD * count, type(executor).__name__))
    if dask is not None:
        return dask_pool(dask)
    return local_pool(workers)


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


@dataclass
class Way:
    """How much longer calls take than their own processor time, in threads or in processes."""

    calls: int = 0
    taken: float = 0.0  # from begin to end [s]
    worked: float = 0.0  # processor time [s]

    def add(self, taken: float, worked: float) -> None:
        """Count a call."""
        self.calls, self.taken, self.worked = self.calls + 1, self.taken + taken, self.worked + worked

    def tried(self, workers: int) -> bool:
        """Whether enough calls are known."""
        calls, worked = TRIED
        return self.calls >= calls * workers and self.worked >= worked * workers

    @property
    def slowness(self) -> float:
        """All workers are busy, so that the calls done in a second are inversely proportional to it."""
        return self.taken / max(self.worked, 1e-9)


@dataclass
class Ways:
    """What calls tell about threads and processes."""

    threads: Way = field(default_factory=Way)
    processes: Way = field(default_factory=Way)


_idle: defaultdict[tuple[int, int], list[Workers]] = defaultdict(list)  # this process, number of workers -> not in use


@contextmanager
def local_pool(workers: int | None = None, ways: Ways | None = None) -> Iterator[Pool]:
    """Workers of this machine, which live on for later calls. Leaving the block by an error ends all runs.

    workers: their number; None: one for each core. ways: what earlier calls like those of this block told. Raises
    InputError.
    """
    count = worker_count(workers)
    idle = _idle[os.getpid(), count]  # threads do not survive a fork
    executor = idle.pop() if idle else Workers(count)
    executor.ways = ways or Ways()
    try:
        yield Pool(executor, lambda: AHEAD * count, "workers")
    except BaseException:
        executor.shutdown(cancel_futures=True)
        raise
    idle.append(executor)


@atexit.register
def end_idle() -> None:
    """End the workers that are not in use."""
    for idle in _idle.values():
        while idle:
            idle.pop().shutdown()


class Workers(Executor):
    """Threads that run calls, or let them run in their processes.

    Calls run in threads until they have waited for each other so long that the start of processes would have cost no
    more. Then some calls run in processes, and the way in which calls waited less is kept. So no user has to know the
    share of a run that needs the global lock of Python, and short work never waits for a process.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._threads = ThreadPoolExecutor(count, "msfp-gen", self._begin_thread)
        self._processes: list[Process] = []
        self._lock = threading.Lock()
        self._own = threading.local()  # attribute `process`: that of this thread
        self._stop = threading.Event()
        self._waited = 0.0
        self._suited = count > 1
        self.ways = Ways()

    def submit(  # type: ignore[override]
        self, function: Callable[..., T], /, *arguments: Any, report: Report | None = None
    ) -> Future[T]:
        """As of `Executor`. report: called with the progress of the call."""
        return self._threads.submit(self._call, function, arguments, report)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """As of `Executor`; calls that run are ended."""
        self._stop.set()
        with self._lock:
            processes, self._processes = self._processes, []
        for process in processes:
            process.hang_up()
        for process in processes:
            process.end()
        self._threads.shutdown(wait, cancel_futures=cancel_futures)

    def _begin_thread(self) -> None:
        worker.stop = self._stop

    def _call(self, function: Callable[..., T], arguments: tuple[Any, ...], report: Report | None) -> T:
        """The value of a call, in this thread or in its process."""
        ways = self.ways
        if self.in_process(ways):
            with suppress(UnsuitedError):
                return self._call_process(ways.processes, function, arguments, report)
            self._suited = False
        begin, worked = time.perf_counter(), time.thread_time()
        with reporting(report):
            value = function(*arguments)
        worked, taken = time.thread_time() - worked, time.perf_counter() - begin
        with self._lock:
            ways.threads.add(taken, worked)
            self._waited += max(0.0, taken - worked) / self._count
        return value

    def in_process(self, ways: Ways) -> bool:
        """Whether the next call runs in a process."""
        if not self._suited or self._waited < START:
            return False
        threads, processes = (way.tried(self._count) for way in (ways.threads, ways.processes))
        return ways.processes.slowness < ways.threads.slowness if threads and processes else threads

    def _call_process(
        self, way: Way, function: Callable[..., T], arguments: tuple[Any, ...], report: Report | None
    ) -> T:
        """The value of a call in the process of this thread. Raises UnsuitedError."""
        process: Process | None = getattr(self._own, "process", None)
        new = process is None or process.ended
        if process is None or new:
            process = self._own.process = self._new_process(process)
        begin = time.perf_counter()
        try:
            value, worked = process.call(function, arguments, report)
        except EndedError as error:
            if self._stop.is_set():
                raise StoppedError from error
            raise BrokenExecutor(str(error)) from error
        if not new:  # its start and its first imports are over
            with self._lock:
                way.add(time.perf_counter() - begin, worked)
        found: T = value
        return found

    def _new_process(self, before: Process | None) -> Process:
        """A process for this thread. before: the one that has ended."""
        process = Process()
        with self._lock:
            self._processes.append(process)
        if before is not None:
            before.end()
        if self._stop.is_set():
            process.end()
            raise StoppedError
        return process


class SharedProgress:
    """Progress of several calls at the same time.

    report: called with the mean share that the calls have done, and 1, by one thread at a time; an exception in it ends
    the calls.
    """

    def __init__(self, calls: int, report: Report) -> None:
        self._shares = [0.0] * calls
        self._report = report
        self._lock = threading.Lock()

    def of(self, call: int) -> Report:
        """What is told of a call by its index."""

        def update(reached: float, end: float) -> None:
            with self._lock:
                self._shares[call] = reached / end
                self._report(sum(self._shares) / len(self._shares), 1.0)

        return update
