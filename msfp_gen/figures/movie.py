"""The stack moving, beside its loop and the bars of sliding: .gif by Pillow, .mp4 by ffmpeg."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.errors import InputError
from msfp_gen.figures.loops import draw_orbit, moving_axes
from msfp_gen.figures.section import draw_section, limits
from msfp_gen.figures.sliding import draw_bars
from msfp_gen.figures.style import COLOURS, FAINT, INK, MILLI, THIN, engineering, headline, label_of, page, subscript
from msfp_gen.motion_checks import positive
from msfp_gen.output import check_output, replacing
from msfp_gen.resample import at_times
from msfp_gen.section import sections

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from msfp_gen.result import Result

MOVIE_SUFFIXES = (".gif", ".mp4")
DOTS = 80  # per inch: 800 x 400 pixels, even numbers as video wants them


def animate(
    result: Result,
    path: str | Path,
    *,
    seconds: float = 8.0,
    frames_per_second: int = 12,
    start: float | None = None,
    end: float | None = None,
    azimuth: float | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> Path:
    """Write a movie of `seconds` of the run from `start` to `end` [s] (None: its own) to `path`, .gif or .mp4.

    The section in the plane along `azimuth` [rad] (None: of the largest displacement) moves beside the loop, the orbit
    where both axes move, and the bars of sliding. `progress` takes frames done and frames in all. Raises InputError: a
    time outside the run, a path that cannot be written, or .mp4 without ffmpeg; nothing is written then.
    """
    target = check_movie(path)
    writer = _writer(target, frames_per_second)
    positive("seconds", seconds)
    rows = result.history.time
    first, last = (float(rows[0]) if start is None else start), (float(rows[-1]) if end is None else end)
    if first >= last:
        raise InputError(f"start = {first:g} s: give a time before the end of the movie, {last:g} s")
    at_times(result, (first, last))  # refused here, in the words that were given
    frames = at_times(result, np.linspace(first, last, max(2, round(seconds * frames_per_second))))
    with page(10.0, 5.0) as figure, replacing(target) as temporary, writer.saving(figure, temporary, DOTS):
        update = _stage(figure, result, frames, azimuth)
        for row in range(len(frames.history.time)):
            update(row)
            writer.grab_frame()
            if progress is not None:
                progress(row + 1, len(frames.history.time))
    return target


def check_movie(path: str | Path, name: str = "movie") -> Path:
    """`path` if a movie can be put there; InputError that begins with `name` otherwise, also for want of ffmpeg."""
    from matplotlib.animation import FFMpegWriter

    target = check_output(path, MOVIE_SUFFIXES, name)
    if target.suffix.lower() == ".mp4" and not FFMpegWriter.isAvailable():
        raise InputError(
            f"{name} = {str(target)!r}: .mp4 needs ffmpeg, which is not on the path; install it or give .gif"
        )
    return target


def _writer(target: Path, frames_per_second: int) -> Any:
    """What makes the file."""
    from matplotlib.animation import FFMpegWriter, PillowWriter

    if frames_per_second < 1:
        raise InputError(f"frames_per_second = {frames_per_second}: give at least 1")
    if target.suffix.lower() == ".gif":
        return PillowWriter(fps=frames_per_second)
    return FFMpegWriter(fps=frames_per_second, codec="h264", extra_args=["-pix_fmt", "yuv420p"])


def _stage(figure: Figure, result: Result, frames: Result, azimuth: float | None) -> Callable[[int], None]:
    """Lay out the page; what moves it to a row of `frames`."""
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
    figure.set_layout_engine("none")  # the page keeps still
    return update


def _loop(axes: Axes, result: Result, frames: Result) -> tuple[Any, Any, Any]:
    """The loop, or the orbit where both axes move, with a dot and the places it takes."""
    moving = moving_axes(result)
    if len(moving) > 1:
        draw_orbit(axes, result)
        x, y = (frames.history.displacement[:, :2] * MILLI).T
    else:
        (axis,) = moving
        scale = engineering(result.history.top_force[:, :2], "N")
        u, force = result.history.displacement[:, axis] * MILLI, result.history.top_force[:, axis] * scale.factor
        axes.plot(u, force, color=FAINT, linewidth=THIN)
        axes.set(title="Loop", xlabel=f"u{subscript(axis + 1)} [mm]", ylabel=f"F{subscript(axis + 1)} [{scale.unit}]")
        x, y = frames.history.displacement[:, axis] * MILLI, frames.history.top_force[:, axis] * scale.factor
    (dot,) = axes.plot([x[0]], [y[0]], marker="o", markersize=7, color=COLOURS[1], linestyle="none", zorder=6)
    return dot, x, y
