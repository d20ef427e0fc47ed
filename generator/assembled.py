"""Explicit equations of a small stack, assembled from the programs for comparison with PEER 2017/07.

It serves documentation and tests only: the C code is emitted from the programs, and expanded expressions of larger
stacks would be too long.
"""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

from msfp_gen.specification.layout import Effects, Layout, ModelSpec

from .derive import derive
from .latex import result_statements, to_latex
from .program import Program
from .schedule import momentum_balances, passes_of, unrolled

Values = Mapping[str, sp.Expr]
"""Stored field of a block -> its value."""

NAMES = {
    "ell_1": r"\ell_{1}",
    "ell_2": r"\ell_{2}",
    "lambda_2": r"\lambda_{1}^{2}",
    "thetat_1": r"\tilde{\theta}_{1}",
    "ddu_g1": r"\ddot{u}_{g1}",
    "ddu_g3": r"\ddot{u}_{g3}",
    "dtheta_1": r"\dot{\theta}_{1}",
    "dtheta_2": r"\dot{\theta}_{2}",
    "ddtheta_1": r"\ddot{\theta}_{1}",
    "ddtheta_2": r"\ddot{\theta}_{2}",
}
NO_RIG = dict.fromkeys(("k", "c", "kr", "cr", "m", "jt", "ja", "h", "g", "mz", "kv", "cv", "x0x", "x0z"), sp.Integer(0))
NO_FOOT = dict.fromkeys(("y", "y1", "beta", "mobility", "share"), sp.Integer(0))


def symbol(name: str) -> sp.Symbol:
    """A real symbol of the assembled stack."""
    return sp.Symbol(name, real=True)


def evaluate(program: Program, **inputs: Values) -> dict[str, sp.Expr]:
    """Results of a program as expanded expressions of its inputs; `inputs` are the values of each alias."""
    known = {
        symbol(f"{alias}_{field}"): sp.sympify(value)
        for alias, fields in inputs.items()
        for field, value in fields.items()
    }
    for statement in result_statements(program, program.results):
        known[statement.target] = statement.expression.xreplace(known)
    return {field: expression.xreplace(known) for field, expression in program.results.items()}


def body(k: int, lower: sp.Expr, upper: sp.Expr) -> dict[str, Values]:
    """Values of body k between two concave-up surfaces of radii `lower` and `upper`, by alias of `body_block`."""
    values = {"height": symbol(f"ell_{k}"), "centroid": symbol(f"z_{k}"), "mass": symbol(f"m_{k}")}
    values |= {"inertia_transverse": symbol(f"lambda_{k}"), "inertia_axial": sp.Integer(0)}
    sides = {"sign_lower": sp.Integer(1), "sign_upper": sp.Integer(1), "radius_lower": lower, "radius_upper": upper}
    return {"b": values, "s": {**sides, "gravity": symbol("g")}}


def coordinates(k: int) -> dict[str, sp.Expr]:
    """Tilt angle of body k with its first and second time derivative."""
    return {"theta": symbol(f"theta_{k}"), "theta1": symbol(f"dtheta_{k}"), "theta2": symbol(f"ddtheta_{k}")}


def ground_motion() -> dict[str, sp.Expr]:
    """Kinematics of the ground, which takes the place of the body below the base: the frame E at r_01."""
    fields = dict.fromkeys(("t1z", "t3x", "wy", "wpy", "aly", "alpy"), sp.Integer(0))
    fields |= {"t1x": sp.Integer(1), "t3z": sp.Integer(1)}
    for field, dots in (("C", ""), ("V", "d"), ("A", "dd")):
        fields |= {f"{field}x": symbol(f"{dots}u_g1"), f"{field}z": symbol(f"{dots}u_g3")}
    return fields


def assembled() -> dict[str, sp.Expr]:
    """Explicit equations of the planar stack (n, m, p) = (2, 1, 0) without rim contact and rig.

    The base translates by u_g1, u_g3 and rotates by theta_1. The force F_1, F_3 and the moment M_2 act on the top plate
    at r_22.

    Returns:
        `E1`, `E3`: linear momentum (3.28) [N]; `t2`: angular momentum (3.29) [N m], left side less right side as in
        `Model.residual`; `dY`: friction rate (3.18) [1/s].
    """
    spec = ModelSpec(Layout(2, 1, 0), Effects(dimension="planar", rims=False, bouc_wen="report"))
    p = {program.name: program for program in derive(spec).programs}
    R, zero = symbol("R_1"), sp.Integer(0)
    lower, plate = evaluate(p["body_block"], **body(1, zero, R)), evaluate(p["body_block"], **body(2, R, zero))
    surface = {"sign": sp.Integer(1), "R": R, "mu": symbol("mu_1"), "dy": symbol("d_1"), "td": zero}
    lists: dict[tuple[str, int], dict[str, sp.Expr]] = {
        ("frame", 0): ground_motion(),
        ("x", 0): coordinates(1),
        ("x", 1): coordinates(2),
        ("body_parameters", 0): lower,
        ("body_parameters", 1): plate,
        ("surface_parameters", 0): surface,
        ("top_parameters", 0): NO_RIG,
        ("foot_stage", 0): NO_FOOT,
        ("load_force", 0): {"Fx": symbol("F_1"), "Fz": symbol("F_3")},
        ("load_moment", 0): {"My": symbol("M_2")},
        ("unknowns", 0): {"theta": symbol("thetat_1"), "N": symbol("N_1")},
        ("friction", 0): {"Y": symbol("Y_1")},
    }
    for name, reads, writes in unrolled(passes_of(momentum_balances(spec.effects)), spec.layout.signs):
        aliases = [use.alias for use in p[name].inputs]
        result = evaluate(p[name], **dict(zip(aliases, (lists[place] for place in reads), strict=True)))
        lists |= dict.fromkeys(writes, result)  # each list takes the fields that it has
    balances = lists["balances", 1]
    return {"E1": balances["Fx"], "E3": balances["Fz"], "t2": balances["My"], "dY": lists["report_contact", 0]["dY"]}


def readable(expression: sp.Expr) -> sp.Expr:
    """An assembled expression in few terms: products of sines and cosines combined, masses and forces factored out."""
    from sympy.simplify.fu import TR8

    def by_angle(factor: sp.Expr) -> sp.Expr:
        return sp.collect(factor, sorted(factor.atoms(sp.sin, sp.cos), key=str), sp.factor)

    heads = [symbol(name) for name in ("m_2", "N_1", "F_1", "F_3")]
    return sp.collect(sp.expand(TR8(sp.expand(expression))), heads, by_angle)


def over_level_base(expression: sp.Expr) -> sp.Expr:
    """An assembled expression for a base that translates without rotation: theta_1 = 0."""
    return expression.xreplace({symbol(f"{dots}theta_1"): sp.Integer(0) for dots in ("", "d", "dd")})


def assembled_latex() -> dict[str, list[str]]:
    """LaTeX of `assembled` for a base without rotation: the signed terms of each sum."""
    names = {symbol(name): text for name, text in NAMES.items()}
    rows: dict[str, list[str]] = {}
    for name, expression in assembled().items():
        terms = [to_latex(term, names) for term in readable(over_level_base(expression)).as_ordered_terms()]
        rows[name] = [term if i == 0 or term.startswith("-") else f"+ {term}" for i, term in enumerate(terms)]
    return rows
