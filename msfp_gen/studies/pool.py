"""Pools of workers for many runs: threads and processes of this machine, an executor of the caller, Dask, MPI.

Every pool is an executor in the sense of `concurrent.futures`.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
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
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, Protocol, TypeVar

from msfp_gen.common.cores import usable_cores
from msfp_gen.common.errors import InputError, MsfpError, RunError

T = TypeVar("T")
S = TypeVar("S")
AHEAD = 2  # calls that wait for each worker, so that none is idle
CONNECT = "20s"  # until a Dask scheduler must have answered
UNKNOWN = 64  # workers of an executor that does not say how many it has


@dataclass(frozen=True)
class Pool:
    """An executor, how many calls it may have at the same time, and a word for messages."""

    executor: Executor
    in_flight: Callable[[], int]
    word: str

    def results(self, function: Callable[..., T], calls: Iterable[tuple[S, tuple[Any, ...]]]) -> Iterator[tuple[S, T]]:
        """Call `function` with the arguments of each call; its key and returned value, in the order of completion.

        Only a few calls for each worker are made ahead, so that memory does not grow with their number. Raises RunError
        where workers died.
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


class SharedProgress:
    """Progress of runs at the same time, in threads: the mean of their shares, with 1 for all.

    report: called by one thread at a time; an exception in it ends the runs.
    """

    def __init__(self, runs: int, report: Callable[[float, float], None] | None) -> None:
        self._shares = [0.0] * runs
        self._report = report
        self._lock = threading.Lock()

    def of(self, run: int) -> Callable[[float, float], None]:
        """The `progress` callback of one of the runs, in a worker; it ends the run as `raise_if_stopped` does."""

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
    mpi: bool = False,
) -> AbstractContextManager[Pool]:
    """The pool of these arguments of `study`. Raises InputError where they name two."""
    choices = (("executor", executor), ("dask", dask), ("mpi", mpi), ("threads", threads))
    named = [name for name, value in choices if value]
    if len(named) > 1:
        raise InputError(f"{named[0]} and {named[1]}: give one engine")
    if executor is not None:
        return pool_of(executor, workers)
    if dask is not None:
        return dask_pool(dask)
    return mpi_pool() if mpi else local_pool(workers, processes=not threads)


@contextmanager
def local_pool(workers: int | None = None, processes: bool = False) -> Iterator[Pool]:
    """Threads, or processes, of this machine; None: one for each core. Leaving the block by an error ends all runs."""
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
def pool_of(executor: Executor, workers: int | None) -> Iterator[Pool]:
    """An executor of the caller, which stays open. workers: how many calls it works on at the same time."""
    count = worker_count(workers) if workers is not None else getattr(executor, "_max_workers", UNKNOWN)
    yield Pool(executor, lambda: AHEAD * count, type(executor).__name__)


@contextmanager
def dask_pool(address: str) -> Iterator[Pool]:
    """Workers of a Dask cluster: the address of its scheduler, or a scheduler file. Raises InputError, RunError."""
    require("distributed", "dask", "--dask")
    from distributed import Client

    scheduler = {"scheduler_file": address} if address.endswith(".json") else {"address": address}
    try:
        client = Client(**scheduler, timeout=CONNECT)
    except (OSError, ValueError) as error:
        raise InputError(
            f"--dask = {address!r}: no scheduler answers there ({error}); start one: dask scheduler"
        ) from None
    try:
        # More workers may join later. The scheduler gives the calls of a worker that died to others.
        executor = client.get_executor(pure=False)
        yield Pool(executor, lambda: AHEAD * max(1, sum(client.ncores().values())), f"Dask at {address}")
    finally:
        client.close()


@contextmanager
def mpi_pool() -> Iterator[Pool]:
    """The other processes of `mpiexec -n N python -m mpi4py.futures -m msfp_gen ...`. Raises InputError."""
    require("mpi4py", "mpi", "--mpi")
    try:
        from mpi4py import MPI
        from mpi4py.futures import MPIPoolExecutor
    except (ImportError, RuntimeError) as error:
        first = str(error).partition("\n")[0]
        raise InputError(f"--mpi: {first}; install an MPI library, such as MPICH or Open MPI") from None
    count = MPI.COMM_WORLD.Get_size() - 1
    if count < 1:
        raise InputError(
            "--mpi: this is one process; start it as mpiexec -n 8 python -m mpi4py.futures -m msfp_gen ..."
        )
    with MPIPoolExecutor() as executor:
        try:
            yield Pool(executor, lambda: AHEAD * count, "MPI")
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            raise


def require(module: str, extra: str, what: str) -> None:
    """Raise InputError with the remedy where an optional module is not installed."""
    if find_spec(module) is None:
        raise InputError(f"{what} needs {module}; pip install 'msfp-gen[{extra}]'")
