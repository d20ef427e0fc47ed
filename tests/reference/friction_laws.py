"""Friction coefficients and temperatures as the publications state them, in plain numpy and SI."""

from __future__ import annotations

from typing import Any

import numpy as np

from .parameters import Array

EDGE = 0.1  # the patch leaves the centre while (x/reach)^2 goes from 1 - EDGE to 1 + EDGE (docs/friction.md)


def velocity(mu_fast: Any, mu_slow: Any, rate: float, v: Any) -> Any:
    """mu_max - (mu_max - mu_min) exp(-a v)."""
    return mu_fast - (mu_fast - mu_slow) * np.exp(-rate * v)


def kp(p: Any, p_ref: float) -> Any:
    """Pressure [Pa]: 0.7^(0.02 (p - p_ref)) with MPa."""
    return 0.7 ** (0.02 * (p - p_ref) * 1e-6)


def kv(v: Any, rate: float = 100.0) -> Any:
    """Velocity [m/s]."""
    return 1 - 0.5 * np.exp(-rate * v)


def kt(T: Any) -> Any:
    """Temperature [degC], with the published factor 0.789."""
    return 0.789 * (0.7 ** (T / 50) + 0.4)


def sliding_velocity(f: Array, slip: Array) -> Array:
    """(Y^2 + Z^2) max(Y u + Z v, 0), over the last axis [m/s]."""
    return (f**2).sum(-1) * np.maximum((f * slip).sum(-1), 0)


def cover(away: Array, radius: float) -> Array:
    """1 where a round patch whose centre is `away` [m] from that of the surface covers it, else 0; a smooth edge."""
    z = np.clip((1 - away**2 / (radius**2 * np.pi / 4)) / EDGE, -1, 1)
    return 0.5 + z * (3 - z**2) / 4


def temperature(t: Array, q: Array, k: float, D: float, T0: float, rows: Array | None = None) -> Array:
    """T0 + sqrt(D/pi)/k times the integral of q(t - tau)/sqrt(tau), the O(n^2) sum over all pairs of times [degC].

    The flux q [W/m^2] is linear between its samples; each interval is integrated exactly.
    rows: where; None: everywhere.
    """
    rows = np.arange(len(t)) if rows is None else rows
    out = np.full(len(rows), T0)
    for place, i in enumerate(rows):
        a, b = t[i] - t[:i], t[i] - t[1 : i + 1]  # tau at the two ends of each interval
        slope = (q[1 : i + 1] - q[:i]) / (t[1 : i + 1] - t[:i])
        first = 2 * (np.sqrt(a) - np.sqrt(b))
        second = 2 / 3 * (a**1.5 - b**1.5)
        out[place] += np.sqrt(D / np.pi) / k * (q[:i] * first + slope * (a * first - second)).sum()
    return out


def images(tau: Any, d: float, D: float) -> Any:
    """2 sum exp(-n^2 d^2/(D tau)), to 1e-16: what the back face of a plate adds to the kernel, over it."""
    across = d**2 / (D * np.asarray(tau, float))
    n = np.arange(1, int(np.ceil((37 / across.min()) ** 0.5)) + 1)
    return 2 * np.exp(-np.multiply.outer(across, n**2)).sum(-1)


def image_temperature(t: Array, q: Array, k: float, D: float, d: float, rows: Array) -> Array:
    """What the images add to `temperature` in a plate of thickness d, at some rows [K].

    Images are smooth in time: a trapezoidal sum.
    """
    out = np.zeros(len(rows))
    for place, i in enumerate(rows):
        tau = t[i] - t[:i]
        kernel = np.append(images(tau, d, D) / np.sqrt(tau), 0.0)
        out[place] = np.sqrt(D / np.pi) / k * np.trapezoid(q[: i + 1] * kernel, t[: i + 1])
    return out


def temperature_by_states(t: Array, q: Array, k: float, D: float, T0: float, kernel: Any) -> Array:
    """`temperature` with the kernel given as (rate, weight) of exponentials, each integrated exactly [degC]."""
    rate, weight = np.array(kernel).T
    state, out = np.zeros(len(rate)), np.full(len(t), T0)
    for i, h in enumerate(np.diff(t), start=1):
        constant = -np.expm1(-rate * h) / rate
        ramp = (h - constant) / rate / h if h > 0 else 0.0
        state = np.exp(-rate * h) * state + weight * (q[i - 1] * constant + (q[i] - q[i - 1]) * ramp)
        out[i] += np.sqrt(D / np.pi) / k * state.sum()
    return out


def change_within(t: Array, q: Array, span: float) -> Array:
    """Largest less least flux over the last `span` before each time."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    step = span / 20
    fine = np.interp(np.arange(t[0] - span, t[-1] + step, step), t, q, left=0.0)
    size = {"size": 24, "origin": 11}  # a little more than the span, all of it before
    spread = maximum_filter1d(fine, **size) - minimum_filter1d(fine, **size)
    return np.interp(t, np.arange(t[0] - span, t[-1] + step, step), spread)
