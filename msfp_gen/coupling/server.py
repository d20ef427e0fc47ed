"""A server of bearings for `element genericClient` of OpenSees: every connection is a bearing of its own."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Sequence
from typing import Self

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.coupling.generic_client import NUMBERS, SIZE_COUNT, SIZES, Action, Report, ServedBearing, Sizes
from msfp_gen.coupling.two_port import TwoPort
from msfp_gen.errors import InputError, MsfpError

POLL = 0.1  # between two looks at whether the server is to end [s]
# Linux: without it every message waits 40 ms, since the client sends by Nagle's algorithm.
QUICK_ACKNOWLEDGEMENT = getattr(socket, "TCP_QUICKACK", None)
LAST_PORT = 65535


class Server:
    """Listens on one port for each kind of bearing, and serves every connection in a thread of its own.

    bearings: name and maker of the two-ports of each port, in order. port: the first one, the others follow; 0: free
    ones. host: address to listen on. up: vertical axis of clients in space, "Y" or "Z". report: called with lines of
    text, from any thread. Raises InputError: a port cannot be used.
    """

    def __init__(
        self,
        bearings: Sequence[tuple[str, Callable[[], TwoPort]]],
        port: int,
        *,
        report: Report,
        host: str = "127.0.0.1",
        up: str = "Z",
    ) -> None:
        self._bearings, self._up, self._report = bearings, up, report
        self._changed = threading.Condition()
        self._begun = self._ended = self._failed = 0
        self._listeners: list[socket.socket] = []
        try:
            for index in range(len(bearings)):
                self._listeners.append(_listener(host, port + index if port else 0))
        except InputError:
            self.close()
            raise
        self.ports = [int(each.getsockname()[1]) for each in self._listeners]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop listening; bearings that are being served go on while the process lives."""
        for listener in self._listeners:
            listener.close()

    def serve(self, count: int | None = None) -> int:
        """Serve until `count` bearings have ended (None: for ever); returns how many of them failed."""
        for listener, bearing in zip(self._listeners, self._bearings, strict=True):
            threading.Thread(target=self._accept, args=(listener, *bearing), daemon=True).start()
        with self._changed:
            while count is None or self._ended < count:
                self._changed.wait(POLL)  # in short pieces, so that Ctrl-C is noticed
        return self._failed

    def _accept(self, listener: socket.socket, name: str, make: Callable[[], TwoPort]) -> None:
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:  # closed
                return
            with self._changed:
                self._begun += 1
                label = f"bearing {self._begun} ({name})"
            threading.Thread(target=self._serve_one, args=(connection, label, make), daemon=True).start()

    def _serve_one(self, connection: socket.socket, label: str, make: Callable[[], TwoPort]) -> None:
        failed = True
        try:
            with connection:
                failed = self._converse(connection, label, make)
        except (MsfpError, OSError, ValueError, OverflowError) as error:  # the last two: no number of a message
            self._report(f"{label}: {error}")
        finally:
            with self._changed:
                self._ended += 1
                self._failed += failed
                self._changed.notify_all()

    def _converse(self, connection: socket.socket, label: str, make: Callable[[], TwoPort]) -> bool:
        """Answer one client until it ends; returns whether the bearing failed on the way."""
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        opening = _receive(connection, SIZE_COUNT * SIZES.itemsize)
        if opening is None:
            raise InputError("the client left before it stated its sizes")
        sizes = Sizes.read(opening)
        port = make()
        bearing = ServedBearing(port, sizes.freedoms, lambda text: self._report(f"{label}: {text}"), self._up)
        self._report(f"{label}: begun, {sizes.freedoms} degrees of freedom")
        while (message := _receive(connection, sizes.message * NUMBERS.itemsize)) is not None:
            numbers = np.frombuffer(message, NUMBERS)
            if numbers[0] == Action.END:
                break
            answer = bearing.answer(numbers)
            if answer is not None:
                connection.sendall(_padded(answer, sizes.message))
        self._report(f"{label}: ended at t = {port.time:.6g} s" + (", failed on the way" if bearing.failures else ""))
        return bool(bearing.failures)


def _listener(host: str, port: int) -> socket.socket:
    if not 0 <= port <= LAST_PORT:
        raise InputError(f"--port = {port}: give a port from 1 to {LAST_PORT}, with room for one for each scene")
    try:
        return socket.create_server((host, port))
    except OSError as error:
        raise InputError(f"--port = {port}: {host} does not let it be used ({error.strerror}); give another") from error


def _receive(connection: socket.socket, size: int) -> bytes | None:
    """A message of `size` bytes; None where the client has left."""
    parts, left = [], size
    while left:
        if QUICK_ACKNOWLEDGEMENT is not None:
            connection.setsockopt(socket.IPPROTO_TCP, QUICK_ACKNOWLEDGEMENT, 1)
        part = connection.recv(left)
        if not part:
            return None
        parts.append(part)
        left -= len(part)
    return b"".join(parts)


def _padded(numbers: Array, size: int) -> bytes:
    """A message of `size` numbers that begins with these."""
    message = np.zeros(size, NUMBERS)
    message[: len(numbers)] = numbers
    return message.tobytes()
