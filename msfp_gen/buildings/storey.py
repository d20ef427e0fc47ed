"""A frame with rigid diaphragms: base slab and storeys come in; mass, stiffness, nodes and columns go out.

The soil below a bearing is here too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Quantity, check_fields, require_type
from msfp_gen.scene.top import NodeTop

HIGHEST = 1000.0  # height of a storey, at most [m]
FREEDOMS = 6  # of a node: displacements along E1, E2, E3 and rotations about them
MOTIONS = ("translation along E1", "translation along E2", "translation along E3",
           "rotation about E1", "rotation about E2", "rotation about E3")  # fmt: skip


@dataclass(frozen=True, eq=False)
class Node:
    """A point of a building.

    name: a label. position: in plan, and height above the nodes of the bearings, ndarray, shape (3,), [m]. rows:
    ndarray, shape (6, n); times the n coordinates of the building they are displacements [m] and rotations [rad] of the
    node. carries: whether bearings may be attached to the node. floor: whether it is the centre of mass of a rigid
    floor, which has corners.
    """

    name: str
    position: Array
    rows: Array
    carries: bool = False
    floor: bool = False

    def linked(self, position: ArrayLike) -> Array:
        """Rows of a point that a rigid link connects to the node, shape (6, n) [SI]. position: of the point [m]."""
        moved: Array = rigid(np.asarray(position, dtype=float) - self.position) @ self.rows
        return moved


def rigid(arm: ArrayLike) -> Array:
    """The matrix from the six motions of a point A of a rigid body to B's: ndarray, shape (6, 6), [SI].

    For small rotations. arm: from A to B, shape (3,) [m].
    """
    x, y, z = np.asarray(arm, dtype=float)
    motion = np.eye(FREEDOMS)
    motion[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return motion


_POINT = Quantity("m", shape=(2,))
_INERTIA = Quantity("kg m^2", above=0.0, shape=(3,))
Pair = tuple[float, float]
Triple = tuple[float, float, float]
_OWN = [0, 1, 5]  # freedoms of a floor on columns that do not shorten; the others follow the floor below


@dataclass(frozen=True)
class BaseSlab:
    """The slab above the bearings, a rigid body to which they are attached.

    mass [kg]. inertia: about E1, E2 and E3 through the centre of mass [kg m^2]. mass_centre: in plan [m]. Raises
    InputError.
    """

    mass: Annotated[float, Quantity("kg", above=0.0)]
    inertia: Annotated[Triple, _INERTIA]
    mass_centre: Annotated[Pair, _POINT] = (0.0, 0.0)

    def __post_init__(self) -> None:
        check_fields(self, "base")


@dataclass(frozen=True)
class Storey:
    """A floor and the columns that carry it, which act as springs at half height between rigid floors.

    height: from the floor below [m]. mass, inertia, mass_centre: of the floor, as in `BaseSlab`. stiffness: of all
    columns along E1 and E2, of a column with fixed ends 12 E I/h^3; one number for both directions [N/m].
    torsional_stiffness: about E3 through the stiffness centre [N m/rad]. stiffness_centre: in plan [m].
    vertical_stiffness: of columns that shorten [N/m]. rocking_stiffness: of the same columns about E1 and E2
    [N m/rad]. None for both: in vertical motion and tilt the floor follows the floor below. Raises InputError.
    """

    height: Annotated[float, Quantity("m", above=0.0)]
    mass: Annotated[float, Quantity("kg", above=0.0)]
    inertia: Annotated[Triple, _INERTIA]
    stiffness: Annotated[Pair | float, Quantity("N/m", above=0.0, shape=(2,), pair=True)]
    torsional_stiffness: Annotated[float, Quantity("N m/rad", above=0.0)]
    mass_centre: Annotated[Pair, _POINT] = (0.0, 0.0)
    stiffness_centre: Annotated[Pair, _POINT] = (0.0, 0.0)
    vertical_stiffness: Annotated[float | None, Quantity("N/m", above=0.0)] = None
    rocking_stiffness: Annotated[Pair | float | None, Quantity("N m/rad", above=0.0, shape=(2,), pair=True)] = None

    def __post_init__(self) -> None:
        check_fields(self, "storey")
        if self.height >= HIGHEST:
            raise InputError(f"storey.height = {self.height:g} m: no storey is as high; is it in mm? Give it in m")
        if (self.vertical_stiffness is None) != (self.rocking_stiffness is None):
            stated, other = ("vertical_stiffness", "rocking_stiffness")
            stated, other = (stated, other) if self.rocking_stiffness is None else (other, stated)
            raise InputError(
                f"storey.{stated} = {getattr(self, stated)!r}: columns that shorten let the floor sink and tilt; give "
                f"storey.{other} as well"
            )

    @property
    def springs(self) -> Array:
        """Stiffness of the columns along [N/m] and about [N m] E1, E2, E3, shape (6,); 0 for columns that are rigid."""
        k1, k2 = self.stiffness  # type: ignore[misc]  # a pair after the check
        r1, r2 = self.rocking_stiffness or (0.0, 0.0)  # type: ignore[misc]
        return np.array([k1, k2, self.vertical_stiffness or 0.0, r1, r2, self.torsional_stiffness])


class StoreyColumns(NamedTuple):
    """Deformation and force of the columns of a storey, at half height at the stiffness centre.

    deformation: rows, shape (6, n) [SI]; times the coordinates they are the motion of the floor above relative to the
    floor below, both extended rigidly. inertia: rows, shape (6, n) [SI]; times the accelerations they are the force and
    moment that accelerate all floors above.
    """

    name: str
    deformation: Array
    inertia: Array


def frame(
    base: BaseSlab, storeys: Sequence[Storey]
) -> tuple[Array, Array, tuple[Node, ...], tuple[StoreyColumns, ...]]:
    """Mass and stiffness of an undamped frame, both shape (n, n) [SI], its floors from the base upwards, and columns.

    The coordinates are motions of the floors at the origin of the plan; the nodes are at their centres of mass.
    """
    nodes = _floors(storeys)
    floors: list[BaseSlab | Storey] = [base, *storeys]
    inertias = [_inertia(node, floor) for node, floor in zip(nodes, floors, strict=True)]
    columns = tuple(_columns(nodes, inertias, index, storey) for index, storey in enumerate(storeys, 1))
    mass = sum((node.rows.T @ inertia for node, inertia in zip(nodes, inertias, strict=True)), np.zeros(1))
    stiffness = np.zeros_like(mass)
    for storey, column in zip(storeys, columns, strict=True):
        stiffness += column.deformation.T * storey.springs @ column.deformation
    return mass, stiffness, tuple(map(_at_mass_centre, nodes, floors)), columns


def _at_mass_centre(node: Node, floor: BaseSlab | Storey) -> Node:
    """The node of a floor at its centre of mass. node: at the origin of the plan."""
    position = np.array([*floor.mass_centre, node.position[2]])
    return replace(node, position=position, rows=node.linked(position), floor=True)


def _inertia(node: Node, floor: BaseSlab | Storey) -> Array:
    """Rows, shape (6, n) [SI]; times the accelerations they are force and moment about the node on its floor."""
    arm = rigid([*floor.mass_centre, 0.0])
    rows: Array = arm.T * [*3 * [floor.mass], *floor.inertia] @ arm @ node.rows
    return rows


def _floors(storeys: Sequence[Storey]) -> tuple[Node, ...]:
    """The nodes of the base and of all floors, at the origin of the plan."""
    sizes = [FREEDOMS, *(len(_OWN) if storey.vertical_stiffness is None else FREEDOMS for storey in storeys)]
    ends = np.cumsum(sizes)
    unit_rows = np.eye(ends[-1])
    nodes = [Node("base", np.zeros(3), unit_rows[:FREEDOMS], carries=True)]
    height = 0.0
    for index, (storey, end, size) in enumerate(zip(storeys, ends[1:], sizes[1:], strict=True), 1):
        height += storey.height
        position = np.array([0.0, 0.0, height])
        rows = nodes[-1].linked(position)
        rows[_OWN if size < FREEDOMS else slice(None)] = unit_rows[end - size : end]
        nodes.append(Node(f"floor {index}", position, rows))
    return tuple(nodes)


def _columns(nodes: Sequence[Node], inertias: Sequence[Array], index: int, storey: Storey) -> StoreyColumns:
    """The columns of a storey by its index, from 1. inertias: of all floors; see `_inertia`."""
    below, floor = nodes[index - 1], nodes[index]
    point = np.array([*storey.stiffness_centre, (below.position[2] + floor.position[2]) / 2])
    inertia = np.zeros_like(floor.rows)
    for node, of_floor in zip(nodes[index:], inertias[index:], strict=True):
        inertia += rigid(node.position - point).T @ of_floor
    return StoreyColumns(f"storey {index}", floor.linked(point) - below.linked(point), inertia)


# Field of `Soil` that is not modelled -> reason and remedy.
REFUSED = {
    "rotational_stiffness": "the lower plate of a bearing does not tilt with its foundation; leave it out: a building "
    "rocks on the vertical springs below its bearings",
    "mass": "a foundation between soil and bearing has no inertia; leave it out, or compute its motion elsewhere and "
    "give that as the motion of the bearings",
}


@dataclass(frozen=True)
class Soil:
    """Springs and dampers of the soil below one bearing, along E1 and E2, and along E3.

    stiffness, vertical_stiffness [N/m]; damping, vertical_damping [N s/m]. rotational_stiffness [N m/rad] and mass of a
    foundation [kg] are not modelled: giving them raises InputError, which says why.
    """

    stiffness: Annotated[float, Quantity("N/m", above=0.0)]
    vertical_stiffness: Annotated[float, Quantity("N/m", above=0.0)]
    damping: Annotated[float, Quantity("N s/m", least=0.0)] = 0.0
    vertical_damping: Annotated[float, Quantity("N s/m", least=0.0)] = 0.0
    rotational_stiffness: Annotated[float | None, Quantity("N m/rad", above=0.0)] = None
    mass: Annotated[float | None, Quantity("kg", above=0.0)] = None

    def __post_init__(self) -> None:
        check_fields(self, "soil")
        for name, reason in REFUSED.items():
            if (value := getattr(self, name)) is not None:
                raise InputError(f"soil.{name} = {value:g}: {reason}")

    def below(self, interface: NodeTop) -> NodeTop:
        """The interface of a bearing on this soil: interface and soil in series.

        A bearing is light beside the load that it carries, so that the same force passes through interface and soil, in
        either order. The damping gives the energy that the two lose in slow motion; it is exact where damping over
        stiffness is equal in both. Raises InputError.
        """
        require_type(interface, NodeTop, "interface")
        along = _in_series(interface.stiffness, interface.damping, self.stiffness, self.damping)
        upright = _in_series(
            interface.vertical_stiffness, interface.vertical_damping, self.vertical_stiffness, self.vertical_damping
        )
        return replace(
            interface,
            stiffness=along[0],
            damping=along[1],
            vertical_stiffness=upright[0],
            vertical_damping=upright[1],
        )


def _in_series(k1: float, c1: float, k2: float, c2: float) -> tuple[float, float]:
    """Stiffness and damping of two springs in series, each with a damper in parallel; to first order in frequency."""
    stiffness = k1 / (1 + k1 / k2)
    return stiffness, c1 * (stiffness / k1) ** 2 + c2 * (stiffness / k2) ** 2
