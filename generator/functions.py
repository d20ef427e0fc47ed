"""Functions that SymPy lacks or differentiates otherwise than is wanted; `printer.py` and `latex.py` know them."""

from __future__ import annotations

import sympy as sp


class Step(sp.Function):  # type: ignore[misc]
    """1 for a positive argument, else 0: the switches a, b of (3.18). Its derivative is zero on both sides."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Zero on both sides of the switch."""
        return sp.Integer(0)


class ArcTan2(sp.Function):  # type: ignore[misc]
    """atan2 of a sine and a cosine, with its derivative off the branch cut (SymPy's own adds a distribution on it)."""

    nargs = 2

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """x/(x^2 + y^2) and -y/(x^2 + y^2)."""
        y, x = self.args
        return (x if argindex == 1 else -y) / (x**2 + y**2)


class Modulus(sp.Function):  # type: ignore[misc]
    """|x|, with the derivative +-1 that it has on either side."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """+1 or -1."""
        return 2 * Step(self.args[0]) - 1
