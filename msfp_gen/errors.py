"""Every error this package raises on purpose. The leaf of the import graph.

A message is one line that names the field, the value and the remedy.
"""

from __future__ import annotations

from pathlib import Path

LONGEST = 500  # characters of a message; what comes from a file can be of any length


class MsfpError(Exception):
    """Base of all errors raised on purpose; `exit_code` is what the command line returns.

    The message is made one line of printable text, whatever of a file it quotes.
    """

    exit_code = 1

    def __init__(self, message: str = "") -> None:
        super().__init__(_one_line(message))


class InputError(MsfpError, ValueError):
    """Bad input: a field, its value and the remedy. Nothing was computed or written."""

    exit_code = 2


class CompileError(MsfpError, RuntimeError):
    """The compiler is missing or refused the emitted sources; carries command, log path and last lines."""

    exit_code = 2

    def __init__(self, message: str, *, command: str = "", log: Path | None = None, output: str = "") -> None:
        super().__init__(message)
        self.command = command
        self.log = log
        self.output = output


class RunError(MsfpError, RuntimeError):
    """A run that could not go on: says time, surface and quantity; `result` holds what was computed until then."""

    exit_code = 1  # 130 where it was interrupted, as shells have it

    def __init__(self, message: str, *, status: str = "", result: object | None = None) -> None:
        super().__init__(message)
        self.status = status
        self.result = result
        if status == "interrupted":
            self.exit_code = 130


def printable(text: str) -> str:
    """`text` with everything but line ends escaped that a terminal would act on: what a file says is only shown."""
    return "".join(letter if letter.isprintable() or letter == "\n" else ascii(letter)[1:-1] for letter in text)


def _one_line(message: str) -> str:
    """Blanks run together, control characters escaped, and a long middle left out."""
    text = printable(" ".join(message.split()))
    half = LONGEST // 2 - 3
    return text if len(text) <= LONGEST else f"{text[:half]} ... {text[-half:]}"
