"""Piecewise polynomials of degree up to five: evaluation, interpolation, refinement and measures of smoothness.

In all functions `knots` is an ndarray, shape (k+1,), [s], increasing. `coefficients` is an ndarray, shape (k, channels,
6): piece, channel, ascending power of (t - knots[piece]).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from math import atan2, factorial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array

Metadata = Mapping[str, str | float]
ORDER = 6  # number of coefficients of a quintic


class Pieces(NamedTuple):
    """Data from which a motion is constructed.

    Attributes:
        knots, coefficients: the polynomials, shapes (k + 1,) [s] and (k, 6, 6), of `Motion`.
        max_step: longest step of a run that resolves them [s]; None: unknown.
        metadata: origin and parameters of the motion.
    """

    knots: Array
    coefficients: Array
    max_step: float | None
    metadata: Metadata


class PickledByFields:
    """A frozen dataclass that is copied and pickled with its checked fields, and with its `resolution` once known."""

    def __getstate__(self) -> dict[str, Any]:
        names = (*(each.name for each in fields(self)), "resolution")  # type: ignore[arg-type]
        return {name: vars(self)[name] for name in names if name in vars(self)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        for each in state.values():
            if isinstance(each, np.ndarray):
                each.setflags(write=False)


# Factor j!/(j - d)! that the d-th derivative produces on the power j, shape (derivative, power).
_DERIVATIVE_FACTORS = np.array(
    [[factorial(j) / factorial(j - d) if j >= d else 0.0 for j in range(ORDER)] for d in range(ORDER)]
)


def powers(values: ArrayLike, count: int = ORDER) -> Array:
    """Powers 0 to count - 1 along a new last axis, shape (..., count) [powers of the unit of `values`].

    By products: the `**` of NumPy depends on the processor.
    """
    factors = np.repeat(np.asarray(values, dtype=float)[..., None], count, axis=-1)
    factors[..., 0] = 1.0
    result: Array = np.cumprod(factors, axis=-1)
    return result


def derivatives(local: float) -> Array:
    """Matrix that gives value and two derivatives of one piece from its coefficients: ndarray, shape (3, 6).

    local: time since the knot at which the piece begins [s].
    """
    rising = powers(local)
    rows = np.zeros((3, ORDER))
    for order in range(3):
        rows[order, order:] = _DERIVATIVE_FACTORS[order, order:] * rising[: ORDER - order]
    return rows


def evaluate(knots: Array, coefficients: Array, time: Array, derivative: int = 0) -> Array:
    """Values or derivatives at `time`, shape (...), [s]: ndarray, shape (..., channels).

    At a knot the later piece is evaluated.
    """
    last = len(knots) - 2
    piece = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, last)
    return polynomial(coefficients[piece], (time - knots[piece])[..., None], derivative)


def polynomial(coefficients: Array, local: Array, derivative: int) -> Array:
    """Value or derivative of polynomials, shape (..., channels, 6), at times since their knot, shape (..., 1), [s]."""
    value = np.zeros(coefficients.shape[:-1])
    if derivative < ORDER:
        for power in range(ORDER - 1, derivative - 1, -1):
            value = value * local + _DERIVATIVE_FACTORS[derivative, power] * coefficients[..., power]
    return value


def hermite5(knots: Array, value: Array, slope: Array, curvature: Array) -> Array:
    """Coefficients of quintic Hermite pieces, twice continuously differentiable.

    Args:
        knots: shape (k+1,), [s].
        value: at each knot, shape (k+1, channels).
        slope: first derivative at each knot, same shape.
        curvature: second derivative at each knot, same shape.
    """
    h = np.diff(knots)[:, None]
    d0 = value[1:] - value[:-1] - h * (slope[:-1] + h * curvature[:-1] / 2)
    d1 = (slope[1:] - slope[:-1] - h * curvature[:-1]) * h
    d2 = (curvature[1:] - curvature[:-1]) * h**2
    _, _, _, h3, h4, h5 = np.moveaxis(powers(h), -1, 0)
    c3 = (10 * d0 - 4 * d1 + d2 / 2) / h3
    c4 = (-15 * d0 + 7 * d1 - d2) / h4
    c5 = (6 * d0 - 3 * d1 + d2 / 2) / h5
    return np.stack([value[:-1], slope[:-1], curvature[:-1] / 2, c3, c4, c5], axis=-1)


def from_rates(knots: Array, velocity: Array, acceleration: Array) -> Array:
    """Coefficients of pieces whose velocity is the cubic Hermite interpolant of velocity and acceleration.

    The displacement is its exact integral from zero, so displacement, velocity and acceleration are consistent and
    continuous. If the velocity is the trapezoidal integral of the acceleration, the acceleration is piecewise linear.

    Args:
        knots: shape (k+1,), [s].
        velocity: shape (k+1, channels).
        acceleration: same shape.
    """
    h = np.diff(knots)[:, None]
    v0, v1, a0, a1 = velocity[:-1], velocity[1:], acceleration[:-1], acceleration[1:]
    secant = (v1 - v0) / h
    c3 = (3 * secant - 2 * a0 - a1) / (3 * h)
    c4 = (a0 + a1 - 2 * secant) / (4 * h**2)
    steps = h * (v0 + v1) / 2 + h**2 * (a0 - a1) / 12
    start = np.concatenate([np.zeros((1, velocity.shape[1])), np.cumsum(steps, axis=0)[:-1]])
    return np.stack([start, v0, a0 / 2, c3, c4, np.zeros_like(c3)], axis=-1)


def refined(knots: Array, coefficients: Array, new_knots: Array) -> Array:
    """Coefficients of the same function on `new_knots`, a superset of `knots`: its Taylor expansion at each of them.

    Shapes: knots (k+1,) [s], coefficients (k, channels, 6).
    """
    taylor = [evaluate(knots, coefficients, new_knots[:-1], d) / factorial(d) for d in range(ORDER)]
    return np.stack(taylor, axis=-1)


def knot_jumps(knots: Array, coefficients: Array, derivative: int) -> tuple[Array, Array]:
    """Jumps of a derivative at the inner knots, and their bounds from rounding, both of shape (k-1, channels) [SI].

    The bound is 1e-9 of the largest magnitude of the derivative inside the pieces, plus the cancellation error of the
    values, eps |u| / h**derivative with h of the shorter neighbouring piece. The magnitude is not taken at the knots,
    where the derivative may vanish. The three components of a vector share one bound, since a rotation of the frame
    distributes the rounding error of each over all of them.
    """
    h = np.diff(knots)
    left = polynomial(coefficients[:-1], h[:-1, None], derivative)
    right = polynomial(coefficients[1:], np.zeros((len(h) - 1, 1)), derivative)
    largest_value = _largest_in_vector(coefficients[:, :, 0])
    rising = powers(h[:, None], ORDER - derivative)
    terms = np.abs(coefficients[:, :, derivative:]) * _DERIVATIVE_FACTORS[derivative, derivative:] * rising
    largest = _largest_in_vector(terms.sum(axis=2))
    short = np.minimum(h[:-1], h[1:])[:, None]
    bound = 1e-9 * largest + 64 * np.finfo(float).eps * largest_value / short**derivative
    return right - left, bound


def _largest_in_vector(values: Array) -> Array:
    """Largest magnitude over all pieces and the three components of a vector, repeated for each component."""
    # `values` has shape (k, channels), the result (channels,).
    largest = np.abs(values).max(axis=0)
    return np.repeat(largest.reshape(-1, 3).max(axis=1), 3)


def azimuth(knots: Array, horizontal: Array) -> float | None:
    """Direction [rad], in (-pi/2, pi/2], of a horizontal motion along a line; 0 without motion, None for a curved path.

    `horizontal` are coefficients of shape (k, 2, 6) of the displacement relative to the start of the motion.
    """
    scaled = horizontal * powers(np.diff(knots)[:, None])
    if not np.any(scaled):
        return 0.0
    x, y = np.moveaxis(scaled / np.abs(scaled).max(), 1, 0)
    squares = x**2 + y**2
    at = np.unravel_index(np.argmax(squares), squares.shape)
    across = x * y[at] - y * x[at]
    if np.sum(across**2) > 1e-24 * squares[at] * np.sum(squares):
        return None
    angle = atan2(y[at], x[at])
    angle -= np.pi * round(angle / np.pi)
    return angle if angle > -np.pi / 2 + 1e-12 else angle + np.pi


def summary(history: object, name: str, knots: Array) -> str:
    """Kind, name, duration and number of pieces of a history, in one line."""
    return f"{type(history).__name__} {name or 'without a name'}: {knots[-1]:.6g} s in {len(knots) - 1} pieces"
