"""Sine, cosine and exponential that are the same on every processor, for what a run is computed from.

NumPy and C libraries hold several versions of such functions, which differ in the last digit, and the processor
selects one. These consist of additions, products and quotients of arrays, which every processor rounds alike: the
formulas and polynomials of `msfp_math.h`, whose numbers they give bit by bit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array

# tools/polynomials.py derives these coefficients, the constant first.
SIN_REST = (
    -0.16666666666666666,
    0.008333333333333331,
    -0.00019841269841265065,
    2.7557319219339167e-06,
    -2.5052106232447578e-08,
    1.6058531618986147e-10,
    -7.586697117706918e-13,
)
COS_REST = (
    0.041666666666666664,
    -0.0013888888888887398,
    2.480158729876569e-05,
    -2.7557317271729793e-07,
    2.08761462684032e-09,
    -1.1382632425521717e-11,
)
EXP_REST = (
    0.5,
    0.1666666666666667,
    0.04166666666666667,
    0.008333333333326141,
    0.0013888888888883752,
    0.00019841269874800493,
    2.4801587325533363e-05,
    2.7557255425746435e-06,
    2.7557273661348637e-07,
    2.510520637395701e-08,
    2.0914679376583935e-09,
)
LARGEST_ANGLE = 1e5  # beyond it the reduction to a quarter turn loses digits [rad]


def sin(x: ArrayLike) -> Array:
    """Sine of angles [rad], of the shape of `x`."""
    return _shifted(x, 0.0)


def cos(x: ArrayLike) -> Array:
    """Cosine of angles [rad], of the shape of `x`."""
    return _shifted(x, 1.0)


def exp(x: ArrayLike) -> Array:
    """Exponential, of the shape of `x`, [-]; 0 below -708, the least number that is not subnormal."""
    values = np.asarray(x, dtype=float)
    n = np.rint(np.clip(values, -2000.0, 2000.0) * 1.4426950408889634)
    r = (values - n * 0.6931471803691238) - n * 1.9082149292705877e-10
    result: Array = np.where(
        values < -708.0, 0.0, np.ldexp(1.0 + (r + r * r * _polynomial(EXP_REST, r)), n.astype(int))
    )
    return result[()]


def _shifted(x: ArrayLike, quarters: float) -> Array:
    """sin(x + quarters pi/2). Beyond `LARGEST_ANGLE` by the function of NumPy."""
    angle = np.asarray(x, dtype=float)
    n = np.rint(angle * 0.6366197723675814)
    rest = ((angle - n * 1.5707963267341256) - n * 6.077100506303966e-11) - n * 2.0222662487959506e-21
    z, fold = rest * rest, np.mod(n + quarters, 4.0)
    half = 0.5 * z
    left = 1.0 - half
    sine = rest + rest * (z * _polynomial(SIN_REST, z))
    cosine = left + (((1.0 - left) - half) + z * z * _polynomial(COS_REST, z))
    value = np.where(fold % 2.0 == 1.0, cosine, sine)
    value = np.where(fold >= 2.0, -value, value)
    result: Array = np.where(np.abs(angle) < LARGEST_ANGLE, value, np.cos(angle) if quarters else np.sin(angle))
    return result[()]


def _polynomial(coefficients: tuple[float, ...], z: Array) -> Array:
    """Even and odd powers apart, as in C."""
    w = z * z
    even, odd = (_horner(coefficients[start::2], w) for start in (0, 1))
    return even + z * odd


def _horner(coefficients: tuple[float, ...], w: Array) -> Array:
    value = np.full_like(w, coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        value = coefficient + w * value
    return value
