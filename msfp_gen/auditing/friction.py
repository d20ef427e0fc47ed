"""Checks of the force of a bearing: its bound, and friction, curvature, heat and coupling while it slides."""

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
    loop,
    si,
    thinned,
)
from msfp_gen.auditing.driving import force_of, off_centre, shadow_scene
from msfp_gen.auditing.sliding import ERRORS, THEORY
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.simulation.simulate import simulate

COUPLING_FLOOR, HEAT_FLOOR = 0.15, 0.25  # of the parts that follow the axial force, and the temperature
DAMPING_FLOOR = 0.05  # force along the velocity over friction
HEATING = ("pvt", "pvtd")  # laws of which a model without heat is pv
ROUGH = 0.05  # irregularity of a sliding force over friction
SPIKE = 0.25  # one row off over friction


def friction_bound(case: AuditCase) -> Answer:
    """Force against the largest that friction and curvature give."""
    if lack := case.lacks("displacement", "force", "axial"):
        return lack
    data, stated = case.data, case.stated
    size = np.hypot(*data.displacement.T)
    judged = case.sliding.settled
    if judged.sum() < 2:
        text = "in all rows a slider is at its rim, or its surfaces may have parted just before; others would decide"
        return Answer(OPEN, text)
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
        return Answer(CONSISTENT, text, value, NONE, float(data.time[row]), loop(case, row))
    return Answer(INCONSISTENT, text, value, NONE, float(data.time[row]), loop(case, row))


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
        return Answer(INCONSISTENT, text, None, NONE, None, loop(case))
    implied = stated / factor.value
    text = f"the slope of the force while sliding implies a radius of {implied:.4g} m; the bearing has {stated:.4g} m"
    good = factor.agrees(1.0, FLOOR)
    return Answer(CONSISTENT if good else INCONSISTENT, text, implied, "m", None, loop(case))


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
    if not case.stated.rigid:
        return _heat_by_model(case)
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


def _heat_by_model(case: AuditCase) -> Answer:
    """Whether friction falls as in the full model, where surfaces slide in turn and heat by their own slip."""
    data, sliding, word = case.data, case.sliding, case.stated.law.word if case.stated.law else ""
    if word not in HEATING:
        return Answer(OPEN, f"which surfaces slide, and heat, does not follow from these columns under the law {word}")
    if case.parted:
        return Answer(
            OPEN, "surfaces may have parted, so that heat does not follow; rows without lift-off would decide"
        )
    if off_centre(data):
        return Answer(OPEN, "a model has to tell which surfaces slide, and heat; rows from the centre on would decide")
    scene = shadow_scene(data, case.stated)
    try:
        runs = [simulate(scene.with_effects(friction=one)) for one in (word, "pv")]
    except (InputError, RunError) as failure:
        return Answer(OPEN, f"a model has to tell which surfaces slide, and heat, and does not run: {failure}")
    rows = sliding.rows
    force, heated, cold = (sliding.along(one) for one in (data.force, *(force_of(run, data) for run in runs)))
    friction = cold - sliding.along(data.displacement) / case.stated.radius * data.axial[rows]
    parts = np.column_stack([friction, heated - cold])
    (level, share), *_ = np.linalg.lstsq(parts, force - cold + friction)
    scatter = np.hypot(np.std(force - cold + friction - parts @ [level, share]), THEORY * np.mean(np.abs(friction)))
    error = float(scatter * np.sqrt(np.linalg.pinv(parts.T @ parts)[1, 1] * len(rows) / (2 * sliding.strokes)))
    temperature = runs[0].history.temperature
    assert temperature is not None  # the law heats
    text = f"by the full model surfaces reach {temperature.max():.0f} °C and friction falls by up to "
    text += f"{100 * float(((cold - heated) / np.where(friction > 0, friction, np.inf)).max()):.2g} %"
    if ERRORS * error > 1.0 - HEAT_FLOOR:
        return Answer(OPEN, f"{text}: too little to decide")
    text += f"; the data have {share:.2g} of this fall"
    drawing = Drawing(
        [(name, data.time[rows], values / data.axial[rows]) for name, values in (("data less cold model", force - cold),
         ("heated less cold model", heated - cold))],
        "time [s]", "friction coefficient", None, True,
    )  # fmt: skip
    reach = HEAT_FLOOR + ERRORS * error
    if abs(share - 1.0) <= reach:
        return Answer(CONSISTENT, text, float(share), NONE, None, drawing)
    hint = ": nothing heats" if abs(share) <= reach else ""
    time = float(data.time[rows[(cold - heated).argmax()]])
    return Answer(INCONSISTENT, text + hint, float(share), NONE, time, drawing)


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
    text = f"{what} {si(abs(factor.value), 'N s/m')} times the velocity, at most {100 * abs(share):.2g} % of friction"
    if factor.agrees(0.0, DAMPING_FLOOR * level / float(speed.max())):
        return Answer(CONSISTENT, text, 100 * share, "%")
    rises = "damping of the structure acts in the bearing, or friction rises with velocity more than the law says"
    text += f": {'friction falls with velocity more than the law says' if falls else rises}"
    curve = sliding.implied - sliding.law.heated[sliding.rows]
    drawing = Drawing([("implied - law", speed, curve)], "velocity [m/s]", "friction coefficient", None, True)
    return Answer(INCONSISTENT, text, 100 * share, "%", float(data.time[row]), drawing)


def chatter(case: AuditCase) -> Answer:
    """Irregular force while sliding."""
    if lack := case.lacks("displacement", "force", "axial"):
        return lack
    sliding, data = case.sliding, case.data
    if not sliding.enough:
        return Answer(OPEN, sliding.lack)
    rows = sliding.rows
    # The law takes out what follows a ringing axial force by pressure.
    relative = 1.0 + (sliding.implied - sliding.law.heated[rows]) / max(float(sliding.law.cold[rows].mean()), 1e-12)
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
