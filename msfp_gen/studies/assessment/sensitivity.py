"""Sensitivity of a quantity to the random axes of a study: tornado and Sobol' indices."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from msfp_gen.common.errors import InputError
from msfp_gen.common.tables import Table
from msfp_gen.studies.assessment.rows import by_sample
from msfp_gen.studies.pool import require
from msfp_gen.studies.study.axes import Sampling


@dataclass(frozen=True)
class Bar:
    """One axis of a tornado: its two values, and the quantity at each, with all other axes at their medians."""

    axis: str
    low: float
    high: float
    at_low: float
    at_high: float

    @property
    def swing(self) -> float:
        """The difference of the quantity between both."""
        return abs(self.at_high - self.at_low)


@dataclass(frozen=True)
class Tornado:
    """Result of `tornado`: the quantity at the medians of all axes, and the bars, the longest first."""

    name: str
    unit: str
    statistic: str
    quantiles: tuple[float, float]
    base: float
    bars: tuple[Bar, ...]


@dataclass(frozen=True)
class Sobol:
    """Result of `sobol`.

    Attributes:
        name, unit, statistic: of the quantity.
        axes: names of the random axes, by falling total index.
        first, total: first-order and total index of each axis.
        first_interval, total_interval: half-widths of their confidence intervals.
        level: of confidence.
        samples: base samples.
    """

    name: str
    unit: str
    statistic: str
    axes: tuple[str, ...]
    first: tuple[float, ...]
    total: tuple[float, ...]
    first_interval: tuple[float, ...]
    total_interval: tuple[float, ...]
    level: float
    samples: int


def tornado(folder: str | Path, name: str, statistic: str = "median") -> Tornado:
    """The change of a quantity with each random axis alone.

    folder: of a study with `sampling.method = "one-at-a-time"`. statistic: over all runs of a sample, such as those of
    several records: "median", "mean", "max" or "min". Raises InputError.
    """
    samples = by_sample(folder, name, statistic, "one-at-a-time")
    low, high = samples.sampling.get("quantiles", Sampling("one-at-a-time").quantiles)
    bars = [
        Bar(
            axis,
            *(float(v) for v in samples.values[1 + 2 * k : 3 + 2 * k, k]),
            *(float(v) for v in samples.reduced[1 + 2 * k : 3 + 2 * k]),
        )
        for k, axis in enumerate(samples.axes)
    ]
    bars.sort(key=lambda bar: -bar.swing)
    return Tornado(name, samples.unit, statistic, (low, high), float(samples.reduced[0]), tuple(bars))


def sobol(folder: str | Path, name: str, statistic: str = "median", level: float = 0.95, seed: int = 0) -> Sobol:
    """First-order and total Sobol' indices of a quantity, by SALib (`msfp-gen[salib]`).

    folder: of a study with `sampling.method = "sobol-indices"`. statistic: as of `tornado`. level, seed: of the
    confidence intervals, which SALib computes by a bootstrap. Raises InputError.
    """
    require("SALib", "salib", "Sobol' indices")
    from SALib.analyze import sobol as analysis

    if not 0 < level < 1:
        raise InputError(f"level = {level:g}: give a share between 0 and 1, such as 0.95")
    samples = by_sample(folder, name, statistic, "sobol-indices")
    if not np.ptp(samples.reduced):
        raise InputError(f"{name}: it has the same value in all samples; give another quantity")
    count = len(samples.axes)
    problem = {"num_vars": count, "names": list(samples.axes), "bounds": [[0.0, 1.0]] * count}
    indices = analysis.analyze(
        problem, samples.reduced, calc_second_order=False, conf_level=level, print_to_console=False, seed=seed
    )
    order = np.argsort(-np.asarray(indices["ST"]), kind="stable")
    columns = {key: tuple(float(indices[key][k]) for k in order) for key in ("S1", "ST", "S1_conf", "ST_conf")}
    return Sobol(
        name, samples.unit, statistic, tuple(samples.axes[k] for k in order),
        columns["S1"], columns["ST"], columns["S1_conf"], columns["ST_conf"], level,
        len(samples.reduced) // (count + 2),
    )  # fmt: skip


def tornado_table(result: Tornado) -> Table:
    """The bars for a terminal."""
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


def sobol_table(result: Sobol) -> Table:
    """The indices for a terminal."""
    rows = [
        (
            axis,
            f"{result.first[k]:.3f}",
            f"± {result.first_interval[k]:.3f}",
            f"{result.total[k]:.3f}",
            f"± {result.total_interval[k]:.3f}",
        )
        for k, axis in enumerate(result.axes)
    ]
    title = (
        f"Sobol' indices of the {result.statistic} of {result.name}, {result.samples} samples, {100 * result.level:g} %"
    )
    return Table(title, ("axis", "first order", "", "total", ""), rows)
