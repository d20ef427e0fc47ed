"""Shared by the scripts that draw figures: the style of `msfp_gen.figures`, and quantities of a run."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from msfp_gen.figures.style import COLOURS, FAINT, INK, MILLI, page, panels
from msfp_gen.scene.top import RigTop

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from reference.friction_circle import Push

    from msfp_gen.results.result import Result

__all__ = [
    "COLOURS",
    "FAINT",
    "INK",
    "MILLI",
    "Array",
    "Runs",
    "closed_form",
    "closed_push",
    "cycle",
    "drawn",
    "panels",
    "ratio",
    "tilts",
]

Array = NDArray[np.float64]
Runs = Callable[[str], "Result"]  # a scene preset's name -> its run


def drawn(path: Path, width: float, height: float) -> AbstractContextManager[Figure]:
    """A figure [inch] in the common style, written to `path` when the block ends without error."""
    return page(width, height, path)


def ratio(result: Result) -> Array:
    """Force on the top support over the axial load, ndarray, shape (T, 3)."""
    load = result.axial_load
    assert load is not None, f"{result.scene.name} has no axial load"
    force: Array = result.history.top_force / load
    return force


def tilts(result: Result) -> Array:
    """Relative tilt arccos(cos psi cos theta) of neighbouring bodies, shape (T, n-1) [rad] (PEER 2017/07, section 4.1)."""
    psi, theta = result.history.tilt_angles[..., 0], result.history.tilt_angles[..., 1]
    delta: Array = np.arccos(np.clip(np.cos(psi) * np.cos(theta), -1.0, 1.0))
    return delta


def cycle(result: Result, back: int = 1) -> slice:
    """Rows of one full cycle of a periodic scene, `back` cycles before its end: 1 is the last."""
    period = float(str(result.scene.motion.metadata["period"]))
    ends = result.scene.end - period * np.array([back, back - 1])
    start, stop = np.searchsorted(result.history.time, ends + 1e-9)
    return slice(int(start) - 1, int(stop))  # from the row at or before the start, so that the loop closes


def closed_form(result: Result, displacements: Array) -> Array:
    """F/N of the massless, rigid-plastic stack pushed from rest to each displacement [m], by friction circles.

    The closed form pushes the top plate to +E1, the runs push the base to +E1. The two are mirror images: displacement
    across the bearing and force on the top support are positive in both.
    """
    from reference.friction_circle import force_at

    push = closed_push(result)
    force: Array = force_at(push, list(displacements)) / push.load
    return force


def closed_push(result: Result) -> Push:
    """The scene of a run on a rig, as input of the closed form."""
    from reference.friction_circle import Push

    top = result.scene.top
    assert isinstance(top, RigTop), f"{result.scene.name} does not stand on a rig"
    return Push(result.scene.bearing, top.axial_load, top.rotational_stiffness)
