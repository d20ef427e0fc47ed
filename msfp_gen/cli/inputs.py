"""Input of commands: load a saved result or a scene, build its model, run it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msfp_gen.cli.console import Progress, building
from msfp_gen.errors import RunError

if TYPE_CHECKING:
    from msfp_gen.result import Result
    from msfp_gen.scene.scene import Scene


def load_source(source: str) -> Result | Scene:
    """Load a saved result (.nc), or the scene of a file or preset."""
    if source.lower().endswith(".nc"):
        from msfp_gen.result import Result

        return Result.from_netcdf(source)
    from msfp_gen.buildings.opening import load_scene

    return load_scene(source)


def build(scene: Scene, gradients: bool = False) -> None:
    """Build the model of a scene, with progress, unless it is in the cache. gradients: one that has them."""
    from msfp_gen.model.model import build_model

    with building() as progress:
        build_model(scene.bearing.layout, scene.modelled, gradients, progress=progress)


def run_scene(scene: Scene, **options: Any) -> tuple[Result | None, RunError | None]:
    """Run a scene; its result (of a failed run as far as it was computed), and the error of a failed run."""
    from msfp_gen.result import Result
    from msfp_gen.simulation.memory import require_room
    from msfp_gen.simulation.simulate import simulate

    require_room(scene, options.get("stream"))
    build(scene)
    with Progress(scene.name or "run") as progress:
        try:
            return simulate(scene, progress=progress, **options), None
        except RunError as error:
            return error.result if isinstance(error.result, Result) else None, error


def result_of(loaded: Result | Scene) -> tuple[Result, RunError | None]:
    """A loaded result, or the run of a loaded scene, and the error of a failed run.

    Raises RunError if nothing was computed.
    """
    from msfp_gen.result import Result

    if isinstance(loaded, Result):
        return loaded, None
    result, failure = run_scene(loaded)
    if result is None:
        assert failure is not None
        raise failure
    return result, failure
