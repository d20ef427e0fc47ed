"""C text of small expressions."""

from __future__ import annotations

import sympy as sp
from sympy.printing.c import C99CodePrinter


class Printer(C99CodePrinter):  # type: ignore[misc]
    """Printer of C99 that writes small powers as products and calls functions of the runtime for the project's own."""

    def _print_Pow(self, expr: sp.Pow) -> str:
        base, exponent = expr.as_base_exp()
        if exponent.is_Integer and 2 <= abs(exponent) <= 4:
            text = self.parenthesize(base, sp.printing.precedence.PRECEDENCE["Mul"] + 1)
            product = "*".join([text] * abs(int(exponent)))
            return f"({product})" if exponent > 0 else f"(1.0/({product}))"
        return str(super()._print_Pow(expr))

    def _print_Step(self, expr: sp.Function) -> str:
        return f"msfp_heaviside({self._print(expr.args[0])})"

    def _print_ArcTan2(self, expr: sp.Function) -> str:
        return f"msfp_angle({self._print(expr.args[0])}, {self._print(expr.args[1])})"

    def _print_Modulus(self, expr: sp.Function) -> str:
        return f"fabs({self._print(expr.args[0])})"


_PRINTER = Printer()


def to_c(expression: sp.Expr) -> str:
    """C text of one expression."""
    return str(_PRINTER.doprint(expression))
