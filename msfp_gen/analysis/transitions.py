"""Transitions between the sliding regimes of a monotonic run (PEER 2017/07, section 4.1, Table 4.2).

A surface has stopped sliding where its share of all sliding, over a window of displacement, falls below a threshold.
First contact with a rim is located by the runtime as an event.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.results.history import BearingRows
from msfp_gen.results.sliding import SHARE, slip_shares

if TYPE_CHECKING:
    from msfp_gen.results.run_data import BearingData

WINDOW = 2e-4  # displacement over which shares of sliding are taken [m]
MONOTONIC = 1e-3  # largest reverse or transverse motion of a monotonic run, over the largest displacement
STOPS = {"u_star": 2, "u_star_star": 3}  # surfaces of a four-surface stack that stop sliding (Table 4.2)
RIMS = (1, 4)  # surfaces of a four-surface stack whose rims are met (Table 4.2)
SYMBOLS = {"u_star": "u*", "u_star_star": "u**"}  # keys that PEER 2017/07 writes differently


def is_monotonic(result: BearingData) -> bool:
    """Whether the run is a monotonic push: its motion is a ramp, or the displacement has no reversal.

    Never that of a bearing below a building, whose first contacts of rims are not located.
    """
    if result.number:
        return False
    if result.scene.motion.metadata.get("source") == "ramp":
        return True
    along, transverse = result.history.path
    peak = along.max(initial=0.0)
    reverse = (np.maximum.accumulate(along) - along).max(initial=0.0)
    return bool(peak > WINDOW and max(reverse, np.abs(transverse).max()) <= MONOTONIC * peak)


def transitions(result: BearingData) -> dict[str, float | None]:
    """Displacements [m], and forces over the axial load [-], at which the sliding regimes of a monotonic run change.

    Stacks of four surfaces have u_star, u_star_star (surfaces 2, 3 stop sliding) and u_dr1, u_dr4, F_dr1, F_dr4 (first
    contact of rims 1, 4), Table 4.2; other stacks have u_dr and F_dr of every surface. A value is None if the
    transition does not occur. `resolution` [m] is the largest spacing of rows at u_star and u_star_star, which limits
    their accuracy; rim contacts are located by the runtime.
    """
    history, axial_load = result.history, result.axial_load
    four = history.surfaces == 4
    values: dict[str, float | None] = {}
    if four:
        values |= {name: stopping_displacement(history, surface) for name, surface in STOPS.items()}
    for surface in RIMS if four else range(1, history.surfaces + 1):
        displacement, force = _first_contact(result, surface)
        values[f"u_dr{surface}"] = displacement
        values[f"F_dr{surface}"] = None if force is None or not axial_load else force / axial_load
    if four:
        values["resolution"] = max(
            (_spacing(history, u) for u in map(values.get, STOPS) if u is not None), default=None
        )
    return values


def stopping_displacement(history: BearingRows, surface: int, window: float = WINDOW) -> float | None:
    """Displacement [m] at which `surface` (1..n-1) stops sliding; None if it never slides or never stops.

    It stops where its share of all sliding, taken over a centred `window` of displacement [m], falls below `SHARE` and
    stays below over one more window, so that a short vibration does not count.
    """
    along, _ = history.path
    rows = np.flatnonzero(np.diff(np.maximum.accumulate(along), prepend=-1.0) > 0)  # new maxima: strictly increasing
    u, sliding = along[rows], history.sliding[rows]
    if len(u) < 2 or u[-1] - u[0] <= window:
        return None
    per_window = 20
    centres = np.arange(u[0] + window / 2, u[-1] - window / 2, window / per_window)
    ends = (np.column_stack([np.interp(centres + half, u, s) for s in sliding.T]) for half in (-window / 2, window / 2))
    below = slip_shares(np.abs(np.subtract(*ends)))[:, surface - 1] - SHARE
    slides = np.cumsum(below >= 0) > 0
    stays = np.array([(below[i : i + per_window] < 0).all() for i in range(len(below))])
    stopped = np.flatnonzero(slides & stays)
    if not stopped.size:
        return None
    i = int(stopped[0])  # below[i - 1] >= 0 > below[i]
    return float(np.interp(0.0, below[[i, i - 1]], centres[[i, i - 1]]))


def _spacing(history: BearingRows, displacement: float) -> float:
    """Difference of displacement [m] between the rows on either side of `displacement` [m]."""
    maxima = np.maximum.accumulate(history.path[0])
    row = int(np.searchsorted(maxima, displacement))
    return float(maxima[row] - maxima[row - 1])


def _first_contact(result: BearingData, surface: int) -> tuple[float, float] | tuple[None, None]:
    """Displacement [m] and force [N] along the direction of the run at the first contact with the rim of `surface`."""
    direction = result.history.direction
    for event in result.events:
        if event.kind == "rim_contact" and event.surface == surface:
            return float(event.displacement[:2] @ direction), float(event.top_force[:2] @ direction)
    return None, None
