"""Piecewise polynomials from samples of a motion or another history, and from corrected records."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.motions.checks import finite, positive, samples
from msfp_gen.motions.piecewise import ORDER, Pieces, from_rates

if TYPE_CHECKING:
    from msfp_gen.motions.records import Corrected

_REST_SHARE = 1e-3  # an end is taken to be at rest if its velocity is at most this share of the peak velocity


def from_displacement(time: ArrayLike, displacement: ArrayLike, rotation: ArrayLike | None) -> Pieces:
    """Cubic splines through displacements (k, 3) [m] and rotations (k, 3) [rad]: see `Motion.from_arrays`."""
    from scipy.interpolate import CubicSpline

    times, metadata = _from_zero(time)
    shape = (len(times), 3)
    angles = np.zeros(shape) if rotation is None else samples("rotation", rotation, shape)
    values = np.concatenate([samples("displacement", displacement, shape), angles], axis=1)
    unclamped = CubicSpline(times, values)
    slopes, peak = unclamped(times[[0, -1]], 1), np.max(np.abs(unclamped(times, 1)), axis=0)
    pieces = np.zeros((len(times) - 1, 6, ORDER))
    for channel in range(6):
        at_rest = np.abs(slopes[:, channel]) <= _REST_SHARE * peak[channel]
        ends = tuple((1, 0.0) if rest else "not-a-knot" for rest in at_rest)
        pieces[:, channel, :4] = CubicSpline(times, values[:, channel], bc_type=ends).c[::-1].T
    metadata |= {"source": "displacement samples, cubic spline"}
    metadata |= {"initial_speed": float(np.linalg.norm(pieces[0, :3, 1]))}
    return Pieces(times, pieces, _resolving_step(times), metadata)


def from_acceleration(time: ArrayLike, acceleration: ArrayLike) -> Pieces:
    """Piecewise linear acceleration (k, 3) [m/s^2], integrated twice exactly from rest."""
    times, metadata = _from_zero(time)
    rate = np.zeros((len(times), 6))
    rate[:, :3] = samples("acceleration", acceleration, (len(times), 3))
    steps = np.diff(times)[:, None] * (rate[1:] + rate[:-1]) / 2
    velocity = np.concatenate([np.zeros((1, 6)), np.cumsum(steps, axis=0)])
    metadata |= {"source": "acceleration samples, piecewise linear"}
    return Pieces(times, from_rates(times, velocity, rate), _resolving_step(times), metadata)


def from_velocity(time: ArrayLike, velocity: ArrayLike) -> Pieces:
    """Velocity (k, 3) [m/s], interpolated by a cubic spline (not-a-knot) and integrated exactly from zero."""
    from scipy.interpolate import CubicSpline

    times, metadata = _from_zero(time)
    rates = np.zeros((2, len(times), 6))
    rates[0, :, :3] = samples("velocity", velocity, (len(times), 3))
    rates[1] = CubicSpline(times, rates[0])(times, 1)
    metadata |= {"source": "velocity samples, cubic spline", "initial_speed": float(np.linalg.norm(rates[0, 0]))}
    return Pieces(times, from_rates(times, rates[0], rates[1]), _resolving_step(times), metadata)


def from_corrected(corrected: Corrected, scale: float) -> Pieces:
    """A corrected record, multiplied by `scale`."""
    rates = np.zeros((2, len(corrected.time), 6))
    factor = positive("scale", scale)
    rates[:, :, :3] = factor * np.array([corrected.velocity, corrected.acceleration])
    pieces = from_rates(corrected.time, rates[0], rates[1])
    return Pieces(corrected.time, pieces, _resolving_step(corrected.time), {**corrected.metadata, "scale": factor})


def sampled_linear(word: str, time: ArrayLike, values: Array) -> tuple[Array, Array]:
    """Knots and coefficients of linear interpolation of `values`, shape (k, channels), at `time`, shape (k,), [s].

    Two samples at one time define a jump, also at the last time. `word` names the history in errors. Raises InputError
    unless times begin at zero, do not decrease, and match the rows of `values`.
    """
    times = finite(f"{word}.time", time)
    if times.ndim != 1 or len(times) < 2 or times[0] != 0:
        first = f"shape {times.shape}, first {times.flat[:1]}"
        raise InputError(f"{word}.time: {first}; give at least two times, the first of them zero")
    if np.any(earlier := np.diff(times) < 0):
        i = int(np.argmax(earlier))
        one, next_one = times[i : i + 2].tolist()
        raise InputError(f"{word}.time[{i + 1}]: {next_one!r} s is before {one!r} s; sort the samples")
    if len(values) != len(times):
        raise InputError(f"{word}: {len(values)} rows for {len(times)} times; give one row for each time")
    if times[-1] == times[-2]:  # the value after a jump at the end is kept
        times, values = np.append(times, times[-1] + 1.0), np.vstack([values, values[-1]])
    wide = np.diff(times) > 0
    pieces = np.zeros((int(wide.sum()), values.shape[1], ORDER))
    pieces[:, :, 0] = values[:-1][wide]
    pieces[:, :, 1] = (np.diff(values, axis=0)[wide]) / np.diff(times)[wide, None]
    if not len(pieces):
        raise InputError(f"{word}.time: all times are {times[0]:g} s; give a later one")
    return np.append(times[:-1][wide], times[1:][wide][-1]), pieces


def _from_zero(time: ArrayLike) -> tuple[Array, dict[str, str | float]]:
    """Times relative to the first one, and metadata `start_time` [s] if the first one is not zero."""
    times = samples("time", time)
    start = float(times[0])
    return times - start, {"start_time": start} if start else {}


def _resolving_step(times: Array) -> float:
    """Longest step of a run that resolves samples: two median sample intervals [s]."""
    return 2 * float(np.median(np.diff(times)))
