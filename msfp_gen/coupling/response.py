"""`Response`: what a trial of a two-port gives."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from typing import Protocol

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.specification.contract import WORKS, names

DISSIPATED = ("friction_dissipated", "contact_dissipated", "rim_dissipated", "seat_dissipated")


class Source(Protocol):
    """The two-port of a trial."""

    def unpacked(self, row: Array) -> dict[str, Array]:
        """The values of a row, shape (row size,), by their names; shapes and units of `History`, without time."""

    def derivative(self, number: int, word: str, direction: tuple[float, float, float]) -> Array:
        """Derivatives of the wrenches of trial `number`, ndarray, shape (12, 12) [N/m], [N/rad], [N m/m], [N m/rad].

        direction: factors of displacements, rates and accelerations of the ends.
        """


@dataclass(frozen=True, eq=False)
class Response:
    """Wrenches of a two-port at the end of a trial; rows are the lower and the upper end.

    time: of the end of the trial [s]. wrench: force along E1, E2, E3 and moment about the present position of the end,
    which each end exerts on the bearing: ndarray, shape (2, 6), [N], [N m].
    """

    time: float
    wrench: Array
    _row: Array
    _port: Source
    _number: int

    @property
    def sliding(self) -> Array:
        """Sliding displacements (3.20), shape (n-1,) [m]."""
        return self._values["sliding"]

    @property
    def normal_force(self) -> Array:
        """Normal forces, shape (n-1,) [N]."""
        return self._values["normal"]

    @property
    def dissipated(self) -> float:
        """Energy dissipated in the bearing since the start [J]."""
        works = dict(zip(names(WORKS), self._values["work"], strict=True))
        return sum(float(works[name]) for name in DISSIPATED)

    @cached_property
    def _values(self) -> dict[str, Array]:
        return self._port.unpacked(self._row)

    @cached_property
    def tangent(self) -> Array:
        """Derivatives of the 12 numbers of `wrench` with respect to displacements and rotation vectors of both ends.

        ndarray, shape (12, 12), [N/m], [N/rad], [N m/m], [N m/rad], at given rates and accelerations of the ends; it
        is consistent with the steps of the trial. Like `damping` and `inertia` it is computed when it is first read, as
        long as the trial is the latest one, before `commit` and `revert`. Raises InputError afterwards, RunError.
        """
        return self._port.derivative(self._number, "tangent", (1.0, 0.0, 0.0))

    @cached_property
    def damping(self) -> Array:
        """Derivatives of `wrench` with respect to the rates of both ends, shape (12, 12), as `tangent`."""
        return self._port.derivative(self._number, "damping", (0.0, 1.0, 0.0))

    @cached_property
    def inertia(self) -> Array:
        """Derivatives of `wrench` with respect to the accelerations of both ends, shape (12, 12), as `tangent`."""
        return self._port.derivative(self._number, "inertia", (0.0, 0.0, 1.0))

    def effective_stiffness(self, rate: float, acceleration: float) -> Array:
        """`tangent` + `rate` * `damping` + `acceleration` * `inertia`, shape (12, 12), at a third of the cost.

        It is the matrix of an iteration of an implicit method whose rates [1/s] and accelerations [1/s^2] change with
        the displacements by these factors: gamma/(beta h) and 1/(beta h^2) of Newmark's method. Errors as `tangent`.
        """
        for name, factor in (("rate", rate), ("acceleration", acceleration)):
            if not isfinite(factor):
                raise InputError(f"{name} = {factor!r}: give a finite number")
        return self._port.derivative(self._number, "effective_stiffness", (1.0, float(rate), float(acceleration)))
