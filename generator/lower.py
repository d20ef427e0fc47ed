"""Lowering: each program with the local partial derivatives that its tangent needs, statement by statement."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from .program import Program, Statement


@dataclass(frozen=True)
class Tangent:
    """d target = sum of partial * d source over the sources that carry a tangent."""

    target: sp.Symbol
    terms: tuple[tuple[sp.Expr, sp.Symbol], ...]


@dataclass(frozen=True)
class Kernel:
    """A program ready to be emitted: its value statements, and the statements of its tangent."""

    program: Program
    values: tuple[Statement, ...]
    partials: tuple[Statement, ...]
    tangents: tuple[Tangent, ...]

    @property
    def operations(self) -> int:
        """Arithmetic operations of the value form."""
        return int(sum(sp.count_ops(s.expression, visual=False) for s in self.values))

    @property
    def tangent_operations(self) -> int:
        """Arithmetic operations of one tangent column."""
        return sum(2 * len(t.terms) - 1 for t in self.tangents)


def live(program: Program, wanted: set[sp.Symbol]) -> tuple[Statement, ...]:
    """Statements that the wanted names depend on."""
    keep: list[Statement] = []
    needed = set(wanted)
    for statement in reversed(program.statements):
        if statement.target in needed:
            keep.append(statement)
            needed |= statement.expression.free_symbols
    return tuple(reversed(keep))


def active_inputs(program: Program) -> set[sp.Symbol]:
    """Input symbols that carry a tangent."""
    return {sp.Symbol(f"{use.alias}_{name}", real=True) for use in program.inputs for name in use.active}


def own_inputs(program: Program) -> list[sp.Symbol]:
    """Input symbols that carry a tangent, in the order of the blocks."""
    return [
        sp.Symbol(f"{use.alias}_{f.name}", real=True)
        for use in program.inputs
        for f in use.block.fields
        if f.name in use.active
    ]


def column(kernel: Kernel, source: sp.Symbol) -> tuple[tuple[Statement, ...], dict[str, sp.Expr]]:
    """Derivatives of the results with respect to one input: statements, and what each result takes.

    Only what depends on that input appears: the Jacobian of a program in its own inputs is sparse.
    """
    rates: dict[sp.Symbol, sp.Expr] = {source: sp.Integer(1)}
    statements: list[Statement] = []
    for tangent in kernel.tangents:
        terms = [partial * rates[s] for partial, s in tangent.terms if s in rates]
        if not terms:
            continue
        total = sp.Add(*terms)
        if not (total.is_Number or total.is_Symbol or (-total).is_Symbol):
            name = sp.Symbol(f"j_{tangent.target.name}_{source.name}", real=True)
            statements.append(Statement(name, total))
            total = name
        if total != 0:
            rates[tangent.target] = total
    results: dict[str, sp.Expr] = {}
    for name in kernel.program.results:
        value = kernel.program.results[name]
        if name in kernel.program.tangents:
            sign = 1 if value.is_Symbol else -1
            results[name] = sign * rates.get(sign * value, sp.Integer(0))
    needed = {s for e in results.values() for s in e.free_symbols}
    kept = []
    for statement in reversed(statements):
        if statement.target in needed:
            kept.append(statement)
            needed |= statement.expression.free_symbols
    return tuple(reversed(kept)), results


def lower(program: Program) -> Kernel:
    """Prune what no output needs and differentiate statement by statement."""
    values = live(program, {s for e in program.results.values() for s in e.free_symbols})
    if not program.tangents:
        return Kernel(program, values, (), ())
    targets = {s for name in program.tangents for s in program.results[name].free_symbols}
    moving = active_inputs(program)
    partials: list[Statement] = []
    tangents: list[Tangent] = []
    for statement in live(program, targets):
        terms = []
        for source in sorted(statement.expression.free_symbols & moving, key=str):
            partial = sp.diff(statement.expression, source)
            if partial == 0:
                continue
            if not (partial.is_Number or partial.is_Symbol or (-partial).is_Symbol):
                name = sp.Symbol(f"p_{statement.target.name}_{source.name}", real=True)
                partials.append(Statement(name, partial))
                partial = name
            terms.append((partial, source))
        if terms:
            moving.add(statement.target)
            tangents.append(Tangent(statement.target, tuple(terms)))
    return Kernel(program, values, *pruned(partials, tangents, targets))


def pruned(
    partials: list[Statement], tangents: list[Tangent], targets: set[sp.Symbol]
) -> tuple[tuple[Statement, ...], tuple[Tangent, ...]]:
    """What the wanted tangents depend on: a switch has no derivative, so what feeds it may fall away."""
    needed, kept, used = set(targets), [], set()
    for tangent in reversed(tangents):
        if tangent.target in needed:
            kept.append(tangent)
            needed |= {source for _, source in tangent.terms}
            used |= {s for partial, _ in tangent.terms for s in partial.free_symbols}
    return tuple(p for p in partials if p.target in used), tuple(reversed(kept))
