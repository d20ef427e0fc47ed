"""The seat of a slider, for bodies that may part: what holds the two sphere centres of a surface together.

The report's ball joint (delta = 0) becomes a stiff, one-sided seat. With s = -delta, the compression, the largest
penetration over the slider's footprint is |s| where s points into the footprint (the ball joint's direction is
free), and s . n on its edge n otherwise; the force is the gradient of half the stiffness times its square, so that
the seat stores energy and, but for its damping, neither makes nor loses any. Nothing is transmitted once the
penetration is gone. Source: docs/uplift.md; the report names uplift as a possible extension (chapter 5).
"""

from __future__ import annotations

from typing import Any

import sympy as sp

from .blocks import Blocks
from .program import Program, Vector
from .vectors import add, cross, dot, scale

Symbols = dict[str, Any]


def _start(p: Program, b: Blocks) -> tuple[Symbols, Symbols, Vector]:
    """Surface parameters, the slider's body, and the compression s with its rates declared."""
    par: Symbols = p.read(b.surface_parameters, "par", active=False)
    slider: Symbols = p.read(b.body, "b", active=("t3", "w"))
    x: Symbols = p.read(b.coordinates, "x", active=("d", "d1"))
    p.declare_rates(x["d"], x["d1"])
    p.declare_rates(slider["t3"], p.let_vector(cross(slider["w"], slider["t3"]), "dt"))  # (2.36)
    return par, slider, p.let_vector(scale(sp.Integer(-1), x["d"]), "s")


def _finish(p: Program, b: Blocks, par: Symbols, depth: sp.Expr, normal: Vector, s: Vector) -> Program:
    """Force ks depth (1 + cs d depth/dt) along the normal (Hunt and Crossley 1975), its moment, energies."""
    rate = p.rate(depth)
    damping = p.let(par["cs"] * rate)
    elastic = p.let(par["ks"] * depth)
    force = p.let_vector(scale(p.let(elastic * (1 + damping)), normal), "F")
    p.write(
        b.seat,
        {
            "F": force,
            "T": cross(s, force),
            "grip": 1 + damping,
            "stored": elastic * depth / 2,
            "power": elastic * rate,
        },
        tangents=("F", "T"),
    )
    return p


def seat_inside(b: Blocks) -> Program:
    """The force meets the footprint: the seat is a ball joint with a spring, equally stiff in every direction."""
    p = Program("seat_inside", "force of the seat while the resultant meets the footprint")
    par, _, s = _start(p, b)
    depth = p.let(sp.sqrt(dot(s, s)), "depth")
    return _finish(p, b, par, depth, p.let_vector(scale(1 / depth, s), "n"), s)


def seat_edge(b: Blocks) -> Program:
    """The slider stands on its edge: the force keeps to the edge of the footprint and rights the slider."""
    p = Program("seat_edge", "force of the seat while the slider stands on the edge of its footprint")
    par, slider, s = _start(p, b)
    axis = slider["t3"]
    along = p.let(dot(s, axis))
    across = p.let_vector(add(s, scale(-along, axis)), "across")
    size = p.let(sp.sqrt(dot(across, across)))
    depth = p.let(par["ca"] * along + par["sa"] * size, "depth")
    normal = p.let_vector(add(scale(par["ca"], axis), scale(p.let(par["sa"] / size), across)), "n")
    return _finish(p, b, par, depth, normal, s)
