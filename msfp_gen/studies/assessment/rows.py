"""The rows of a study as a DataFrame, its columns as arrays, and labels and scales of the figures of evaluations.

The parts in the folder of a study come in; every evaluation of a study begins with the DataFrame that goes out.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.tables import write_columns
from msfp_gen.figures.style import Scale, engineering
from msfp_gen.results.quantities import Side
from msfp_gen.scene.file.catalogue import suggestion
from msfp_gen.studies.run import parts_in, readable_parts, study_table

SIZE = (6.8, 4.6)  # of a figure [inch]
COMPLETE = "ok"  # the status of a run that reached its end
STATISTICS: dict[str, Callable[..., Any]] = {
    "median": np.median,
    "mean": np.mean,
    "max": np.max,
    "min": np.min,
}


def read_study(folder: str | Path, columns: Sequence[str] | None = None) -> Any:
    """The rows that a study has so far, as a pandas.DataFrame, sorted by run.

    columns: to be read beside `run` and `status`; None: all. `DataFrame.attrs["units"]` has the units, and
    `attrs["sides"]` how runs that ended early bound a column. Raises
    InputError: the folder has no study, the study has no rows yet, or a column is unknown.
    """
    import pyarrow.dataset as ds

    folder = Path(folder)
    study_table(folder)
    parts = [str(folder / name) for name in sorted(parts_in(folder))]
    if not parts:
        raise InputError(f"{str(folder)!r}: the study has no rows yet; run it")
    checked = ds.ParquetFragmentScanOptions(page_checksum_verification=True)
    with readable_parts(folder):
        dataset = ds.dataset(parts, format=ds.ParquetFileFormat(default_fragment_scan_options=checked))
    check_columns(columns or (), dataset.schema.names)
    names = None if columns is None else list(dict.fromkeys(["run", "status", *columns]))
    with readable_parts(folder):
        rows = dataset.to_table(columns=names).to_pandas().sort_values("run", ignore_index=True)
    rows.attrs["sides"] = json.loads((dataset.schema.metadata or {}).get(b"sides", b"{}"))
    rows.attrs["units"] = {field.name: (field.metadata or {}).get(b"units", b"").decode() for field in dataset.schema}
    return rows


def chosen_rows(rows: Any, conditions: Sequence[str]) -> Any:
    """The rows that meet all conditions on columns, such as `bounds=upper`. Raises InputError."""
    for text in conditions:
        name, equals, value = text.partition("=")
        if not equals:
            raise InputError(f"{text!r}: give a column and a value, such as bounds=upper")
        check_columns([name], rows.columns)
        column = rows[name]
        if column.dtype.kind == "f":
            try:
                matches = np.isclose(column, float(value), rtol=1e-9, atol=0.0)
            except ValueError:
                raise InputError(f"{text!r}: {name} holds numbers; give one") from None
        else:
            matches = np.asarray(column.astype(str) == value)
        if not matches.any():
            raise InputError(f"{text!r}: no run has this value")
        rows = rows[matches]
    return rows.reset_index(drop=True)


def write_frame(frame: Any, path: str | Path, name: str = "output") -> Path:
    """Write a DataFrame without units; path, name and errors as in `write_columns`."""
    columns = frame.astype(object).where(frame.notna(), None).items()
    return write_columns(path, {(column, ""): values.tolist() for column, values in columns}, name)


def check_columns(names: Iterable[str], known: Iterable[str]) -> None:
    """Raise InputError for a column that a study does not have."""
    known = list(known)
    for name in names:
        if name not in known:
            hint = suggestion(name, known) or f"; the columns are {', '.join(known)}"
            raise InputError(f"{name}: no column of this study{hint}")


def check_share(name: str, value: float) -> None:
    """Raise InputError for a share, such as a level of confidence, that is not between 0 and 1."""
    if not 0 < value < 1:
        raise InputError(f"{name} = {value:g}: give a share between 0 and 1, such as 0.95")


def column_numbers(rows: Any, name: str) -> Array:
    """A column as floats, shape (runs,) [its unit]; NaN: no value. Raises InputError: unknown column, or texts."""
    check_columns([name], rows.columns)
    try:
        return np.asarray(rows[name], dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: this column holds texts; give one of numbers") from None


def intensities(rows: Any, name: str) -> Array:
    """A column of positive numbers, shape (runs,) [its unit]: an intensity measure. Raises InputError."""
    values = column_numbers(rows, name)
    if not (values > 0).all():
        raise InputError(f"{name}: an intensity measure is above 0 in every run; give another column")
    return values


def demands(rows: Any, name: str) -> Array:
    """A column as demands, shape (runs,) [its unit].

    For a run that ended early it is a bound, on the side of `side_of`; without a value 0, or infinite from above.

    Raises InputError where a run that reached its end has no value.
    """
    values = column_numbers(rows, name)
    if count := int(np.isnan(values[complete(rows)]).sum()):
        raise InputError(f"{name}: {count} runs reached their end without a value; give another quantity")
    return np.where(np.isnan(values), np.inf if side_of(rows, name) == "least" else 0.0, values)


def side_of(rows: Any, name: str) -> Side:
    """How runs that ended early bound a column: "most" from below, "least" from above, "" not at all.

    Columns that no study has written are taken for largest values.
    """
    side: Side = rows.attrs.get("sides", {}).get(name, "most")
    return side


def complete(rows: Any) -> Any:
    """Whether each run reached its end, ndarray of bool, shape (runs,)."""
    return np.asarray(rows["status"] == COMPLETE)


def unit_of(rows: Any, name: str) -> str:
    """The SI unit of a column, "" for a plain number."""
    return str(rows.attrs.get("units", {}).get(name, ""))


def labelled(name: str, unit: str) -> str:
    """A label of an axis or a column: words, and the unit in brackets."""
    return name.replace("_", " ") + (f" [{unit}]" if unit else "")


def scale_of(values: Any, unit: str) -> Scale:
    """The scale in which values are shown: lengths in mm, other quantities with a prefix, plain numbers unscaled."""
    if unit == "m":
        return Scale(1e3, "mm")
    finite: Array = np.asarray(values, dtype=float)
    return engineering(finite, unit) if unit else Scale(1.0, "")
