"""Which surfaces slide when, which rest on their rims, and which are open."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from msfp_gen.history import Array, History

SHARE = 0.1  # of all sliding at one instant, below which a surface only gives: its friction or its rim is elastic
YIELDED = 0.9  # |(Y, Z)| from which friction counts as overcome; it is 1 in steady sliding (2.94)

Flags = NDArray[np.bool_]


def sliding_now(history: History) -> Flags:
    """Whether each surface slides in each row, ndarray of bool, shape (T, n-1).

    It does where its friction is overcome, |(Y, Z)| >= `YIELDED` (2.94), acts against the slip, and the surface is
    closed and does at least `SHARE` of all sliding of that instant.
    """
    state, slip = history.friction_state, history.slip_velocity
    speed = np.where(parted(history), 0.0, np.linalg.norm(slip, axis=-1))
    overcome = np.linalg.norm(state, axis=-1) >= YIELDED
    against = np.sum(state * slip, axis=-1) > 0
    flags: Flags = overcome & against & (speed >= SHARE * speed.sum(axis=1, keepdims=True)) & ~parted(history)
    return flags


def parted(history: History) -> Flags:
    """Whether each surface is open in each row, ndarray of bool, shape (T, n-1); never without `effects.uplift`."""
    flags: Flags = history.lift > 0
    return flags


def rims_touched(history: History) -> Flags:
    """Whether each rim pushes in each row, ndarray of bool, shape (T, n-1)."""
    touched: Flags = history.rim_force != 0
    return touched


def spans(time: Array, flags: Flags) -> list[tuple[float, float]]:
    """(start, length) [s] of the stretches in which `flags`, ndarray of bool, shape (T,), hold.

    A row stands for the time half way to its neighbours.
    """
    edges = np.concatenate([time[:1], (time[1:] + time[:-1]) / 2, time[-1:]])
    change = np.diff(np.concatenate([[False], flags, [False]]).astype(int))
    starts, ends = edges[np.flatnonzero(change > 0)], edges[np.flatnonzero(change < 0)]
    return [(float(start), float(end - start)) for start, end in zip(starts, ends, strict=True) if end > start]
