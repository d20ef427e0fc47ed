"""Piecewise polynomials of motions and other histories: from samples and analytic waves.

The waves are the motions of PEER 2017/07, chapter 4, with a smooth start. A wave is a tuple (u, u', u'') of arrays of
shape (k,) at the same times. Waves are multiplied by the product rule, so displacement, velocity and acceleration of an
enveloped sine are exactly consistent.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.motions.checks import finite, positive, samples
from msfp_gen.motions.piecewise import ORDER, Pieces, from_rates, hermite5

ACCELERATION_SAMPLES = "acceleration samples, piecewise linear"  # the source in the metadata of such a motion
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
    return Pieces(times, pieces, resolving_step(times), metadata)


def from_acceleration(time: ArrayLike, acceleration: ArrayLike) -> Pieces:
    """Piecewise linear acceleration (k, 3) [m/s^2], integrated twice exactly from rest."""
    times, metadata = _from_zero(time)
    rate = np.zeros((len(times), 6))
    rate[:, :3] = samples("acceleration", acceleration, (len(times), 3))
    steps = np.diff(times)[:, None] * (rate[1:] + rate[:-1]) / 2
    velocity = np.concatenate([np.zeros((1, 6)), np.cumsum(steps, axis=0)])
    metadata |= {"source": ACCELERATION_SAMPLES}
    return Pieces(times, from_rates(times, velocity, rate), resolving_step(times), metadata)


def from_velocity(time: ArrayLike, velocity: ArrayLike) -> Pieces:
    """Velocity (k, 3) [m/s], interpolated by a cubic spline (not-a-knot) and integrated exactly from zero."""
    from scipy.interpolate import CubicSpline

    times, metadata = _from_zero(time)
    rates = np.zeros((2, len(times), 6))
    rates[0, :, :3] = samples("velocity", velocity, (len(times), 3))
    rates[1] = CubicSpline(times, rates[0])(times, 1)
    metadata |= {"source": "velocity samples, cubic spline", "initial_speed": float(np.linalg.norm(rates[0, 0]))}
    return Pieces(times, from_rates(times, rates[0], rates[1]), resolving_step(times), metadata)


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


def resolving_step(times: Array) -> float:
    """Longest step of a run that resolves samples: two median sample intervals [s]."""
    return 2 * float(np.median(np.diff(times)))


Wave = tuple[Array, Array, Array]
MAX_PIECES = 2e6  # limits the memory of the coefficients to 0.6 GB


def smoothstep(time: Array, rise: float) -> Wave:
    """Quintic S(x) = x^3 (10 - 15 x + 6 x^2), x = time/rise, from 0 to 1 with zero derivatives at both ends; then 1.

    Args:
        time: shape (k,), [s].
        rise: duration of the increase [s].
    """
    x = np.clip(time / rise, 0.0, 1.0)
    return (
        x**2 * x * (10 - 15 * x + 6 * x**2),
        30 * x**2 * (1 - x) ** 2 / rise,
        60 * x * (1 - x) * (1 - 2 * x) / rise**2,
    )


def sine(time: Array, angular_frequency: float, phase: float = 0.0) -> Wave:
    """sin(angular_frequency * time + phase) at `time`, shape (k,), [s]; angular frequency [rad/s], phase [rad]."""
    w, angle = angular_frequency, angular_frequency * time + phase
    return np.sin(angle), w * np.cos(angle), -(w**2) * np.sin(angle)


def product(first: Wave, second: Wave) -> Wave:
    """Product of two waves at the same times, with its derivatives."""
    (a, da, dda), (b, db, ddb) = first, second
    return a * b, da * b + a * db, dda * b + 2 * da * db + a * ddb


def wave_knots(rise: float, duration: float, shortest_period: float) -> Array:
    """Knots, shape (k+1,) [s], for quintic pieces that approximate an enveloped sine to 1e-9 of its amplitude.

    There are 128 in a period and at least 128 in the rise, whose end is a knot.

    Args:
        rise: duration of the smooth start [s].
        duration: duration of the motion [s].
        shortest_period: shortest period of its sines [s].

    Raises:
        InputError: more than `MAX_PIECES` pieces would be needed.
    """
    step = shortest_period / 128
    if not duration > rise:
        raise InputError(f"cycles: they end with the lead_in of {rise:.4g} s; give more cycles or a shorter lead_in")
    if not duration / step <= MAX_PIECES:
        raise InputError(
            f"cycles: {duration:.4g} s of waves of {shortest_period:.4g} s need more than {MAX_PIECES:.0e} pieces; "
            "give fewer cycles or a shorter lead_in"
        )
    start = np.linspace(0.0, rise, 1 + max(128, int(np.ceil(rise / step))))
    rest = np.linspace(rise, duration, 1 + max(1, int(np.ceil((duration - rise) / step))))
    return np.concatenate([start, rest[1:]])


def enveloped_sines(
    amplitude: float, sines: list[tuple[float, float, float]], period: float, cycles: float, lead_in: float
) -> Pieces:
    """Motion of sines along u_g1 and u_g2 with a smooth start.

    Args:
        amplitude: [m].
        sines: for u_g1 and u_g2: (factor on the amplitude, frequency times `period`, phase [rad]).
        period: [s].
        cycles: number of periods after the smooth start.
        lead_in: duration of the smooth start [s].

    Raises:
        InputError: a value is not positive, or too many pieces would be needed.
    """
    amplitude = positive("amplitude", amplitude)
    rise = positive("lead_in", lead_in)
    duration = rise + positive("cycles", cycles) * period
    shortest = period / max(multiple for _, multiple, _ in sines)
    knots = wave_knots(rise, duration, shortest)
    envelope = smoothstep(knots, rise)
    rows = np.zeros((3, len(knots), 6))
    for channel, (factor, multiple, phase) in enumerate(sines):
        wave = sine(knots, 2 * np.pi * multiple / period, phase)
        rows[:, :, channel] = amplitude * factor * np.array(product(envelope, wave))
    metadata: dict[str, str | float] = {"source": "smooth start and sines", "amplitude": amplitude, "period": period}
    metadata |= {"lead_in": rise, "cycles": float(cycles)}
    return Pieces(knots, hermite5(knots, *rows), shortest / 40, metadata)
