"""`BuildingResult`: what the run of a building gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.buildings.step import Coupling, State
from msfp_gen.common.arrays import Array


@dataclass(frozen=True, eq=False)
class BuildingResult:
    """Motion of a building, and forces and sliding of its bearings, at k times.

    time: ndarray, shape (k,) [s]. displacement, velocity, acceleration: of the coordinates, shape (k, n), relative to
    the place at rest, in axes that do not move with the ground: accelerations are absolute. ground: displacement,
    velocity and acceleration of the ground, shape (k, 3, 3) [m]. wrench: force and moment that the lower and the upper
    end of each bearing exert on it, shape (k, bearings, 2, 6) [N], [N m]. normal_force, sliding: of the surfaces of
    each bearing, a list of arrays of shape (k, n-1) [N], [m]. dissipated: energy dissipated in each bearing, shape
    (k, bearings) [J]. counts: trials and tangents of the bearings.
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
    counts: dict[str, int]

    def node(self, name: str) -> Array:
        """Displacement, velocity and acceleration of a node: ndarray, shape (k, 3, 6), [m], [rad] and per s, s^2."""
        rows = self.scene.building.node(name).rows
        return np.stack([each @ rows.T for each in (self.displacement, self.velocity, self.acceleration)], axis=1)

    @property
    def bearing_displacement(self) -> Array:
        """Displacement of the upper end of each bearing relative to the ground, shape (k, bearings, 3) [m]."""
        upper: Array = np.einsum("bin,kn->kbi", self.scene.attachments[:, :3], self.displacement)
        return upper - self.ground[:, None, 0]

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
    def damped(self) -> Array:
        """Energy dissipated by the damping of the building, shape (k,) [J]."""
        return self._integral(_squares(self.velocity, self.scene.building.damping))

    @property
    def received(self) -> Array:
        """Work of the bearings on the building, by their forces beyond those at rest, shape (k,) [J]."""
        upper = np.einsum("bin,kn->kbi", self.scene.attachments, self.velocity)
        power = -np.einsum("kbi,kbi->k", self.wrench[:, :, 1] - self.wrench[0, :, 1], upper)
        return self._integral(power)

    @property
    def _size(self) -> int:
        return len(self.scene.building.mass)

    def _integral(self, power: Array) -> Array:
        steps = 0.5 * (power[1:] + power[:-1]) * np.diff(self.time)
        return np.concatenate([[0.0], np.cumsum(steps)])


def _squares(rows: Array, matrix: Array) -> Array:
    """x^T A x of every row x, shape (k,)."""
    found: Array = ((rows @ matrix) * rows).sum(axis=1)
    return found


class Rows:
    """Rows of a run that grows."""

    def __init__(self, scene: BuildingScene) -> None:
        self.scene = scene
        self.states: list[State] = []
        self.ground: list[Array] = []
        self.bearings: list[list[tuple[Array, Array, Array, float]]] = [[] for _ in scene.bearings]

    def start(self, coupling: Coupling, state: State) -> None:
        """The row of the state at rest."""
        still = np.zeros((3, 6))
        coupling.responses = [port.trial(0.0, still, still) for port in coupling.ports]
        self.add(coupling, state)

    def add(self, coupling: Coupling, state: State) -> None:
        """The row of a state that the bearings have reached."""
        self.states.append(state)
        self.ground.append(coupling.lower(state.time)[:, :3])
        for rows, each in zip(self.bearings, coupling.responses, strict=True):
            rows.append((each.wrench, each.normal_force, each.sliding, each.dissipated))

    def result(self, coupling: Coupling) -> BuildingResult:
        """The rows until now."""
        columns = [[np.array(column) for column in zip(*rows, strict=True)] for rows in self.bearings]
        wrench, normal, sliding, dissipated = zip(*columns, strict=True)
        return BuildingResult(
            self.scene,
            np.array([each.time for each in self.states]),
            np.array([each.u for each in self.states]),
            np.array([each.v for each in self.states]),
            np.array([each.a for each in self.states]),
            np.array(self.ground),
            np.stack(wrench, axis=1),
            list(normal),
            list(sliding),
            np.stack(dissipated, axis=1),
            {"trials": coupling.trials, "tangents": coupling.tangents},
        )
