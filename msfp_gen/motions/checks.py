"""Checks of the data of a motion; errors name the field, the value and the remedy in one line."""

from __future__ import annotations

from numbers import Integral

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array, distinct
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import LARGEST, Text
from msfp_gen.motions import piecewise

_JUMPS = (
    ("position", "make the displacement continuous"),
    ("velocity", "that is an impulse; smooth the data or start from rest"),
    ("acceleration", "smooth it, or name the time in `jumps`"),
)


def positive(field: str, value: float) -> float:
    """`value` as a float. Raises InputError unless it is positive, and neither it nor its reciprocal above LARGEST."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{field}: {value!r} is not a number; give a positive one") from None
    if not (np.isfinite(number) and number > 0):
        raise InputError(f"{field}: {number!r} is not a positive finite number; give one")
    if not 1 / LARGEST <= number <= LARGEST:
        raise InputError(f"{field}: {number!r} is beyond all measure; give {1 / LARGEST:g} to {LARGEST:g}")
    return number


def storable(field: str, text: str) -> str:
    """`text`. Raises InputError where files cannot hold it."""
    try:
        return Text().parse(text)
    except ValueError as error:
        raise InputError(f"{field} = {text!r}: {error}") from None


def number(field: str, value: float) -> float:
    """`value` as a float. Raises InputError unless it is one finite number."""
    array = numbers(field, value)
    if array.ndim:
        raise InputError(f"{field}: shape {array.shape}; give one number")
    return float(array)


def order(derivative: int) -> int:
    """The order of a derivative. Raises InputError unless it is a whole number that is not negative."""
    if not isinstance(derivative, Integral) or derivative < 0:
        raise InputError(f"derivative: {derivative!r}; give 0 (the value), 1 (its rate) or 2 (the rate of that)")
    return int(derivative)


def vector(field: str, values: ArrayLike, components: int = 3) -> Array:
    """`values` as an array of finite numbers, shape (components,), [unit of `values`]. Raises InputError."""
    array = finite(field, values)
    if array.shape != (components,):
        raise InputError(f"{field}: shape {array.shape}; give {components} numbers")
    return array


def finite(field: str, values: ArrayLike) -> Array:
    """`values` as contiguous floats, shape (1,) of a number [unit of `values`]. Raises InputError as `numbers`."""
    return np.ascontiguousarray(numbers(field, values))


def numbers(field: str, values: ArrayLike) -> Array:
    """`values` as floats, of their shape [unit of `values`]. Raises InputError unless all are finite numbers."""
    try:
        if values is None or np.iscomplexobj(values):
            raise TypeError
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{field}: not an array of numbers ({type(values).__name__}); give real numbers") from None
    if not np.all(np.isfinite(array)):
        index = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InputError(f"{field}{list(index)}: {array[index]} is not finite; fill or cut the gap")
    return array


def increasing(field: str, times: Array) -> Array:
    """`times`, shape (k,), [s]. Raises InputError unless they are strictly increasing."""
    if times.ndim != 1:
        raise InputError(f"{field}: shape {times.shape}; give times in one dimension")
    late = np.diff(times) < 1 / LARGEST
    if np.any(late):
        i = int(np.argmax(late))
        raise InputError(
            f"{field}[{i + 1}]: {times[i + 1]:g} s does not come after {times[i]:g} s; sort the samples, drop repeats"
        )
    return times


def samples(field: str, values: ArrayLike, shape: tuple[int, ...] | None = None) -> Array:
    """`values` as an array of the given shape [unit of `values`]; shape None: at least four strictly increasing times.

    Raises InputError for another shape, other times, or values that are not finite.
    """
    array = finite(field, values)
    if shape is not None:
        if array.shape != shape:
            raise InputError(f"{field}: shape {array.shape}; give {shape}, one row of three components a time")
        return array
    if array.ndim != 1 or len(array) < 4:
        raise InputError(f"{field}: shape {array.shape}; give at least 4 times in one dimension")
    return increasing(field, array)


def checked_pieces(
    knots: ArrayLike, coefficients: ArrayLike, jumps: ArrayLike, channels: tuple[str, ...]
) -> tuple[Array, Array, Array]:
    """Check that piecewise polynomials are twice continuously differentiable, except at `jumps`.

    Args:
        knots: shape (k+1,), [s].
        coefficients: shape (k, channels, 6).
        jumps: shape (j,), [s]: knots at which the second derivative may be discontinuous.
        channels: names of the channels, for messages.

    Returns:
        Read-only copies of the three arrays; `jumps` sorted and without duplicates.

    Raises:
        InputError: shapes, order or finiteness are wrong, or a channel or a derivative jumps.
    """
    k, c, j = finite("knots", knots), finite("coefficients", coefficients), finite("jumps", jumps)
    if k.ndim != 1 or len(k) < 2 or k[0] != 0:
        raise InputError(f"knots: shape {k.shape}, first {k.flat[:1]}; give at least two times, the first of them zero")
    increasing("knots", k)
    shape = (len(k) - 1, len(channels), piecewise.ORDER)
    if c.shape != shape:
        raise InputError(f"coefficients: shape {c.shape}; give {shape}: pieces, channels, powers 0..5")
    j = distinct(j)
    missing = j[k[np.minimum(np.searchsorted(k, j), len(k) - 1)] != j]
    if len(missing):
        raise InputError(f"jumps: {missing[0]:g} s is not a knot; put a knot there")
    for derivative, (quantity, remedy) in enumerate(_JUMPS):
        with np.errstate(over="ignore", invalid="ignore"):
            size, allowance = piecewise.knot_jumps(k, c, derivative)
        if not (np.isfinite(size).all() and np.isfinite(allowance).all()):
            raise InputError(f"motion: the {quantity} is not finite within {k[-1]:g} s; give smaller numbers")
        bad = np.abs(size) > allowance
        if derivative == 2:
            bad &= ~np.isin(k[1:-1], j)[:, None]
        if np.any(bad):
            knot, channel = (int(i) for i in np.argwhere(bad)[0])
            raise InputError(
                f"motion: the {quantity} of {channels[channel]} jumps by {size[knot, channel]:.3g} "
                f"at t = {k[knot + 1]:g} s; {remedy}"
            )
    frozen = tuple(a.copy() for a in (k, c, j))
    for array in frozen:
        array.setflags(write=False)
    return frozen[0], frozen[1], frozen[2]
