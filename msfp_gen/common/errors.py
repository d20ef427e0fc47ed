"""The errors that this package raises. This module imports no other module of the package.

A message is one line with the field, its value and a remedy.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class MsfpError(Exception):
    """Base class of all errors of this package; the command line ends with its `exit_code`.

    The message is converted to one line of printable text, since it may quote a file.
    """

    exit_code = 1
    max_length = 500  # characters of a message: texts quoted from a file can have any length

    def __init__(self, message: str = "") -> None:
        super().__init__(_one_line(message, self.max_length))


class InputError(MsfpError, ValueError):
    """Invalid input: the message gives the field, its value and a remedy. Nothing was computed or written."""

    exit_code = 2


class CompileError(MsfpError, RuntimeError):
    """There is no compiler, or it failed. The error has `command`, the path of the `log` and the end of `output`."""

    exit_code = 2

    def __init__(self, message: str, *, command: str = "", log: Path | None = None, output: str = "") -> None:
        super().__init__(message)
        self.command = command
        self.log = log
        self.output = output


class RunError(MsfpError, RuntimeError):
    """A run that failed: the message gives time, surface and cause; `result` has the rows until then, or is None."""

    max_length = 1000  # more than cause, last state and all remedies take
    exit_code = 1  # 130 where the run was interrupted, the convention of shells

    def __init__(self, message: str, *, status: str = "", result: object | None = None) -> None:
        super().__init__(message)
        self.status = status
        self.result = result
        if status == "interrupted":
            self.exit_code = 130


@contextmanager
def prefixed(prefix: str) -> Iterator[None]:
    """Begin the messages of all InputErrors of the block with a text."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{prefix}{error}") from None


def printable(text: str) -> str:
    """`text` with control characters other than line ends escaped, so that quoted files cannot control a terminal."""
    return "".join(letter if letter.isprintable() or letter == "\n" else ascii(letter)[1:-1] for letter in text)


def _one_line(message: str, longest: int) -> str:
    """A message in one line: white space collapsed, control characters escaped, the middle of a long text omitted."""
    text = printable(" ".join(message.split()))
    half = longest // 2 - 3
    return text if len(text) <= longest else f"{text[:half]} ... {text[-half:]}"
