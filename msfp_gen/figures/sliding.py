"""What every surface does over time: how far it has slid, and when it slides at all."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from msfp_gen.figures.style import (
    INK,
    MILLI,
    PALE,
    THIN,
    colour,
    contacts,
    headline,
    label_of,
    mark,
    page,
    strips,
    subscript,
)  # fmt: skip
from msfp_gen.stages import parted, rims_touched, sliding_now, spans

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from msfp_gen.result import Result

BAR, EDGE = 0.56, 0.16  # heights of the bars of sliding and of a rim that pushes, in rows


def plot_sliding(result: Result, path: str | Path | None = None) -> Figure:
    """Sliding of every surface [mm] over time, with its capacity and where it met its rim. Raises InputError."""
    with page(9.5, max(4.8, 1.2 * result.history.surfaces + 1), path) as figure:
        headline(figure, label_of(result))
        draw_sliding(figure, result)
    return figure


def plot_stages(result: Result, path: str | Path | None = None) -> Figure:
    """The stage bar: when each surface slides and when its rim pushes, under the displacement across the bearing.

    `stages.sliding_now` says what counts as sliding. Raises InputError for a path that cannot be written.
    """
    count = result.history.surfaces
    with page(9.5, 2.8 + 0.45 * count, path) as figure:
        headline(figure, label_of(result))
        above, below = strips(figure, 2, height_ratios=(4, 1.2 * count))
        _draw_displacement(above, result)
        draw_bars(below, result)
    return figure


def draw_bars(axes: Axes, result: Result) -> None:
    """One row a surface, top surface uppermost: a bar while it slides, a black edge while its rim pushes, a frame while
    it is open.
    """
    history = result.history
    slides, pushes, opened = sliding_now(history), rims_touched(history), parted(history)
    span = float(history.time[-1] - history.time[0])
    for surface in range(1, history.surfaces + 1):
        flags = slides[:, surface - 1]
        axes.broken_barh([(float(history.time[0]), span)], (surface - BAR / 2, BAR), facecolors=PALE)
        axes.broken_barh(spans(history.time, flags), (surface - BAR / 2, BAR), facecolors=colour(surface))
        gaps = spans(history.time, opened[:, surface - 1])
        axes.broken_barh(gaps, (surface - BAR / 2, BAR), facecolors="white", edgecolors=colour(surface))
        rims = spans(history.time, pushes[:, surface - 1])
        axes.broken_barh(rims, (surface + BAR / 2, EDGE), facecolors=INK)
        share = sum(length for _, length in spans(history.time, flags)) / span if span else 0.0
        axes.annotate(f"{100 * share:.0f} %", (1.008, surface), xycoords=("axes fraction", "data"), va="center",
                      fontsize=8, color=colour(surface))  # fmt: skip
    axes.set_yticks(range(1, history.surfaces + 1), [f"surface {k}" for k in range(1, history.surfaces + 1)])
    axes.set_ylim(0.5, history.surfaces + 0.6)
    axes.grid(visible=False, axis="y")
    notes = [note for note, seen in (("black: on the rim", pushes), ("white: open", opened)) if seen.any()]
    axes.set_title("Which surfaces slide" + (f"  ({', '.join(notes)})" if notes else ""))


def draw_sliding(figure: Any, result: Result) -> None:
    """One strip a surface, top surface uppermost: sliding, capacity, and rims met."""
    history, surfaces = result.history, result.scene.bearing.surfaces
    column = strips(figure, len(surfaces))
    met = contacts(result)
    for index, (axes, surface) in enumerate(zip(column[::-1], surfaces, strict=True)):
        capacity, sliding = surface.capacity * MILLI, history.sliding[:, index] * MILLI
        axes.axhline(capacity, color=INK, linewidth=THIN, linestyle=(0, (5, 3)))
        axes.annotate(f"capacity {capacity:.3g} mm", (1, capacity), xycoords=("axes fraction", "data"), xytext=(0, 4),
                      textcoords="offset points", ha="right", va="bottom", fontsize=7.5, color=INK)  # fmt: skip
        axes.plot(history.time, sliding, color=colour(index + 1))
        for event in met:
            if event.surface == index + 1:
                axes.plot(event.time, capacity, **mark(event))
        axes.set_ylabel(f"s{subscript(index + 1)} [mm]")
        top = 1.38 * max(capacity, sliding.max())
        axes.set_ylim(-0.05 * top, top)  # a surface that is stuck at its centre does not hide on the frame
        axes.locator_params(axis="y", nbins=3)
    column[0].set_title("Sliding of every surface" + ("  (▼ rim met)" if met else ""))
    figure.align_ylabels(column)


def _draw_displacement(axes: Axes, result: Result) -> None:
    from msfp_gen.figures.loops import moving_axes

    history = result.history
    for axis, style in zip(moving_axes(result), ("-", "--"), strict=False):
        axes.plot(history.time, history.displacement[:, axis] * MILLI, color=INK, linestyle=style, linewidth=THIN,
                  label=f"u{subscript(axis + 1)}")  # fmt: skip
    axes.set(title="Displacement across the bearing", ylabel="u [mm]")
    if len(moving_axes(result)) > 1:
        axes.legend(loc="upper right", ncols=2)
