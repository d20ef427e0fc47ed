"""What a check of an audit reads and answers: the case, findings, and the drawings of their evidence.

A threshold is a physical bound, an error that follows from the data, or a floor, which states how far a sound program
may be from the balance of rigid links.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from msfp_gen.auditing.histories import Histories
from msfp_gen.auditing.momentum import Momentum, momentum
from msfp_gen.auditing.sliding import CLOSED, ERRORS, FittedFactor, Sliding
from msfp_gen.auditing.stated import Stated
from msfp_gen.common.arrays import Array

CONSISTENT, INCONSISTENT, OPEN = "consistent", "inconsistent", "not decidable"
FLOOR = 0.03  # of radius, friction and mass: compliance, weights of sliders, arrangement of a stack
BOUND_FLOOR = 0.05  # of the bounds of friction and of travel: they are single rows, not means
UNSURE = 0.3  # error of radius and friction from which on nothing is said
NONE, SHOWN = "", 2000  # rows of a drawing


class Drawing(NamedTuple):
    """The evidence of a finding.

    Attributes:
        curves: (label, x, y), shape (k,) each [unit of the axis].
        x, y: labels of the axes.
        place: (x, y) that the finding names.
        points: whether points are drawn, not lines.
    """

    curves: list[tuple[str, Array, Array]]
    x: str
    y: str
    place: tuple[float, float] | None = None
    points: bool = False


@dataclass(frozen=True)
class Finding:
    """What one check found.

    Attributes:
        check: key of the check.
        title: what it checks.
        verdict: "consistent", "inconsistent" or "not decidable".
        sentence: what was found, or what column would decide.
        value, unit: the number of the finding; None: there is none.
        time: instant of the finding [s]; None: the whole record.
        drawing: the evidence as a figure; None: there is none.
    """

    check: str
    title: str
    verdict: str
    sentence: str
    value: float | None = None
    unit: str = ""
    time: float | None = None
    drawing: Drawing | None = field(default=None, repr=False, compare=False)

    @property
    def as_dict(self) -> dict[str, Any]:
        """The finding as plain data, without the drawing."""
        names = ("check", "title", "verdict", "sentence", "value", "unit", "time")
        return {name: getattr(self, name) for name in names}


class Answer(NamedTuple):
    """The answer of a check, without its name: see `Finding`."""

    verdict: str
    sentence: str
    value: float | None = None
    unit: str = ""
    time: float | None = None
    drawing: Drawing | None = None


@dataclass(frozen=True)
class AuditCase:
    """What a check reads: histories as read, the data of the bearing, and histories with units and signs put right."""

    uncorrected: Histories
    stated: Stated
    data: Histories
    corrections: dict[str, Answer]

    @cached_property
    def sliding(self) -> Sliding:
        """Rows of full sliding."""
        return Sliding(self.data, self.stated)

    @cached_property
    def momentum(self) -> Momentum | None:
        """Force against acceleration; None without columns."""
        return momentum(self.data)

    @property
    def mass(self) -> float | None:
        """Mass that all bearings support, as stated [kg]; None: it is not stated."""
        return stated_mass(self.uncorrected, self.stated)

    @cached_property
    def parted(self) -> bool:
        """Whether surfaces may have parted."""
        return "axial" in self.data.columns and bool(self.data.below(CLOSED).any())

    @cached_property
    def rest_error(self) -> float:
        """Relative error of the axial force at rest, where surfaces may have parted: its rows miss impacts."""
        return abs(self.data.before / self.data.at_rest - 1.0) if self.parted else 0.0

    def lacks_rest(self) -> Answer | None:
        """The answer where the axial force at rest does not follow from the data."""
        if self.rest_error <= FLOOR:
            return None
        text = (
            f"surfaces may have parted, and the mean axial force of {si(self.data.at_rest, 'N')} is not the "
            f"{si(self.data.before, 'N')} before the motion; rows closer together, from rest to rest, would decide"
        )
        return Answer(OPEN, text)

    @cached_property
    def shear_ratio(self) -> Array:
        """Horizontal force over axial force, (T, 2) [-]; 0 where it may be opening."""
        data = self.data
        closed = data.axial > CLOSED * data.at_rest
        return np.where(closed[:, None], data.force / np.where(closed, data.axial, 1.0)[:, None], 0.0)

    def lacks(self, *names: str) -> Answer | None:
        """The answer where columns are missing."""
        if missing := self.data.missing(*names):
            return Answer(OPEN, f"no column {' and '.join(missing)}; with it this can be decided")
        return None

    def fitted(self, name: str) -> FittedFactor | Answer:
        """A fitted factor, or the answer where there is none."""
        if lack := self.lacks("displacement", "force", "axial"):
            return lack
        if not self.sliding.enough:
            return Answer(OPEN, self.sliding.lack)
        factor = self.sliding.fit.factors.get(name)
        if factor is None:
            return Answer(OPEN, "its part of the force is too small in these data")
        if name in ("radius", "friction") and ERRORS * factor.error > UNSURE:
            text = (
                f"it is known to {100 * ERRORS * factor.error:.2g} % only, since these strokes are "
                "alike; longer ones would decide"
            )
            return Answer(OPEN, text)
        return factor


def stated_mass(data: Histories, stated: Stated) -> float | None:
    """Mass that all bearings support [kg]: of the map, or of the scene, whose mass is on one bearing; None: unknown."""
    if data.mass is not None or stated.mass is None:
        return data.mass
    return stated.mass * data.bearings


def thinned(values: Array) -> Array:
    """Some rows for a drawing, shape (k,) [unit of `values`]."""
    return values[:: -(-len(values) // SHOWN)]


def loop(case: AuditCase, row: int | None = None) -> Drawing:
    """Force over axial force against displacement, along the largest displacement, with the stated bounds."""
    data = case.data
    peak = int(np.hypot(*data.displacement.T).argmax())
    size = float(np.hypot(*data.displacement[peak])) or 1.0
    axis = data.displacement[peak] / size if size else np.array([1.0, 0.0])
    u, f = data.displacement @ axis, case.shear_ratio @ axis
    ends = np.array([u.min(), u.max()])
    bounds = [("stated", ends, ends / case.stated.radius + sign * case.stated.friction) for sign in (1, -1)]
    place = None if row is None else (1e3 * float(u[row]), float(f[row]))
    curves = [("data", 1e3 * thinned(u), thinned(f))] + [(n, 1e3 * x, y) for n, x, y in bounds]
    return Drawing(curves, "displacement [mm]", "force / axial force", place)


def course(label: str, time: Array, values: Array, y: str, row: int | None = None) -> Drawing:
    """A history over time; row: the one that the finding names."""
    place = None if row is None else (float(time[row]), float(values[row]))
    return Drawing([(label, thinned(time), thinned(values))], "time [s]", y, place)


def work_of(force: Array, displacement: Array) -> Array:
    """Work of the force since the start by the trapezoidal rule, (T,) [J]."""
    parts = 0.5 * ((force[1:] + force[:-1]) * np.diff(displacement, axis=0)).sum(axis=1)
    return np.append(0.0, np.cumsum(parts))


def si(value: float, unit: str) -> str:
    """A value with a prefix."""
    for size, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if abs(value) >= size:
            return f"{value / size:.4g} {prefix}{unit}"
    return f"{value:.4g} {unit}"
