"""Export of a result as CSV, Parquet or MATLAB file; netCDF is in `dataset.py`."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.output import check_output, replacing, write_bytes
from msfp_gen.errors import InputError
from msfp_gen.results.dataset import to_dataset
from msfp_gen.results.netcdf import write_netcdf
from msfp_gen.results.sign import DEFAULT, Sign, sign_of, signed

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.results.run_data import RunData


class Column(NamedTuple):
    """One column of the table of a run: variable of the dataset, name, unit, meaning, and one value per row."""

    variable: str
    name: str
    unit: str
    meaning: str
    values: Array


def save(result: RunData, path: str | Path) -> Path:
    """Write `result` in the format of the suffix: .nc, .parquet, .csv or .mat; completely or not at all.

    Raises InputError for an invalid path.
    """
    target = check_result_path(path)
    return WRITERS[target.suffix.lower()](result, target)


def export_columns(result: RunData, path: str | Path, names: Sequence[str] | None = None, sign: str = DEFAULT) -> Path:
    """Write some columns of `result` as CSV or Parquet, by the suffix; time is always the first.

    names: of columns (`displacement_E1`) or of variables of the dataset, for all of their columns (`sliding`), in the
    order in which they are written; None: all. sign: of displacement and force across the bearing, a word of
    `sign.SIGNS`. Raises InputError for another name, another sign or an invalid path.
    """
    target = check_output(path, TABLE_WRITERS, "output")
    return TABLE_WRITERS[target.suffix.lower()](result, target, names, sign)


def check_result_path(path: str | Path, name: str = "output") -> Path:
    """`path` if a result can be written there; raises InputError otherwise.

    name: that of the option, for the message.
    """
    return check_output(path, WRITERS, name)


def columns(dataset: xr.Dataset) -> list[Column]:
    """Every variable along time as columns, one for each component: `displacement_E1`, `sliding_2`, `tilt_3_psi`."""
    found = [_column(dataset["time"], "time", dataset["time"].to_numpy())]
    for name, variable in dataset.data_vars.items():
        if variable.dims[:1] == ("time",):
            values = variable.to_numpy()
            for index in np.ndindex(values.shape[1:]):
                labels = [str(dataset[dim].values[i]) for dim, i in zip(variable.dims[1:], index, strict=True)]
                found.append(_column(variable, "_".join([str(name), *labels]), values[(slice(None), *index)]))
    return found


def selected_columns(table: list[Column], names: Sequence[str] | None) -> list[Column]:
    """The columns with these names, or of these variables, after time; all for None. Raises InputError."""
    if names is None:
        return table
    chosen = [table[0]]
    for name in names:
        found = [column for column in table if name in (column.name, column.variable)]
        if not found:
            known = ", ".join(dict.fromkeys(column.variable for column in table))
            raise InputError(
                f"columns: {name!r} is none; give names of columns, such as displacement_E1, or of {known}"
            )
        chosen += [column for column in found if column not in chosen]
    return chosen


def _column(variable: xr.DataArray, name: str, values: Array) -> Column:
    return Column(str(variable.name), name, str(variable.attrs["units"]), str(variable.attrs["long_name"]), values)


def write_csv(result: RunData, path: str | Path, names: Sequence[str] | None = None, sign: str = DEFAULT) -> Path:
    """Write a CSV file: one comment, `name [unit]` as header, one line per row; the origin as # comments at the end.

    The origin is attributes of the dataset, events, and the scene as TOML text. names, sign: as of `export_columns`.
    """
    target = check_output(path, (".csv",))
    shown, result = sign_of(sign), signed(result, sign)
    dataset = to_dataset(result)
    table = selected_columns(columns(dataset), names)
    title = f"{result.scene.name or 'unnamed scene'}, status {result.status}; {_sign_text(shown)}"
    write_csv_table(target, table, title, _provenance(result, dataset))
    return target


def write_csv_table(path: Path, table: list[Column], title: str, origin: list[str]) -> None:
    """Write columns as CSV, with a comment before them, and the lines of their origin as comments after them."""
    rows = np.column_stack([column.values for column in table]).tolist()
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        about = "versions, events and scene stand after them"
        file.write(f"# {' '.join(title.split())}; {len(rows)} rows; {about}\n")
        file.write(",".join(f"{column.name} [{column.unit}]" for column in table) + "\n")
        file.writelines(",".join(map(repr, row)) + "\n" for row in rows)
        file.writelines(f"# {line}\n" for line in origin)


def _sign_text(shown: Sign) -> str:
    return f"u = {shown.difference.replace('−', '-')}, F {shown.force}"


def _provenance(result: RunData, dataset: xr.Dataset) -> list[str]:
    """Attributes of the dataset, events, and the scene as TOML text, as lines."""
    attributes = dict(dataset.attrs)
    scene = str(attributes.pop("scene")).splitlines()
    about = [f"{key}: {' '.join(str(value).split())}" for key, value in attributes.items()]
    return [*about, *(f"event: {json.dumps(event)}" for event in _events(result)), "scene:", *scene]


def _events(result: RunData) -> list[dict[str, Any]]:
    return [
        {
            "time": event.time,
            "surface": event.surface,
            "kind": event.kind,
            "displacement": np.asarray(event.displacement).tolist(),
            "top_force": np.asarray(event.top_force).tolist(),
        }
        for event in result.events
    ]


def write_parquet(result: RunData, path: str | Path, names: Sequence[str] | None = None, sign: str = DEFAULT) -> Path:
    """Write a Parquet file: units and meanings as metadata of columns, the rest as that of the file.

    names, sign: as of `export_columns`.
    """
    target = check_result_path(check_output(path, (".parquet",)))
    shown, result = sign_of(sign), signed(result, sign)
    dataset = to_dataset(result)
    about = {str(key): str(value) for key, value in dataset.attrs.items()}
    about |= {"sign": _sign_text(shown), "events": json.dumps(_events(result))}
    write_parquet_table(target, selected_columns(columns(dataset), names), about)
    return target


def write_parquet_table(path: Path, table: list[Column], about: dict[str, str]) -> None:
    """Write columns as Parquet, with metadata of the file."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [pa.field(c.name, pa.float64(), metadata={"units": c.unit, "long_name": c.meaning}) for c in table]
    content = BytesIO()
    arrays = [np.ascontiguousarray(c.values) for c in table]
    pq.write_table(pa.table(arrays, schema=pa.schema(fields, metadata=about)), content)
    write_bytes(path, [content.getbuffer()])


def write_mat(result: RunData, path: str | Path) -> Path:
    """Write a MATLAB 5 file: every variable of the dataset by name, and structs `units`, `meaning`, `attributes`."""
    target = check_output(path, (".mat",))
    write_mat_dataset(target, to_dataset(result))
    return target


def write_mat_dataset(path: Path, dataset: xr.Dataset) -> None:
    """Write a dataset as MATLAB 5 file, as `write_mat` does."""
    from scipy.io import savemat

    # One-dimensional arrays become column vectors, as usual in MATLAB, and texts become cells.
    content: dict[str, Any] = {str(name): _matlab(variable.to_numpy()) for name, variable in dataset.variables.items()}
    for key, attribute in (("units", "units"), ("meaning", "long_name")):
        content[key] = {str(n): v.attrs[attribute] for n, v in dataset.variables.items() if attribute in v.attrs}
    content["attributes"] = {str(key): value for key, value in dataset.attrs.items()}
    stream = BytesIO()
    savemat(stream, content, oned_as="column", long_field_names=True, do_compression=True)
    write_bytes(path, [stream.getbuffer()])


def _matlab(values: Any) -> Any:
    return values.astype(object) if values.dtype.kind == "U" else values


TABLE_WRITERS: dict[str, Callable[[RunData, str | Path, Sequence[str] | None, str], Path]] = {
    ".csv": write_csv,
    ".parquet": write_parquet,
}
WRITERS: dict[str, Callable[[RunData, str | Path], Path]] = {
    ".nc": write_netcdf,
    ".parquet": write_parquet,
    ".csv": write_csv,
    ".mat": write_mat,
}
