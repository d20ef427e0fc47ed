"""The result of a building as an xarray.Dataset, and as the groups and attributes of a netCDF-4 file.

A result goes out to a file and comes in again by `results/files.py`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.buildings.building import Building
from msfp_gen.buildings.extremes import DIMENSIONS, OF_SURFACES, SIZES, BuildingExtremes
from msfp_gen.buildings.file import stored_bearing
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.buildings.spectra import Steps
from msfp_gen.buildings.storey import FREEDOMS, Node, StoreyColumns
from msfp_gen.common.arrays import Array
from msfp_gen.motions.motion import Motion
from msfp_gen.results.dataset import ROWS as ONE_BEARING
from msfp_gen.results.files import COUNTER, Storage, attributes_of, motion_in, notes_in, without
from msfp_gen.results.history import ENERGY_BELOW, LABELS
from msfp_gen.results.stored_group import Attribute, StoredGroup
from msfp_gen.results.variables import (
    SURFACES,
    Arrays,
    Labels,
    Places,
    Variable,
    column_places,
    dataset_of,
    digest_of_names,
    label_coordinates,
    stored_fields,
)
from msfp_gen.scene.file.loader import bearing_table, dumps, plain_table, toml_table
from msfp_gen.scene.file.stored_motion import GROUP as MOTION
from msfp_gen.scene.file.stored_motion import PIECES, to_pieces
from msfp_gen.scene.scene_fields import Limits
from msfp_gen.scene.solver import Solver

if TYPE_CHECKING:
    import xarray as xr

Dimensions = Mapping[str, tuple[str, ...]]  # of arrays, by name
GROUP = "building"  # group of a result file with the matrices
MATRICES = {  # array in that group -> dimensions
    **dict.fromkeys(("mass", "damping", "stiffness"), ("row", "column")),
    "node_rows": ("node", "freedom", "row"),
    "node_position": ("node", "axis"),
    **dict.fromkeys(("deformation", "inertia"), ("storey", "freedom", "row")),
}


def scene_text(scene: BuildingScene) -> str:
    """Bearings, solver and names as TOML text in SI units; matrices and motions are stored as arrays."""
    building = scene.building
    return dumps(
        {
            "name": scene.name,
            "duration": scene.duration,
            "output_step": scene.output_step,
            "grounds": len(scene.grounds[0]),
            "solver": plain_table(scene.solver),
            "limits": None if scene.limits is None else plain_table(scene.limits),
            "fidelity": None if scene.fidelity == "exact" else scene.fidelity,
            "node": [{"name": n.name, "carries": n.carries, "floor": n.floor} for n in building.nodes],
            "column": [{"name": column.name} for column in building.columns],
            "bearing": [
                {
                    **plain_table(mount),
                    "bearing": bearing_table(mount.bearing),
                    "interface": plain_table(mount.interface),
                    "effects": None if mount.effects is None else plain_table(mount.effects),
                    "ground": ground,
                }
                for mount, ground in zip(scene.bearings, scene.grounds[1], strict=True)
            ],
        }
    )


def to_arrays(building: Building) -> Arrays:
    """Matrices, nodes and columns of a building by name, as in `MATRICES`."""
    size, nodes, columns = len(building.mass), building.nodes, building.columns
    return {
        **{name: getattr(building, name) for name in ("mass", "damping", "stiffness")},
        "node_rows": np.reshape([node.rows for node in nodes], (-1, FREEDOMS, size)),
        "node_position": np.reshape([node.position for node in nodes], (-1, 3)),
        **{
            name: np.reshape([getattr(column, name) for column in columns], (-1, FREEDOMS, size))
            for name in ("deformation", "inertia")
        },
    }


def ground_name(index: int) -> str:
    """The name of the group of a result file with a motion of the ground, by index; 0 is the motion of the scene."""
    return MOTION if index == 0 else f"{MOTION}_{index}"


def scene_from(text: str, arrays: dict[str, Array], motions: Sequence[Motion]) -> BuildingScene:
    """The scene of a text of `scene_text`, arrays of `to_arrays` and all motions of the ground. Raises InputError."""
    table = toml_table(text)
    of_nodes = zip(table.get("node", []), arrays["node_position"], arrays["node_rows"], strict=True)
    nodes = tuple(
        Node(str(row["name"]), position, rows, bool(row["carries"]), bool(row["floor"]))
        for row, position, rows in of_nodes
    )
    of_storeys = zip(table.get("column", []), arrays["deformation"], arrays["inertia"], strict=True)
    columns = tuple(StoreyColumns(str(row["name"]), deformation, inertia) for row, deformation, inertia in of_storeys)
    building = Building(arrays["mass"], arrays["damping"], arrays["stiffness"], nodes, columns)
    bearings = []
    for index, row in enumerate(table["bearing"]):
        ground = row.pop("ground", 0)
        own = motions[ground] if ground else None
        bearings.append(replace(stored_bearing(row, index), motion=own))
    known = {field.name for field in fields(Solver)}
    solver = Solver(**{name: value for name, value in table.get("solver", {}).items() if name in known})
    name, duration, step = str(table.get("name", "")), table.get("duration"), table.get("output_step")
    limits = Limits(**table["limits"]) if "limits" in table else None
    fidelity = table.get("fidelity", "exact")
    return BuildingScene(building, bearings, motions[0], solver, duration, name, step, limits, fidelity)


EXTREMES, EXTREME_TIMES = "extremes", "extreme_times"  # groups
STEPS = "steps"  # group with the accelerations of all nodes at the ends of all steps
OF_STEPS = {"time": ("step",), "acceleration": ("step", "node", "freedom")}
FREEDOM = ("u1", "u2", "u3", "r1", "r2", "r3")
ON_BEARING = "on the bearing"
MOTION_UNITS = {  # unit of translations; unit of translations and rotations in one array
    "displacement": ("m", "m or rad"),
    "velocity": ("m/s", "m/s or rad/s"),
    "acceleration": ("m/s^2", "m/s^2 or rad/s^2"),
}


ALL, STOREYS = ("time",), ("time", "storey", "freedom")  # dimensions
OF_BEARING, VECTORS = ("time", "bearing"), ("time", "bearing", "axis")


def _of_bearings(name: str, field: str, sign: str = "") -> Variable:
    """The variable of all bearings that corresponds to a variable of one bearing."""
    variable = ONE_BEARING[name]
    return variable._replace(dims=("time", "bearing", *variable.dims[1:]), field=field, sign=sign)


def _motions(word: str, dims: tuple[str, ...], meaning: str, kind: int = 0) -> dict[str, Variable]:
    """Variables for displacement, velocity and acceleration in one array."""
    # word: field of the result. dims: of each variable. kind: index of the unit in MOTION_UNITS.
    array_dims = (*dims[:-1], "order", dims[-1])
    return {
        f"{word}_{name}": Variable(dims, units[kind], meaning.format(name), word, (..., order, slice(None)), array_dims)
        for order, (name, units) in enumerate(MOTION_UNITS.items())
    }


def _wrenches(end: int, word: str) -> dict[str, Variable]:
    """Variables for force and moment of an end of each bearing. end: 0, lower, or 1, upper."""
    array_dims = (*OF_BEARING, "end", "freedom")
    force, moment = f"force of the {word} end", f"moment of the {word} end about it"
    return {
        f"{word}_force": Variable(VECTORS, "N", force, "wrench", (..., end, slice(0, 3)), array_dims, ON_BEARING),
        f"{word}_moment": Variable(VECTORS, "N m", moment, "wrench", (..., end, slice(3, 6)), array_dims, ON_BEARING),
    }


COORDINATES = {
    "displacement": "coordinates, in axes that do not move with the ground",
    "velocity": "their rates",
    "acceleration": "absolute",
}
# Variables from which a result is read again.
STORED = {
    "time": ONE_BEARING["time"],
    **{
        f"coordinate_{name}": Variable(("time", "coordinate"), MOTION_UNITS[name][1], meaning, name)
        for name, meaning in COORDINATES.items()
    },
    **_motions("ground", ("time", "axis"), "{} of the ground"),
    **_wrenches(0, "lower"),
    **_wrenches(1, "upper"),
    "normal_force": _of_bearings("normal_force", "normal_force", "compression"),
    **{name: _of_bearings(name, name) for name in OF_SURFACES},
    **_motions("support", VECTORS, "{} of the ground below the bearing"),
    **{name: Variable(OF_BEARING, "J", meaning, name) for name, meaning in ENERGY_BELOW.items()},
    "energy_damped": Variable(ALL, "J", "dissipated by the damping of the building", "damped"),
    "energy_received": Variable(
        ALL, "J", "work of the bearings on the building, by their forces beyond those at rest", "received"
    ),
    "energy_input": Variable(ALL, "J", "work of the ground", "input"),
}
FORCE = "force and moment that accelerate the floors above, at half height"
# Variables that follow from STORED.
DERIVED = {
    **_motions("node", ("time", "node", "freedom"), "{} of the node, of a floor its centre of mass, absolute", 1),
    "bearing_displacement": _of_bearings("displacement", "bearing_displacement", "base less top"),
    "top_force": _of_bearings("top_force", "top_force", "on the building"),
    "axial_force": Variable(
        OF_BEARING, "N", "force between bearing and building along E3", "axial_force", sign="compression"
    ),
    "base_reaction": Variable(
        ("time", "axis"), "N", "sum of the forces of the ground", "base_reaction", sign=ON_BEARING
    ),
    "base_torsion": Variable(ALL, "N m", "their moment about E3 through the centre of mass", "base_torsion"),
    "overturning_moment": Variable(
        ("time", "horizontal"), "N m", "moment that accelerates the building, at height 0", "overturning_moment"
    ),
    "drift": Variable(STOREYS, "m or rad", "deformation of the columns", "drift", sign="above less below"),
    "storey_force": Variable(STOREYS, "N or N m", FORCE, "storey_force", sign="on the floors above"),
    "energy_kinetic": Variable(ALL, "J", "kinetic energy of the building", "kinetic"),
    "energy_strain": Variable(ALL, "J", "strain energy of the building", "strain"),
    "energy_potential": Variable(ALL, "J", "potential energy of the weights, from the place at rest", "potential"),
}
VARIABLES = STORED | DERIVED


def arrays_of(result: Any) -> Arrays:
    """Field, as in `Variable.field`, -> array; the variables are parts of these arrays."""
    nodes, bearings = result.scene.building.nodes, result.bearings
    lists = {
        "node": [result.node(node.name) for node in nodes],
        "bearing_displacement": [bearing.history.displacement for bearing in bearings],
        "top_force": [bearing.history.top_force for bearing in bearings],
    }
    fields = {variable.field for variable in VARIABLES.values()} - lists.keys()
    arrays = {name: np.stack(columns, axis=1) for name, columns in lists.items()}
    return arrays | {name: getattr(result, name) for name in fields}


def to_dataset(result: Any) -> xr.Dataset:
    """All variables over time; scene, status, notes of the monitors and versions are attributes."""
    counters = {**result.counters, "wall_time": result.wall_time}
    about = attributes_of(result, edition(), scene_text(result.scene), result.monitored, counters)
    about |= {"motion": PIECES, "padding": "NaN: the bearing has no such surface"}
    storeys = bool(result.scene.building.columns)
    variables = {name: variable for name, variable in VARIABLES.items() if storeys or "storey" not in variable.dims}
    return dataset_of(variables, arrays_of(result), label_coordinates(labels_of(result.scene)), about)


def labels_of(scene: BuildingScene) -> Labels:
    """Dimension -> labels, for all dimensions but time."""
    building, bearings = scene.building, scene.bearings
    return {
        "axis": LABELS["axis"],
        "horizontal": LABELS["axis"][:2],
        "freedom": FREEDOM,
        "coordinate": range(len(building.mass)),
        "node": [node.name for node in building.nodes],
        "storey": [column.name for column in building.columns],
        "bearing": range(1, len(bearings) + 1),
        "surface": range(1, max(bearing.layout.surfaces for bearing in scene.every_bearing) + 1),
    }


def columns(scene: BuildingScene) -> Places:
    """The columns of a table of all rows, as in `column_places`, without surfaces that a bearing does not have."""
    surfaces = [bearing.layout.surfaces for bearing in scene.every_bearing]
    return {
        name: (variable, index)
        for name, (variable, index) in column_places(VARIABLES, labels_of(scene)).items()
        if variable.dims[1:] != SURFACES or index[1] < surfaces[index[0]]
    }


def groups_of(result: Any) -> dict[str, xr.Dataset]:
    """The groups of a file beside the dataset: matrices, motions of the ground, extremes and their times."""
    groups = {GROUP: _group_of(to_arrays(result.scene.building), MATRICES)}
    groups |= {ground_name(i): to_pieces(motion) for i, motion in enumerate(result.scene.grounds[0])}
    groups |= {STEPS: _group_of(result.steps._asdict(), OF_STEPS)}
    extremes = {name: getattr(result.extremes, name) for name in DIMENSIONS}
    groups |= {EXTREMES: _group_of(extremes, DIMENSIONS)}
    return groups | {EXTREME_TIMES: _group_of(result.extremes.times, DIMENSIONS)}


def _group_of(arrays: Mapping[str, Array], dims: Dimensions) -> xr.Dataset:
    import xarray as xr

    return xr.Dataset({name: (dims[name], values) for name, values in arrays.items()})


def _arrays_in(root: StoredGroup, name: str, dims: Dimensions, sizes: Mapping[str, int]) -> Arrays:
    """The arrays of the group `name`, with the arguments of `_group_of`."""
    group = root.group(name)
    return {key: group.array(key, tuple(sizes[dim] for dim in dims_of)) for key, dims_of in dims.items()}


def edition() -> str:
    """A digest of the names of variables and extremes in a file of this version."""
    return digest_of_names([*STORED, *OF_STEPS, *DIMENSIONS])


def fields_in(root: StoredGroup, about: Mapping[str, Attribute]) -> dict[str, Any]:
    """The fields of the `BuildingResult` in a file: scene, rows, extremes, counters and notes.

    As `Storage.fields_in`.
    """
    scene = _scene(root, about)
    sizes = SIZES | {dim: len(labels) for dim, labels in labels_of(scene).items()} | {"time": root.rows("time")}
    surfaces = np.array([bearing.layout.surfaces for bearing in scene.every_bearing])
    missing = np.arange(sizes["surface"]) >= surfaces[:, None]
    counters: dict[str, Any] = without(COUNTER, about)
    return {
        "scene": scene,
        **stored_fields(root, STORED, sizes, missing),
        "steps": Steps(**_arrays_in(root, STEPS, OF_STEPS, sizes | {"step": root.group(STEPS).rows("time")})),
        "wall_time": counters.pop("wall_time"),
        "counters": counters,
        "monitored": notes_in(about),
        "extremes": BuildingExtremes(
            **_arrays_in(root, EXTREMES, DIMENSIONS, sizes),
            times=_arrays_in(root, EXTREME_TIMES, DIMENSIONS, sizes),
        ),
    }


def _scene(root: StoredGroup, about: Mapping[str, Attribute]) -> BuildingScene:
    """The scene in a file."""
    text = str(about["scene"])
    table, size = toml_table(text), root.group(GROUP).rows("mass")
    sizes = {"row": size, "column": size, "freedom": FREEDOMS, "axis": 3}
    sizes |= {"node": len(table.get("node", [])), "storey": len(table.get("column", []))}
    matrices = _arrays_in(root, GROUP, MATRICES, sizes)
    motions = [motion_in(root, ground_name(index)) for index in range(int(table.get("grounds", 1)))]
    return scene_from(text, matrices, motions)


STORAGE = Storage(to_dataset, arrays_of, columns, edition, fields_in, groups_of, DERIVED)
