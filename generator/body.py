"""One body: its kinematics from those of the body below, and its momentum balances.

Concave up and down differ by a sign in the distances of `parameters.places`. Base and top plate are bodies like the
others, with R_0 = 0 below the base and R_n = 0 above the top plate.
"""

from __future__ import annotations

import sympy as sp

from .blocks import Blocks
from .parameters import ValueBlocks, places
from .program import Program, Symbols, Vector, add, combine, cross, dot, project, scale, subtract

LEAST_FORCE = sp.Float("1e-6")
"""Force of a separated surface [N], so that the direction of its force is defined (docs/uplift.md)."""


def sines(p: Program, x: Symbols) -> Symbols:
    """Sines and cosines of psi and theta; other programs read them from the block `body`."""
    return {
        "sp": p.let(sp.sin(x["psi"])),
        "cp": p.let(sp.cos(x["psi"])),
        "st": p.let(sp.sin(x["theta"])),
        "ct": p.let(sp.cos(x["theta"])),
    }


def basis(p: Program, parent: Symbols, trig: Symbols) -> tuple[Vector, Vector, Vector]:
    """Co-rotational basis of a body from its parent's: (2.1)-(2.6)."""
    sin_psi, cos_psi, sin_theta, cos_theta = trig["sp"], trig["cp"], trig["st"], trig["ct"]
    t1, t2, t3 = parent["t1"], parent["t2"], parent["t3"]
    t2_new = p.let_vector(add(scale(cos_psi, t2), scale(sin_psi, t3)), "t2")  # (2.4): t'_2 = t_2 of the body
    t3_mid = p.let_vector(add(scale(-sin_psi, t2), scale(cos_psi, t3)), "tm")  # (2.4), (2.6)
    t1_new = p.let_vector(add(scale(cos_theta, t1), scale(-sin_theta, t3_mid)), "t1")  # (2.5)
    t3_new = p.let_vector(add(scale(sin_theta, t1), scale(cos_theta, t3_mid)), "t3")  # (2.5)
    return t1_new, t2_new, t3_new


def rotational_motion(p: Program, parent: Symbols, x: Symbols) -> Symbols:
    """Basis (2.1)-(2.6), angular velocities (3.12) and their derivatives; declares the rates of all symbols."""
    trig = sines(p, x)
    t1, t2, t3 = basis(p, parent, trig)
    w = p.let_vector(add(parent["w"], scale(x["psi1"], parent["t1"]), scale(x["theta1"], t2)), "w")  # (3.12)
    wp = p.let_vector(add(w, scale(x["phi1"], t3)), "wp")  # (3.12), (2.29)
    for angle in ("psi", "theta", "phi"):
        if x[f"{angle}1"].is_Symbol:
            p.rates[x[f"{angle}1"]] = x[f"{angle}2"]
    p.declare_rates(parent["w"], parent["al"])
    p.declare_rates(parent["t1"], cross(parent["w"], parent["t1"]))  # (2.36)
    for t in (t2, t3):
        p.declare_rates(t, p.let_vector(cross(w, t), "dt"))  # (2.36)
    # No rate of w and wp is declared: their derivatives, printed from (2.56) on, follow from (3.12).
    al = p.rate_vector(w)
    alp = p.rate_vector(wp)
    return {"t1": t1, "t2": t2, "t3": t3, "w": w, "wp": wp, "al": al, "alp": alp, **trig}


def point(p: Program, centre: Vector, distance: sp.Expr, t3: Vector) -> tuple[Vector, Vector, Vector]:
    """Position centre + distance * t3; velocity and acceleration, printed from (2.37) on, by differentiation."""
    r = add(centre, scale(distance, t3))
    v = p.rate_vector(r)
    return p.let_vector(r, "r"), v, p.rate_vector(v)


def centre_below(p: Program, up: Symbols, x: Symbols) -> Vector:
    """Sphere centre of the body at its lower end: that of the surface below plus, with uplift, the separation."""
    p.declare_rates(up["C"], up["V"])
    p.declare_rates(up["V"], up["A"])
    if "d" not in x:
        return up["C"]  # type: ignore[no-any-return]
    p.declare_rates(x["d"], x["d1"])
    p.declare_rates(x["d1"], x["d2"])
    return p.let_vector(add(up["C"], x["d"]), "centre")


def forward(b: Blocks) -> Program:
    """Body k from body k-1: (2.1)-(2.6), (3.4)-(3.12) and their derivatives."""
    p = Program(
        "forward",
        "body k from body k-1: (2.1)-(2.6), (3.4)-(3.12), rates by differentiation",
    )
    par: Symbols = p.read(b.body_parameters, "par")
    up: Symbols = p.read(b.body, "u")
    x: Symbols = p.read(b.coordinates, "x")
    out = rotational_motion(p, up, x)
    centre = centre_below(p, up, x)
    out["C"], out["V"], out["A"] = point(p, centre, par["e"], out["t3"])
    out["rc"], out["vc"], out["ac"] = point(p, centre, par["c"], out["t3"])
    p.write(b.body, out)
    return p


def named_points(b: Blocks, values: ValueBlocks) -> Program:
    """All named points of one body (3.2)-(3.11) with velocity and acceleration."""
    p = Program("named_points", "named points of body k: (3.2)-(3.11) with velocity and acceleration")
    v: Symbols = p.read(values.body_values, "l")
    s: Symbols = p.read(values.sides, "s")
    up: Symbols = p.read(b.body, "u")
    x: Symbols = p.read(b.coordinates, "x")
    t3 = rotational_motion(p, up, x)["t3"]
    centre = centre_below(p, up, x)
    distances = {name: p.let(distance) for name, distance in places(v, s).items()}
    out: Symbols = {}
    for name, distance in distances.items():
        out[f"r_{name}"], out[f"v_{name}"], out[f"a_{name}"] = point(p, centre, distance, t3)
    p.write(b.points, out)
    return p


def weight_and_inertia(p: Program, par: Symbols, body: Symbols, massless: bool) -> Vector:
    """Force below a body less the force above it, m (a + g E3): (3.26), (3.28)."""
    gravity: Vector = (sp.Integer(0), sp.Integer(0), par["g"])
    acceleration = gravity if massless else add(body["ac"], gravity)
    return p.let_vector(scale(par["m"], acceleration), "inertia")


def interface_force(b: Blocks, massless: bool) -> Program:
    """Force through the interface below from the one above: (3.26), (3.28) summed from the top down."""
    p = Program("interface_force", "force below a body from the force above: (3.26), (3.28), summed from the top down")
    par: Symbols = p.read(b.body_parameters, "par")
    body: Symbols = p.read(b.body, "b")
    above: Symbols = p.read(b.force, "up")
    p.write(b.force, {"F": add(above["F"], weight_and_inertia(p, par, body, massless))})
    return p


def linear_balance(b: Blocks, massless: bool) -> Program:
    """Residual of the balance of linear momentum (3.26), (3.28)."""
    p = Program("linear_balance", "balance of linear momentum (3.26), (3.28): left side less right side")
    par: Symbols = p.read(b.body_parameters, "par")
    body: Symbols = p.read(b.body, "b")
    below: Symbols = p.read(b.force, "lo")
    above: Symbols = p.read(b.force, "up")
    p.write(b.linear, {"r": add(weight_and_inertia(p, par, body, massless), subtract(above["F"], below["F"]))})
    return p


def angular_balance(b: Blocks, massless: bool) -> Program:
    """Residual of the balance of angular momentum (3.27), (3.29) about the centre of mass, along t_i.

    The wrench of an interface is (F, M) with M about its sphere centre; r_gc - r_k = -c t3 below and
    (e - c) t3 above, so that the moments of both forces share one product with t3.
    """
    p = Program(
        "angular_balance",
        "balance of angular momentum (3.27), (3.29) about the centre of mass: left side less right side, along t_i",
    )
    par: Symbols = p.read(b.body_parameters, "par")
    body: Symbols = p.read(b.body, "b")
    below: Symbols = p.read(b.force, "lo")
    moment_below: Symbols = p.read(b.moment, "ml")
    above: Symbols = p.read(b.force, "up")
    moment_above: Symbols = p.read(b.moment, "mu")
    t3 = body["t3"]
    lever = p.let(par["e"] - par["c"])
    weighted = p.let_vector(add(scale(par["c"], below["F"]), scale(lever, above["F"])), "g")
    total = add(cross(t3, weighted), subtract(moment_above["M"], moment_below["M"]))  # -(right side)
    if not massless:
        total = add(total, rate_of_angular_momentum(p, par, body))
    r = p.let_vector(total, "r")
    p.write(b.angular, {"r": project((body["t1"], body["t2"], t3), r)})
    return p


def balances(b: Blocks, spin_locked: bool) -> Program:
    """All balances of a body. With locked spin, phi'' = 0 takes the place of the axial one, whose moment is unknown."""
    p = Program("balances", "balances of a body (3.26)-(3.29); with locked spin phi'' in place of the axial one")
    linear: Symbols = p.read(b.linear, "f")
    angular: Symbols = p.read(b.angular, "m")
    x: Symbols = p.read(b.coordinates, "x")
    first, second, axial = angular["r"]
    p.write(b.balances, {"F": linear["r"], "M": (first, second, x["phi2"] if spin_locked else axial)})
    return p


def rate_of_angular_momentum(p: Program, par: Symbols, body: Symbols) -> Vector:
    """J d omega'/dt + omega' x J omega', left side of (3.27), (3.29), with J of (2.118), lambda_1 = lambda_2."""
    t3, wp, alp = body["t3"], body["wp"], body["alp"]
    difference = p.let(par["ja"] - par["jt"])
    spin, spin_rate = p.let(dot(t3, wp)), p.let(dot(t3, alp))
    gyroscopic = p.let_vector(cross(wp, t3), "gy")
    return p.let_vector(
        add(
            scale(par["jt"], alp), scale(p.let(difference * spin_rate), t3), scale(p.let(difference * spin), gyroscopic)
        ),
        "hdot",
    )


def body_energy(b: Blocks, massless: bool) -> Program:
    """Kinetic and potential energy of one body relative to the base, and the power of the base acceleration."""
    p = Program("body_energy", "energy of a body in the frame moving with the base")
    par: Symbols = p.read(b.body_parameters, "par")
    body: Symbols = p.read(b.body, "b")
    base: Symbols = p.read(b.base_motion, "base")
    terms = energy_terms(p, par, body, body["rc"], body["vc"], base)
    if massless:
        terms.update(kinetic=sp.Integer(0), power=sp.Integer(0))
    p.write(b.energy, terms)
    return p


def energy_terms(p: Program, par: Symbols, body: Symbols, r: Vector, v: Vector, base: Symbols) -> Symbols:
    """The fields of `energy` for a rigid axisymmetric body whose centre of mass is at r with velocity v."""
    relative = p.let_vector(subtract(v, base["U"]), "v")
    spin = p.let(dot(body["t3"], body["wp"]))
    rotation = (par["jt"] * dot(body["wp"], body["wp"]) + (par["ja"] - par["jt"]) * spin**2) / 2
    return {
        "kinetic": par["m"] * dot(relative, relative) / 2 + rotation,
        "potential": par["m"] * par["g"] * (r[2] - base["O"][2]),
        "power": -par["m"] * dot(base["B"], relative),
    }


def moment_to_world(b: Blocks) -> Program:
    """Moment of an interface from the basis of the body below to E."""
    p = Program("moment_to_world", "moment about the sphere centre: from the basis of the body below to E")
    body: Symbols = p.read(b.body, "b")
    local: Symbols = p.read(b.moment, "loc")
    p.write(b.moment, {"M": combine((body["t1"], body["t2"], body["t3"]), local["M"])})
    return p


def tilted_axis(p: Program, sin_psi: sp.Expr, cos_psi: sp.Expr, sin_theta: sp.Expr, cos_theta: sp.Expr) -> Vector:
    """t_3 after the rotations psi and theta, along the basis before them: (2.3)-(2.6)."""
    return sin_theta, p.let(-sin_psi * cos_theta), p.let(cos_psi * cos_theta)


def relative_angular_velocity(p: Program, above: Symbols, x: Symbols, lower: Symbols) -> Vector:
    """omega'_above - omega'_below (3.12) in the basis of the body below; x, lower: coordinates of above and below."""
    sin_psi, cos_psi, sin_theta, cos_theta = above["sp"], above["cp"], above["st"], above["ct"]
    zero = sp.Integer(0)
    t2: Vector = (zero, cos_psi, sin_psi)
    t3 = tilted_axis(p, sin_psi, cos_psi, sin_theta, cos_theta)
    return add((x["psi1"], zero, -lower["phi1"]), scale(x["theta1"], t2), scale(x["phi1"], t3))


def slip_rotation(b: Blocks) -> Program:
    """Relative angular velocity at a surface in the basis of the body below it, from which the slip follows."""
    p = Program("slip_rotation", "omega'_above - omega'_below in the basis of the body below (3.12), (3.19)")
    above: Symbols = p.read(b.body, "a")
    x: Symbols = p.read(b.coordinates, "x")
    lower: Symbols = p.read(b.coordinates, "y")
    tilt = {"tilt": above["cp"] * above["ct"]} if "tilt" in b.relative.quantities else {}
    p.write(b.relative, {"dw": relative_angular_velocity(p, above, x, lower), **tilt})
    return p


def surface_local(b: Blocks, uplift: bool, rims: bool) -> Program:
    """Contact force and relative angular velocity of a surface in the basis of the body below it."""
    p = Program(
        "surface_local", "contact force and omega'_above - omega'_below in the basis of the body below (3.12), (3.19)"
    )
    body: Symbols = p.read(b.body, "b")
    above: Symbols = p.read(b.body, "a")
    x: Symbols = p.read(b.coordinates, "x")
    lower: Symbols = p.read(b.coordinates, "y")
    total: Symbols = p.read(b.force, "tot")
    least: Vector = (sp.Integer(0), sp.Integer(0), LEAST_FORCE if uplift else sp.Integer(0))
    relative = relative_angular_velocity(p, above, x, lower)
    contact = project((body["t1"], body["t2"], body["t3"]), total["F"])
    if rims:
        rim: Symbols = p.read(b.rim, "rim")
        contact = subtract(contact, rim["f"])
    tilt = {"tilt": above["cp"] * above["ct"]} if "tilt" in b.contact_frame.quantities else {}
    p.write(b.contact_frame, {"p": add(contact, least), "dw": relative, **tilt})
    return p
