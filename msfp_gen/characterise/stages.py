"""Stages of motion along one way of the bearing: which surfaces slide, and the straight line the force follows.

A surface slides where its plastic slip, its slip less the elastic part d_y Y of the Bouc-Wen law (2.94), makes up a
share of the bearing's travel, and its rim is not in contact. Nothing is guessed from the shape of the curve.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.history import Array

if TYPE_CHECKING:
    from msfp_gen.result import Result

CELLS = 400  # pieces of equal travel in which slip is compared
WINDOW = 4  # of these make the travel over which a share is taken
SHARE = 0.05  # plastic slip over travel from which a surface slides
SHORTEST = 0.03  # a stage shorter than this share of the way is the rounding between its neighbours
TRIM = 0.15  # share left out at either end of a stage before a line is fitted


@dataclass(frozen=True)
class Stage:
    """One stage: the surfaces (1..n-1) that slide, none while all stick, and the line fitted to its middle.

    start, end: displacement where it begins and ends [m]. stiffness: slope of the line [N/m]. intercept: its force at
    zero displacement [N]. scatter: largest distance of the force from the line within the fit [N].
    """

    surfaces: tuple[int, ...]
    start: float
    end: float
    stiffness: float
    intercept: float
    scatter: float


@dataclass(frozen=True)
class Transition:
    """A change of stage: displacement [m] and force [N] in the middle of the rounding; surfaces before and after."""

    displacement: float
    force: float
    before: tuple[int, ...]
    after: tuple[int, ...]


@dataclass(frozen=True)
class Branch:
    """The way between two turning points, in the order in which it was gone."""

    start: float
    end: float
    stages: tuple[Stage, ...]
    transitions: tuple[Transition, ...]


def signed_slip(result: Result, direction: Array) -> tuple[Array, Array]:
    """Slip of every surface along `direction`, shape (2,), and its plastic part: each shape (T, n-1), [m]."""
    history, bearing = result.history, result.scene.bearing
    # t_3 of a body leans to (theta, -psi); slip is against it where the surface is concave up (3.19)
    lean = history.tilt_angles[..., 1] * direction[0] - history.tilt_angles[..., 0] * direction[1]
    slip = -np.array(bearing.layout.signs) * np.copysign(history.sliding, lean)
    elastic = np.array([surface.yield_displacement for surface in bearing.surfaces])
    return slip, slip - elastic * (history.friction_state @ direction)


def branch_of(u: Array, force: Array, plastic: Array, gap: Array) -> Branch:
    """The stages along rows of one way: `u` [m], `force` [N], shapes (T,); plastic slip and gap [m], (T, n-1)."""
    travel = np.maximum.accumulate(np.abs(u - u[0]))
    rows = np.flatnonzero(np.diff(travel, prepend=-1.0) > 0)
    if len(rows) < 3:
        return Branch(float(u[0]), float(u[-1]), (), ())
    x = np.linspace(0.0, travel[-1], CELLS + 1)
    table = np.column_stack([u, force, plastic, gap])[rows]
    grid = np.array([np.interp(x, travel[rows], column) for column in table.T])
    count = plastic.shape[1]
    on, pull, slid, left = grid[0], grid[1], grid[2 : 2 + count], grid[2 + count :]
    sets = _sliding_sets(x, slid, left)
    runs = _long_runs(sets)
    stages = tuple(_fit(on, pull, first, last, sets[first]) for first, last in runs)
    changes = tuple(_change(on, pull, last, then, sets) for (_, last), (then, _) in pairwise(runs))
    return Branch(float(u[0]), float(u[-1]), stages, changes)


def _sliding_sets(x: Array, plastic: Array, gap: Array) -> list[tuple[int, ...]]:
    """The surfaces that slide about every point of the grid."""
    low = np.clip(np.arange(CELLS + 1) - WINDOW // 2, 0, None)
    high = np.clip(np.arange(CELLS + 1) + WINDOW // 2, None, CELLS)
    rate = np.abs(plastic[:, high] - plastic[:, low]) / (x[high] - x[low])
    slides = (rate >= SHARE) & (gap > 0)
    return [tuple(int(i) + 1 for i in np.flatnonzero(column)) for column in slides.T]


def _long_runs(sets: list[tuple[int, ...]]) -> list[tuple[int, int]]:
    """First and last point of every stage that is long enough; one that a flicker interrupts counts once."""
    edges = [0, *(i for i in range(1, len(sets)) if sets[i] != sets[i - 1]), len(sets)]
    runs: list[tuple[int, int]] = []
    for first, after in pairwise(edges):
        if after - first < SHORTEST * CELLS:
            continue
        if runs and sets[runs[-1][0]] == sets[first]:
            runs[-1] = (runs[-1][0], after - 1)
        else:
            runs.append((first, after - 1))
    return runs


def _fit(u: Array, force: Array, first: int, last: int, surfaces: tuple[int, ...]) -> Stage:
    """The line through the middle of a stage: the median of all slopes between its points (Theil and Sen)."""
    trim = int(TRIM * (last - first))
    x, y = u[first + trim : last + 1 - trim], force[first + trim : last + 1 - trim]
    i, j = np.triu_indices(len(x), 1)
    slope = float(np.median((y[j] - y[i]) / (x[j] - x[i])))
    intercept = float(np.median(y - slope * x))
    scatter = float(np.abs(y - slope * x - intercept).max())
    return Stage(surfaces, float(u[first]), float(u[last]), slope, intercept, scatter)


def _change(u: Array, force: Array, last: int, then: int, sets: list[tuple[int, ...]]) -> Transition:
    middle = (last + then) / 2
    points = np.arange(len(u))
    at, pull = (float(np.interp(middle, points, values)) for values in (u, force))
    return Transition(at, pull, sets[last], sets[then])
