"""An estimate for a terminal, and its picture: width of the interval over time, plain Monte Carlo beside it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.tables import Table
from msfp_gen.figures.style import COLOURS, FAINT, INK, headline, page
from msfp_gen.studies.assessment.rows import labelled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from msfp_gen.studies.estimation.estimate import Estimate

WIDTH, HEIGHT = 6.8, 4.6  # [inch]


def estimate_table(result: Estimate) -> Table:
    """The estimate in ten lines at most."""
    unit = f" {result.unit}" if result.unit else ""
    threshold = "" if result.threshold is None else f" {result.threshold:g}"
    runs = ", ".join(f"{count} {name}" for name, count in result.runs.items())
    rows = [
        ("value", f"{result.value:.4g}{unit}"),
        ("interval of 95 %", f"{result.interval[0]:.4g} to {result.interval[1]:.4g}{unit}"),
    ]
    if result.dispersion is not None and result.dispersion_interval is not None:
        low, high = result.dispersion_interval
        rows.append(("dispersion", f"{result.dispersion:.3g}, {low:.3g} to {high:.3g}"))
    gain = result.plain_seconds / result.seconds if result.seconds else 1.0
    rows += [
        ("runs", runs),
        ("seconds", f"{result.seconds:.4g}, on one core"),
        ("plain Monte Carlo", f"{result.plain_seconds:.4g} s for this interval, {gain:.3g} times as many"),
        ("correlation", ", ".join(f"{name} {rho:.4f}" for name, rho in result.correlation.items()) or "none tried"),
        ("cost of a run", ", ".join(f"{name} {1e3 * cost:.3g} ms" for name, cost in result.costs.items())),
    ]
    return Table(f"{result.statistic}{threshold} of {result.quantity}", (), rows)


def plot_estimate(result: Estimate, path: str | Path | None = None, title: str = "") -> Figure:
    """Half the width of the interval over the seconds of all runs: the mixture as it was, and plain Monte Carlo.

    Raises InputError for a path that cannot be written.
    """
    seconds, half = np.array(result.trace).T
    with page(WIDTH, HEIGHT, path) as figure:
        headline(figure, title or f"{result.statistic} of {labelled(result.quantity, '')}: what an interval costs")
        axes = figure.subplots()
        end = half[-1]
        span = np.geomspace(seconds[0] / 2, 2 * max(result.plain_seconds, seconds[-1]), 100)
        axes.plot(span, end * np.sqrt(result.plain_seconds / span), color=FAINT, label="plain Monte Carlo")
        axes.plot(
            span, end * np.sqrt(result.seconds / span), "--", color=COLOURS[0], linewidth=1, label="as the last round"
        )
        axes.plot(seconds, half, "o-", color=COLOURS[0], label="this estimate, round by round")
        axes.axhline(end, color=INK, linewidth=0.5)
        text = f"{result.plain_seconds / max(result.seconds, 1e-300):.3g} times"
        axes.annotate(text, (result.plain_seconds, end), (4, 6), textcoords="offset points")
        axes.set(xscale="log", yscale="log", xlabel="seconds on one core",
                 ylabel=labelled("half the width of the interval of 95 %", result.unit))  # fmt: skip
        axes.legend()
    return figure
