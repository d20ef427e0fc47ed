"""The rows of a study as a table of pandas: columns that evaluations take from it, and a quantity by random sample."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.tables import write_columns
from msfp_gen.scene.file.catalogue import suggestion
from msfp_gen.studies.study.chunks import parts_in, readable_parts, study_table

COMPLETE = "ok"  # the status of a run that reached its end
STATISTICS: dict[str, Callable[..., Any]] = {
    "median": np.median,
    "mean": np.mean,
    "max": np.max,
    "min": np.min,
}


def read_study(folder: str | Path, columns: Sequence[str] | None = None) -> Any:
    """The rows of a study as a pandas.DataFrame, sorted by run; those that are not computed yet are not in it.

    columns: only these, and `run` and `status`; None: all. Units are in `DataFrame.attrs["units"]`; `attrs["chosen"]`
    says whether an estimate chose the runs. Raises InputError: no study there, no rows yet, or an unknown column.
    """
    import pyarrow.dataset as ds

    folder = Path(folder)
    table = study_table(folder)
    parts = [str(folder / name) for name in sorted(parts_in(folder))]
    if not parts:
        raise InputError(f"{str(folder)!r}: the study has no rows yet; run it")
    checked = ds.ParquetFragmentScanOptions(page_checksum_verification=True)
    with readable_parts(folder):
        dataset = ds.dataset(parts, format=ds.ParquetFileFormat(default_fragment_scan_options=checked))
    for name in columns or ():
        if name not in dataset.schema.names:
            raise unknown_column(name, dataset.schema.names)
    wanted = None if columns is None else list(dict.fromkeys(["run", "status", *columns]))
    with readable_parts(folder):
        rows = dataset.to_table(columns=wanted).to_pandas().sort_values("run", ignore_index=True)
    rows.attrs["chosen"] = "listed" in table.get("accuracy", {})
    rows.attrs["units"] = {field.name: (field.metadata or {}).get(b"units", b"").decode() for field in dataset.schema}
    return rows


def chosen_rows(rows: Any, conditions: Sequence[str]) -> Any:
    """The rows in which columns have the values of all conditions, such as `bounds=upper`. Raises InputError."""
    for text in conditions:
        name, equals, value = text.partition("=")
        if not equals:
            raise InputError(f"{text!r}: give a column and a value, such as bounds=upper")
        if name not in rows.columns:
            raise unknown_column(name, list(rows.columns))
        column = rows[name]
        if column.dtype.kind == "f":
            try:
                chosen = np.isclose(column, float(value), rtol=1e-9, atol=0.0)
            except ValueError:
                raise InputError(f"{text!r}: {name} holds numbers; give one") from None
        else:
            chosen = np.asarray(column.astype(str) == value)
        if not chosen.any():
            raise InputError(f"{text!r}: no run has this value")
        rows = rows[chosen]
    return rows.reset_index(drop=True)


def write_frame(frame: Any, path: str | Path, name: str = "output") -> Path:
    """Write a DataFrame by `write_columns`, whose arguments and errors these are; without units."""
    columns = frame.astype(object).where(frame.notna(), None).items()
    return write_columns(path, {(column, ""): values.tolist() for column, values in columns}, name)


def unknown_column(name: str, known: Sequence[str]) -> InputError:
    """The error about a column that a study does not have."""
    hint = suggestion(name, list(known)) or f"; the columns are {', '.join(known)}"
    return InputError(f"{name}: no column of this study{hint}")


def numbers(rows: Any, name: str) -> Array:
    """A column as floats, shape (runs,) [its unit]; NaN: no value. Raises InputError: no such column, or texts."""
    if name not in rows.columns:
        raise unknown_column(name, list(rows.columns))
    try:
        return np.asarray(rows[name], dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: this column holds texts; give one of numbers") from None


def intensities(rows: Any, name: str) -> Array:
    """A column of positive numbers, shape (runs,) [its unit]: an intensity measure. Raises InputError."""
    values = numbers(rows, name)
    if not (values > 0).all():
        raise InputError(f"{name}: an intensity measure is above 0 in every run; give another column")
    return values


def demands(rows: Any, name: str) -> Array:
    """A column as demands, shape (runs,) [its unit]: of runs that ended early a lower bound, zero if they have none.

    Raises InputError where a run that reached its end has no value, and for runs that an estimate chose.
    """
    if rows.attrs.get("chosen"):
        raise InputError(
            f"{name}: the runs of an estimate were chosen where they decide most, which a curve through them does not "
            "know; give --estimate with --statistic fragility and a threshold, or run the study without an estimate"
        )
    values, ended = numbers(rows, name), complete(rows)
    if np.isnan(values[ended]).any():
        count = int(np.isnan(values[ended]).sum())
        raise InputError(f"{name}: {count} runs reached their end without a value; give another quantity")
    return np.where(np.isnan(values), 0.0, values)


def complete(rows: Any) -> Any:
    """Whether each run reached its end, ndarray of bool."""
    return np.asarray(rows["status"] == COMPLETE)


def unit_of(rows: Any, name: str) -> str:
    """The SI unit of a column, "" for a plain number."""
    return str(rows.attrs.get("units", {}).get(name, ""))


def labelled(name: str, unit: str) -> str:
    """A label of an axis or a column: words, and the unit in brackets."""
    return name.replace("_", " ") + (f" [{unit}]" if unit else "")


@dataclass(frozen=True)
class Samples:
    """A quantity by sample.

    Attributes:
        name, unit: of the quantity.
        statistic: over the runs of a sample.
        axes: names of the random axes.
        values: of the axes, ndarray, shape (samples, axes), [units of the axes].
        reduced: the statistic of each sample, ndarray, shape (samples,), [its unit].
        sampling: the table `[sampling]` of the study.
    """

    name: str
    unit: str
    statistic: str
    axes: tuple[str, ...]
    values: Array
    reduced: Array
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
    axes = tuple(axis for axis, keys in table["axes"].items() if "distribution" in keys)
    rows = read_study(folder, [*axes, name])
    if len(rows) < table["about"]["runs"]:
        raise InputError(f"{str(folder)!r}: {len(rows)} of {table['about']['runs']} runs are done; complete the study")
    if early := int((~complete(rows)).sum()):
        raise InputError(f"{name}: {early} runs ended early; see their status and message, and narrow the axes")
    y = numbers(rows, name)
    if np.isnan(y).any():
        raise InputError(f"{name}: {int(np.isnan(y).sum())} runs have no value; give another quantity")
    count = table["about"]["samples"]
    reduced = STATISTICS[statistic](y.reshape(-1, count), axis=0)
    return Samples(
        name, unit_of(rows, name), statistic, axes, rows[list(axes)].to_numpy(dtype=float)[:count], reduced, sampling
    )
