"""The scene of a building as text and arrays, from which it can be made again without any other file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.buildings.building import Building
from msfp_gen.buildings.file import stored_bearing
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.buildings.storey import FREEDOMS, Columns, Node
from msfp_gen.common.arrays import Array
from msfp_gen.motions.motion import Motion
from msfp_gen.scene.file.loader import bearing_table, plain_table, toml_table
from msfp_gen.scene.file.stored_motion import GROUP as MOTION
from msfp_gen.scene.file.toml_text import dumps
from msfp_gen.scene.solver import Solver

if TYPE_CHECKING:
    import xarray as xr

GROUP = "building"  # group of a result file with the matrices
MATRICES = ("mass", "damping", "stiffness")


def scene_text(scene: BuildingScene) -> str:
    """Bearings, solver and names as TOML text in SI units; matrices and motion are arrays beside it."""
    building = scene.building
    return dumps(
        {
            "name": scene.name,
            "duration": scene.duration,
            "output_step": scene.output_step,
            "grounds": len(scene.grounds[0]),
            "solver": plain_table(scene.solver),
            "node": [{"name": n.name, "carries": n.carries} for n in building.nodes],
            "column": [{"name": column.name} for column in building.columns],
            "bearing": [
                {
                    **plain_table(each),
                    "bearing": bearing_table(each.bearing),
                    "interface": plain_table(each.interface),
                    "effects": None if each.effects is None else plain_table(each.effects),
                    "ground": ground,
                }
                for each, ground in zip(scene.bearings, scene.grounds[1], strict=True)
            ],
        }
    )


def to_arrays(building: Building) -> xr.Dataset:
    """Matrices, nodes and columns of a building as a dataset."""
    import xarray as xr

    square = ("row", "column")
    found: dict[str, Any] = {name: (square, getattr(building, name)) for name in MATRICES}
    shape = (-1, FREEDOMS, len(building.mass))
    node, storey = ("node", "freedom", "row"), ("storey", "freedom", "row")
    found["node_rows"] = (node, np.reshape([each.rows for each in building.nodes], shape))
    found["node_position"] = (("node", "axis"), np.reshape([each.position for each in building.nodes], (-1, 3)))
    found["deformation"] = (storey, np.reshape([each.deformation for each in building.columns], shape))
    found["inertia"] = (storey, np.reshape([each.inertia for each in building.columns], shape))
    return xr.Dataset(found)


def shapes(size: int, nodes: int, columns: int) -> dict[str, tuple[int, ...]]:
    """The shapes of these arrays."""
    found: dict[str, tuple[int, ...]] = dict.fromkeys(MATRICES, (size, size))
    found |= {"node_rows": (nodes, FREEDOMS, size), "node_position": (nodes, 3)}
    return found | dict.fromkeys(("deformation", "inertia"), (columns, FREEDOMS, size))


def ground_name(index: int) -> str:
    """The group of a result file with a motion of the ground; the first is that of the scene."""
    return MOTION if index == 0 else f"{MOTION}_{index}"


def scene_from(text: str, arrays: dict[str, Array], motions: Sequence[Motion]) -> BuildingScene:
    """The inverse of `scene_text`, with the arrays of `to_arrays` and all motions of the ground. Raises InputError."""
    table = toml_table(text)
    given = zip(table.get("node", []), arrays["node_position"], arrays["node_rows"], strict=True)
    nodes = tuple(Node(str(each["name"]), place, rows, bool(each["carries"])) for each, place, rows in given)
    stated = zip(table.get("column", []), arrays["deformation"], arrays["inertia"], strict=True)
    columns = tuple(Columns(str(each["name"]), *both) for each, *both in stated)
    building = Building(arrays["mass"], arrays["damping"], arrays["stiffness"], nodes, columns)
    bearings = []
    for index, row in enumerate(table["bearing"]):
        ground = row.pop("ground", 0)
        own = motions[ground] if ground else None
        bearings.append(replace(stored_bearing(row, index), motion=own))
    known = {field.name for field in fields(Solver)}
    solver = Solver(**{name: value for name, value in table.get("solver", {}).items() if name in known})
    name, duration, step = str(table.get("name", "")), table.get("duration"), table.get("output_step")
    return BuildingScene(building, bearings, motions[0], solver, duration, name, step)
