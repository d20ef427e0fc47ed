"""Full nonlinear equations of motion of multi-stage friction pendulum bearings: derived, compiled, integrated.

The public names below are imported at first use, so that `import msfp_gen` is fast.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from msfp_gen.common.version import __version__

if TYPE_CHECKING:
    from msfp_gen.auditing import audit as audit
    from msfp_gen.auditing.shadow import shadow as shadow
    from msfp_gen.buildings.bearing import BuildingBearing as BuildingBearing
    from msfp_gen.buildings.building import Building as Building
    from msfp_gen.buildings.figures import plot_axial_forces as plot_axial_forces
    from msfp_gen.buildings.figures import plot_building as plot_building
    from msfp_gen.buildings.figures import plot_floor_spectra as plot_floor_spectra
    from msfp_gen.buildings.figures import plot_plan as plot_plan
    from msfp_gen.buildings.figures import plot_profile as plot_profile
    from msfp_gen.buildings.result import BuildingResult as BuildingResult
    from msfp_gen.buildings.scene import BuildingScene as BuildingScene
    from msfp_gen.buildings.storey import BaseSlab as BaseSlab
    from msfp_gen.buildings.storey import Soil as Soil
    from msfp_gen.buildings.storey import Storey as Storey
    from msfp_gen.common.errors import CompileError as CompileError
    from msfp_gen.common.errors import InputError as InputError
    from msfp_gen.common.errors import MsfpError as MsfpError
    from msfp_gen.common.errors import RunError as RunError
    from msfp_gen.embedding.two_port import TwoPort as TwoPort
    from msfp_gen.figures import animate as animate
    from msfp_gen.figures import figures_of as figures_of
    from msfp_gen.figures import plot_correction as plot_correction
    from msfp_gen.figures import plot_energy as plot_energy
    from msfp_gen.figures import plot_force_path as plot_force_path
    from msfp_gen.figures import plot_loops as plot_loops
    from msfp_gen.figures import plot_orbit as plot_orbit
    from msfp_gen.figures import plot_response_spectrum as plot_response_spectrum
    from msfp_gen.figures import plot_result as plot_result
    from msfp_gen.figures import plot_section as plot_section
    from msfp_gen.figures import plot_sheet as plot_sheet
    from msfp_gen.figures import plot_sliding as plot_sliding
    from msfp_gen.figures import plot_stages as plot_stages
    from msfp_gen.model.model import build_model as build_model
    from msfp_gen.model.symbolic import symbolic as symbolic
    from msfp_gen.motions.motion import Motion as Motion
    from msfp_gen.motions.prescribed import Load as Load
    from msfp_gen.motions.prescribed import Rotation as Rotation
    from msfp_gen.report import write_report as write_report
    from msfp_gen.results.depth import temperature_at_depth as temperature_at_depth
    from msfp_gen.results.result import Result as Result
    from msfp_gen.results.result import characterise as characterise
    from msfp_gen.results.result import load_result as load_result
    from msfp_gen.results.sign import using_sign as using_sign
    from msfp_gen.scene.bearing import Bearing as Bearing
    from msfp_gen.scene.bearing import Body as Body
    from msfp_gen.scene.bearing import Surface as Surface
    from msfp_gen.scene.file import presets as presets
    from msfp_gen.scene.file.source import changed_scene as changed_scene
    from msfp_gen.scene.file.source import load_scene as load_scene
    from msfp_gen.scene.scene import Scene as Scene
    from msfp_gen.scene.scene_fields import InitialState as InitialState
    from msfp_gen.scene.scene_fields import Limits as Limits
    from msfp_gen.scene.scene_fields import Stop as Stop
    from msfp_gen.scene.solver import Solver as Solver
    from msfp_gen.scene.top import Top as Top
    from msfp_gen.simulation.simulate import simulate as simulate
    from msfp_gen.specification.layout import Auto as Auto
    from msfp_gen.specification.layout import Effects as Effects
    from msfp_gen.specification.layout import Layout as Layout
    from msfp_gen.studies.batch import simulate_batch as simulate_batch
    from msfp_gen.studies.bounding import bound as bound
    from msfp_gen.studies.calibration import Measurement as Measurement
    from msfp_gen.studies.calibration import fit as fit
    from msfp_gen.studies.run import study as study

# Public name -> the module that defines it; `presets` is a module itself.
_MODULES = {
    "Auto": "specification.layout",
    "BaseSlab": "buildings.storey",
    "Bearing": "scene.bearing",
    "Body": "scene.bearing",
    "Building": "buildings.building",
    "BuildingBearing": "buildings.bearing",
    "BuildingResult": "buildings.result",
    "BuildingScene": "buildings.scene",
    "CompileError": "common.errors",
    "Effects": "specification.layout",
    "InitialState": "scene.scene_fields",
    "InputError": "common.errors",
    "Layout": "specification.layout",
    "Limits": "scene.scene_fields",
    "Load": "motions.prescribed",
    "Measurement": "studies.calibration",
    "Motion": "motions.motion",
    "MsfpError": "common.errors",
    "Result": "results.result",
    "Rotation": "motions.prescribed",
    "RunError": "common.errors",
    "Scene": "scene.scene",
    "Soil": "buildings.storey",
    "Solver": "scene.solver",
    "Stop": "scene.scene_fields",
    "Storey": "buildings.storey",
    "Surface": "scene.bearing",
    "Top": "scene.top",
    "TwoPort": "embedding.two_port",
    "animate": "figures",
    "audit": "auditing",
    "bound": "studies.bounding",
    "build_model": "model.model",
    "changed_scene": "scene.file.source",
    "characterise": "results.result",
    "figures_of": "figures",
    "fit": "studies.calibration",
    "load_result": "results.result",
    "load_scene": "scene.file.source",
    "plot_axial_forces": "buildings.figures",
    "plot_building": "buildings.figures",
    "plot_correction": "figures",
    "plot_energy": "figures",
    "plot_floor_spectra": "buildings.figures",
    "plot_force_path": "figures",
    "plot_loops": "figures",
    "plot_orbit": "figures",
    "plot_plan": "buildings.figures",
    "plot_profile": "buildings.figures",
    "plot_response_spectrum": "figures",
    "plot_result": "figures",
    "plot_section": "figures",
    "plot_sheet": "figures",
    "plot_sliding": "figures",
    "plot_stages": "figures",
    "presets": "scene.file.presets",
    "shadow": "auditing.shadow",
    "simulate": "simulation.simulate",
    "simulate_batch": "studies.batch",
    "study": "studies.run",
    "symbolic": "model.symbolic",
    "temperature_at_depth": "results.depth",
    "using_sign": "results.sign",
    "write_report": "report",
}

__all__ = [*_MODULES, "__version__"]


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module 'msfp_gen' has no attribute {name!r}")
    module = import_module(f"msfp_gen.{_MODULES[name]}")
    value = module if name == "presets" else getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)  # without what this module itself needs
