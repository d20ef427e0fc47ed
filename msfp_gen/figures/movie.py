"""Movies of runs: a stack with its loop and the bars of sliding surfaces, or a building on its bearings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.buildings.result import BuildingResult
from msfp_gen.common.arrays import Array
from msfp_gen.common.output import check_output, replacing
from msfp_gen.errors import InputError
from msfp_gen.figures.building_movie import building_film
from msfp_gen.figures.film import WIDE, WRITERS, Film, Layout, even, pictures
from msfp_gen.figures.loops import draw_orbit, moving_axes
from msfp_gen.figures.section import draw_section, limits
from msfp_gen.figures.sliding import draw_bars
from msfp_gen.figures.style import (
    COLOURS,
    FAINT,
    INK,
    THIN,
    displacement,
    displacement_label,
    engineering,
    force,
    headline,
    label_of,
    page,
    subscript,
)
from msfp_gen.motions.checks import positive
from msfp_gen.results.geometry.section import Section, sections
from msfp_gen.results.resample import at_times, checked_times

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from msfp_gen.results.run_data import RunData

MOVIE_SUFFIXES = tuple(WRITERS)
BELOW = 2.7  # height of loop and bars [inch]
AROUND, TALLEST = 1.55, 4.5  # height of title, legend and labels of the section, and of the section itself [inch]


def animate(
    result: RunData | BuildingResult,
    path: str | Path,
    *,
    seconds: float = 8.0,
    frames_per_second: int = 12,
    start: float | None = None,
    end: float | None = None,
    azimuth: float | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> Path:
    """Write a movie of a run.

    Of one bearing: the section, the loop (or the orbit where both axes move), and the sliding surfaces. Of a building:
    the frame on its bearings in two elevations, the plan with the paths of the bearings, the loops of the isolation
    system, and the axial forces; displacements are magnified by the factor that the title states.

    Args:
        result: the run.
        path: file to write, .gif or .mp4.
        seconds: length of the movie [s].
        frames_per_second: frame rate [1/s].
        start: first instant of the run that is shown [s]; None: its start.
        end: last instant of the run that is shown [s]; None: its end.
        azimuth: of the plane of the section [rad]; None: that of the largest displacement. Of a building: of the first
            elevation, the other one is perpendicular to it; None: along E1.
        progress: called with the number of finished frames and of all frames.

    Returns:
        The path.

    Raises:
        InputError: a time outside the run, a path that cannot be written, or .mp4 without ffmpeg. No file is written.
    """
    target = check_movie(path)
    if frames_per_second < 1:
        raise InputError(f"frames_per_second = {frames_per_second}: give at least 1")
    positive("seconds", seconds)
    rows = result.time if isinstance(result, BuildingResult) else result.history.time
    first, last = (float(rows[0]) if start is None else start), (float(rows[-1]) if end is None else end)
    if first >= last:
        raise InputError(f"start = {first:g} s: give a time before the end of the movie, {last:g} s")
    checked_times(rows, (first, last))
    times = np.linspace(first, last, max(2, round(seconds * frames_per_second)))
    if isinstance(result, BuildingResult):
        film = building_film(result, times, azimuth)
    else:
        film = stack_film(result, times, azimuth)
    with page(WIDE, film.height) as figure, replacing(target) as temporary:
        WRITERS[target.suffix.lower()](pictures(figure, film, progress), temporary, frames_per_second)
    return target


def check_movie(path: str | Path, name: str = "movie") -> Path:
    """`path` if a movie can be written to it; else raises InputError that begins with `name`, also without ffmpeg."""
    from matplotlib.animation import FFMpegWriter

    target = check_output(path, MOVIE_SUFFIXES, name)
    if target.suffix.lower() == ".mp4" and not FFMpegWriter.isAvailable():
        raise InputError(
            f"{name} = {str(target)!r}: .mp4 needs ffmpeg, which is not on the path; install it or give .gif"
        )
    return target


def stack_film(result: RunData, times: Array, azimuth: float | None) -> Film:
    """The movie of one bearing at these times [s], its section at `azimuth` [rad]."""
    frames = at_times(result, times)
    drawn_sections = sections(frames, azimuth)
    return Film(_height(drawn_sections), len(times), lambda figure: _layout(figure, result, frames, drawn_sections))


def _height(drawn_sections: list[Section]) -> float:
    """Height of the movie [inch]: the section over its full width to scale, the loop and the bars below it."""
    (left, right), (low, high) = limits(drawn_sections)
    return even(min(TALLEST, (WIDE - 1.0) * (high - low) / (right - left)) + AROUND + BELOW)


def _layout(figure: Figure, result: RunData, frames: RunData, drawn_sections: list[Section]) -> Layout:
    """Draw all parts; returns a function that moves them to one row of `frames`, and the artists that it changes."""
    headline(figure, label_of(result))
    height = figure.get_size_inches()[1]
    ((above,), (below,)) = figure.subfigures(2, 1, squeeze=False, height_ratios=(height - BELOW, BELOW))
    stack = above.subplots()
    left, right = below.subplots(1, 2)
    drawing = draw_section(stack, frames, drawn_sections[0])
    wide, high = limits(drawn_sections)
    stack.set(xlim=wide, ylim=high)
    legend = above.legend(handles=drawing.entries, loc="outside upper center", ncols=3)
    dot, x, y = _loop(left, result, frames)
    draw_bars(right, result)
    right.set_xlabel("time t [s]")
    cursor = right.axvline(frames.history.time[0], color=INK, linewidth=THIN)

    def update(row: int) -> None:
        drawing.update(drawn_sections[row], row)
        shown = zip(legend.get_texts(), legend.get_lines(), drawing.entries, strict=True)
        for text, line, entry in shown:
            text.set_text(entry.get_label())
            line.set_linewidth(entry.get_linewidth())
        dot.set_data([x[row]], [y[row]])
        cursor.set_xdata([frames.history.time[row]] * 2)

    return update, [*drawing.artists, legend, dot, cursor]


def _loop(axes: Axes, result: RunData, frames: RunData) -> tuple[Any, Any, Any]:
    """Draw the loop, or the orbit where both axes move; returns a marker and its coordinates in every frame."""
    moving = moving_axes(result)
    if len(moving) > 1:
        draw_orbit(axes, result)
        x, y = displacement(frames.history.displacement[:, :2]).T
    else:
        (axis,) = moving
        scale = engineering(result.history.top_force[:, :2], "N")
        u, loads = displacement(result.history.displacement[:, axis]), force(result.history.top_force[:, axis], scale)
        axes.plot(u, loads, color=FAINT, linewidth=THIN)
        axes.set(
            title="Hysteresis loop",
            xlabel=displacement_label(axis),
            ylabel=f"F{subscript(axis + 1)} [{scale.unit}]",
        )
        x, y = displacement(frames.history.displacement[:, axis]), force(frames.history.top_force[:, axis], scale)
    (dot,) = axes.plot([x[0]], [y[0]], marker="o", markersize=7, color=COLOURS[1], linestyle="none", zorder=6)
    return dot, x, y
