"""Pieces from samples: displacements, accelerations and corrected records."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.motion_checks import positive, series
from msfp_gen.piecewise import ORDER, Array, Pieces, from_rates

if TYPE_CHECKING:
    from msfp_gen.records import Corrected

_REST = 1e-3  # a sampled end slower than this share of the peak velocity is taken to be at rest


def spline(time: ArrayLike, displacement: ArrayLike, rotation: ArrayLike | None) -> Pieces:
    """Cubic splines through displacements (k, 3) [m] and rotations (k, 3) [rad]: see `Motion.from_arrays`."""
    from scipy.interpolate import CubicSpline

    times, metadata = _from_zero(time)
    shape = (len(times), 3)
    turned = np.zeros(shape) if rotation is None else series("rotation", rotation, shape)
    values = np.concatenate([series("displacement", displacement, shape), turned], axis=1)
    free = CubicSpline(times, values)
    slopes, peak = free(times[[0, -1]], 1), np.max(np.abs(free(times, 1)), axis=0)
    pieces = np.zeros((len(times) - 1, 6, ORDER))
    for channel in range(6):
        rest = np.abs(slopes[:, channel]) <= _REST * peak[channel]
        ends = tuple((1, 0.0) if r else "not-a-knot" for r in rest)
        pieces[:, channel, :4] = CubicSpline(times, values[:, channel], bc_type=ends).c[::-1].T
    metadata |= {"source": "displacement samples, cubic spline"}
    metadata |= {"initial_speed": float(np.linalg.norm(pieces[0, :3, 1]))}
    return Pieces(times, pieces, _resolved(times), metadata)


def integrated(time: ArrayLike, acceleration: ArrayLike) -> Pieces:
    """Piecewise linear acceleration (k, 3) [m/s^2], integrated twice exactly from rest."""
    times, metadata = _from_zero(time)
    rate = np.zeros((len(times), 6))
    rate[:, :3] = series("acceleration", acceleration, (len(times), 3))
    steps = np.diff(times)[:, None] * (rate[1:] + rate[:-1]) / 2
    velocity = np.concatenate([np.zeros((1, 6)), np.cumsum(steps, axis=0)])
    metadata |= {"source": "acceleration samples, piecewise linear"}
    return Pieces(times, from_rates(times, velocity, rate), _resolved(times), metadata)


def integrated_once(time: ArrayLike, velocity: ArrayLike) -> Pieces:
    """Velocity (k, 3) [m/s], interpolated by a cubic spline (not-a-knot) and integrated exactly from zero."""
    from scipy.interpolate import CubicSpline

    times, metadata = _from_zero(time)
    rates = np.zeros((2, len(times), 6))
    rates[0, :, :3] = series("velocity", velocity, (len(times), 3))
    rates[1] = CubicSpline(times, rates[0])(times, 1)
    metadata |= {"source": "velocity samples, cubic spline", "initial_speed": float(np.linalg.norm(rates[0, 0]))}
    return Pieces(times, from_rates(times, rates[0], rates[1]), _resolved(times), metadata)


def recorded(corrected: Corrected, scale: float) -> Pieces:
    """A corrected record, times `scale`."""
    rates = np.zeros((2, len(corrected.time), 6))
    factor = positive("scale", scale)
    rates[:, :, :3] = factor * np.array([corrected.velocity, corrected.acceleration])
    pieces = from_rates(corrected.time, rates[0], rates[1])
    return Pieces(corrected.time, pieces, _resolved(corrected.time), {**corrected.metadata, "scale": factor})


def _from_zero(time: ArrayLike) -> tuple[Array, dict[str, str | float]]:
    """The times counted from the first, and that first time as metadata if it was not zero."""
    times = series("time", time)
    start = float(times[0])
    return times - start, {"start_time": start} if start else {}


def _resolved(times: Array) -> float:
    """Two sample intervals [s]: a longer step would skip over what the samples resolve."""
    return 2 * float(np.median(np.diff(times)))
