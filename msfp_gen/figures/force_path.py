"""Path of the force through the stack: its lines at one instant, and the eccentricity of every contact over time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.figures.section import draw_circles, draw_section, peak_time
from msfp_gen.figures.style import MILLI, colour, draw_limit, headline, label_of, page, strips, subscript
from msfp_gen.results.geometry.outline import slider_radius
from msfp_gen.results.geometry.section import sections
from msfp_gen.results.geometry.shape import friction_circles, poses
from msfp_gen.results.resample import at_times
from msfp_gen.results.sliding import separated

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from msfp_gen.results.run_data import RunData


def plot_force_path(result: RunData, path: str | Path | None = None, *, time: float | None = None) -> Figure:
    """Lines of force with the friction circles at one instant, and the eccentricity of every contact over time [mm].

    A slider would tip where its contact lies beyond the edge of its face, which only models with `effects.uplift`
    describe (docs/model.md, choice 11; docs/uplift.md). Nothing is drawn while a surface is separated.

    Args:
        result: the run.
        path: file to write, .png, .svg or .pdf; None: none.
        time: instant of the lines of force [s]; None: at the largest displacement.

    Raises:
        InputError: a time outside the run, or a path that cannot be written.
    """
    then = at_times(result, peak_time(result) if time is None else time)
    (section,) = sections(then)
    with page(12.5, max(6.0, 1.3 * result.history.surfaces + 1), path) as figure:
        headline(figure, label_of(result))
        ((left, right),) = figure.subfigures(1, 2, squeeze=False, width_ratios=(1, 1.7))
        axes = left.subplots()
        draw_section(axes, then, section)
        draw_circles(axes, section, friction_circles(then)[0])
        _draw_offsets(right, result)
    return figure


def eccentricity(result: RunData) -> Array:
    """Distance of every contact from the axis of its slider [m], shape (T, n-1); NaN while the surface is separated."""
    where, bearing = poses(result), result.scene.bearing
    sliders = [bearing.slider(surface) for surface in range(bearing.layout.surfaces)]
    axes = where.basis[:, sliders, 2]
    arm = where.contact - where.centre
    off: Array = np.linalg.norm(arm - np.sum(arm * axes, axis=-1, keepdims=True) * axes, axis=-1)
    return np.where(separated(result.history), np.nan, off)


def _draw_offsets(figure: SubFigure, result: RunData) -> None:
    """One panel per surface, top surface uppermost, with the radius of the slider's face."""
    bearing, off = result.scene.bearing, eccentricity(result) * MILLI
    column = strips(figure, bearing.layout.surfaces)
    for index, axes in enumerate(column[::-1]):
        edge = slider_radius(bearing, index) * MILLI
        known = bool(bearing.slider_rim_radius(index))
        axes.plot(result.history.time, off[:, index], color=colour(index + 1))
        axes.set_ylabel(f"e{subscript(index + 1)} [mm]")
        axes.set_ylim(0, 1.3 * max(edge if known else 0.0, np.nan_to_num(off[:, index]).max()) or 1.0)
        axes.locator_params(axis="y", nbins=3)
        if known:
            draw_limit(axes, edge, f"edge of the slider {edge:.3g} mm")
    column[0].set_title("Eccentricity e of the contacts")
    figure.align_ylabels(column)
