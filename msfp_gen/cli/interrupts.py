"""Handle SIGTERM and SIGHUP like Ctrl-C, so that an interrupted run still writes its output."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

# SIGHUP does not exist on all platforms. Python itself handles SIGINT.
_SIGNALS = [number for name in ("SIGTERM", "SIGHUP") if (number := getattr(signal, name, None)) is not None]


@contextmanager
def signals_as_interrupts() -> Iterator[list[int]]:
    """Within the block these signals raise KeyboardInterrupt; the list contains the numbers received."""
    received: list[int] = []

    def interrupt(number: int, _: FrameType | None) -> None:
        received.append(number)
        raise KeyboardInterrupt

    # A handler that was set before stays: nohup, for example, ignores SIGHUP.
    handled = [number for number in _SIGNALS if signal.getsignal(number) is signal.SIG_DFL]
    try:
        for number in handled:
            signal.signal(number, interrupt)
    except ValueError:  # only the main thread may set handlers
        handled = []
    try:
        yield received
    finally:
        for number in handled:
            signal.signal(number, signal.SIG_DFL)
