"""Input of commands: load a saved result or a scene, build its models, run it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msfp_gen.cli.console import Progress, building
from msfp_gen.errors import InputError, RunError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from msfp_gen.buildings.load import AnyScene
    from msfp_gen.buildings.result import BuildingResult
    from msfp_gen.result import Result

    AnyResult = Result | BuildingResult


def load_source(source: str) -> AnyResult | AnyScene:
    """Load a saved result (.nc), or the scene of a file or preset, of one bearing or of a building."""
    if source.lower().endswith(".nc"):
        from msfp_gen.buildings.result import BuildingResult
        from msfp_gen.result import Result
        from msfp_gen.results.files import read_result

        result: Any = read_result(source, Result, BuildingResult)
        return result  # type: ignore[no-any-return]
    from msfp_gen.buildings.load import load_scene

    return load_scene(source)


def is_result(loaded: object) -> bool:
    """Whether this is a result, not a scene."""
    from msfp_gen.results.files import ResultFiles

    return isinstance(loaded, ResultFiles)


def of_building(loaded: object) -> bool:
    """Whether this is the scene or the result of a building."""
    from msfp_gen.buildings.result import BuildingResult
    from msfp_gen.buildings.scene import BuildingScene

    return isinstance(loaded, BuildingScene | BuildingResult)


def figures_of(loaded: object) -> Mapping[str, Callable[..., Any]]:
    """The figures of a scene or result, of one bearing or of a building, by their names."""
    from msfp_gen.figures import BUILDING_FIGURES, FIGURES

    return BUILDING_FIGURES if of_building(loaded) else FIGURES


def one_bearing(loaded: Any, what: str) -> Any:
    """A scene or result of one bearing. Raises InputError that begins with `what` for one of a building."""
    if of_building(loaded):
        raise InputError(f"{what}: this is a building; leave it out, or give a scene or result of one bearing")
    return loaded


def build(scene: AnyScene, gradients: bool = False) -> None:
    """Build the models of a scene, with progress, unless they are in the cache. gradients: ones that have them."""
    from msfp_gen.model.model import build_model

    with building() as progress:
        for spec in scene.specs:
            build_model(spec.layout, spec.effects, gradients, progress=progress)


def run_scene(scene: AnyScene, **options: Any) -> tuple[Any, RunError | None]:
    """Run a scene; its result (of a failed run as far as it was computed), and the error of a failed run."""
    from msfp_gen.scene.scene import Scene
    from msfp_gen.simulation.memory import require_room
    from msfp_gen.simulation.run_any import simulate

    if isinstance(scene, Scene):
        require_room(scene, options.get("stream"))
    build(scene)
    with Progress(scene.name or "run") as progress:
        try:
            return simulate(scene, progress=progress, **options), None
        except RunError as error:
            return error.result if is_result(error.result) else None, error


def result_of(loaded: AnyResult | AnyScene) -> tuple[Any, RunError | None]:
    """A loaded result, or the run of a loaded scene, and the error of a failed run.

    Raises RunError if nothing was computed.
    """
    if is_result(loaded):
        return loaded, None
    result, failure = run_scene(loaded)  # type: ignore[arg-type]
    if result is None:
        assert failure is not None
        raise failure
    return result, failure
