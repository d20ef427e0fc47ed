"""Programs of friction in closed form over a slip, for planar models without masses (docs/effects.md).

s is the slip over d_y. By (3.18) dY/ds = 1 - Y^2 while friction opposes the slip, so Y is a hyperbolic tangent of s;
while friction unloads, dY/ds = 1. By the plastic law Y is Y + s, between -1 and 1.
"""

from __future__ import annotations

from typing import Any

import sympy as sp

from msfp_gen.specification.hysteresis import is_plastic

from .blocks import Blocks
from .functions import Clamp, Decay, Select, Step
from .program import Program

Symbols = dict[str, Any]


def _after_slip(p: Program, plastic: bool, Y: sp.Expr, slip: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Y after a slip, and the work that friction dissipates over it, over mu N d_y.

    The work is the integral of Y^3 ds while friction opposes the slip; by the plastic law it is the slip beyond the
    edge. Along the slip the state is y. Where no slip is left after unloading, the exponential is not used: Y stays
    exact, and its slope is 1 also at rest.
    """
    if plastic:
        trial = p.let(Y + slip)
        end = p.let(Clamp(trial))
        beyond = p.let(trial - end)
        return end, beyond * (Step(beyond) - Step(-beyond))
    direction = p.let(1 - 2 * Step(-slip))
    y, rest = p.let(direction * Y), p.let(direction * slip)
    unloading = p.let(y * Step(-y))  # of y; then friction unloads until it is zero
    start, left = p.let(y - unloading), p.let(rest + unloading)
    above = p.let(1 + start)
    below = p.let((1 - start) * p.let(Decay(p.let(2 * left))))  # 0 at y = 1: saturated friction stays so
    total = p.let(above + below)
    end = p.let(Select(left, p.let((above - below) / total), p.let(y + rest)))
    growth = p.let(left + p.let(Select(left, sp.log(total / 2), 0)))
    lost = p.let(growth - p.let(end**2 - start**2) / 2)
    return p.let(direction * end), Select(left, lost, 0)


def slid_friction(b: Blocks, law: str) -> Program:
    """Friction at the end of a step: Y, and the force over -mu N, Y + T dY/dt, of the sheared contact."""
    p = Program("slid_friction", "friction after the slip of a step, (3.18) integrated in closed form")
    par: Symbols = p.read(b.surface_parameters, "par", active=False)
    step: Symbols = p.read(b.slip, "s", active=False)
    local: Symbols = p.read(b.contact_frame, "loc", active=("dw",))
    per_turn = p.let(-par["sign"] * par["R"] / par["dy"])  # (3.19); in the plane the contact position does not enter
    rate = p.let(per_turn * local["dw"][1])
    Y, _ = _after_slip(p, is_plastic(law), step["Y"], p.let(step["beta"] * rate + per_turn * step["turn"]))
    sheared = p.let(par["td"] * rate)
    if is_plastic(law):
        g = Clamp(p.let(Y + sheared))
    else:
        g = Y + sheared * p.let(1 - Step(p.let(Y * rate)) * p.let(Y**2))  # (3.18)
    p.write(b.slid, {"Y": Y, "g": g}, columns="1")
    return p


def slip_work(b: Blocks, law: str) -> Program:
    """Work of friction over a step, with the mean normal force."""
    p = Program("slip_work", "work that friction stores and dissipates over the slip of a step")
    par: Symbols = p.read(b.surface_parameters, "par", active=False)
    step: Symbols = p.read(b.slip, "s", active=False)
    end: Symbols = p.read(b.slip_end, "e", active=False)
    per_turn = p.let(-par["sign"] * par["R"] / par["dy"])
    _, lost = _after_slip(p, is_plastic(law), step["Y"], p.let(per_turn * step["turn"]))
    size = p.let(p.let(end["N"] * par["mu"]) * par["dy"])
    stored = p.let(end["Y"] ** 2 - step["Y"] ** 2) / 2
    p.write(b.slip_work, {"stored": size * stored, "lost": size * p.let(lost)}, tangents=False)
    return p
