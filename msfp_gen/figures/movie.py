"""Movies of runs; of one bearing: the stack with its loop and the bars of sliding surfaces.

What stands still is drawn once; each frame moves the other artists over a copy of it. Files: .gif by Pillow, .mp4 by
ffmpeg.
"""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import singledispatch
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from msfp_gen.common.aliases import Progress
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.output import check_output, replacing
from msfp_gen.figures.bearing import draw_bars, draw_orbit, moving_axes
from msfp_gen.figures.section import SectionDrawing, limits
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
from msfp_gen.results.geometry import StackSection, sections
from msfp_gen.results.joining import checked_times
from msfp_gen.results.result import Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


BELOW = 2.7  # height of loop and bars [inch]
AROUND, TALLEST = 1.55, 4.5  # height of title, legend and labels of the section, and of the section itself [inch]


def animate(
    result: Any,
    path: str | Path,
    *,
    seconds: float = 8.0,
    frames_per_second: int = 12,
    start: float | None = None,
    end: float | None = None,
    azimuth: float | None = None,
    progress: Progress | None = None,
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
        azimuth: of the plane of the section [rad]; None: the azimuth of the largest displacement. Of a building: of the
            first elevation, the other one is perpendicular to it; None: along E1.
        progress: called with the number of finished frames and of all frames.

    Returns:
        The path.

    Raises:
        InputError: a time outside the run, a bearing of a building, a path that cannot be written, or .mp4 without
            ffmpeg. No file is written.
    """
    target = check_movie(path)
    if frames_per_second < 1:
        raise InputError(f"frames_per_second = {frames_per_second}: give at least 1")
    positive("seconds", seconds)
    rows = result.time
    first, last = (float(rows[0]) if start is None else start), (float(rows[-1]) if end is None else end)
    if first >= last:
        raise InputError(f"start = {first:g} s: give a time before the end of the movie, {last:g} s")
    checked_times(rows, (first, last))
    times = np.linspace(first, last, max(2, round(seconds * frames_per_second)))
    film = film_of(result, times, azimuth)
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


@singledispatch
def film_of(result: Any, times: Array, azimuth: float | None) -> Film:
    """The movie of a run at these times [s]; azimuth: see `animate`."""
    film: Film = result.film(times, azimuth)
    return film


@film_of.register(Result)
def stack_film(result: Result, times: Array, azimuth: float | None) -> Film:
    """The movie of one bearing at these times [s], its section at `azimuth` [rad]."""
    frames = result.at_times(times)
    drawn_sections = sections(frames, azimuth)
    (left, right), (low, high) = limits(drawn_sections)  # drawn over the full width to scale, loop and bars below it
    tall = even(min(TALLEST, (WIDE - 1.0) * (high - low) / (right - left)) + AROUND + BELOW)
    return Film(tall, len(times), lambda figure: _layout(figure, result, frames, drawn_sections))


def _layout(figure: Figure, result: Result, frames: Result, drawn_sections: list[StackSection]) -> MovieLayout:
    """Draw all parts; returns a function that moves them to one row of `frames`, and the artists that it changes."""
    headline(figure, label_of(result))
    height = figure.get_size_inches()[1]
    ((above,), (below,)) = figure.subfigures(2, 1, squeeze=False, height_ratios=(height - BELOW, BELOW))
    stack = above.subplots()
    left, right = below.subplots(1, 2)
    drawing = SectionDrawing(stack, frames, drawn_sections[0])
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


def _loop(axes: Axes, result: Result, frames: Result) -> tuple[Any, Any, Any]:
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


DOTS = 80  # per inch: 800 pixels wide
WIDE = 10.0  # width of the movie [inch]
PALETTE = 256  # colours of a GIF

MovieLayout = tuple[Callable[[int], None], list[Any]]


class Film(NamedTuple):
    """A movie to be drawn.

    height: of the page [inch]. frames: their number. layout: draws all parts on a figure; returns a function that moves
    them to one frame, and the artists that it changes.
    """

    height: float
    frames: int
    layout: Callable[[Figure], MovieLayout]


def even(height: float) -> float:
    """A height [inch] of an even number of pixels, which video needs."""
    return 2 * round(height * DOTS / 2) / DOTS


def pictures(figure: Figure, film: Film, progress: Progress | None) -> Iterator[Array]:
    """The frames as pixels, shape (height, width, 4) [-]: what stands still is drawn once, the rest over a copy."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure.set_dpi(DOTS)
    canvas: Any = FigureCanvasAgg(figure)
    update, moving = film.layout(figure)
    for artist in moving:
        artist.set_animated(True)
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    for row in range(film.frames):
        canvas.restore_region(still)
        update(row)
        for artist in moving:
            artist.draw(canvas.get_renderer())
        yield np.array(canvas.buffer_rgba())
        if progress is not None:
            progress(row + 1, film.frames)


def _write_gif(drawn: Iterator[Array], path: Path, frames_per_second: int) -> None:
    """Write a GIF; all frames have the colours of the first one, which holds every colour of the movie."""
    from PIL import Image

    images = (Image.fromarray(picture[..., :3]) for picture in drawn)
    first = next(images).quantize(PALETTE)
    rest = (image.quantize(palette=first, dither=Image.Dither.NONE) for image in images)
    first.save(path, save_all=True, append_images=rest, duration=1000 / frames_per_second, loop=0)


def _write_mp4(drawn: Iterator[Array], path: Path, frames_per_second: int) -> None:
    """Write an MP4 by ffmpeg, which reads the pixels from a pipe. Raises OSError with its message."""
    from matplotlib.animation import FFMpegWriter

    first = next(drawn)
    size = f"{first.shape[1]}x{first.shape[0]}"
    raw = ["-f", "rawvideo", "-pix_fmt", "rgba", "-s", size, "-framerate", str(frames_per_second), "-i", "pipe:"]
    command = [FFMpegWriter.bin_path(), "-loglevel", "error", *raw, "-vcodec", "h264", "-pix_fmt", "yuv420p", "-y"]
    with subprocess.Popen([*command, str(path)], stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None and process.stderr is not None
        with suppress(BrokenPipeError):
            for picture in chain((first,), drawn):
                process.stdin.write(picture.tobytes())
            process.stdin.close()
        message = process.stderr.read().decode(errors="replace")
    if process.returncode:
        raise OSError(f"ffmpeg failed: {' '.join(message.split())[-200:]}")


WRITERS = {".gif": _write_gif, ".mp4": _write_mp4}
MOVIE_SUFFIXES = tuple(WRITERS)
