"""Boundary condition at the top plate: rig, prescribed load and supported mass (F_top, M_top of (3.28), (3.29))."""

from __future__ import annotations

import sympy as sp

from .blocks import Blocks
from .body import energy_terms, rate_of_angular_momentum
from .functions import Select
from .program import Program, Symbols, Vector, add, cross, scale


def mass_point(p: Program, par: Symbols, body: Symbols) -> tuple[Vector, Vector, Vector]:
    """Position r_nn + h t3 of the centre of the supported mass [m], its velocity [m/s] and acceleration [m/s^2].

    Where the mass rests on a vertical spring, C, V, A of `body` are the motion of its foot.
    """
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
    s: Symbols = p.read(b.support, "s")
    sin_psi, cos_psi = p.let(sp.sin(s["psi"])), p.let(sp.cos(s["psi"]))
    sin_theta, cos_theta = p.let(sp.sin(s["theta"])), p.let(sp.cos(s["theta"]))
    zero = sp.Integer(0)
    omega = add((s["psi1"], zero, zero), scale(s["theta1"], (zero, cos_psi, sin_psi)))
    p.write(b.upright, {"e": (sin_theta, -sin_psi * cos_theta, cos_psi * cos_theta), "w": omega})
    return p


def vertical_spring(p: Program, par: Symbols, body: Symbols, stage: Symbols) -> tuple[sp.Expr, sp.Expr]:
    """Force S of the vertical spring on the foot [N], and acceleration y'' of the foot [m/s^2].

    The stage formula, y = Q + beta y' and y' = V + beta y'', eliminates y'' from m (y'' + (h t3)'' + g) = S. Where no
    mass rests on the spring, its end does not move and beta is 0. Without a spring S is 0. `mass_point` has declared
    the rates.
    """
    raised = p.rate(p.rate(par["h"] * body["t3"][2]))
    weight = p.let(raised + par["g"], "weight")
    spring = par["kv"] * (body["C"][2] - stage["y"]) + par["cv"] * (body["V"][2] - stage["y1"])
    spring = p.let(spring, "spring")
    zeta = p.let(stage["beta"] * (par["cv"] + par["kv"] * stage["beta"]), "zeta")
    force = p.let(stage["share"] * (spring + zeta * weight), "S")
    return force, stage["mobility"] * (spring - par["m"] * weight)


def spring_stage(b: Blocks) -> Program:
    """Constants of the stage formula of a foot: its balance with y and y' eliminated, solved for y''.

    Where no mass rests on the spring, that of a rig, its end is fixed.
    """
    p = Program("spring_stage", "constants of the stage formula of the foot")
    par: Symbols = p.read(b.top_parameters, "par")
    before: Symbols = p.read(b.foot_previous, "f")
    mass = p.let(par["m"] - par["mz"])
    beta = p.let(Select(mass, before["beta"], 0))
    moving = p.let(mass + beta * p.let(par["cv"] + beta * par["kv"]))
    moving = p.let(Select(mass, moving, 1))
    constants = {"mobility": Select(mass, 1 / moving, 0), "share": Select(mass, mass / moving, 1)}
    p.write(b.foot_stage, {"y": before["y"], "y1": before["y1"], "beta": beta, **constants})
    return p


def resting_foot(b: Blocks) -> Program:
    """The foot at which the vertical spring carries the mass that rests on it, and moves with the top plate."""
    p = Program("resting_foot", "height and velocity of the foot while its spring carries the mass at rest")
    par: Symbols = p.read(b.top_parameters, "par")
    body: Symbols = p.read(b.body, "b")
    mass = p.let(par["m"] - par["mz"])
    stiffness = p.let(Select(par["kv"], par["kv"], 1))  # of a damper without a spring nothing settles
    settlement = p.let(Select(par["kv"], p.let(mass * par["g"]) / stiffness, 0))
    values = {"y": body["C"][2] - settlement, "y1": Select(mass, body["V"][2], 0)}
    p.write(b.resting_foot, values)
    return p


def foot(b: Blocks) -> Program:
    """Height of the foot of the supported mass with its derivatives, at the end of a stage."""
    p = Program("foot", "height of the foot of the supported mass, from the stage formula and its balance")
    par: Symbols = p.read(b.top_parameters, "par")
    body: Symbols = p.read(b.body, "b")
    stage: Symbols = p.read(b.foot_stage, "y")
    mass_point(p, par, body)
    acceleration = p.let(vertical_spring(p, par, body, stage)[1])
    step = p.let(stage["beta"] * acceleration)
    p.write(
        b.foot,
        {"y": stage["y"] + stage["beta"] * step, "y1": stage["y1"] + step, "y2": acceleration},
    )
    return p


def top_wrench(b: Blocks, rotating_support: bool) -> Program:
    """Force -F_top and moment -M_top about r_nn, exerted by the bearing on its support: (3.28), (3.29)."""
    p = Program("top_wrench", "-F_top, -M_top of (3.28), (3.29): rig springs, prescribed load, supported mass")
    par: Symbols = p.read(b.top_parameters, "par")
    stage: Symbols = p.read(b.foot_stage, "y")
    body: Symbols = p.read(b.body, "b")
    x: Symbols = p.read(b.coordinates, "x")
    force: Symbols = p.read(b.force, "fe")
    moment: Symbols = p.read(b.moment, "me")
    zero = sp.Integer(0)
    horizontal: Vector = (
        par["k"] * (body["C"][0] - par["x0"][0]) + par["c"] * body["V"][0],
        par["k"] * (body["C"][1] - par["x0"][1]) + par["c"] * body["V"][1],
        zero,
    )
    _, _, a = mass_point(p, par, body)
    spring, _ = vertical_spring(p, par, body, stage)
    x_part, y_part, _ = scale(par["m"], a)
    inertia = p.let_vector((x_part, y_part, par["mz"] * (a[2] + par["g"]) + spring), "inertia")
    f = add(p.let_vector(horizontal, "rig"), inertia, scale(sp.Integer(-1), force["F"]))
    t3 = body["t3"]
    axis, relative = (zero, zero, sp.Integer(1)), body["wp"]
    if rotating_support:
        support: Symbols = p.read(b.upright, "u")
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
    par: Symbols = p.read(b.top_parameters, "par")
    body: Symbols = p.read(b.body, "b")
    base: Symbols = p.read(b.base_motion, "base")
    foot: Symbols = p.read(b.foot, "f")
    heights = {"C": foot["y"], "V": foot["y1"], "A": foot["y2"]}
    r, v, _ = mass_point(p, par, {**body, **{name: (*body[name][:2], z) for name, z in heights.items()}})
    p.write(b.energy, energy_terms(p, par, body, r, v, base))
    return p
