"""Figures of evaluated studies, in the common style."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.figures.style import COLOURS, FAINT, INK, PALE, THIN, Scale, engineering, headline, page, plain
from msfp_gen.studies.assessment.rows import labelled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from msfp_gen.studies.assessment.fragility import Fragility
    from msfp_gen.studies.assessment.ida import Ida
    from msfp_gen.studies.assessment.pareto import Front
    from msfp_gen.studies.assessment.sensitivity import Sobol, Tornado

POINTS = 300
SHADE = 0.16  # opacity of a confidence band
MOST_CURVES = 400  # that are drawn one by one
WIDTH, HEIGHT = 6.8, 4.6  # [inch]


def plot_ida(result: Ida, path: str | Path | None = None, title: str = "") -> Figure:
    """Intensity over demand: every curve, with a cross where a run ended early, and the fractiles.

    Raises InputError for a path that cannot be written.
    """
    scale = _scale(result.curves[result.demand], result.unit)
    with page(WIDTH, HEIGHT, path) as figure:
        headline(figure, title or "incremental dynamic analysis")
        axes = figure.subplots()
        for number, curve in result.curves.groupby("curve"):
            if number > MOST_CURVES:
                break
            x, y = curve[result.measure], scale.factor * curve[result.demand]
            axes.plot([0.0, *y], [0.0, *x], color=FAINT, linewidth=THIN / 2, alpha=0.6)
            early = ~curve["ended"]
            axes.plot(y[early][:1], x[early][:1], "x", color=FAINT, markersize=4)
        for name, colour in zip(_shares(result), (COLOURS[0], INK, COLOURS[1], *COLOURS[2:]), strict=False):
            values = np.where(np.isinf(result.fractiles[name]), np.nan, scale.factor * result.fractiles[name])
            axes.plot([0.0, *values], [0.0, *result.fractiles[result.measure]], color=colour, label=f"{name[1:]} %")
        axes.set(xlabel=labelled(result.demand, scale.unit), ylabel=labelled(result.measure, result.measure_unit))
        axes.set(xlim=(0, None), ylim=(0, None))
        axes.legend(title="fractile of demand")
    return figure


def _shares(result: Ida) -> list[str]:
    return [name for name in result.fractiles.columns if name.startswith("p")]


def plot_fragility(result: Fragility, path: str | Path | None = None, title: str = "") -> Figure:
    """Probability of exceedance over intensity: curve, confidence band and observed shares of every damage state.

    Raises InputError for a path that cannot be written.
    """
    every = np.concatenate([state.intensity for state in result.states])
    x = np.geomspace(every.min(), every.max(), POINTS)
    scale = _scale([state.threshold for state in result.states], result.unit)
    with page(WIDTH, HEIGHT, path) as figure:
        headline(figure, title or "fragility")
        axes = figure.subplots()
        for state, colour in zip(result.states, COLOURS * len(result.states), strict=False):
            name = f"{state.case} {state.threshold * scale.factor:.4g} {scale.unit}".strip()
            text = f"{plain(name)}: θ = {state.median:.3g}, β = {state.dispersion:.2g}"
            axes.plot(x, state.probability(x), color=colour, label=text)
            axes.fill_between(x, *state.band(x), color=colour, alpha=SHADE, linewidth=0)
            if state.runs_at.max() > 1:  # levels with several runs have a share
                axes.plot(state.intensity, state.exceeded_at / state.runs_at, "o", color=colour, markersize=3.5)
        axes.set(
            xlabel=labelled(result.measure, result.measure_unit),
            ylabel=f"probability that {labelled(result.demand, '')} exceeds",
            ylim=(0, 1),
        )
        axes.legend(title=f"threshold, with bands of {100 * result.states[0].level:g} %")
    return figure


def plot_tornado(result: Tornado, path: str | Path | None = None, title: str = "") -> Figure:
    """Bars of the quantity between the low and the high value of each axis, the longest on top.

    Raises InputError for a path that cannot be written.
    """
    scale = _scale([value for bar in result.bars for value in (bar.at_low, bar.at_high)], result.unit)
    base = scale.factor * result.base
    with page(WIDTH, 1.4 + 0.45 * len(result.bars), path) as figure:
        headline(figure, title or "sensitivity, one axis at a time")
        axes = figure.subplots()
        for place, bar in enumerate(reversed(result.bars)):
            ends = ((bar.at_low, COLOURS[0], bar.low), (bar.at_high, COLOURS[1], bar.high))
            for value, colour, at in ends:
                end = scale.factor * value
                axes.barh(place, end - base, left=base, height=0.6, color=colour)
                side = "left" if end >= base else "right"
                axes.annotate(f"{at:.3g}", (end, place), (3 if end >= base else -3, 0), textcoords="offset points",
                              va="center", ha=side, fontsize=8)  # fmt: skip
        axes.axvline(base, color=INK, linewidth=THIN)
        axes.set_yticks(range(len(result.bars)), [labelled(bar.axis, "") for bar in reversed(result.bars)])
        axes.margins(x=0.12)
        axes.grid(visible=False, axis="y")
        axes.set_xlabel(f"{result.statistic} of {labelled(result.name, scale.unit)}")
    return figure


def plot_sobol(result: Sobol, path: str | Path | None = None, title: str = "") -> Figure:
    """First-order and total Sobol' indices of every axis with confidence intervals, the largest total on top.

    Raises InputError for a path that cannot be written.
    """
    count = len(result.axes)
    with page(WIDTH, 1.6 + 0.5 * count, path) as figure:
        headline(figure, title or f"Sobol' indices of {labelled(result.name, '')}")
        axes = figure.subplots()
        places = np.arange(count)[::-1]
        drawn: list[tuple[str, Any, Any, float]] = [
            ("first order", result.first, result.first_interval, 0.18),
            ("total", result.total, result.total_interval, -0.18),
        ]
        for (label, values, errors, shift), colour in zip(drawn, COLOURS, strict=False):
            axes.barh(places + shift, values, height=0.32, color=colour, label=label)
            axes.errorbar(values, places + shift, xerr=errors, fmt="none", ecolor=INK, elinewidth=THIN, capsize=2)
        axes.set_yticks(places, [labelled(name, "") for name in result.axes])
        axes.grid(visible=False, axis="y")
        axes.set_xlabel(f"share of the variance of the {result.statistic} of {labelled(result.name, '')}")
        axes.legend(loc="lower right")
    return figure


def plot_pareto(result: Front, path: str | Path | None = None, title: str = "") -> Figure:
    """The first two objectives: all designs, and those on the front joined by a line.

    Raises InputError for a path that cannot be written.
    """
    first, second = result.goals.names[:2]
    designs, front = result.designs, result.designs[result.designs.front].sort_values(first)
    scales = [_scale(designs[name], result.units.get(name, "")) for name in (first, second)]
    with page(WIDTH, HEIGHT, path) as figure:
        headline(figure, title or "Pareto front")
        axes = figure.subplots()
        for chosen, marker, colour, label in (
            (designs[~designs.feasible], "x", PALE, "not feasible"),
            (designs[designs.feasible & ~designs.front], ".", FAINT, "dominated"),
        ):
            x, y = (scale.factor * chosen[name] for scale, name in zip(scales, (first, second), strict=True))
            axes.plot(x, y, marker, color=colour, label=label)
        x, y = (scale.factor * front[name] for scale, name in zip(scales, (first, second), strict=True))
        line = "-" if len(result.goals.names) == 2 else "none"
        axes.plot(x, y, "o", linestyle=line, color=COLOURS[0], label=f"front, {len(front)} designs")
        axes.set(xlabel=labelled(first, scales[0].unit), ylabel=labelled(second, scales[1].unit))
        axes.legend()
    return figure


def _scale(values: Any, unit: str) -> Scale:
    """Lengths in mm, other quantities with a prefix, plain numbers as they are."""
    if unit == "m":
        return Scale(1e3, "mm")
    finite: Array = np.asarray(values, dtype=float)
    return engineering(finite, unit) if unit else Scale(1.0, "")
