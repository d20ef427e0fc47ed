"""`simulate_building`: the run of a building on its bearings."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from msfp_gen.buildings.compiled_run import BuildingRun, start_run
from msfp_gen.buildings.result import BuildingResult, result_of
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.buildings.switching import switch
from msfp_gen.errors import RunError
from msfp_gen.specification.contract import STATUSES

STEPS_PER_CALL = 20  # between two looks at interrupts, progress and checkpoints
_FAILURES = {status.name: status for status in STATUSES}
Progress = Callable[[float, float], None]


class RunCheckpoint(Protocol):
    """A checkpoint of the run (`simulation/checkpoint.py`)."""

    def restore(self, run: Any) -> None:
        """Set a new run to the saved state, if there is one."""

    def save_if_due(self, run: Any) -> None:
        """Save the run if enough time has passed."""

    def save(self, run: Any) -> None:
        """Save the run now."""


def simulate_building(
    scene: BuildingScene,
    progress: Progress | None = None,
    keep: Callable[[BuildingRun], RunCheckpoint] | None = None,
    threads: int | None = None,
) -> BuildingResult:
    """The motion of a building and its bearings from rest.

    progress: called with the time reached and the end [s]. keep: gives the checkpoint of a run. threads: as in
    `start_run`. Raises InputError; RunError that names the bearing: it cannot follow, or a step has no solution; its
    `result` has the rows until then, as after an interrupt; None before the first row.
    """
    run = start_run(scene, threads)
    keeper = keep(run) if keep is not None else None
    if keeper is not None:
        keeper.restore(run)
    interrupted = _advance(run, progress, keeper)
    status = run.run.status[0]
    if keeper is not None and status == "ok":  # a run that failed fails again from the last checkpoint
        keeper.save(run)
    if status == "ok" and interrupted:
        status = "interrupted"
    if status != "ok":
        raise RunError(failure(run, status), status=status, result=result_of(run) if len(run.run.rows) else None)
    return result_of(run)


def _advance(run: BuildingRun, progress: Progress | None, keeper: RunCheckpoint | None) -> bool:
    """Take all steps; True after Ctrl-C."""
    try:
        while run.run.advance(STEPS_PER_CALL) or switch(run):
            if keeper is not None:
                keeper.save_if_due(run)
            if progress is not None:
                progress(run.run.time, run.scene.end)
    except KeyboardInterrupt:
        return True
    return False


def failure(run: BuildingRun, status: str) -> str:
    """One line with bearing, time, surface, cause and remedy."""
    _, bearing, surface, value = run.run.status
    found = _FAILURES[status]
    who = run.scene.label(bearing - 1) if bearing else "building"
    where = f", surface {surface}" if surface else ""
    where += f", {found.quantity} = {value:.4g}" if surface and found.quantity else ""
    return f"{who}: stopped at t = {run.run.time:.6g} s of {run.scene.end:.6g} s{where}: {found.failure}"
