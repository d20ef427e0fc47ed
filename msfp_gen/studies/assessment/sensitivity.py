"""Sensitivity of a quantity to the random axes, from the rows of a study: tornado."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.errors import InputError
from msfp_gen.common.tables import Table
from msfp_gen.figures.style import COLOURS, INK, THIN, headline, page
from msfp_gen.studies.assessment.rows import (
    SIZE,
    STATISTICS,
    column_numbers,
    complete,
    labelled,
    read_study,
    scale_of,
    unit_of,
)
from msfp_gen.studies.axes import Sampling
from msfp_gen.studies.run import study_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Bar:
    """A bar of a tornado, with all other axes at their medians.

    axis: its name. low, high: the two values of the axis. at_low, at_high: the quantity at these values.
    """

    axis: str
    low: float
    high: float
    at_low: float
    at_high: float

    @property
    def swing(self) -> float:
        """The difference of the quantity between the two values of the axis [unit of the quantity]."""
        return abs(self.at_high - self.at_low)


@dataclass(frozen=True)
class Tornado:
    """Result of `tornado`.

    name, unit, statistic: of the quantity. quantiles: of each axis, low and high. base: the quantity at the medians of
    all axes. bars: the longest first.
    """

    name: str
    unit: str
    statistic: str
    quantiles: tuple[float, float]
    base: float
    bars: tuple[Bar, ...]


def by_sample(folder: str | Path, name: str, statistic: str, method: str) -> Any:
    """The samples of a study as a DataFrame: random axes, and last the statistic of a quantity over the runs of each.

    `attrs` has the `unit` of the quantity and the table `sampling` of the study. method: of sampling that the study
    must have. Raises InputError: another method, runs that are missing or ended early, or a run without a value.
    """
    if statistic not in STATISTICS:
        raise InputError(f"statistic = {statistic!r}: give one of {', '.join(STATISTICS)}")
    table = study_table(Path(folder))
    sampling = dict(table.get("sampling", {}))
    if sampling.get("method", "latin-hypercube") != method:
        raise InputError(f"{str(folder)!r}: this needs a study with sampling.method = {method!r}")
    axes = tuple(axis for axis, keys in table["axes"].items() if "distribution" in keys)
    rows = read_study(folder, [*axes, name])
    if len(rows) < table["about"]["runs"]:
        raise InputError(f"{str(folder)!r}: {len(rows)} of {table['about']['runs']} runs are done; complete the study")
    if early := int((~complete(rows)).sum()):
        raise InputError(f"{name}: {early} runs ended early; see their status and message, and narrow the axes")
    y = column_numbers(rows, name)
    if np.isnan(y).any():
        raise InputError(f"{name}: {int(np.isnan(y).sum())} runs have no value; give another quantity")
    count = table["about"]["samples"]
    reduced = STATISTICS[statistic](y.reshape(-1, count), axis=0)
    samples = rows[list(axes)].astype(float).head(count).assign(**{name: reduced})
    samples.attrs = {"unit": unit_of(rows, name), "sampling": sampling}
    return samples


def tornado(folder: str | Path, name: str, statistic: str = "median") -> Tornado:
    """The change of a quantity with each random axis alone.

    folder: of a study with `sampling.method = "one-at-a-time"`. statistic: over all runs of a sample, such as the runs
    of several records: "median", "mean", "max" or "min". Raises InputError.
    """
    samples = by_sample(folder, name, statistic, "one-at-a-time")
    low, high = samples.attrs["sampling"].get("quantiles", Sampling("one-at-a-time").quantiles)
    values = samples.to_numpy()
    bars = [
        Bar(axis, *values[1 + 2 * k : 3 + 2 * k, k].tolist(), *values[1 + 2 * k : 3 + 2 * k, -1].tolist())
        for k, axis in enumerate(samples.columns[:-1])
    ]
    bars.sort(key=lambda bar: -bar.swing)
    return Tornado(name, samples.attrs["unit"], statistic, (low, high), float(values[0, -1]), tuple(bars))


def tornado_table(result: Tornado) -> Table:
    """The bars as a table for a terminal."""
    rows = [
        (bar.axis, f"{bar.low:.4g}", f"{bar.high:.4g}", f"{bar.at_low:.4g}", f"{bar.at_high:.4g}", f"{bar.swing:.4g}")
        for bar in result.bars
    ]
    unit = f" {result.unit}" if result.unit else ""
    low, high = result.quantiles
    title = (
        f"{result.statistic} of {result.name}: {result.base:.4g}{unit} at medians; each axis at {low:g} and {high:g}"
    )
    return Table(title, ("axis", "low", "high", "at low", "at high", "swing"), rows)


def plot_tornado(result: Tornado, path: str | Path | None = None, title: str = "") -> Figure:
    """Bars of the quantity between the low and the high value of each axis, longest on top. path: see `page`."""
    scale = scale_of([value for bar in result.bars for value in (bar.at_low, bar.at_high)], result.unit)
    base = scale.factor * result.base
    with page(SIZE[0], 1.4 + 0.45 * len(result.bars), path) as figure:
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
