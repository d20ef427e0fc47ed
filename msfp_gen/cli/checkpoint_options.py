"""Options of `run` for checkpoints: --checkpoint, --every, --resume."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from msfp_gen.cli.console import number
from msfp_gen.errors import InputError, RunError

CheckpointFile = Annotated[
    Path | None,
    typer.Option("--checkpoint", metavar="FILE", help="Save the state of the run to this file at intervals."),
]
Every = Annotated[
    float | None, typer.Option(parser=number, metavar="SECONDS", help="Wall time between two checkpoints; default 60.")
]
ResumeFile = Annotated[
    Path | None, typer.Option("--resume", metavar="FILE", help="Continue the run from this checkpoint.")
]


@dataclass(frozen=True)
class CheckpointOptions:
    """Options of checkpoints.

    Attributes:
        path: file of the checkpoint; None without checkpoints.
        every: wall time between two checkpoints [s]; None for the default.
        resume: whether the run continues from the file.
    """

    path: Path | None = None
    every: float | None = None
    resume: bool = False

    @classmethod
    def of(cls, checkpoint: Path | None, every: float | None, resume: Path | None) -> CheckpointOptions:
        """From the command line. Raises InputError for options that contradict each other."""
        if checkpoint is not None and resume is not None:
            raise InputError(f"--checkpoint = {str(checkpoint)!r}: --resume continues to write its own file; give one")
        if every is not None and checkpoint is None and resume is None:
            raise InputError(f"--every = {every:g}: there is no checkpoint to write; give --checkpoint FILE")
        return cls(checkpoint if resume is None else resume, every, resume is not None)

    @property
    def arguments(self) -> dict[str, Any]:
        """Keyword arguments for `simulate`."""
        if self.path is None:
            return {}
        return {"checkpoint": self.path, "resume": self.resume} | ({} if self.every is None else {"every": self.every})

    def hint(self, failure: RunError) -> str:
        """Text for the message of an interrupted run: how to continue it."""
        return f"; continue with --resume {self.path}" if failure.status == "interrupted" and self._files else ""

    @contextmanager
    def hint_on_write_error(self) -> Iterator[None]:
        """Add to an error of writing, such as a full disk, that the checkpoint still holds the run."""
        try:
            yield
        except OSError as error:
            if not self._files:
                raise
            raise RunError(f"{error}; the run is not lost: make room and give --resume {self.path}") from error

    def remove_files(self) -> None:
        """Remove the checkpoint, after all output is written."""
        from msfp_gen.simulation.checkpoint import kept_rows

        for file in [*self._files, *([] if self.path is None else kept_rows(self.path))]:
            file.unlink(missing_ok=True)

    @property
    def _files(self) -> list[Path]:
        """Existing files of the checkpoint: one per segment of the run."""
        from msfp_gen.simulation.checkpoint import checkpoint_files  # imported late: --help shall not import NumPy

        return [] if self.path is None else checkpoint_files(self.path)


NO_CHECKPOINT = CheckpointOptions()
