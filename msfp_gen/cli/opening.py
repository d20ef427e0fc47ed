"""What a command is given: a saved result, or a scene that is run first, its model built where there is none yet."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msfp_gen.cli.console import Progress, building
from msfp_gen.errors import RunError

if TYPE_CHECKING:
    from msfp_gen.result import Result
    from msfp_gen.scene import Scene


def opened(source: str) -> Result | Scene:
    """A saved result (.nc), or the scene of a file or preset."""
    if source.lower().endswith(".nc"):
        from msfp_gen.dataset import read_result

        return read_result(source)
    from msfp_gen.scenefile import load_scene

    return load_scene(source)


def build(scene: Scene) -> None:
    """Make sure that the model is there, and say so while it is made."""
    from msfp_gen.build import build_model

    with building() as progress:
        build_model(scene.bearing.layout, scene.modelled, progress=progress)


def simulated(scene: Scene, **options: Any) -> tuple[Result | None, RunError | None]:
    """The result, and why the run failed if it did: what was computed until then is worth keeping."""
    from msfp_gen.result import Result
    from msfp_gen.simulation import simulate

    build(scene)
    with Progress(scene.name or "run") as progress:
        try:
            return simulate(scene, progress=progress, **options), None
        except RunError as error:
            return error.result if isinstance(error.result, Result) else None, error


def looked_at(given: Result | Scene) -> tuple[Result, RunError | None]:
    """`given`, or its run, and why that failed if it did; raises where nothing was computed."""
    from msfp_gen.result import Result

    if isinstance(given, Result):
        return given, None
    result, failure = simulated(given)
    if result is None:
        assert failure is not None
        raise failure
    return result, failure
