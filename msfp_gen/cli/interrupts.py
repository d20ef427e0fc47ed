"""Handle SIGTERM and SIGHUP like Ctrl-C, so that an interrupted run still writes its output."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

# SIGHUP does not exist on all platforms. Python itself handles SIGINT.
_SIGNALS = [number for name in ("SIGTERM", "SIGHUP") if (number := getattr(signal, name, None)) is not None]
REPEAT = 0.05  # time after which an interrupt that was lost is repeated [s]


@contextmanager
def signals_as_interrupts() -> Iterator[list[int]]:
    """Within the block these signals raise KeyboardInterrupt; the list contains the numbers received.

    Python ignores a KeyboardInterrupt in a callback, such as that of a weak reference; it is repeated.
    """
    received: list[int] = []

    def interrupt(number: int, _: FrameType | None) -> None:
        received.append(number)
        raise KeyboardInterrupt

    def repeat(ignored: Any) -> None:
        if not issubclass(ignored.exc_type, KeyboardInterrupt):
            before(ignored)
            return
        number = received[-1] if received else signal.SIGINT
        again = threading.Timer(REPEAT, signal.pthread_kill, (threading.main_thread().ident, number))
        again.daemon = True
        again.start()

    before, sys.unraisablehook = sys.unraisablehook, repeat
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
        sys.unraisablehook = before
        for number in handled:
            signal.signal(number, signal.SIG_DFL)
