"""The run of a system, from its start to its end: with progress, checkpoints, Ctrl-C and a watch of the memory.

`Run` is what runs of bearings, of buildings and of other systems have in common; `finish` takes one to its end.
"""

from __future__ import annotations

import time
from typing import Any, Protocol

from msfp_gen.common.aliases import Progress
from msfp_gen.simulation.checkpoint import Checkpoint


class Run(Protocol):
    """A run of a system. Each of its segments has its own models, and its own snapshot in a checkpoint."""

    @property
    def time(self) -> float:
        """Time reached [s]."""

    @property
    def build(self) -> str:
        """Key of the builds of the models of the present segment."""

    @property
    def without_checkpoint(self) -> str:
        """Why the run cannot be saved; "" where it can."""

    def begin(self) -> None:
        """Begin the next segment, before its first step. Raises InputError, RunError."""

    def advance(self) -> bool:
        """Take some steps; False: the present segment has ended."""

    @property
    def status(self) -> str:
        """How the present segment stands: "ok", "stopped" (the stop condition was met), or the name of a failure."""

    def end(self, status: str, wall: float) -> bool:
        """End the present segment with a status, after `wall` seconds; whether another segment follows."""

    def snapshot(self) -> bytes:
        """State of the present segment, with all rows."""

    def restore(self, snapshot: bytes) -> None:
        """Continue, before the first step, from a snapshot of a run of the same system. Raises ValueError."""

    def result(self, with_initial_row: bool = False) -> Any:
        """The result of all segments, of a failed run until its failure; RunError where there is no row.

        with_initial_row: a run that failed before its first row has one of its initial state, if that is finite.
        """


def finish(run: Run, end: float, progress: Progress | None = None, checkpoint: Checkpoint | None = None) -> None:
    """Take a run to its end [s], or until it fails or is interrupted. progress, checkpoint: see `simulate`."""
    while True:
        run.begin()
        if checkpoint is not None:
            checkpoint.begin(run, run.build)
        begin = time.perf_counter()
        status = _advance(run, end, progress, checkpoint)
        wall = time.perf_counter() - begin + (0.0 if checkpoint is None else checkpoint.wall)
        if not run.end(status, wall):
            return
        if checkpoint is not None:
            checkpoint.end(run)


def _advance(run: Run, end: float, progress: Progress | None, checkpoint: Checkpoint | None) -> str:
    """Take all steps of a segment; its status: "interrupted" after Ctrl-C. end: of the run [s]."""
    status = ""
    try:
        while run.advance():
            if checkpoint is not None:
                checkpoint.save_if_due(run)
            if progress is not None:
                progress(run.time, end)
    except KeyboardInterrupt:
        status = "interrupted"
    # After a failure the last checkpoint is kept: resumed from there, the run fails again in the same way.
    if checkpoint is not None and run.status in ("ok", "stopped"):
        checkpoint.save(run)
    return status or run.status
