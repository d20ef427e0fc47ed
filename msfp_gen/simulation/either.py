"""`msfp_gen.simulate`: the run of a bearing or of a building."""

from __future__ import annotations

import inspect
from dataclasses import replace
from time import monotonic
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from msfp_gen.buildings.result import BuildingResult
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.identity import fingerprint
from msfp_gen.errors import InputError, RunError
from msfp_gen.simulation import simulate as bearings
from msfp_gen.simulation.checkpoint import EVERY, Checkpoint, Identity, require_no_checkpoint
from msfp_gen.version import __version__

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from msfp_gen.buildings.compiled_run import BuildingRun
    from msfp_gen.result import Result
    from msfp_gen.scene.scene import Scene

_OF_BUILDINGS = ("progress", "checkpoint", "every", "resume", "threads")


@overload
def simulate(
    scene: BuildingScene,
    *,
    progress: bearings.Progress | None = None,
    checkpoint: str | Path | None = None,
    every: float = ...,
    resume: bool = False,
    threads: int | None = None,
) -> BuildingResult: ...


@overload
def simulate(
    scene: Scene,
    *,
    progress: bearings.Progress | None = None,
    checkpoint: str | Path | None = None,
    every: float = ...,
    resume: bool = False,
    strict: bool = False,
    stream: str | Path | None = None,
    gradients: Sequence[str] = (),
    energy_gradients: bool = False,
    gradient_errors: bool = True,
) -> Result: ...


@overload
def simulate(scene: Scene | BuildingScene, *, progress: bearings.Progress | None = None) -> Any: ...


def simulate(scene: Scene | BuildingScene, **options: Any) -> Result | BuildingResult:
    """As `simulation.simulate.simulate`, whose text is shown; a `BuildingScene` gives a `BuildingResult`."""
    if not isinstance(scene, BuildingScene):
        return bearings.simulate(scene, **options)
    for name, value in options.items():
        if name not in _OF_BUILDINGS and value not in (False, None, ()):
            raise InputError(f"{name}: the run of a building has no such option; leave it out")
    return _timed(scene, {name: options[name] for name in _OF_BUILDINGS if name in options})


def _timed(scene: BuildingScene, options: dict[str, Any]) -> BuildingResult:
    """The run of a building, whose result states how it ended, with what and how long it took."""
    begin, about = monotonic(), {"msfp_gen": __version__, "numpy": np.__version__}
    try:
        return replace(_simulate_building(scene, **options), provenance=about, wall_time=monotonic() - begin)
    except RunError as error:
        result = error.result
        if isinstance(result, BuildingResult):
            ended = {"status": error.status, "message": str(error), "wall_time": monotonic() - begin}
            result = replace(result, provenance=about, **ended)  # type: ignore[arg-type]
        raise RunError(str(error), status=error.status, result=result) from None


def _simulate_building(
    scene: BuildingScene,
    progress: bearings.Progress | None = None,
    checkpoint: str | Path | None = None,
    every: float = EVERY,
    resume: bool = False,
    threads: int | None = None,
) -> BuildingResult:
    from msfp_gen.buildings.run import simulate_building

    if checkpoint is None:
        if resume:
            raise InputError("resume: needs the checkpoint to resume from; give checkpoint")
        return simulate_building(scene, progress, threads=threads)
    path = checkpoint
    if not resume:
        require_no_checkpoint(path)

    def keep(run: BuildingRun) -> Checkpoint:
        return Checkpoint(path, identity(run), every, resume)

    return simulate_building(scene, progress, keep, threads)


def identity(run: BuildingRun) -> Identity:
    """The identity of the run of a building, for its checkpoint. The text states what users recognise a scene by."""
    import tomli_w

    scene = run.scene
    known = {
        "name": scene.name,
        "building": {"coordinates": len(scene.building.mass), "bearings": len(scene.bearings)},
        "motion": {"name": scene.motion.name, "duration": scene.motion.duration},
        "solver": {"method": scene.solver.method, "rtol": scene.solver.rtol},
        "duration": scene.end,
    }
    return Identity(run.build, tomli_w.dumps(known), fingerprint(scene))


_ADDED = """
    Of a `BuildingScene`: its `BuildingResult`, with the options progress, checkpoint, every, resume, and threads:
    for its bearings, None: chosen. Results do not depend on their number.
"""
simulate.__doc__ = f"{bearings.simulate.__doc__}{_ADDED}"
simulate.__signature__ = inspect.signature(bearings.simulate)  # type: ignore[attr-defined]
