"""Hysteresis loops of the bearing, and its orbit in the horizontal plane."""

from __future__ import annotations

from functools import partial
from operator import mul
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.analysis.transitions import SYMBOLS, is_monotonic, transitions
from msfp_gen.figures.style import (
    COLOURS,
    FAINT,
    INK,
    MILLI,
    SMALL,
    THIN,
    displacement,
    displacement_label,
    engineering,
    first_contacts,
    force,
    headline,
    label_of,
    mark,
    page,
    subscript,
)
from msfp_gen.results.sign import shown_sign

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from msfp_gen.common.arrays import Array
    from msfp_gen.results.run_data import BearingData

SIDE = 0.02  # least displacement along a horizontal axis that is drawn, over the largest


def plot_loops(result: BearingData, path: str | Path | None = None) -> Figure:
    """Loops of the top force [kN] over the displacement across the bearing [mm], along each horizontal axis that moves.

    The right axis gives force over axial load; the first contact of every rim is marked. Raises InputError for a path
    that cannot be written. result: also one bearing of a building, with the axial load at rest.
    """
    axes = moving_axes(result)
    with page(6.2 * len(axes), 4.8, path) as figure:
        headline(figure, label_of(result))
        for axis, place in zip(axes, figure.subplots(1, len(axes), squeeze=False)[0], strict=True):
            draw_loop(place, result, axis)
    return figure


def plot_orbit(result: BearingData, path: str | Path | None = None) -> Figure:
    """Orbits in the horizontal plane: displacement across the bearing [mm], and force on the top support [kN].

    Raises InputError for a path that cannot be written.
    """
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


def moving_axes(result: BearingData) -> tuple[int, ...]:
    """Horizontal axes (0: E1, 1: E2) along which the bearing moves; E1 if it does not move."""
    return axes_along(result.history.displacement)


def axes_along(displacement: Array) -> tuple[int, ...]:
    """Horizontal axes (0: E1, 1: E2) along which a path moves, shape (time, 2 or 3); E1 if it does not move."""
    peaks = np.abs(displacement[:, :2]).max(axis=0)
    return tuple(np.flatnonzero(peaks > SIDE * peaks.max()).tolist()) or (0,)


def draw_loop(axes: Axes, result: BearingData, axis: int) -> None:
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


def draw_orbit(axes: Axes, result: BearingData, title: str = "Orbit") -> None:
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


def _draw_transitions(axes: Axes, result: BearingData, axis: int) -> None:
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
