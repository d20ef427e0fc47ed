"""Columns of the tangent of the condensed equations: the variation of one body with one unknown.

A tilt of a body rotates it, and all bodies above it, about the sphere centre below it. This twist (rotation and
translation, each with two time derivatives) is the same for every body above. In the body-fixed frame it changes the
angular velocity and acceleration of a body, not its basis. A column therefore costs a few products per body, however
many bodies lie below (docs/model.md, "The tangent"). `local_variation` adds the change of the surface below the tilted
body.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import sympy as sp

from .blocks import Blocks
from .body import rate_of_angular_momentum, relative_angular_velocity
from .contact import contact_basis
from .program import (
    AXIAL,
    POLAR,
    ZERO,
    Block,
    BlockBuilder,
    Program,
    Symbols,
    Vector,
    add,
    cross,
    project,
    scale,
    subtract,
)

ORDERS = (0, 1, 2)
TILTS = {"psi": ("sp", "cp"), "theta": ("st", "ct")}
"""Tilt angles of a body, with the fields of a body that hold their sine and cosine."""


def repeated(block: Block, name: str, angles: tuple[str, ...]) -> Block:
    """The fields of `block` once per unknown angle, one after the other."""
    return Block(
        name,
        tuple(replace(f, name=f"{u}_{f.name}") for u in angles for f in block.fields),
        {
            f"{u}_{quantity}": tuple(f"{u}_{part}" if isinstance(part, str) else part for part in parts)
            for u in angles
            for quantity, parts in block.quantities.items()
        },
    )


@dataclass(frozen=True)
class Columns:
    """The blocks that only the columns of the tangent use."""

    seed: Block
    axis: Block
    twist: Block
    variation: Block
    variations: Block
    turning: Block


def column_blocks(b: Blocks, planar: bool, angles: tuple[str, ...]) -> Columns:
    """The blocks of the columns of a model. angles: of a body, those whose accelerations are unknown."""
    seed = BlockBuilder("seed", planar)
    axis = BlockBuilder("axis", planar)
    axis.vector("t", "-", "unit vector along the axis of a tilt angle", AXIAL)
    axis.vector("w", "rad/s", "its angular velocity", AXIAL)
    axis.vector("al", "rad/s^2", "its angular acceleration", AXIAL)
    axis.vector("C", "m", "sphere centre on the axis", POLAR)
    axis.vector("V", "m/s", "its velocity", POLAR)
    axis.vector("A", "m/s^2", "its acceleration", POLAR)
    twist = BlockBuilder("twist", planar)
    for order, per in zip(ORDERS, ("", "/s", "/s^2"), strict=True):
        seed.scalar(f"s{order}", "-", f"derivative {order} in time of an angle, per unit of the unknown")
        twist.vector(f"q{order}", f"rad{per}", "rotation, or its derivative in time", AXIAL)
        twist.vector(f"t{order}", f"m{per}", "translation of the point at the origin, or its derivative", POLAR)
    variation = BlockBuilder("variation", planar)
    variation.vector("dw", "rad/s", "omega'_above - omega'_below, basis of the body below", AXIAL)
    if "tilt" in b.contact_frame.quantities:
        variation.scalar("tilt", "-", "cosine of the angle between the axes of the two bodies")
    variation.vector(
        "p", "N", "variation of the interface force by rotation of the body, basis of the body below", POLAR
    )
    variation.vector("F", "N", "the same variation along E1, E2, E3", POLAR)
    variation.vector("M", "N m", "variation of the moment of the surface, basis of the body above", AXIAL)
    turning = BlockBuilder("turning", planar)
    for block in (variation, turning) if "phi" in angles else (turning,):
        block.vector("wp", "rad/s", "omega', with spin (3.12)", AXIAL)
        block.vector("alp", "rad/s^2", "d omega'/dt", AXIAL)
    local = variation.build()
    variations = repeated(local, "variations", angles)
    return Columns(seed.build(), axis.build(), twist.build(), local, variations, turning.build())


def twist(c: Columns) -> Program:
    """Twist of the bodies that a tilt angle turns about its axis, with two time derivatives."""
    p = Program("twist", "twist of all bodies that a tilt angle turns about its axis: (2.4), (2.5), (2.36)")
    s: Symbols = p.read(c.seed, "s")
    axis: Symbols = p.read(c.axis, "x")
    p.rates = {s["s0"]: s["s1"], s["s1"]: s["s2"]}
    p.declare_rates(axis["C"], axis["V"])
    p.declare_rates(axis["V"], axis["A"])
    p.declare_rates(axis["w"], axis["al"])
    p.declare_rates(axis["t"], p.let_vector(cross(axis["w"], axis["t"]), "dt"))  # (2.36)
    turned = p.let_vector(scale(s["s0"], axis["t"]), "q")
    moved = p.let_vector(cross(axis["C"], turned), "t")
    out: Symbols = {}
    for order in ORDERS:
        out |= {f"q{order}": turned, f"t{order}": moved}
        if order < 2:
            turned, moved = p.rate_vector(turned), p.rate_vector(moved)
    p.write(c.twist, out)
    p.lanes = "MSFP_DOF"
    return p


def transported_twist(b: Blocks, c: Columns) -> Program:
    """Kinematics of a body after an infinitesimal twist in the fixed frame; used at the top plate."""
    p = Program("transported_twist", "a body after an infinitesimal twist")
    body: Symbols = p.read(b.body, "b")
    s: Symbols = p.read(c.twist, "s", active=True)
    out = {**body, "t3": add(body["t3"], cross(s["q0"], body["t3"]))}
    for w, al in (("w", "al"), ("wp", "alp")):
        out[w] = add(body[w], s["q1"], cross(s["q0"], body[w]))
        out[al] = add(body[al], s["q2"], cross(s["q1"], body[w]), cross(s["q0"], body[al]))
    C, V, A = body["C"], body["V"], body["A"]
    twice = scale(sp.Integer(2), cross(s["q1"], V))
    out["C"] = add(C, cross(s["q0"], C), s["t0"])
    out["V"] = add(V, cross(s["q1"], C), cross(s["q0"], V), s["t1"])
    out["A"] = add(A, cross(s["q2"], C), twice, cross(s["q0"], A), s["t2"])
    p.write(b.body, out, tangents=("t3", "w", "al", "wp", "alp", "C", "V", "A"))
    return p


def variation_of_rates(b: Blocks, c: Columns) -> Program:
    """Variation of angular velocity and acceleration under an infinitesimal twist, in the body-fixed frame."""
    p = Program(
        "variation_of_rates", "angular velocity and acceleration of a body after a twist, in the body-fixed frame"
    )
    body: Symbols = p.read(b.body, "b")
    s: Symbols = p.read(c.twist, "s", active=True)
    alp = add(body["alp"], s["q2"], cross(s["q1"], body["wp"]))
    p.write(c.turning, {"wp": add(body["wp"], s["q1"]), "alp": alp}, tangents=True)
    return p


def transported_force(b: Blocks, c: Columns, massless: bool) -> Program:
    """Force below a body from that above (3.26), (3.28), both in the body-fixed frame, in which gravity rotates."""
    p = Program("transported_force", "force below a body from the force above: (3.26), (3.28) in the body-fixed frame")
    par: Symbols = p.read(b.body_parameters, "par")
    body: Symbols = p.read(b.body, "b")
    s: Symbols = p.read(c.twist, "s", active=True)
    above: Symbols = p.read(b.force, "up", active=True)
    gravity: Vector = (sp.Integer(0), sp.Integer(0), par["g"])
    acceleration = subtract(gravity, cross(s["q0"], gravity))
    if not massless:
        twice = scale(sp.Integer(2), cross(s["q1"], body["vc"]))
        acceleration = add(acceleration, body["ac"], cross(s["q2"], body["rc"]), twice, s["t2"])
    p.write(b.force, {"F": add(above["F"], scale(par["m"], acceleration))}, tangents=True)
    return p


def transported_wrench(b: Blocks, c: Columns) -> Program:
    """Force and moment at the top in the body-fixed frame; the moment along the body's basis vectors."""
    p = Program(
        "transported_wrench", "force and moment at the top in the body-fixed frame; the moment in the body's basis"
    )
    body: Symbols = p.read(b.body, "b")
    s: Symbols = p.read(c.twist, "s", active=True)
    force: Symbols = p.read(b.force, "f", active=True)
    moment: Symbols = p.read(b.moment, "m", active=True)
    seen = subtract(moment["M"], cross(s["q0"], moment["M"]))
    basis = (body["t1"], body["t2"], body["t3"])
    p.write(
        b.top_wrench, {"F": subtract(force["F"], cross(s["q0"], force["F"])), "M": project(basis, seen)}, tangents=True
    )
    return p


def force_to_local(b: Blocks) -> Program:
    """Interface force of a surface in the basis of the body below."""
    p = Program("force_to_local", "force: from E to the basis of the body below")
    body: Symbols = p.read(b.body, "b")
    force: Symbols = p.read(b.force, "f", active=True)
    p.write(b.force, {"F": project((body["t1"], body["t2"], body["t3"]), force["F"])}, tangents=True)
    return p


def basis_above(p: Program, body: Symbols) -> tuple[Vector, Vector, Vector]:
    """Basis of a body in that of the body below: (2.85) with its own tilts."""
    return contact_basis(p, body["sp"], body["cp"], body["st"], body["ct"])


def turning_balance(b: Blocks, c: Columns, massless: bool, rows: int) -> Program:
    """(3.27), (3.29) in the body-fixed frame: forces along E, moments in the basis of the body below their surface."""
    p = Program("turning_balance", "balance of angular momentum (3.27), (3.29) in the body-fixed frame")
    par: Symbols = p.read(b.body_parameters, "par")
    body: Symbols = p.read(b.body, "b")
    turning: Symbols = p.read(c.turning, "w", active=() if massless else ("wp", "alp"))
    below: Symbols = p.read(b.force, "lo", active=True)
    moment_below: Symbols = p.read(b.moment, "ml", active=True)
    above: Symbols = p.read(b.force, "up", active=True)
    moment_above: Symbols = p.read(b.moment, "mu", active=True)
    lever = p.let(par["e"] - par["c"])
    weighted = p.let_vector(add(scale(par["c"], below["F"]), scale(lever, above["F"])), "g")
    basis = (body["t1"], body["t2"], body["t3"])
    g1, g2, _ = project(basis, weighted)
    total = add((-g2, g1, sp.Integer(0)), moment_above["M"])  # t_3 x g
    total = subtract(total, project(basis_above(p, body), moment_below["M"]))
    if not massless:
        total = add(total, project(basis, rate_of_angular_momentum(p, par, {**body, **turning})))
    p.write(b.angular, {"r": total}, tangents=True)
    p.tangents = frozenset(f.name for f in b.angular.fields[:rows])
    return p


def local_variation(b: Blocks, c: Columns, angles: tuple[str, ...]) -> Program:
    """Derivatives of slip, force and moment of the surface below a body with respect to each unknown of that body."""
    p = Program("local_variation", "variation of the surface below a body with the unknowns of that body")
    s: Symbols = p.read(c.seed, "s")
    up: Symbols = p.read(b.body, "u")
    body: Symbols = p.read(b.body, "b")
    x: Symbols = p.read(b.coordinates, "x")
    lower: Symbols = p.read(b.coordinates, "y")
    force: Symbols = p.read(b.force, "f")
    moment: Symbols = p.read(b.moment, "m")
    below = (up["t1"], up["t2"], up["t3"])
    seen = p.let_vector(project(basis_above(p, body), moment["M"]), "seen")
    slip = p.let_vector(relative_angular_velocity(p, body, x, lower), "dw")
    tilt = p.let(body["cp"] * body["ct"])
    out: Symbols = {}
    for angle in angles:
        p.rates = {x[f"{angle}1"]: s["s1"]}
        turning, wp, alp = ZERO, ZERO, ZERO
        if angle not in TILTS:  # spin
            wp = scale(s["s1"], body["t3"])
            alp = add(scale(s["s2"], body["t3"]), scale(s["s1"], cross(body["w"], body["t3"])))
        else:
            sine, cosine = (body[name] for name in TILTS[angle])
            p.rates |= {sine: s["s0"] * cosine, cosine: -s["s0"] * sine}
            axis = up["t1"] if angle == "psi" else body["t2"]  # (2.4), (2.5)
            turning = p.let_vector(scale(s["s0"], axis))
        turned = p.let_vector(cross(turning, force["F"]))
        quantities = {
            "dw": p.rate_vector(slip),
            "tilt": p.rate(tilt),
            "p": project(below, turned),
            "F": turned,
            "M": p.rate_vector(seen),
            "wp": wp,
            "alp": alp,
        }
        out |= {f"{angle}_{name}": quantities[name] for name in c.variation.quantities}
    p.write(c.variations, out)
    return p


def programs(b: Blocks, c: Columns, massless: bool, angles: tuple[str, ...]) -> list[Program]:
    """All programs of the columns of the tangent."""
    return [
        twist(c),
        transported_twist(b, c),
        variation_of_rates(b, c),
        transported_force(b, c, massless),
        transported_wrench(b, c),
        force_to_local(b),
        turning_balance(b, c, massless, len(angles)),
        local_variation(b, c, angles),
    ]
