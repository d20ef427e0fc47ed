"""Closed cycles of a force-displacement path, and the effective properties that codes define on one cycle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi
from typing import NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.results.history import first_peak

REVERSAL = 0.02  # least reverse motion after a turning point, over the range of the run
CLOSURE = 0.05  # largest distance between start and end of a closed cycle, over its range
TRANSVERSE = 0.02  # largest transverse displacement of a motion in one direction, over the largest displacement
REST_INTERVAL = 0.05  # last share of a run in which the bearing must be at rest
REST_MOVEMENT = 0.01  # largest movement in it of a bearing at rest, over the largest displacement


@dataclass(frozen=True)
class Loop:
    """Effective properties of one closed cycle (ASCE 7-16 17.8.3, EN 15129).

    Attributes:
        displacement_most, displacement_least: largest and least displacement Delta+ and Delta- [m].
        force_most, force_least: force at these displacements, F+ and F- [N].
        effective_stiffness: k_eff = (F+ - F-)/(Delta+ - Delta-) [N/m].
        energy_dissipated: area E of the loop [J].
        effective_damping: 2 E/(pi k_eff (Delta+ - Delta-)^2) [-]; None if the stiffness is not positive.
        zero_displacement_force: half the height of the loop at zero displacement, the characteristic strength [N].
    """

    displacement_most: float
    displacement_least: float
    force_most: float
    force_least: float
    effective_stiffness: float
    energy_dissipated: float
    effective_damping: float | None
    zero_displacement_force: float


class Path(NamedTuple):
    """A horizontal motion and its force, at T times.

    time: shape (T,) [s]. u, force: shape (T, 2) [m], [N]. direction: unit vector of the largest displacement. row: of
    it. peak: it [m]. what: moves.
    """

    time: Array
    u: Array
    force: Array
    direction: Array
    row: int
    peak: float
    what: str

    @classmethod
    def of(cls, time: Array, displacement: Array, force: Array, what: str = "the bearing") -> Path:
        """The path of displacement [m] and force [N], shape (T, 2 or 3). Raises InputError if `what` did not move."""
        u = displacement[:, :2]
        size = np.hypot(*u.T)
        row = first_peak(size)
        if not size[row]:
            raise InputError(f"characterise: {what} did not move in this run; give a motion, or a longer duration")
        return cls(time, u, force[:, :2], u[row] / size[row], row, float(size.max()), what)

    @property
    def along(self) -> tuple[Array, Array]:
        """Displacement [m] and force [N] along the direction, shape (T,) each."""
        return self.u @ self.direction, self.force @ self.direction

    @property
    def secant_stiffness(self) -> float:
        """Force along the largest displacement, divided by it [N/m]."""
        return float(self.force[self.row] @ self.direction / np.hypot(*self.u[self.row]))

    @property
    def straight(self) -> bool:
        """Whether the motion is in one direction."""
        transverse = self.u @ np.array([-self.direction[1], self.direction[0]])
        return bool(np.abs(transverse).max() <= TRANSVERSE * self.peak)

    @property
    def residual(self) -> float:
        """Displacement in the last row [m]."""
        return float(np.hypot(*self.u[-1]))

    @property
    def at_rest(self) -> bool:
        """Whether it is at rest when the run ends."""
        return rests(self.time, self.u)

    @property
    def turning(self) -> list[int]:
        """Rows of the turning points of a motion in one direction; none of any other."""
        u = self.along[0]
        return turning_points(u, REVERSAL * float(np.ptp(u))) if self.straight else []

    def cycles(self) -> Iterator[tuple[int, int, int, Loop]]:
        """Rows of start, reversal and end of every closed cycle of a motion in one direction, and its properties."""
        u, force = self.along
        for start, middle, end in closed_cycles(u, self.turning):
            rows = slice(start, end + 1)
            yield start, middle, end, effective_properties(u[rows], force[rows], middle - start)


def rests(time: Array, u: Array) -> bool:
    """Whether a path moves by less than `REST_MOVEMENT` of its peak in the last part of the run.

    time: shape (T,) [s]. u: horizontal displacement, shape (T, 2) [m].
    """
    begin = time[-1] - REST_INTERVAL * (time[-1] - time[0])
    return bool(np.hypot(*np.ptp(u[time >= begin], axis=0)) <= REST_MOVEMENT * np.hypot(*u.T).max())


def turning_points(u: Array, threshold: float) -> list[int]:
    """Rows of the turning points of `u` [m], shape (T,), ignoring reverse motion shorter than `threshold` [m].

    The first is the start of the path, the last its last extreme.
    """
    turning, candidate, direction = [0], 0, 0.0
    for row in range(1, len(u)):
        step = u[row] - u[candidate]
        if direction == 0.0:
            if abs(u[row] - u[0]) >= threshold:
                candidate, direction = row, np.sign(u[row] - u[0])
        elif step * direction >= 0:
            candidate = row
        elif abs(step) >= threshold:
            turning.append(candidate)
            candidate, direction = row, -direction
    return [*turning, candidate] if direction else turning


def closed_cycles(u: Array, turning: list[int]) -> Iterator[tuple[int, int, int]]:
    """Rows (start, reversal, end) of successive closed cycles between turning points on the same side.

    A cycle is closed if its end is within `CLOSURE` of its start, relative to its range; it must include u = 0.
    """
    first = 0
    while first + 2 < len(turning):
        start, middle, end = turning[first : first + 3]
        span = abs(u[middle] - u[start])
        if abs(u[end] - u[start]) <= CLOSURE * span and u[start] * u[middle] < 0:
            yield start, middle, end
            first += 2
        else:
            first += 1


def effective_properties(u: Array, force: Array, middle: int) -> Loop:
    """Effective properties of a cycle `u` [m], `force` [N], each shape (T,), with its reversal in row `middle`."""
    most, least = (0, middle) if u[0] > u[middle] else (middle, 0)
    span = float(u[most] - u[least])
    stiffness = float(force[most] - force[least]) / span
    energy = loop_area(u, force)
    halves = (slice(None, middle + 1), slice(middle, None))
    crossings = [_force_at_zero(u[half], force[half]) for half in halves]
    return Loop(
        float(u[most]),
        float(u[least]),
        float(force[most]),
        float(force[least]),
        stiffness,
        energy,
        2 * energy / (pi * stiffness * span**2) if stiffness > 0 else None,
        abs(crossings[0] - crossings[1]) / 2,
    )


def loop_area(u: Array, force: Array) -> float:
    """Area of the loop, its ends joined by a straight line [J]; positive if the loop dissipates energy."""
    return float(np.sum((force + np.roll(force, -1)) * (np.roll(u, -1) - u)) / 2)


def _force_at_zero(u: Array, force: Array) -> float:
    """Force [N] where a half cycle first passes zero displacement."""
    row = int(np.flatnonzero(u[:-1] * u[1:] <= 0)[0])
    share = u[row] / (u[row] - u[row + 1]) if u[row] != u[row + 1] else 0.0
    return float(force[row] + share * (force[row + 1] - force[row]))
