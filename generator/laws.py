"""Friction laws: the fields that a law adds to the blocks, and the statements that it adds to the contact programs.

With a law, the friction coefficient mu is a local unknown of the contact, besides Y and Z: it depends on normal force,
slip and what the surface remembers, such as its temperature, which depend on mu in turn. The program `contact`
therefore has one more equation to solve. In `report_contact` psi~, theta~ and N are given, and mu follows directly. A
model of constant friction uses none of this.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import sympy as sp

from msfp_gen.specification.formula import Operations, fold
from msfp_gen.specification.friction_laws import Law, Memory
from msfp_gen.specification.spin import Spin

from .blocks import Blocks
from .functions import Modulus, Step
from .program import Block, Field, Program

Symbols = dict[str, Any]
COVER_TRANSITION = sp.Rational(1, 10)
"""Half-width of the transition, in (x/reach)^2 about 1, over which the patch uncovers the centre of the surface: x is
within 5 % of `reach`."""

TILT_FIELD = Field("tilt", "-", "cosine of the angle between the axes of the two bodies")


def with_fields(block: Block, fields: list[Field], before: str | None = None) -> Block:
    """The block with more scalar fields, at its end or before the field named `before`."""
    at = len(block.fields) if before is None else [f.name for f in block.fields].index(before)
    more: dict[str, tuple[str | sp.Expr, ...]] = {f.name: (f.name,) for f in fields}
    return Block(block.name, (*block.fields[:at], *fields, *block.fields[at:]), {**block.quantities, **more})


def add_law_fields(b: Blocks, law: Law | None) -> Blocks:
    """The blocks with the fields that a friction law needs; unchanged for constant friction (None)."""
    if law is None:
        return b
    contact = with_fields(b.contact, [Field("mu", "-", "friction coefficient by its law")], before="N")
    slopes = [Field(f"law_{f.name}", "-", f"d mu/d{f.name} at constant N and slip") for f in b.friction.fields]
    contact = with_fields(contact, slopes)
    b = replace(
        b,
        coefficient=with_fields(
            Block("coefficient", (), {}), [Field("mu", "-", "friction coefficient, solved for with Y and Z")]
        ),
        contact=contact,
    )
    return b if law.memory is None else _add_memory_fields(b, law.memory)


def _add_memory_fields(b: Blocks, memory: Memory) -> Blocks:
    """The blocks with the fields of what a surface remembers."""
    fields = [
        Field("past", memory.unit, f"{memory.meaning}: less its start and what the source of this stage contributes"),
        Field("gain", f"({memory.unit})/({memory.source_unit})", "what it contributes, per unit; 0 where it is given"),
    ]
    source = Field("source", memory.source_unit, f"{memory.source}: source of the {memory.meaning}")
    results = [source, Field("memory", memory.unit, memory.meaning), Field("law_mu", "-", "d mu/d mu likewise")]
    if memory.where_covered:
        b = replace(
            b, contact_frame=with_fields(b.contact_frame, [TILT_FIELD]), relative=with_fields(b.relative, [TILT_FIELD])
        )
    return replace(
        b,
        before=with_fields(b.before, fields),
        stage=with_fields(b.stage, fields),
        contact=with_fields(b.contact, results),
        report_contact=with_fields(b.report_contact, [source]),
    )


def read_unknown_coefficient(p: Program, b: Blocks, law: Law | None, par: Symbols) -> Symbols:
    """Parameters of a surface for `contact`: with a law, mu is the unknown coefficient instead of the given one.

    The symbols of the block `coefficient` are added under the key "law".
    """
    if law is None:
        return par
    assert b.coefficient is not None
    c: Symbols = p.read(b.coefficient, "c", active=("mu",))
    return {**par, "mu": c["mu"], "law": c}


def law_results(
    p: Program,
    law: Law | None,
    par: Symbols,
    unknown: Symbols,
    stage: Symbols,
    loc: Symbols,
    N: sp.Expr,
    kept: sp.Expr,
    slip: Symbols,
) -> Symbols:
    """Results that a law adds to `contact`; empty for constant friction.

    They are mu by the law and its derivatives with respect to the friction force over -mu N at constant N and slip
    velocity. With a memory they include its source, its value and the derivative of the law with respect to the unknown
    mu.

    Args:
        p: program of the contact.
        law: friction law.
        par: symbols of the surface parameters.
        unknown: the result of `read_unknown_coefficient`.
        stage: symbols of the block `stage`.
        loc: symbols of the block `contact_frame`.
        N: normal force.
        kept: derivative of the friction state with respect to the friction force over -mu N.
        slip: slip velocity with the velocity of plastic slip and its derivatives, of `contact.slip`.
    """
    if law is None:
        return {}
    c = unknown["law"]
    variables = law_variables(p, law, par, N, slip["plastic"])
    results: Symbols = {}
    memory = law.memory
    if memory:
        share = source_of(p, memory, par, variables, loc)
        results["source"] = p.let(c["mu"] * share, "source") if memory.by_friction else share
        value = start_of(memory, par) + stage["past"] + stage["gain"] * results["source"]
        variables[memory.variable] = results["memory"] = p.let(value, memory.variable)
    mu = results["mu"] = coefficient(p, law, par, variables)
    if memory:
        by_memory = partial_derivative(p, mu, results["memory"]) if memory.by_friction else sp.Integer(0)
        results["law_mu"] = p.let(by_memory * stage["gain"] * share)
    slope = p.let(partial_derivative(p, mu, variables["v"]) * kept)
    return results | {f"law_{name}": p.let(slope * slip[f"plastic_{name}"]) for name in ("Y", "Z")}


def evaluate_law(
    p: Program, b: Blocks, law: Law | None, par: Symbols, loc: Symbols, N: sp.Expr, slip: Symbols
) -> tuple[Symbols, Symbols]:
    """The law at given N and slip velocity, for `report_contact`; arguments as of `law_results`.

    Returns the surface parameters with mu by the law, and the results that the law adds.
    """
    if law is None:
        return par, {}
    variables = law_variables(p, law, par, N, slip["plastic"])
    memory = law.memory
    if memory is None:
        return {**par, "mu": coefficient(p, law, par, variables)}, {}
    stage: Symbols = p.read(b.stage, "h", active=False)
    value = p.let(start_of(memory, par) + stage["past"], memory.variable)
    mu = coefficient(p, law, par, {**variables, memory.variable: value})
    source = source_of(p, memory, par, variables, loc)
    return {**par, "mu": mu}, {"source": mu * source if memory.by_friction else source}


def law_variables(p: Program, law: Law, par: Symbols, N: sp.Expr, velocity: sp.Expr) -> Symbols:
    """Variables of a friction law but its memory: normal force, sliding velocity and, if needed, pressure."""
    pressure = {"p": p.let(N / par["area"], "pressure")} if law.needs_pressure else {}
    return {"N": N, "v": velocity, **pressure}


def coefficient(p: Program, law: Law, par: Symbols, variables: Symbols) -> sp.Expr:
    """Friction coefficient by the formula of the law; every operation becomes a statement."""
    return p.let(fold(law.tree, {**par, **variables}, operations(p)), "mu")


def drilling_moment(p: Program, way: Spin, par: Symbols, N: sp.Expr, rate: sp.Expr) -> sp.Expr:
    """Moment that resists spin at this rate, about the contact normal [N m]."""
    return p.let(fold(way.tree, {**par, "r": par["rs"], "N": N, "w": rate}, operations(p)), "drilling")


def start_of(memory: Memory, par: Symbols) -> sp.Expr:
    """Value of a memory at the start."""
    return par[memory.start] if memory.start else sp.Integer(0)


def source_of(p: Program, memory: Memory, par: Symbols, variables: Symbols, loc: Symbols) -> sp.Expr:
    """Source of a memory, over the friction coefficient where it is proportional to that too."""
    products: Operations = {**operations(p), "mul": lambda a, b: a * b}
    source = fold(memory.tree, {**par, **variables}, products)
    return p.let(source * cover(p, par, loc) if memory.where_covered else source, "share")


def cover(p: Program, par: Symbols, loc: Symbols) -> sp.Expr:
    """1 where the contact patch covers the centre of the surface, 0 elsewhere.

    The temperature of a surface is that at its centre. The patch is R sin(tilt) away from there; the transition between
    covered and uncovered is a cubic over `COVER_TRANSITION`.
    """
    distance = p.let((par["R"] / par["reach"]) ** 2 * (1 - loc["tilt"] ** 2))  # squared, over the square of the reach
    z = p.let((1 - distance) / COVER_TRANSITION)
    partly, fully = p.let(Step(z + 1)), p.let(Step(z - 1))
    return p.let(fully + (partly - fully) * (2 + z * (3 - z**2)) / 4, "cover")


def partial_derivative(p: Program, value: sp.Expr, symbol: sp.Symbol) -> sp.Expr:
    """Derivative of a named value with respect to one symbol; all other inputs are constant."""
    saved, p.rates = p.rates, {symbol: sp.Integer(1)}
    derivative = p.rate(value)
    p.rates = saved
    return derivative


def operations(p: Program) -> dict[str, Callable[..., sp.Expr]]:
    """Operations for `fold` that write every result as a statement of the program."""

    def pow_(base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
        return p.let(base ** (sp.Integer(exponent) if exponent == int(exponent) else exponent))

    def minimum(a: sp.Expr, b: sp.Expr) -> sp.Expr:
        return p.let(b + (a - b) * Step(b - a))

    return {
        "number": lambda value: sp.Float(value),
        "neg": lambda a: p.let(-a),
        "pow": pow_,
        "power": lambda base, exponent: p.let(sp.exp(p.let(p.let(sp.log(base)) * exponent))),
        "add": lambda a, b: p.let(a + b),
        "sub": lambda a, b: p.let(a - b),
        "mul": lambda a, b: p.let(a * b),
        "div": lambda a, b: p.let(a / b),
        "exp": lambda a: p.let(sp.exp(a)),
        "log": lambda a: p.let(sp.log(a)),
        "sqrt": lambda a: p.let(sp.sqrt(a)),
        "tanh": lambda a: p.let(sp.tanh(a)),
        "Abs": lambda a: p.let(Modulus(a)),
        "Min": minimum,
        "Max": lambda a, b: p.let(-minimum(-a, -b)),
    }
