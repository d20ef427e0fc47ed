"""Energy balance of a run over time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.figures.style import (
    COLOURS,
    FAINT,
    HAIR,
    INK,
    LINE,
    THIN,
    engineering,
    headline,
    label_of,
    page,
    strips,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from msfp_gen.results.run_data import RunData

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


def plot_energy(result: RunData, path: str | Path | None = None) -> Figure:
    """Energy balance: dissipated and stored energy stacked over time with the input, and the numerical term below.

    Terms below 0.1 % of the largest input are left out. Raises InputError for a path that cannot be written.
    """
    energy = result.history.energy
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


def _draw_balance(axes: Axes, result: RunData, peak: float) -> None:
    """Stack the terms over time: positive values above zero, negative ones below."""
    history = result.history
    scale = engineering(peak, "J")
    above, below = np.zeros_like(history.time), np.zeros_like(history.time)
    for key, (name, colour) in TERMS.items():
        values = history.energy[key]
        if np.abs(values).max() < VISIBLE * peak:
            continue
        label = f"{name}: {100 * values[-1] / peak:.1f} %"
        above = _band(axes, history.time, above, np.maximum(values, 0), scale.factor, colour, label)
        below = _band(axes, history.time, below, np.minimum(values, 0), scale.factor, colour, None)
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
