"""Columns of the tangent of the condensed equations: what one unknown changes for one body.

A tilt of a body turns it, and all that stands on it, about the sphere centre below it: a screw (turning and
translation, each with two time derivatives) that is one and the same for every body above. Seen in axes that turn
along, a body feels no more of it than the rates of the turning; its basis stays. So a column costs a body a few
products, whatever stands below it (docs/model.md, "The tangent"). What a body's own unknowns change at the surface
below it comes on top (`own`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import sympy as sp

from .blocks import AXIAL, POLAR, Blocks
from .body import rate_of_angular_momentum, relative_turning
from .contact import contact_basis
from .program import Block, BlockBuilder, Program, Vector
from .vectors import add, cross, project, scale, subtract

Symbols = dict[str, Any]
ORDERS = (0, 1, 2)
TILTS = {"psi": ("sp", "cp"), "theta": ("st", "ct")}
"""Angles that turn a body's axes, with the fields of a body that hold their sine and cosine."""


def repeated(block: Block, name: str, unknowns: tuple[str, ...]) -> Block:
    """A block for every unknown, one after the other."""
    return Block(
        name,
        tuple(replace(f, name=f"{u}_{f.name}") for u in unknowns for f in block.fields),
        {
            f"{u}_{quantity}": tuple(f"{u}_{part}" if isinstance(part, str) else part for part in parts)
            for u in unknowns
            for quantity, parts in block.quantities.items()
        },
    )


@dataclass(frozen=True)
class Columns:
    """The blocks of columns, beside those of the equations themselves."""

    seed: Block
    screw: Block
    screws: Block
    own: Block
    owns: Block
    turning: Block


def column_blocks(b: Blocks, planar: bool, unknowns: tuple[str, ...]) -> Columns:
    """The blocks of columns of a model with these unknowns a body."""
    seed = BlockBuilder("seed", planar)
    screw = BlockBuilder("screw", planar)
    for order, per in zip(ORDERS, ("", "/s", "/s^2"), strict=True):
        seed.scalar(f"s{order}", "-", f"derivative {order} in time of an angle, per unit of the unknown")
        screw.vector(f"q{order}", f"rad{per}", "turning, or its derivative in time", AXIAL)
        screw.vector(f"t{order}", f"m{per}", "translation of what is at the origin, likewise", POLAR)
    own = BlockBuilder("own", planar)
    own.vector("dw", "rad/s", "omega'_above - omega'_below, basis of the body below", AXIAL)
    if "tilt" in b.local.quantities:
        own.scalar("tilt", "-", "cosine of the angle between the axes of the two bodies")
    own.vector("p", "N", "force through the surface, as the body's axes turn, basis of the body below", POLAR)
    own.vector("F", "N", "the same along E1, E2, E3", POLAR)
    own.vector("M", "N m", "moment of the surface in the body's basis, likewise", AXIAL)
    turning = BlockBuilder("turning", planar)
    for block in (own, turning) if "phi" in unknowns else (turning,):
        block.vector("wp", "rad/s", "omega', with spin (3.12)", AXIAL)
        block.vector("alp", "rad/s^2", "d omega'/dt", AXIAL)
    one, mine = screw.build(), own.build()
    tilts = repeated(one, "screws", tuple(u for u in unknowns if u in TILTS))
    return Columns(seed.build(), one, tilts, mine, repeated(mine, "owns", unknowns), turning.build())


def axes(up: Symbols, body: Symbols) -> dict[str, tuple[Vector, Vector, Vector]]:
    """What each tilt of a body turns it about, with the angular velocity and acceleration of that axis (2.4), (2.5)."""
    return {"psi": (up["t1"], up["w"], up["al"]), "theta": (body["t2"], body["w"], body["al"])}


def screws(b: Blocks, c: Columns) -> Program:
    """The screws of a body's tilts: turning about the sphere centre below, differentiated twice in time."""
    p = Program("screws", "how the tilts of a body move it and all that stands on it: (2.4), (2.5), (2.36)")
    s: Symbols = p.read(c.seed, "s", active=False)
    up: Symbols = p.read(b.body, "u", active=False)
    body: Symbols = p.read(b.body, "b", active=False)
    out: Symbols = {}
    for angle, (axis, w, al) in axes(up, body).items():
        if f"{angle}_q0" not in c.screws.quantities:
            continue
        p.rates = {s["s0"]: s["s1"], s["s1"]: s["s2"]}
        p.declare_rates(up["C"], up["V"])
        p.declare_rates(up["V"], up["A"])
        p.declare_rates(w, al)
        p.declare_rates(axis, p.let_vector(cross(w, axis), "dt"))  # (2.36)
        turned = p.let_vector(scale(s["s0"], axis), "q")
        moved = p.let_vector(cross(up["C"], turned), "t")
        for order in ORDERS:
            out |= {f"{angle}_q{order}": turned, f"{angle}_t{order}": moved}
            if order < 2:
                turned, moved = p.rate_vector(turned), p.rate_vector(moved)
    p.write(c.screws, out, tangents=False)
    return p


def carried(b: Blocks, c: Columns) -> Program:
    """A body after a small screw: what the top feels of the columns."""
    p = Program("carried", "a body after a small screw")
    body: Symbols = p.read(b.body, "b", active=False)
    s: Symbols = p.read(c.screw, "s")
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


def felt(b: Blocks, c: Columns) -> Program:
    """What a body feels of a small screw in axes that turn along."""
    p = Program("felt", "turning of a body after a small screw, in axes that turn along")
    body: Symbols = p.read(b.body, "b", active=False)
    s: Symbols = p.read(c.screw, "s")
    alp = add(body["alp"], s["q2"], cross(s["q1"], body["wp"]))
    p.write(c.turning, {"wp": add(body["wp"], s["q1"]), "alp": alp})
    return p


def carried_force(b: Blocks, c: Columns, massless: bool) -> Program:
    """Force below a body from the force above (3.26), (3.28), both in axes that turn along: gravity turns instead."""
    p = Program("carried_force", "force below a body from the force above: (3.26), (3.28) in axes that turn along")
    par: Symbols = p.read(b.body_parameters, "par", active=False)
    body: Symbols = p.read(b.body, "b", active=False)
    s: Symbols = p.read(c.screw, "s")
    above: Symbols = p.read(b.vector, "up")
    gravity: Vector = (sp.Integer(0), sp.Integer(0), par["g"])
    asked = subtract(gravity, cross(s["q0"], gravity))
    if not massless:
        twice = scale(sp.Integer(2), cross(s["q1"], body["vc"]))
        asked = add(asked, body["ac"], cross(s["q2"], body["rc"]), twice, s["t2"])
    p.write(b.vector, {"F": add(above["F"], scale(par["m"], asked))})
    return p


def seen_wrench(b: Blocks, c: Columns) -> Program:
    """Force and moment at the top in axes that turn along; the moment in the body's basis."""
    p = Program("seen_wrench", "force and moment at the top in axes that turn along; the moment in the body's basis")
    body: Symbols = p.read(b.body, "b", active=False)
    s: Symbols = p.read(c.screw, "s")
    force: Symbols = p.read(b.vector, "f")
    moment: Symbols = p.read(b.moment, "m")
    seen = subtract(moment["M"], cross(s["q0"], moment["M"]))
    basis = (body["t1"], body["t2"], body["t3"])
    p.write(b.top_wrench, {"F": subtract(force["F"], cross(s["q0"], force["F"])), "M": project(basis, seen)})
    return p


def force_to_local(b: Blocks) -> Program:
    """Force through a surface in the basis of the body below."""
    p = Program("force_to_local", "force: from E to the basis of the body below")
    body: Symbols = p.read(b.body, "b", active=False)
    force: Symbols = p.read(b.vector, "f")
    p.write(b.vector, {"F": project((body["t1"], body["t2"], body["t3"]), force["F"])})
    return p


def basis_above(p: Program, body: Symbols) -> tuple[Vector, Vector, Vector]:
    """Basis of a body in that of the body below: (2.85) with its own tilts."""
    return contact_basis(p, body["sp"], body["cp"], body["st"], body["ct"])


def turning_balance(b: Blocks, c: Columns, massless: bool, rows: int) -> Program:
    """(3.27), (3.29) in axes that turn along: forces along E, moments in the basis of the body below their surface."""
    p = Program("turning_balance", "balance of angular momentum (3.27), (3.29) in axes that turn along")
    par: Symbols = p.read(b.body_parameters, "par", active=False)
    body: Symbols = p.read(b.body, "b", active=False)
    turning: Symbols = p.read(c.turning, "w", active=() if massless else ("wp", "alp"))
    below: Symbols = p.read(b.vector, "lo")
    moment_below: Symbols = p.read(b.moment, "ml")
    above: Symbols = p.read(b.vector, "up")
    moment_above: Symbols = p.read(b.moment, "mu")
    lever = p.let(par["e"] - par["c"])
    weighted = p.let_vector(add(scale(par["c"], below["F"]), scale(lever, above["F"])), "g")
    basis = (body["t1"], body["t2"], body["t3"])
    g1, g2, _ = project(basis, weighted)
    total = add((-g2, g1, sp.Integer(0)), moment_above["M"])  # t_3 x g
    total = subtract(total, project(basis_above(p, body), moment_below["M"]))
    if not massless:
        total = add(total, project(basis, rate_of_angular_momentum(p, par, {**body, **turning})))
    p.write(b.angular, {"r": total})
    p.tangents = frozenset(f.name for f in b.angular.fields[:rows])
    return p


def own(b: Blocks, c: Columns, unknowns: tuple[str, ...]) -> Program:
    """What each unknown of a body changes at the surface below it, by differentiation along that unknown."""
    p = Program("own", "what a body's own unknowns change at the surface below it")
    s: Symbols = p.read(c.seed, "s", active=False)
    up: Symbols = p.read(b.body, "u", active=False)
    body: Symbols = p.read(b.body, "b", active=False)
    x: Symbols = p.read(b.coordinates, "x", active=False)
    lower: Symbols = p.read(b.coordinates, "y", active=False)
    force: Symbols = p.read(b.vector, "f", active=False)
    moment: Symbols = p.read(b.moment, "m", active=False)
    below = (up["t1"], up["t2"], up["t3"])
    seen = p.let_vector(project(basis_above(p, body), moment["M"]), "seen")
    slip = p.let_vector(relative_turning(p, body, x, lower), "dw")
    tilt = p.let(body["cp"] * body["ct"])
    zero: Vector = (sp.Integer(0),) * 3
    out: Symbols = {}
    for angle in unknowns:
        p.rates = {x[f"{angle}1"]: s["s1"]}
        turning, wp, alp = zero, zero, zero
        if angle not in TILTS:  # spin
            wp = scale(s["s1"], body["t3"])
            alp = add(scale(s["s2"], body["t3"]), scale(s["s1"], cross(body["w"], body["t3"])))
        else:
            sine, cosine = (body[name] for name in TILTS[angle])
            p.rates |= {sine: s["s0"] * cosine, cosine: -s["s0"] * sine}
            turning = p.let_vector(scale(s["s0"], axes(up, body)[angle][0]))
        turned = p.let_vector(cross(turning, force["F"]))
        found = {"dw": p.rate_vector(slip), "tilt": p.rate(tilt), "p": project(below, turned), "F": turned,
                 "M": p.rate_vector(seen), "wp": wp, "alp": alp}  # fmt: skip
        out |= {f"{angle}_{name}": found[name] for name in c.own.quantities}
    p.write(c.owns, out, tangents=False)
    return p


def programs(b: Blocks, c: Columns, massless: bool, unknowns: tuple[str, ...]) -> list[Program]:
    """All programs of the columns."""
    return [
        screws(b, c),
        carried(b, c),
        felt(b, c),
        carried_force(b, c, massless),
        seen_wrench(b, c),
        force_to_local(b),
        turning_balance(b, c, massless, len(unknowns)),
        own(b, c, unknowns),
    ]
