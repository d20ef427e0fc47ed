"""`msfp_gen.simulate`: the run of a bearing or of a building."""

from __future__ import annotations

import inspect
from dataclasses import replace
from time import monotonic
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.errors import InputError, RunError
from msfp_gen.simulation import simulate as bearings
from msfp_gen.version import __version__

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from msfp_gen.buildings.result import BuildingResult
    from msfp_gen.result import Result
    from msfp_gen.scene.scene import Scene


@overload
def simulate(scene: BuildingScene) -> BuildingResult: ...


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
) -> Result: ...


@overload
def simulate(scene: Scene | BuildingScene, *, progress: bearings.Progress | None = None) -> Any: ...


def simulate(scene: Scene | BuildingScene, **options: Any) -> Result | BuildingResult:
    """As `simulation.simulate.simulate`, whose text is shown; a `BuildingScene` gives a `BuildingResult`."""
    if not isinstance(scene, BuildingScene):
        return bearings.simulate(scene, **options)
    options.pop("progress", None)
    if options:
        raise InputError(f"{next(iter(options))}: the run of a building has no such option; leave it out")
    return _simulate_building(scene)


def _simulate_building(scene: BuildingScene) -> BuildingResult:
    """The run of a building, whose result states how it ended, with what and how long it took."""
    from msfp_gen.buildings.result import BuildingResult
    from msfp_gen.buildings.run import simulate_building

    begin, about = monotonic(), {"msfp_gen": __version__, "numpy": np.__version__}
    try:
        return replace(simulate_building(scene), provenance=about, wall_time=monotonic() - begin)
    except RunError as error:
        result = error.result
        if isinstance(result, BuildingResult):
            ended = {"status": error.status, "message": str(error), "wall_time": monotonic() - begin}
            result = replace(result, provenance=about, **ended)  # type: ignore[arg-type]
        raise RunError(str(error), status=error.status, result=result) from None


simulate.__doc__ = f"{bearings.simulate.__doc__}\n    Of a `BuildingScene`, without options: its `BuildingResult`.\n"
simulate.__signature__ = inspect.signature(bearings.simulate)  # type: ignore[attr-defined]
