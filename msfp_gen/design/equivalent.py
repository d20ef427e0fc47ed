"""Equivalent lateral procedure: displacement and base shear of an isolated mass from a spectrum (docs/bearing.md).

A bearing by its published backbone, a spectrum of 5 % damping and factors of damping come in; the displacement at which
the effective properties give it again goes out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import pi, sqrt
from typing import Any

import numpy as np

from msfp_gen.common.errors import InputError
from msfp_gen.common.tables import Table
from msfp_gen.design.effective import Effective, effective
from msfp_gen.motions.records.scaling import tabulated_spectrum
from msfp_gen.scene.fidelity import Backbone

Pairs = Sequence[tuple[float, float]]
POINTS = 400  # displacements among which the largest solution is looked for


def _interpolated(pairs: Pairs) -> Callable[[float], float]:
    ratios, factors = zip(*pairs, strict=True)
    return lambda damping: float(np.interp(damping, ratios, factors))


# Name -> factor B of a damping ratio, by which the spectrum of 5 % damping is divided, and the rule in words.
DAMPING: dict[str, tuple[Callable[[float], float], str]] = {
    "asce7": (
        _interpolated(
            ((0.02, 0.8), (0.05, 1.0), (0.10, 1.2), (0.20, 1.5), (0.30, 1.7), (0.40, 1.9), (0.50, 2.0)),
        ),
        "ASCE 7-10, table 17.5-1: B of 2, 5, 10, 20, 30, 40, 50 % = 0.8, 1.0, 1.2, 1.5, 1.7, 1.9, 2.0, linear between",
    ),
    "aashto": (lambda damping: min((damping / 0.05) ** 0.3, 1.7), "AASHTO: B = (beta/0.05)^0.3, at most 1.7"),
    "en1998": (
        lambda damping: 1 / max(sqrt(10 / (5 + 100 * damping)), 0.55),
        "EN 1998-1: 1/B = sqrt(10/(5 + beta [%])), at least 0.55",
    ),
}


def damping_table(pairs: Pairs) -> Callable[[float], float]:
    """The factor B of a damping ratio by a table of (damping ratio, B), linear between and constant beyond.

    Raises InputError unless ratios increase and all numbers are above zero.
    """
    table = [(float(ratio), float(factor)) for ratio, factor in pairs]
    ratios = [ratio for ratio, _ in table]
    if len(table) < 2 or min(min(pair) for pair in table) <= 0 or ratios != sorted(set(ratios)):
        raise InputError(f"damping = {table}: give pairs of increasing damping ratios and factors, all above 0")
    return _interpolated(table)


def damping_of(text: str) -> tuple[Callable[[float], float], str]:
    """The factor of a damping ratio by a name of `DAMPING`, or of pairs as in "0.05:1,0.1:1.2"; and the rule in words.

    Raises InputError.
    """
    if text in DAMPING:
        return DAMPING[text]
    try:
        pairs = [(float(ratio), float(factor)) for ratio, factor in (pair.split(":") for pair in text.split(","))]
    except ValueError:
        names = ", ".join(DAMPING)
        raise InputError(f"damping = {text!r}: give {names}, or pairs of ratio and factor, 0.05:1,0.1:1.2") from None
    return damping_table(pairs), f"B of damping ratios {text}, linear between"


@dataclass(frozen=True)
class Equivalent:
    """Result of `equivalent`.

    at: effective properties at the displacement; force is the base shear over the weight. acceleration: ordinate of the
    spectrum of 5 % damping at the effective period [m/s^2]. factor: B of the effective damping.
    """

    at: Effective
    acceleration: float
    factor: float


def equivalent(backbone: Backbone, spectrum: Pairs, factor: Callable[[float], float], gravity: float) -> Equivalent:
    """The displacement D = S_a(T_eff) (T_eff/2 pi)^2/B(beta_eff), with both at D; the largest, if several.

    Args:
        backbone: of the bearing, or of all bearings over their load.
        spectrum: periods [s] and pseudo-accelerations of 5 % damping [m/s^2].
        factor: B of a damping ratio: of `DAMPING`, or by `damping_table`.
        gravity: [m/s^2].

    Raises:
        InputError: the displacement is beyond the last rim, or the effective period beyond the spectrum.
    """
    from scipy.optimize import brentq

    def tried(displacement: float) -> tuple[float, Equivalent]:
        at = effective(backbone, displacement, gravity)
        if not spectrum[0][0] <= at.period <= spectrum[-1][0]:
            raise InputError(
                f"spectrum: the effective period at {displacement * 1e3:.4g} mm is {at.period:.4g} s; give a spectrum "
                f"beyond {spectrum[0][0]:g} to {spectrum[-1][0]:g} s"
            )
        ordinate = float(tabulated_spectrum(np.array([at.period]), tuple(spectrum))[0])
        found = Equivalent(at, ordinate, factor(at.damping))
        return ordinate * (at.period / (2 * pi)) ** 2 / found.factor - displacement, found

    capacity = backbone.capacity
    high = capacity
    excess, _ = tried(high)
    if excess > 0:
        raise InputError(
            f"spectrum: at the displacement capacity of {capacity * 1e3:.4g} mm it asks for {excess * 1e3:.4g} mm "
            "more; give a larger bearing"
        )
    for low in capacity * np.arange(POINTS - 1, 0, -1) / POINTS:
        if tried(float(low))[0] >= 0:
            break
        high = float(low)
    else:
        raise InputError(f"spectrum: it moves the bearing by less than {high * 1e3:.4g} mm, so the mass stays stuck")
    return tried(brentq(lambda displacement: tried(displacement)[0], float(low), high, xtol=1e-12 * capacity))[1]


def total_displacement(
    displacement: float, arm: float, eccentricity: float, width: float, depth: float, torsion_ratio: float = 1.0
) -> float:
    """Displacement of a corner with torsion: D_T = D (1 + y/P_T^2 12 e/(b^2 + d^2)) [m].

    Args:
        displacement: D at the centre of rigidity [m].
        arm: y, from the centre of rigidity to the corner, across the motion [m].
        eccentricity: e, actual and accidental [m].
        width: b, of the plan along the motion [m].
        depth: d, of the plan across it [m].
        torsion_ratio: P_T, effective translational period over torsional period of the isolation system.

    Raises InputError for a value out of range.
    """
    positive = {"displacement": displacement, "width": width, "depth": depth, "torsion_ratio": torsion_ratio}
    for name, value in positive.items():
        if not value > 0:
            raise InputError(f"{name} = {value:g}: give a number above 0")
    for name, value in {"arm": arm, "eccentricity": eccentricity}.items():
        if not value >= 0:
            raise InputError(f"{name} = {value:g}: give a number not below 0")
    return displacement * (1 + arm / torsion_ratio**2 * 12 * eccentricity / (width**2 + depth**2))


Arms = Sequence[float]  # y, e, b, d [m] and P_T of `total_displacement`
HistoryPeaks = tuple[
    float, float
]  # of response histories: largest displacement of a bearing [m], base shear over weight [-]


@dataclass(frozen=True)
class Given:
    """What the procedure is given, beside its backbones: for `as_dict` and `tables`.

    Attributes:
        load: axial load of the sheet [N].
        gravity: [m/s^2].
        friction: case of friction -> coefficients at the pivot, bottom first [-].
        spectrum: of 5 % damping, in words.
        damping: rule of the factor B, in words.
        bearings: of the building, in words; "" without one.
        weight: of the building on bearings that all have the backbone [N]; None without one.
        arms: of `total_displacement`; None: no total displacement.
        peaks: case of friction -> peaks of the response histories that are compared with it.
        history: whose peaks these are, in words.
    """

    load: float
    gravity: float
    friction: Mapping[str, Sequence[float]]
    spectrum: str
    damping: str
    bearings: str = ""
    weight: float | None = None
    arms: Arms | None = None
    peaks: Mapping[str, HistoryPeaks] = field(default_factory=dict)
    history: str = ""


def as_dict(found: Mapping[str, Equivalent], given: Given) -> dict[str, Any]:
    """Case of friction -> results in SI units, ready for JSON."""
    rows = {}
    for case, result in found.items():
        at = result.at
        row = rows[case] = {
            "displacement": at.displacement,
            "effective_period": at.period,
            "effective_damping": at.damping,
            "effective_stiffness": at.stiffness * given.load,
            "spectral_acceleration": result.acceleration,
            "damping_factor": result.factor,
            "base_shear": at.force * given.load,
            "base_shear_over_weight": at.force,
        }
        if given.weight is not None:
            row["building_base_shear"] = at.force * given.weight
        if given.arms is not None:
            row["total_displacement"] = total_displacement(at.displacement, *given.arms)
        if case in given.peaks:
            displacement, shear = given.peaks[case]
            row["history_displacement"], row["history_base_shear_over_weight"] = displacement, shear
            row["history_displacement_ratio"] = displacement / at.displacement
            row["history_base_shear_ratio"] = shear / at.force
            if given.arms is not None:
                row["history_total_displacement_ratio"] = displacement / row["total_displacement"]
    return rows


# Result -> label of its row, scale and format.
ROWS = {
    "displacement": ("displacement D [mm]", 1e3, ".1f"),
    "total_displacement": ("total displacement D_T [mm]", 1e3, ".1f"),
    "effective_period": ("effective period [s]", 1.0, ".3f"),
    "effective_damping": ("effective damping [%]", 100.0, ".2f"),
    "effective_stiffness": ("effective stiffness [kN/mm]", 1e-6, ".4g"),
    "spectral_acceleration": ("spectrum at this period, 5 % [m/s2]", 1.0, ".4g"),
    "damping_factor": ("damping factor B", 1.0, ".3f"),
    "base_shear": ("base shear of the bearing [kN]", 1e-3, ".4g"),
    "base_shear_over_weight": ("base shear over weight", 1.0, ".4f"),
    "building_base_shear": ("base shear of the building [MN]", 1e-6, ".4g"),
    "history_displacement": ("history: displacement of a bearing [mm]", 1e3, ".1f"),
    "history_displacement_ratio": ("history: this over D", 1.0, ".3f"),
    "history_total_displacement_ratio": ("history: this over D_T", 1.0, ".3f"),
    "history_base_shear_over_weight": ("history: base shear over weight", 1.0, ".4f"),
    "history_base_shear_ratio": ("history: this over V/W", 1.0, ".3f"),
}


def tables(name: str, found: Mapping[str, Equivalent], given: Given) -> list[Table]:
    """Results by case, and the formulas with their inputs."""
    cases = as_dict(found, given)
    rows = [
        (label, *(format(values[key] * scale, digits) if key in values else "-" for values in cases.values()))
        for key, (label, scale, digits) in ROWS.items()
        if any(key in values for values in cases.values())
    ]
    formulas = [
        ("displacement", "D = S_a(T_eff) (T_eff/2 pi)^2/B, by iteration; the largest solution"),
        ("effective", "k_eff = F(D)/D, T_eff = 2 pi sqrt(W/(g k_eff)), beta = loop area/(2 pi k_eff D^2)"),
        (
            "base shear",
            "V = k_eff D" + (", of the building (V/W) times its weight" if given.weight is not None else ""),
        ),
        ("damping factor", given.damping),
        ("spectrum of 5 % damping", given.spectrum),
        ("gravity g", f"{given.gravity:.6g} m/s2"),
        *(
            (f"friction at the pivot, {case}", ", ".join(f"{value:.4g}" for value in given.friction[case]))
            for case in found
        ),
        ("axial load W", f"{given.load / 1e3:.4g} kN"),
    ]
    if given.bearings:
        formulas.append(("bearings of the building", given.bearings))
    if given.arms is not None:
        y, e, b, d, *ratio = given.arms
        words = f"y = {y:g} m, e = {e:g} m, b = {b:g} m, d = {d:g} m, P_T = {ratio[0] if ratio else 1.0:g}"
        formulas.append(("total displacement", f"D_T = D (1 + y/P_T^2 12 e/(b^2 + d^2)), {words}"))
    if given.history:
        formulas.append(("response history", given.history))
    return [
        Table(f"{name}: equivalent lateral procedure", ("friction", *cases), rows),
        Table("formulas and inputs", (), formulas),
    ]
