"""Polynomials of msfp_gen/runtime/msfp_math.h: `python tools/polynomials.py` prints them as C.

A function is a few exact terms and the rest, z^k P(z). P interpolates the rest at the Chebyshev nodes of an interval,
in 60 digits, and has the least degree at which the relative error of the function is below 1e-17.
"""

from __future__ import annotations

import sys
from itertools import count
from pathlib import Path

import mpmath as mp

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))
from quick import parser, pick

mp.mp.dps = 60
BOUND, SAMPLES = mp.mpf("1e-17"), 60
TILT, LOG, ROOT = (mp.pi / 4) ** 2, mp.log(2) / 2, (mp.sqrt(2) - 1) / (mp.sqrt(2) + 1)


def coefficients(kind: str) -> list[mp.mpf]:
    """Taylor coefficients in z: of sin(x)/x, cos(x), asin(x)/x and atanh(x)/x with z = x^2, of exp(z)."""
    terms = range(120)
    return {
        "sin": [mp.mpf(-1) ** k / mp.factorial(2 * k + 1) for k in terms],
        "cos": [mp.mpf(-1) ** k / mp.factorial(2 * k) for k in terms],
        "asin": [mp.binomial(2 * k, k) / mp.mpf(4) ** k / (2 * k + 1) for k in terms],
        "exp": [1 / mp.factorial(k) for k in terms],
        "log": [mp.mpf(1) / (2 * k + 1) for k in terms],
    }[kind]


# Function -> (interval of z, number of exact terms).
RANGES = {
    "sin": (0, TILT, 1), "cos": (0, TILT, 2), "asin": (0, mp.mpf(1) / 4, 1), "exp": (-LOG, LOG, 2),
    "log": (0, ROOT**2, 1),
}  # fmt: skip


def polynomial(kind: str) -> list[float]:
    """Coefficients of P, the constant first."""
    low, high, exact = RANGES[kind]
    series = coefficients(kind)
    samples = [low + (high - low) * mp.mpf(i) / SAMPLES for i in range(SAMPLES + 1)]
    for degree in count(3):
        nodes = [
            (low + high + (high - low) * mp.cospi(mp.mpf(2 * k + 1) / (2 * degree + 2))) / 2 for k in range(degree + 1)
        ]
        matrix = mp.matrix([[z**j for j in range(degree + 1)] for z in nodes])
        found = [
            float(c) for c in mp.lu_solve(matrix, mp.matrix([mp.polyval(series[: exact - 1 : -1], z) for z in nodes]))
        ]
        errors = (
            z**exact
            * (mp.polyval(found[::-1], z) - mp.polyval(series[: exact - 1 : -1], z))
            / mp.polyval(series[::-1], z)
            for z in samples
        )
        if max(map(abs, errors)) < BOUND:
            return found
    raise AssertionError


def as_c(values: list[float]) -> str:
    """P with z and w = z^2: even and odd powers apart, which a processor computes side by side."""
    return f"{_horner(values[::2])} + z * ({_horner(values[1::2])})"


def _horner(values: list[float]) -> str:
    first, *rest = values
    return f"{first!r} + w * ({_horner(rest)})" if rest else repr(first)


if __name__ == "__main__":
    parser(__doc__).parse_args()
    for kind in pick(list(RANGES), ["sin"]):
        print(f"{kind}: {as_c(polynomial(kind))}")
