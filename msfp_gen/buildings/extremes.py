"""Extremes of a building over all steps of its run, whatever the times of the rows.

The scene gives the vectors whose peaks the compiled run keeps; its numbers become `BuildingExtremes`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, get_type_hints

import numpy as np

from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.arrays import Array, Flags, parts
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.friction_parameters import start_temperatures

Shapes = list[tuple[str, tuple[int, ...]]]  # names and shapes of consecutive numbers
CORNERS = 4  # of the plan
OF_SURFACES = ("sliding", "rim_force", "lift", "temperature")  # quantities of surfaces whose largest value is kept
VECTOR = 4  # numbers for a vector: largest magnitudes along E1, E2, E3 and in the horizontal plane
# Dimension -> size, where it is equal in all buildings.
SIZES = {"peak": VECTOR, "whole": 1, "kind": 2, "end": 2, "order": 3}
# Arrays with their dimensions in a file.
Peaks = Annotated[Array, ("peak",)]
Single = Annotated[Array, ("whole",)]
OfNodes = Annotated[Array, ("node", "peak")]
OfStoreys = Annotated[Array, ("storey", "peak")]
OfBearings = Annotated[Array, ("bearing", "peak")]
OfSurfaces = Annotated[Array, ("bearing", "surface")]


@dataclass(frozen=True, eq=False)
class BuildingExtremes:
    """Extremes of the run of a building.

    Vectors, shape (..., 4), with the largest magnitudes along E1, E2, E3 and in the horizontal plane: node_acceleration
    [m/s^2] and node_displacement relative to the ground [m], of a floor at its centre of mass; corner_acceleration and
    corner_displacement, the largest at the corners of the plan on this floor (where the node is no floor, of the node);
    drift of the storeys at the stiffness centre, corner_drift, the largest at the corners of the plan, and
    mean_displacement of the bearings [m]; overturning_moment, about
    E1 and E2 [N m]; storey_shear, base_reaction and top_force of the bearings [N]; bearing_displacement, base less top
    [m].

    Largest magnitudes: storey_torsion, shape (storeys,), base_torsion, shape (1,) [N m]; base_twist, shape (1,) [rad];
    energy: kinetic and strain energy, shape (2,) [J].

    Least and largest value: axial_force, shape (bearings, 2) [N]; normal_force, shape (bearings, 2, surfaces) [N].

    Largest value, shape (bearings, surfaces): sliding [m], rim_force [N], lift, the clearance between separated faces
    [m], temperature [degC], and, in models without uplift, contact_offset of a loaded contact from the axis of its
    slider [m]. Bearings with fewer surfaces than another have zeros in place of the missing ones. rims_met, shape
    (bearings,): the largest number of rims that are met at one time.

    times: name of each -> when every number was reached first [s], in its shape.
    """

    node_acceleration: OfNodes
    node_displacement: OfNodes
    corner_acceleration: OfNodes
    corner_displacement: OfNodes
    drift: OfStoreys
    corner_drift: OfStoreys
    storey_shear: OfStoreys
    storey_torsion: Annotated[Array, ("storey",)]
    base_twist: Single
    mean_displacement: Peaks
    overturning_moment: Peaks
    base_reaction: Peaks
    base_torsion: Single
    energy: Annotated[Array, ("kind",)]
    bearing_displacement: OfBearings
    top_force: OfBearings
    axial_force: Annotated[Array, ("bearing", "end")]
    sliding: OfSurfaces
    rim_force: OfSurfaces
    lift: OfSurfaces
    temperature: OfSurfaces
    contact_offset: OfSurfaces
    normal_force: Annotated[Array, ("bearing", "end", "surface")]
    rims_met: Annotated[Array, ("bearing",)]
    times: Mapping[str, Array]

    @classmethod
    def of_run(cls, scene: BuildingScene, recorded: Array, kept: Sequence[Shapes]) -> BuildingExtremes:
        """Extremes from the numbers of a compiled run and their times (`msfp_building.h`), shape (2, peaks).

        kept: names and shapes for each bearing.
        """
        floors = np.array([node.floor for node in scene.building.nodes], dtype=bool)
        shapes = _recorded(len(floors), len(scene.building.columns), int(floors.sum()))
        for i, (bearing, numbers) in enumerate(zip(scene.every_bearing, kept, strict=True)):
            shapes += [(f"displacement {i}", (VECTOR,)), (f"force {i}", (VECTOR,)), (f"axial {i}", (2,))]
            shapes += [(f"{word} {name} {i}", shape) for word in ("least", "most") for name, shape in numbers]
            shapes += [(f"contact {i}", (bearing.layout.surfaces,)), (f"met {i}", (1,))]
        values, times = (parts(each, shapes) for each in recorded)
        for i, bearing in enumerate(scene.every_bearing):
            values[f"contact {i}"] = values[f"contact {i}"] * bearing.arrays()["radius"]
            values[f"least compression {i}"] = lift_of(values[f"least compression {i}"])
            values[f"most temperature {i}"] = temperature_of(bearing, values[f"most temperature {i}"])
        return cls(**_arranged(values, values, floors, len(kept)), times=_arranged(times, values, floors, len(kept)))


def _recorded(nodes: int, storeys: int, floors: int) -> Shapes:
    """Names and shapes of what a compiled run records of the building, in its order."""
    counts = {
        "node_acceleration": nodes,
        "node_displacement": nodes,
        "drift": storeys,
        "storey_shear": storeys,
        "torsion": storeys,
        "twist": 1,
        "mean": 1,
        "overturning": 1,
        "corner": CORNERS * storeys,
        "floor_acceleration": CORNERS * floors,
        "floor_displacement": CORNERS * floors,
        "base": 1,
    }
    return [*((name, (count, VECTOR)) for name, count in counts.items()), ("base_torsion", (1,)), ("energy", (2,))]


def _of_corners(name: str, of: Mapping[str, Array], values: Mapping[str, Array]) -> Array:
    """Of the corners of each floor the largest of `values`, or what `of` has there, shape (floors, 4)."""
    size, each = values[name].reshape(-1, CORNERS, VECTOR), of[name].reshape(-1, CORNERS, VECTOR)
    found: Array = np.take_along_axis(each, size.argmax(axis=1)[:, None], axis=1)[:, 0]
    return found


def _arranged(of: Mapping[str, Array], values: Mapping[str, Array], floors: Flags, bearings: int) -> dict[str, Array]:
    """The fields of `BuildingExtremes` from the values by name, or from their times. floors: which nodes are floors."""

    def of_bearings(name: str) -> list[Array]:
        return [of[f"{name} {i}"] for i in range(bearings)]

    corners = {}
    for name in ("acceleration", "displacement"):
        corners[f"corner_{name}"] = of[f"node_{name}"].copy()
        corners[f"corner_{name}"][floors] = _of_corners(f"floor_{name}", of, values)
    return {
        **{name: of[name] for name in ("node_acceleration", "node_displacement", "drift", "storey_shear")},
        **corners,
        "corner_drift": _of_corners("corner", of, values),
        "storey_torsion": of["torsion"][:, 2],
        "base_twist": of["twist"][:, 2],
        "mean_displacement": of["mean"][0],
        "overturning_moment": of["overturning"][0],
        "base_reaction": of["base"][0],
        "base_torsion": of["base_torsion"],
        "energy": of["energy"],
        "bearing_displacement": np.array(of_bearings("displacement")),
        "top_force": np.array(of_bearings("force")),
        "axial_force": np.array(of_bearings("axial")),
        "sliding": padded(of_bearings("most sliding")),
        "rim_force": padded(of_bearings("most rim")),
        "lift": padded(of_bearings("least compression")),
        "contact_offset": padded(of_bearings("contact")),
        "temperature": padded(of_bearings("most temperature")),
        "normal_force": np.stack([padded(of_bearings(f"{word} normal")) for word in ("least", "most")], axis=1),
        "rims_met": np.concatenate(of_bearings("met")),
    }


DIMENSIONS = {
    name: hint.__metadata__[0]
    for name, hint in get_type_hints(BuildingExtremes, include_extras=True).items()
    if name != "times"
}


def vectors(scene: BuildingScene) -> tuple[list[int], Array, Array]:
    """The vectors of a building whose peaks the compiled run keeps, in the order of `BuildingExtremes.of_run`.

    A vector is its rows times a derivative of the coordinates, less shares of the motions of the ground. Returns the
    orders of the derivatives; the rows, shape (vectors, 3, n) [SI]; and the shares, shape (vectors, grounds) [-].
    """
    building, size = scene.building, len(scene.building.mass)
    grounds, ground_of = scene.grounds
    none = np.zeros(len(grounds))
    first, mean = none.copy(), np.bincount(ground_of, minlength=len(grounds)) / len(ground_of)
    first[0] = 1.0
    zeros = np.zeros((3, size))

    def about_e3(row: Array) -> Array:
        return np.vstack([zeros[:2], row])

    entries = [(2, node.rows[:3], none) for node in building.nodes]
    entries += [(0, node.rows[:3], first) for node in building.nodes]
    entries += [(0, columns.deformation[:3], none) for columns in building.columns]
    entries += [(2, columns.inertia[:3], none) for columns in building.columns]
    entries += [(2, about_e3(columns.inertia[5]), none) for columns in building.columns]
    entries.append((0, about_e3(building.node(scene.bearings[0].node).rows[5]), none))
    entries.append((0, scene.attachments[:, :3].mean(axis=0), mean))
    entries.append((2, np.vstack([overturning(scene), zeros[:1]]), none))
    entries += [(0, rows, none) for rows in corners(scene).reshape(-1, 3, size)]
    of_floors = [
        node.linked(point)[:3] for node in building.nodes if node.floor for point in corner_points(scene, node.position)
    ]
    entries += [(2, rows, none) for rows in of_floors]
    entries += [(0, rows, first) for rows in of_floors]
    orders, rows, shares = zip(*entries, strict=True)
    return list(orders), np.stack(rows), np.stack(shares)


def overturning(scene: BuildingScene) -> Array:
    """Rows of the overturning moment about E1 and E2, shape (2, n) [SI], to be multiplied by the accelerations.

    The moment accelerates the building; it is about its centre of mass in plan, at height 0. The bearings provide it,
    by horizontal forces at their height and by axial forces beyond the loads at rest.
    """
    force = (scene.building.mass @ scene.building.rigid_motions).T
    x, y = scene.mass_centre
    return np.stack([force[3] - y * force[2], force[4] + x * force[2]])


def corners(scene: BuildingScene) -> Array:
    """Rows of the drift of each storey at the corners of the rectangle around the bearings, (storeys, 4, 3, n) [SI]."""
    nodes, size = scene.building.nodes, len(scene.building.mass)
    rows = [
        above.linked(point)[:3] - below.linked(point)[:3]
        for below, above, _ in zip(nodes, nodes[1:], scene.building.columns, strict=False)
        for point in corner_points(scene, (below.position + above.position) / 2)
    ]
    return np.reshape(rows, (-1, CORNERS, 3, size))


def corner_points(scene: BuildingScene, position: Array) -> Array:
    """Corners of the plan at the height of a position [m]: of the rectangle around the bearings, shape (4, 3) [m].

    They are counterclockwise from the corner with the least coordinates.
    """
    (west, south), (east, north) = scene.places.min(axis=0), scene.places.max(axis=0)
    plan = [(west, south), (east, south), (east, north), (west, north)]
    return np.array([[*corner, position[2]] for corner in plan])


def lift_of(compression: Array) -> Array:
    """Clearance between separated faces from the compression of unilateral contacts, shape (..., surfaces) [m]."""
    opening: Array = np.maximum(0.0, -compression) + 0.0  # no -0.0
    return opening


def temperature_of(bearing: Bearing, recorded: Array) -> Array:
    """Temperatures at the centres of surfaces, shape (..., surfaces) [degC].

    recorded: of the run; 0 where the model has no temperature, which is then the temperature at the start.
    """
    return np.where(recorded == 0.0, start_temperatures(bearing), recorded)


def heated(bearing: Bearing, temperature: Array) -> Array | None:
    """The temperatures of surfaces, shape (..., surfaces) [degC]; None where no surface was heated."""
    return temperature if (temperature > start_temperatures(bearing)).any() else None


def padded(columns: Sequence[Array], fill: float = 0.0) -> Array:
    """Values of all bearings in one array, shape (..., bearings, most surfaces) [unit of `columns`].

    columns: of each bearing, shape (..., surfaces). fill: value where a bearing has no such surface.
    """
    most = max(values.shape[-1] for values in columns)
    table = np.full((*columns[0].shape[:-1], len(columns), most), fill)
    for index, values in enumerate(columns):
        table[..., index, : values.shape[-1]] = values
    return table
