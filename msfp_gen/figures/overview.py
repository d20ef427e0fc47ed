"""The figure of `msfp-gen run --plot`: loops, orbit and sliding on one page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.figures.loops import draw_loop, draw_orbit, moving_axes
from msfp_gen.figures.sliding import draw_sliding
from msfp_gen.figures.style import MILLI, engineering, headline, label_of, page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from msfp_gen.results.run_data import BearingData


def plot_result(result: BearingData, path: str | Path | None = None) -> Figure:
    """Overview of a run: loops along each axis that moves, orbit where both move, sliding of every surface over time.

    The right axis of the loops gives force over axial load; sliding is drawn with its capacity and the rim contacts.

    Args:
        result: the run.
        path: file to write, .png, .svg or .pdf; it appears only when complete. None: none.

    Raises:
        InputError: a path that cannot be written.
    """
    axes = moving_axes(result)
    size = (10.5, max(4.8, 0.95 * result.history.surfaces + 1)) if len(axes) == 1 else (11.5, 8.6)
    with page(*size, path) as figure:
        headline(figure, _title(result))
        ((left, right),) = figure.subfigures(1, 2, squeeze=False, width_ratios=(1.15, 1))
        if len(axes) == 1:
            draw_loop(left.subplots(), result, axes[0])
            draw_sliding(right, result)
        else:
            (above,), (below,) = right.subfigures(2, 1, squeeze=False, height_ratios=(1, 1.25))
            for axis, place in zip(axes, left.subplots(2, 1), strict=True):
                draw_loop(place, result, axis)
            draw_orbit(above.subplots(), result)
            draw_sliding(below, result)
    return figure


def _title(result: BearingData) -> str:
    """Name and peaks; of a failed run also the time it reached."""
    history, load = result.history, result.axial_load
    force = np.hypot(*history.top_force[:, :2].T).max()
    scale = engineering(force, "N")
    lines = [
        label_of(result),
        f"peak displacement {history.horizontal.max() * MILLI:.4g} mm, peak force {force * scale.factor:.4g} "
        f"{scale.unit}",
    ]
    return ", ".join(lines) + (f", F/N = {force / load:.3f}" if load else "")
