"""Full nonlinear equations of motion of multi-stage friction pendulum bearings: derived, compiled, integrated.

The public names below are loaded when first used, so that `import msfp_gen` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from msfp_gen.version import __version__

if TYPE_CHECKING:
    from msfp_gen import presets
    from msfp_gen.batch import simulate_batch
    from msfp_gen.bearing import Bearing, Body, Surface
    from msfp_gen.build import build_model
    from msfp_gen.errors import CompileError, InputError, MsfpError, RunError
    from msfp_gen.layout import Auto, Effects, Layout
    from msfp_gen.motion import Motion
    from msfp_gen.prescribed import Load, Rotation
    from msfp_gen.scene import Scene, Stop
    from msfp_gen.scenefile import load_scene
    from msfp_gen.simulation import simulate
    from msfp_gen.solver import Solver
    from msfp_gen.top import Top

# Name -> module that holds it; a package is its own value.
_HOMES = {
    "Auto": "layout",
    "Bearing": "bearing",
    "Body": "bearing",
    "CompileError": "errors",
    "Effects": "layout",
    "InputError": "errors",
    "Layout": "layout",
    "Load": "prescribed",
    "Motion": "motion",
    "MsfpError": "errors",
    "Rotation": "prescribed",
    "RunError": "errors",
    "Scene": "scene",
    "Solver": "solver",
    "Stop": "scene",
    "Surface": "bearing",
    "Top": "top",
    "build_model": "build",
    "load_scene": "scenefile",
    "presets": "presets",
    "simulate": "simulation",
    "simulate_batch": "batch",
}

__all__ = [
    "Auto",
    "Bearing",
    "Body",
    "CompileError",
    "Effects",
    "InputError",
    "Layout",
    "Load",
    "Motion",
    "MsfpError",
    "Rotation",
    "RunError",
    "Scene",
    "Solver",
    "Stop",
    "Surface",
    "Top",
    "__version__",
    "build_model",
    "load_scene",
    "presets",
    "simulate",
    "simulate_batch",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'msfp_gen' has no attribute {name!r}")
    module = import_module(f"msfp_gen.{_HOMES[name]}")
    value = module if _HOMES[name] == name else getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
