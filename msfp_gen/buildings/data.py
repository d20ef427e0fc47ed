"""`BuildingData`: the rows of a building and what follows from them."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.buildings.peaks import Peaks, along_time, padded
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.arrays import Array
from msfp_gen.common.identity import fingerprint
from msfp_gen.results.note import Note
from msfp_gen.results.resample import checked_times, interpolated

B = TypeVar("B", bound="BuildingData")


@dataclass(frozen=True, eq=False, repr=False)
class BuildingData:
    """Motion of a building, and forces and sliding of its bearings, at k times. `BuildingResult` adds files.

    time: ndarray, shape (k,) [s]. displacement, velocity, acceleration: of the coordinates, shape (k, n), relative to
    the place at rest, in axes that do not move with the ground: accelerations are absolute. ground: displacement,
    velocity and acceleration of the ground, shape (k, 3, 3) [m]. support: of the ground below each bearing, shape
    (k, bearings, 3, 3). wrench: force and moment that the lower and the
    upper end of each bearing exert on it, shape (k, bearings, 2, 6) [N], [N m]. normal_force, sliding: of the surfaces
    of each bearing, a list of arrays of shape (k, n-1) [N], [m]. Energies, shape (k,) or (k, bearings) [J]: dissipated:
    in each bearing; stored: in each bearing, with the springs of its interface; damped: by the damping of the building;
    received: work of the bearings on the building, by their forces beyond those at rest; input: work of the ground.
    counts: of the run. monitored: notes of the monitors of the bearings, each with its bearing, from 0. recorded_peaks:
    over all steps; None: not recorded. status: "ok" or the name of a failure; message: one line of text, "" for a run
    that succeeded. provenance: versions with which the result was computed. wall_time [s].
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
    monitored: tuple[tuple[int, Note], ...] = ()
    recorded_peaks: Peaks | None = None
    status: str = "ok"
    message: str = ""
    provenance: dict[str, str] = field(default_factory=dict)
    wall_time: float = 0.0

    @cached_property
    def peaks(self) -> Peaks:
        """Peaks over all steps, or of the rows where the run did not record them."""
        return self.recorded_peaks or peaks_of_rows(self)

    @property
    def identity(self) -> str:
        """The sha256 of the scene, its motions and matrices included, as in checkpoints."""
        return fingerprint(self.scene)

    @property
    def succeeded(self) -> bool:
        """Whether the run reached its end."""
        return self.status == "ok"

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
    def base_torsion(self) -> Array:
        """Moment of the forces of the ground about E3 through the centre of mass at rest, shape (k,) [N m]."""
        arms = self.scene.places - self.scene.mass_centre
        forces = self.wrench[:, :, 0]
        moments = arms[:, 0] * forces[..., 1] - arms[:, 1] * forces[..., 0] + forces[..., 5]
        total: Array = moments.sum(axis=1)
        return total

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


def at_times(result: B, times: ArrayLike) -> B:
    """`result` with rows at other times, by linear interpolation between its own rows.

    times: ndarray, shape (K,), or a number [s]. Raises InputError for a time outside the run.
    """
    new_times = checked_times(result.time, times)

    def rows(values: Any) -> Any:
        if isinstance(values, list):
            return [rows(each) for each in values]
        return interpolated(result.time, values, new_times)

    columns = {each.name: getattr(result, each.name) for each in fields(BuildingData)}
    changed = {name: rows(values) for name, values in columns.items() if isinstance(values, (np.ndarray, list))}
    return replace(result, **changed)


def peaks_of_rows(result: BuildingData) -> Peaks:
    """Peaks of the rows alone."""
    scene = result.scene
    names = [node.name for node in scene.building.nodes]
    nodes = np.reshape([result.node(name) for name in names], (len(names), len(result.time), 3, 6))
    lower = np.einsum("bin,kn->bki", scene.attachments[:, :3], result.displacement)
    across = np.moveaxis(result.support[:, :, 0], 1, 0) - lower
    slid, normal = (padded([each.max(axis=0) for each in of]) for of in (result.sliding, result.normal_force))
    least = padded([each.min(axis=0) for each in result.normal_force])
    force, axial = np.moveaxis(result.wrench[:, :, 1, :3], 1, 0), result.axial_force
    base = scene.bearings[0].node
    return Peaks(
        node_acceleration=along_time(nodes[:, :, 2, :3]),
        node_displacement=along_time(nodes[:, :, 0, :3] - result.ground[:, 0]),
        drift=along_time(np.moveaxis(result.drift[..., :3], 1, 0)),
        storey_shear=along_time(np.moveaxis(result.storey_force[..., :3], 1, 0)),
        storey_torsion=np.abs(result.storey_force[..., 5]).max(axis=0),
        base_twist=np.abs(result.node(base)[:, 0, 5]).max(keepdims=True),
        mean_displacement=along_time(across.mean(axis=0)),
        base_reaction=along_time(result.base_reaction),
        base_torsion=np.abs(result.base_torsion).max(keepdims=True),
        energy=np.array([result.kinetic.max(), result.strain.max()]),
        bearing_displacement=along_time(across),
        top_force=along_time(force),
        axial_force=np.stack([axial.min(axis=0), axial.max(axis=0)], axis=1),
        sliding=slid,
        normal_force=np.stack([least, normal], axis=1),
    )


def _squares(rows: Array, matrix: Array) -> Array:
    """x^T A x of every row x, shape (k,)."""
    found: Array = ((rows @ matrix) * rows).sum(axis=1)
    return found
