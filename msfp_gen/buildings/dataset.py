"""The result of a building as an xarray.Dataset, and what a netCDF-4 file of it holds: see `results/files.py`."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, replace
from functools import partial
from hashlib import sha256
from itertools import product
from types import EllipsisType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from msfp_gen.buildings.building import Building
from msfp_gen.buildings.extremes import BuildingExtremes
from msfp_gen.buildings.extremes import shapes as shapes_of_extremes
from msfp_gen.buildings.file import stored_bearing
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.buildings.storey import FREEDOMS, Columns, Node
from msfp_gen.common.arrays import Array
from msfp_gen.motions.motion import Motion
from msfp_gen.results.files import COUNTER, Arrays, attributes_of, motion_in, notes_in, table_of, without
from msfp_gen.results.history import LABELS
from msfp_gen.results.stored_group import Attribute, StoredGroup
from msfp_gen.scene.file.loader import bearing_table, plain_table, toml_table
from msfp_gen.scene.file.stored_motion import GROUP as MOTION
from msfp_gen.scene.file.stored_motion import PIECES, to_pieces
from msfp_gen.scene.file.toml_text import dumps
from msfp_gen.scene.solver import Solver

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.buildings.scene import BuildingScene
    from msfp_gen.results.files import ResultFiles

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
                    **plain_table(one),
                    "bearing": bearing_table(one.bearing),
                    "interface": plain_table(one.interface),
                    "effects": None if one.effects is None else plain_table(one.effects),
                    "ground": ground,
                }
                for one, ground in zip(scene.bearings, scene.grounds[1], strict=True)
            ],
        }
    )


def to_arrays(building: Building) -> xr.Dataset:
    """Matrices, nodes and columns of a building as a dataset."""
    import xarray as xr

    square = ("row", "column")
    variables: dict[str, Any] = {name: (square, getattr(building, name)) for name in MATRICES}
    shape = (-1, FREEDOMS, len(building.mass))
    node, storey = ("node", "freedom", "row"), ("storey", "freedom", "row")
    variables["node_rows"] = (node, np.reshape([each.rows for each in building.nodes], shape))
    variables["node_position"] = (("node", "axis"), np.reshape([each.position for each in building.nodes], (-1, 3)))
    variables["deformation"] = (storey, np.reshape([each.deformation for each in building.columns], shape))
    variables["inertia"] = (storey, np.reshape([each.inertia for each in building.columns], shape))
    return xr.Dataset(variables)


def shapes(size: int, nodes: int, columns: int) -> dict[str, tuple[int, ...]]:
    """The shapes of these arrays."""
    table: dict[str, tuple[int, ...]] = dict.fromkeys(MATRICES, (size, size))
    table |= {"node_rows": (nodes, FREEDOMS, size), "node_position": (nodes, 3)}
    return table | dict.fromkeys(("deformation", "inertia"), (columns, FREEDOMS, size))


def ground_name(index: int) -> str:
    """The group of a result file with a motion of the ground; the first is that of the scene."""
    return MOTION if index == 0 else f"{MOTION}_{index}"


def scene_from(text: str, arrays: dict[str, Array], motions: Sequence[Motion]) -> BuildingScene:
    """The inverse of `scene_text`, with the arrays of `to_arrays` and all motions of the ground. Raises InputError."""
    table = toml_table(text)
    given = zip(table.get("node", []), arrays["node_position"], arrays["node_rows"], strict=True)
    nodes = tuple(Node(str(row["name"]), place, rows, bool(row["carries"])) for row, place, rows in given)
    stated = zip(table.get("column", []), arrays["deformation"], arrays["inertia"], strict=True)
    columns = tuple(Columns(str(row["name"]), *both) for row, *both in stated)
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


EXTREMES = "extremes"  # group
FREEDOM = ("u1", "u2", "u3", "r1", "r2", "r3")
ON_BEARING = "on the bearing"
GROUND = ("displacement", "velocity", "acceleration")
UNITS = ("m", "m/s", "m/s^2")
BOTH = ("m or rad", "m/s or rad/s", "m/s^2 or rad/s^2")  # of translations and rotations
SURFACE = ("bearing", "surface")
Index = tuple[int | slice | EllipsisType, ...]


class Stored(NamedTuple):
    """A variable of which a result is made again: dimensions after time, field and part of it, unit, meaning, sign."""

    dims: tuple[str, ...]
    field: str
    part: Index
    unit: str
    meaning: str
    sign: str = ""


class Derived(NamedTuple):
    """A variable that follows from the stored ones: dimensions after time, values, unit, meaning, sign."""

    dims: tuple[str, ...]
    values: Callable[[Any], Array]
    unit: str
    meaning: str
    sign: str = ""


def _nodes(order: int, result: Any) -> Array:
    """A derivative of the motion of every node, shape (k, nodes, 6)."""
    return np.stack([result.node(node.name)[:, order] for node in result.scene.building.nodes], axis=1)


WHOLE: Index = (...,)
STORED = {
    "coordinate_displacement": Stored(
        ("coordinate",), "displacement", WHOLE, BOTH[0], "coordinates, in axes that do not move with the ground"
    ),
    "coordinate_velocity": Stored(("coordinate",), "velocity", WHOLE, BOTH[1], "their rates"),
    "coordinate_acceleration": Stored(("coordinate",), "acceleration", WHOLE, BOTH[2], "absolute"),
    **{
        f"ground_{name}": Stored(("axis",), "ground", (..., order, slice(None)), unit, f"{name} of the ground")
        for order, (name, unit) in enumerate(zip(GROUND, UNITS, strict=True))
    },
    **{
        f"{word}_{what}": Stored(
            ("bearing", "axis"), "wrench", (..., end, slice(3 * half, 3 * half + 3)), unit, meaning, ON_BEARING
        )
        for end, word in enumerate(("lower", "upper"))
        for half, (what, unit, meaning) in enumerate(
            (("force", "N", f"force of the {word} end"), ("moment", "N m", f"moment of the {word} end about it"))
        )
    },
    "normal_force": Stored(SURFACE, "normal_force", WHOLE, "N", "normal force on the surface", "compression"),
    "sliding": Stored(SURFACE, "sliding", WHOLE, "m", "distance s from the centre of the surface (3.20)"),
    "rim_force": Stored(SURFACE, "rim_force", WHOLE, "N", "force F_c of the rim (2.103)"),
    "lift": Stored(SURFACE, "lift", WHOLE, "m", "clearance between separated faces; 0 while in contact"),
    **{
        f"support_{name}": Stored(
            ("bearing", "axis"), "support", (..., order, slice(None)), unit, f"{name} of the ground below the bearing"
        )
        for order, (name, unit) in enumerate(zip(GROUND, UNITS, strict=True))
    },
    "dissipated": Stored(("bearing",), "dissipated", WHOLE, "J", "energy dissipated in the bearing"),
    "stored": Stored(("bearing",), "stored", WHOLE, "J", "energy stored in the bearing and its interface"),
    "energy_damped": Stored((), "damped", WHOLE, "J", "dissipated by the damping of the building"),
    "energy_received": Stored(
        (), "received", WHOLE, "J", "work of the bearings on the building, by their forces beyond those at rest"
    ),
    "energy_input": Stored((), "input", WHOLE, "J", "work of the ground"),
}
OF_SURFACES = [variable.field for variable in STORED.values() if variable.dims == SURFACE]
DERIVED = {
    **{
        f"node_{name}": Derived(
            ("node", "freedom"), partial(_nodes, order), BOTH[order], f"{name} of the node, absolute"
        )
        for order, name in enumerate(GROUND)
    },
    "bearing_displacement": Derived(
        ("bearing", "axis"), lambda r: _of_bearings(r, "displacement"), "m", "displacement u across it", "base less top"
    ),
    "top_force": Derived(
        ("bearing", "axis"), lambda r: _of_bearings(r, "top_force"), "N", "force of the bearing", "on the building"
    ),
    "axial_force": Derived(("bearing",), lambda r: r.axial_force, "N", "force along E3", "compression"),
    "base_reaction": Derived(("axis",), lambda r: r.base_reaction, "N", "sum of the forces of the ground", ON_BEARING),
    "base_torsion": Derived((), lambda r: r.base_torsion, "N m", "their moment about E3 through the centre of mass"),
    "drift": Derived(
        ("storey", "freedom"), lambda r: r.drift, BOTH[0], "deformation of the columns", "above less below"
    ),
    "storey_force": Derived(
        ("storey", "freedom"),
        lambda r: r.storey_force,
        "N or N m",
        "force and moment that accelerate the floors above, at half height",
        "on the floors above",
    ),
    "energy_kinetic": Derived((), lambda r: r.kinetic, "J", "kinetic energy of the building"),
    "energy_strain": Derived((), lambda r: r.strain, "J", "strain energy of the building"),
}


def _of_bearings(result: Any, name: str) -> Array:
    """A quantity of every bearing, shape (k, bearings, 3)."""
    return np.stack([getattr(one, name) for one in result.bearings], axis=1)


def to_dataset(result: Any) -> xr.Dataset:
    """All variables along time; scene, status, notes of the monitors and versions in the attributes."""
    import xarray as xr

    values = {name: (variable, getattr(result, variable.field)[variable.part]) for name, variable in STORED.items()}
    variables = {name: _array(variable, rows) for name, (variable, rows) in values.items()}
    variables |= {name: _array(variable, variable.values(result)) for name, variable in _derived(result)}
    counters = {**result.counters, "wall_time": result.wall_time}
    about = attributes_of(result, edition(), scene_text(result.scene), result.monitored, counters)
    about |= {"motion": PIECES, "padding": "NaN: the bearing has no such surface"}
    return xr.Dataset(variables, dict(_coordinates(result)), attrs=about)


def _derived(result: Any) -> Iterator[tuple[str, Derived]]:
    """Those of storeys only where there are some."""
    for name, variable in DERIVED.items():
        if result.scene.building.columns or "storey" not in variable.dims:
            yield name, variable


def _array(variable: Stored | Derived, values: Array) -> tuple[tuple[str, ...], Array, dict[str, str]]:
    about = {"units": variable.unit, "long_name": variable.meaning}
    return ("time", *variable.dims), values, about | ({"sign": variable.sign} if variable.sign else {})


def _labels(scene: BuildingScene) -> dict[str, Sequence[Any]]:
    """The labels of the dimensions after time."""
    building, bearings = scene.building, scene.bearings
    return {
        "axis": LABELS["axis"],
        "freedom": FREEDOM,
        "coordinate": range(len(building.mass)),
        "node": [node.name for node in building.nodes],
        "storey": [column.name for column in building.columns],
        "bearing": range(1, len(bearings) + 1),
        "surface": range(1, max(one.bearing.layout.surfaces for one in bearings) + 1),
    }


def _coordinates(result: Any) -> Iterator[tuple[str, Any]]:
    meanings = {
        "freedom": "along and about E1, E2, E3",
        "coordinate": "of the building, from 0",
        "bearing": "number of the bearing",
        "surface": "sliding surface, bottom first",
    }
    yield "time", ("time", result.time, {"units": "s", "long_name": "time t"})
    for dim, labels in _labels(result.scene).items():
        values = np.array(labels, dtype=None if len(labels) else str)
        yield dim, (dim, values, {"long_name": meanings[dim]} if dim in meanings else {})


def groups_of(result: Any) -> dict[str, xr.Dataset]:
    """The groups of a file beside the dataset: matrices, motions of the ground, extremes."""
    groups = {GROUP: to_arrays(result.scene.building)}
    groups |= {ground_name(i): to_pieces(motion) for i, motion in enumerate(result.scene.grounds[0])}
    return groups | ({} if result.recorded_extremes is None else {EXTREMES: result.recorded_extremes.to_arrays()})


def edition() -> str:
    """A digest of the names that a file of this version has."""
    table = [*STORED, *(field.name for field in fields(BuildingExtremes))]
    return sha256(json.dumps(table).encode()).hexdigest()[:12]


def fields_in(root: StoredGroup, about: dict[str, Attribute], arrays: Arrays) -> dict[str, Any]:
    """Scene, rows, extremes, counters and notes of a file, as `ResultFiles.fields_in`."""
    scene = _scene(root, about, arrays)
    rows = _rows(root, scene, arrays)
    counters: dict[str, Any] = without(COUNTER, about)
    return {
        "scene": scene,
        **rows,
        "wall_time": counters.pop("wall_time"),
        "counters": counters,
        "monitored": notes_in(about),
        "recorded_extremes": _extremes(root.group(EXTREMES), scene, arrays) if EXTREMES in root else None,
    }


def _scene(root: StoredGroup, about: dict[str, Attribute], arrays: Arrays) -> BuildingScene:
    text, group = str(about["scene"]), root.group(GROUP)
    table = toml_table(text)
    sizes = shapes(group.rows("mass"), len(table.get("node", [])), len(table.get("column", [])))
    matrices = {name: group.array(name, shape) for name, shape in sizes.items()}
    arrays |= {f"{GROUP}/{name}": values for name, values in matrices.items()}
    motions = []
    for index in range(int(table.get("grounds", 1))):
        motion, pieces, motion_about = motion_in(root, ground_name(index))
        arrays |= pieces
        about |= motion_about
        motions.append(motion)
    return scene_from(text, matrices, motions)


def _extremes(group: StoredGroup, scene: BuildingScene, arrays: Arrays) -> BuildingExtremes:
    extremes = {name: group.array(name, shape) for name, shape in shapes_of_extremes(scene).items()}
    arrays |= {f"{EXTREMES}/{name}": values for name, values in extremes.items()}
    return BuildingExtremes(**extremes)


def _rows(root: StoredGroup, scene: BuildingScene, arrays: Arrays) -> dict[str, Any]:
    """The rows by the names that `BuildingResult` has for them. Raises ValueError where they are not finite."""
    count, bearings = root.length("time"), len(scene.bearings)
    surfaces = np.array([one.bearing.layout.surfaces for one in scene.bearings])
    sizes = {"coordinate": len(scene.building.mass), "axis": 3, "bearing": bearings, "surface": int(surfaces.max())}
    more = {"ground": (3, 3), "wrench": (bearings, 2, 6), "support": (bearings, 3, 3)}  # shapes of fields of several
    rows = {"time": root.array("time", (count,), compressed=False)}
    arrays["time"] = rows["time"]
    for name, (dims, field, part, *_) in STORED.items():
        arrays[name] = values = root.array(name, (count, *(sizes[dim] for dim in dims)))
        if field not in more:
            rows[field] = values
        else:
            rows.setdefault(field, np.empty((count, *more[field])))[part] = values
    missing = np.arange(sizes["surface"]) >= surfaces[:, None]  # a bearing has no such surface
    for field, values in rows.items():
        unknown = missing if field in OF_SURFACES else False
        if not (np.isfinite(values) | unknown).all():
            raise ValueError(f"{field} is not finite")
    return rows


def columns_of(result: ResultFiles) -> dict[str, Array]:
    """Name -> values of every column of an exported table, shape (k,), SI units: `node_acceleration_floor_2_u1`."""
    return {column.name: column.values for column in table_of(result.dataset)}


def column_names(scene: BuildingScene) -> tuple[str, ...]:
    """Names of the columns that a run of the scene has."""
    labels, names = _labels(scene), ["time"]
    surfaces = {number: one.bearing.layout.surfaces for number, one in enumerate(scene.bearings, start=1)}
    table: dict[str, Stored | Derived] = {**STORED, **DERIVED}
    for name, variable in table.items():
        for index in product(*(labels[dim] for dim in variable.dims)):
            if variable.dims != SURFACE or index[1] <= surfaces[index[0]]:
                names.append("_".join([name, *map(str, index)]).replace(" ", "_"))
    return tuple(names)
