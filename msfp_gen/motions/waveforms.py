"""Analytic motions of PEER 2017/07, chapter 4, with a smooth start: values, first and second derivatives.

A wave is a tuple (u, u', u'') of arrays of shape (k,) at the same times. Waves are multiplied by the product rule, so
displacement, velocity and acceleration of an enveloped sine are exactly consistent.
"""

from __future__ import annotations

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.elementary import cos, sin
from msfp_gen.common.errors import InputError
from msfp_gen.motions.checks import positive
from msfp_gen.motions.piecewise import Pieces, hermite5

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
    return sin(angle), w * cos(angle), -(w**2) * sin(angle)


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
