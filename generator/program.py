"""Straight-line programs: the form every equation of this project takes on its way to C.

A program is a list of statements `name = small expression`, each over inputs and earlier names.
Every intermediate of the recursion is named the moment it is formed, so that nothing here ever
walks an expanded tree: derivatives are taken statement by statement (`derivative.py`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import sympy as sp

Vector = tuple[sp.Expr, sp.Expr, sp.Expr]
AXES = "xyz"


@dataclass(frozen=True)
class Field:
    """One stored number of a block: its name, unit and meaning (they end up in the emitted C)."""

    name: str
    unit: str
    meaning: str


@dataclass(frozen=True)
class Block:
    """A record that C stores as a flat array; `shape` maps each quantity to scalars or constants.

    A component that vanishes identically (the third dimension of a planar model) is a constant
    here: it takes no place in the array, no statement and no arithmetic.
    """

    name: str
    fields: tuple[Field, ...]
    quantities: Mapping[str, tuple[str | sp.Expr, ...]]

    def symbols(self, alias: str) -> dict[str, sp.Expr | Vector]:
        """Symbols of one use of this block: scalars as they are, vectors as 3-tuples."""
        out: dict[str, sp.Expr | Vector] = {}
        for quantity, parts in self.quantities.items():
            values = tuple(sp.Symbol(f"{alias}_{part}", real=True) if isinstance(part, str) else part for part in parts)
            out[quantity] = values[0] if len(values) == 1 else values
        return out


class BlockBuilder:
    """Collects the fields of a block; `planar` drops what vanishes in the E1-E3 plane."""

    def __init__(self, name: str, planar: bool) -> None:
        self.name, self.planar = name, planar
        self.fields: list[Field] = []
        self.quantities: dict[str, tuple[str | sp.Expr, ...]] = {}

    def scalar(self, name: str, unit: str, meaning: str, constant: int | None = None) -> BlockBuilder:
        """Add a scalar; `constant` is its value in a planar model."""
        if self.planar and constant is not None:
            self.quantities[name] = (sp.Integer(constant),)
        else:
            self.fields.append(Field(name, unit, meaning))
            self.quantities[name] = (name,)
        return self

    def vector(
        self, name: str, unit: str, meaning: str, planar: tuple[int | None, int | None, int | None]
    ) -> BlockBuilder:
        """Add a vector; `planar` gives the constant components of a planar model (None: stored)."""
        parts: list[str | sp.Expr] = []
        for axis, constant in zip(AXES, planar, strict=True):
            if self.planar and constant is not None:
                parts.append(sp.Integer(constant))
            else:
                self.fields.append(Field(f"{name}{axis}", unit, meaning))
                parts.append(f"{name}{axis}")
        self.quantities[name] = tuple(parts)
        return self

    def build(self) -> Block:
        """Freeze the block."""
        return Block(self.name, tuple(self.fields), self.quantities)


@dataclass(frozen=True)
class Use:
    """A block as one program sees it: under an alias, read or written."""

    block: Block
    alias: str
    active: frozenset[str]
    """Names of the stored fields that carry a tangent (none: parameters)."""
    moving: bool = False
    """Whether the emitted tangent takes columns of this block: the same in every model, whatever is left out."""


@dataclass(frozen=True)
class Statement:
    """`target = expression`."""

    target: sp.Symbol
    expression: sp.Expr


@dataclass
class Program:
    """A straight-line program between blocks."""

    name: str
    summary: str
    inputs: list[Use] = field(default_factory=list)
    output: Use | None = None
    statements: list[Statement] = field(default_factory=list)
    results: dict[str, sp.Expr] = field(default_factory=dict)
    """Stored output field -> the expression (a name or a constant) it takes."""
    tangents: frozenset[str] = frozenset()
    """Stored output fields whose tangent is wanted (none: a program without a tangent form)."""
    columns: str = ""
    """C constant: the number of tangent columns."""
    lanes: bool = False
    """Whether C runs it for all surfaces side by side, and takes its tangent with respect to its own inputs."""
    rates: dict[sp.Symbol, sp.Expr] = field(default_factory=dict)
    _definitions: dict[sp.Symbol, sp.Expr] = field(default_factory=dict)
    _count: int = 0

    def read(self, block: Block, alias: str, active: bool | Iterable[str] = True) -> dict[str, sp.Expr | Vector]:
        """Declare an input block and return its symbols; `active` tells what carries a tangent."""
        names = [f.name for f in block.fields]
        chosen = names if active is True else [] if active is False else fields_of(block, active)
        self.inputs.append(Use(block, alias, frozenset(chosen), moving=active is not False))
        return block.symbols(alias)

    def let(self, expression: sp.Expr, name: str = "s") -> sp.Expr:
        """Name an intermediate; numbers, symbols and their negatives need no name."""
        expression = sp.sympify(expression)
        if expression.is_Number or expression.is_Symbol or (-expression).is_Symbol:
            return expression
        self._count += 1
        target = sp.Symbol(f"{name}_{self._count}", real=True)
        self.statements.append(Statement(target, expression))
        self._definitions[target] = expression
        return target

    def let_vector(self, vector: Vector, name: str = "s") -> Vector:
        """Name the three components of a vector."""
        x, y, z = (self.let(component, f"{name}{axis}") for component, axis in zip(vector, AXES, strict=True))
        return (x, y, z)

    def rate_of(self, symbol: sp.Symbol) -> sp.Expr:
        """Time derivative of one symbol: declared in `rates`, found from its definition, or zero (a parameter)."""
        if symbol not in self.rates:
            definition = self._definitions.get(symbol)
            self.rates[symbol] = sp.Integer(0) if definition is None else self.rate(definition)
        return self.rates[symbol]

    def rate(self, expression: sp.Expr) -> sp.Expr:
        """Total time derivative of a small expression by the chain rule; named at once."""
        expression = sp.sympify(expression)
        terms = (sp.diff(expression, s) * self.rate_of(s) for s in sorted(expression.free_symbols, key=str))
        return self.let(sp.Add(*terms), "rate")

    def rate_vector(self, vector: Vector) -> Vector:
        """Total time derivative of a vector of small expressions."""
        x, y, z = (self.rate(component) for component in vector)
        return (x, y, z)

    def declare_rates(self, vector: Vector, rates: Vector) -> None:
        """Say what the time derivative of a vector of symbols is, e.g. (2.36) for the bases."""
        for component, rate in zip(vector, rates, strict=True):
            if component.is_Symbol:
                self.rates[component] = rate
            elif (-component).is_Symbol:
                self.rates[-component] = -rate

    def write(
        self,
        block: Block,
        values: Mapping[str, sp.Expr | Vector],
        tangents: bool | Iterable[str] = True,
        columns: str = "MSFP_DOF",
        alias: str = "out",
    ) -> None:
        """Declare the output block; a component that the block holds constant must come out so."""
        for quantity, parts in block.quantities.items():
            value = values[quantity]
            components = value if isinstance(value, tuple) else (value,)
            for part, component in zip(parts, components, strict=True):
                if isinstance(part, str):
                    self.results[part] = self.let(component, "out")
                elif sp.sympify(component) != part:
                    raise AssertionError(f"{self.name}: {quantity} should be {part}, is {component}")
        unknown = set(values) - set(block.quantities)
        if unknown:
            raise AssertionError(f"{self.name}: {sorted(unknown)} are not in block {block.name}")
        self.output = Use(block, alias, frozenset())
        names = [f.name for f in block.fields]
        self.tangents = frozenset(
            names if tangents is True else [] if tangents is False else fields_of(block, tangents)
        )
        self.columns = columns if self.tangents else ""


def fields_of(block: Block, quantities: Iterable[str]) -> list[str]:
    """Stored field names of some quantities of a block."""
    return [part for quantity in quantities for part in block.quantities[quantity] if isinstance(part, str)]
