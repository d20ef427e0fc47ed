"""A quantity of a study by sample of its random axes, reduced over all other axes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.studies.assessment.rows import complete, numbers, read_study, unit_of
from msfp_gen.studies.study.chunks import study_table

STATISTICS: dict[str, Callable[..., Any]] = {
    "median": np.median,
    "mean": np.mean,
    "max": np.max,
    "min": np.min,
}


@dataclass(frozen=True)
class Samples:
    """A quantity by sample.

    Attributes:
        name, unit: of the quantity.
        statistic: over the runs of a sample.
        axes: names of the random axes.
        values: of the axes, ndarray, shape (samples, axes).
        found: the statistic of each sample, ndarray, shape (samples,).
        sampling: the table `[sampling]` of the study.
    """

    name: str
    unit: str
    statistic: str
    axes: tuple[str, ...]
    values: Array
    found: Array
    sampling: dict[str, Any]


def by_sample(folder: str | Path, name: str, statistic: str, method: str) -> Samples:
    """The quantity of a study by sample.

    Raises InputError: another sampling method, runs that are missing or ended early, or a run without a value.
    """
    if statistic not in STATISTICS:
        raise InputError(f"statistic = {statistic!r}: give one of {', '.join(STATISTICS)}")
    table = study_table(Path(folder))
    sampling = dict(table.get("sampling", {}))
    if sampling.get("method", "latin-hypercube") != method:
        raise InputError(f"{str(folder)!r}: this needs a study with sampling.method = {method!r}")
    axes = tuple(axis for axis, given in table["axes"].items() if "distribution" in given)
    rows = read_study(folder, [*axes, name])
    if len(rows) < table["about"]["runs"]:
        raise InputError(f"{str(folder)!r}: {len(rows)} of {table['about']['runs']} runs are done; complete the study")
    if early := int((~complete(rows)).sum()):
        raise InputError(f"{name}: {early} runs ended early; see their status and message, and narrow the axes")
    y = numbers(rows, name)
    if np.isnan(y).any():
        raise InputError(f"{name}: {int(np.isnan(y).sum())} runs have no value; give another quantity")
    count = table["about"]["samples"]
    found = STATISTICS[statistic](y.reshape(-1, count), axis=0)
    return Samples(
        name, unit_of(rows, name), statistic, axes, rows[list(axes)].to_numpy(dtype=float)[:count], found, sampling
    )
