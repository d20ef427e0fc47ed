"""A polite end: SIGTERM and a terminal that closes are heard as Ctrl-C is, so that nothing is lost to them."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

# SIGHUP is not known everywhere; SIGINT is Python's own business.
_HEARD = [number for name in ("SIGTERM", "SIGHUP") if (number := getattr(signal, name, None)) is not None]


@contextmanager
def heard() -> Iterator[list[int]]:
    """Within the block these signals raise KeyboardInterrupt; the list holds the numbers of those that came."""
    came: list[int] = []

    def interrupt(number: int, _: FrameType | None) -> None:
        came.append(number)
        raise KeyboardInterrupt

    # What somebody chose before us (nohup ignores SIGHUP) stands.
    mine = [number for number in _HEARD if signal.getsignal(number) is signal.SIG_DFL]
    try:
        for number in mine:
            signal.signal(number, interrupt)
    except ValueError:  # signals are the main thread's alone
        mine = []
    try:
        yield came
    finally:
        for number in mine:
            signal.signal(number, signal.SIG_DFL)
