"""Every error this package raises on purpose. The leaf of the import graph.

A message is one line that names the field, the value and the remedy.
"""

from __future__ import annotations

from pathlib import Path


class MsfpError(Exception):
    """Base of all errors raised on purpose; `exit_code` is what the command line returns."""

    exit_code = 1


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
