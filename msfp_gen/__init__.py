"""Full nonlinear equations of motion of multi-stage friction pendulum bearings: derived, compiled, integrated.

The public names below are imported at first use, so that `import msfp_gen` is fast.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from msfp_gen.version import __version__

if TYPE_CHECKING:
    from msfp_gen.analysis.any_result import characterise
    from msfp_gen.buildings.building import Building
    from msfp_gen.buildings.load import changed_scene, load_scene
    from msfp_gen.buildings.scene import BuildingBearing, BuildingScene
    from msfp_gen.buildings.soil import Soil
    from msfp_gen.buildings.storey import BaseSlab, Storey
    from msfp_gen.coupling.two_port import TwoPort
    from msfp_gen.errors import CompileError, InputError, MsfpError, RunError
    from msfp_gen.model.model import build_model
    from msfp_gen.motions.motion import Motion
    from msfp_gen.motions.prescribed import Load, Rotation
    from msfp_gen.result import Result
    from msfp_gen.scene.bearing import Bearing, Body, Surface
    from msfp_gen.scene.file import presets
    from msfp_gen.scene.scene import Scene
    from msfp_gen.scene.scene_fields import InitialState, Stop
    from msfp_gen.scene.solver import Solver
    from msfp_gen.scene.top import Top
    from msfp_gen.simulation.run_any import simulate
    from msfp_gen.specification.layout import Auto, Effects, Layout
    from msfp_gen.studies.batch import simulate_batch
    from msfp_gen.studies.bounding import bound
    from msfp_gen.studies.calibration import Measurement, fit
    from msfp_gen.studies.study.run import study

# Public name -> the module that defines it; `presets` is a module itself.
_MODULES = {
    "Auto": "specification.layout",
    "BaseSlab": "buildings.storey",
    "Bearing": "scene.bearing",
    "Body": "scene.bearing",
    "Building": "buildings.building",
    "BuildingBearing": "buildings.scene",
    "BuildingScene": "buildings.scene",
    "CompileError": "errors",
    "Effects": "specification.layout",
    "InitialState": "scene.scene_fields",
    "InputError": "errors",
    "Layout": "specification.layout",
    "Load": "motions.prescribed",
    "Measurement": "studies.calibration",
    "Motion": "motions.motion",
    "MsfpError": "errors",
    "Result": "result",
    "Rotation": "motions.prescribed",
    "RunError": "errors",
    "Scene": "scene.scene",
    "Soil": "buildings.soil",
    "Solver": "scene.solver",
    "Stop": "scene.scene_fields",
    "Storey": "buildings.storey",
    "Surface": "scene.bearing",
    "Top": "scene.top",
    "TwoPort": "coupling.two_port",
    "bound": "studies.bounding",
    "build_model": "model.model",
    "changed_scene": "buildings.load",
    "characterise": "analysis.any_result",
    "fit": "studies.calibration",
    "load_scene": "buildings.load",
    "presets": "scene.file.presets",
    "simulate": "simulation.run_any",
    "simulate_batch": "studies.batch",
    "study": "studies.study.run",
}

__all__ = [
    "Auto",
    "BaseSlab",
    "Bearing",
    "Body",
    "Building",
    "BuildingBearing",
    "BuildingScene",
    "CompileError",
    "Effects",
    "InitialState",
    "InputError",
    "Layout",
    "Load",
    "Measurement",
    "Motion",
    "MsfpError",
    "Result",
    "Rotation",
    "RunError",
    "Scene",
    "Soil",
    "Solver",
    "Stop",
    "Storey",
    "Surface",
    "Top",
    "TwoPort",
    "__version__",
    "bound",
    "build_model",
    "changed_scene",
    "characterise",
    "fit",
    "load_scene",
    "presets",
    "simulate",
    "simulate_batch",
    "study",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module 'msfp_gen' has no attribute {name!r}")
    module = import_module(f"msfp_gen.{_MODULES[name]}")
    value = module if name == "presets" else getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
