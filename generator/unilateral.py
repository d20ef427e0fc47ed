"""Unilateral contact of a surface, for models with uplift; `seat` in names of fields refers to it.

PEER 2017/07 joins the two bodies at the sphere centre by a ball joint (separation delta = 0). With uplift a stiff
contact that transmits compression only replaces it. With the compression s = -delta, the largest penetration d over the
footprint of the slider is |s| where s points into the footprint, and s . n with the normal n at its edge otherwise: it
is the length of the projection of s on the cone of the footprint. The force is the projection of s + c d ds/dt on this
cone, times the stiffness. Without c it is the gradient of half the stiffness times d^2, and the contact conserves
energy; with it the contact dissipates, since projections on convex cones are monotonic. It transmits no force where d
is not positive. Source: docs/uplift.md; PEER 2017/07 mentions uplift as a possible extension (chapter 5).
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from .blocks import Blocks
from .body import LEAST_FORCE
from .functions import Select, Step
from .program import Program, Symbols, Vector, add, combine, cross, dot, scale, subtract

CENTRE = sp.Float("1e-60")
"""Added to a squared length [m^2]: where the length is zero, its derivative is zero, and no value changes."""


def _at_edge(p: Program, par: Symbols, axis: Vector, s: Vector) -> tuple[sp.Expr, Vector, sp.Expr]:
    """Part of s along the normal n at the edge of the footprint, n, and by how much s points out of the footprint."""
    along = p.let(dot(s, axis))
    across = p.let_vector(add(s, scale(-along, axis)), "across")
    size = p.let(sp.sqrt(dot(across, across) + CENTRE))
    normal = add(scale(par["ca"], axis), scale(p.let(par["sa"] / size), across))
    return p.let(par["ca"] * along + par["sa"] * size), normal, p.let(par["ca"] * size - par["sa"] * along)


@dataclass(frozen=True)
class Compression:
    """Compression of a contact.

    Attributes:
        s: compression [m].
        rate: its rate relative to the slider [m/s].
        depth: penetration, the length of the part of s in the footprint [m].
        damped: s + c depth rate, whose part in the footprint is the force over the stiffness [m].
    """

    s: Vector
    rate: Vector
    depth: sp.Expr
    damped: Vector


def _compression(p: Program, par: Symbols, slider: Symbols, x: Symbols) -> Compression:
    """Compression of a contact with its damping; declares the time derivatives."""
    p.declare_rates(x["d"], x["d1"])
    p.declare_rates(slider["t3"], p.let_vector(cross(slider["w"], slider["t3"]), "dt"))  # (2.36)
    s = p.let_vector(scale(sp.Integer(-1), x["d"]), "s")
    rate = p.let_vector(subtract(p.rate_vector(s), cross(slider["w"], s)), "ds")
    edge, _, beyond = _at_edge(p, par, slider["t3"], s)
    depth = p.let(Select(beyond, edge, p.let(sp.sqrt(dot(s, s) + CENTRE))), "depth")
    lag = p.let(par["cs"] * depth)
    return Compression(s, rate, depth, p.let_vector(add(s, scale(lag, rate)), "damped"))


def unilateral_depth(b: Blocks) -> Program:
    """Penetration, negative where the contact is open, and how far the damped compression misses the footprint."""
    p = Program("unilateral_depth", "unilateral contact: penetration, and by how much the footprint is missed")
    par: Symbols = p.read(b.surface_parameters, "par")
    slider: Symbols = p.read(b.body, "b")
    x: Symbols = p.read(b.coordinates, "x")
    contact = _compression(p, par, slider, x)
    _, _, beyond = _at_edge(p, par, slider["t3"], contact.damped)
    p.write(b.unilateral_depth, {"depth": contact.depth, "beyond": beyond})
    return p


def _force(b: Blocks, name: str, summary: str, at_edge: bool) -> Program:
    """Force of a closed contact with its moment and energies."""
    p = Program(name, summary)
    par: Symbols = p.read(b.surface_parameters, "par")
    slider: Symbols = p.read(b.body, "b")
    x: Symbols = p.read(b.coordinates, "x")
    contact = _compression(p, par, slider, x)
    inward = contact.damped
    if at_edge:
        edge, normal, _ = _at_edge(p, par, slider["t3"], contact.damped)
        inward = scale(p.let(Step(edge) * edge), normal)  # its damping does not pull
    force = p.let_vector(scale(par["ks"], inward), "F")
    elastic = p.let(par["ks"] * contact.depth)
    p.write(
        b.unilateral,
        {
            "F": force,
            "T": cross(contact.s, force),
            "stored": elastic * contact.depth / 2,
            "lost": p.let(dot(force, contact.rate)) - elastic * p.rate(contact.depth),
            "penetration": contact.depth,
        },
    )
    return p


def unilateral_inside(b: Blocks) -> Program:
    """Contact whose resultant passes through the footprint: spring and damper are equal in every direction."""
    summary = "unilateral contact: force while the resultant passes through the footprint"
    return _force(b, "unilateral_inside", summary, at_edge=False)


def unilateral_edge(b: Blocks) -> Program:
    """Contact at the edge of the footprint: the slider stands on its edge, and the force produces a righting moment."""
    summary = "unilateral contact: force while the slider stands on the edge of its footprint"
    return _force(b, "unilateral_edge", summary, at_edge=True)


def rim_to_world(b: Blocks) -> Program:
    """Rim force along E, and the moment on the slider that its work over a separation requires (docs/uplift.md)."""
    p = Program("rim_to_world", "rim force: from the basis of the body below to E, and its moment by the separation")
    body: Symbols = p.read(b.body, "b")
    x: Symbols = p.read(b.coordinates, "x")
    rim: Symbols = p.read(b.rim, "rim")
    force = p.let_vector(combine((body["t1"], body["t2"], body["t3"]), rim["f"]), "F")
    p.write(b.rim_wrench, {"F": force, "T": cross(force, x["d"])})
    return p


def surface_force(b: Blocks, rims: bool) -> Program:
    """Force of a surface on the body above, of its contact and its rim."""
    p = Program("surface_force", "force of a surface on the body above: of its unilateral contact and its rim")
    contact: Symbols = p.read(b.unilateral, "c")
    force = contact["F"]
    if rims:
        rim: Symbols = p.read(b.rim_wrench, "rim")
        force = add(force, rim["F"])
    p.write(b.force, {"F": force})
    return p


def split_moment(b: Blocks, rims: bool) -> Program:
    """Moments of a surface on the bodies above and below, each about the sphere centre of its body.

    The one on the slider also has the moments of contact and rim by the separation.
    """
    p = Program("split_moment", "moments of a surface on the bodies above and below, each about its sphere centre")
    par: Symbols = p.read(b.surface_parameters, "par")
    joint: Symbols = p.read(b.moment, "j")
    contact: Symbols = p.read(b.unilateral, "c")
    by_separation = contact["T"]
    if rims:
        rim: Symbols = p.read(b.rim_wrench, "rim")
        by_separation = add(by_separation, rim["T"])
    by_separation = p.let_vector(by_separation, "T")
    above = p.let((1 + par["sign"]) / 2)
    p.write(
        b.split,
        {
            "M": add(joint["M"], scale(above, by_separation)),
            "B": add(joint["M"], scale(p.let(above - 1), by_separation)),
        },
    )
    return p


def wrench_above(b: Blocks) -> Program:
    """Force and moment above the top plate, with which the sums of the bodies below begin."""
    p = Program("wrench_above", "force and moment above the top plate, with which sums from the top down begin")
    force: Symbols = p.read(b.force, "f")
    moment: Symbols = p.read(b.moment, "m")
    p.write(b.wrench, {"F": force["F"], "M": moment["M"]})
    return p


def excess_force(b: Blocks) -> Program:
    """Balance of linear momentum of all bodies above a surface (3.26), (3.28): its residual."""
    p = Program("excess_force", "balance of linear momentum of all bodies above a surface: left side less right side")
    carried: Symbols = p.read(b.force, "s")
    force: Symbols = p.read(b.force, "f")
    p.write(b.linear, {"r": subtract(carried["F"], force["F"])})
    return p


def contact_excess(b: Blocks) -> Program:
    """The force (3.15)-(3.17) at given psi~, theta~ and N with that of the rim, less that of the surface.

    An open surface has the least force along its axis, as the condensed equations have it.
    """
    p = Program("contact_excess", "contact force (3.15)-(3.17) at given psi~, theta~, N less that of its spring")
    body: Symbols = p.read(b.body, "b")
    given: Symbols = p.read(b.force, "s")
    force: Symbols = p.read(b.force, "f")
    p.write(b.linear, {"r": subtract(subtract(given["F"], force["F"]), scale(LEAST_FORCE, body["t3"]))})
    return p


def programs(b: Blocks, rims: bool) -> list[Program]:
    """The programs of a model with uplift."""
    contact = [unilateral_depth(b), unilateral_inside(b), unilateral_edge(b), *([rim_to_world(b)] if rims else [])]
    sums = [surface_force(b, rims), split_moment(b, rims), wrench_above(b), excess_force(b), contact_excess(b)]
    return [*contact, *sums]
