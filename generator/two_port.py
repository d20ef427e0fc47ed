"""Programs of a bearing between two moving ends: load of the interface, wrenches of the ends, and derivatives by them.

End A holds the base, end B the far side of the interface, springs and dampers on the top plate (docs/embedding.md).
`rotation_angles` gives the three angles of a plate from the rotation vector of an end.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import sympy as sp

from .blocks import Blocks
from .directions import Directions
from .functions import ArcTan2, Stumpff
from .lower import (
    Kernel,
    Tangent,
    active_inputs,
    directional,
    jacobian_column,
    lower,
    values_of_tangents,
    with_all_inputs,
)
from .program import ZERO, Program, Statement, Symbols, add, cross, derivative, dot, scale, subtract


def _angles(p: Program, t: Symbols) -> dict[str, sp.Expr]:
    """psi, theta, phi (2.1) of the rotation vector; declares the rates of its statements."""
    p.declare_rates(t["r"], t["r1"])
    p.declare_rates(t["r1"], t["r2"])
    x, y, z = t["r"]
    square = p.let(dot(t["r"], t["r"]))
    sine, versine = p.let(Stumpff(1, square)), p.let(Stumpff(2, square))
    cosine = p.let(1 - versine * square)
    first, across = p.let(cosine + versine * x**2), p.let(sine * z - versine * x * y)
    upright, aside = p.let(cosine + versine * z**2), p.let(sine * x - versine * y * z)
    cos_square = p.let(first**2 + across**2)
    cos_theta = p.let(sp.sqrt(cos_square))
    return {
        "psi": p.let(ArcTan2(p.let(aside / cos_theta), p.let(upright / cos_theta))),
        "theta": p.let(ArcTan2(p.let(versine * x * z + sine * y), cos_theta)),
        "phi": p.let(ArcTan2(p.let(across / cos_theta), p.let(first / cos_theta))),
    }


def rotation_angles(b: Blocks) -> Program:
    """psi, theta, phi (2.1) of a rotation vector, with two derivatives in time."""
    p = Program("rotation_angles", "angles psi, theta, phi (2.1) of a rotation vector, with two derivatives in time")
    angles = _angles(p, p.read(b.turn, "t"))
    rates = {f"{name}1": p.rate(angle) for name, angle in angles.items()}
    second = {f"{name[:-1]}2": p.rate(rate) for name, rate in rates.items()}
    p.write(b.rotation_angles, {**angles, **rates, **second})
    return p


def interface_load(b: Blocks) -> Program:
    """Force on the top plate by which springs with a moving end differ from those of the top, whose ends are fixed."""
    p = Program("interface_load", "force of the moving end of the interface, and its axial load at rest")
    par: Symbols = p.read(b.top_parameters, "par")
    end: Symbols = p.read(b.far_end, "e")
    x, y, z = subtract(end["u"], end["a"])
    u, v, w = end["v"]
    force = (par["k"] * x + par["c"] * u, par["k"] * y + par["c"] * v, par["kv"] * z + par["cv"] * w - end["axial"])
    p.write(b.force, {"F": force})
    return p


def locking_moment(b: Blocks) -> Program:
    """Moment that locks the spin of a body (docs/model.md, choice 3): end A exerts it. In the plane there is none."""
    p = Program("locking_moment", "moment that locks the spin of a body")
    body: Symbols = p.read(b.body, "b")
    lock: Symbols = p.read(b.lock, "l")
    planar = len(b.moment.fields) == 1
    p.write(b.moment, {"M": ZERO if planar else scale(lock["moment"], body["t3"])})
    return p


def lower_wrench(b: Blocks) -> Program:
    """Force and moment that end A exerts on the bearing, about its present position."""
    p = Program("lower_wrench", "wrench that the lower end exerts, about its present position")
    frame: Symbols = p.read(b.body, "e")
    body: Symbols = p.read(b.body, "b")
    force: Symbols = p.read(b.force, "f")
    moment: Symbols = p.read(b.moment, "m")
    lock_moment: Symbols = p.read(b.moment, "h")
    arm = p.let_vector(subtract(body["C"], frame["C"]), "arm")
    total = add(add(moment["M"], lock_moment["M"]), cross(arm, force["F"]))
    p.write(b.end_wrench, {"F": force["F"], "M": total})
    return p


def upper_wrench(b: Blocks) -> Program:
    """Force and moment that end B exerts on the bearing, about its present position: the interface hands them on."""
    p = Program("upper_wrench", "wrench that the upper end exerts, about its present position")
    end: Symbols = p.read(b.far_end, "e")
    body: Symbols = p.read(b.body, "b")
    force: Symbols = p.read(b.force, "f")
    moment: Symbols = p.read(b.moment, "m")
    arm = p.let_vector(subtract(body["C"], add(end["rest"], end["u"])), "arm")
    against = scale(sp.Integer(-1), force["F"])
    p.write(
        b.end_wrench,
        {"F": against, "M": subtract(cross(arm, against), moment["M"])},
    )
    return p


def programs(b: Blocks) -> list[Program]:
    """All programs of a two-port."""
    return [rotation_angles(b), interface_load(b), locking_moment(b), lower_wrench(b), upper_wrench(b)]


def end_angles(every: Iterable[Program], b: Blocks, along: Directions) -> Iterator[Kernel]:
    """The derivatives of `rotation_angles`: of all results, and of those on which a stage depends at the upper end."""
    for program in every:
        if program.name == "rotation_angles":
            inputs, results = with_all_inputs(program), frozenset(program.results)
            support = results & {field.name for field in b.support.fields}
            found = directional(program, along.suffix, along.columns, inputs, results, False)
            yield lower(found)
            yield lower(replace(found, name=f"support_angles_{along.suffix}", tangents=support))


def _by_unknowns(kernel: Kernel) -> tuple[list[Statement], list[dict[str, sp.Expr]], sp.Matrix]:
    """Statements, derivatives of the results by each unknown, and the inverse of the matrix of the equations."""
    statements: list[Statement] = []
    columns: list[dict[str, sp.Expr]] = []
    program = kernel.program
    for unknown in program.unknowns:
        more, results = jacobian_column(kernel, unknown)
        statements += more
        columns.append(results)

    def name(text: str, expression: sp.Expr) -> sp.Symbol:
        statements.append(Statement(sp.Symbol(text, real=True), expression))
        return statements[-1].target

    def slope(equal: sp.Expr, column: dict[str, sp.Expr]) -> sp.Expr:
        return sp.Add(*(derivative(equal, program.results[name]) * by for name, by in column.items()))

    equal, count = list(program.unknowns.values()), len(program.unknowns)
    matrix = sp.Matrix(count, count, lambda k, i: name(f"m_{k}{i}", int(k == i) - slope(equal[k], columns[i])))
    determinant = name("determinant", matrix.det(method="berkowitz"))
    adjugate = matrix.adjugate()
    return statements, columns, sp.Matrix(count, count, lambda k, i: name(f"n_{k}{i}", adjugate[k, i] / determinant))


def eliminated(program: Program) -> Kernel:
    """The derivatives of `contact`, whose local unknowns follow by the implicit function theorem."""
    kernel, unknowns = lower(program), list(program.unknowns)
    statements, columns, inverse = _by_unknowns(kernel)
    moving = active_inputs(program) - set(unknowns)
    tangents: list[Tangent] = []

    def add(target: sp.Symbol, terms: Iterable[tuple[sp.Expr, sp.Symbol]]) -> None:
        kept = tuple((partial, source) for partial, source in terms if partial != 0 and source in moving)
        if kept:
            tangents.append(Tangent(target, kept))
            moving.add(target)

    for tangent in kernel.tangents:  # at constant unknowns
        add(tangent.target, tangent.terms)
    rests = [sp.Symbol(f"rest_{k}", real=True) for k in range(len(unknowns))]
    for rest, equal in zip(rests, program.unknowns.values(), strict=True):
        add(rest, ((derivative(equal, s), s) for s in sorted(equal.free_symbols, key=str)))
    for k, unknown in enumerate(unknowns):
        moving.discard(unknown)
        add(unknown, [(inverse[k, i], rest) for i, rest in enumerate(rests)])
    results = dict(program.results)
    for name in (name for name in program.results if name in program.tangents):
        value, total = results[name], sp.Symbol(f"total_{name}", real=True)
        sign = 1 if value.is_Symbol else -1
        by_unknowns = [(column[name], unknown) for column, unknown in zip(columns, unknowns, strict=True)]
        add(total, [(sp.Integer(sign), sign * value), *by_unknowns])
        results[name] = total
    inputs = [
        replace(use, active=frozenset(), moving=False) if use.alias in ("g", "c") else use for use in program.inputs
    ]
    lowered = Kernel(
        replace(program, inputs=inputs, results=results), (), (*kernel.partials, *statements), tuple(tangents)
    )
    return replace(lowered, values=values_of_tangents(lowered))
