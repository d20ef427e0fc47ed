"""Checks by mechanics alone: weight, inertia, tension, energy, travel, and the rise of the mass."""

from __future__ import annotations

import numpy as np

from msfp_gen.auditing.case import (
    BOUND_FLOOR,
    CONSISTENT,
    FLOOR,
    INCONSISTENT,
    NONE,
    OPEN,
    Answer,
    AuditCase,
    Drawing,
    course,
    si,
    thinned,
    work_of,
)
from msfp_gen.auditing.histories import Histories
from msfp_gen.auditing.momentum import momentum
from msfp_gen.auditing.sliding import CLOSED, NEAR_RIM
from msfp_gen.auditing.stated import Stated

TWICE, HALF = "twice the number", "half"
NO_TENSION = 1e-3  # tension over the load at rest that a stiff contact may have
HANGING = 2.0  # mean pull of a plate that hangs on its support, over its weight: at rest, and as it is caught
LEAST_VERTICAL = 0.005  # vertical acceleration over gravity from which on a mass follows from it
GIVEN_BACK = 0.01  # of the energy lost
WEIGHT_FLOOR = 0.05  # of the axial force at rest: bearings of one layout carry different shares
MULTIPLES = {2.0: TWICE, 0.5: HALF, 3.0: "three times the number", 1 / 3: "a third", 0.25: "a quarter"}


def weight(case: AuditCase) -> Answer:
    """Axial force at rest against the mass."""
    if lack := case.lacks("axial"):
        return lack
    if case.mass is None:
        return Answer(OPEN, "no mass is stated; give `mass` in the map, or a scene with a supported mass")
    if lack := case.lacks_rest():
        return lack
    carried = case.data.at_rest * case.data.bearings / case.stated.bearing.gravity
    ratio = carried / case.mass
    count = f"{case.data.bearings:g} bearing{'s' * (case.data.bearings != 1)}"
    text = (
        f"{count} of {si(case.data.at_rest, 'N')} at rest carry {carried:.4g} kg; the mass stated is {case.mass:.4g} kg"
    )
    drawing = course("axial force", case.data.time, case.data.axial / 1e3, "axial force [kN]")
    if abs(ratio - 1.0) <= WEIGHT_FLOOR + case.rest_error:
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
    if lack := case.lacks_rest():
        return lack
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
    if abs(ratio - 1.0) <= FLOOR + found.error + case.rest_error:
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
    if lack := case.lacks_rest():
        return lack
    ratio = found.mass * gravity / (data.at_rest * data.bearings)
    text = (
        f"axial force over vertical acceleration implies {found.mass:.4g} kg, {ratio:.3g} of what the "
        "weight at rest has"
    )
    drawing = Drawing(
        [("windows", found.acceleration, found.force)], "vertical acceleration [m/s²]", "axial force [N]", None, True
    )
    close = abs(ratio - 1.0) <= FLOOR + found.error + case.rest_error
    return Answer(CONSISTENT if close else INCONSISTENT, text, found.mass, "kg", None if close else found.time, drawing)


def tension(case: AuditCase) -> Answer:
    """Tension of the bearing."""
    if lack := case.lacks("axial"):
        return lack
    data = case.data
    row = int(data.axial.argmin())
    least = float(data.axial[row]) + 0.0  # of a turned column, -0.0 is 0.0
    drawing = course("axial force", data.time, data.axial / 1e3, "axial force, compression positive [kN]", row)
    if least >= -NO_TENSION * data.at_rest:
        text = f"the least axial force is a compression of {si(abs(max(least, 0.0)), 'N')}"
        return Answer(CONSISTENT, text, least, "N", float(data.time[row]), drawing)
    span = float((np.gradient(data.time) * (data.axial < -NO_TENSION * data.at_rest)).sum())
    text = f"the bearing pulls with up to {si(-least, 'N')}, in tension for {span:.3g} s in all"
    if not holds_down(data, case.stated):
        text += (
            "; the upper plate, which hangs on its support where surfaces part, and rims that are inclined pull so "
            "too: the force through the surfaces, at closer rows, would decide"
        )
        return Answer(OPEN, text, least, "N", float(data.time[row]), drawing)
    text += "; its surfaces transmit none and would have opened"
    return Answer(INCONSISTENT, text, least, "N", float(data.time[row]), drawing)


def holds_down(data: Histories, stated: Stated) -> bool:
    """Whether the bearing pulls more than its upper plate does, which hangs on its support where surfaces part.

    The impulse of the plate while surfaces are parted is its weight times this time, and the change of its velocity,
    which gravity makes too. A rim is normal to its dish, so that its force pulls by the slope of the dish.
    """
    pull = np.maximum(-data.axial - np.hypot(*data.force.T) * stated.steepest, 0.0)
    lasting = float(np.minimum(pull[1:], pull[:-1]) @ np.diff(data.time))  # a peak of a single row may be any time long
    parted = float((np.gradient(data.time) * data.below(CLOSED)).sum())
    plate = stated.bearing.bodies[-1].mass * stated.bearing.gravity
    return lasting > (HANGING * plate + NO_TENSION * data.at_rest) * parted


def energy(case: AuditCase) -> Answer:
    """Energy that the bearing dissipates."""
    if lack := case.lacks("displacement", "force", "axial"):
        return lack
    data, stated = case.data, case.stated
    if np.hypot(*data.displacement.T).max() > NEAR_RIM * stated.first_rim:
        return Answer(OPEN, "rims store energy too, which these columns do not tell apart; `msfp-gen shadow` does")
    closed = case.sliding.closed
    if not closed.any():
        return Answer(OPEN, "surfaces may have parted in every row; rows of smaller motion would decide")
    friction = (data.force - data.axial[:, None] * data.displacement / stated.radius) * closed[:, None]
    lost = work_of(friction, data.displacement)
    coarse = np.interp(data.time, data.time[::2], work_of(friction[::2], data.displacement[::2]))
    back = np.maximum.accumulate(lost) - lost
    row = int(back.argmax())
    # Links may tilt against each other by their friction, and stuck friction is elastic: both give energy back.
    most = max(link.friction for link in stated.links)
    stored = float(data.axial.max()) * (
        2.0 * stated.radius * most**2 * (not stated.rigid) + 2.0 * stated.friction * stated.yielding
    )
    error = float(np.abs(lost - coarse).max()) / 3.0
    permitted = 1.5 * stored + 3 * error + GIVEN_BACK * max(float(lost[-1]), 0.0)
    where = ", in rows in which its surfaces are closed" if case.parted else ""
    text = (
        f"the bearing dissipates {si(float(lost[-1]), 'J')}{where}; it gives back {si(float(back[row]), 'J')} at most, "
        f"where {si(permitted, 'J')} is permitted: one and a half times the {si(stored, 'J')} that links and stuck "
        f"friction store, the error of the rows, and {100 * GIVEN_BACK:g} % of the loss"
    )
    drawing = course("dissipated", data.time, lost / 1e3, "dissipated [kJ]", row)
    if back[row] <= permitted:
        return Answer(CONSISTENT, text, float(lost[-1]), "J", None, drawing)
    return Answer(INCONSISTENT, text + ": it makes energy", float(-back[row]), "J", float(data.time[row]), drawing)


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
    drawing = course("displacement", data.time, 1e3 * size, "displacement [mm]", row)
    most, verdict = stated.capacity * (1 + BOUND_FLOOR), CONSISTENT
    if size[row] > most and not data.missing("force", "axial"):
        # Rims are elastic, and their force is what friction and curvature leave.
        slides = data.axial[row] * (size[row] / stated.radius + stated.friction)
        most += max(float(np.hypot(*data.force[row])) - slides, 0.0) * sum(1.0 / link.rim for link in stated.links)
    if size[row] > most:
        parted = case.parted and data.below(CLOSED)[: row + 1].any()
        verdict = OPEN if parted or data.missing("force", "axial") else INCONSISTENT
        text += ": the rims were left out, or have no stiffness"
        text += ", or parted surfaces passed them" if parted else ""
        text += "; columns of the force would decide" if data.missing("force", "axial") else ""
    return Answer(verdict, text, float(size[row]), "m", float(data.time[row]), drawing)


def lift(case: AuditCase) -> Answer:
    """Rise of the mass on the dish."""
    if lack := case.lacks("displacement"):
        return lack
    data, stated = case.data, case.stated
    if "rise" not in data.columns:
        return Answer(OPEN, "no column rise, of the upper plate against the lower one; with it this can be decided")
    closed = case.sliding.closed  # lifted surfaces raise the mass too
    size, rise = np.hypot(*data.displacement.T)[closed], (data.columns["rise"] - data.columns["rise"][0])[closed]
    if len(size) < 2:
        return Answer(OPEN, "surfaces may have parted in every row; rows of smaller motion would decide")
    expected = size**2 / (2 * stated.radius)
    row = int(expected.argmax())
    if expected[row] < 1e-4 or np.std(rise) == 0 == np.std(expected):
        return Answer(OPEN, f"the mass rises by {1e3 * expected[row]:.2g} mm at most: too little to decide")
    # The axial force compresses the bearing.
    axial = data.axial[closed] / data.at_rest if "axial" in data.columns else 0.0 * size
    slope = float(np.linalg.lstsq(np.column_stack([expected, 0 * size + 1, axial - 1]), rise)[0][0])
    text = f"on the dish the mass rises by {1e3 * expected[row]:.3g} mm, u²/(2 L); the data have {slope:.2g} of it"
    drawing = Drawing(
        [
            ("data", thinned(1e3 * size), thinned(1e3 * rise)),
            ("u²/(2 L)", thinned(1e3 * size), thinned(1e3 * expected)),
        ],
        "displacement [mm]", "rise [mm]", (1e3 * float(size[row]), 1e3 * float(rise[row])), True,
    )  # fmt: skip
    time = float(data.time[closed][row])
    if slope >= 0.5:  # of links that tilt by different angles the rise is larger than of one
        return Answer(CONSISTENT, text, slope, NONE, time, drawing)
    return Answer(
        INCONSISTENT,
        f"{text}: the vertical motion is not coupled to the horizontal one",
        slope,
        NONE,
        time,
        drawing,
    )
