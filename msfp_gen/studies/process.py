"""Calls in a worker: what a run tells it, and its process: calls go in, values come out, arrays as their bytes.

The process is a new Python with the import path of this one. It does not import the script of the user, so that a
script needs no `if __name__ == "__main__"`, and no fork copies locks of other threads.
"""

from __future__ import annotations

import io
import os
import pickle
import struct
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.spawn import get_executable
from queue import Empty, SimpleQueue
from subprocess import PIPE, Popen, TimeoutExpired
from typing import IO, Any

from msfp_gen.common.errors import MsfpError

IDLE = 300.0  # time without a call after which the process ends [s]; the next call starts another
PROGRESS = 0.1  # least time between two reports of progress [s]
PROGRAM = (
    "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN); "  # a terminal sends Ctrl-C to all processes
    "import pickle, sys; sys.path[:] = pickle.load(sys.stdin.buffer); "
    "from msfp_gen.studies.process import serve; serve()"
)
VALUE, ERROR, REPORT, UNREADABLE = "value", "error", "report", "unreadable"
Report = Callable[[float, float], None]
Frame = tuple[bytes, list[Any]]  # a pickle, and the buffers of its arrays


worker = threading.local()  # attributes `stop`: the flag that ends the runs of this thread; `report`: of its call


class StoppedError(Exception):
    """Ends a run in a worker after the block of its pool has ended."""


@contextmanager
def reporting(report: Report | None) -> Iterator[None]:
    """Let `proceed` call `report` in this thread."""
    worker.report = report
    try:
        yield
    finally:
        worker.report = None


def proceed(reached: float, end: float) -> None:
    """The `progress` callback of a run in a worker: reports, and ends the run once its pool has ended."""
    stop: threading.Event | None = getattr(worker, "stop", None)
    if stop is not None and stop.is_set():
        raise StoppedError
    report: Report | None = getattr(worker, "report", None)
    if report is not None:
        report(reached, end)


class UnsuitedError(Exception):
    """What a call takes or returns cannot travel to another process."""


class EndedError(Exception):
    """The process has died."""


class Process:
    """A process that runs one call at a time. Raises UnsuitedError where Python cannot be started."""

    def __init__(self) -> None:
        try:
            self._popen = Popen([get_executable() or "", "-P", "-c", PROGRAM], stdin=PIPE, stdout=PIPE)
        except OSError as error:
            raise UnsuitedError from error
        assert self._popen.stdin is not None and self._popen.stdout is not None
        self._calls, self._answers = self._popen.stdin, self._popen.stdout
        pickle.dump(sys.path, self._calls)

    @property
    def ended(self) -> bool:
        """Whether it has ended, such as after a long time without a call."""
        return self._popen.poll() is not None

    def call(self, function: Callable[..., Any], arguments: tuple[Any, ...], report: Report | None) -> Any:
        """The value of a call in the process, and the processor time that it took [s]. report: called during the call.

        Objects of `arguments` that come back are these objects. Raises what the call raises, UnsuitedError, EndedError.
        """
        try:
            frame = packed((function, arguments))
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise UnsuitedError from error
        try:
            send(self._calls, frame)
            while True:
                kind, value = unpacked(receive(self._answers), arguments)
                if kind != REPORT:
                    break
                if report is not None:
                    try:
                        report(*value)
                    except BaseException:
                        self.end()
                        raise
        except (OSError, EOFError, ValueError) as error:
            raise EndedError(f"a process ended with exit code {self._popen.wait()}") from error
        if kind == UNREADABLE:
            raise UnsuitedError(value)
        if kind == ERROR:
            raise value
        return value

    def hang_up(self) -> None:
        """Let the process end, also in the middle of a call."""
        with suppress(OSError):  # of a call that was not sent to its end
            self._calls.close()

    def end(self) -> None:
        """End the process, and wait until it has ended."""
        self.hang_up()
        try:
            self._popen.wait(timeout=2.0)
        except TimeoutExpired:
            self._popen.kill()
            self._popen.wait()
        self._answers.close()


def packed(value: Any, known: tuple[Any, ...] = ()) -> Frame:
    """A value as bytes, without the bytes of its arrays. known: objects of which only the number travels."""
    stream, buffers = io.BytesIO(), list[Any]()
    numbers = {id(each): index for index, each in enumerate(known)}
    pickler = _Pickler(stream, protocol=5, buffer_callback=lambda buffer: buffers.append(buffer.raw()))
    pickler.numbers = numbers
    pickler.dump(value)
    return stream.getvalue(), buffers


class _Pickler(pickle.Pickler):
    numbers: dict[int, int]

    def persistent_id(self, each: Any) -> int | None:
        """The number of a known object."""
        return self.numbers.get(id(each))


def unpacked(frame: Frame, known: tuple[Any, ...] = ()) -> Any:
    """The value of a frame."""
    unpickler = _Unpickler(io.BytesIO(frame[0]), buffers=frame[1])
    unpickler.known = known
    return unpickler.load()


class _Unpickler(pickle.Unpickler):
    known: tuple[Any, ...]

    def persistent_load(self, number: Any) -> Any:
        """The known object of a number."""
        return self.known[number]


def send(stream: IO[bytes], frame: Frame) -> None:
    """Write a frame: number of parts, their lengths, the parts."""
    parts = [frame[0], *frame[1]]
    stream.write(struct.pack(f"<Q{len(parts)}Q", len(parts), *map(len, parts)))
    for part in parts:
        stream.write(part)
    stream.flush()


def receive(stream: IO[bytes]) -> Frame:
    """Read a frame. Raises EOFError where the stream has ended."""
    (count,) = struct.unpack("<Q", _read(stream, 8))
    first, *others = (_read(stream, size) for size in struct.unpack(f"<{count}Q", _read(stream, 8 * count)))
    return bytes(first), others


def _read(stream: IO[bytes], size: int) -> bytearray:
    part = bytearray(size)
    if stream.readinto(part) != size:  # type: ignore[attr-defined]
        raise EOFError
    return part


def serve() -> None:
    """Run the calls of the process that started this one, until that ends or does not call for a long time."""
    calls, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a call prints is no answer
    frames: SimpleQueue[Frame | None] = SimpleQueue()
    busy = threading.Event()

    def read() -> None:
        try:
            while True:
                frames.put(receive(calls))
        except (EOFError, OSError):
            if busy.is_set():
                os._exit(1)  # nobody waits for the value
            frames.put(None)

    threading.Thread(target=read, daemon=True).start()
    while True:
        try:
            frame = frames.get(timeout=IDLE)
        except Empty:
            return
        if frame is None:
            return
        busy.set()
        _answer(frame, answers)
        busy.clear()


def _answer(frame: Frame, answers: IO[bytes]) -> None:
    """Run a call and send its value."""
    try:
        function, arguments = unpacked(frame)
    except Exception:  # such as of a class of the script of the user
        send(answers, packed((UNREADABLE, traceback.format_exc())))
        return
    last = time.monotonic()

    def report(reached: float, end: float) -> None:
        nonlocal last
        if (now := time.monotonic()) - last > PROGRESS:
            last = now
            send(answers, packed((REPORT, (reached, end))))

    begin = time.thread_time()
    answer: tuple[str, Any]
    try:
        with reporting(report):
            value = function(*arguments)
        answer = VALUE, (value, time.thread_time() - begin)
    except Exception as error:
        if not isinstance(error, MsfpError):
            error.add_note(traceback.format_exc())
        answer = ERROR, error
    try:
        message = packed(answer, arguments)
    except Exception:
        message = packed((UNREADABLE, traceback.format_exc()))
    send(answers, message)
