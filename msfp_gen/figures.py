"""Pictures of a run, in one style: hysteresis loops with forces over the load, and the sliding of every surface."""

from __future__ import annotations

from functools import partial
from operator import mul
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.history import Event
from msfp_gen.output import FIGURE_SUFFIXES, check_output, replacing
from msfp_gen.summary import axial_load
from msfp_gen.transitions import SYMBOLS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from msfp_gen.result import Result

# Okabe and Ito's colours: told apart in print and by colour-blind readers.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
INK, FAINT = "#222222", "#999999"
STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
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
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.7,
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.dpi": 130,
    "savefig.dpi": 160,
    "svg.hashsalt": "msfp-gen",  # the same run gives the same file
}
SIDE = 0.02  # a horizontal axis whose displacement stays below this share of the largest is not drawn
MILLI = 1e3
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def plot_result(result: Result, path: str | Path | None = None) -> Figure:
    """Draw `result`, and write it to `path` if given (.png, .svg or .pdf), whole or not at all.

    Loops of the top force against the displacement across the bearing, along each horizontal axis that moves, with
    force over axial load to the right; the orbit where both axes move; sliding of every surface over time with its
    capacity and where it met its rim. Raises InputError for a path that cannot be written.
    """
    import matplotlib
    from matplotlib.figure import Figure

    target = None if path is None else check_output(path, FIGURE_SUFFIXES, "plot")
    with matplotlib.rc_context(STYLE):
        axes = moving_axes(result)
        figure = Figure(figsize=(10.5, max(4.8, 0.95 * result.history.surfaces + 1)) if len(axes) == 1 else (11.5, 8.6),
                        layout="constrained")  # fmt: skip
        figure.suptitle(_title(result), fontsize=12, fontweight="bold", color=INK, x=0.01, ha="left")
        ((left, right),) = figure.subfigures(1, 2, squeeze=False, width_ratios=(1.15, 1))
        if len(axes) == 1:
            _draw_loop(left.subplots(), result, axes[0])
            _draw_sliding(right, result)
        else:
            (above,), (below,) = right.subfigures(2, 1, squeeze=False, height_ratios=(1, 1.25))
            for axis, place in zip(axes, left.subplots(2, 1), strict=True):
                _draw_loop(place, result, axis)
            _draw_orbit(above.subplots(), result)
            _draw_sliding(below, result)
        if target is not None:
            with replacing(target) as temporary:
                figure.savefig(temporary, metadata={"Date": None} if target.suffix.lower() == ".svg" else None)
    return figure


def moving_axes(result: Result) -> tuple[int, ...]:
    """Horizontal axes (0 for E1, 1 for E2) along which the bearing moves; E1 where it does not move at all."""
    peaks = np.abs(result.history.displacement[:, :2]).max(axis=0)
    return tuple(np.flatnonzero(peaks > SIDE * peaks.max()).tolist()) or (0,)


def _draw_loop(axes: Axes, result: Result, axis: int) -> None:
    """Top force against displacement along `axis`; rims met are marked; force over load to the right."""
    history, name = result.history, str(axis + 1).translate(SUBSCRIPTS)
    scale, prefix = _force_unit(history.top_force[:, :2])
    axes.plot(history.displacement[:, axis] * MILLI, history.top_force[:, axis] * scale, color=COLOURS[0])
    for event in _first_contacts(result):
        label = f"rim {event.surface} first met"
        axes.plot(event.displacement[axis] * MILLI, event.top_force[axis] * scale, **_mark(event), label=label)
    axes.set(
        title=f"Force and displacement along E{name}",
        xlabel=f"displacement across the bearing u{name} [mm]",
        ylabel=f"force on the top support F{name} [{prefix}N]",
    )
    axes.margins(0.06)
    if len(moving_axes(result)) == 1 and "transitions" in result.summary:
        _draw_transitions(axes, result, axis)
    elif _first_contacts(result):
        axes.legend(loc="upper left", handletextpad=0.1)
    load = axial_load(result)
    if load:
        factor = scale * load
        ratio = axes.secondary_yaxis("right", functions=(partial(mul, 1 / factor), partial(mul, factor)))
        ratio.set_ylabel(f"F{name} / N  (N = {load / 1e3:.4g} kN)")
        ratio.spines["right"].set_visible(True)


def _draw_transitions(axes: Axes, result: Result, axis: int) -> None:
    """Dotted lines where the stages of a monotonic run change, each with its symbol and value."""
    history = result.history
    sign = np.sign(history.displacement[int(history.horizontal.argmax()), axis])
    for key, value in result.summary["transitions"].items():
        if not key.startswith("u_") or value is None:
            continue
        x = sign * value * MILLI
        axes.axvline(x, color=FAINT, linewidth=0.9, linestyle=":")
        # The curve rises: above it there is room on its first half, below it on its second.
        above = value < history.horizontal.max() / 2
        axes.annotate(
            f"{SYMBOLS.get(key, key)} = {value * MILLI:.1f} mm", (x, float(above)),
            xycoords=("data", "axes fraction"), xytext=(2, -4 if above else 4), textcoords="offset points",
            va="top" if above else "bottom", rotation=90, fontsize=8, color=INK,
        )  # fmt: skip


def _draw_orbit(axes: Axes, result: Result) -> None:
    u = result.history.displacement * MILLI
    axes.plot(u[:, 0], u[:, 1], color=COLOURS[0])
    for event in _first_contacts(result):
        axes.plot(event.displacement[0] * MILLI, event.displacement[1] * MILLI, **_mark(event))
    axes.plot(*u[0, :2], marker="o", markersize=5, color=INK, linestyle="none", label="start")
    axes.set(title="Orbit", xlabel="u₁ [mm]", ylabel="u₂ [mm]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06)


def _draw_sliding(figure: SubFigure, result: Result) -> None:
    """One strip a surface, top surface uppermost: sliding, capacity, and rims met."""
    history, surfaces = result.history, result.scene.bearing.surfaces
    strips = figure.subplots(len(surfaces), 1, sharex=True, squeeze=False)[:, 0]
    contacts = _contacts(result)
    for index, (axes, surface) in enumerate(zip(strips[::-1], surfaces, strict=True)):
        capacity, sliding = surface.capacity * MILLI, history.sliding[:, index] * MILLI
        axes.axhline(capacity, color=INK, linewidth=0.9, linestyle=(0, (5, 3)))
        axes.annotate(f"capacity {capacity:.3g} mm", (1, capacity), xycoords=("axes fraction", "data"), xytext=(0, 4),
                      textcoords="offset points", ha="right", va="bottom", fontsize=7.5, color=INK)  # fmt: skip
        axes.plot(history.time, sliding, color=_colour(index + 1))
        for event in contacts:
            if event.surface == index + 1:
                axes.plot(event.time, capacity, **_mark(event))
        axes.set_ylabel(f"s{str(index + 1).translate(SUBSCRIPTS)} [mm]")
        top = 1.38 * max(capacity, sliding.max())
        axes.set_ylim(-0.05 * top, top)  # a surface that is stuck at its centre does not hide on the frame
        axes.locator_params(axis="y", nbins=3)
    strips[0].set_title("Sliding of every surface" + ("  (▼ rim met)" if contacts else ""))
    strips[-1].set_xlabel("time t [s]")
    strips[-1].margins(x=0.01)
    figure.align_ylabels(strips)


def _contacts(result: Result) -> list[Event]:
    return [event for event in result.events if event.kind == "rim_contact"]


def _first_contacts(result: Result) -> list[Event]:
    """The first contact of every rim that was met; a rim met every cycle would bury the loop in marks."""
    return list({event.surface: event for event in reversed(_contacts(result))}.values())[::-1]


def _colour(surface: int) -> str:
    return COLOURS[(surface - 1) % len(COLOURS)]


def _mark(event: Event) -> dict[str, Any]:
    return {"marker": "v", "markersize": 5.5, "linestyle": "none", "zorder": 4, "markeredgecolor": "white",
            "markeredgewidth": 0.6, "color": _colour(event.surface)}  # fmt: skip


def _force_unit(force: Any) -> tuple[float, str]:
    """Factor and prefix that make the largest force readable."""
    peak = np.abs(force).max()
    return next((scale, prefix) for limit, scale, prefix in ((1e6, 1e-6, "M"), (500.0, 1e-3, "k"), (-1.0, 1.0, ""))
                if peak >= limit)  # fmt: skip


def _title(result: Result) -> str:
    """Name and peaks; of a run that failed, how far it came."""
    history, load = result.history, axial_load(result)
    force = np.hypot(*history.top_force[:, :2].T).max()
    scale, prefix = _force_unit(force)
    lines = [result.scene.name or "unnamed scene"]
    if not result.succeeded:
        lines.append(f"run failed ({result.status}) at t = {history.time[-1]:.4g} s")
    lines.append(
        f"peak displacement {history.horizontal.max() * MILLI:.4g} mm, peak force {force * scale:.4g} {prefix}N"
    )
    return ", ".join(lines) + (f", F/N = {force / load:.3f}" if load else "")
