"""A film drawn twice: by moving artists over a copy of what stands still, and whole."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from msfp_gen.figures import movie
from msfp_gen.figures.style import page


class Drawn(NamedTuple):
    """pictures: of the film. differs: largest share of pixels in which a whole drawing differs. moving: artists."""

    pictures: list[Any]
    differs: float
    moving: list[Any]
    figure: Any


def drawn_twice(shown: Any, width: float, height: float) -> Drawn:
    """The pictures of a film, compared with drawings of all artists; size of the figure in inches."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    with page(width, height) as figure:
        pictures = list(movie.pictures(figure, shown, None))
    with page(width, height) as figure:
        figure.set_dpi(movie.DOTS)
        canvas = FigureCanvasAgg(figure)
        update, moving = shown.layout(figure)
        canvas.draw()
        figure.set_layout_engine("none")
        differs = []
        for row, picture in enumerate(pictures):
            update(row)
            canvas.draw()
            whole = np.array(canvas.buffer_rgba(), dtype=int)
            differs.append(float((np.abs(whole - picture).max(axis=-1) > 60).mean()))
    return Drawn(pictures, max(differs), list(moving), figure)
