"""`simulate`: runs a scene and returns its result. The time integration is compiled C."""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from pathlib import Path
from typing import Any, overload

from msfp_gen.common.aliases import Progress
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.results.result import Result
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.system import System, is_system
from msfp_gen.simulation.bearing_run import start_bearing
from msfp_gen.simulation.checkpoint import EVERY, Checkpoint, Identity
from msfp_gen.simulation.system import Run, finish


@overload
def simulate(
    scene: Scene,
    *,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    every: float = ...,
    resume: bool = False,
    strict: bool = False,
    gradients: Sequence[str] = (),
    energy_gradients: bool = False,
    gradient_errors: bool = True,
) -> Result: ...


@overload
def simulate(
    scene: Any,
    *,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    every: float = ...,
    resume: bool = False,
    **options: Any,
) -> Any: ...


def simulate(  # noqa: D417 - the docstring lists the options one by one
    scene: Any,
    *,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    every: float = EVERY,
    resume: bool = False,
    **options: Any,  # the options of `scene.run_options`, which the docstring lists
) -> Any:
    """Run a scene: integrate its equations from the start to the end of the motion.

    Parameters
    ----------
    scene
        The scene of a bearing (`Scene`), of a building (`BuildingScene`), or another system. The options from `strict`
        to `gradient_errors` are for a bearing, `threads` and `cores` are for a building.
    progress
        Called repeatedly with the time reached and the end of the run [s]. An exception in it ends the run.
    checkpoint
        File of the checkpoint, written at intervals, when the run is interrupted and when it ends. It must not exist
        unless `resume` is given. It is not removed after the run.
    every
        Wall time between two checkpoints [s].
    resume
        Continue from the state in `checkpoint`; the rows are bit by bit the same as without the interruption.
    strict
        Stop where a monitor trips (status `monitor`), instead of continuing with a model that includes the effect
        (`Auto`) or with a note in the result (`Effects`): docs/effects.md.
    gradients
        Paths of parameters (`bearing.surfaces[*].friction`) by which the run is differentiated: docs/gradients.md.
    energy_gradients
        Whether the energies that are integrals over the run are differentiated too, which costs more.
    gradient_errors
        Whether the errors of the derivatives of a run that meets a rim or lifts off are measured, by another run at a
        tenth of its tolerance.
    threads
        Number of threads for the bearings of a building; None: chosen. Results do not depend on it.
    cores
        Number of cores for the threads that are chosen; None: all that this process may use.

    Returns
    -------
    Result, or BuildingResult of a building
        Rows, events, counters and notes of the run.

    Raises
    ------
    InputError
        The method does not support the effects; the rows do not fit into memory; the checkpoint is damaged, or
        of another scene or build; a parameter does not exist, or the run has no gradients; the runs of this kind of
        scene have no such option.
    RunError
        The run failed: the message gives time, bearing, surface and cause, `.result` has the rows until then.

    """
    if not is_system(scene):
        raise InputError(f"scene: a {type(scene).__name__} is no scene; give what load_scene returns")
    chosen = {name: value for name, value in options.items() if value or name in scene.run_options}
    if unknown := sorted(chosen.keys() - scene.run_options):
        raise InputError(f"{unknown[0]}: the run of this scene has no such option; leave it out")
    if checkpoint is None and resume:
        raise InputError("resume: needs the checkpoint to resume from; give checkpoint")
    result = integrate(scene, progress=progress, checkpoint=checkpoint, every=every, resume=resume, **chosen)
    if not result.succeeded:
        raise RunError(result.message, status=result.status, result=result)
    return result


def integrate(
    system: System,
    *,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    every: float = EVERY,
    resume: bool = False,
    with_initial_row: bool = False,
    **options: Any,
) -> Any:
    """The result of a run, also of one that failed after its first row.

    Arguments, errors: see `simulate`. with_initial_row: see `Run.result`. Raises RunError where there is no row.
    """
    run = start(system, **options)
    if checkpoint is not None and run.without_checkpoint:
        raise InputError(f"checkpoint = {str(checkpoint)!r}: {run.without_checkpoint}; leave out one of them")
    saved = None if checkpoint is None else Checkpoint(checkpoint, Identity.of(system), every, resume)
    finish(run, system.end, progress, saved)
    return run.result(with_initial_row)


@singledispatch
def start(system: Any, **options: Any) -> Run:
    """The run of a system before its first segment. options: of `simulate`. Raises InputError, RunError."""
    run: Run = system.start(**options)
    return run


start.register(Scene, start_bearing)
