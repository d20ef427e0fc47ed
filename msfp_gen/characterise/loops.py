"""Closed cycles of a force-displacement path, and the effective properties that codes define on one cycle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi

import numpy as np

from msfp_gen.history import Array

REVERSAL = 0.02  # way back, over the range of the run, that makes a turning point
CLOSURE = 0.05  # distance between both ends of a cycle, over its range, that still counts as closed


@dataclass(frozen=True)
class Loop:
    """Effective properties of one closed cycle (ASCE 7-16 17.8.3, EN 15129); SI.

    displacement_most, displacement_least: Delta+ and Delta- [m]; force_most, force_least: the force at them [N].
    effective_stiffness: (F+ - F-)/(Delta+ - Delta-) [N/m]. energy_dissipated: area of the loop [J].
    effective_damping: 2 E/(pi k_eff (Delta+ - Delta-)^2) [-]; None where the stiffness is not positive.
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


def turning_points(u: Array, threshold: float) -> list[int]:
    """Rows between which `u`, shape (T,), goes one way, but for ways back shorter than `threshold` [m].

    First and last of them are the start of the path and its last extreme.
    """
    pivots, candidate, direction = [0], 0, 0.0
    for row in range(1, len(u)):
        step = u[row] - u[candidate]
        if direction == 0.0:
            if abs(u[row] - u[0]) >= threshold:
                candidate, direction = row, np.sign(u[row] - u[0])
        elif step * direction >= 0:
            candidate = row
        elif abs(step) >= threshold:
            pivots.append(candidate)
            candidate, direction = row, -direction
    return [*pivots, candidate] if direction else pivots


def closed_cycles(u: Array, pivots: list[int]) -> Iterator[tuple[int, int, int]]:
    """Rows (start, reversal, end) of cycles that follow one another, from one turning point to the next of its side.

    A cycle counts where it ends within `CLOSURE` of its range of where it began and has zero inside.
    """
    first = 0
    while first + 2 < len(pivots):
        start, middle, end = pivots[first : first + 3]
        reach = abs(u[middle] - u[start])
        if abs(u[end] - u[start]) <= CLOSURE * reach and u[start] * u[middle] < 0:
            yield start, middle, end
            first += 2
        else:
            first += 1


def effective_properties(u: Array, force: Array, middle: int) -> Loop:
    """The loop whose rows are `u` [m] and `force` [N], each shape (T,), with its reversal in row `middle`."""
    most, least = (0, middle) if u[0] > u[middle] else (middle, 0)
    reach = float(u[most] - u[least])
    stiffness = float(force[most] - force[least]) / reach
    energy = loop_area(u, force)
    legs = (slice(None, middle + 1), slice(middle, None))
    crossings = [_at_zero(u[leg], force[leg]) for leg in legs]
    return Loop(
        float(u[most]), float(u[least]), float(force[most]), float(force[least]), stiffness, energy,
        2 * energy / (pi * stiffness * reach**2) if stiffness > 0 else None,
        abs(crossings[0] - crossings[1]) / 2,
    )  # fmt: skip


def loop_area(u: Array, force: Array) -> float:
    """Work done round the loop, its ends joined by a straight line [J]; positive where the loop dissipates."""
    return float(np.sum((force + np.roll(force, -1)) * (np.roll(u, -1) - u)) / 2)


def _at_zero(u: Array, force: Array) -> float:
    """Force where a leg of a loop first passes zero displacement."""
    row = int(np.flatnonzero(u[:-1] * u[1:] <= 0)[0])
    share = u[row] / (u[row] - u[row + 1]) if u[row] != u[row + 1] else 0.0
    return float(force[row] + share * (force[row + 1] - force[row]))
