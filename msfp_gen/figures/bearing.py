"""Figures of one bearing: overview, loops and orbit, sliding and its regimes, path of the force, energy balance."""

from __future__ import annotations

from functools import partial
from operator import mul
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.figures.section import SectionDrawing, draw_circles, peak_time
from msfp_gen.figures.style import (
    COLOURS,
    FAINT,
    HAIR,
    INK,
    LINE,
    MILLI,
    PALE,
    SMALL,
    THIN,
    colour,
    contacts,
    displacement,
    displacement_label,
    draw_limit,
    engineering,
    first_contacts,
    force,
    headline,
    label_of,
    mark,
    page,
    strips,
    subscript,
)
from msfp_gen.results.geometry import contact_offsets, friction_circles, sections, slider_radius
from msfp_gen.results.result import Result
from msfp_gen.results.sign import shown_sign
from msfp_gen.results.sliding import intervals, rims_in_contact, sliding_surfaces
from msfp_gen.results.summary import SYMBOLS, is_monotonic, transitions

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure


SIDE = 0.02  # least displacement along a horizontal axis that is drawn, over the largest


def plot_loops(result: Result, path: str | Path | None = None) -> Figure:
    """Loops of the top force [kN] over the displacement across the bearing [mm], along each horizontal axis that moves.

    The right axis gives force over axial load; the first contact of every rim is marked. result: also one bearing of a
    building, with the axial load at rest.
    """
    axes = moving_axes(result)
    with page(6.2 * len(axes), 4.8, path) as figure:
        headline(figure, label_of(result))
        for axis, place in zip(axes, figure.subplots(1, len(axes), squeeze=False)[0], strict=True):
            draw_loop(place, result, axis)
    return figure


def plot_orbit(result: Result, path: str | Path | None = None) -> Figure:
    """Orbits in the horizontal plane: displacement across the bearing [mm], and force on the top support [kN]."""
    with page(10.4, 5.2, path) as figure:
        headline(figure, label_of(result))
        left, right = figure.subplots(1, 2)
        draw_orbit(left, result, "Orbit of the displacement")
        scale = engineering(result.history.top_force[:, :2], "N")
        path_of_force = force(result.history.top_force[:, :2], scale)
        right.plot(*path_of_force.T, color=COLOURS[1])
        right.plot(*path_of_force[0], marker="o", markersize=5, color=INK, linestyle="none")
        right.set(
            title=f"Orbit of the force {shown_sign().force}", xlabel=f"F₁ [{scale.unit}]", ylabel=f"F₂ [{scale.unit}]"
        )
        right.set_aspect("equal", adjustable="datalim")
        right.margins(0.06)
        figure.legend(loc="outside lower left", ncols=7, handletextpad=0.1)
    return figure


def moving_axes(result: Result) -> tuple[int, ...]:
    """Horizontal axes (0: E1, 1: E2) along which the bearing moves; E1 if it does not move."""
    return axes_along(result.history.displacement)


def axes_along(displacement: Array) -> tuple[int, ...]:
    """Horizontal axes (0: E1, 1: E2) along which a path moves, shape (time, 2 or 3); E1 if it does not move."""
    peaks = np.abs(displacement[:, :2]).max(axis=0)
    return tuple(np.flatnonzero(peaks > SIDE * peaks.max()).tolist()) or (0,)


def draw_loop(axes: Axes, result: Result, axis: int) -> None:
    """Top force over displacement along `axis`, with the first rim contacts and force over axial load on the right."""
    history, name = result.history, subscript(axis + 1)
    scale = engineering(history.top_force[:, :2], "N")
    axes.plot(displacement(history.displacement[:, axis]), force(history.top_force[:, axis], scale), color=COLOURS[0])
    for event in first_contacts(result):
        label = f"first contact of rim {event.surface}"
        point = displacement(event.displacement[axis]), force(event.top_force[axis], scale)
        axes.plot(*point, **mark(event), label=label)
    axes.set(
        title=f"Force and displacement along E{name}",
        xlabel=f"displacement across the bearing {displacement_label(axis)}",
        ylabel=f"force {shown_sign().force} F{name} [{scale.unit}]",
    )
    axes.margins(0.06)
    if len(moving_axes(result)) == 1 and is_monotonic(result):
        _draw_transitions(axes, result, axis)
    elif first_contacts(result):
        axes.legend(loc="upper left", handletextpad=0.1)
    if load := result.axial_load:
        factor = scale.factor * load
        ratio = axes.secondary_yaxis("right", functions=(partial(mul, 1 / factor), partial(mul, factor)))
        ratio.set_ylabel(f"F{name} / N  (N = {load / 1e3:.4g} kN)")
        ratio.spines["right"].set_visible(True)


def draw_orbit(axes: Axes, result: Result, title: str = "Orbit") -> None:
    """Displacement across the bearing in the horizontal plane, with its start and the first contact of every rim."""
    u = displacement(result.history.displacement)
    axes.plot(u[:, 0], u[:, 1], color=COLOURS[0])
    for event in first_contacts(result):
        axes.plot(
            *displacement(event.displacement[:2]),
            **mark(event),
            label=f"first contact of rim {event.surface}",
        )
    axes.plot(*u[0, :2], marker="o", markersize=5, color=INK, linestyle="none", label="start")
    axes.set(title=title, xlabel=displacement_label(0), ylabel=displacement_label(1))
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06)


def _draw_transitions(axes: Axes, result: Result, axis: int) -> None:
    """Dotted lines at the transitions of a monotonic run, each with its symbol and value."""
    history = result.history
    sign = float(np.sign(displacement(history.displacement[history.peak_row, axis])))
    for key, value in transitions(result).items():
        if not key.startswith("u_") or value is None:
            continue
        x = sign * value * MILLI
        axes.axvline(x, color=FAINT, linewidth=THIN, linestyle=":")
        # The curve rises, so labels lie above it in its first half and below it in the second.
        above = value < history.horizontal.max() / 2
        axes.annotate(
            f"{SYMBOLS.get(key, key)} = {value * MILLI:.1f} mm",
            (x, float(above)),
            xycoords=("data", "axes fraction"),
            xytext=(2, -4 if above else 4),
            textcoords="offset points",
            va="top" if above else "bottom",
            rotation=90,
            fontsize=SMALL,
            color=INK,
        )


BAR, EDGE = 0.56, 0.16  # heights of the bars for sliding and for rim contact, in rows


def plot_sliding(result: Result, path: str | Path | None = None) -> Figure:
    """Sliding displacement of every surface [mm] over time, with its capacity and the rim contacts."""
    with page(9.5, max(4.8, 1.2 * result.history.surfaces + 1), path) as figure:
        headline(figure, label_of(result))
        draw_sliding(figure, result)
    return figure


def plot_stages(result: Result, path: str | Path | None = None) -> Figure:
    """Sliding regimes over time: when each surface slides or touches its rim, below the displacement of the bearing.

    `results.sliding` defines when a surface slides.
    """
    count = result.history.surfaces
    with page(9.5, 2.8 + 0.45 * count, path) as figure:
        headline(figure, label_of(result))
        above, below = strips(figure, 2, height_ratios=(4, 1.2 * count))
        _draw_displacement(above, result)
        draw_bars(below, result)
    return figure


def draw_bars(axes: Axes, result: Result) -> None:
    """One row per surface, top surface uppermost: a bar while it slides, a black edge during rim contact, a white bar
    while it is separated. The share of time in which it slides stands to the right.
    """
    history = result.alone.history
    slides, on_rim, apart = sliding_surfaces(history), rims_in_contact(history), history.separated
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


def draw_sliding(figure: Any, result: Result) -> None:
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


def _draw_displacement(axes: Axes, result: Result) -> None:

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


# Term -> (label, colour), from the bottom of the stack up: dissipated energy first, then stored energy.
TERMS = {
    "friction_dissipated": ("friction, dissipated", COLOURS[0]),
    "contact_dissipated": ("contact damping, dissipated", "#B07AA1"),
    "rim_dissipated": ("rims, dissipated", COLOURS[3]),
    "top_dissipated": ("dampers of the top, dissipated", "#7F7F7F"),
    "potential": ("potential (weights and vertical loads)", COLOURS[2]),
    "restraint": ("springs of the top", COLOURS[4]),
    "friction_stored": ("friction, stored elastically", COLOURS[5]),
    "rim_stored": ("rims, stored", "#F0E442"),
    "kinetic": ("kinetic", COLOURS[1]),
}
VISIBLE = 1e-3  # least peak of a term that is drawn, over the largest input


def plot_energy(result: Result, path: str | Path | None = None) -> Figure:
    """Energy balance: dissipated and stored energy stacked over time with the input, and the numerical term below.

    Terms below 0.1 % of the largest input are left out.
    """
    energy = result.alone.history.energy
    peak = max(float(np.abs(energy["input"]).max()), np.finfo(float).tiny)
    with page(11.5, 5.6, path) as figure:
        headline(figure, label_of(result))
        above, below = strips(figure, 2, height_ratios=(4, 1))
        _draw_balance(above, result, peak)
        numerical = energy["numerical"] / peak
        below.plot(result.history.time, 100 * numerical, color=INK, linewidth=THIN)
        below.axhline(0.0, color=FAINT, linewidth=HAIR)
        largest = 100 * float(np.abs(numerical).max())
        below.set(title=f"Numerical error: input less all terms, at most {largest:.2g} % of peak input", ylabel="[%]")
    return figure


def _draw_balance(axes: Axes, result: Result, peak: float) -> None:
    """Stack the terms over time: positive values above zero, negative ones below."""
    history = result.history
    scale = engineering(peak, "J")
    above, below = np.zeros_like(history.time), np.zeros_like(history.time)
    for key, (name, shade) in TERMS.items():
        values = history.energy[key]
        if np.abs(values).max() < VISIBLE * peak:
            continue
        label = f"{name}: {100 * values[-1] / peak:.1f} %"
        above = _band(axes, history.time, above, np.maximum(values, 0), scale.factor, shade, label)
        below = _band(axes, history.time, below, np.minimum(values, 0), scale.factor, shade, None)
    axes.plot(history.time, history.energy["input"] * scale.factor, color=INK, linewidth=LINE, label="input")
    axes.set(title="Energy balance, relative to the base", ylabel=f"energy E [{scale.unit}]")
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(
        handles[::-1],
        labels[::-1],
        loc="upper left",
        bbox_to_anchor=(1.01, 1),
        alignment="left",
        title="at the end, over the peak input",
    )


def _band(axes: Axes, time: Array, start: Array, values: Array, factor: float, colour: str, label: str | None) -> Array:
    """Draw a filled band from `start` [J], shape (T,), of height `values`; returns its other edge."""
    end: Array = start + values
    if np.any(values) or label:
        axes.fill_between(time, start * factor, end * factor, color=colour, linewidth=0, alpha=0.85, label=label)
    return end


def plot_force_path(result: Result, path: str | Path | None = None, *, time: float | None = None) -> Figure:
    """Lines of force with the friction circles at one instant, and the eccentricity of every contact over time [mm].

    A slider would tip where its contact lies beyond the edge of its face, which only models with `effects.uplift`
    describe (docs/model.md, choice 11; docs/uplift.md). Nothing is drawn while a surface is separated.

    Args:
        result: the run.
        path: file to write, .png, .svg or .pdf; None: none.
        time: instant of the lines of force [s]; None: at the largest displacement.

    Raises:
        InputError: a time outside the run, a bearing of a building, or a path that cannot be written.
    """
    then = result.at_times(peak_time(result) if time is None else time)
    (section,) = sections(then)
    with page(12.5, max(6.0, 1.3 * result.history.surfaces + 1), path) as figure:
        headline(figure, label_of(result))
        ((left, right),) = figure.subfigures(1, 2, squeeze=False, width_ratios=(1, 1.7))
        axes = left.subplots()
        SectionDrawing(axes, then, section)
        draw_circles(axes, section, friction_circles(then)[0])
        _draw_offsets(right, result)
    return figure


def eccentricity(result: Result) -> Array:
    """Distance of every contact from the axis of its slider [m], shape (T, n-1); NaN while the surface is separated."""
    history = result.alone.history
    offsets = contact_offsets(result.bearing, history.contact_angles, history.tilt_angles)
    return np.where(history.separated, np.nan, offsets)


def _draw_offsets(figure: SubFigure, result: Result) -> None:
    """One panel per surface, top surface uppermost, with the radius of the slider's face."""
    bearing, off = result.bearing, eccentricity(result) * MILLI
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


def plot_result(result: Result, path: str | Path | None = None) -> Figure:
    """Overview of a run: loops along each axis that moves, orbit where both move, sliding of every surface over time.

    The right axis of the loops gives force over axial load; sliding is drawn with its capacity and the rim contacts.

    Args:
        result: the run.
        path: file to write, .png, .svg or .pdf; it appears only when complete. None: none.

    Raises:
        InputError: a path that cannot be written.
    """
    axes = moving_axes(result)
    size = (10.5, max(4.8, 0.95 * result.history.surfaces + 1)) if len(axes) == 1 else (11.5, 8.6)
    with page(*size, path) as figure:
        headline(figure, _title(result))
        ((left, right),) = figure.subfigures(1, 2, squeeze=False, width_ratios=(1.15, 1))
        if len(axes) == 1:
            draw_loop(left.subplots(), result, axes[0])
            draw_sliding(right, result)
        else:
            (above,), (below,) = right.subfigures(2, 1, squeeze=False, height_ratios=(1, 1.25))
            for axis, place in zip(axes, left.subplots(2, 1), strict=True):
                draw_loop(place, result, axis)
            draw_orbit(above.subplots(), result)
            draw_sliding(below, result)
    return figure


def _title(result: Result) -> str:
    """Name and peaks over all steps; of a failed run also the time it reached."""
    load = result.axial_load
    displacement, force = result.extremes.displacement[3], result.extremes.top_force[3]
    scale = engineering(force, "N")
    lines = [
        label_of(result),
        f"peak displacement {displacement * MILLI:.4g} mm, peak force {force * scale.factor:.4g} {scale.unit}",
    ]
    return ", ".join(lines) + (f", F/N = {force / load:.3f}" if load else "")
