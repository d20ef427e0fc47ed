"""Functions that SymPy lacks or differentiates to distributions, and C text of expressions."""

from __future__ import annotations

from functools import cache
from typing import Any

import sympy as sp
from sympy.printing.c import C99CodePrinter


class Step(sp.Function):  # type: ignore[misc]
    """Heaviside function, 1 for a positive argument and 0 otherwise: the switches a, b of (3.18). Derivative: 0."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Zero on both sides of the discontinuity."""
        return sp.Integer(0)


class Select(sp.Function):  # type: ignore[misc]
    """The second of three arguments where the first is positive, else the third; so is the derivative."""

    nargs = 3

    def fdiff(self, argindex: int = 2) -> sp.Expr:
        """0 for the condition; 1 for the chosen argument and 0 for the other."""
        chosen = Step(self.args[0])
        return (sp.Integer(0), chosen, 1 - chosen)[argindex - 1]


class Decay(sp.Function):  # type: ignore[misc]
    """exp(-x), and 1 where x is not positive; there the exponential is not evaluated."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """-exp(-x) or 0."""
        return -Step(self.args[0]) * Decay(self.args[0])


class Clamp(sp.Function):  # type: ignore[misc]
    """The argument bounded to -1 .. 1, with the derivative 1 inside and 0 on the bounds."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """1 or 0."""
        return Step(1 - Modulus(self.args[0]))


class ArcTan2(sp.Function):  # type: ignore[misc]
    """atan2 of a sine and a cosine, with the derivative that holds off the branch cut."""

    nargs = 2

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """x/(x^2 + y^2) and -y/(x^2 + y^2)."""
        y, x = self.args
        return (x if argindex == 1 else -y) / (x**2 + y**2)


class Stumpff(sp.Function):  # type: ignore[misc]
    """Stumpff function c_n(s), the sum over k of (-s)^k/(2k + n)!; c_1(x^2) = sin(x)/x."""

    nargs = 2

    def fdiff(self, argindex: int = 2) -> sp.Expr:
        """(n c_(n+2) - c_(n+1))/2."""
        n, s = self.args
        return (n * Stumpff(n + 2, s) - Stumpff(n + 1, s)) / 2


class Modulus(sp.Function):  # type: ignore[misc]
    """|x|, with the derivative +1 for positive x and -1 otherwise."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """+1 or -1."""
        return 2 * Step(self.args[0]) - 1


class Length(sp.Function):  # type: ignore[misc]
    """sqrt(x^2 + y^2). At zero, where it has a kink, its derivative counts as zero."""

    nargs = 2

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """X or y over the length, or 0."""
        return self.args[argindex - 1] * Select(self, 1 / self, 0)


class Hypot(Length):
    """The same length, printed as `msfp_hypot`, which does not overflow and rounds differently."""


# Functions of `runtime/msfp_math.h`, which give the same numbers on every system.
FUNCTIONS = {name: f"msfp_{name}" for name in ("sin", "cos", "asin", "exp", "log", "tanh")}


class Printer(C99CodePrinter):  # type: ignore[misc]
    """Printer of C99 that writes small powers as products and calls functions of the runtime."""

    def __init__(self) -> None:
        super().__init__({"user_functions": FUNCTIONS})

    def _print_Pow(self, expr: sp.Pow) -> str:
        base, exponent = expr.as_base_exp()
        if exponent.is_Integer and 2 <= abs(exponent) <= 4:
            text = self.parenthesize(base, sp.printing.precedence.PRECEDENCE["Mul"] + 1)
            product = "*".join([text] * abs(int(exponent)))
            return f"({product})" if exponent > 0 else f"(1.0/({product}))"
        halves = 2 * float(exponent) if exponent.is_Number else 0.0
        if abs(halves) in (1.0, 3.0):
            root = f"sqrt({self._print(base)})"
            text = self.parenthesize(base, sp.printing.precedence.PRECEDENCE["Mul"] + 1)
            product = root if abs(halves) == 1.0 else f"({text}*{root})"
            return product if halves > 0 else f"(1.0/{product})"
        if exponent == -1:
            return str(super()._print_Pow(expr))
        return f"msfp_pow({self._print(base)}, {self._print(exponent)})"

    def _print_atan(self, expr: sp.Function) -> str:
        return f"msfp_atan2({self._print(expr.args[0])}, 1.0)"

    def _print_Step(self, expr: sp.Function) -> str:
        return f"msfp_heaviside({self._print(expr.args[0])})"

    def _print_Select(self, expr: sp.Function) -> str:
        condition, chosen, other = (self._print(argument) for argument in expr.args)
        return f"({condition} > 0.0 ? {chosen} : {other})"

    def _print_Decay(self, expr: sp.Function) -> str:
        argument = self._print(expr.args[0])
        return f"({argument} > 0.0 ? msfp_exp(-({argument})) : 1.0)"

    def _print_Clamp(self, expr: sp.Function) -> str:
        return f"fmax(-1.0, fmin(1.0, {self._print(expr.args[0])}))"

    def _print_ArcTan2(self, expr: sp.Function) -> str:
        return f"msfp_angle({self._print(expr.args[0])}, {self._print(expr.args[1])})"

    def _print_Stumpff(self, expr: sp.Function) -> str:
        return f"msfp_stumpff({expr.args[0]}, {self._print(expr.args[1])})"

    def _print_Modulus(self, expr: sp.Function) -> str:
        return f"fabs({self._print(expr.args[0])})"

    def _print_Length(self, expr: sp.Function) -> str:
        x, y = expr.args
        return f"fabs({self._print(x)})" if y == 0 else str(self._print(sp.sqrt(x**2 + y**2)))

    def _print_Hypot(self, expr: sp.Function) -> str:
        return f"msfp_hypot({', '.join(map(self._print, expr.args))})"


_PRINTER = Printer()


@cache
def to_c(expression: sp.Expr) -> str:
    """C text of one expression, cached, since models share most of their statements."""
    return str(_PRINTER.doprint(expression))


def to_python(expression: sp.Expr) -> str:
    """Python text of one small expression, in which functions are those of `in_numpy`."""
    if expression.is_Symbol:
        return str(expression.name)
    if expression.is_Integer:
        return f"({expression})" if expression < 0 else str(expression)
    if expression.is_Number:
        return f"({float(expression)!r})"
    if expression.is_Add or expression.is_Mul:
        return f"({(' + ' if expression.is_Add else '*').join(map(to_python, expression.args))})"
    if expression.is_Pow:
        base, exponent = map(to_python, expression.args)
        special = {-1: f"(1.0/{base})", sp.Rational(1, 2): f"sqrt({base})", sp.Rational(-1, 2): f"(1.0/sqrt({base}))"}
        return special.get(expression.exp, f"{base}**{exponent}")
    return f"{expression.func.__name__}({', '.join(map(to_python, expression.args))})"


def in_numpy() -> dict[str, Any]:
    """The functions of `to_python`, in NumPy."""
    import numpy as np

    names = ("sin", "cos", "sqrt", "exp", "log", "tanh", "atan2")
    return {name: getattr(np, name.replace("atan2", "arctan2")) for name in names} | {
        "Step": lambda x: np.where(x > 0, 1.0, 0.0),
        "Select": lambda condition, chosen, other: np.where(condition > 0, chosen, other),
        "Decay": lambda x: np.exp(-np.maximum(x, 0.0)),
        "Clamp": lambda x: np.clip(x, -1.0, 1.0),
        "ArcTan2": np.arctan2,
        "Modulus": np.abs,
        **dict.fromkeys(("Length", "Hypot"), np.hypot),
    }
