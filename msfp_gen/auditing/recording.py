"""Checks of the record itself: signs, units, distance of rows, values that were cut off."""

from __future__ import annotations

import numpy as np

from msfp_gen.auditing.case import CONSISTENT, INCONSISTENT, OPEN, Answer, AuditCase, course, loop, work_of
from msfp_gen.auditing.histories import Histories
from msfp_gen.common.arrays import Array

COARSE = 0.02  # error of the work of friction by the rows
PLATEAU = 5  # rows at an extreme value that are no accident


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
    work, half = work_of(data.force, data.displacement), work_of(data.force[::2], data.displacement[::2])
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
    if case.parted:
        return Answer(OPEN, f"{text}; surfaces may have parted, and land by impacts that are shorter", 100 * error, "%")
    text += f"; the bearing moves up to {1e3 * step[row]:.3g} mm between two rows: export rows at a smaller step"
    return Answer(INCONSISTENT, text, 100 * error, "%", float(data.time[row]), loop(case, row))


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
            drawing = course(name, data.time, data.columns[name], f"{name} [{unit}]", first)
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
