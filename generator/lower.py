"""Lowering: reduces a program to the statements that it needs and differentiates it statement by statement.

A directional derivative is that of a program of `derive.py` with other inputs active and other results differentiated;
nothing is derived again. `directions.py` finds which these are.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import sympy as sp

from .program import Program, Statement, Use, derivative


@cache
def operations_of(expression: sp.Expr) -> int:
    """Number of arithmetic operations of an expression."""
    return int(sp.count_ops(expression, visual=False))


@dataclass(frozen=True)
class Tangent:
    """Tangent of one statement: d target = sum of partial * d source.

    Attributes:
        target: symbol that the statement defines.
        terms: (partial derivative, source symbol) for the sources with a nonzero tangent.
    """

    target: sp.Symbol
    terms: tuple[tuple[sp.Expr, sp.Symbol], ...]


@dataclass(frozen=True)
class Kernel:
    """A program ready to be emitted.

    Attributes:
        program: the program as derived.
        values: statements that the results need.
        partials: statements that name the partial derivatives in `tangents`.
        tangents: tangents of the statements, in order of execution.
    """

    program: Program
    values: tuple[Statement, ...]
    partials: tuple[Statement, ...]
    tangents: tuple[Tangent, ...]

    @property
    def operations(self) -> int:
        """Number of arithmetic operations of the values."""
        return sum(operations_of(s.expression) for s in self.values)

    @property
    def tangent_operations(self) -> int:
        """Number of arithmetic operations of one column of the tangent."""
        return sum(2 * len(t.terms) - 1 for t in self.tangents)


def needed_statements(statements: Sequence[Statement], symbols: set[sp.Symbol]) -> tuple[Statement, ...]:
    """Statements on which the given symbols depend, in order of execution."""
    backwards: list[Statement] = []
    needed = set(symbols)
    for statement in reversed(statements):
        if statement.target in needed:
            backwards.append(statement)
            needed |= statement.expression.free_symbols
    return tuple(reversed(backwards))


def symbol_of(use: Use, field: str) -> sp.Symbol:
    """The symbol of a stored field of an input."""
    return sp.Symbol(f"{use.alias}_{field}", real=True)


def moving_symbols(program: Program, sources: set[sp.Symbol]) -> set[sp.Symbol]:
    """The symbols of a program with a derivative by any of the sources, these included."""
    moving = set(sources)
    for statement in program.statements:
        if any(derivative(statement.expression, s) != 0 for s in statement.expression.free_symbols & moving):
            moving.add(statement.target)
    return moving


def symbols_read(program: Program, results: Iterable[str], sources: set[sp.Symbol]) -> set[sp.Symbol]:
    """The sources whose derivatives those of the results contain."""
    moving = moving_symbols(program, sources)
    needed = {s for name in results for s in program.results[name].free_symbols & moving}
    for statement in reversed(program.statements):
        if statement.target in needed:
            terms = statement.expression.free_symbols & moving
            needed |= {s for s in terms if derivative(statement.expression, s) != 0}
    return needed & sources


def active_inputs(program: Program) -> set[sp.Symbol]:
    """Input symbols with respect to which the program is differentiated."""
    return {sp.Symbol(f"{use.alias}_{name}", real=True) for use in program.inputs for name in use.active}


def ordered_active_inputs(program: Program) -> list[sp.Symbol]:
    """The symbols of `active_inputs` in the order in which the blocks store them."""
    return [
        sp.Symbol(f"{use.alias}_{f.name}", real=True)
        for use in program.inputs
        for f in use.block.fields
        if f.name in use.active
    ]


def jacobian_column(kernel: Kernel, source: sp.Symbol) -> tuple[tuple[Statement, ...], dict[str, sp.Expr]]:
    """Derivatives of the results of a program with respect to one of its inputs.

    Statements that do not depend on that input are left out, since the Jacobian is sparse.

    Returns:
        The statements, and result name -> its derivative as a symbol or a constant.
    """
    derivatives: dict[sp.Symbol, sp.Expr] = {source: sp.Integer(1)}
    statements: list[Statement] = []
    for tangent in kernel.tangents:
        terms = [partial * derivatives[s] for partial, s in tangent.terms if s in derivatives]
        if not terms:
            continue
        total = sp.Add(*terms)
        if not (total.is_Number or total.is_Symbol or (-total).is_Symbol):
            name = sp.Symbol(f"j_{tangent.target.name}_{source.name}", real=True)
            statements.append(Statement(name, total))
            total = name
        if total != 0:
            derivatives[tangent.target] = total
    results: dict[str, sp.Expr] = {}
    for name in kernel.program.results:
        value = kernel.program.results[name]
        if name in kernel.program.tangents:
            sign = 1 if value.is_Symbol else -1
            results[name] = sign * derivatives.get(sign * value, sp.Integer(0))
    return needed_statements(statements, {s for e in results.values() for s in e.free_symbols}), results


def lower(program: Program) -> Kernel:
    """Leave out statements that no result needs, and differentiate the others one by one."""
    results = {s for e in program.results.values() for s in e.free_symbols}
    values = needed_statements(program.statements, results)
    if not program.tangents:
        return Kernel(program, values, (), ())
    functions = {s.expression: s.target for s in values if s.expression.is_Function}
    targets = {s for name in program.tangents for s in program.results[name].free_symbols}
    active = active_inputs(program)  # symbols with a nonzero tangent
    partials: list[Statement] = []
    tangents: list[Tangent] = []
    for statement in needed_statements(program.statements, targets):
        terms = []
        for source in sorted(statement.expression.free_symbols & active, key=str):
            partial = derivative(statement.expression, source).xreplace(functions)
            if partial == 0:
                continue
            if not (partial.is_Number or partial.is_Symbol or (-partial).is_Symbol):
                name = sp.Symbol(f"p_{statement.target.name}_{source.name}", real=True)
                partials.append(Statement(name, partial))
                partial = name
            terms.append((partial, source))
        if terms:
            active.add(statement.target)
            tangents.append(Tangent(statement.target, tuple(terms)))
    kernel = Kernel(program, values, *needed_tangents(partials, tangents, targets))
    return kernel if program.stored else replace(kernel, values=values_of_tangents(kernel))


def values_of_tangents(kernel: Kernel) -> tuple[Statement, ...]:
    """Statements on which the tangents depend, but for those whose target is an input."""
    inputs = {sp.Symbol(f"{use.alias}_{f.name}", real=True) for use in kernel.program.inputs for f in use.block.fields}
    partials = [partial for tangent in kernel.tangents for partial, _ in tangent.terms]
    partials += [statement.expression for statement in kernel.partials]
    computed = [statement for statement in kernel.program.statements if statement.target not in inputs]
    return needed_statements(computed, {s for partial in partials for s in partial.free_symbols})


def needed_tangents(
    partials: list[Statement], tangents: list[Tangent], targets: set[sp.Symbol]
) -> tuple[tuple[Statement, ...], tuple[Tangent, ...]]:
    """Partials and tangents on which the tangents of `targets` depend.

    A Heaviside switch has no derivative, so the tangents of its argument may be unnecessary.
    """
    needed, backwards, used = set(targets), [], set()
    for tangent in reversed(tangents):
        if tangent.target in needed:
            backwards.append(tangent)
            needed |= {source for _, source in tangent.terms}
            used |= {s for partial, _ in tangent.terms for s in partial.free_symbols}
    return tuple(p for p in partials if p.target in used), tuple(reversed(backwards))


GRADIENT_COLUMNS = 4
"""Parameters whose derivatives one call carries: as many numbers as the vectors of most processors hold."""


def directional(
    program: Program, suffix: str, columns: str, inputs: list[Use], results: frozenset[str], output_is_stored: bool
) -> Program:
    """The derivatives of a program along directions, as one of another name.

    Args:
        program: the program.
        suffix: what its name ends with.
        columns: C constant with the number of directions.
        inputs: its inputs, with what moves along them as active.
        results: what is differentiated.
        output_is_stored: the results themselves are read, as a block `out`, where the derivatives contain them.
    """
    assert program.output is not None
    names: dict[sp.Expr, sp.Expr] = {}
    if output_is_stored:
        inputs = [*inputs, program.output]
        computed = {statement.target for statement in program.statements}
        for field, result in program.results.items():
            if result in computed:
                names.setdefault(result, sp.Symbol(f"{program.output.alias}_{field}", real=True))
    return replace(
        program,
        name=f"{program.name}_{suffix}",
        inputs=inputs,
        statements=[Statement(s.target.xreplace(names), s.expression.xreplace(names)) for s in program.statements],
        results={field: result.xreplace(names) for field, result in program.results.items()},
        unknowns={unknown: equal.xreplace(names) for unknown, equal in program.unknowns.items()},
        tangents=results,
        columns=columns,
        lanes="",
        stored=False,
    )


def with_all_inputs(program: Program) -> list[Use]:
    """The inputs of a program, all of which move."""
    return [
        replace(use, active=frozenset(field.name for field in use.block.fields), moving=True) for use in program.inputs
    ]


def by_inputs(program: Program) -> Program:
    """The program of a contact, active in every input that it uses, for its Jacobian at all surfaces at once."""
    symbols = {s.name for statement in program.statements for s in statement.expression.free_symbols}

    def used(use: Use) -> Use:
        names = {f.name for f in use.block.fields if use.alias in ("h", "loc") or f"{use.alias}_{f.name}" in symbols}
        return replace(use, active=frozenset(names - {"sign"}), moving=True)

    results = frozenset(program.results) - program.slopes
    return replace(program, name="contact_by_inputs", inputs=[used(use) for use in program.inputs], tangents=results)


def contact_lists(programs: Iterable[Program]) -> dict[str, object]:
    """Inputs of `by_inputs` in order, as (position of the block, index in the block), and indices of its results."""
    for program in programs:
        if not program.lanes or program.output is None:
            continue
        numbered = [(i, use, j, f) for i, use in enumerate(program.inputs) for j, f in enumerate(use.block.fields)]
        fields = enumerate(program.output.block.fields)
        return {
            "inputs": [(i, j) for i, use, j, field in numbered if field.name in use.active],
            "results": [j for j, field in fields if field.name in program.tangents],
        }
    return {}
