"""Boundary condition at the top plate: rig, prescribed load and supported mass (F_top, M_top of (3.28), (3.29))."""

from __future__ import annotations

from typing import Any

import sympy as sp

from .blocks import Blocks
from .body import energy_terms, rate_of_angular_momentum
from .program import Program, Vector
from .vectors import add, cross, scale

Symbols = dict[str, Any]


def mass_point(p: Program, par: Symbols, body: Symbols) -> tuple[Vector, Vector, Vector]:
    """Position r_nn + h t3 of the centre of the supported mass [m], its velocity [m/s] and acceleration [m/s^2]."""
    p.declare_rates(body["C"], body["V"])
    p.declare_rates(body["V"], body["A"])
    p.declare_rates(body["w"], body["al"])
    p.declare_rates(body["t3"], p.let_vector(cross(body["w"], body["t3"]), "dt"))  # (2.36)
    r = add(body["C"], scale(par["h"], body["t3"]))
    v = p.rate_vector(r)
    return p.let_vector(r, "r"), v, p.rate_vector(v)


def upright(b: Blocks) -> Program:
    """Axis t_3 (2.1) and angular velocity (3.12) of a rotating support, to which the rotational spring refers."""
    p = Program("upright", "axis and angular velocity of the rotating support: (2.1), (3.12) without spin")
    s: Symbols = p.read(b.support, "s", active=False)
    sin_psi, cos_psi = p.let(sp.sin(s["psi"])), p.let(sp.cos(s["psi"]))
    sin_theta, cos_theta = p.let(sp.sin(s["theta"])), p.let(sp.cos(s["theta"]))
    zero = sp.Integer(0)
    omega = add((s["psi1"], zero, zero), scale(s["theta1"], (zero, cos_psi, sin_psi)))
    p.write(b.upright, {"e": (sin_theta, -sin_psi * cos_theta, cos_psi * cos_theta), "w": omega}, tangents=False)
    return p


def top_wrench(b: Blocks, rotating_support: bool) -> Program:
    """Force -F_top and moment -M_top about r_nn, exerted by the bearing on its support: (3.28), (3.29)."""
    p = Program("top_wrench", "-F_top, -M_top of (3.28), (3.29): rig springs, prescribed load, supported mass")
    par: Symbols = p.read(b.top_parameters, "par", active=False)
    body: Symbols = p.read(b.body, "b", active=("t3", "w", "al", "wp", "alp", "C", "V", "A"))
    x: Symbols = p.read(b.coordinates, "x", active=("phi",))
    force: Symbols = p.read(b.vector, "fe")
    moment: Symbols = p.read(b.moment, "me")
    zero = sp.Integer(0)
    horizontal: Vector = (
        par["k"] * (body["C"][0] - par["x0"][0]) + par["c"] * body["V"][0],
        par["k"] * (body["C"][1] - par["x0"][1]) + par["c"] * body["V"][1],
        zero,
    )
    _, _, a = mass_point(p, par, body)
    inertia = p.let_vector(scale(par["m"], add(a, (zero, zero, par["g"]))), "inertia")
    f = add(p.let_vector(horizontal, "rig"), inertia, scale(sp.Integer(-1), force["F"]))
    t3 = body["t3"]
    axis, relative = (zero, zero, sp.Integer(1)), body["wp"]
    if rotating_support:
        support: Symbols = p.read(b.upright, "u", active=False)
        axis, relative = support["e"], add(relative, scale(sp.Integer(-1), support["w"]))
    restoring = add(
        cross(scale(par["kr"], axis), t3), scale(p.let(par["kr"] * x["phi"]), t3), scale(par["cr"], relative)
    )
    h_dot = rate_of_angular_momentum(p, par, body)
    m = add(
        p.let_vector(restoring, "rot"),
        h_dot,
        cross(p.let_vector(scale(par["h"], t3), "lever"), inertia),
        scale(sp.Integer(-1), moment["M"]),
    )
    p.write(b.top_wrench, {"F": f, "M": m})
    return p


def top_energy(b: Blocks) -> Program:
    """Energy of the supported mass and power of the base acceleration, in the frame that translates with the base."""
    p = Program("top_energy", "energy of the supported mass in the frame moving with the base")
    par: Symbols = p.read(b.top_parameters, "par", active=False)
    body: Symbols = p.read(b.body, "b", active=False)
    base: Symbols = p.read(b.base_motion, "o", active=False)
    r, v, _ = mass_point(p, par, body)
    p.write(b.energy, energy_terms(p, par, body, r, v, base), tangents=False)
    return p
