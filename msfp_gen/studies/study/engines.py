"""Engines of a study: executors in the sense of `concurrent.futures`, from threads of one machine to a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, TypeVar

from msfp_gen.errors import InputError, MsfpError, RunError
from msfp_gen.simulation.batch import Workers, worker_count

T = TypeVar("T")
S = TypeVar("S")
AHEAD = 2  # calls that wait for each worker, so that none is idle
CONNECT = "20s"  # until a Dask scheduler must have answered
UNKNOWN = 64  # workers of an executor that does not say how many it has


@dataclass(frozen=True)
class Engine:
    """An executor, how many calls it may have at the same time, and a word for messages."""

    executor: Executor
    in_flight: Callable[[], int]
    word: str

    def results(self, function: Callable[..., T], calls: Iterator[tuple[S, tuple[Any, ...]]]) -> Iterator[tuple[S, T]]:
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
        for future in done:
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
                    "again: what is done is kept"
                ) from error
            yield key, value


def engine_from(
    workers: int | None = None,
    threads: bool = False,
    executor: Executor | None = None,
    dask: str | None = None,
    mpi: bool = False,
) -> AbstractContextManager[Engine]:
    """The engine of these arguments of `study`. Raises InputError where they name two."""
    choices = (("executor", executor), ("dask", dask), ("mpi", mpi), ("threads", threads))
    given = [name for name, value in choices if value]
    if len(given) > 1:
        raise InputError(f"{given[0]} and {given[1]}: give one engine")
    if executor is not None:
        return given_engine(executor, workers)
    if dask is not None:
        return dask_engine(dask)
    return mpi_engine() if mpi else local_engine(workers, threads)


@contextmanager
def local_engine(workers: int | None, threads: bool) -> Iterator[Engine]:
    """Processes, or threads, of this machine; None: one for each core. Leaving the block by an error ends all runs."""
    count = worker_count(workers)
    with Workers(count, processes=not threads) as pool:
        yield Engine(pool.executor, lambda: AHEAD * count, "threads" if threads else "processes")


@contextmanager
def given_engine(executor: Executor, workers: int | None) -> Iterator[Engine]:
    """An executor of the caller, which stays open. workers: how many calls it works on at the same time."""
    count = worker_count(workers) if workers is not None else getattr(executor, "_max_workers", UNKNOWN)
    yield Engine(executor, lambda: AHEAD * count, type(executor).__name__)


@contextmanager
def dask_engine(address: str) -> Iterator[Engine]:
    """Workers of a Dask cluster: the address of its scheduler, or a scheduler file. Raises InputError, RunError."""
    require("distributed", "dask", "--dask")
    from distributed import Client

    given = {"scheduler_file": address} if address.endswith(".json") else {"address": address}
    try:
        client = Client(**given, timeout=CONNECT)
    except (OSError, ValueError) as error:
        raise InputError(
            f"--dask = {address!r}: no scheduler answers there ({error}); start one: dask scheduler"
        ) from None
    try:
        # More workers may join later. The scheduler gives the calls of a worker that died to others.
        executor = client.get_executor(pure=False)
        yield Engine(executor, lambda: AHEAD * max(1, sum(client.ncores().values())), f"Dask at {address}")
    finally:
        client.close()


@contextmanager
def mpi_engine() -> Iterator[Engine]:
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
            yield Engine(executor, lambda: AHEAD * count, "MPI")
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            raise


def require(module: str, extra: str, what: str) -> None:
    """Raise InputError with the remedy where an optional module is not installed."""
    if find_spec(module) is None:
        raise InputError(f"{what} needs {module}; pip install 'msfp-gen[{extra}]'")
