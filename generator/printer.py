"""C text of small expressions."""

from __future__ import annotations

from functools import cache

import sympy as sp
from sympy.printing.c import C99CodePrinter

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


_PRINTER = Printer()


@cache
def to_c(expression: sp.Expr) -> str:
    """C text of one expression. Kept, since models share most of their statements."""
    return str(_PRINTER.doprint(expression))
