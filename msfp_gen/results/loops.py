"""Loops of a run with their effective properties, its first loading, and the demands on its surfaces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.results.history import History, first_peak
from msfp_gen.results.sliding import slides_over
from msfp_gen.scene.bearing import Bearing

if TYPE_CHECKING:
    from msfp_gen.results.result import Result

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


class ForcePath(NamedTuple):
    """A horizontal motion and its force, at T times.

    time: shape (T,) [s]. u, force: shape (T, 2) [m], [N]. direction: unit vector of the largest displacement. row: its
    row. peak: its size [m]. what: the moving part, in messages.
    """

    time: Array
    u: Array
    force: Array
    direction: Array
    row: int
    peak: float
    what: str

    @classmethod
    def of(cls, time: Array, displacement: Array, force: Array, what: str = "the bearing") -> ForcePath:
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


@dataclass(frozen=True)
class SurfaceDemand:
    """Extreme values of one surface over some rows.

    Attributes:
        surface: 1..n-1.
        capacity_left: least gap to the rim [m]; negative where the rim is compressed.
        capacity_left_share: the same over the capacity [-].
        peak_velocity: largest slip velocity while the surface is in contact [m/s]; None if it is not known.
        peak_heat_flux: largest mu N |v|/A [W/m^2]; None if A or v is not known.
        heat: its integral over time [J/m^2]; None if A or v is not known.
        contact_area: A = pi r^2, with r the radius of the sliding patch, else the rim radius of the slider [m^2]; None
            if the bearing has neither.
        maximum_uplift: largest opening of the surface [m]; None where no model of the run had uplift.
    """

    surface: int
    capacity_left: float
    capacity_left_share: float
    peak_velocity: float | None
    peak_heat_flux: float | None
    heat: float | None
    contact_area: float | None
    maximum_uplift: float | None


def surface_demands(one: Result, rows: slice | None = None) -> tuple[SurfaceDemand, ...]:
    """Demands on every surface over `rows`, bottom first; over the whole run, its steps included, without them."""
    history, extremes, whole = one.history, one.extremes, rows is None
    rows = slice(None) if rows is None else rows
    gap, lift = (values[rows] for values in (history.gap, history.lift))
    least_gap = extremes.gap if whole else gap.min(axis=0)
    most_lift = extremes.lift if whole and extremes.lift is not None else lift.max(axis=0)
    recorded = one.recorded_extremes  # a monitor may have added uplift during the run
    has_uplift = one.effects.uplift or history.lift.any() or (recorded is not None and recorded.lift is not None)
    slips = _slips(one, rows, whole) if isinstance(one.history, History) else None
    return tuple(
        SurfaceDemand(
            surface=i + 1,
            capacity_left=float(least_gap[i]),
            capacity_left_share=float(least_gap[i]) / surface.capacity,
            peak_velocity=None if slips is None else float(slips[0][i]),
            peak_heat_flux=float(slips[1][i]) / area if slips is not None and area else None,
            heat=float(slips[2][i]) / area if slips is not None and area else None,
            contact_area=area,
            maximum_uplift=float(most_lift[i]) if has_uplift else None,
        )
        for i, surface in enumerate(one.bearing.surfaces)
        for area in (_contact_area(one.bearing, i),)
    )


def _slips(result: Result, rows: slice, whole: bool) -> tuple[Array, Array, Array]:
    """Largest slip velocity [m/s] and friction power [W], and its integral [J], of every surface, shape (n-1,) each."""
    history, fastest = result.alone.history, result.extremes.slip_speed
    speed = np.where(history.separated, 0.0, np.linalg.norm(history.slip_velocity, axis=2))[rows]
    power = result.friction_coefficient[rows] * history.normal_force[rows] * speed
    heat = np.asarray(np.trapezoid(power, history.time[rows], axis=0))
    return (fastest if whole and fastest is not None else speed.max(axis=0)), power.max(axis=0), heat


def _contact_area(bearing: Bearing, surface: int) -> float | None:
    """Contact area of a surface (index from 0) [m^2]; None if no radius is given."""
    patch = bearing.surfaces[surface].patch_radius
    radius = bearing.slider_rim_radius(surface) if patch is None else patch
    return pi * radius**2 if radius > 0 else None


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


def signed_slip(result: Result, direction: Array) -> tuple[Array, Array]:
    """Slip of every surface along the unit vector `direction`, shape (2,), and its plastic part: (T, n-1) each [m]."""
    history, bearing = result.alone.history, result.bearing
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
