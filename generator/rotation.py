"""The rotation of an end of a two-port: angles of its rotation vector.

The rotation matrix is cos(x) I + c_1 [r]x + c_2 r r^T with x = |r| and the Stumpff functions c_1 = sin(x)/x and
c_2 = (1 - cos x)/x^2 of x^2, which are regular at x = 0 (docs/embedding.md, the two-port).
"""

from __future__ import annotations

from typing import Any

import sympy as sp

from .blocks import Blocks
from .functions import ArcTan2, Stumpff
from .program import Program
from .vectors import dot

Symbols = dict[str, Any]


def _angle(p: Program, sine: sp.Expr, cosine: sp.Expr) -> sp.Expr:
    """The angle of a sine and cosine whose squares add up to 1, from which its rate follows."""
    angle = p.let(ArcTan2(sine, cosine))
    p.rates[angle] = p.let(cosine * p.rate(sine) - sine * p.rate(cosine))
    return angle


def _angles(p: Program, t: Symbols) -> dict[str, sp.Expr]:
    """psi, theta, phi (2.1) of the rotation vector, with the rates of their statements declared."""
    p.declare_rates(t["r"], t["r1"])
    p.declare_rates(t["r1"], t["r2"])
    x, y, z = t["r"]
    square = p.let(dot(t["r"], t["r"]))
    sine, versine = p.let(Stumpff(1, square)), p.let(Stumpff(2, square))
    cosine = p.let(1 - versine * square)
    first, across = p.let(cosine + versine * x**2), p.let(sine * z - versine * x * y)
    upright, aside = p.let(cosine + versine * z**2), p.let(sine * x - versine * y * z)
    cos_square = p.let(first**2 + across**2)
    cos_theta = p.let(sp.sqrt(cos_square))
    p.rates[cos_theta] = p.let(p.rate(cos_square) / (2 * cos_theta))
    return {
        "psi": _angle(p, p.let(aside / cos_theta), p.let(upright / cos_theta)),
        "theta": _angle(p, p.let(versine * x * z + sine * y), cos_theta),
        "phi": _angle(p, p.let(across / cos_theta), p.let(first / cos_theta)),
    }


def rotation_angles(b: Blocks) -> Program:
    """psi, theta, phi (2.1) of a rotation vector, with two derivatives in time."""
    p = Program("rotation_angles", "angles psi, theta, phi (2.1) of a rotation vector, with two derivatives in time")
    angles = _angles(p, p.read(b.turn, "t", active=False))
    rates = {f"{name}1": p.rate(angle) for name, angle in angles.items()}
    second = {f"{name[:-1]}2": p.rate(rate) for name, rate in rates.items()}
    p.write(b.rotation_angles, {**angles, **rates, **second}, tangents=False)
    return p
