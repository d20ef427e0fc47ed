"""Incremental dynamic analysis of the rows of a study: curves of demand over intensity, and fractiles of these curves.

After Vamvatsikos and Cornell (2002).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.tables import Table
from msfp_gen.figures.style import COLOURS, FAINT, INK, THIN, headline, page
from msfp_gen.results.quantities import Side
from msfp_gen.studies.assessment.rows import (
    SIZE,
    check_columns,
    complete,
    demands,
    intensities,
    labelled,
    scale_of,
    side_of,
    unit_of,
)
from msfp_gen.studies.axes import INTENSITY

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FRACTILES = (0.16, 0.5, 0.84)
POINTS = 50  # intensities of the fractiles, where the curves have different intensities
MOST_CURVES = 400  # in a figure
SCALE = "scale"  # axis of a study that scales the records
DemandCurve = tuple[Array, Array, Any]  # intensities, demands, and whether each run reached its end


@dataclass(frozen=True)
class Ida:
    """Result of `ida`.

    Attributes:
        measure, demand: names of the columns.
        measure_unit, unit: of intensity and demand.
        curves: DataFrame, one row for each run, sorted by curve and intensity: `curve`, the measure, the demand, and
            `ended`, false for a run that ended early, whose demand is a lower bound.
        fractiles: DataFrame, one row for each intensity: the measure, `curves`, `ended_early`, and one column for each
            fractile, such as `p50`; infinite where the fractile lies among runs that ended early, of a least value
            minus infinity.
        side: see `side_of`.
    """

    measure: str
    demand: str
    measure_unit: str
    unit: str
    curves: Any
    fractiles: Any
    side: Side = "most"

    @property
    def shares(self) -> list[str]:
        """Names of the columns of the fractiles, such as `p50`."""
        return [name for name in self.fractiles.columns if name.startswith("p")]


def ida(rows: Any, measure: str, demand: str, fractiles: Sequence[float] = FRACTILES) -> Ida:
    """IDA curves, and the fractiles of the demand at each intensity.

    The runs of a curve differ in their intensity only; there is one curve for each record, sample and bound. A run that
    ended early counts as a demand above all others, of a demand that is the least value over a run below all others,
    and so does every larger intensity of its curve. The fractile p of
    n curves is the smallest demand that at least p n curves do not exceed; where p n is a whole number, it is the mean
    of this demand and the next larger demand, so that the median of an even number of curves is the mean of the middle
    two. Where the curves have different intensities, such as spectral accelerations, demands are interpolated, from
    zero at zero; of least values, which are not zero there, from the first intensity that all curves have.

    rows: DataFrame of `read_study`, or a part of it. measure: column of the intensity measure, such as `scale` or
    `intensity`. demand: column of the demand, such as `peak_displacement`. fractiles: shares between 0 and 1. Raises
    InputError: unknown columns, intensities that are not positive, curves of a single intensity, invalid fractiles, or
    runs that ended early where the demand is no extreme over a run.
    """
    import pandas as pd

    if not fractiles or not all(0 < share < 1 for share in fractiles):
        raise InputError(f"fractiles = {list(fractiles)}: give shares between 0 and 1, such as 0.16")
    side, early = side_of(rows, demand), int((~complete(rows)).sum())
    if early and not side:
        raise InputError(
            f"{demand}: {early} runs ended early, and it is neither the largest nor the least value over a run, so "
            "that they say nothing about it; give --where status=ok to leave them out"
        )
    columns = {measure: intensities(rows, measure), demand: demands(rows, demand), "ended": complete(rows)}
    frame = pd.DataFrame({"curve": _curve_numbers(rows, measure), **columns})
    frame = frame.sort_values(["curve", measure], ignore_index=True)
    sizes = frame.groupby("curve")[measure].nunique()
    if sizes.min() < 2:
        raise InputError(f"{measure}: an IDA needs several intensities of each record; curve {sizes.idxmin()} has one")
    curves = [(c[measure].to_numpy(), c[demand].to_numpy(), c["ended"].to_numpy()) for _, c in frame.groupby("curve")]
    levels = _common_intensities(curves, side)
    values = np.sort([_interpolated(levels, *curve, side) for curve in curves], axis=0)
    table = {measure: levels, "curves": len(curves), "ended_early": np.isinf(values).sum(axis=0)}
    for share in fractiles:
        table[f"p{100 * share:g}"] = _fractile(values, share)
    return Ida(measure, demand, unit_of(rows, measure), unit_of(rows, demand), frame, pd.DataFrame(table), side)


def _fractile(values: Array, share: float) -> Array:
    """The fractile of every column of sorted rows, shape (columns,) (definition 2 of Hyndman and Fan, 1996)."""
    count = share * len(values)
    nearest = round(count)
    if abs(count - nearest) < 1e-9 * len(values):  # equal up to roundoff
        return np.asarray(values[max(nearest, 1) - 1 : nearest + 1].mean(axis=0))
    return np.asarray(values[ceil(count) - 1])


def _common_intensities(curves: list[DemandCurve], side: Side) -> Array:
    """The intensities of the fractiles: of the curves if equal in all, else a grid to the end of the shortest curve."""
    # A curve with a run that ended early counts as longer than any other.
    first = np.unique(curves[0][0])
    if all(np.array_equal(np.unique(x), first) for x, _, _ in curves):
        return first
    limit = min((x[-1] for x, _, ended in curves if ended.all()), default=max(x[-1] for x, _, _ in curves))
    if side != "most":
        return np.linspace(max(x[0] for x, _, _ in curves), limit, POINTS)
    return np.linspace(0, limit, POINTS + 1)[1:]


def _interpolated(levels: Array, x: Array, y: Array, ended: Any, side: Side) -> Array:
    """The demand of a curve at intensities `levels`, linear between its runs, shape of `levels`."""
    # Infinite beyond the last run before the first run that ended early, of a least value minus infinity.
    beyond = -np.inf if side == "least" else np.inf
    first_early = x[~ended].min(initial=np.inf)
    known = ended & (x < first_early)
    origin = [0.0] if side == "most" or not known.any() else []
    values = np.interp(levels, [*origin, *x[known]], [*origin, *y[known]])
    last = x[known].max(initial=0.0)
    return np.where((levels > last) & np.isfinite(first_early), beyond, values)


def _curve_numbers(rows: Any, measure: str) -> Any:
    """The number of the curve of each run, from 1; runs of a curve differ in intensity alone."""
    # The axes are the columns between `run` and `status`.
    names = list(rows.columns)
    check_columns(("run", "status"), names)
    changing = {measure, SCALE} if measure == INTENSITY else {measure}
    others = [name for name in names[names.index("run") + 1 : names.index("status")] if name not in changing]
    return rows.groupby(others, sort=False, dropna=False).ngroup().to_numpy() + 1 if others else 1


def ida_table(result: Ida) -> Table:
    """The fractiles as a table for a terminal."""
    rows = [
        [f"{row[result.measure]:.4g}", f"{row['curves']:.0f}", f"{row['ended_early']:.0f}"]
        + ["beyond" if np.isinf(row[name]) else f"{row[name]:.4g}" for name in result.shares]
        for _, row in result.fractiles.iterrows()
    ]
    unit = f" [{result.unit}]" if result.unit else ""
    title = f"fractiles of {result.demand}{unit} by {result.measure}"
    return Table(title, (result.measure, "curves", "ended early", *result.shares), rows)


def plot_ida(result: Ida, path: str | Path | None = None, title: str = "") -> Figure:
    """Intensity over demand: every curve, with a cross where a run ended early, and fractiles. path: see `page`."""
    scale = scale_of(result.curves[result.demand], result.unit)
    origin = [0.0] if result.side == "most" else []
    with page(*SIZE, path) as figure:
        headline(figure, title or "incremental dynamic analysis")
        axes = figure.subplots()
        for number, curve in result.curves.groupby("curve"):
            if number > MOST_CURVES:
                break
            x, y = curve[result.measure], scale.factor * curve[result.demand]
            axes.plot([*origin, *y], [*origin, *x], color=FAINT, linewidth=THIN / 2, alpha=0.6)
            early = ~curve["ended"]
            axes.plot(y[early][:1], x[early][:1], "x", color=FAINT, markersize=4)
        for name, colour in zip(result.shares, (COLOURS[0], INK, COLOURS[1], *COLOURS[2:]), strict=False):
            values = np.where(np.isinf(result.fractiles[name]), np.nan, scale.factor * result.fractiles[name])
            axes.plot(
                [*origin, *values], [*origin, *result.fractiles[result.measure]], color=colour, label=f"{name[1:]} %"
            )
        axes.set(xlabel=labelled(result.demand, scale.unit), ylabel=labelled(result.measure, result.measure_unit))
        axes.set(xlim=(0 if origin else None, None), ylim=(0, None))
        axes.legend(title="fractile of demand")
    return figure
