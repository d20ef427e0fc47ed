"""What the C files of a unit need to know of its scene."""

from __future__ import annotations

from typing import Any

from msfp_gen.fmu.description import Unit
from msfp_gen.fmu.variables import Block, top_names
from msfp_gen.generator.interface import model_name
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.top import MassTop
from msfp_gen.specification import contract
from msfp_gen.version import __version__


def model_content(scene: Scene, unit: Unit, exchange: bool) -> dict[str, Any]:
    """The names in the templates fmu_model.h and fmu_model.c."""
    effects, count = scene.spec.effects, scene.bearing.layout.surfaces
    loaded, surface = isinstance(scene.top, MassTop), contract.surface_values(effects)
    top, body = contract.names(contract.TOP), contract.names(contract.BODY)
    return {
        "stamp": f"written by msfp-gen {__version__}",
        "model": model_name(scene.spec),
        "token": unit.token,
        "mass": int(loaded),
        "exchange": int(exchange),
        "uplift": int(effects.uplift),
        "method": scene.solver.method,
        "top_places": [top.index(name) for name in top_names(scene)],
        "surfaces": count,
        "coordinates": 6 if effects.uplift else 3,
        "body_size": len(body),
        "body_mass": body.index("mass"),
        "surface_size": len(surface),
        "seat_stiffness": surface.index("seat_stiffness") if effects.uplift else 0,
        "top_size": len(top),
        "output_places": _output_places(unit, loaded),
        "output_count": len(unit.at(Block.OUTPUTS)),
        "places": _places(unit, loaded),
        "names": [variable.name for variable in unit.variables],
        "start": [variable.start for variable in unit.variables],
        "input_nominals": [unit.variables[i].nominal for i in unit.at(Block.INPUTS)],
        "state_nominals": [*(unit.variables[i].nominal for i in unit.at(Block.STATES)), 1.0],
    }


def _output_places(unit: Unit, loaded: bool) -> list[tuple[str, int]]:
    """Names in C of outputs, counted from the first output."""
    names = [unit.variables[i].name for i in unit.at(Block.OUTPUTS)]
    found = {"SLIDING": "surface[1].sliding", "NORMAL": "surface[1].normal"}
    if loaded:
        found |= {"TOP_FORCE": "top.force[1]", "BASE_FORCE": "lower.force[1]"}
    return [(place, names.index(name)) for place, name in found.items()]


def _places(unit: Unit, loaded: bool) -> list[tuple[str, int]]:
    """Names of value references in C: where blocks begin, and the variables that have a place."""
    found, end = [], 0
    for block in Block:
        references = unit.at(block)
        found.append((block.value, end))
        end += len(references)
        assert not references or references == list(range(references[0], end)), block
    found += [(variable.place, i) for i, variable in enumerate(unit.variables) if variable.place]
    if loaded:
        names = [variable.name for variable in unit.variables]
        found.append(("TOP_MASS", names.index("top.mass")))
    return found
