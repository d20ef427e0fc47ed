"""A formula given as text: read against a whitelist, never run; then folded over numbers, symbols or units.

The text becomes a syntax tree of which every node must be known here. What the nodes mean is left to a table of
operations, so that one walk serves numpy arrays (checks), SymPy (the generator) and units (`units_of`).
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

Operations = Mapping[str, Callable[..., Any]]

LONGEST = 500  # characters: a formula for people
FUNCTIONS = {"exp": 1, "log": 1, "sqrt": 1, "tanh": 1, "Abs": 1, "Min": 2, "Max": 2}
_BINARY: dict[type, str] = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div", ast.Pow: "pow"}

NUMBERS: Operations = {
    "number": float, "neg": operator.neg, "add": operator.add, "sub": operator.sub, "mul": operator.mul,
    "div": operator.truediv, "pow": math.pow, "exp": math.exp, "log": math.log, "sqrt": math.sqrt, "tanh": math.tanh,
    "Abs": abs, "Min": min, "Max": max,
}  # fmt: skip


def parse(text: str, known: Iterable[str]) -> ast.expr:
    """The tree of a formula over the names `known`; raises ValueError that says what in it is not understood."""
    if len(text) > LONGEST:
        raise ValueError(f"a formula has at most {LONGEST} characters")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(
            "this is no formula; write one such as mu * (1 - c1 * exp(-c2 * v)), with ** for powers"
        ) from None
    _check(tree, frozenset(known))
    _check_constants(tree)
    return tree


def names_in(tree: ast.expr) -> frozenset[str]:
    """Names of quantities in a formula."""
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    return frozenset(n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and id(n) not in called)


def fold(tree: ast.expr, names: Mapping[str, Any], do: Operations) -> Any:
    """The value of a formula: `names` for its quantities, `do` for numbers, signs, operators and functions."""
    if isinstance(tree, ast.Constant):
        return do["number"](tree.value)
    if isinstance(tree, ast.Name):
        return names[tree.id]
    if isinstance(tree, ast.BinOp):
        word = _BINARY[type(tree.op)]
        if word == "pow" and names_in(tree.right):
            word = "power"  # of a value: exp(exponent log(base)); that of a number also takes a base below zero
        return do[word](fold(tree.left, names, do), fold(tree.right, names, do))
    if isinstance(tree, ast.UnaryOp):
        value = fold(tree.operand, names, do)
        return do["neg"](value) if isinstance(tree.op, ast.USub) else value
    assert isinstance(tree, ast.Call) and isinstance(tree.func, ast.Name)
    return do[tree.func.id](*(fold(argument, names, do) for argument in tree.args))


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
    """No part without names may overflow, such as 10 ** 10 ** 10 or 1 / 0."""
    for part in ast.walk(tree):
        if isinstance(part, ast.expr) and not isinstance(part, ast.Name) and not names_in(part):
            try:
                value = fold(part, {}, NUMBERS)
            except (ArithmeticError, ValueError):
                value = math.nan
            if not abs(value) <= 1e30:
                raise ValueError(f"{ast.unparse(part)!r} is no number that can be used")


# ---- units ----------------------------------------------------------------------------------------------------------

BASE = ("m", "s", "kg", "K")
UNITS = {"mu": (0, 0, 0, 0), "v": (1, -1, 0, 0), "p": (-1, -2, 1, 0), "T": (0, 0, 0, 1), "N": (1, -2, 1, 0)}


@dataclass(frozen=True)
class Unit:
    """Exponents of the base units: fixed ones, and multiples of the unknown units of some parameters."""

    fixed: tuple[Fraction, ...] = (Fraction(0),) * 4
    unknown: Mapping[str, Fraction] = field(default_factory=dict)

    def plus(self, other: Unit, times: Fraction = Fraction(1)) -> Unit:
        """The unit of a product with `other ** times`."""
        fixed = tuple(a + times * b for a, b in zip(self.fixed, other.fixed, strict=True))
        both = {**self.unknown, **{name: Fraction(0) for name in other.unknown if name not in self.unknown}}
        unknown = {name: value + times * other.unknown.get(name, Fraction(0)) for name, value in both.items()}
        return Unit(fixed, {name: value for name, value in unknown.items() if value})

    def __str__(self) -> str:
        parts = [*zip(BASE, self.fixed, strict=True), *self.unknown.items()]
        return " ".join(name if power == 1 else f"{name}^{power}" for name, power in parts if power) or "-"


class _Solver:
    """Collects what the sums and functions of a formula demand of the units of its parameters."""

    def __init__(self) -> None:
        self.found: dict[str, Unit] = {}

    def known(self, unit: Unit) -> Unit:
        """The unit with what was found put in."""
        for name, power in unit.unknown.items():
            if name in self.found:
                rest = Unit(unit.fixed, {k: p for k, p in unit.unknown.items() if k != name})
                return self.known(rest.plus(self.found[name], power))
        return unit

    def same(self, a: Unit, b: Unit, what: str) -> Unit:
        """Demand that two units agree; raises ValueError where they cannot."""
        rest = self.known(a.plus(b, Fraction(-1)))
        if rest.unknown:
            name, power = next(iter(rest.unknown.items()))
            others = Unit(rest.fixed, {k: p for k, p in rest.unknown.items() if k != name})
            self.found[name] = Unit().plus(others, -1 / power)
        elif any(rest.fixed):
            raise ValueError(f"{what}: [{self.known(a)}] against [{self.known(b)}]; constants with a unit are c1 to c4")
        return a

    def pure(self, a: Unit, what: str) -> Unit:
        """Demand a pure number."""
        self.same(a, Unit(), what)
        return Unit()


def units_of(tree: ast.expr, parameters: Iterable[str]) -> dict[str, str]:
    """Units that a formula for a pure number demands of its parameters; raises ValueError where none fit."""
    solver = _Solver()
    names = {name: Unit(tuple(map(Fraction, powers))) for name, powers in UNITS.items()}
    names |= {name: Unit(unknown={name: Fraction(1)}) for name in parameters}
    solver.pure(_unit(tree, names, solver), "a friction coefficient has no unit, the formula has one")
    return {name: str(solver.known(names[name])) for name in sorted(names_in(tree) & set(parameters))}


def _unit(tree: ast.expr, names: Mapping[str, Unit], solver: _Solver) -> Unit:
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
            power = Fraction(float(fold(tree.right, {}, NUMBERS))).limit_denominator(1000)
            return Unit().plus(left, power)
        right = _unit(tree.right, names, solver)
        if isinstance(tree.op, ast.Pow):
            solver.pure(right, f"the exponent in {text!r}")
            return solver.pure(left, f"the base of {text!r}")
        if isinstance(tree.op, ast.Mult | ast.Div):
            return left.plus(right, Fraction(1 if isinstance(tree.op, ast.Mult) else -1))
        return solver.same(left, right, repr(text))
    assert isinstance(tree, ast.Call) and isinstance(tree.func, ast.Name)
    arguments = [_unit(argument, names, solver) for argument in tree.args]
    if tree.func.id in ("Min", "Max"):
        return solver.same(arguments[0], arguments[1], repr(text))
    if tree.func.id in ("sqrt", "Abs"):
        return Unit().plus(arguments[0], Fraction(1, 2) if tree.func.id == "sqrt" else Fraction(1))
    return solver.pure(arguments[0], f"the argument of {text!r}")
