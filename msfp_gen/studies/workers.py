"""Pools of workers: calls come in, their values go out as they end (docs/studies.md).

A pool is an executor in the sense of `concurrent.futures`: the workers of this machine, an executor of the caller, or
Dask. A worker of this machine is a thread; calls go on to processes of loky where measurement shows that this is
faster. These are new interpreters that do not import the script of the user, so that a script needs no
`if __name__ == "__main__"`, and no fork copies locks of other threads.
"""

from __future__ import annotations

import atexit
import io
import os
import pickle
import shutil
import signal
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from queue import SimpleQueue
from typing import Any, TypeVar

from msfp_gen.common.aliases import Progress
from msfp_gen.common.cores import usable_cores
from msfp_gen.common.errors import InputError, MsfpError, RunError

T = TypeVar("T")
S = TypeVar("S")
AHEAD = 2  # calls in flight for each worker, so that no worker is idle
CONNECT = "20s"  # time in which a Dask scheduler must answer
UNKNOWN = 64  # workers that are assumed of an executor that does not state their number
START = 1.0  # time that calls in threads wait [s], for all workers together, after which processes are tried
IDLE = 300.0  # time without a call after which processes end [s]; the next call starts others
TRIED = 2, 0.1  # calls of each worker, and their processor time [s], by which threads and then processes are measured
WORTH = 1.15  # slowness of threads from which processes are tried: a trial of short runs costs tens of runs
LARGE = 2**20  # arrays of this size [bytes] come from a process in a file in memory: a pipe copies them six times
MEMORY = Path("/dev/shm")  # files here are memory, on Linux


class _Worker(threading.local):
    """What the present thread has: a flag that ends its runs, the report of its call, and when its last call ended."""

    stop: threading.Event | None = None
    report: Progress | None = None
    ended = 0.0


_worker = _Worker()


class _StoppedError(Exception):
    """Ends a run in a worker after the block of its pool has ended."""


class _UnsuitedError(Exception):
    """What a call takes or returns cannot travel to another process."""


def proceed(reached: float, end: float) -> None:
    """The `progress` callback of a run in a worker: reports, and ends the run once its pool has ended."""
    if _worker.stop is not None and _worker.stop.is_set():
        raise _StoppedError
    if _worker.report is not None:
        _worker.report(reached, end)


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
        report: Callable[[S], Progress] | None = None,
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
    """The pool for these arguments; see `study`. Raises InputError where they name two engines."""
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
    taken: float = 0.0  # from when a worker was free to the end [s]
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

    workers: their number; None: one for each core. ways: what earlier calls like the calls of this block told. Raises
    InputError.
    """
    count = worker_count(workers)
    idle = _idle[os.getpid(), count]  # threads do not survive a fork
    try:
        executor = idle.pop()
    except IndexError:
        executor = Workers(count)
    executor.begin(ways or Ways())
    try:
        yield Pool(executor, lambda: AHEAD * count, "workers")
    except BaseException:
        executor.shutdown(cancel_futures=True)
        raise
    idle.append(executor)


@atexit.register
def end_idle() -> None:
    """End the workers that are not in use."""
    for (process, _), idle in _idle.items():
        while idle and process == os.getpid():  # a fork has no threads of its parent
            idle.pop().shutdown()


class Workers(Executor):
    """Threads that run calls, or let processes run them.

    Calls run in threads until they have waited for each other so long that the start of processes would have cost no
    more. Then some calls run in processes, and the way in which calls waited less is kept. So no user has to know the
    share of a run that needs the global lock of Python, and short work never waits for a process.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._threads = ThreadPoolExecutor(count, "msfp-gen", self._begin_thread)
        self._processes: Any = None  # executor of loky
        self._folder: str | None = None  # of the files in memory
        self._known: set[int] = set()  # processes that have ended a call: their start is over
        self._answered = 0.0  # when a process last ended a call [s]
        self._under_way = 0  # calls
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._waited = 0.0
        self._suited = count > 1
        self.ways = Ways()
        self._began = 0.0  # when a call was submitted while there was none [s]

    def begin(self, ways: Ways) -> None:
        """Begin a block of calls; `ways` has what earlier calls like them told."""
        self.ways, self._suited = ways, self._count > 1

    def submit(  # type: ignore[override]
        self, function: Callable[..., T], /, *arguments: Any, report: Progress | None = None
    ) -> Future[T]:
        """See `Executor`. report: called with the progress of the call; from a process only when it has ended."""
        with self._lock:
            if not self._under_way:  # what went before is no time in which a call waited, such as builds of models
                self._began = time.perf_counter()
            self._under_way += 1
        future = self._threads.submit(self._call, function, arguments, report)
        future.add_done_callback(self._done)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """See `Executor`; calls that run are ended. cancel_futures: also those that run in processes."""
        self._stop.set()
        with self._lock:
            if self._processes is not None:
                self._processes.shutdown(kill_workers=cancel_futures)
            if self._folder is not None:
                shutil.rmtree(self._folder, ignore_errors=True)
        self._threads.shutdown(wait, cancel_futures=cancel_futures)

    def _begin_thread(self) -> None:
        _worker.stop = self._stop

    def _call(self, function: Callable[..., T], arguments: tuple[Any, ...], report: Progress | None) -> T:
        """The value of a call, in this thread or in a process."""
        # The wait for the global lock, of this thread and of the thread that submits, begins with the last call's end.
        begin = max(self._began, _worker.ended)
        try:
            return self._run(function, arguments, report, begin)
        finally:
            _worker.ended = time.perf_counter()

    def _done(self, _: Future[Any]) -> None:
        with self._lock:
            self._under_way -= 1

    def _run(self, function: Callable[..., T], arguments: tuple[Any, ...], report: Progress | None, begin: float) -> T:
        """The same. begin: since when this thread was free [s]."""
        ways = self.ways
        if self.in_process(ways):
            try:
                found: T = self._call_process(ways.processes, function, arguments, begin)
            except _UnsuitedError:
                self._suited = False
            else:
                if report is not None:
                    report(1.0, 1.0)
                return found
        worked = time.thread_time()
        _worker.report = report
        value = function(*arguments)
        worked, taken = time.thread_time() - worked, time.perf_counter() - begin
        with self._lock:
            ways.threads.add(taken, worked)
            self._waited += max(0.0, taken - worked) / self._count
        return value

    def in_process(self, ways: Ways) -> bool:
        """Whether the next call runs in a process."""
        if not self._suited or self._waited < START or not ways.threads.tried(self._count):
            return False
        return (ways.processes.slowness if ways.processes.tried(self._count) else WORTH) < ways.threads.slowness

    def _call_process(self, way: Way, function: Callable[..., Any], arguments: tuple[Any, ...], begin: float) -> Any:
        """The value of a call in a process. begin: since when this thread was free [s]. Raises _UnsuitedError."""
        import cloudpickle
        import loky

        try:
            call = cloudpickle.dumps((function, arguments))
        except Exception as error:  # pickle passes on what the objects raise
            raise _UnsuitedError from error
        with self._lock:
            if self._stop.is_set():
                raise _StoppedError
            if self._processes is None:
                self._folder = tempfile.mkdtemp(prefix="msfp-gen-", dir=MEMORY) if os.access(MEMORY, os.W_OK) else None
                begin_process = (_begin_process, (os.getpid(), self._folder))
                self._processes = loky.ProcessPoolExecutor(self._count, None, None, IDLE, None, *begin_process)
        try:
            value, files, worked, process = self._processes.submit(_answer, call, self._folder).result()
        except (BrokenExecutor, RuntimeError) as error:
            if self._stop.is_set():
                raise _StoppedError from error
            raise
        try:
            found = _Unpickler(io.BytesIO(value), arguments, [_content(path) for path in files]).load()
        except Exception as error:  # such as a class that is not imported here by the same name
            raise _UnsuitedError from error
        with self._lock:
            now = time.perf_counter()
            if now - self._answered > IDLE:  # other processes have started
                self._known.clear()
            if len(self._known) >= self._count:  # until then calls wait for processes that start
                way.add(now - begin, worked)
            self._known.add(process)
            self._answered = now
        return found


def _begin_process(parent: int, folder: str | None) -> None:
    """Leave Ctrl-C, which a terminal sends to all processes, to the parent, and end with it and its files in memory."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)
        os._exit(1)

    if os.name == "posix":
        threading.Thread(target=watch, daemon=True).start()


def _answer(call: bytes, folder: str | None) -> tuple[bytes, list[Path], float, int]:
    """In a process: the value of a call as bytes and files, its processor time [s], the process. Or _UnsuitedError."""
    try:
        function, arguments = pickle.loads(call)
    except Exception as error:  # such as a class that cannot be imported here
        raise _UnsuitedError(repr(error)) from None
    begin = time.thread_time()
    value = function(*arguments)
    worked = time.thread_time() - begin
    try:
        return *_packed(value, arguments, folder), worked, os.getpid()
    except Exception as error:
        raise _UnsuitedError(repr(error)) from None


def _packed(value: Any, known: tuple[Any, ...], folder: str | None) -> tuple[bytes, list[Path]]:
    """A value as bytes, and the files with its large arrays; without a folder, or where it is full, all as bytes."""
    stream, large = io.BytesIO(), list[pickle.PickleBuffer]()

    def within(array: pickle.PickleBuffer) -> bool:
        """Whether an array is part of the bytes."""
        small = folder is None or array.raw().nbytes < LARGE
        if not small:
            large.append(array)
        return small

    _Pickler(stream, known, within).dump(value)
    files: list[Path] = []
    try:
        for array in large:
            with tempfile.NamedTemporaryFile(dir=folder, delete=False) as file:
                files.append(Path(file.name))
                file.write(array.raw())
    except OSError:
        for path in files:
            path.unlink()
        return _packed(value, known, None)
    return stream.getvalue(), files


def _content(path: Path) -> bytearray:
    """The content of a file in memory, which is deleted. (Every map of a file would keep a descriptor.)"""
    content = bytearray(path.stat().st_size)
    with path.open("rb") as file:
        file.readinto(content)
    path.unlink()
    return content


class _Pickler(pickle.Pickler):
    """Of what is among `known`, the number travels: a result comes back with the scene of the caller."""

    def __init__(self, stream: io.BytesIO, known: tuple[Any, ...], within: Callable[[Any], bool]) -> None:
        super().__init__(stream, protocol=5, buffer_callback=within)
        self._numbers = {id(each): number for number, each in enumerate(known)}

    def persistent_id(self, each: Any) -> int | None:
        """The number of a known object."""
        return self._numbers.get(id(each))


class _Unpickler(pickle.Unpickler):
    """As `_Pickler` wrote."""

    def __init__(self, stream: io.BytesIO, known: tuple[Any, ...], arrays: list[bytearray]) -> None:
        super().__init__(stream, buffers=arrays)
        self._objects = known

    def persistent_load(self, number: Any) -> Any:
        """The known object of a number."""
        return self._objects[number]


class SharedProgress:
    """Progress of several calls at the same time.

    report: called with the mean share that the calls have done, and 1, by one thread at a time; an exception in it ends
    the calls.
    """

    def __init__(self, calls: int, report: Progress) -> None:
        self._shares = [0.0] * calls
        self._report = report
        self._lock = threading.Lock()

    def of(self, call: int) -> Progress:
        """What is told of a call by its index."""

        def update(reached: float, end: float) -> None:
            with self._lock:
                self._shares[call] = reached / end
                self._report(sum(self._shares) / len(self._shares), 1.0)

        return update
