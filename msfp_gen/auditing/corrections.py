"""Signs and units of a file: what has to be turned or scaled before anything else can be read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from msfp_gen.auditing.case import BOUND_FLOOR, INCONSISTENT, OPEN, Answer, si, stated_mass
from msfp_gen.auditing.histories import Histories
from msfp_gen.auditing.momentum import momentum
from msfp_gen.auditing.sliding import CLOSED, ERRORS, Sliding
from msfp_gen.auditing.stated import Stated
from msfp_gen.common.arrays import Array
from msfp_gen.common.fields import G

AGAINST = 0.1  # work against the motion over the sum of its parts, from which on a sign is wrong
FAR = 1.5  # ratio from which on a unit is suspected
BEYOND = 5.0  # displacement over that of the last rim, which is no travel but another unit
CLOSE = 0.1  # difference of radius and friction with the right unit
LENGTHS = {1e3: "millimetres", 1e2: "centimetres", 39.3701: "inches", 3.28084: "feet", 1e-3: "kilometres"}
FORCES = {
    1e3: "newtons",
    1e-3: "kilonewtons",
    1e6: "newtons",
    1e-6: "meganewtons",
    0.2248089: "pounds",
    2.248089e-4: "kips",
    0.1019716: "kilogram-forces",
}


def corrected(data: Histories, stated: Stated) -> tuple[Histories, dict[str, Answer]]:
    """Histories with signs and units put right, and what was found."""
    found: dict[str, Answer] = {}
    no_weight = ""
    if data.weightless:
        no_weight = (
            f"the axial force at rest is {si(data.at_rest, 'N')}, so that the bearing carries nothing: the column is "
            "empty, or has the variation about the weight alone; it is left out of what follows"
        )
        data = replace(data, columns={name: values for name, values in data.columns.items() if name != "axial"})
    factors, texts, unsure = _signs(data)
    data = data.scaled(factors)
    if texts or no_weight:
        turned = ["; ".join(texts) + "; it is turned in what follows"] if texts else []
        found["signs"] = Answer(INCONSISTENT, "; ".join(filter(None, [no_weight, *turned])))
    elif unsure:
        text = f"{unsure} gives work in all, as the dish of a mass that bounces may do; rows without lift-off decide"
        found["signs"] = Answer(OPEN, text)
    factors, answer = _units(data, stated)
    if answer is not None:
        found["units"] = answer
    return data.scaled(factors), found


def _signs(data: Histories) -> tuple[dict[str, float], list[str], str]:
    """Columns to turn, and why; and those of which the data do not tell it, in words."""
    factors, texts = {}, []
    if "axial" in data.columns and data.at_rest < 0:
        factors["axial"] = -1.0
        texts.append("the axial force at rest is negative, where compression is positive")
    data = data.scaled(factors)
    parted = "axial" in data.columns and bool(data.below(CLOSED).any())
    turned, unsure = [], []
    for axis in (1, 2):
        names = (f"force_{axis}", f"displacement_{axis}")
        if all(name in data.columns for name in names):
            force, u = (data.columns[name] for name in names)
            parts = 0.5 * (force[1:] + force[:-1]) * np.diff(u)
            if parts.sum() >= -AGAINST * np.abs(parts).sum() - _stored(force, u):
                continue
            # The base lifts a mass that bounces, and the dish gives this work back: its slope decides the sign then.
            if parted and force @ u > 0:
                unsure.append(names[0])
            else:
                turned.append(names[0])
                factors[names[0]] = -1.0
    if turned:
        texts.append(f"{' and '.join(turned)} and displacement have opposite signs: the loop gives energy")
    return factors, texts, " and ".join(unsure)


def _stored(force: Array, displacement: Array) -> float:
    """Energy that curvature may give back between the ends of a record, by its own stiffness in any units."""
    if not np.ptp(displacement):
        return 0.0
    stiffness = np.polyfit(displacement, force, 1)[0]
    return float(abs(stiffness * (displacement[-1] ** 2 - displacement[0] ** 2)) / 2.0)


def _ratio(data: Histories, stated: Stated) -> float:
    """How far sizes are off: 1 where force, displacement and capacity fit together."""
    size = np.hypot(*data.displacement.T)
    sliding = Sliding(data, stated)
    closed = sliding.closed
    shear_ratio = np.hypot(*data.force[closed].T) / data.axial[closed]
    most = stated.friction + size[closed] / stated.radius
    inside = size[closed] < stated.first_rim
    beyond = float((shear_ratio / np.maximum(most, 1e-12))[inside].max()) if inside.any() else 1.0
    worst = max(beyond, float(size.max()) / stated.capacity / 2.0)
    if sliding.enough:
        factors = sliding.fit.factors
        for name in ("radius", "friction"):
            if name in factors:
                size, error = abs(factors[name].value), ERRORS * factors[name].error
                worst = max(worst, size - error, 1.0 / (size + error))
    return worst


def _units(data: Histories, stated: Stated) -> tuple[dict[str, float], Answer | None]:
    """Factors of columns in another unit, and what was found; None where all units fit."""
    whole = not data.missing("displacement", "force", "axial") and data.at_rest > 0
    ratio = _ratio(data, stated) if whole else 1.0
    found = _other_unit(data, stated) or _other_length(data, stated) if ratio > FAR else None
    found = found or _other_acceleration(data, stated)
    if found is not None:
        factors, text, value = found
        return factors, Answer(INCONSISTENT, f"{text}; it is put right in what follows", value)
    if ratio > FAR:
        text = (
            f"sizes differ from the bearing's by a factor of up to {ratio:.3g}, and no other unit of one "
            "quantity explains it; the other checks say what differs"
        )
        return {}, Answer(OPEN, text, ratio)
    return {}, None


def _other_acceleration(data: Histories, stated: Stated) -> tuple[dict[str, float], str, float] | None:
    """The unit of acceleration with which inertia and weight have the same mass; None: there is none."""
    inertia = momentum(data)
    if inertia is not None and inertia.one_mass and "axial" in data.columns:
        ratio = inertia.mass / (data.at_rest * data.bearings / stated.bearing.gravity)
        for factor, words in ((1.0 / G, "m/s², named g"), (G, "g, named m/s²")):
            if abs(ratio / factor - 1.0) < CLOSE:
                names = [name for name in data.columns if name.startswith(("acceleration", "position"))]
                text = f"shear over acceleration implies {ratio:.3g} of the mass: the acceleration looks like {words}"
                return dict.fromkeys(names, factor), text, factor
    return None


def _other_unit(data: Histories, stated: Stated) -> tuple[dict[str, float], str, float] | None:
    """The unit of one quantity with which radius and friction are those stated; None: there is none."""
    mass = stated_mass(data, stated)  # its weight tells apart units of force and of axial force that fit alike
    best: tuple[tuple[float, float], dict[str, float], str, float] | None = None
    for kind, units in (("displacement", LENGTHS), ("force", FORCES), ("axial", FORCES)):
        names = [name for name in data.columns if name.startswith(kind)]
        for factor, unit in units.items():
            other = data.scaled(dict.fromkeys(names, 1.0 / factor))
            fit = _fits(other, stated)
            if fit is None:
                continue
            carried = other.at_rest * other.bearings / stated.bearing.gravity
            off = (round(fit, 6), 0.0 if mass is None else abs(np.log(carried / mass)))
            if best is None or off < best[0]:
                what = "axial force" if kind == "axial" else kind
                text = f"the {what} is {factor:g} times what the bearing has: it looks like {unit} with another unit"
                best = (off, dict.fromkeys(names, 1.0 / factor), f"{text} named", factor)
    return None if best is None else best[1:]


def _other_length(data: Histories, stated: Stated) -> tuple[dict[str, float], str, float] | None:
    """The one unit in which a displacement far beyond the rims, of a motion that slides little, fits; None: not one."""
    most = float(np.hypot(*data.displacement.T).max())
    if most < BEYOND * stated.capacity:
        return None
    names = [name for name in data.columns if name.startswith("displacement")]
    fitting = [
        (dict.fromkeys(names, 1.0 / factor), factor, unit)
        for factor, unit in LENGTHS.items()
        if factor > 1.0 and _ratio(data.scaled(dict.fromkeys(names, 1.0 / factor)), stated) <= 1.0 + BOUND_FLOOR
    ]
    if len(fitting) != 1:
        return None
    [(factors, factor, unit)] = fitting
    text = (
        f"the displacement of {most:.4g} m is beyond the last rim, at {1e3 * stated.capacity:.4g} mm: it looks like "
        f"{unit} with another unit named"
    )
    return factors, text, factor


def _fits(data: Histories, stated: Stated) -> float | None:
    """Difference of radius and friction from the stated ones; None where it is not small."""
    sliding = Sliding(data, stated)
    if not sliding.enough:
        return None
    factors = sliding.fit.factors
    off: Array = np.abs([factors[name].value - 1.0 for name in ("radius", "friction") if name in factors])
    return float(off.max()) if len(off) == 2 and off.max() < CLOSE else None
