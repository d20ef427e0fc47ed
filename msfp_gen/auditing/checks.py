"""The checks of an audit: one function for each, over one table. Each is a physical statement about a bearing.

A threshold is a physical bound, an error that follows from the data, or one of the floors below, which state how far a
sound program may be from the balance of rigid links.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from msfp_gen.auditing.histories import Histories
from msfp_gen.auditing.momentum import Momentum, momentum
from msfp_gen.auditing.sliding import CLOSED, ERRORS, NEAR_RIM, FittedFactor, Sliding
from msfp_gen.auditing.stated import Stated
from msfp_gen.common.arrays import Array

CONSISTENT, INCONSISTENT, OPEN = "consistent", "inconsistent", "not decidable"
TWICE, HALF = "twice the number", "half"
FLOOR = 0.03  # of radius, friction and mass: compliance, weights of sliders, arrangement of a stack
BOUND_FLOOR = 0.05  # of the bound of friction: it is a single row, not a mean
COUPLING_FLOOR, HEAT_FLOOR = 0.15, 0.25  # of the parts that follow the axial force, and the temperature
DAMPING_FLOOR = 0.05  # force along the velocity over friction
NO_TENSION = 1e-3  # tension over the load at rest that a stiff contact may have
LEAST_VERTICAL = 0.005  # vertical acceleration over gravity from which on a mass follows from it
COARSE = 0.02  # error of the work of friction by the rows
UNSURE = 0.3  # error of radius and friction from which on nothing is said
GIVEN_BACK = 0.01  # of the energy lost
ROUGH = 0.05  # irregularity of a sliding force over friction
SPIKE = 0.25  # one row off over friction
PLATEAU = 5  # rows at an extreme value that are no accident
WEIGHT_FLOOR = 0.05  # of the axial force at rest: bearings of one layout carry different shares
MULTIPLES = {2.0: TWICE, 0.5: HALF, 3.0: "three times the number", 1 / 3: "a third", 0.25: "a quarter"}
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


def _loop(case: AuditCase, row: int | None = None) -> Drawing:
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


def _course(label: str, time: Array, values: Array, y: str, row: int | None = None) -> Drawing:
    place = None if row is None else (float(time[row]), float(values[row]))
    return Drawing([(label, thinned(time), thinned(values))], "time [s]", y, place)


def signs(case: AuditCase) -> Answer:
    """Signs of force, displacement and axial force."""
    if found := case.corrections.get("signs"):
        return found
    if lack := case.lacks("displacement", "force"):
        return lack
    text = "the bearing takes up work along every axis"
    if not case.lacks("axial"):
        text += ", and its axial force is a compression"
    return Answer(CONSISTENT, text)


def units(case: AuditCase) -> Answer:
    """Units of displacement, force and acceleration."""
    if found := case.corrections.get("units"):
        return found
    if lack := case.lacks("displacement", "force", "axial"):
        return lack
    return Answer(CONSISTENT, "sizes of displacement and force are of the order that the bearing has")


def sampling(case: AuditCase) -> Answer:
    """Distance of the rows against the motion."""
    if lack := case.lacks("displacement", "force"):
        return lack
    data = case.data
    work, half = _work(data.force, data.displacement), _work(data.force[::2], data.displacement[::2])
    straight = _interpolated(data.force)
    if straight:
        text = (
            f"the force is straight between every {straight}th row, so that the rows were interpolated from a step of "
            f"{straight * data.step:.3g} s: velocity and friction between them do not come from the analysis"
        )
        return Answer(INCONSISTENT, text, straight * data.step, "s")
    if not work[-1]:
        return Answer(OPEN, "the bearing did no work; rows of a motion would decide")
    error = abs(work[-1] - half[-1]) / abs(work[-1]) / 3.0  # of the trapezoidal rule, by Richardson
    step = np.hypot(*np.diff(data.displacement, axis=0).T)
    row = int(step.argmax())
    text = f"the work of friction by these rows, {data.step:.3g} s apart, is exact to {100 * error:.2g} %"
    if error <= COARSE:
        return Answer(CONSISTENT, text, 100 * error, "%")
    text += f"; the bearing moves up to {1e3 * step[row]:.3g} mm between two rows: export rows at a smaller step"
    return Answer(INCONSISTENT, text, 100 * error, "%", float(data.time[row]), _loop(case, row))


def _work(force: Array, displacement: Array) -> Array:
    """Work of the force since the start by the trapezoidal rule, (T,) [J]."""
    parts = 0.5 * ((force[1:] + force[:-1]) * np.diff(displacement, axis=0)).sum(axis=1)
    return np.append(0.0, np.cumsum(parts))


def _interpolated(force: Array) -> int:
    """Number of rows in which a force is straight again and again; 0: it is not."""
    values = force[:, int(np.ptp(force, axis=0).argmax())]
    bend = np.abs(values[2:] - 2 * values[1:-1] + values[:-2])
    size = float(np.ptp(values))
    moving = np.abs(values[2:] - values[:-2]) > 1e-6 * size
    corners = np.flatnonzero((bend > 1e-9 * size) & moving)
    if not size or len(corners) < 10 or moving.sum() < 3 * len(corners):
        return 0
    gaps = np.diff(corners)
    usual = int(np.median(gaps))
    return usual if usual >= 3 and np.mean(gaps % usual == 0) > 0.9 else 0


def clipped(case: AuditCase) -> Answer:
    """Values that stop at a limit."""
    if lack := case.lacks("displacement", "force"):
        return lack
    data = case.data
    names = [n for n in data.columns if n.startswith(("force", "displacement", "axial", "acceleration"))]
    for name in names:
        if (found := _plateau(data, name)) is not None:
            first, last, value = found
            unit = {"force": "N", "axial": "N", "acceleration": "m/s^2"}.get(name.split("_")[0], "m")
            text = (
                f"{name} stays at {value:.6g} {unit} in {last - first + 1} rows from "
                f"{data.time[first]:.4g} s on and is "
                "entered and left at full rate: it was cut off at a limit of the program or of the recorder"
            )
            drawing = _course(name, data.time, data.columns[name], f"{name} [{unit}]", first)
            return Answer(INCONSISTENT, text, value, unit, float(data.time[first]), drawing)
    return Answer(CONSISTENT, "no column is cut off at its largest or smallest value")


def _plateau(data: Histories, name: str) -> tuple[int, int, float] | None:
    """First and last row and value of a plateau at an extreme that is entered and left at full rate."""
    values = data.columns[name]
    size = float(np.ptp(values))
    rates = np.abs(np.diff(values))
    for value in (values.max(), values.min()) if size else ():
        at = np.abs(values - value) <= 1e-12 * size
        edges = np.flatnonzero(np.diff(np.concatenate([[0], at.astype(int), [0]])))
        for first, end in zip(edges[::2], edges[1::2], strict=True):
            if end - first < PLATEAU or first < 3 or end > len(values) - 3 or abs(value) <= 1e-9 * size:
                continue
            # The last whole steps before and after it, against the change of such steps elsewhere.
            before, after = rates[first - 2], rates[end]
            bends = np.abs(np.diff(rates[rates > 0])) if np.any(rates > 0) else np.zeros(1)
            usual = float(np.median(bends))
            others = [n for n in ("displacement_1", "displacement_2", "force_1", "force_2") if n in data.columns]
            other = [n for n in others if n.split("_")[0] != name.split("_")[0]]
            varies = any(np.ptp(data.columns[n][first:end]) > 0.02 * np.ptp(data.columns[n]) for n in other)
            if min(before, after) > 5.0 * usual and min(before, after) > 1e-4 * size and varies:
                return int(first), int(end) - 1, float(value)
    return None


def weight(case: AuditCase) -> Answer:
    """Axial force at rest against the mass."""
    if lack := case.lacks("axial"):
        return lack
    if case.mass is None:
        return Answer(OPEN, "no mass is stated; give `mass` in the map, or a scene with a supported mass")
    carried = case.data.at_rest * case.data.bearings / case.stated.bearing.gravity
    ratio = carried / case.mass
    count = f"{case.data.bearings:g} bearing{'s' * (case.data.bearings != 1)}"
    text = (
        f"{count} of {_si(case.data.at_rest, 'N')} at rest carry {carried:.4g} kg; the mass stated is "
        f"{case.mass:.4g} kg"
    )
    drawing = _course("axial force", case.data.time, case.data.axial / 1e3, "axial force [kN]")
    if abs(ratio - 1.0) <= WEIGHT_FLOOR:
        return Answer(CONSISTENT, text, ratio, NONE)
    if case.data.bearings > 1 and not _multiple(ratio):
        return Answer(OPEN, f"{text}, {ratio:.3g} of it: bearings need not share it equally", ratio, NONE)
    hint = f": {_multiple(ratio)} of the bearings, or of the mass, took part" if _multiple(ratio) else ""
    return Answer(INCONSISTENT, f"{text}, {ratio:.3g} of it{hint}", ratio, NONE, None, drawing)


def _multiple(ratio: float) -> str:
    """Words for a ratio near a small whole number or its inverse."""
    return next((word for value, word in MULTIPLES.items() if abs(ratio / value - 1) < WEIGHT_FLOOR), "")


def mass(case: AuditCase) -> Answer:
    """Inertia: shear over acceleration against the weight."""
    if lack := case.lacks("force", "axial"):
        return lack
    found = case.momentum
    if found is None:
        return Answer(OPEN, "no column acceleration of the supported mass, nor its position; with one this is decided")
    if not found.one_mass:
        text = (
            f"force and acceleration are proportional only to {100 * found.correlation**2:.3g} % "
            "(squared correlation): "
            "the acceleration does not belong to all the mass above; a column of the mean acceleration would decide"
        )
        return Answer(OPEN, text, found.correlation**2, NONE)
    carried = case.data.at_rest * case.data.bearings / case.stated.bearing.gravity
    expected, source = (carried, "the weight on the bearings") if case.mass is None else (case.mass, "the mass stated")
    implied, ratio = found.mass, found.mass / carried
    text = f"shear over acceleration implies {implied:.4g} kg, the weight on the bearings at rest {carried:.4g} kg"
    if case.mass is not None:
        text += f", the mass stated is {expected:.4g} kg"
    slope = np.sign(found.correlation) * expected  # the force of other programs may be the one on the mass
    drawing = Drawing(
        [("windows", found.acceleration, found.force), (source, found.acceleration, slope * found.acceleration)],
        "acceleration [m/s²]", "force of all bearings [N]",
        (float(found.acceleration[found.row]), float(found.force[found.row])), True,
    )  # fmt: skip
    if abs(ratio - 1.0) <= FLOOR + found.error:
        return Answer(CONSISTENT, text, implied, "kg", None, drawing)
    hint = {TWICE: "inertia acts twice", HALF: "half of the inertia acts"}.get(_multiple(ratio), "")
    hint = hint or f"the inertia that acts is {ratio:.3g} of what the weight has"
    return Answer(INCONSISTENT, f"{text}: {hint}", implied, "kg", found.time, drawing)


def vertical_mass(case: AuditCase) -> Answer:
    """Axial force against vertical acceleration."""
    if lack := case.lacks("axial"):
        return lack
    data, gravity = case.data, case.stated.bearing.gravity
    found = momentum(data, vertical=True)
    if found is None:
        return Answer(OPEN, "no column acceleration_3 or position_3 of the supported mass; with one this is decided")
    if found.spread < LEAST_VERTICAL * gravity:
        return Answer(OPEN, f"the vertical acceleration is {found.spread:.2g} m/s² RMS: too little to decide")
    if not found.one_mass:
        return Answer(
            OPEN,
            "the axial force does not follow this vertical acceleration; one of the mass on this bearing would decide",
        )
    ratio = found.mass * gravity / (data.at_rest * data.bearings)
    text = (
        f"axial force over vertical acceleration implies {found.mass:.4g} kg, {ratio:.3g} of what the "
        "weight at rest has"
    )
    drawing = Drawing(
        [("windows", found.acceleration, found.force)], "vertical acceleration [m/s²]", "axial force [N]", None, True
    )
    close = abs(ratio - 1.0) <= FLOOR + found.error
    return Answer(CONSISTENT if close else INCONSISTENT, text, found.mass, "kg", None if close else found.time, drawing)


def tension(case: AuditCase) -> Answer:
    """Tension of the bearing."""
    if lack := case.lacks("axial"):
        return lack
    data = case.data
    row = int(data.axial.argmin())
    least = float(data.axial[row])
    drawing = _course("axial force", data.time, data.axial / 1e3, "axial force, compression positive [kN]", row)
    if least >= -NO_TENSION * data.at_rest:
        return Answer(
            CONSISTENT,
            f"the least axial force is a compression of {_si(abs(max(least, 0.0)), 'N')}",
            least,
            "N",
            float(data.time[row]),
            drawing,
        )
    rows = data.axial < -NO_TENSION * data.at_rest
    span = float((np.gradient(data.time) * rows).sum())
    text = (
        f"the bearing pulls with up to {_si(-least, 'N')}, in tension for {span:.3g} s in all; its "
        "surfaces transmit none "
        "and would have opened"
    )
    return Answer(INCONSISTENT, text, least, "N", float(data.time[row]), drawing)


def friction_bound(case: AuditCase) -> Answer:
    """Force against the largest that friction and curvature give."""
    if lack := case.lacks("displacement", "force", "axial"):
        return lack
    data, stated = case.data, case.stated
    size = np.hypot(*data.displacement.T)
    judged = (data.axial > CLOSED * data.at_rest) & (size < NEAR_RIM * stated.first_rim)
    if judged.sum() < 2:
        return Answer(OPEN, "the slider is at its rims in all rows; rows of smaller displacement would decide")
    needed = _needed(case)
    most = float(case.sliding.law.cold[judged].max())
    # Theories of large angles differ by as much as the slope of the dish by sine and by tangent.
    sine = np.minimum(size / stated.radius, 0.7)
    beyond = needed - sine * (1.0 / np.sqrt(1.0 - sine**2) - 1.0)
    row = int(np.where(judged, beyond, -1.0).argmax())
    value = float(needed[row])
    text = (
        f"force and displacement need a friction coefficient of up to {value:.4g}; the bearing has at most {most:.4g}"
    )
    if beyond[row] <= most * (1.0 + BOUND_FLOOR):
        return Answer(CONSISTENT, text, value, NONE, float(data.time[row]), _loop(case, row))
    return Answer(INCONSISTENT, text, value, NONE, float(data.time[row]), _loop(case, row))


def _needed(case: AuditCase) -> Array:
    """Friction coefficient that every row needs at least, by small or by large angles, (T,) [-]."""
    data, radius = case.data, case.stated.radius
    tilt = np.arcsin(np.clip(np.hypot(*data.displacement.T) / radius, 0.0, 0.9))
    small = case.shear_ratio - data.displacement / radius
    large = (case.shear_ratio - data.displacement / radius / np.cos(tilt)[:, None]) * np.cos(tilt)[:, None]
    large = large / np.hypot(1.0, np.hypot(*case.shear_ratio.T))[:, None]
    least: Array = np.minimum(np.hypot(*small.T), np.hypot(*large.T))
    return least


def friction(case: AuditCase) -> Answer:
    """Friction coefficient while sliding, against the law."""
    factor = case.fitted("friction")
    if isinstance(factor, Answer):
        return factor
    sliding, stated = case.sliding, case.stated
    low, high = np.quantile(sliding.implied, [0.05, 0.95])
    speed = np.hypot(*case.data.velocity.T)[sliding.rows]
    text = (
        f"sliding implies coefficients of {low:.4g} to {high:.4g} (5 to 95 % of rows at {speed.min():.2g} to "
        f"{speed.max():.2g} m/s), {factor.value:.3g} of what the law gives"
    )
    times = case.data.time[sliding.rows]
    drawing = Drawing(
        [("implied", times, sliding.implied), ("law, cold", times, sliding.law.cold[sliding.rows])],
        "time [s]", "friction coefficient", None, True,
    )  # fmt: skip
    if factor.agrees(1.0, FLOOR):
        return Answer(CONSISTENT, text, factor.value, NONE, None, drawing)
    ratio = stated.pivot_ratio
    hints = {
        ratio: "as if the coefficients of the surfaces acted at the pivot, without the lever arm of its height",
        1.0 / ratio: "as if coefficients that refer to the pivot were taken at the surfaces",
    }
    hint = next(
        (words for at, words in hints.items() if abs(at - 1.0) > FLOOR and factor.agrees(at, 0.5 * abs(at - 1.0))), ""
    )
    worst = int(sliding.rows[np.abs(sliding.implied - sliding.law.heated[sliding.rows]).argmax()])
    return Answer(
        INCONSISTENT, f"{text}{': ' + hint if hint else ''}", factor.value, NONE, float(case.data.time[worst]), drawing
    )


def radius(case: AuditCase) -> Answer:
    """Curvature: slope of the force while sliding."""
    factor = case.fitted("radius")
    if isinstance(factor, Answer):
        return factor
    stated = case.stated.radius
    if factor.value <= 0.0:
        text = f"while sliding the force does not rise with displacement; the bearing has a radius of {stated:.4g} m"
        return Answer(INCONSISTENT, text, None, NONE, None, _loop(case))
    implied = stated / factor.value
    text = f"the slope of the force while sliding implies a radius of {implied:.4g} m; the bearing has {stated:.4g} m"
    good = factor.agrees(1.0, FLOOR)
    return Answer(CONSISTENT if good else INCONSISTENT, text, implied, "m", None, _loop(case))


def heat(case: AuditCase) -> Answer:
    """Whether friction falls as the surfaces heat."""
    if lack := case.lacks("displacement", "force", "axial"):
        return lack
    sliding = case.sliding
    if not sliding.enough:
        return Answer(OPEN, sliding.lack)
    law, data, rows = sliding.law, case.data, sliding.rows
    if law.temperature is None:
        return _drift(case)
    if case.stated.bearing.layout.n > 3:
        return Answer(
            OPEN, "which surfaces slide, and heat, does not follow from these columns; `msfp-gen shadow` computes it"
        )
    hottest = float(law.temperature.max())
    if np.array_equal(law.heated, law.cold):
        return _drift(case)
    fall = float(1.0 - (law.heated[rows] / law.cold[rows]).min())
    factor = sliding.fit.factors.get("heat")
    if factor is None or ERRORS * factor.error > 1.0 - HEAT_FLOOR:
        return Answer(
            OPEN,
            f"by the law the surface reaches {hottest:.0f} °C and loses {100 * fall:.2g} % of "
            "friction: too little to decide",
        )
    text = (
        f"by the law the surface reaches {hottest:.0f} °C and loses {100 * fall:.2g} % of its friction; the data have "
        f"{factor.value:.2g} of this fall"
    )
    times = data.time[rows]
    drawing = Drawing(
        [
            ("implied / cold", times, sliding.implied / law.cold[rows]),
            ("law / cold", times, law.heated[rows] / law.cold[rows]),
        ],
        "time [s]", "factor of temperature", None, True,
    )  # fmt: skip
    if factor.agrees(1.0, HEAT_FLOOR):
        return Answer(CONSISTENT, text, factor.value, NONE, None, drawing)
    hint = ": nothing heats" if factor.agrees(0.0, HEAT_FLOOR) else ""
    return Answer(INCONSISTENT, text + hint, factor.value, NONE, float(data.time[law.temperature.argmax()]), drawing)


def _drift(case: AuditCase) -> Answer:
    """Change of the implied coefficient over the record, where the law has no temperature."""
    sliding = case.sliding
    work = np.cumsum(np.append(0.0, np.hypot(*np.diff(case.data.displacement, axis=0).T)))[sliding.rows]
    share = (work - work.mean()) / (np.ptp(work) or 1.0)
    relative = sliding.implied / sliding.law.cold[sliding.rows]
    slope, middle = np.polyfit(share, relative, 1)
    residual = float(np.std(relative - middle - slope * share))
    error = residual / (np.std(share) or 1.0) / np.sqrt(2 * sliding.strokes)
    text = (
        f"the coefficient changes by {100 * slope:+.2g} % over the path of {np.ptp(work):.3g} m; by the "
        "law friction does not depend on heat"
    )
    if abs(slope) <= 2 * FLOOR + 3 * error:
        return Answer(CONSISTENT, text, float(slope), NONE)
    drawing = Drawing(
        [("implied / law", case.data.time[sliding.rows], relative)], "time [s]", "friction over law", None, True
    )
    return Answer(INCONSISTENT, text, float(slope), NONE, None, drawing)


def coupling(case: AuditCase) -> Answer:
    """Whether the horizontal force follows the axial force at every instant."""
    factor = case.fitted("coupling")
    if isinstance(factor, Answer):
        return factor
    data, rows = case.data, case.sliding.rows
    spread = float(np.std(data.axial[rows]) / data.at_rest)
    text = (
        f"the axial force varies by {100 * spread:.2g} % RMS; the horizontal force has "
        f"{factor.value:.2g} of this variation"
    )
    if ERRORS * factor.error > 1.0 - COUPLING_FLOOR:
        return Answer(OPEN, f"{text}, +- {ERRORS * factor.error:.2g}: too little to decide", factor.value, NONE)
    if factor.agrees(1.0, COUPLING_FLOOR):
        return Answer(CONSISTENT, text, factor.value, NONE)
    worst = int(rows[np.abs(data.axial[rows] - data.at_rest).argmax()])
    hint = ": friction and stiffness belong to a constant axial force" if factor.agrees(0.0, COUPLING_FLOOR) else ""
    drawing = Drawing(
        [("axial force / at rest", thinned(data.time), thinned(data.axial / data.at_rest))],
        "time [s]", "axial force / at rest",
        (float(data.time[worst]), float(data.axial[worst] / data.at_rest)),
    )  # fmt: skip
    return Answer(INCONSISTENT, text + hint, factor.value, NONE, float(data.time[worst]), drawing)


def damping(case: AuditCase) -> Answer:
    """Force along the velocity beside friction."""
    factor = case.fitted("damping")
    if isinstance(factor, Answer):
        return factor
    sliding, data = case.sliding, case.data
    speed = sliding.along(data.velocity)
    row = int(sliding.rows[speed.argmax()])
    level = float(np.mean(sliding.law.heated[sliding.rows])) * data.at_rest
    share = factor.value * float(speed.max()) / level
    falls = factor.value < 0.0
    what = "friction is less than by the law, by" if falls else "beside friction acts a force of"
    text = f"{what} {_si(abs(factor.value), 'N s/m')} times the velocity, at most {100 * abs(share):.2g} % of friction"
    if factor.agrees(0.0, DAMPING_FLOOR * level / float(speed.max())):
        return Answer(CONSISTENT, text, 100 * share, "%")
    rises = "damping of the structure acts in the bearing, or friction rises with velocity more than the law says"
    text += f": {'friction falls with velocity more than the law says' if falls else rises}"
    curve = sliding.implied - sliding.law.heated[sliding.rows]
    drawing = Drawing([("implied - law", speed, curve)], "velocity [m/s]", "friction coefficient", None, True)
    return Answer(INCONSISTENT, text, 100 * share, "%", float(data.time[row]), drawing)


def energy(case: AuditCase) -> Answer:
    """Energy that the bearing dissipates."""
    if lack := case.lacks("displacement", "force", "axial"):
        return lack
    data, stated = case.data, case.stated
    if np.hypot(*data.displacement.T).max() > NEAR_RIM * stated.first_rim:
        return Answer(OPEN, "rims store energy too, which these columns do not tell apart; `msfp-gen shadow` does")
    spring = data.axial[:, None] * data.displacement / stated.radius
    lost = _work(data.force - spring, data.displacement)
    coarse = np.interp(data.time, data.time[::2], _work((data.force - spring)[::2], data.displacement[::2]))
    back = np.maximum.accumulate(lost) - lost
    row = int(back.argmax())
    # Links may tilt against each other by their friction, and stuck friction is elastic: both give energy back.
    most = max(link.friction for link in stated.links)
    stored = float(data.axial.max()) * (
        2.0 * stated.radius * most**2 * (not stated.rigid) + 2.0 * stated.friction * stated.yielding
    )
    error = float(np.abs(lost - coarse).max()) / 3.0
    permitted = 1.5 * stored + 3 * error + GIVEN_BACK * max(float(lost[-1]), 0.0)
    text = (
        f"the bearing dissipates {_si(float(lost[-1]), 'J')}; it gives back {_si(float(back[row]), 'J')} at most, "
        f"where {_si(permitted, 'J')} is permitted: one and a half times the {_si(stored, 'J')} that links and stuck "
        f"friction store, the error of the rows, and {100 * GIVEN_BACK:g} % of the loss"
    )
    drawing = _course("dissipated", data.time, lost / 1e3, "dissipated [kJ]", row)
    if back[row] <= permitted:
        return Answer(CONSISTENT, text, float(lost[-1]), "J", None, drawing)
    return Answer(INCONSISTENT, text + ": it makes energy", float(-back[row]), "J", float(data.time[row]), drawing)


def chatter(case: AuditCase) -> Answer:
    """Irregular force while sliding."""
    if lack := case.lacks("displacement", "force", "axial"):
        return lack
    sliding, data = case.sliding, case.data
    if not sliding.enough:
        return Answer(OPEN, sliding.lack)
    rows = sliding.rows
    relative = sliding.implied / max(float(sliding.law.cold[rows].mean()), 1e-12)
    whole = (np.diff(rows[:-1]) == 1) & (np.diff(rows[1:]) == 1)
    bends = ((relative[2:] - 2 * relative[1:-1] + relative[:-2]) / 2.0)[whole]
    if len(bends) < 10:
        return Answer(OPEN, "strokes of three rows and more would decide")
    middle = rows[1:-1][whole]
    rough, worst = float(np.sqrt(np.mean(bends**2))), int(np.abs(bends).argmax())
    usual = float(np.median(np.abs(bends)))
    time = float(data.time[middle[worst]])
    drawing = Drawing([("implied / law", data.time[rows], relative)], "time [s]", "friction over law", None, True)
    most = float(np.abs(bends[worst]))
    text = (
        f"from row to row the sliding force is off its course by {100 * rough:.2g} % RMS of friction, "
        f"{100 * most:.2g} % at most"
    )
    if rough > ROUGH and usual > 0.2 * rough:
        return Answer(
            INCONSISTENT,
            f"{text}: it chatters at the step of the rows, above {0.25 / data.step:.3g} Hz",
            100 * rough,
            "%",
            time,
            drawing,
        )
    if most > max(SPIKE, 8 * usual):
        count = int((np.abs(bends) > max(SPIKE, 8 * usual)).sum())
        return Answer(
            INCONSISTENT, f"{text}: {count} spike{'s' * (count > 1)} of single rows", 100 * most, "%", time, drawing
        )
    return Answer(CONSISTENT, text, 100 * rough, "%")


def travel(case: AuditCase) -> Answer:
    """Displacement against the rims."""
    if lack := case.lacks("displacement"):
        return lack
    data, stated = case.data, case.stated
    size = np.hypot(*data.displacement.T)
    row = int(size.argmax())
    text = (
        f"the largest displacement is {1e3 * size[row]:.4g} mm; the last slider meets its rim at "
        f"{1e3 * stated.capacity:.4g} mm"
    )
    drawing = _course("displacement", data.time, 1e3 * size, "displacement [mm]", row)
    if size[row] <= stated.capacity * (1 + BOUND_FLOOR):
        return Answer(CONSISTENT, text, float(size[row]), "m", float(data.time[row]), drawing)
    return Answer(
        INCONSISTENT,
        f"{text}: the rims were left out, or have no stiffness",
        float(size[row]),
        "m",
        float(data.time[row]),
        drawing,
    )


def lift(case: AuditCase) -> Answer:
    """Rise of the mass on the dish."""
    if lack := case.lacks("displacement"):
        return lack
    data, stated = case.data, case.stated
    if "rise" not in data.columns:
        return Answer(OPEN, "no column rise, of the upper plate against the lower one; with it this can be decided")
    size = np.hypot(*data.displacement.T)
    expected = size**2 / (2 * stated.radius)
    row = int(expected.argmax())
    rise = data.columns["rise"] - data.columns["rise"][0]
    if expected[row] < 1e-4 or np.std(rise) == 0 == np.std(expected):
        return Answer(OPEN, f"the mass rises by {1e3 * expected[row]:.2g} mm at most: too little to decide")
    slope = float(np.polyfit(expected, rise, 1)[0])
    text = f"on the dish the mass rises by {1e3 * expected[row]:.3g} mm, u²/(2 L); the data have {slope:.2g} of it"
    drawing = Drawing(
        [
            ("data", thinned(1e3 * size), thinned(1e3 * rise)),
            ("u²/(2 L)", thinned(1e3 * size), thinned(1e3 * expected)),
        ],
        "displacement [mm]", "rise [mm]", (1e3 * float(size[row]), 1e3 * float(rise[row])), True,
    )  # fmt: skip
    # Of links that tilt by different angles the rise is larger than of one; lifted surfaces raise it too.
    if slope >= 0.5:
        return Answer(CONSISTENT, text, slope, NONE, float(data.time[row]), drawing)
    return Answer(
        INCONSISTENT,
        f"{text}: the vertical motion is not coupled to the horizontal one",
        slope,
        NONE,
        float(data.time[row]),
        drawing,
    )


def _si(value: float, unit: str) -> str:
    """A value with a prefix."""
    for size, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if abs(value) >= size:
            return f"{value / size:.4g} {prefix}{unit}"
    return f"{value:.4g} {unit}"


Check = Callable[[AuditCase], Answer]
CHECKS: dict[str, tuple[str, Check]] = {
    "signs": ("signs of force, displacement and axial force", signs),
    "units": ("units", units),
    "sampling": ("distance of rows", sampling),
    "clipped": ("values cut off", clipped),
    "weight": ("weight on the bearings", weight),
    "mass": ("inertia: shear over acceleration", mass),
    "vertical_mass": ("inertia: axial force over vertical acceleration", vertical_mass),
    "tension": ("tension", tension),
    "friction_bound": ("force within friction and curvature", friction_bound),
    "friction": ("friction coefficient while sliding", friction),
    "radius": ("curvature", radius),
    "heat": ("heat", heat),
    "coupling": ("horizontal force follows the axial force", coupling),
    "damping": ("force along the velocity", damping),
    "energy": ("energy", energy),
    "chatter": ("chatter and spikes", chatter),
    "travel": ("travel", travel),
    "lift": ("rise on the dish", lift),
}
"""Key of a check -> its title, and its function; in the order of tables."""
