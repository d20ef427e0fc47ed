"""`BuildingResult`: what the run of a building gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from msfp_gen.buildings.compiled_run import BuildingRun, unpacked
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.arrays import Array
from msfp_gen.coupling.response import DISSIPATED
from msfp_gen.specification.contract import WORKS, names


@dataclass(frozen=True, eq=False)
class BuildingResult:
    """Motion of a building, and forces and sliding of its bearings, at k times.

    time: ndarray, shape (k,) [s]. displacement, velocity, acceleration: of the coordinates, shape (k, n), relative to
    the place at rest, in axes that do not move with the ground: accelerations are absolute. ground: displacement,
    velocity and acceleration of the ground, shape (k, 3, 3) [m]. support: of the ground below each bearing, shape
    (k, bearings, 3, 3). wrench: force and moment that the lower and the upper end of each bearing exert on it, shape
    (k, bearings, 2, 6) [N], [N m]. normal_force, sliding: of the surfaces of each bearing, a list of arrays of shape
    (k, n-1) [N], [m]. Energies, shape (k,) or (k, bearings) [J]: dissipated: in each bearing; stored: in each bearing,
    with the springs of its interface; damped: by the damping of the building; received: work of the bearings on the
    building, by their forces beyond those at rest; input: work of the ground. counts: of the run.
    """

    scene: BuildingScene
    time: Array
    displacement: Array
    velocity: Array
    acceleration: Array
    ground: Array
    wrench: Array
    normal_force: list[Array]
    sliding: list[Array]
    dissipated: Array
    stored: Array
    damped: Array
    received: Array
    input: Array
    support: Array
    counts: dict[str, int]

    def node(self, name: str) -> Array:
        """Displacement, velocity and acceleration of a node: ndarray, shape (k, 3, 6), [m], [rad] and per s, s^2."""
        rows = self.scene.building.node(name).rows
        return np.stack([each @ rows.T for each in (self.displacement, self.velocity, self.acceleration)], axis=1)

    @property
    def bearing_displacement(self) -> Array:
        """Displacement of the upper end of each bearing relative to the ground, shape (k, bearings, 3) [m]."""
        upper: Array = np.einsum("bin,kn->kbi", self.scene.attachments[:, :3], self.displacement)
        return upper - self.support[:, :, 0]

    @property
    def axial_force(self) -> Array:
        """Compression between the building and each bearing, shape (k, bearings) [N]."""
        return -self.wrench[:, :, 1, 2]

    @property
    def drift(self) -> Array:
        """Deformation of the columns of each storey, along and about E1, E2, E3, shape (k, storeys, 6) [m], [rad]."""
        rows = np.array([each.deformation for each in self.scene.building.columns]).reshape(-1, 6, self._size)
        found: Array = np.einsum("sin,kn->ksi", rows, self.displacement)
        return found

    @property
    def storey_force(self) -> Array:
        """Force and moment that accelerate the floors above, at half height of each storey, shape (k, storeys, 6).

        [N], [N m]; the first two are the storey shears. Weights are not included.
        """
        rows = np.array([each.inertia for each in self.scene.building.columns]).reshape(-1, 6, self._size)
        found: Array = np.einsum("sin,kn->ksi", rows, self.acceleration)
        return found

    @property
    def base_reaction(self) -> Array:
        """Sum of the forces that the ground exerts on the bearings, shape (k, 3) [N]."""
        forces: Array = self.wrench[:, :, 0, :3].sum(axis=1)
        return forces

    @property
    def kinetic(self) -> Array:
        """Kinetic energy of the building, shape (k,) [J]."""
        return 0.5 * _squares(self.velocity, self.scene.building.mass)

    @property
    def strain(self) -> Array:
        """Energy of deformation of the building, from the place at rest, shape (k,) [J]."""
        return 0.5 * _squares(self.displacement, self.scene.building.stiffness)

    @property
    def _size(self) -> int:
        return len(self.scene.building.mass)


def _squares(rows: Array, matrix: Array) -> Array:
    """x^T A x of every row x, shape (k,)."""
    found: Array = ((rows @ matrix) * rows).sum(axis=1)
    return found


def result_of(run: BuildingRun) -> BuildingResult:
    """The rows of a run until now."""
    rows = unpacked(run)
    count = len(run.ports)
    works = [dict(zip(names(WORKS), rows[f"work {i}"].T, strict=True)) for i in range(count)]
    return BuildingResult(
        scene=run.scene,
        time=rows["time"],
        displacement=rows["displacement"],
        velocity=rows["velocity"],
        acceleration=rows["acceleration"],
        ground=rows["ground"][:, 0],
        wrench=np.stack([rows[f"wrench {i}"] for i in range(count)], axis=1),
        normal_force=[rows[f"normal {i}"] for i in range(count)],
        sliding=[rows[f"sliding {i}"] for i in range(count)],
        dissipated=np.stack([sum((work[name] for name in DISSIPATED), np.zeros(1)) for work in works], axis=1),
        stored=np.stack([_stored(run, rows, i) + works[i]["friction_stored"] for i in range(count)], axis=1),
        damped=rows["damped"],
        received=rows["received"],
        input=rows["input"],
        support=rows["ground"][:, run.scene.grounds[1]],
        counts=run.run.counts,
    )


def _stored(run: BuildingRun, rows: dict[str, Array], index: int) -> Array:
    """Energy of a bearing and of the springs of its interface, less that in friction, shape (k,) [J]."""
    upper, interface = rows[f"wrench {index}"][:, 1], run.scene.bearings[index].interface
    stiffness = [interface.stiffness, interface.stiffness, interface.vertical_stiffness]
    stiffness += 2 * [interface.rotational_stiffness]
    found: Array = 0.5 * (upper[:, :5] ** 2 / stiffness).sum(axis=1)
    for name in ("kinetic", "potential", "rim_stored", "seat_stored"):
        found = found + rows[f"{name} {index}"]
    return found
