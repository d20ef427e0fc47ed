"""`Node`: a point of a building with its six motions, and the kinematics of rigid bodies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array

FREEDOMS = 6  # of a node: displacements along E1, E2, E3 and rotations about them
MOTIONS = ("translation along E1", "translation along E2", "translation along E3",
           "rotation about E1", "rotation about E2", "rotation about E3")  # fmt: skip


@dataclass(frozen=True, eq=False)
class Node:
    """A point of a building.

    name: a label. position: ndarray, shape (3,), [m]: in plan, and height above the nodes of the bearings. rows:
    ndarray, shape (6, n): displacements [m] and rotations [rad] of the node from the n coordinates of the building.
    carries: whether bearings may be attached to the node.
    """

    name: str
    position: Array
    rows: Array
    carries: bool = False

    def linked(self, position: ArrayLike) -> Array:
        """Motion of a point [m] that a rigid link connects to the node: rows as those of the node, shape (6, n)."""
        moved: Array = rigid(np.asarray(position, dtype=float) - self.position) @ self.rows
        return moved


def rigid(arm: ArrayLike) -> Array:
    """Six motions of a point of a rigid body from those of another, for small rotations: ndarray, shape (6, 6).

    arm: from the latter point to the former, shape (3,) [m].
    """
    x, y, z = np.asarray(arm, dtype=float)
    motion = np.eye(FREEDOMS)
    motion[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return motion
