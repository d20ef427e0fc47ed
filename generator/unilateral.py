"""Unilateral contact of a surface, for models with uplift; `seat` in names of fields refers to it.

PEER 2017/07 joins the two bodies at the sphere centre by a ball joint (separation delta = 0). With uplift a stiff
contact that transmits compression only replaces it. With the compression s = -delta, the largest penetration over the
footprint of the slider is |s| where s points into the footprint, and s . n with the normal n at its edge otherwise. The
force is the gradient of half the stiffness times the square of the penetration, so the contact conserves energy except
for its damping. It transmits no force where the penetration is not positive. Source: docs/uplift.md; PEER 2017/07
mentions uplift as a possible extension (chapter 5).
"""

from __future__ import annotations

import sympy as sp

from .blocks import Blocks
from .body import LEAST_FORCE
from .functions import Select, Step
from .program import Program, Symbols, Vector, add, combine, cross, dot, scale, subtract

CENTRE = sp.Float("1e-60")
"""Added to a squared length [m^2]: where the length is zero, its derivative is zero, and no value changes."""


def _compression(x: Symbols) -> Vector:
    """Compression s = -delta [m]."""
    return scale(sp.Integer(-1), x["d"])


def _inside(s: Vector) -> sp.Expr:
    """Penetration where s points into the footprint."""
    return sp.sqrt(dot(s, s))


def _at_edge(p: Program, par: Symbols, axis: Vector, s: Vector) -> tuple[sp.Expr, Vector, sp.Expr, sp.Expr]:
    """Penetration at the edge of the footprint; part of s across the axis, its size, and the part along the axis."""
    along = p.let(dot(s, axis))
    across = p.let_vector(add(s, scale(-along, axis)), "across")
    size = p.let(sp.sqrt(dot(across, across) + CENTRE))
    return par["ca"] * along + par["sa"] * size, across, size, along


def _read_inputs(p: Program, b: Blocks) -> tuple[Symbols, Symbols, Vector]:
    """Surface parameters, kinematics of the slider and compression s [m]; declares the time derivatives."""
    par: Symbols = p.read(b.surface_parameters, "par", active=False)
    slider: Symbols = p.read(b.body, "b", active=("t3", "w"))
    x: Symbols = p.read(b.coordinates, "x", active=("d", "d1"))
    p.declare_rates(x["d"], x["d1"])
    p.declare_rates(slider["t3"], p.let_vector(cross(slider["w"], slider["t3"]), "dt"))  # (2.36)
    return par, slider, p.let_vector(_compression(x), "s")


def _write_force(p: Program, b: Blocks, par: Symbols, depth: sp.Expr, normal: Vector, s: Vector) -> Program:
    """Force ks depth (1 + cs d depth/dt) along `normal` (Hunt and Crossley 1975) with its moment and energies."""
    rate = p.rate(depth)
    grip = p.let(1 + par["cs"] * rate)
    pushing = p.let(Step(grip) * grip)  # its damping does not pull
    elastic = p.let(par["ks"] * depth)
    force = p.let_vector(scale(p.let(elastic * pushing), normal), "F")
    p.write(
        b.unilateral,
        {
            "F": force,
            "T": cross(s, force),
            "stored": elastic * depth / 2,
            "lost": p.let(elastic * rate) * (pushing - 1),
            "penetration": depth,
        },
        tangents=("F", "T"),
    )
    return p


def unilateral_depth(b: Blocks) -> Program:
    """Penetration, negative where the contact is open, and how far the compression points out of the footprint."""
    p = Program("unilateral_depth", "unilateral contact: penetration, and by how much the footprint is missed")
    par: Symbols = p.read(b.surface_parameters, "par", active=False)
    slider: Symbols = p.read(b.body, "b", active=False)
    x: Symbols = p.read(b.coordinates, "x", active=False)
    s = p.let_vector(_compression(x), "s")
    edge, _, size, along = _at_edge(p, par, slider["t3"], s)
    beyond = p.let(par["ca"] * size - par["sa"] * along)
    depth = Select(beyond, p.let(edge), p.let(_inside(s)))
    p.write(b.unilateral_depth, {"depth": depth, "beyond": beyond}, tangents=False)
    return p


def unilateral_inside(b: Blocks) -> Program:
    """Contact whose resultant passes through the footprint: a spring that is equally stiff in every direction."""
    p = Program("unilateral_inside", "unilateral contact: force while the resultant passes through the footprint")
    par, _, s = _read_inputs(p, b)
    depth = p.let(_inside(s), "depth")
    return _write_force(p, b, par, depth, p.let_vector(scale(1 / depth, s), "n"), s)


def unilateral_edge(b: Blocks) -> Program:
    """Contact at the edge of the footprint: the slider stands on its edge, and the force produces a righting moment."""
    p = Program("unilateral_edge", "unilateral contact: force while the slider stands on the edge of its footprint")
    par, slider, s = _read_inputs(p, b)
    axis = slider["t3"]
    edge, across, size, _ = _at_edge(p, par, axis, s)
    depth = p.let(edge, "depth")
    normal = p.let_vector(add(scale(par["ca"], axis), scale(p.let(par["sa"] / size), across)), "n")
    return _write_force(p, b, par, depth, normal, s)


def rim_to_world(b: Blocks) -> Program:
    """Rim force along E, and the moment on the slider that its work over a separation requires (docs/uplift.md)."""
    p = Program("rim_to_world", "rim force: from the basis of the body below to E, and its moment by the separation")
    body: Symbols = p.read(b.body, "b", active=("t1", "t2", "t3"))
    x: Symbols = p.read(b.coordinates, "x", active=("d",))
    rim: Symbols = p.read(b.rim, "rim", active=("f",))
    force = p.let_vector(combine((body["t1"], body["t2"], body["t3"]), rim["f"]), "F")
    p.write(b.rim_wrench, {"F": force, "T": cross(force, x["d"])})
    return p


def surface_force(b: Blocks, rims: bool) -> Program:
    """Force of a surface on the body above, of its contact and its rim."""
    p = Program("surface_force", "force of a surface on the body above: of its unilateral contact and its rim")
    contact: Symbols = p.read(b.unilateral, "c", active=("F",))
    force = contact["F"]
    if rims:
        rim: Symbols = p.read(b.rim_wrench, "rim", active=("F",))
        force = add(force, rim["F"])
    p.write(b.force, {"F": force})
    return p


def split_moment(b: Blocks, rims: bool) -> Program:
    """Moments of a surface on the bodies above and below, each about the sphere centre of its body.

    They are equal but on the slider, where the moments of contact and rim by the separation are added.
    """
    p = Program("split_moment", "moments of a surface on the bodies above and below, each about its sphere centre")
    par: Symbols = p.read(b.surface_parameters, "par", active=False)
    joint: Symbols = p.read(b.moment, "j")
    contact: Symbols = p.read(b.unilateral, "c", active=("T",))
    by_separation = contact["T"]
    if rims:
        rim: Symbols = p.read(b.rim_wrench, "rim", active=("T",))
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
    body: Symbols = p.read(b.body, "b", active=("t3",))
    given: Symbols = p.read(b.force, "s")
    force: Symbols = p.read(b.force, "f")
    p.write(b.linear, {"r": subtract(subtract(given["F"], force["F"]), scale(LEAST_FORCE, body["t3"]))})
    return p


def programs(b: Blocks, rims: bool) -> list[Program]:
    """The programs of a model with uplift."""
    contact = [unilateral_depth(b), unilateral_inside(b), unilateral_edge(b), *([rim_to_world(b)] if rims else [])]
    sums = [surface_force(b, rims), split_moment(b, rims), wrench_above(b), excess_force(b), contact_excess(b)]
    return [*contact, *sums]
