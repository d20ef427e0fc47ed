"""The common style of all figures: colours, line widths, units, layout, and writing of the file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.common.output import FIGURE_SUFFIXES, check_output, replacing
from msfp_gen.results.history import Event
from msfp_gen.results.result import Result
from msfp_gen.results.sign import shown_sign

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure


# The palette of Okabe and Ito, which can be distinguished in print and by colour-blind readers.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
INK, FAINT, PALE = "#222222", "#999999", "#E4E4E4"
# Of the bounds of friction, in the order of drawing, so that the nominal curve is on top. Solid lines, since repeated
# cycles would fill dashes.
CASE_COLOURS = {"lower": COLOURS[0], "upper": COLOURS[1], "nominal": INK}
LINE, THIN, HAIR, BOLD = 1.3, 0.9, 0.7, 2.6  # widths [pt]: curves, reference lines, grids, highlights
SMALL = 8.0  # font size of notes in a figure [pt]
FAMILY = "DejaVu Sans"  # comes with matplotlib
STYLE: dict[Any, Any] = {
    "font.family": FAMILY,
    "font.size": 9.5,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelcolor": INK,
    "axes.edgecolor": FAINT,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": PALE,
    "grid.linewidth": HAIR,
    "lines.linewidth": LINE,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.dpi": 130,
    "savefig.dpi": 160,
    "svg.hashsalt": "msfp-gen",  # makes SVG files reproducible
}
MILLI = 1e3  # lengths are drawn in mm, as on drawings of bearings
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"))
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


class Scale(NamedTuple):
    """`factor` turns SI values into numbers of `unit`, such as 1e-3 and "kN"."""

    factor: float
    unit: str


def engineering(values: ArrayLike, unit: str) -> Scale:
    """The prefix of `unit` that brings the largest of `values` (SI) between 1 and 1000."""
    peak = float(np.nanmax(np.abs(values), initial=0.0))
    if not peak:
        return Scale(1.0, unit)
    size, prefix = next(((size, prefix) for size, prefix in PREFIXES if peak >= size), PREFIXES[-1])
    return Scale(1 / size, prefix + unit)


@contextmanager
def page(width: float, height: float, path: str | Path | None = None, name: str = "plot") -> Iterator[Figure]:
    """A figure of `width` and `height` [inch] in the common style; written to `path`, if given, when the block ends.

    After an error in the block nothing is written. Raises InputError that begins with `name` for a path that cannot be
    written, before anything is drawn.
    """
    import matplotlib
    from matplotlib.figure import Figure

    target = None if path is None else check_output(path, FIGURE_SUFFIXES, name)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(width, height), layout="constrained")
        yield figure
        if target is not None:
            with replacing(target) as temporary:
                figure.savefig(temporary, metadata={"Date": None} if target.suffix.lower() == ".svg" else None)


def distinct_colours(count: int) -> list[str]:
    """So many different colours: from the palette, or where it has too few, from a rainbow of even lightness."""
    if count <= len(COLOURS):
        return list(COLOURS[:count])
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(colormaps["turbo"](0.03 + 0.94 * index / (count - 1))) for index in range(count)]


def plain(text: str) -> str:
    """A name from a file as text for matplotlib: $ is escaped, letters that the font does not have become ?."""
    from matplotlib.font_manager import findfont, get_font

    font = get_font(findfont(FAMILY))
    return "".join(letter if font.get_char_index(ord(letter)) else "?" for letter in text).replace("$", r"\$")


def headline(figure: Figure | SubFigure, text: str) -> None:
    """Set the title of a figure, or of a part of it."""
    figure.suptitle(plain(text), fontsize=12, fontweight="bold", color=INK, x=0.01, ha="left")


def panels(figure: Figure, *titles: str, **options: Any) -> list[Axes]:
    """One row of axes with these titles."""
    row: list[Axes] = list(figure.subplots(1, len(titles), squeeze=False, **options)[0])
    for axes, title in zip(row, titles, strict=True):
        axes.set_title(title)
    return row


def strips(figure: Any, count: int, **options: Any) -> list[Axes]:
    """`count` axes below each other with a common time axis, labelled at the last."""
    column: list[Axes] = list(figure.subplots(count, 1, sharex=True, squeeze=False, **options)[:, 0])
    column[-1].set_xlabel("time t [s]")
    column[-1].margins(x=0.01)
    return column


def subscript(number: int) -> str:
    """`number` in subscript digits."""
    return str(number).translate(SUBSCRIPTS)


def displacement(values: ArrayLike) -> Array:
    """Displacement across the bearing [m], as a result holds it, in mm and in the sign of the figures; same shape."""
    return shown_sign().factor * MILLI * np.asarray(values)


def force(values: ArrayLike, scale: Scale) -> Array:
    """Force on the top [N], as a result holds it, in the unit of `scale` and the sign of the figures; same shape."""
    return shown_sign().factor * scale.factor * np.asarray(values)


def displacement_label(axis: int | None = None) -> str:
    """Label of an axis with the displacement along E1 (0) or E2 (1), or with both (None): its sign and unit."""
    return f"u{'' if axis is None else subscript(axis + 1)} = {shown_sign().difference} [mm]"


def colour(surface: int) -> str:
    """The colour of a surface (1..n-1) in all figures."""
    return COLOURS[(surface - 1) % len(COLOURS)]


def label_of(result: Result) -> str:
    """The name of a run for a title; of a failed run with its status and the time it reached."""
    name = result.title
    if result.succeeded:
        return name
    return f"{name}, run failed ({result.status}) at t = {result.history.time[-1]:.4g} s"


def contacts(result: Result) -> list[Event]:
    """All events of rim contact."""
    return [event for event in result.events if event.kind == "rim_contact"]


def first_contacts(result: Result) -> list[Event]:
    """The first contact of every rim; markers of all contacts would cover the loop."""
    return list({event.surface: event for event in reversed(contacts(result))}.values())[::-1]


def mark(event: Event) -> dict[str, Any]:
    """Style of the marker of a rim contact, in the colour of its surface."""
    return {
        "marker": "v",
        "markersize": 5.5,
        "linestyle": "none",
        "zorder": 4,
        "markeredgecolor": "white",
        "markeredgewidth": 0.6,
        "color": colour(event.surface),
    }


def draw_limit(axes: Axes, value: float, text: str) -> None:
    """A dashed line at a value of the vertical axis, with its text above the right end."""
    axes.axhline(value, color=INK, linewidth=THIN, linestyle=(0, (5, 3)))
    axes.annotate(
        text,
        (1, value),
        xycoords=("axes fraction", "data"),
        xytext=(0, 4),
        textcoords="offset points",
        ha="right",
        va="bottom",
        fontsize=7.5,
        color=INK,
    )
