"""Rates of the friction state by the hysteresis laws: Bouc-Wen (3.18) and elastic-perfectly plastic."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import sympy as sp

from msfp_gen.specification.hysteresis import HYSTERESIS, is_plastic

from .functions import Step
from .program import Program

Symbols = dict[str, Any]
ON_THE_EDGE = sp.Float("1e-9")
"""A friction state is on the edge of the unit disc if 1 less its square is at most this."""


@dataclass(frozen=True)
class Shear:
    """Friction state of a contact, and the data from which its rates follow.

    Attributes:
        Y, Z: friction state.
        before: Y and Z that the earlier stages of a step give.
        tau: sum of the diagonal entry of the stage formula and the damping time T; T outside of a step [s].
        kept: derivative of the friction state with respect to the friction force over -mu N.
    """

    Y: sp.Expr
    Z: sp.Expr
    before: tuple[sp.Expr, sp.Expr]
    tau: sp.Expr
    kept: sp.Expr


def friction_rates(p: Program, law: str, shear: Shear, u: sp.Expr, v: sp.Expr, dy: sp.Expr) -> Symbols:
    """dY/dt and dZ/dt of a hysteresis law at the slip velocity u, v; `dy` is the yield displacement.

    YY, YZ, ZY, ZZ are their derivatives with respect to Y and Z at constant slip velocity. An implicit stage solves for
    Y and Z with them. `plastic` is the velocity of plastic slip; `plastic_Y`, `plastic_Z` are its derivatives.
    """
    return (plastic_rates if is_plastic(law) else partial(bouc_wen_rates, law))(p, shear, u, v, dy)


def bouc_wen_rates(law: str, p: Program, shear: Shear, u: sp.Expr, v: sp.Expr, dy: sp.Expr) -> Symbols:
    """dY/dt and dZ/dt (3.18) with 1/d_y for R/R_0, and the switches of the hysteresis law.

    The plastic slip is that of the isotropic law for every law, Y^2 + Z^2 times Y u + Z v where the latter is positive:
    it is zero where friction unloads elastically and equals the slip velocity in steady sliding. The magnitude of the
    slip velocity is not used: a friction coefficient that increases with it would increase friction during elastic
    unloading, where friction acts along the slip and does work on the sliders, so that light sliders accelerate without
    bound. The plastic part by the switches per axis has the same defect across the slip.
    """
    Y, Z = shear.Y, shear.Z
    yu, zv = p.let(Y * u), p.let(Z * v)
    switches = HYSTERESIS[law].switches
    assert switches is not None
    a, b = switches(yu, zv, lambda x: p.let(Step(p.let(x))))
    drive, au, bv = p.let(a * yu + b * zv), p.let(a * u), p.let(b * v)
    square, along = p.let(Y**2 + Z**2), p.let(yu + zv)
    positive = p.let(Step(along))
    return {
        "dY": p.let((u - Y * drive) / dy, "dY"),
        "dZ": p.let((v - Z * drive) / dy, "dZ"),
        "YY": -(drive + Y * au) / dy,
        "YZ": -Y * bv / dy,
        "ZY": -Z * au / dy,
        "ZZ": -(drive + Z * bv) / dy if Z != 0 else Z,
        "plastic": p.let(square * along * positive),
        "plastic_Y": positive * (2 * Y * along + square * u),
        "plastic_Z": positive * (2 * Z * along + square * v),
    }


def plastic_rates(p: Program, shear: Shear, u: sp.Expr, v: sp.Expr, dy: sp.Expr) -> Symbols:
    """dY/dt and dZ/dt of the elastic-perfectly plastic law by radial return; keys as of `friction_rates`.

    The friction force over -mu N, g = (Y, Z) + T d(Y, Z)/dt, is bounded by 1: g is the projection onto the unit disc of
    `before` + tau (u, v)/d_y, the force of an elastic slip, and d(Y, Z)/dt = (g - before)/tau. With tau = 0 it is the
    limit: elastic inside the disc, and without the outward component on its edge.
    """
    zero, before = sp.Integer(0), shear.before
    trial = tuple(p.let(f + shear.tau * w / dy) for f, w in zip(before, (u, v), strict=True))
    square = p.let(trial[0] ** 2 + trial[1] ** 2)
    root = p.let(sp.sqrt(p.let(1 + Step(p.let(square - 1)) * (square - 1))))
    along = p.let(before[0] * u + before[1] * v)
    timed = p.let(Step(shear.tau))
    returned, limit = p.let(timed * dy / (shear.tau + 1 - timed)), p.let(1 - timed)
    outward = p.let(limit * Step(p.let(square - 1 + ON_THE_EDGE)) * Step(along))
    slipping = p.let(returned * (root - 1) + outward * along, "slipping")
    return {
        "dY": p.let((u - p.let(trial[0] / root) * slipping) / dy, "dY"),
        "dZ": p.let((v - p.let(trial[1] / root) * slipping) / dy, "dZ"),
        **dict.fromkeys(("YY", "YZ", "ZY", "ZZ", "plastic_Y", "plastic_Z"), zero),
        "plastic": slipping,
    }
