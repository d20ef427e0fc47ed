"""The result of a building as an xarray.Dataset."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from msfp_gen.buildings.bearing_result import bearings_of
from msfp_gen.buildings.notes import notes_of
from msfp_gen.common.arrays import Array
from msfp_gen.results.history import LABELS

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.buildings.data import BuildingData

SOURCE = "msfp-gen building"  # by which a file is known
AXES = LABELS["axis"]
FREEDOM = ("u1", "u2", "u3", "r1", "r2", "r3")
ON_BEARING = "on the bearing"
ENERGY = {
    "damped": "dissipated by the damping of the building",
    "received": "work of the bearings on the building, by their forces beyond those at rest",
    "input": "work of the ground",
}
GROUND = ("displacement", "velocity", "acceleration")


class Variable(NamedTuple):
    """A variable of the dataset: dimensions after time, values, unit, meaning, sign."""

    dims: tuple[str, ...]
    values: Array
    unit: str
    meaning: str
    sign: str = ""


def stored(result: BuildingData) -> dict[str, Variable]:
    """The variables from which a result can be made again."""
    still = "axes that do not move with the ground"
    found = {
        "coordinate_displacement": Variable(
            ("coordinate",), result.displacement, "m or rad", f"coordinates, in {still}"
        ),
        "coordinate_velocity": Variable(("coordinate",), result.velocity, "m/s or rad/s", "their rates"),
        "coordinate_acceleration": Variable(("coordinate",), result.acceleration, "m/s^2 or rad/s^2", "absolute"),
    }
    for order, name in enumerate(GROUND):
        unit = ("m", "m/s", "m/s^2")[order]
        found[f"ground_{name}"] = Variable(("axis",), result.ground[:, order], unit, f"{name} of the ground")
    for end, word in enumerate(("lower", "upper")):
        force, moment = np.split(result.wrench[:, :, end], 2, axis=-1)
        dims = ("bearing", "axis")
        found[f"{word}_force"] = Variable(dims, force, "N", f"force of the {word} end", ON_BEARING)
        found[f"{word}_moment"] = Variable(dims, moment, "N m", f"moment of the {word} end about it", ON_BEARING)
    dims = ("bearing", "surface")
    found["normal_force"] = Variable(
        dims, padded(result.normal_force), "N", "normal force on the surface", "compression"
    )
    found["sliding"] = Variable(dims, padded(result.sliding), "m", "distance s from the centre of the surface (3.20)")
    for order, name in enumerate(GROUND):
        unit, own = ("m", "m/s", "m/s^2")[order], result.support[:, :, order]
        found[f"support_{name}"] = Variable(("bearing", "axis"), own, unit, f"{name} of the ground below the bearing")
    found["dissipated"] = Variable(("bearing",), result.dissipated, "J", "energy dissipated in the bearing")
    found["stored"] = Variable(("bearing",), result.stored, "J", "energy stored in the bearing and its interface")
    for name, meaning in ENERGY.items():
        found[f"energy_{name}"] = Variable((), getattr(result, name), "J", meaning)
    return found


def derived(result: BuildingData) -> dict[str, Variable]:
    """The variables that follow from the others."""
    nodes = [result.node(node.name) for node in result.scene.building.nodes]
    motion = np.stack(nodes, axis=2)  # time, derivative, node, freedom
    each = np.stack([one.displacement for one in bearings_of(result)], axis=1)
    force = np.stack([one.top_force for one in bearings_of(result)], axis=1)
    node, storey = ("node", "freedom"), ("storey", "freedom")
    units = ("m or rad", "m/s or rad/s", "m/s^2 or rad/s^2")
    found = {
        f"node_{name}": Variable(node, motion[:, order], units[order], f"{name} of the node, absolute")
        for order, name in enumerate(GROUND)
    }
    found |= {
        "bearing_displacement": Variable(("bearing", "axis"), each, "m", "displacement u across it", "base less top"),
        "top_force": Variable(("bearing", "axis"), force, "N", "force of the bearing", "on the building"),
        "axial_force": Variable(("bearing",), result.axial_force, "N", "force along E3", "compression"),
        "base_reaction": Variable(("axis",), result.base_reaction, "N", "sum of the forces of the ground", ON_BEARING),
        "base_torsion": Variable((), result.base_torsion, "N m", "their moment about E3 through the centre of mass"),
    }
    if result.scene.building.columns:
        above = "force and moment that accelerate the floors above, at half height"
        found["drift"] = Variable(storey, result.drift, "m or rad", "deformation of the columns", "above less below")
        found["storey_force"] = Variable(storey, result.storey_force, "N or N m", above, "on the floors above")
    for name in ("kinetic", "strain"):
        found[f"energy_{name}"] = Variable((), getattr(result, name), "J", f"{name} energy of the building")
    return found


def to_dataset(result: BuildingData) -> xr.Dataset:
    """All variables along time; scene, status, summary of notes and provenance in the attributes."""
    import xarray as xr

    variables = {name: _array(variable) for name, variable in {**stored(result), **derived(result)}.items()}
    return xr.Dataset(variables, dict(_coordinates(result)), attrs=attributes(result))


def padded(columns: list[Array]) -> Array:
    """Values of the surfaces of all bearings, shape (k, bearings, most surfaces); NaN where a bearing has none."""
    most = max(each.shape[1] for each in columns)
    found = np.full((len(columns[0]), len(columns), most), np.nan)
    for index, each in enumerate(columns):
        found[:, index, : each.shape[1]] = each
    return found


def attributes(result: BuildingData) -> dict[str, Any]:
    """The attributes of dataset and file."""
    from msfp_gen.buildings.text import scene_text

    return {
        "title": result.scene.name or "unnamed",
        "source": SOURCE,
        "status": result.status,
        "message": result.message,
        "notes": json.dumps([note.line for note in notes_of(result)]),
        "scene": scene_text(result.scene),
        "counts": json.dumps(result.counts),
        "monitored": json.dumps([[index, vars(note)] for index, note in result.monitored]),
        "wall_time": result.wall_time,
        "provenance": json.dumps(result.provenance),
        "padding": "NaN: the bearing has no such surface",
    }


def _array(variable: Variable) -> tuple[tuple[str, ...], Array, dict[str, str]]:
    about = {"units": variable.unit, "long_name": variable.meaning}
    return ("time", *variable.dims), variable.values, about | ({"sign": variable.sign} if variable.sign else {})


def _coordinates(result: BuildingData) -> Iterator[tuple[str, Any]]:
    building = result.scene.building
    most = max(each.shape[1] for each in result.sliding)
    yield "time", ("time", result.time, {"units": "s", "long_name": "time t"})
    yield "axis", ("axis", np.array(AXES))
    yield "freedom", ("freedom", np.array(FREEDOM), {"long_name": "along and about E1, E2, E3"})
    yield "coordinate", ("coordinate", np.arange(len(building.mass)), {"long_name": "of the building, from 0"})
    yield "node", ("node", np.array([node.name for node in building.nodes]))
    yield "storey", ("storey", np.array([column.name for column in building.columns], dtype=str))
    yield "bearing", ("bearing", np.arange(1, len(bearings_of(result)) + 1), {"long_name": "number of the bearing"})
    yield "surface", ("surface", np.arange(1, most + 1), {"long_name": "sliding surface, bottom first"})
