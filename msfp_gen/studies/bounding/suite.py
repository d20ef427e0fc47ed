"""Bounds under a suite of ground motions: means, worst values and envelopes over the records.

A scene for each record comes in; `bound` runs each; statistics go out, as tables, CSV and a figure.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import RunError
from msfp_gen.common.output import check_output
from msfp_gen.common.tables import Table, write_columns
from msfp_gen.figures.style import INK, distinct, headline, page, plain
from msfp_gen.results.quantities import Source, quantities
from msfp_gen.studies.bounding.factors import FactorTable
from msfp_gen.studies.bounding.runs import CASES, Progress, bound, shown_as

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from msfp_gen.scene.system import System

# Quantities of the figure, where the runs have them.
DRAWN = ("peak_displacement", "peak_force", "peak_floor_acceleration", "peak_drift_ratio", "capacity_left")
WORST: dict[str, Callable[..., Any]] = {"most": np.max, "least": np.min}


@dataclass(frozen=True)
class Statistic:
    """Statistics of a quantity over the records of a suite.

    name: column of `catalogue`. part: name of its bearing, storey, floor or surface; "" for the bearing or building as
    a whole. extreme: whether the largest or the least value is the worst. means, worst: by case [SI]. governs: case
    with the worst mean. record: record with the worst value of all.
    """

    name: str
    part: str
    unit: str
    extreme: Literal["most", "least", ""]
    means: tuple[float, ...]
    worst: tuple[float, ...]
    governs: str
    record: str

    @property
    def envelope(self) -> tuple[float, float]:
        """The worst mean and the worst value over the cases [SI]."""
        worst_of = WORST[self.extreme]
        return float(worst_of(self.means)), float(worst_of(self.worst))


@dataclass(frozen=True)
class SuiteBounds:
    """Result of `bound_suite`.

    Attributes:
        name: of the scene, for the figure.
        table: of factors.
        records: names of the motions.
        sources: column -> quantity, with the name of its bearing, storey, floor or surface.
        values: column -> values, shape (records, cases) [SI]; NaN where a run has none.
        failures: (record, case) -> message of a run that failed.
        undefined: column -> why runs that reached their end have no value.
        exceeded: (record, case) -> verdict of a run that exceeded limits of the device.
        stopped: (record, case) -> time at which a run met the stop condition of the scene [s].
    """

    name: str
    table: FactorTable
    records: tuple[str, ...]
    sources: Mapping[str, Source]
    values: Mapping[str, Array]
    failures: Mapping[tuple[str, str], str]
    undefined: Mapping[str, str]
    exceeded: Mapping[tuple[str, str], str]
    stopped: Mapping[tuple[str, str], float]

    @cached_property
    def statistics(self) -> tuple[Statistic, ...]:
        """The statistics of every quantity with a mean, as of `has_mean`."""
        return tuple(self._statistic(name, values) for name, values in self.values.items() if self.has_mean(name))

    def has_mean(self, name: str) -> bool:
        """Whether a column has a mean: a value of it governs, every run has one, and no run met the stop condition."""
        known = not self.stopped and not np.isnan(self.values[name]).any()
        return bool(self.sources[name].quantity.governs) and known

    def _statistic(self, name: str, values: Array) -> Statistic:
        quantity, _, part = self.sources[name]
        worst_of = WORST[quantity.governs]
        means, worst = values.mean(axis=0), worst_of(values, axis=0)
        case = CASES[int(np.flatnonzero(means == worst_of(means))[0])]
        record = self.records[int(np.argwhere(values == worst_of(values))[0][0])]
        numbers = tuple(means.tolist()), tuple(worst.tolist())
        return Statistic(name, part, quantity.unit, quantity.governs, *numbers, case, record)

    @property
    def left_out(self) -> dict[str, str]:
        """Column -> why it has no mean, for the columns of which a value governs."""
        runs, reasons = len(self.records) * len(CASES), dict(self.undefined)
        for incomplete, what in ((self.stopped, "met the stop condition of the scene"), (self.failures, "failed")):
            if incomplete:
                reason = f"{len(incomplete)} of {runs} runs {what}, so that a mean would be biased"
                reasons |= {name: reason for name, source in self.sources.items() if source.quantity.governs}
        return reasons

    def as_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON."""
        return {
            "factors": self.table.name,
            "records": list(self.records),
            "statistics": [vars(statistic) | {"envelope": statistic.envelope} for statistic in self.statistics],
            "left_out": self.left_out,
            "exceeded": [{"record": r, "case": c, "verdict": text} for (r, c), text in self.exceeded.items()],
            "stopped": [{"record": r, "case": c, "time": time} for (r, c), time in self.stopped.items()],
            "failures": [{"record": r, "case": c, "message": text} for (r, c), text in self.failures.items()],
        }


def bound_suite(
    scenes: Mapping[str, System], table: FactorTable, *, name: str = "", progress: Progress | None = None
) -> SuiteBounds:
    """Run the cases of `bound` under each motion of a suite, and keep the quantities of the runs.

    A run that fails is part of the result. Raises InputError as `bound`; RunError: no run reached its end.

    scenes: name of the record -> the scene with this motion. name: of the scene, for the figure. progress: as of
    `bound`.
    """
    first = next(iter(scenes.values()))
    sources = {name: source for name, source in quantities(first).items() if source.quantity.governs}
    values = {key: np.full((len(scenes), len(CASES)), np.nan) for key in sources}
    failures: dict[tuple[str, str], str] = {}
    undefined: dict[str, str] = {}
    exceeded: dict[tuple[str, str], str] = {}
    stopped: dict[tuple[str, str], float] = {}
    for row, (record, scene) in enumerate(scenes.items()):
        own_progress = None if progress is None else _progress_of(progress, row, len(scenes))
        try:
            cases = bound(scene, table, progress=own_progress).cases
        except RunError as error:
            failures |= {(record, case): str(error) for case in CASES}
            continue
        for column, case in enumerate(cases):
            if case.result is not None and case.result.verdict.exceeded:
                exceeded[record, case.name] = case.result.verdict.text
            if case.stopped_at is not None:
                stopped[record, case.name] = case.stopped_at
            if case.result is None or case.characterisation is None:
                failures[record, case.name] = case.failure
                continue
            for key, source in sources.items():
                if (value := case.value(source)) is not None:
                    values[key][row, column] = value
                elif reason := source.reason(case.characterisation):
                    undefined[key] = reason
    if len(failures) == len(scenes) * len(CASES):
        raise RunError(
            f"no run of the suite reached its end; the first: {next(iter(failures.values()))}", status="bound"
        )
    return SuiteBounds(name, table, tuple(scenes), sources, values, failures, undefined, exceeded, stopped)


def _progress_of(progress: Progress, row: int, count: int) -> Progress:
    """The progress of one record, by its index, as progress of a suite of `count` records."""
    return lambda done, whole: progress(row + done / whole, count)


def suite_bound_tables(bounds: SuiteBounds) -> list[Table]:
    """Tables of statistics, of quantities without a mean, and of runs that exceeded limits, were stopped, or failed.

    The statistics are of the bearing or building as a whole; `write_statistics` writes those of its parts too.
    """
    rows = []
    for statistic in bounds.statistics:
        if not statistic.part:
            unit, scale = shown_as(statistic.unit)
            numbers = [f"{value * scale:.4g}" for value in (*statistic.means, *statistic.worst)]
            name = f"{bounds.sources[statistic.name].words(statistic.name)} [{unit}]"
            rows.append((name, *numbers, statistic.governs, statistic.record))
    columns = ("", *(f"mean {case}" for case in CASES), *(f"worst {case}" for case in CASES), "governs", "worst record")
    reasons = [(bounds.sources[name].words(name), why) for name, why in bounds.left_out.items()]
    exceeded = [(f"{record}, {case}", verdict) for (record, case), verdict in bounds.exceeded.items()]
    stopped = [(f"{record}, {case}", f"{time:.4g} s") for (record, case), time in bounds.stopped.items()]
    failed = [(f"{record}, {case}", message) for (record, case), message in bounds.failures.items()]
    tables = [
        Table(f"{len(bounds.records)} records at bounds by {bounds.table.name}: means and worst values", columns, rows),
        Table("what has no mean, and why", (), reasons),
        Table("limits of the device that runs exceeded (docs/limits.md)", (), exceeded),
        Table("runs that met the stop condition of the scene", (), stopped),
        Table("runs that failed", (), failed),
    ]
    return [table for table in tables if table.rows]


def write_statistics(bounds: SuiteBounds, path: str | Path) -> Path:
    """Write the statistics as CSV in SI units: one row for each quantity, with the name of its part.

    Raises InputError for a path that does not end in .csv or cannot be written.
    """
    rows = bounds.statistics
    columns: dict[tuple[str, str], list[Any]] = {
        ("quantity", ""): [bounds.sources[row.name].words(row.name) for row in rows],
        ("of", ""): [row.part for row in rows],
        ("unit", ""): [row.unit or "1" for row in rows],
        **{(f"mean {case}", ""): [row.means[i] for row in rows] for i, case in enumerate(CASES)},
        **{(f"worst {case}", ""): [row.worst[i] for row in rows] for i, case in enumerate(CASES)},
        ("envelope of means", ""): [row.envelope[0] for row in rows],
        ("envelope of worst", ""): [row.envelope[1] for row in rows],
        ("governs", ""): [row.governs for row in rows],
        ("worst record", ""): [row.record for row in rows],
    }
    return write_columns(check_output(path, (".csv",)), columns)


def write_records(bounds: SuiteBounds, path: str | Path) -> Path:
    """Write the quantities of every run as CSV in SI units, one row for each record and case.

    Raises InputError for a path that does not end in .csv or cannot be written.
    """
    count = len(CASES)
    runs = [(record, case) for record in bounds.records for case in CASES]
    columns: dict[tuple[str, str], list[Any]] = {
        ("record", ""): [record for record, _ in runs],
        ("case", ""): [case for _, case in runs],
        ("failure", ""): [bounds.failures.get(run, "") for run in runs],
        ("stopped at", "s"): [bounds.stopped.get(run) for run in runs],
        ("limits exceeded", ""): [bounds.exceeded.get(run, "") for run in runs],
    }
    for name, values in bounds.values.items():
        cells = [None if np.isnan(value) else value for value in values.reshape(len(bounds.records) * count).tolist()]
        columns[bounds.sources[name].words(name), bounds.sources[name].quantity.unit or "1"] = cells
    return write_columns(check_output(path, (".csv",)), columns)


def plot_suite_bounds(bounds: SuiteBounds, path: str | Path | None = None) -> Figure:
    """The quantities DRAWN over the cases: each record in a colour of its own, and the means over the records.

    Runs without a value are not drawn. Raises InputError for a path that cannot be written.
    """
    plotted = [name for name in DRAWN if name in bounds.values and not np.isnan(bounds.values[name]).all()]
    colours = distinct(len(bounds.records))
    with page(3.4 * len(plotted) + 2.2, 4.4, path, "suite") as figure:
        headline(
            figure, f"{bounds.name or 'unnamed scene'}: {len(bounds.records)} records at bounds by {bounds.table.name}"
        )
        row = figure.subplots(1, len(plotted), squeeze=False)[0]
        for axes, name in zip(row, plotted, strict=True):
            _draw(axes, bounds, name, colours)
        handles, labels = row[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside right center")
    return figure


def _draw(axes: Axes, bounds: SuiteBounds, name: str, colours: Sequence[str]) -> None:
    unit, scale = shown_as(bounds.sources[name].quantity.unit)
    values = bounds.values[name] * scale
    for record, of_record, colour in zip(bounds.records, values, colours, strict=True):
        axes.plot(CASES, of_record, color=colour, marker="o", markersize=4, label=plain(record))
    if bounds.has_mean(name):
        axes.plot(CASES, values.mean(axis=0), color=INK, linewidth=2.5, label="mean")
    axes.set(title=bounds.sources[name].words(name), ylabel=f"[{unit}]")
    axes.set_ylim(bottom=min(0.0, float(np.nanmin(values))))
