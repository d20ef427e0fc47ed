"""Options that keep a run on disk while it goes on: --checkpoint, --every, --resume."""

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
    Path | None, typer.Option("--checkpoint", metavar="FILE", help="Keep the run here while it goes on.")
]
Every = Annotated[
    float | None, typer.Option(parser=number, metavar="SECONDS", help="Time between two checkpoints; default 60.")
]
ResumeFile = Annotated[
    Path | None, typer.Option("--resume", metavar="FILE", help="Go on with the run that this checkpoint keeps.")
]


@dataclass(frozen=True)
class Keep:
    """Where a run is kept, if anywhere."""

    path: Path | None = None
    every: float | None = None
    resume: bool = False

    @classmethod
    def of(cls, checkpoint: Path | None, every: float | None, resume: Path | None) -> Keep:
        """From the options; InputError where they contradict each other."""
        if checkpoint is not None and resume is not None:
            raise InputError(f"--checkpoint = {str(checkpoint)!r}: --resume goes on writing its own file; give one")
        if every is not None and checkpoint is None and resume is None:
            raise InputError(f"--every = {every:g}: there is no checkpoint to write; give --checkpoint FILE")
        return cls(checkpoint if resume is None else resume, every, resume is not None)

    @property
    def arguments(self) -> dict[str, Any]:
        """What `simulate` is told."""
        if self.path is None:
            return {}
        return {"checkpoint": self.path, "resume": self.resume} | ({} if self.every is None else {"every": self.every})

    def hint(self, failure: RunError) -> str:
        """What to do after an interruption."""
        return f"; go on with --resume {self.path}" if failure.status == "interrupted" and self._there else ""

    @contextmanager
    def while_saving(self) -> Iterator[None]:
        """Say that the run is not lost where the block cannot write what was asked for."""
        try:
            yield
        except OSError as error:
            if not self._there:
                raise
            raise RunError(f"{error}; the run is not lost: make room and give --resume {self.path}") from error

    def done(self) -> None:
        """Everything that was asked for is written: the checkpoint has served."""
        for file in self._files:
            file.unlink(missing_ok=True)

    @property
    def _there(self) -> bool:
        return bool(self._files)

    @property
    def _files(self) -> list[Path]:
        """One for each model that the run went through."""
        from msfp_gen.checkpoint import kept_files  # numpy is not for --help

        return [] if self.path is None else kept_files(self.path)


NOT_KEPT = Keep()
