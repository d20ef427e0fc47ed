"""The analytic motions of the report, chapter 4, with a smooth start: values, first and second derivatives at a time.

A wave is a function of time, shape (k,), that returns (u, u', u''), each of shape (k,). Waves multiply by the product
rule, so that an envelope and a sine give a motion whose three rows agree exactly.
"""

from __future__ import annotations

import numpy as np

from msfp_gen.errors import InputError
from msfp_gen.motion_checks import positive
from msfp_gen.piecewise import Array, Pieces, hermite5

Wave = tuple[Array, Array, Array]
MOST_PIECES = 2e6  # 0.6 GB of polynomials


def smoothstep(time: Array, rise: float) -> Wave:
    """Quintic S(x) = x^3 (10 - 15 x + 6 x^2), x = time/rise in [0, 1]: from 0 to 1, at rest at both ends; then 1."""
    x = np.clip(time / rise, 0.0, 1.0)
    return (
        x**3 * (10 - 15 * x + 6 * x**2),
        30 * x**2 * (1 - x) ** 2 / rise,
        60 * x * (1 - x) * (1 - 2 * x) / rise**2,
    )


def sine(time: Array, angular_frequency: float, phase: float = 0.0) -> Wave:
    """sin(angular_frequency * time + phase), [rad/s], [rad]."""
    w, angle = angular_frequency, angular_frequency * time + phase
    return np.sin(angle), w * np.cos(angle), -(w**2) * np.sin(angle)


def product(first: Wave, second: Wave) -> Wave:
    """The product of two waves and its derivatives."""
    (a, da, dda), (b, db, ddb) = first, second
    return a * b, da * b + a * db, dda * b + 2 * da * db + a * ddb


def sampling(rise: float, duration: float, shortest_period: float) -> Array:
    """Knots [s] so dense that quintic pieces miss an enveloped sine by less than 1e-9 of its amplitude.

    128 a period, and 128 over the rise, which ends on a knot.
    """
    step = shortest_period / 128
    if not duration / step <= MOST_PIECES:
        raise InputError(
            f"cycles: {duration:.4g} s of waves of {shortest_period:.4g} s need more than {MOST_PIECES:.0e} pieces; "
            "give fewer cycles or a shorter lead_in"
        )
    start = np.linspace(0.0, rise, 1 + max(128, int(np.ceil(rise / step))))
    rest = np.linspace(rise, duration, 1 + max(1, int(np.ceil((duration - rise) / step))))
    return np.concatenate([start, rest[1:]])


def enveloped(
    amplitude: float, sines: list[tuple[float, float, float]], period: float, cycles: float, lead_in: float
) -> Pieces:
    """Sines under the smooth start; for u_g1, u_g2: (share of the amplitude, frequency times period, phase [rad])."""
    amplitude = positive("amplitude", amplitude)
    rise = positive("lead_in", lead_in)
    duration = rise + positive("cycles", cycles) * period
    shortest = period / max(multiple for _, multiple, _ in sines)
    knots = sampling(rise, duration, shortest)
    envelope = smoothstep(knots, rise)
    rows = np.zeros((3, len(knots), 6))
    for channel, (share, multiple, phase) in enumerate(sines):
        wave = sine(knots, 2 * np.pi * multiple / period, phase)
        rows[:, :, channel] = amplitude * share * np.array(product(envelope, wave))
    metadata: dict[str, str | float] = {"source": "smooth start and sines", "amplitude": amplitude, "period": period}
    metadata |= {"lead_in": rise, "cycles": float(cycles)}
    return Pieces(knots, hermite5(knots, *rows), shortest / 40, metadata)
