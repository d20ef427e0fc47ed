"""Sliding displacement of every surface over time, and the intervals in which it slides."""

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
    displacement,
    displacement_label,
    draw_limit,
    headline,
    label_of,
    mark,
    page,
    strips,
    subscript,
)
from msfp_gen.results.sliding import intervals, rims_in_contact, separated, sliding_surfaces

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from msfp_gen.results.run_data import BearingData, RunData

BAR, EDGE = 0.56, 0.16  # heights of the bars for sliding and for rim contact, in rows


def plot_sliding(result: BearingData, path: str | Path | None = None) -> Figure:
    """Sliding displacement of every surface [mm] over time, with its capacity and the rim contacts.

    Raises InputError for a path that cannot be written.
    """
    with page(9.5, max(4.8, 1.2 * result.history.surfaces + 1), path) as figure:
        headline(figure, label_of(result))
        draw_sliding(figure, result)
    return figure


def plot_stages(result: RunData, path: str | Path | None = None) -> Figure:
    """Sliding regimes over time: when each surface slides or touches its rim, below the displacement of the bearing.

    `results.sliding` defines when a surface slides. Raises InputError for a path that cannot be written.
    """
    count = result.history.surfaces
    with page(9.5, 2.8 + 0.45 * count, path) as figure:
        headline(figure, label_of(result))
        above, below = strips(figure, 2, height_ratios=(4, 1.2 * count))
        _draw_displacement(above, result)
        draw_bars(below, result)
    return figure


def draw_bars(axes: Axes, result: RunData) -> None:
    """One row per surface, top surface uppermost: a bar while it slides, a black edge during rim contact, a white bar
    while it is separated. The share of time in which it slides stands to the right.
    """
    history = result.history
    slides, on_rim, apart = sliding_surfaces(history), rims_in_contact(history), separated(history)
    span = float(history.time[-1] - history.time[0])
    for surface in range(1, history.surfaces + 1):
        flags = slides[:, surface - 1]
        axes.broken_barh([(float(history.time[0]), span)], (surface - BAR / 2, BAR), facecolors=PALE)
        axes.broken_barh(intervals(history.time, flags), (surface - BAR / 2, BAR), facecolors=colour(surface))
        gaps = intervals(history.time, apart[:, surface - 1])
        axes.broken_barh(gaps, (surface - BAR / 2, BAR), facecolors="white", edgecolors=colour(surface))
        rims = intervals(history.time, on_rim[:, surface - 1])
        axes.broken_barh(rims, (surface + BAR / 2, EDGE), facecolors=INK)
        share = sum(length for _, length in intervals(history.time, flags)) / span if span else 0.0
        axes.annotate(
            f"{100 * share:.0f} %",
            (1.008, surface),
            xycoords=("axes fraction", "data"),
            va="center",
            fontsize=8,
            color=colour(surface),
        )
    axes.set_yticks(range(1, history.surfaces + 1), [f"surface {k}" for k in range(1, history.surfaces + 1)])
    axes.set_ylim(0.5, history.surfaces + 0.6)
    axes.grid(visible=False, axis="y")
    notes = [note for note, seen in (("black: rim contact", on_rim), ("white: separated", apart)) if seen.any()]
    axes.set_title("Sliding surfaces" + (f"  ({', '.join(notes)})" if notes else ""))


def draw_sliding(figure: Any, result: BearingData) -> None:
    """One panel per surface, top surface uppermost: sliding displacement, capacity and rim contacts."""
    history, surfaces = result.history, result.bearing.surfaces
    column = strips(figure, len(surfaces))
    events = contacts(result)
    for index, (axes, surface) in enumerate(zip(column[::-1], surfaces, strict=True)):
        capacity, sliding = surface.capacity * MILLI, history.sliding[:, index] * MILLI
        draw_limit(axes, capacity, f"capacity {capacity:.3g} mm")
        axes.plot(history.time, sliding, color=colour(index + 1))
        for event in events:
            if event.surface == index + 1:
                axes.plot(event.time, capacity, **mark(event))
        axes.set_ylabel(f"s{subscript(index + 1)} [mm]")
        top = 1.38 * max(capacity, sliding.max())
        axes.set_ylim(-0.05 * top, top)  # the line of a surface stuck at its centre stays clear of the frame
        axes.locator_params(axis="y", nbins=3)
    column[0].set_title("Sliding displacement" + ("  (▼ rim contact)" if events else ""))
    figure.align_ylabels(column)


def _draw_displacement(axes: Axes, result: BearingData) -> None:
    from msfp_gen.figures.loops import moving_axes

    history = result.history
    for axis, style in zip(moving_axes(result), ("-", "--"), strict=False):
        axes.plot(
            history.time,
            displacement(history.displacement[:, axis]),
            color=INK,
            linestyle=style,
            linewidth=THIN,
            label=f"u{subscript(axis + 1)}",
        )
    axes.set(title="Displacement across the bearing", ylabel=displacement_label())
    if len(moving_axes(result)) > 1:
        axes.legend(loc="upper right", ncols=2)
