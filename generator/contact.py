"""Programs of one sliding surface: normal and friction force, slip velocity, Bouc-Wen rates, drilling moment, rim.

All vectors have components along the basis t_i of the body below the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from msfp_gen.specification import friction_laws
from msfp_gen.specification.friction_laws import Spin

from . import laws
from .blocks import Blocks
from .body import tilted_axis
from .functions import ArcTan2, Length, Modulus, Select
from .laws import Shear, friction_rates
from .program import Program, Symbols, Vector, add, combine, cross, derivative, dot, project, scale

ALIGNED = sp.Float("1e-9")
"""Sine of a tilt, and distance [m], below which the direction of a rim force is not resolved."""


def norm(x: sp.Expr, y: sp.Expr) -> sp.Expr:
    """sqrt(x^2 + y^2); |x| where y is identically zero (planar models)."""
    return Modulus(x) if y == 0 else sp.sqrt(x**2 + y**2)


@dataclass(frozen=True)
class FrictionModel:
    """Friction of a model, as its effects define it.

    Attributes:
        bouc_wen: name of the hysteresis law.
        drilling: what resists spin by a moment; None: nothing does.
        coefficient: friction law; None for a constant friction coefficient.
        seated: whether a unilateral contact carries the surface (uplift).
    """

    bouc_wen: str
    drilling: Spin | None
    coefficient: friction_laws.Law | None = None
    seated: bool = False


Basis = tuple[Vector, Vector, Vector]


def contact_basis(p: Program, sin_psi: sp.Expr, cos_psi: sp.Expr, sin_theta: sp.Expr, cos_theta: sp.Expr) -> Basis:
    """Contact basis t~_1, t~_2, t~_3 (2.85), (3.13): the basis of the body below, rotated by psi~ and theta~."""
    zero = sp.Integer(0)
    t1: Vector = (cos_theta, p.let(sin_psi * sin_theta), p.let(-cos_psi * sin_theta))
    t2: Vector = (zero, cos_psi, sin_psi)
    return t1, t2, tilted_axis(p, sin_psi, cos_psi, sin_theta, cos_theta)


def slip(
    p: Program, friction_model: FrictionModel, par: Symbols, base: Basis, shear: Shear, N: sp.Expr, dw: Vector
) -> tuple[sp.Expr, Symbols]:
    """Signed radius sign R, and slip velocity u, v (2.98), (3.19) with the rates of the friction state (3.18)."""
    t1, t2, _ = base
    signed_radius = p.let(par["sign"] * par["R"])
    # (3.19): v~ = -sign R dw x t~_3; its components (2.98) by the triple product.
    u, v = p.let(-signed_radius * dot(dw, t2), "u"), p.let(signed_radius * dot(dw, t1), "v")
    dy = laws.yield_displacement(p, friction_model.seated, par, N)
    return signed_radius, {**friction_rates(p, friction_model.bouc_wen, shear, u, v, dy), "u": u, "v": v}


def friction(
    p: Program,
    friction_model: FrictionModel,
    par: Symbols,
    base: Basis,
    N: sp.Expr,
    g: Symbols,
    dw: Vector,
    signed_radius: sp.Expr,
) -> Symbols:
    """Moment M of the contact force about the sphere centre [N m], and power of the drilling moment [W].

    g: friction force over -mu N along t~_1, t~_2.
    """
    t1, t2, t3 = base
    # (3.14)-(3.17): the normal force has no moment about the sphere centre, friction has -sign R t~_3 x F_f.
    arm = p.let(signed_radius * par["mu"] * N)
    moment = add(scale(p.let(arm * g["Y"]), t2), scale(p.let(-arm * g["Z"]), t1))
    drill = sp.Integer(0)
    if friction_model.drilling is not None:
        spin = p.let(dot(dw, t3))
        size = laws.drilling_moment(p, friction_model.drilling, par, N, spin)
        moment = add(moment, scale(size, t3))
        drill = p.let(size * spin)
    return {"M": p.let_vector(moment, "M"), "drill": drill}


def report_contact(b: Blocks, friction_model: FrictionModel) -> Program:
    """Contact force and moment at given unknowns psi~, theta~, N: (3.13)-(3.19) as stated in PEER 2017/07."""
    p = Program("report_contact", "contact force and moment at given psi~, theta~, N: (3.13)-(3.19)")
    par: Symbols = p.read(b.surface_parameters, "par")
    x: Symbols = p.read(b.unknowns, "x")
    f: Symbols = p.read(b.friction, "f")
    loc: Symbols = p.read(b.relative, "loc")
    base = contact_basis(p, *(p.let(function(x[a])) for a in ("psi", "theta") for function in (sp.sin, sp.cos)))
    shear = Shear(f["Y"], f["Z"], (f["Y"], f["Z"]), par["td"])
    signed_radius, rates = slip(p, friction_model, par, base, shear, x["N"], loc["dw"])
    par, heat = laws.evaluate_law(p, b, friction_model.coefficient, par, loc, x["N"], rates)
    g = {name: p.let(f[name] + par["td"] * rates[f"d{name}"]) for name in ("Y", "Z")}
    out = {**rates, **friction(p, friction_model, par, base, x["N"], g, loc["dw"], signed_radius)}
    t1, t2, t3 = base
    mu_n = p.let(-par["mu"] * x["N"])
    force = add(scale(x["N"], t3), scale(p.let(mu_n * g["Y"]), t1), scale(p.let(mu_n * g["Z"]), t2))  # (3.15)-(3.17)
    p.write(b.report_contact, {"p": force, "M": out["M"], "dY": out["dY"], "dZ": out["dZ"], **heat})
    return p


def closed_form(p: Program, par: Symbols, force: Vector, g: Symbols) -> tuple[sp.Expr, tuple[sp.Expr, ...]]:
    """N and (sin psi~, cos psi~, sin theta~, cos theta~) at a given contact force: the inverse of (3.15)-(3.17).

    The contact force is P = N e with e = (-mu g_Y, -mu g_Z, 1) along t~_i. Let p = P/N. The rotation theta~ about axis
    2 takes the first component e_1 to p_1 and the third to w. The rotation psi~ about axis 1 then takes (e_2, w) to
    (p_2, p_3).
    """
    ex, ey = p.let(-par["mu"] * g["Y"]), p.let(-par["mu"] * g["Z"])
    length = p.let(sp.sqrt(1 + ex**2 + ey**2))
    N = p.let(sp.sqrt(dot(force, force)) / length, "N")
    px, py, pz = p.let_vector(scale(1 / N, force), "p")
    square = p.let(1 + ex**2)
    root = p.let(sp.sqrt(square - px**2))
    sin_theta, cos_theta = p.let((px - ex * root) / square), p.let((ex * px + root) / square)
    if py == 0 and ey == 0:  # planar
        return N, (sp.Integer(0), sp.Integer(1), sin_theta, cos_theta)
    w = p.let(cos_theta - ex * sin_theta)
    norm = p.let(ey**2 + w**2)
    return N, (p.let((ey * pz - w * py) / norm), p.let((ey * py + w * pz) / norm), sin_theta, cos_theta)


def contact(b: Blocks, friction_model: FrictionModel) -> Program:
    """Normal force, contact position and moment at a given contact force (closed form), with the Bouc-Wen rates."""
    p = Program(
        "contact", "contact at a given force: N, psi~, theta~ in closed form, moment and Bouc-Wen rates (3.13)-(3.19)"
    )
    par: Symbols = p.read(b.surface_parameters, "par")
    stage: Symbols = p.read(b.friction_stage, "h")
    loc: Symbols = p.read(b.contact_frame, "loc", active=True)
    g: Symbols = p.read(b.friction_force, "g", active=True)
    f = {name: p.let(g[name] - stage["rest"] * (g[name] - stage[name])) for name in ("Y", "Z")}
    shear = Shear(f["Y"], f["Z"], (stage["Y"], stage["Z"]), stage["tau"])
    unknown = laws.read_unknown_coefficient(p, b, friction_model.coefficient, par)
    N, (sp_, cp_, st_, ct_) = closed_form(p, unknown, loc["p"], g)
    base = contact_basis(p, sp_, cp_, st_, ct_)
    signed_radius, rates = slip(p, friction_model, par, base, shear, N, loc["dw"])
    out = {**rates, **friction(p, friction_model, unknown, base, N, g, loc["dw"], signed_radius)}
    law = friction_model.coefficient
    by_law, slopes = laws.law_results(p, law, par, unknown, stage, loc, N, f, g, rates)
    out |= by_law
    for name in ("Y", "Z"):
        slopes[f"Y{name}"], slopes[f"Z{name}"] = p.partials((rates["dY"], rates["dZ"]), f[name])
    values = {**out, **slopes, **f, "N": N, "sp": sp_, "cp": cp_, "st": st_, "ct": ct_}
    p.write(
        b.contact,
        {name: values[name] for name in b.contact.quantities},
        tangents=("M", "dY", "dZ", "N") if law is None else ("M", "dY", "dZ", "mu", "N"),
        columns="MSFP_FRAME_INPUTS",
        slopes=[name for name in slopes if name in b.contact.quantities],  # in a plane the law has no slope along Z
    )
    p.lanes = "MSFP_LANES"
    p.unknowns = {g[n]: stage[n] + stage["tau"] * p.results[f"d{n}"] for n in ("Y", "Z") if g[n].is_Symbol}
    if law is not None:
        p.unknowns[unknown["mu"]] = p.results["mu"]
    return p


def surface_results(b: Blocks) -> Program:
    """What a run takes of a contact beside its moment."""
    p = Program("surface_results", "rates of the friction state and normal force of a contact")
    c: Symbols = p.read(b.contact, "c")
    p.write(b.surface_results, {name: c[name] for name in ("dY", "dZ", "N")})
    return p


def report_rates(b: Blocks) -> Program:
    """Rates of the friction state by the balances as PEER 2017/07 states them."""
    p = Program("report_rates", "rates of the friction state (3.18)")
    c: Symbols = p.read(b.report_contact, "c")
    p.write(b.friction_rates, {name: c[name] for name in ("dY", "dZ")})
    return p


def contact_stage(b: Blocks) -> Program:
    """Constants of the stage formula of Y, Z: f = f_0 + beta df/dt, so that f + T df/dt = f_0 + (beta + T) df/dt."""
    p = Program("contact_stage", "constants of the stage formula of friction, with the damping time of the contact")
    par: Symbols = p.read(b.surface_parameters, "par")
    before: Symbols = p.read(b.friction_previous, "f")
    tau = p.let(before["beta"] + par["td"])
    rest = Select(tau, par["td"] / p.let(Select(tau, tau, 1)), 1)
    copied = {name: before[name] for name in b.friction_stage.quantities if name not in ("tau", "rest")}
    p.write(b.friction_stage, {**copied, "tau": tau, "rest": rest})
    return p


def surface_moment(b: Blocks, rims: bool) -> Program:
    """Moment of a surface on the body above, of contact and rim."""
    p = Program("surface_moment", "moment of contact and rim on the body above, in the basis of the body below")
    contact_: Symbols = p.read(b.contact, "c")
    moment = contact_["M"]
    if rims:
        rim_contact: Symbols = p.read(b.rim, "rim")
        moment = add(moment, rim_contact["M"])
    p.write(b.moment, {"M": moment})
    return p


def contact_angles(b: Blocks) -> Program:
    """The angles of the normal's position from their sines and cosines."""
    p = Program("contact_angles", "psi~ and theta~ of a contact (2.85)")
    c: Symbols = p.read(b.contact, "c")
    angles = {"psi": ArcTan2(c["sp"], c["cp"]) if c["sp"] != 0 else sp.Integer(0), "theta": ArcTan2(c["st"], c["ct"])}
    p.write(b.contact_angles, angles)
    return p


def gap(b: Blocks) -> Program:
    """Sliding displacement (3.20) and gap (3.21) where the body above is evaluated."""
    p = Program("gap", "sliding displacement and gap (3.20), (3.21)")
    par: Symbols = p.read(b.surface_parameters, "par")
    above: Symbols = p.read(b.body, "a")
    return _gap(p, b, par, (above["sp"], above["cp"]), (above["st"], above["ct"]))


def gap_at(b: Blocks) -> Program:
    """The same from the angles of the body above alone."""
    p = Program("gap_at", "sliding displacement and gap (3.20), (3.21), from angles")
    par: Symbols = p.read(b.surface_parameters, "par")
    x: Symbols = p.read(b.coordinates, "x")
    psi, theta = (
        (p.let(sp.sin(x["psi"])), p.let(sp.cos(x["psi"]))),
        (p.let(sp.sin(x["theta"])), p.let(sp.cos(x["theta"]))),
    )
    return _gap(p, b, par, psi, theta)


def _gap(p: Program, b: Blocks, par: Symbols, psi: tuple[sp.Expr, sp.Expr], theta: tuple[sp.Expr, sp.Expr]) -> Program:
    """psi, theta: sine and cosine. The arccos is written as an atan2, which is exact at zero tilt."""
    sine = p.let(Length(theta[0], p.let(psi[0] * theta[1])))
    s = p.let(par["R"] * ArcTan2(sine, p.let(psi[1] * theta[1])))
    p.write(b.gap, {"s": s, "g": par["sc"] - s})
    return p


def report_wrench(b: Blocks, rims: bool) -> Program:
    """Force and moment of a surface on the body above, of contact and rim, from the basis of the body below to E."""
    p = Program("report_wrench", "wrench of contact and rim on the body above: from the basis of the body below to E")
    body: Symbols = p.read(b.body, "b")
    contact: Symbols = p.read(b.report_contact, "c")
    force, moment = contact["p"], contact["M"]
    if rims:
        rim_contact: Symbols = p.read(b.rim, "rim")
        force = p.let_vector(add(force, rim_contact["f"]), "F")
        moment = p.let_vector(add(moment, rim_contact["M"]), "M")
    basis = (body["t1"], body["t2"], body["t3"])
    p.write(b.wrench, {"F": combine(basis, force), "M": combine(basis, moment)})
    return p


def rim_coordinates(b: Blocks) -> Program:
    """Coordinates of the gap of a rim: the tilts of the body above, and with uplift the separation of the surface."""
    p = Program("rim_coordinates", "coordinates on which the gap of a rim depends")
    body: Symbols = p.read(b.body, "b")
    angles = ("psi", "theta", "psi1", "theta1")
    separated = "d" in b.coordinates.quantities
    x: Symbols = p.read(b.coordinates, "x")
    values = {name: x[name] for name in angles}
    if separated:
        basis = (body["t1"], body["t2"], body["t3"])
        for axis in basis:
            p.declare_rates(axis, p.let_vector(cross(body["w"], axis), "dt"))  # (2.36)
        p.declare_rates(x["d"], x["d1"])
        along = p.let_vector(project(basis, x["d"]), "d")
        values |= {"d": along, "d1": p.rate_vector(along)}
    p.write(b.rim_coordinates, values)
    return p


def rim(b: Blocks) -> Program:
    """Rim contact (3.20)-(3.25): gap, force and its moment about the sphere centre.

    The force acts on the slider: the body above a concave-up surface, the body below a concave-down one. The runtime
    applies it only while it is compressive (docs/model.md, choice 4). With uplift the gap follows the separation too,
    so that the energy of the rim is a function of the position (docs/uplift.md).
    """
    p = Program("rim", "rim contact (3.20)-(3.25); applied only while the force is compressive")
    par: Symbols = p.read(b.surface_parameters, "par")
    x: Symbols = p.read(b.rim_coordinates, "x", active=True)
    sin_psi, cos_psi = p.let(sp.sin(x["psi"])), p.let(sp.cos(x["psi"]))
    sin_theta, cos_theta = p.let(sp.sin(x["theta"])), p.let(sp.cos(x["theta"]))
    above = tilted_axis(p, sin_psi, cos_psi, sin_theta, cos_theta)
    below: Vector = (sp.Integer(0), sp.Integer(0), sp.Integer(1))
    cosine = above[2]
    for angle in ("psi", "theta"):
        if x[angle].is_Symbol:
            p.rates[x[angle]] = x[f"{angle}1"]
    up = p.let((1 + par["sign"]) / 2)
    down = p.let((1 - par["sign"]) / 2)
    # (3.24), without its denominator: the axis of the other body, projected on the face of the slider.
    toward = add(scale(p.let(up - down * cosine), below), scale(p.let(down - up * cosine), above))
    slider = add(scale(up, above), scale(down, below))
    dish = add(scale(down, above), scale(up, below))
    lever = p.let(par["R"] - par["pr"])  # (3.25); the part along the direction of the force has no moment
    separation: Vector | None = x.get("d")
    if separation is None:
        sine = p.let(norm(above[0], above[1]))  # |t_3 x t_3'|, for arccos of (3.20)
        gap = p.let(par["sc"] - par["R"] * ArcTan2(sine, cosine), "gap")  # (3.20), (3.21)
    else:
        p.declare_rates(separation, x["d1"])
        sine = p.let(sp.sqrt(above[0] ** 2 + above[1] ** 2 + ALIGNED**2))
        angle_ratio = p.let(p.let(ArcTan2(sine, cosine)) / sine)
        slider, dish = p.let_vector(slider, "slider"), p.let_vector(dish, "dish")
        across = add(separation, scale(-p.let(dot(separation, slider)), slider))
        aside = p.let_vector(add(scale(par["R"] * angle_ratio, toward), scale(par["R"] / lever, across)), "aside")
        distance = p.let(sp.sqrt(dot(aside, aside) + ALIGNED**2))
        gap = p.let(par["sc"] - distance, "gap")
    gap_rate = p.rate(gap)  # (2.102)
    size = p.let(par["kc"] * gap + par["cc"] * gap_rate, "fc")  # (3.23)
    if separation is None:
        force = p.let_vector(scale(p.let(size / sine), toward), "f")  # (3.22)
        moment = scale(p.let(-par["sign"] * lever), cross(p.let_vector(slider, "slider"), force))
    else:
        force = p.let_vector(scale(p.let(size / distance), aside), "f")
        # The virtual work of the force over a rotation of the dish, which changes the angle and the projection.
        circle = sine**2 + cosine**2  # is constant
        along = {sine: -derivative(circle, cosine) / derivative(circle, sine)}
        slope = p.let(p.partial(angle_ratio, cosine, along) * dot(force, dish))
        moment = scale(p.let(-par["sign"] * lever), cross(dish, add(scale(slope, slider), scale(angle_ratio, force))))
    p.write(
        b.rim,
        {"f": force, "M": p.let_vector(moment, "M"), "g": gap, "dg": gap_rate, "fc": size},
        tangents=("f", "M"),
        columns="MSFP_RIM_LOCAL",
    )
    return p
