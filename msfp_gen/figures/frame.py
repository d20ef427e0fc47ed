"""The frame of a building in motion: magnified places of its floors, columns and bearings."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from msfp_gen.common.arrays import Array

if TYPE_CHECKING:
    from msfp_gen.buildings.result import BuildingResult
    from msfp_gen.buildings.scene import BuildingScene

EDGE = 0.06  # of a floor beyond the outermost bearings, over the size of the plan
DEPTH = 0.05  # height of a bearing in a drawing over the size of the building
NOTHING = 0.01  # of the load at rest: what is left is the mass of plates and sliders


def plan_of(scene: BuildingScene) -> tuple[Array, Array]:
    """Corners of the floors, shape (2,) each [m]: the outermost bearings and an edge."""
    low, high = scene.places.min(axis=0), scene.places.max(axis=0)
    edge = max(EDGE * float(np.linalg.norm(high - low)), 1.0)
    return low - edge, high + edge


def height_of(scene: BuildingScene) -> float:
    """Height of the highest node [m]."""
    return max(float(node.position[2]) for node in scene.building.nodes)


def size_of(scene: BuildingScene) -> float:
    """Diagonal of plan and height [m]."""
    low, high = plan_of(scene)
    return float(np.hypot(np.linalg.norm(high - low), height_of(scene)))


def level_of(scene: BuildingScene, index: int) -> float:
    """Height of the upper end of a bearing [m]."""
    return float(scene.building.node(scene.bearings[index].node).position[2])


class MovingFrame:
    """Places of the parts of a building relative to the ground of its scene, at the k times of a result.

    Displacements are `factor` times as large as the frame; rotations are small, so both follow the same line.
    """

    def __init__(self, result: BuildingResult, factor: float) -> None:
        self.result, self.factor = result, factor
        scene = self.scene = result.scene
        self.depth = DEPTH * size_of(scene)
        self.upper_ends = np.array([[*place, level_of(scene, i)] for i, place in enumerate(scene.places)])  # at rest

    def points(self, node: int, at: Array) -> Array:
        """Points that move with a node, shape (k, p, 3) [m]; at: where they are at rest, shape (p, 3) [m]."""
        position = self.scene.building.nodes[node]
        motion = self.result.node(position.name)[:, 0]
        turned = np.cross(motion[:, None, 3:], at - position.position)
        points: Array = at + self.factor * (motion[:, None, :3] - self.result.ground[:, None, 0] + turned)
        return points

    @cached_property
    def floors(self) -> Array:
        """Corners of the floors, shape (k, nodes, 4, 3) [m]."""
        (x0, y0), (x1, y1) = plan_of(self.scene)
        plan = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
        heights = [float(node.position[2]) for node in self.scene.building.nodes]
        corners = [self.points(i, np.column_stack([plan, np.full(4, z)])) for i, z in enumerate(heights)]
        return np.stack(corners, axis=1)

    @cached_property
    def nodes(self) -> Array:
        """The nodes, shape (k, nodes, 3) [m]."""
        positions = [self.points(i, node.position[None]) for i, node in enumerate(self.scene.building.nodes)]
        return np.concatenate(positions, axis=1)

    @cached_property
    def members(self) -> Array:
        """Both ends of the columns of a shear frame, above every bearing; of any other building the rigid links from
        its nodes to the bearings: shape (k, members, 2, 3) [m].
        """
        building = self.scene.building
        if not building.columns:
            names = [node.name for node in building.nodes]
            links = [names.index(bearing.node) for bearing in self.scene.bearings]
            return np.stack([self.nodes[:, links], self.uppers], axis=2)
        ends = []
        for index in range(len(building.columns)):
            heights = [float(building.nodes[k].position[2]) for k in (index, index + 1)]
            at = [np.column_stack([self.scene.places, np.full(len(self.scene.places), z)]) for z in heights]
            ends.append(np.stack([self.points(index, at[0]), self.points(index + 1, at[1])], axis=2))
        return np.concatenate(ends, axis=1)

    @cached_property
    def lowers(self) -> Array:
        """Lower ends of the bearings, shape (k, bearings, 3) [m]; they move where they have a ground of their own."""
        below = self.upper_ends - [0.0, 0.0, self.depth]
        positions: Array = below + self.factor * (self.result.support[:, :, 0] - self.result.ground[:, None, 0])
        return positions

    @cached_property
    def uppers(self) -> Array:
        """Upper ends of the bearings, shape (k, bearings, 3) [m]."""
        rows = self.scene.attachments[:, :3]
        moved = np.einsum("bin,kn->kbi", rows, self.result.displacement) - self.result.ground[:, None, 0]
        positions: Array = self.upper_ends + self.factor * moved
        return positions

    @cached_property
    def on_rim(self) -> NDArray[np.bool_]:
        """Whether a slider of each bearing touches its rim, shape (k, bearings)."""
        return np.stack([(bearing.history.gap <= 0).any(axis=1) for bearing in self.result.bearings], axis=1)

    @cached_property
    def lifted(self) -> NDArray[np.bool_]:
        """Whether each bearing carries less than `NOTHING` of its load at rest, shape (k, bearings)."""
        lifted: NDArray[np.bool_] = self.result.axial_force < NOTHING * self.scene.axial_loads
        return lifted
