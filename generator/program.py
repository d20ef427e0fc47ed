"""Straight-line programs: the form in which all equations are written before they are emitted as C.

A program is a list of statements `name = small expression`, each over inputs and earlier names. Every intermediate
result is named when it is formed. Expressions therefore stay small, and derivatives are taken statement by statement
(`lower.py`). Vectors have components along E1, E2, E3 or along a local basis.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import sympy as sp

Vector = tuple[sp.Expr, sp.Expr, sp.Expr]
Symbols = dict[str, Any]
"""Quantity of a block -> its symbol, a `Vector` of symbols, or a constant."""
AXES = "xyz"
POLAR, AXIAL = (None, 0, None), (0, None, 0)
"""Constant components of a vector in a planar model, which keeps (E1, E3) of a polar and E2 of an axial one."""


@cache
def derivative(expression: sp.Expr, symbol: sp.Symbol) -> sp.Expr:
    """Partial derivative of an expression, cached, since models share most of their statements.

    By the rules for sums, products, powers with a number and functions. `sp.diff` gives the same, but spends most of
    its time on finding out which kind of expression it is given.
    """
    if expression == symbol:
        return sp.Integer(1)
    if symbol not in expression.free_symbols:
        return sp.Integer(0)
    args = expression.args
    inner = [derivative(arg, symbol) for arg in args]
    if expression.is_Add:
        return sp.Add(*inner)
    if expression.is_Mul:
        return sp.Add(*(sp.Mul(*args[:i], d, *args[i + 1 :]) for i, d in enumerate(inner) if d != 0))
    if expression.is_Pow and expression.exp.is_Number:
        return expression.exp * expression.base ** (expression.exp - 1) * inner[0]
    if expression.is_Function:
        return sp.Add(*(expression.fdiff(i + 1) * d for i, d in enumerate(inner) if d != 0))
    return sp.diff(expression, symbol)


@dataclass(frozen=True)
class Field:
    """One stored number of a block; name, unit and meaning become a comment of the emitted C.

    fixed: whether nothing that moves in a step changes it: a constant of the formulas of a step, or a value at rest.
    """

    name: str
    unit: str
    meaning: str
    fixed: bool = False


@dataclass(frozen=True)
class Block:
    """A record that C stores as a flat array.

    Attributes:
        name: name of the record.
        fields: the stored numbers, in the order of the array.
        quantities: scalar or vector -> its components, each the name of a field or a constant. A component that is
            identically constant, as the third dimension of a planar model, is not stored and needs no arithmetic.
    """

    name: str
    fields: tuple[Field, ...]
    quantities: Mapping[str, tuple[str | sp.Expr, ...]]

    def symbols(self, alias: str) -> dict[str, sp.Expr | Vector]:
        """Quantity -> its symbol or constant, or a 3-tuple of them; names of symbols begin with `alias`."""
        out: dict[str, sp.Expr | Vector] = {}
        for quantity, parts in self.quantities.items():
            values = tuple(sp.Symbol(f"{alias}_{part}", real=True) if isinstance(part, str) else part for part in parts)
            out[quantity] = values[0] if len(values) == 1 else values
        return out


class BlockBuilder:
    """Builds a block field by field; in a `planar` model, components outside the E1-E3 plane become constants."""

    def __init__(self, name: str, planar: bool) -> None:
        self.name, self.planar = name, planar
        self.fields: list[Field] = []
        self.quantities: dict[str, tuple[str | sp.Expr, ...]] = {}

    def scalar(
        self, name: str, unit: str, meaning: str, constant: int | None = None, fixed: bool = False
    ) -> BlockBuilder:
        """Add a scalar; `constant` is its value in a planar model, None where it is stored there too."""
        if self.planar and constant is not None:
            self.quantities[name] = (sp.Integer(constant),)
        else:
            self.fields.append(Field(name, unit, meaning, fixed))
            self.quantities[name] = (name,)
        return self

    def vector(
        self,
        name: str,
        unit: str,
        meaning: str,
        planar: tuple[int | None, int | None, int | None],
        fixed: bool = False,
    ) -> BlockBuilder:
        """Add a vector; `planar` gives its constant components in a planar model, None for a stored one."""
        parts: list[str | sp.Expr] = []
        for axis, constant in zip(AXES, planar, strict=True):
            if self.planar and constant is not None:
                parts.append(sp.Integer(constant))
            else:
                self.fields.append(Field(f"{name}{axis}", unit, meaning, fixed))
                parts.append(f"{name}{axis}")
        self.quantities[name] = tuple(parts)
        return self

    def build(self) -> Block:
        """The block with the fields added so far."""
        return Block(self.name, tuple(self.fields), self.quantities)


@dataclass(frozen=True)
class Use:
    """One use of a block by a program, as an input or as the output.

    Attributes:
        block: the record.
        alias: prefix of its symbols in the program.
        active: names of the stored fields with respect to which the program is differentiated; empty for parameters.
        moving: whether the emitted tangent has an argument for this block. It is the same in every model, whatever
            the effects leave out, so that C calls the function in one way.
    """

    block: Block
    alias: str
    active: frozenset[str]
    moving: bool = False


@dataclass(frozen=True)
class Statement:
    """`target = expression`."""

    target: sp.Symbol
    expression: sp.Expr


@dataclass
class Program:
    """A straight-line program that computes one block from others."""

    name: str
    summary: str
    inputs: list[Use] = field(default_factory=list)
    output: Use | None = None
    statements: list[Statement] = field(default_factory=list)
    results: dict[str, sp.Expr] = field(default_factory=dict)
    """Stored field of the output -> its value, a symbol or a constant."""
    tangents: frozenset[str] = frozenset()
    """Stored fields of the output whose tangent is emitted; empty for a program without a tangent."""
    slopes: frozenset[str] = frozenset()
    """Stored fields of the output that are derivatives themselves, of which no derivatives are taken."""
    columns: str = ""
    """C constant with the number of columns of the tangent."""
    lanes: str = ""
    """C constant with the number of surfaces or unknowns for which C evaluates it at once (SIMD), with the Jacobian
    with respect to its active inputs; empty for a program that is evaluated once."""
    unknowns: dict[sp.Symbol, sp.Expr] = field(default_factory=dict)
    """Input for which the runtime solves -> what it equals, by the results: the stage formula, or a law."""
    stored: bool = True
    """Whether the results are stored. Where only their tangents are, a statement whose target is an input is read."""
    rates: dict[sp.Symbol, sp.Expr] = field(default_factory=dict)
    _definitions: dict[sp.Symbol, sp.Expr] = field(default_factory=dict)
    _count: int = 0

    def read(self, block: Block, alias: str, active: bool | Iterable[str] = False) -> dict[str, sp.Expr | Vector]:
        """Declare an input block and return its symbols.

        Args:
            block: the record.
            alias: prefix of its symbols.
            active: quantities by which the program is differentiated alone, outside of a schedule (`directions.py`);
                True: all, False: none.
        """
        names = [f.name for f in block.fields]
        chosen = names if active is True else [] if active is False else fields_of(block, active)
        self.inputs.append(Use(block, alias, frozenset(chosen), moving=active is not False))
        return block.symbols(alias)

    def let(self, expression: sp.Expr, name: str = "s") -> sp.Expr:
        """Add the statement `name_<count> = expression` and return its symbol.

        Numbers, symbols and their negatives are returned as they are.
        """
        expression = sp.sympify(expression)
        if expression.is_Number or expression.is_Symbol or (-expression).is_Symbol:
            return expression
        self._count += 1
        target = sp.Symbol(f"{name}_{self._count}", real=True)
        self.statements.append(Statement(target, expression))
        self._definitions[target] = expression
        return target

    def let_vector(self, vector: Vector, name: str = "s") -> Vector:
        """`let` for the three components of a vector."""
        x, y, z = (self.let(component, f"{name}{axis}") for component, axis in zip(vector, AXES, strict=True))
        return (x, y, z)

    def rate_of(self, symbol: sp.Symbol) -> sp.Expr:
        """Time derivative of a symbol: as declared in `rates`, else from its statement, else zero (a parameter)."""
        if symbol not in self.rates:
            definition = self._definitions.get(symbol)
            self.rates[symbol] = sp.Integer(0) if definition is None else self.rate(definition)
        return self.rates[symbol]

    def rate(self, expression: sp.Expr) -> sp.Expr:
        """Total time derivative of an expression by the chain rule, as a new statement."""
        expression = sp.sympify(expression)
        terms = (derivative(expression, s) * self.rate_of(s) for s in sorted(expression.free_symbols, key=str))
        return self.let(sp.Add(*terms), "rate")

    def rate_vector(self, vector: Vector) -> Vector:
        """`rate` for the three components of a vector."""
        x, y, z = (self.rate(component) for component in vector)
        return (x, y, z)

    def partials(
        self, values: Iterable[sp.Expr], symbol: sp.Expr, given: Mapping[sp.Expr, sp.Expr] | None = None
    ) -> Iterator[sp.Expr]:
        """Derivatives of named values with respect to a symbol, as new statements; zero with respect to a number.

        given: derivatives of symbols, whatever these follow from; 0 for what is held constant.
        """
        rates = {one: slope for one, slope in (given or {}).items() if one.is_Symbol}
        if symbol.is_Symbol:
            rates[symbol] = sp.Integer(1)
        for value in values:
            definition = self._definitions.get(value, value)
            saved, self.rates = self.rates, rates
            terms = [derivative(definition, s) * self.rate_of(s) for s in sorted(definition.free_symbols, key=str)]
            self.rates = saved
            yield self.let(sp.factor_terms(sp.Add(*terms)), "partial")

    def partial(self, value: sp.Expr, symbol: sp.Expr, given: Mapping[sp.Expr, sp.Expr] | None = None) -> sp.Expr:
        """`partials` of one value."""
        return next(self.partials((value,), symbol, given))

    def declare_rates(self, vector: Vector, rates: Vector) -> None:
        """Declare the time derivative of a vector of symbols, such as (2.36) for a basis vector."""
        for component, rate in zip(vector, rates, strict=True):
            if component.is_Symbol:
                self.rates[component] = rate
            elif (-component).is_Symbol:
                self.rates[-component] = -rate

    def write(
        self,
        block: Block,
        values: Mapping[str, sp.Expr | Vector],
        tangents: bool | Iterable[str] = False,
        columns: str = "MSFP_DOF",
        alias: str = "out",
        slopes: Iterable[str] = (),
    ) -> None:
        """Declare the output block and its values.

        Args:
            block: the record.
            values: quantity -> its value; every quantity of the block must be given.
            tangents: quantities whose tangent by the `active` inputs is emitted; True: all, False: none.
            columns: C constant with the number of columns of the tangent.
            alias: prefix of the output in emitted code and LaTeX.
            slopes: quantities that are derivatives themselves.

        Raises:
            AssertionError: a value contradicts a constant component of the block, or is not in the block.
        """
        for quantity, parts in block.quantities.items():
            value = values[quantity]
            components = value if isinstance(value, tuple) else (value,)
            for part, component in zip(parts, components, strict=True):
                if isinstance(part, str):
                    self.results[part] = self.let(component, "out")
                elif sp.sympify(component) != part:
                    raise AssertionError(
                        f"{self.name}: {quantity} of block {block.name} is {component}, but generator/blocks.py keeps "
                        f"it at {part} in a planar model; store it there, with None in place of {part}"
                    )
        unknown = set(values) - set(block.quantities)
        if unknown:
            raise AssertionError(f"{self.name}: {sorted(unknown)} are not in block {block.name}")
        self.output = Use(block, alias, frozenset())
        names = [f.name for f in block.fields]
        self.tangents = frozenset(
            names if tangents is True else [] if tangents is False else fields_of(block, tangents)
        )
        self.slopes = frozenset(fields_of(block, slopes))
        self.columns = columns if self.tangents else ""


def fields_of(block: Block, quantities: Iterable[str]) -> list[str]:
    """Names of the stored fields of the given quantities of a block."""
    return [part for quantity in quantities for part in block.quantities[quantity] if isinstance(part, str)]


ZERO: Vector = (sp.Integer(0), sp.Integer(0), sp.Integer(0))


def add(*vectors: Vector) -> Vector:
    """Sum of vectors."""
    x, y, z = (sp.Add(*components) for components in zip(*vectors, strict=True))
    return (x, y, z)


def scale(factor: sp.Expr, vector: Vector) -> Vector:
    """Scalar times vector."""
    return (factor * vector[0], factor * vector[1], factor * vector[2])


def subtract(a: Vector, b: Vector) -> Vector:
    """Difference a - b."""
    return add(a, scale(sp.Integer(-1), b))


def dot(a: Vector, b: Vector) -> sp.Expr:
    """Scalar product."""
    return sp.Add(*(p * q for p, q in zip(a, b, strict=True)))


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def combine(basis: tuple[Vector, Vector, Vector], components: Vector) -> Vector:
    """Vector with the given components along `basis`."""
    return add(*(scale(c, t) for c, t in zip(components, basis, strict=True)))


def project(basis: tuple[Vector, Vector, Vector], vector: Vector) -> Vector:
    """Components of a vector along `basis`."""
    return (dot(basis[0], vector), dot(basis[1], vector), dot(basis[2], vector))
