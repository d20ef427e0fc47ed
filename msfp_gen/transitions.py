"""Where a monotonic run passes from one stage of motion to the next (report section 4.1, Table 4.2).

A surface has stopped where its share of all sliding, over a window of displacement, falls below a threshold; a rim is
met where the runtime located its first contact.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.history import Array, History

if TYPE_CHECKING:
    from msfp_gen.result import Result

WINDOW = 2e-4  # displacement over which shares of sliding are taken [m]
SHARE = 0.05  # a surface that does less than this share of all sliding has stopped
MONOTONIC = 1e-3  # way back or aside, over the largest displacement, that still counts as a monotonic run
STOPS = {"u_star": 2, "u_star_star": 3}  # surfaces of a four-surface stack that stop (Table 4.2)
SYMBOLS = {"u_star": "u*", "u_star_star": "u**"}  # as the report writes them; the others are written as they are
RIMS = (1, 4)  # and those whose rims are met


def is_monotonic(result: Result) -> bool:
    """Whether the run pushed the bearing one way: its motion is a ramp, or the displacement never came back."""
    if result.scene.motion.metadata.get("source") == "ramp":
        return True
    along, aside = _path(result.history)
    peak = along.max(initial=0.0)
    back = (np.maximum.accumulate(along) - along).max(initial=0.0)
    return bool(peak > WINDOW and max(back, np.abs(aside).max()) <= MONOTONIC * peak)


def transitions(result: Result, axial_load: float | None) -> dict[str, float | None]:
    """Displacements [m], and forces over the axial load, at which the stages of a monotonic run change.

    Four surfaces: u_star, u_star_star (surfaces 2, 3 stop), u_dr1, u_dr4, F_dr1, F_dr4 (rims 1, 4 met), Table 4.2.
    Other stacks: u_dr and F_dr of every surface. What did not happen is None. `resolution` [m] is the widest spacing of
    rows about the stops found, which are known no better than that; rims are located exactly.
    """
    history = result.history
    four = history.surfaces == 4
    found: dict[str, float | None] = {}
    if four:
        found |= {name: stopping_displacement(history, surface) for name, surface in STOPS.items()}
    for surface in RIMS if four else range(1, history.surfaces + 1):
        displacement, force = _first_contact(result, surface)
        found[f"u_dr{surface}"] = displacement
        found[f"F_dr{surface}"] = None if force is None or not axial_load else force / axial_load
    if four:
        found["resolution"] = max((_spacing(history, u) for u in map(found.get, STOPS) if u is not None), default=None)
    return found


def stopping_displacement(history: History, surface: int, window: float = WINDOW, share: float = SHARE) -> float | None:
    """Displacement [m] at which `surface` (1..n-1), having slid, stops: its share falls below `share` and stays there.

    Shares are taken over `window` [m], centred, of displacement; a share must stay below over one more window, so that
    a quiver is no stop. None where the surface never slides or never stops.
    """
    along, _ = _path(history)
    rows = np.flatnonzero(np.diff(np.maximum.accumulate(along), prepend=-1.0) > 0)  # the way out, strictly rising
    u, sliding = along[rows], history.sliding[rows]
    if len(u) < 2 or u[-1] - u[0] <= window:
        return None
    per_window = 20
    centres = np.arange(u[0] + window / 2, u[-1] - window / 2, window / per_window)
    below = _share(u, sliding, surface, centres, window) - share
    slides = np.cumsum(below >= 0) > 0
    stays = np.array([(below[i : i + per_window] < 0).all() for i in range(len(below))])
    stopped = np.flatnonzero(slides & stays)
    if not stopped.size:
        return None
    i = int(stopped[0])  # below[i - 1] >= 0 > below[i]
    return float(np.interp(0.0, below[[i, i - 1]], centres[[i, i - 1]]))


def _share(u: Array, sliding: Array, surface: int, centres: Array, window: float) -> Array:
    """Share of `surface` in all sliding over a window about each centre; none where nothing slides."""
    increments = np.array(
        [np.abs(np.interp(centres + window / 2, u, s) - np.interp(centres - window / 2, u, s)) for s in sliding.T]
    )
    total = increments.sum(axis=0)
    share: Array = np.divide(increments[surface - 1], total, out=np.zeros_like(total), where=total > 1e-6 * window)
    return share


def _spacing(history: History, displacement: float) -> float:
    """Distance [m] between the rows on either side of a displacement on the way out."""
    out = np.maximum.accumulate(_path(history)[0])
    row = int(np.searchsorted(out, displacement))
    return float(out[row] - out[row - 1])


def _path(history: History) -> tuple[Array, Array]:
    """Horizontal displacement along and across the direction of its largest value, each shape (T,), [m]."""
    horizontal = history.displacement[:, :2]
    e1, e2 = _direction(history)
    along: Array = horizontal @ np.array([e1, e2])
    return along, horizontal @ np.array([-e2, e1])


def _direction(history: History) -> Array:
    """Unit vector towards the largest horizontal displacement; E1 where the bearing did not move."""
    peak: Array = history.displacement[history.peak_row, :2]
    size = float(np.hypot(*peak))
    return np.asarray(peak / size) if size else np.array([1.0, 0.0])


def _first_contact(result: Result, surface: int) -> tuple[float, float] | tuple[None, None]:
    """Displacement [m] and force [N] along the run's direction where the rim of `surface` was first met."""
    direction = _direction(result.history)
    for event in result.events:
        if event.kind == "rim_contact" and event.surface == surface:
            return float(event.displacement[:2] @ direction), float(event.top_force[:2] @ direction)
    return None, None
