"""`msfp_gen.simulate`: the run of a bearing or of a building."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any, overload

from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.errors import InputError
from msfp_gen.simulation import simulate as bearings

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


def simulate(scene: Scene | BuildingScene, **options: Any) -> Result | BuildingResult:
    """As `simulation.simulate.simulate`, whose text is shown; a `BuildingScene` gives a `BuildingResult`."""
    if not isinstance(scene, BuildingScene):
        return bearings.simulate(scene, **options)
    if options:
        raise InputError(f"{next(iter(options))}: the run of a building has no such option; leave it out")
    from msfp_gen.buildings.run import simulate_building

    return simulate_building(scene)


simulate.__doc__ = f"{bearings.simulate.__doc__}\n    Of a `BuildingScene`, without options: its `BuildingResult`.\n"
simulate.__signature__ = inspect.signature(bearings.simulate)  # type: ignore[attr-defined]
