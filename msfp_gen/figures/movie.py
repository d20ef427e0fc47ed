"""Movie of the stack in motion, with its loop and the bars of sliding surfaces: .gif by Pillow, .mp4 by ffmpeg."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.output import check_output, replacing
from msfp_gen.errors import InputError
from msfp_gen.figures.loops import draw_orbit, moving_axes
from msfp_gen.figures.section import draw_section, limits
from msfp_gen.figures.sliding import draw_bars
from msfp_gen.figures.style import COLOURS, FAINT, INK, MILLI, THIN, engineering, headline, label_of, page, subscript
from msfp_gen.motions.checks import positive
from msfp_gen.results.geometry.section import sections
from msfp_gen.results.resample import at_times

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from msfp_gen.results.run_data import RunData

MOVIE_SUFFIXES = (".gif", ".mp4")
DOTS = 80  # per inch: 800 x 400 pixels; video needs even numbers


def animate(
    result: RunData,
    path: str | Path,
    *,
    seconds: float = 8.0,
    frames_per_second: int = 12,
    start: float | None = None,
    end: float | None = None,
    azimuth: float | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> Path:
    """Write a movie of a run: the section, the loop (or the orbit where both axes move), and the sliding surfaces.

    Args:
        result: the run.
        path: file to write, .gif or .mp4.
        seconds: length of the movie [s].
        frames_per_second: frame rate [1/s].
        start: first instant of the run that is shown [s]; None: its start.
        end: last instant of the run that is shown [s]; None: its end.
        azimuth: plane of the section [rad]; None: that of the largest displacement.
        progress: called with the number of finished frames and of all frames.

    Returns:
        The path.

    Raises:
        InputError: a time outside the run, a path that cannot be written, or .mp4 without ffmpeg. No file is written.
    """
    target = check_movie(path)
    writer = _writer(target, frames_per_second)
    positive("seconds", seconds)
    rows = result.history.time
    first, last = (float(rows[0]) if start is None else start), (float(rows[-1]) if end is None else end)
    if first >= last:
        raise InputError(f"start = {first:g} s: give a time before the end of the movie, {last:g} s")
    at_times(result, (first, last))  # raises InputError for a time outside the run
    frames = at_times(result, np.linspace(first, last, max(2, round(seconds * frames_per_second))))
    with page(10.0, 5.0) as figure, replacing(target) as temporary, writer.saving(figure, temporary, DOTS):
        update = _layout(figure, result, frames, azimuth)
        for row in range(len(frames.history.time)):
            update(row)
            writer.grab_frame()
            if progress is not None:
                progress(row + 1, len(frames.history.time))
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


def _writer(target: Path, frames_per_second: int) -> Any:
    """The writer of matplotlib for this kind of file."""
    from matplotlib.animation import FFMpegWriter, PillowWriter

    if frames_per_second < 1:
        raise InputError(f"frames_per_second = {frames_per_second}: give at least 1")
    if target.suffix.lower() == ".gif":
        return PillowWriter(fps=frames_per_second)
    return FFMpegWriter(fps=frames_per_second, codec="h264", extra_args=["-pix_fmt", "yuv420p"])


def _layout(figure: Figure, result: RunData, frames: RunData, azimuth: float | None) -> Callable[[int], None]:
    """Draw the parts that do not move; returns a function that draws one row of `frames`."""
    found = sections(frames, azimuth)
    headline(figure, label_of(result))
    ((left, right),) = figure.subfigures(1, 2, squeeze=False, width_ratios=(1.1, 1))
    ((above,), (below,)) = right.subfigures(2, 1, squeeze=False, height_ratios=(1.5, 1))
    stack, bars = left.subplots(), below.subplots()
    pointers = [_loop(above.subplots(), result, frames)]
    draw_bars(bars, result)
    bars.set_xlabel("time t [s]")
    cursor = bars.axvline(frames.history.time[0], color=INK, linewidth=THIN)
    wide, high = limits(found)

    def update(row: int) -> None:
        stack.clear()
        draw_section(stack, frames, found[row], row)
        stack.set(xlim=wide, ylim=high)
        stack.legend(loc="lower center", bbox_to_anchor=(0.5, 1.13), ncols=2)
        for dot, x, y in pointers:
            dot.set_data([x[row]], [y[row]])
        cursor.set_xdata([frames.history.time[row]] * 2)

    update(0)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # the axes keep their places in all frames
    return update


def _loop(axes: Axes, result: RunData, frames: RunData) -> tuple[Any, Any, Any]:
    """Draw the loop, or the orbit where both axes move; returns a marker and its coordinates in every frame."""
    moving = moving_axes(result)
    if len(moving) > 1:
        draw_orbit(axes, result)
        x, y = (frames.history.displacement[:, :2] * MILLI).T
    else:
        (axis,) = moving
        scale = engineering(result.history.top_force[:, :2], "N")
        u, force = result.history.displacement[:, axis] * MILLI, result.history.top_force[:, axis] * scale.factor
        axes.plot(u, force, color=FAINT, linewidth=THIN)
        axes.set(
            title="Hysteresis loop",
            xlabel=f"u{subscript(axis + 1)} [mm]",
            ylabel=f"F{subscript(axis + 1)} [{scale.unit}]",
        )
        x, y = frames.history.displacement[:, axis] * MILLI, frames.history.top_force[:, axis] * scale.factor
    (dot,) = axes.plot([x[0]], [y[0]], marker="o", markersize=7, color=COLOURS[1], linestyle="none", zorder=6)
    return dot, x, y
