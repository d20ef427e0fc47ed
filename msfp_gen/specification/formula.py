"""Formulas given as text: parsed against a whitelist, never executed, and evaluated on numbers or symbols.

The text is parsed to a syntax tree in which only the nodes listed here are permitted. `fold` evaluates the tree with a
table of operations, so that one function serves numpy arrays (checks of a law) and SymPy (the generator). `units_of`
checks the units.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from typing import Any

Operations = Mapping[str, Callable[..., Any]]

MAX_LENGTH = 500  # characters; a longer formula would not be readable
MAX_DEPTH = 100  # operations inside each other: a tree is walked by recursion
FUNCTIONS = {"exp": 1, "log": 1, "sqrt": 1, "tanh": 1, "Abs": 1, "Min": 2, "Max": 2}
_BINARY: dict[type, str] = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div", ast.Pow: "pow"}

FLOAT_OPERATIONS: Operations = {
    "number": float,
    "neg": operator.neg,
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
    "pow": math.pow,
    "exp": math.exp,
    "log": math.log,
    "sqrt": math.sqrt,
    "tanh": math.tanh,
    "Abs": abs,
    "Min": min,
    "Max": max,
}


def parse(text: str, known: Iterable[str]) -> ast.expr:
    """Syntax tree of a formula.

    Args:
        text: the formula.
        known: names of quantities that it may contain.

    Raises:
        ValueError: the formula is too long or too deep, has a syntax error, or contains a name, an operation or a
            constant that is not permitted.
    """
    if len(text) > MAX_LENGTH:
        raise ValueError(f"a formula has at most {MAX_LENGTH} characters")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(
            "this is no formula; write one such as mu * (1 - c1 * exp(-c2 * v)), with ** for powers"
        ) from None
    if _depth(tree) > MAX_DEPTH:
        raise ValueError(f"a formula has at most {MAX_DEPTH} operations inside each other; write it in fewer")
    _check(tree, frozenset(known))
    _check_constants(tree)
    return tree


def _depth(tree: ast.expr) -> int:
    """Levels of the expressions in a tree, counted without recursion."""
    depth, level = 0, [tree]
    while level:
        depth += 1
        level = [part for node in level for part in ast.iter_child_nodes(node) if isinstance(part, ast.expr)]
    return depth


@lru_cache(maxsize=4096)
def names_in(tree: ast.expr) -> frozenset[str]:
    """Names of quantities in a formula, without the names of functions."""
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    return frozenset(n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and id(n) not in called)


def fold(tree: ast.expr, names: Mapping[str, Any], operations: Operations) -> Any:
    """Value of a formula, evaluated from the leaves of its tree.

    Args:
        tree: from `parse`.
        names: value of each quantity.
        operations: function for each of "number", "neg", "add", "sub", "mul", "div", "pow" (constant exponent),
            "power" (variable exponent) and each name of `FUNCTIONS`.
    """
    if isinstance(tree, ast.Constant):
        return operations["number"](tree.value)
    if isinstance(tree, ast.Name):
        return names[tree.id]
    if isinstance(tree, ast.BinOp):
        word = _BINARY[type(tree.op)]
        if word == "pow" and names_in(tree.right):
            # A variable exponent is evaluated as exp(exponent log(base)); a constant one permits a negative base.
            word = "power"
        return operations[word](fold(tree.left, names, operations), fold(tree.right, names, operations))
    if isinstance(tree, ast.UnaryOp):
        value = fold(tree.operand, names, operations)
        return operations["neg"](value) if isinstance(tree.op, ast.USub) else value
    assert isinstance(tree, ast.Call) and isinstance(tree.func, ast.Name)
    return operations[tree.func.id](*(fold(argument, names, operations) for argument in tree.args))


def _check(tree: ast.expr, known: frozenset[str]) -> None:
    if isinstance(tree, ast.Constant) and type(tree.value) in (int, float):
        return
    if isinstance(tree, ast.Name):
        if tree.id not in known:
            raise ValueError(f"{tree.id!r} is no name of a law; the names are {', '.join(sorted(known))}")
    elif isinstance(tree, ast.BinOp) and type(tree.op) in _BINARY:
        _check(tree.left, known)
        _check(tree.right, known)
    elif isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.USub | ast.UAdd):
        _check(tree.operand, known)
    elif isinstance(tree, ast.Call) and isinstance(tree.func, ast.Name):
        _check_call(tree, tree.func.id, known)
    else:
        raise ValueError(f"{ast.unparse(tree)!r} is not allowed; use names, numbers, + - * / ** and {_functions()}")


def _check_call(tree: ast.Call, name: str, known: frozenset[str]) -> None:
    if name not in FUNCTIONS:
        raise ValueError(f"{name!r} is no function of a law; the functions are {_functions()}")
    if tree.keywords or len(tree.args) != FUNCTIONS[name]:
        raise ValueError(f"{ast.unparse(tree)!r}: {name} takes {FUNCTIONS[name]} argument(s)")
    for argument in tree.args:
        _check(argument, known)


def _functions() -> str:
    return ", ".join(FUNCTIONS)


def _check_constants(tree: ast.expr) -> None:
    """Raise ValueError if a constant part of the formula overflows or is undefined, such as 10 ** 10 ** 10 or 1 / 0."""
    for part in ast.walk(tree):
        if isinstance(part, ast.expr) and not isinstance(part, ast.Name) and not names_in(part):
            try:
                value = fold(part, {}, FLOAT_OPERATIONS)
            except (ArithmeticError, ValueError):
                value = math.nan
            if not abs(value) <= 1e30:
                raise ValueError(f"{ast.unparse(part)!r} is no number that can be used")


# ---- units ----------------------------------------------------------------------------------------------------------

BASE = ("m", "s", "kg", "K")
UNITS = {"mu": (0, 0, 0, 0), "v": (1, -1, 0, 0), "p": (-1, -2, 1, 0), "N": (1, -2, 1, 0)}


@dataclass(frozen=True)
class Unit:
    """A unit as exponents: of the base units, and of the units of parameters that are still unknown.

    Attributes:
        fixed: exponents of the units of `BASE`.
        unknown: parameter name -> exponent of its unit.
    """

    fixed: tuple[Fraction, ...] = (Fraction(0),) * 4
    unknown: Mapping[str, Fraction] = field(default_factory=dict)

    def times(self, other: Unit, power: Fraction = Fraction(1)) -> Unit:
        """Unit of the product of a quantity of this unit and one of unit `other` to the given power."""
        fixed = tuple(a + power * b for a, b in zip(self.fixed, other.fixed, strict=True))
        both = {**self.unknown, **{name: Fraction(0) for name in other.unknown if name not in self.unknown}}
        unknown = {name: value + power * other.unknown.get(name, Fraction(0)) for name, value in both.items()}
        return Unit(fixed, {name: value for name, value in unknown.items() if value})

    def __str__(self) -> str:
        parts = [*zip(BASE, self.fixed, strict=True), *self.unknown.items()]
        return " ".join(name if power == 1 else f"{name}^{power}" for name, power in parts if power) or "-"


class _UnitSolver:
    """Solves the conditions that sums and functions of a formula impose on the units of its parameters."""

    def __init__(self) -> None:
        self.solved: dict[str, Unit] = {}

    def substituted(self, unit: Unit) -> Unit:
        """`unit` with the solved units of parameters inserted."""
        for name, power in unit.unknown.items():
            if name in self.solved:
                rest = Unit(unit.fixed, {k: p for k, p in unit.unknown.items() if k != name})
                return self.substituted(rest.times(self.solved[name], power))
        return unit

    def require_equal(self, a: Unit, b: Unit, place: str) -> Unit:
        """Impose that two units are equal and return the first. Raises ValueError that begins with `place`."""
        rest = self.substituted(a.times(b, Fraction(-1)))
        if rest.unknown:
            name, power = next(iter(rest.unknown.items()))
            others = Unit(rest.fixed, {k: p for k, p in rest.unknown.items() if k != name})
            self.solved[name] = Unit().times(others, -1 / power)
        elif any(rest.fixed):
            units = f"[{self.substituted(a)}] against [{self.substituted(b)}]"
            raise ValueError(f"{place}: {units}; constants with a unit are c1 to c4")
        return a

    def require_dimensionless(self, a: Unit, place: str) -> Unit:
        """Impose that a unit is the unit of a plain number. Raises ValueError that begins with `place`."""
        self.require_equal(a, Unit(), place)
        return Unit()


def units_of(
    tree: ast.expr, parameters: Iterable[str], others: Mapping[str, tuple[int, int, int, int]]
) -> dict[str, str]:
    """Units that the parameters of a formula for a dimensionless result must have.

    Args:
        tree: from `parse`.
        parameters: names whose units are unknown.
        others: exponents of the units of names beside the names in `UNITS`.

    Returns:
        Parameter name -> unit as text, for the parameters in the formula.

    Raises:
        ValueError: no units of the parameters make the formula consistent.
    """
    solver = _UnitSolver()
    names = {name: Unit(tuple(map(Fraction, powers))) for name, powers in {**UNITS, **others}.items()}
    names |= {name: Unit(unknown={name: Fraction(1)}) for name in parameters}
    solver.require_dimensionless(_unit(tree, names, solver), "a friction coefficient has no unit, the formula has one")
    return {name: str(solver.substituted(names[name])) for name in sorted(names_in(tree) & set(parameters))}


def _unit(tree: ast.expr, names: Mapping[str, Unit], solver: _UnitSolver) -> Unit:
    """Unit of a part of a formula; imposes the conditions of its sums and functions on `solver`."""
    if isinstance(tree, ast.Constant):
        return Unit()
    if isinstance(tree, ast.Name):
        return names[tree.id]
    if isinstance(tree, ast.UnaryOp):
        return _unit(tree.operand, names, solver)
    text = ast.unparse(tree)
    if isinstance(tree, ast.BinOp):
        left = _unit(tree.left, names, solver)
        if isinstance(tree.op, ast.Pow) and not names_in(tree.right):
            power = Fraction(float(fold(tree.right, {}, FLOAT_OPERATIONS))).limit_denominator(1000)
            return Unit().times(left, power)
        right = _unit(tree.right, names, solver)
        if isinstance(tree.op, ast.Pow):
            solver.require_dimensionless(right, f"the exponent in {text!r}")
            return solver.require_dimensionless(left, f"the base of {text!r}")
        if isinstance(tree.op, ast.Mult | ast.Div):
            return left.times(right, Fraction(1 if isinstance(tree.op, ast.Mult) else -1))
        return solver.require_equal(left, right, repr(text))
    assert isinstance(tree, ast.Call) and isinstance(tree.func, ast.Name)
    arguments = [_unit(argument, names, solver) for argument in tree.args]
    if tree.func.id in ("Min", "Max"):
        return solver.require_equal(arguments[0], arguments[1], repr(text))
    if tree.func.id in ("sqrt", "Abs"):
        return Unit().times(arguments[0], Fraction(1, 2) if tree.func.id == "sqrt" else Fraction(1))
    return solver.require_dimensionless(arguments[0], f"the argument of {text!r}")
