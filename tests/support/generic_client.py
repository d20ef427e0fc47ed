"""A client that speaks as `element genericClient` of OpenSees does, with the server that it talks to."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Thread

import numpy as np

from msfp_gen import TwoPort
from msfp_gen.embedding.server import Server
from support import Array

SIZE = 256  # numbers of a message


class Client:
    """One element with `count` degrees of freedom."""

    def __init__(self, port: int, count: int = 12, sizes: list[int] | None = None) -> None:
        self.count, self.socket = count, socket.create_connection(("127.0.0.1", port), timeout=60)
        self.socket.sendall(np.array(sizes or [count] * 3 + [0, 1, 0, 0, 0, count, 0, SIZE], "<i4").tobytes())

    def send(self, action: int, *numbers: Array | float) -> None:
        message = np.zeros(SIZE)
        values = np.concatenate([[float(action)], *(np.ravel(each) for each in numbers)])
        message[: len(values)] = values
        self.socket.sendall(message.tobytes())

    def trial(self, time: float, motion: Array) -> Array:
        """The force at a trial; motion: displacements, rates, accelerations, shape (3, count)."""
        self.send(3, motion, time)
        return self.ask(10)[: self.count]

    def ask(self, action: int) -> Array:
        self.send(action)
        data = b""
        while len(data) < 8 * SIZE:
            part = self.socket.recv(8 * SIZE)
            assert part, "the server has left"
            data += part
        return np.frombuffer(data)

    def matrix(self, action: int) -> Array:
        return self.ask(action)[: self.count**2].reshape(self.count, self.count, order="F")

    def commit(self) -> None:
        self.send(5)

    def end(self) -> None:
        self.send(99)
        self.socket.close()


class Served:
    """What a server said, and how many bearings failed."""

    def __init__(self, ports: list[int]) -> None:
        self.ports, self.lines, self.failed = ports, list[str](), -1


@contextmanager
def serving(*ports: TwoPort, count: int | None = None, up: str = "Z") -> Iterator[Served]:
    """Serve two-ports, each at its own port and for one client at a time, until `count` bearings have ended."""
    lines: list[str] = []
    makers = [(f"port {i}", lambda port=port: port) for i, port in enumerate(ports)]
    with Server(makers, 0, report=lines.append, up=up) as server:
        served = Served(server.ports)
        served.lines = lines

        def serve() -> None:
            served.failed = server.serve(len(ports) if count is None else count)

        thread = Thread(target=serve, daemon=True)
        thread.start()
        yield served
        thread.join(60)
        assert not thread.is_alive(), lines
