"""Piecewise polynomials of degree five and less: evaluate, interpolate, shift, and measure their smoothness.

Everywhere `knots` is ndarray, shape (k+1,), [s], rising, and `coefficients` is ndarray, shape (k, channels, 6): piece,
channel, ascending power of (t - knots[piece]).
"""

from __future__ import annotations

from collections.abc import Mapping
from math import factorial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Metadata = Mapping[str, str | float]
ORDER = 6  # coefficients of a quintic


class Pieces(NamedTuple):
    """What a constructor of a motion works out: pieces, the longest step [s] that resolves them, and their origin."""

    knots: Array
    coefficients: Array
    max_step: float | None
    metadata: Metadata


# (power choose derivative) * derivative!: the factor that differentiation leaves on each power.
_FALLING = np.array([[factorial(j) / factorial(j - d) if j >= d else 0.0 for j in range(ORDER)] for d in range(ORDER)])


def derivatives(local: float, orders: int = 3) -> Array:
    """Rows that turn the coefficients of one piece into its value and derivatives at `local` time: (orders, 6)."""
    powers = local ** np.arange(ORDER)
    rows = np.zeros((orders, ORDER))
    for order in range(orders):
        rows[order, order:] = _FALLING[order, order:] * powers[: ORDER - order]
    return rows


def evaluate(knots: Array, coefficients: Array, time: Array, derivative: int = 0) -> Array:
    """Values or derivatives at `time`, shape (...): ndarray, shape (..., channels); at a knot, of the later piece."""
    last = len(knots) - 2
    piece = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, last)
    return _horner(coefficients[piece], (time - knots[piece])[..., None], derivative)


def _horner(coefficients: Array, local: Array, derivative: int) -> Array:
    """Derivative of polynomials, shape (..., channels, 6), at local times, shape (..., 1)."""
    value = np.zeros(coefficients.shape[:-1])
    if derivative < ORDER:
        for power in range(ORDER - 1, derivative - 1, -1):
            value = value * local + _FALLING[derivative, power] * coefficients[..., power]
    return value


def hermite5(knots: Array, value: Array, slope: Array, curvature: Array) -> Array:
    """Quintic pieces through value, first and second derivative at each knot, each of shape (k+1, channels): C2."""
    h = np.diff(knots)[:, None]
    d0 = value[1:] - value[:-1] - h * (slope[:-1] + h * curvature[:-1] / 2)
    d1 = (slope[1:] - slope[:-1] - h * curvature[:-1]) * h
    d2 = (curvature[1:] - curvature[:-1]) * h**2
    c3 = (10 * d0 - 4 * d1 + d2 / 2) / h**3
    c4 = (-15 * d0 + 7 * d1 - d2) / h**4
    c5 = (6 * d0 - 3 * d1 + d2 / 2) / h**5
    return np.stack([value[:-1], slope[:-1], curvature[:-1] / 2, c3, c4, c5], axis=-1)


def from_rates(knots: Array, velocity: Array, acceleration: Array) -> Array:
    """Pieces whose velocity is the cubic Hermite of the given velocity and acceleration, shapes (k+1, channels).

    The displacement is its exact integral, from zero: displacement, velocity and acceleration agree and are
    continuous. Where velocity is the trapezoidal sum of acceleration, the acceleration comes out piecewise linear.
    """
    h = np.diff(knots)[:, None]
    v0, v1, a0, a1 = velocity[:-1], velocity[1:], acceleration[:-1], acceleration[1:]
    gap = (v1 - v0) / h
    c3 = (3 * gap - 2 * a0 - a1) / (3 * h)
    c4 = (a0 + a1 - 2 * gap) / (4 * h**2)
    steps = h * (v0 + v1) / 2 + h**2 * (a0 - a1) / 12
    start = np.concatenate([np.zeros((1, velocity.shape[1])), np.cumsum(steps, axis=0)[:-1]])
    return np.stack([start, v0, a0 / 2, c3, c4, np.zeros_like(c3)], axis=-1)


def shifted(knots: Array, coefficients: Array, new_knots: Array) -> Array:
    """The same function on finer knots (a superset of `knots`): a Taylor expansion at each new knot."""
    taylor = [evaluate(knots, coefficients, new_knots[:-1], d) / factorial(d) for d in range(ORDER)]
    return np.stack(taylor, axis=-1)


def knot_jumps(knots: Array, coefficients: Array, derivative: int) -> tuple[Array, Array]:
    """Jumps at the inner knots and what rounding may leave there, both ndarray, shape (k-1, channels).

    The rounding allowance is 1e-9 of the largest size of the derivative inside the pieces (a motion that rests at
    every knot has none there), and what cancellation in the values costs: eps |u| / h**derivative over the shorter
    neighbour. The three components of a vector share one allowance: where the frame is turned, each takes a part of
    the rounding of the others.
    """
    h = np.diff(knots)
    left = _horner(coefficients[:-1], h[:-1, None], derivative)
    right = _horner(coefficients[1:], np.zeros((len(h) - 1, 1)), derivative)
    level = _vector_sizes(coefficients[:, :, 0])
    powers = h[:, None, None] ** np.arange(ORDER - derivative)
    terms = np.abs(coefficients[:, :, derivative:]) * _FALLING[derivative, derivative:] * powers
    largest = _vector_sizes(terms.sum(axis=2))
    short = np.minimum(h[:-1], h[1:])[:, None]
    allowance = 1e-9 * largest + 64 * np.finfo(float).eps * level / short**derivative
    return right - left, allowance


def _vector_sizes(values: Array) -> Array:
    """Largest component of each vector over the pieces, (k, channels), said for each of its components, (channels,)."""
    largest = np.abs(values).max(axis=0)
    return np.repeat(largest.reshape(-1, 3).max(axis=1), 3)


def azimuth(knots: Array, horizontal: Array) -> float | None:
    """Direction [rad], in (-pi/2, pi/2], of a straight horizontal motion; 0 if it stands still, None if not straight.

    `horizontal` has shape (k, 2, 6), with displacements counted from the start of the motion.
    """
    scaled = horizontal * np.diff(knots)[:, None, None] ** np.arange(ORDER)
    _, sizes, directions = np.linalg.svd(scaled.transpose(0, 2, 1).reshape(-1, 2), full_matrices=False)
    if sizes[1] > 1e-12 * sizes[0]:
        return None
    if sizes[0] == 0:
        return 0.0
    angle = float(np.arctan2(directions[0, 1], directions[0, 0]))
    angle -= np.pi * round(angle / np.pi)
    return angle if angle > -np.pi / 2 + 1e-12 else angle + np.pi
