"""Which surfaces slide, which are in contact with their rims, and which are separated.

A surface slides where its plastic slip, its slip less the elastic part d_y (Y, Z) of the Bouc-Wen equations (2.94), is
at least a certain share of the slip of all surfaces together. Surfaces that deform elastically, in friction or at a
rim, do not slide. The definition has two forms:

- Over an interval of a motion in one direction, the increments of plastic slip are known; the share is `SHARE`.
- At one instant, plastic slip is slip with mobilised friction, |(Y, Z)| >= `MOBILISED`, that opposes it. The share is
  `INSTANT_SHARE`, which is larger, because the slip velocity also contains the elastic motion of a compressed rim.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from msfp_gen.common.arrays import Array, Flags
from msfp_gen.results.history import BearingRows, Event, History

SHARE = 0.05  # of the slip of all surfaces together, over an interval
INSTANT_SHARE = 0.1  # the same at one instant
MOBILISED = 0.9  # |(Y, Z)|; in steady sliding it is 1 (2.94)


def slip_shares(slip: Array) -> Array:
    """Share of each surface in the slip of all, same shape as `slip`; 0 where no surface slips.

    slip: magnitudes of increments [m] or velocities [m/s], ndarray, shape (..., n-1).
    """
    total = slip.sum(axis=-1, keepdims=True)
    shares: Array = np.divide(slip, total, out=np.zeros_like(slip), where=total > 0)
    return shares


def slides_over(slip: Array, plastic: Array) -> Flags:
    """Whether each surface slides over intervals of a motion in one direction, ndarray of bool, shape (..., n-1).

    slip, plastic: increments of slip along the motion, and of its plastic part, ndarray, shape (..., n-1) [m].
    """
    total = np.abs(slip).sum(axis=-1, keepdims=True)
    flags: Flags = (total > 0) & (np.abs(plastic) >= SHARE * total)
    return flags


def sliding_surfaces(history: History) -> Flags:
    """Whether each surface slides in each row, ndarray of bool, shape (T, n-1); never while it is separated."""
    state, velocity = history.friction_state, np.where(history.separated[..., None], 0.0, history.slip_velocity)
    mobilised = np.linalg.norm(state, axis=-1) >= MOBILISED
    opposes = np.sum(state * velocity, axis=-1) > 0  # friction is -mu N (Y, Z)
    flags: Flags = mobilised & opposes & (slip_shares(np.linalg.norm(velocity, axis=-1)) >= INSTANT_SHARE)
    return flags


def rims_in_contact(history: BearingRows) -> Flags:
    """Whether the rim of each surface is in contact in each row, ndarray of bool, shape (T, n-1)."""
    flags: Flags = history.rim_force != 0
    return flags


def intervals(time: Array, flags: Flags) -> list[tuple[float, float]]:
    """Intervals of time in which `flags` hold, as (start, length) [s].

    time: ndarray, shape (T,) [s]. flags: ndarray of bool, shape (T,). Each row represents the time from half way to the
    row before it to half way to the row after it.
    """
    edges = np.concatenate([time[:1], (time[1:] + time[:-1]) / 2, time[-1:]])
    change = np.diff(np.concatenate([[False], flags, [False]]).astype(int))
    starts, ends = edges[np.flatnonzero(change > 0)], edges[np.flatnonzero(change < 0)]
    return [(float(start), float(end - start)) for start, end in zip(starts, ends, strict=True) if end > start]


def openings(time: Array, lift: Array, events: Iterable[Event]) -> list[tuple[float, float]]:
    """Times in which a surface is open, as (start, length) [s]: by its events where there are some, else by the rows.

    time, lift: ndarrays, shape (T,) [s], [m]. events: of the surface.
    """
    changes = [event for event in events if event.kind in ("lift_off", "landing")]
    if not changes:
        return intervals(time, lift > 0) if lift.any() else []
    spells, start = [], float(time[0]) if lift[0] > 0 else None
    for event in changes:
        if event.kind == "lift_off":
            start = event.time if start is None else start
        elif start is not None:
            spells.append((start, event.time - start))
            start = None
    return spells if start is None else [*spells, (start, float(time[-1]) - start)]


def open_times(history: BearingRows, events: Iterable[Event]) -> list[list[tuple[float, float]]]:
    """The openings of every surface, bottom first."""
    of_surfaces: list[list[Event]] = [[] for _ in range(history.lift.shape[1] + 1)]
    for event in events:
        of_surfaces[event.surface].append(event)
    return [openings(history.time, lift, own) for lift, own in zip(history.lift.T, of_surfaces[1:], strict=True)]


def merged(spells: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Times that lie in any of several, as (start, length) [s]."""
    union: list[tuple[float, float]] = []
    for start, length in sorted(spells):
        if union and start <= sum(union[-1]):
            first = union[-1][0]
            union[-1] = (first, max(sum(union[-1]), start + length) - first)
        else:
            union.append((start, length))
    return union
