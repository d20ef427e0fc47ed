"""One step of a building on its bearings: TR-BDF2, each stage by Newton's method with the tangents of the bearings."""

from __future__ import annotations

from contextlib import suppress
from typing import NamedTuple

import numpy as np

from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.arrays import Array
from msfp_gen.coupling.response import Response
from msfp_gen.coupling.two_port import TwoPort
from msfp_gen.errors import InputError, RunError
from msfp_gen.scene.top import NodeTop

GAMMA = 2 - np.sqrt(2)  # first stage, as a share of the step: both stages then have the same matrix
STAGE = GAMMA / 2  # weight of the rate at the end of a stage
TOLERANCE = 1e-7  # of the residual, relative to the weight as a horizontal force
ITERATIONS = 25
SLOW = 0.2  # of the residual from one iteration to the next: then the tangents are computed anew
UPPER = slice(6, 12)


class State(NamedTuple):
    """Displacements, velocities and accelerations of the building at a time, each of shape (n,)."""

    time: float
    u: Array
    v: Array
    a: Array


class UnconvergedError(Exception):
    """A stage has no solution that Newton's method finds: message and status of the run that it ends."""

    def __init__(self, message: str, status: str) -> None:
        super().__init__(message)
        self.status = status


class Coupling:
    """The building with its bearings between it and the ground, and the matrix of the stages."""

    def __init__(self, scene: BuildingScene) -> None:
        self.scene = scene
        self.rows = scene.attachments
        self.ports = [_port(scene, index) for index in range(len(scene.bearings))]
        self.start = scene.motion.displacement(0.0)
        self.scale = scene.building.uniform_acceleration([scene.gravity, 0.0, 0.0])
        self.at_rest = np.array([[0.0, 0.0, -load, 0.0, 0.0, 0.0] for load in scene.axial_loads])
        self.responses: list[Response] = []
        self.stiffnesses = [_interface_stiffness(each.interface) for each in scene.bearings]
        self.inverse = np.zeros((0, 0))
        self.tau = 0.0
        self.trials = self.tangents = 0

    def step(self, begin: State, h: float) -> State:
        """The state after a step of length h [s], which the bearings have tried. Raises UnconvergedError."""
        tau = STAGE * h
        if tau != self.tau:
            self.tau, self.inverse = tau, np.zeros((0, 0))
        middle = self._stage(begin.time + GAMMA * h, begin.u + tau * begin.v, begin.v + tau * begin.a, begin.a)
        one, two = 1 / (GAMMA * (2 - GAMMA)), (1 - GAMMA) ** 2 / (GAMMA * (2 - GAMMA))
        u, v = one * middle.u - two * begin.u, one * middle.v - two * begin.v
        return self._stage(begin.time + h, u, v, middle.a)

    def commit(self) -> None:
        """The bearings accept the step."""
        for port in self.ports:
            port.commit()

    def lower(self, time: float) -> Array:
        """Motion of the ground as that of the lower ends, shape (3, 6)."""
        ends = np.stack([self.scene.motion.evaluate(time, order) for order in range(3)])
        ends[0, :3] -= self.start
        return ends

    def _stage(self, time: float, u: Array, v: Array, guess: Array) -> State:
        """Solve M a + C v + K u + forces of the bearings = 0 with v = v + tau a and u = u + tau v."""
        tau, a, last = self.tau, guess.copy(), np.inf
        lower = self.lower(time)
        for _ in range(ITERATIONS):
            now = State(time, u + tau * (v + tau * a), v + tau * a, a)
            residual = self._residual(now, lower)
            if not self.inverse.size:
                self._factor()
            size = self._size(residual)
            if size <= TOLERANCE:
                return now
            if size > SLOW * last and np.isfinite(last):
                self._factor()
            last = size
            a = a - self.inverse @ residual / tau**2
        raise UnconvergedError(
            f"building: stopped at t = {time:.6g} s of {self.scene.end:.6g} s: the iteration finds no balance of the "
            "forces of bearings and building; give a shorter solver.max_step",
            "newton",
        )

    def _size(self, residual: Array) -> float:
        """Norm of a residual in that of the matrix of the stage, in which coordinates of all units add up."""
        return float(np.sqrt(abs(residual @ self.inverse @ residual) / abs(self.scale @ self.inverse @ self.scale)))

    def _residual(self, now: State, lower: Array) -> Array:
        building = self.scene.building
        self.responses = [self._trial(index, now, lower) for index in range(len(self.ports))]
        forces = np.stack([each.wrench[1] for each in self.responses]) - self.at_rest
        found: Array = building.mass @ now.a + building.damping @ now.v + building.stiffness @ now.u
        found += np.einsum("bin,bi->n", self.rows, forces)
        return found

    def _trial(self, index: int, now: State, lower: Array) -> Response:
        self.trials += 1
        try:
            return self.ports[index].trial(now.time, lower, np.stack([self.rows[index] @ x for x in now[1:]]))
        except RunError as error:
            raise UnconvergedError(f"{self.scene.label(index)}: {error}", error.status) from None

    def _factor(self) -> None:
        """The inverse of the matrix of a stage, with the tangents of the latest trials."""
        building, tau = self.scene.building, self.tau
        matrix = building.mass / tau**2 + building.damping / tau + building.stiffness
        for index, (rows, response) in enumerate(zip(self.rows, self.responses, strict=True)):
            self.tangents += 1
            # Where there is no derivative, as in an impact, the previous one: the residual decides all the same.
            with suppress(RunError):
                self.stiffnesses[index] = response.effective_stiffness(1 / tau, 1 / tau**2)[UPPER, UPPER]
            matrix = matrix + rows.T @ self.stiffnesses[index] @ rows
        scale = 1 / np.sqrt(np.diag(matrix))
        self.inverse = scale[:, None] * np.linalg.inv(scale[:, None] * matrix * scale) * scale


def _port(scene: BuildingScene, index: int) -> TwoPort:
    given, load = scene.bearings[index], float(scene.axial_loads[index])
    try:
        return TwoPort(given.bearing, given.interface, load, scene.modelled[index], scene.solver)
    except InputError as error:
        raise InputError(f"scene.bearings[{index}]: {error}") from None


def _interface_stiffness(interface: NodeTop) -> Array:
    k, kr = interface.stiffness, interface.rotational_stiffness
    return np.diag([k, k, interface.vertical_stiffness, kr, kr, 0.0])
