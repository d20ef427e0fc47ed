"""A server of bearings for `element genericClient` of OpenSees (docs/other-programs.md): the protocol, a bearing that
answers it, and the connections; each connection is a bearing of its own.
"""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Self

import numpy as np

from msfp_gen.common.aliases import Say
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, MsfpError, RunError
from msfp_gen.embedding.two_port import TwoPort

SIZES = np.dtype("<i4")  # the first message of a client: eleven of these
SIZE_COUNT = 11
NUMBERS = np.dtype("<f8")  # of all other messages
LARGEST_MESSAGE = 10_000  # numbers of a message, at most
INITIAL_TIME = 1.0  # of the trial that gives the initial stiffness [s]: slow for a stuck bearing
AVERAGE_ACCELERATION = (2.0, 4.0)  # change of rate and acceleration with displacement, times h and h^2


class Action(IntEnum):
    """First number of a message of the client."""

    SET_TRIAL = 3
    COMMIT = 5
    FORCE = 10
    INITIAL_STIFFNESS = 12
    TANGENT = 13
    DAMPING = 14
    MASS = 15
    END = 99


def freedoms(count: int, up: str) -> Array:
    """The twelve motions of the ends from `count` degrees of freedom of a client, shape (12, count) [-].

    count: 12, two nodes in space (three displacements and three rotations each), or 6, two nodes in the plane X-Y (two
    displacements and a rotation each). up: vertical axis of the client in space, "Y" or "Z". Raises InputError.
    """
    if count not in (6, 12):
        raise InputError(f"element genericClient: {count} degrees of freedom; give two nodes of 6, or of 3 in a plane")
    y_up = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # E1 = X, E2 = -Z, E3 = Y
    axes = y_up if up == "Y" or count == 6 else np.eye(3)
    node = np.kron(np.eye(2), axes)
    return np.asarray(np.kron(np.eye(2), node[:, [0, 1, 5]] if count == 6 else node), dtype=np.float64)


@dataclass(frozen=True)
class Sizes:
    """First message of a client: numbers of each later message, and its degrees of freedom."""

    message: int
    freedoms: int

    @classmethod
    def read(cls, message: bytes) -> Sizes:
        """Raises InputError where this is no such message."""
        numbers = np.frombuffer(message, SIZES)
        count, size = int(numbers[0]), int(numbers[10])
        expected = [count, count, count, 0, 1, 0, 0, 0, count, 0, size]
        if list(numbers) != expected or not 0 < 3 * count + 2 <= size <= LARGEST_MESSAGE or count**2 > size:
            raise InputError(f"sizes {numbers.tolist()}: an element genericClient of OpenSees sends others")
        return cls(size, count)


class ServedBearing:
    """A two-port that answers the messages of one client.

    The client's time passes in the bearing between two commits. A client's clock that is set back, as by `loadConst
    -time 0`, starts at zero again. After a failure every answer is NaN until a trial from the committed state succeeds:
    the client's iteration cannot converge.
    """

    def __init__(self, port: TwoPort, count: int, report: Say, up: str = "Z") -> None:
        self.port = port
        self.failed = ""  # message of the present failure
        self.failures = 0
        self._map = freedoms(count, up)
        self._report = report
        self._shift = port.time  # of the bearing's clock against the client's [s]
        self._clock = 0.0  # of the client at the last commit [s]
        self._given = np.zeros((3, count)), 0.0  # last trial of the client
        self._before: Array | None = None  # the trial before it, in the same step
        self._ratios = AVERAGE_ACCELERATION
        rest = np.zeros((2, 3, 6))
        self._initial = self._map.T @ port.trial(port.time + INITIAL_TIME, *rest).tangent @ self._map
        port.revert()
        self._response = port.trial(port.time, *rest)
        self._pending = False  # a trial is given and not yet integrated

    def answer(self, message: Array) -> Array | None:
        """The numbers that answer a message, shape (k,) [SI]; None where the client expects no answer."""
        action = Action(int(message[0]))
        if action is Action.SET_TRIAL:
            self._set_trial(message[1:])
            return None
        if action is Action.COMMIT:
            self._commit()
            return None
        count = self._map.shape[1]
        if action is Action.FORCE:
            return self._map.T @ self._response.wrench.ravel() if self._integrate() else np.full(count, np.nan)
        if action is Action.TANGENT:
            return self._tangent().ravel(order="F")
        if action is Action.INITIAL_STIFFNESS:
            return self._initial.ravel(order="F")
        return np.zeros(count * count)  # damping and mass: both are in the tangent

    def _set_trial(self, numbers: Array) -> None:
        count = self._map.shape[1]
        motion, clock = numbers[: 3 * count].reshape(3, count).copy(), float(numbers[3 * count])
        if np.array_equal(motion, self._given[0]) and clock == self._given[1]:
            return
        self._before = self._given[0] if clock == self._given[1] and clock != self._clock else None
        self._given, self._pending = (motion, clock), True

    def _integrate(self) -> bool:
        """Integrate the last trial of the client; False where the bearing cannot follow."""
        if not self._pending:
            return not self.failed
        self._pending = False
        motion, clock = self._given
        if not np.isfinite(motion).all() and self.failed:
            return False  # the client goes on with the answer to an earlier failure
        if clock < self._clock:
            self._clock, self._shift = 0.0, self.port.time
        ends = (motion @ self._map.T).reshape(3, 2, 6).transpose(1, 0, 2)
        try:
            self._response = self.port.trial(self._shift + clock, *ends)
        except (InputError, RunError) as error:
            self.failures += 1
            self.failed = str(error)
            self._report(self.failed)
            return False
        self.failed = ""
        return True

    def _commit(self) -> None:
        if not self._integrate():
            return
        if self._response.time > self.port.time:
            self.port.commit()
        self._clock, self._before = self._given[1], None

    def _tangent(self) -> Array:
        """Derivative of the force with respect to the displacements, rates and accelerations moving with them."""
        if not self._integrate():
            return np.full((self._map.shape[1],) * 2, np.nan)
        step = self._response.time - self.port.time
        if step <= 0.0:
            return self._initial
        rate, acceleration = self._moving_with_displacements(step)
        try:
            stiffness = self._response.effective_stiffness(rate, acceleration)
        except RunError:  # the force is known: another matrix only costs the client iterations
            return self._initial
        return np.asarray(self._map.T @ stiffness @ self._map)

    def _moving_with_displacements(self, step: float) -> tuple[float, float]:
        """How rates and accelerations change with displacements in the client's method, from its last two trials."""
        motion = self._given[0]
        if not motion[1:].any():
            return 0.0, 0.0  # a static analysis
        if self._before is not None and (change := motion - self._before)[0].any():
            square = float(change[0] @ change[0])
            rate, acceleration = (float(change[i] @ change[0]) / square for i in (1, 2))
            self._ratios = rate * step, acceleration * step**2
        return self._ratios[0] / step, self._ratios[1] / step**2


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
        report: Say,
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
        self.ports = [int(listener.getsockname()[1]) for listener in self._listeners]

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
