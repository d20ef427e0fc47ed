"""Functions that SymPy lacks or differentiates to distributions; `printer.py` and `latex.py` print them."""

from __future__ import annotations

import sympy as sp


class Step(sp.Function):  # type: ignore[misc]
    """Heaviside function, 1 for a positive argument and 0 otherwise: the switches a, b of (3.18). Derivative: 0."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Zero on both sides of the discontinuity."""
        return sp.Integer(0)


class Select(sp.Function):  # type: ignore[misc]
    """Of three arguments the second where the first is positive, else the third, to which the derivative belongs."""

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
