"""Sliding regimes along a path between two turning points: which surfaces slide, and a straight line of the force.


`results.sliding` defines where a surface slides; here its rim must not be in contact either. The shape of the
force-displacement curve is not used. "Stage" in names means a sliding regime.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.sliding import slides_over

if TYPE_CHECKING:
    from msfp_gen.results.run_data import RunData

CELLS = 400  # intervals of equal travel on a path
WINDOW = 4  # intervals over which the increments of slip are taken
SHORTEST = 0.03  # least share of the path of a regime; shorter ones are the gradual transition between two others
TRIM = 0.15  # share of a regime left out at either end before a line is fitted


@dataclass(frozen=True)
class Stage:
    """One sliding regime and the line fitted to its middle part.

    Attributes:
        surfaces: surfaces (1..n-1) that slide; empty while all stick.
        start, end: displacement at its start and end [m].
        stiffness: slope of the line [N/m].
        intercept: force of the line at zero displacement [N].
        scatter: largest distance of the force from the line within the fitted part [N].
    """

    surfaces: tuple[int, ...]
    start: float
    end: float
    stiffness: float
    intercept: float
    scatter: float


@dataclass(frozen=True)
class Transition:
    """Transition between two sliding regimes.

    Attributes:
        displacement, force: in the middle of the gradual transition [m], [N].
        before, after: surfaces that slide before and after.
    """

    displacement: float
    force: float
    before: tuple[int, ...]
    after: tuple[int, ...]


@dataclass(frozen=True)
class Branch:
    """Path between two turning points at displacements `start` and `end` [m], with its regimes in order of time."""

    start: float
    end: float
    stages: tuple[Stage, ...]
    transitions: tuple[Transition, ...]


def signed_slip(result: RunData, direction: Array) -> tuple[Array, Array]:
    """Slip of every surface along the unit vector `direction`, shape (2,), and its plastic part: (T, n-1) each [m]."""
    history, bearing = result.history, result.scene.bearing
    # t_3 of a body tilts towards (theta, -psi); the slip of a surface that is concave up is opposite to it (3.19).
    tilt = history.tilt_angles[..., 1] * direction[0] - history.tilt_angles[..., 0] * direction[1]
    slip = -np.array(bearing.layout.signs) * np.copysign(history.sliding, tilt)
    elastic = np.array([surface.yield_displacement for surface in bearing.surfaces])
    return slip, slip - elastic * (history.friction_state @ direction)


def branch_of(u: Array, force: Array, slip: Array, plastic: Array, gap: Array) -> Branch:
    """Sliding regimes along the rows between two turning points.

    u: displacement, shape (T,) [m]. force: shape (T,) [N]. slip, plastic: slip along the motion and its plastic part,
    shape (T, n-1) [m]. gap: shape (T, n-1) [m].
    """
    travel = np.maximum.accumulate(np.abs(u - u[0]))
    rows = np.flatnonzero(np.diff(travel, prepend=-1.0) > 0)
    if len(rows) < 3:
        return Branch(float(u[0]), float(u[-1]), (), ())
    x = np.linspace(0.0, travel[-1], CELLS + 1)
    table = np.column_stack([u, force, slip, plastic, gap])[rows]
    grid = np.array([np.interp(x, travel[rows], column) for column in table.T])
    at, force_at = grid[:2]
    sets = _sliding_sets(*np.split(grid[2:].T, 3, axis=1))
    spans = _regime_spans(sets)
    stages = tuple(_fit(at, force_at, first, last, sets[first]) for first, last in spans)
    changes = tuple(_transition(at, force_at, last, after, sets) for (_, last), (after, _) in pairwise(spans))
    return Branch(float(u[0]), float(u[-1]), stages, changes)


def _sliding_sets(slip: Array, plastic: Array, gap: Array) -> list[tuple[int, ...]]:
    """The surfaces that slide at every point of the grid; arrays of shape (CELLS + 1, n-1) [m]."""
    low = np.clip(np.arange(CELLS + 1) - WINDOW // 2, 0, None)
    high = np.clip(np.arange(CELLS + 1) + WINDOW // 2, None, CELLS)
    sliding = slides_over(slip[high] - slip[low], plastic[high] - plastic[low]) & (gap > 0)
    return [tuple(int(i) + 1 for i in np.flatnonzero(row)) for row in sliding]


def _regime_spans(sets: list[tuple[int, ...]]) -> list[tuple[int, int]]:
    """First and last point of every regime that is long enough; equal ones with a short interruption are joined."""
    edges = [0, *(i for i in range(1, len(sets)) if sets[i] != sets[i - 1]), len(sets)]
    spans: list[tuple[int, int]] = []
    for first, after in pairwise(edges):
        if after - first < SHORTEST * CELLS:
            continue
        if spans and sets[spans[-1][0]] == sets[first]:
            spans[-1] = (spans[-1][0], after - 1)
        else:
            spans.append((first, after - 1))
    return spans


def _fit(u: Array, force: Array, first: int, last: int, surfaces: tuple[int, ...]) -> Stage:
    """Line through the middle part of a regime; its slope is the median of all slopes between points (Theil-Sen)."""
    trim = int(TRIM * (last - first))
    x, y = u[first + trim : last + 1 - trim], force[first + trim : last + 1 - trim]
    i, j = np.triu_indices(len(x), 1)
    slope = float(np.median((y[j] - y[i]) / (x[j] - x[i])))
    intercept = float(np.median(y - slope * x))
    scatter = float(np.abs(y - slope * x - intercept).max())
    return Stage(surfaces, float(u[first]), float(u[last]), slope, intercept, scatter)


def _transition(u: Array, force: Array, last: int, after: int, sets: list[tuple[int, ...]]) -> Transition:
    """Transition halfway between the `last` point of one regime and the first point `after` it."""
    middle = (last + after) / 2
    points = np.arange(len(u))
    displacement, force_there = (float(np.interp(middle, points, values)) for values in (u, force))
    return Transition(displacement, force_there, sets[last], sets[after])
