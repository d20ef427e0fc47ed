"""The run of a building: `simulate_building`."""

from __future__ import annotations

from dataclasses import replace
from time import monotonic
from typing import TYPE_CHECKING

from msfp_gen.buildings.compiled_run import BuildingRun, result_of, start_run
from msfp_gen.buildings.dataset import scene_text
from msfp_gen.common.identity import fingerprint
from msfp_gen.errors import RunError
from msfp_gen.scene.file.loader import dumps
from msfp_gen.simulation.checkpoint import EVERY, Checkpoint, Identity
from msfp_gen.simulation.outcome import provenance_of, stopped

if TYPE_CHECKING:
    from pathlib import Path

    from msfp_gen.buildings.result import BuildingResult
    from msfp_gen.buildings.scene import BuildingScene
    from msfp_gen.simulation.outcome import Progress

STEPS_PER_CALL = 20  # of a building, between two looks at interrupts, progress and checkpoints


def simulate_building(
    scene: BuildingScene,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    every: float = EVERY,
    resume: bool = False,
    threads: int | None = None,
) -> BuildingResult:
    """The motion of a building and its bearings from rest.

    progress: called with the time reached and the end [s]. checkpoint, every, resume: as of `simulate`. threads: as in
    `start_run`. Raises InputError; RunError that names the bearing: it cannot follow, or a step has no solution; its
    `result` has the rows until then, as after an interrupt; None before the first row.
    """
    begin = monotonic()
    run = start_run(scene, threads)
    keeper = None if checkpoint is None else Checkpoint(checkpoint, identity(run), every, resume)
    if keeper is not None:
        keeper.restore(run)
    interrupted = _advance(run, progress, keeper)
    status, message = run.run.status[0], ""
    if keeper is not None and status == "ok":  # a run that failed fails again from the last checkpoint
        keeper.save(run)
    if status == "ok" and interrupted:
        status = "interrupted"
    if status != "ok":
        message = failure(run, status)
    result = None
    if status == "ok" or run.run.row_count:
        about = provenance_of(scene.solver, ", ".join(spec.key for spec in scene.specs))
        ended = {"status": status, "message": message, "wall_time": monotonic() - begin}
        result = replace(result_of(run), provenance=about, **ended)  # type: ignore[arg-type]
    if result is None or message:
        raise RunError(message, status=status, result=result)
    return result


def _advance(run: BuildingRun, progress: Progress | None, keeper: Checkpoint | None) -> bool:
    """Take all steps; True after Ctrl-C."""
    try:
        while run.run.advance(STEPS_PER_CALL) or run.switch():
            if keeper is not None:
                keeper.save_if_due(run)
            if progress is not None:
                progress(run.time, run.scene.end)
    except KeyboardInterrupt:
        return True
    return False


def failure(run: BuildingRun, status: str) -> str:
    """One line with bearing, time, surface, cause and remedy."""
    _, bearing, surface, value = run.run.status
    who = run.scene.label(bearing - 1) if bearing else "building"
    return f"{who}: {stopped(run.time, run.scene.end, status, surface, value)}"


def identity(run: BuildingRun) -> Identity:
    """The identity of the run of a building, for its checkpoint."""
    motion = {"name": run.scene.motion.name, "duration": run.scene.motion.duration}
    return Identity(run.build, scene_text(run.scene) + dumps({"motion": motion}), fingerprint(run.scene))
