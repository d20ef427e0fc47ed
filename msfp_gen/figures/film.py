"""What a movie shows, its frames as pixels, and their files: .gif by Pillow, .mp4 by ffmpeg.

What stands still is drawn once; each frame moves the other artists over a copy of it.
"""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS = 80  # per inch: 800 pixels wide
WIDE = 10.0  # width of the movie [inch]
PALETTE = 256  # colours of a GIF

Layout = tuple[Callable[[int], None], list[Any]]


class Film(NamedTuple):
    """A movie to be drawn.

    height: of the page [inch]. frames: their number. layout: draws all parts on a figure; returns a function that moves
    them to one frame, and the artists that it changes.
    """

    height: float
    frames: int
    layout: Callable[[Figure], Layout]


def even(height: float) -> float:
    """A height [inch] of an even number of pixels, which video needs."""
    return 2 * round(height * DOTS / 2) / DOTS


def pictures(figure: Figure, film: Film, progress: Callable[[float, float], None] | None) -> Iterator[Array]:
    """The frames as pixels, shape (height, width, 4): what stands still is drawn once, the rest over a copy of it."""
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
