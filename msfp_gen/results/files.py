"""The files of a result, of one bearing or of a building: netCDF-4, which is read again, and tables.

A file may be damaged, or made by another person. It is data: its scene names no file, its motion lies in it. Every file
that is not as expected is refused with one InputError.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import asdict, dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.output import DATASET_SUFFIXES, check_output, replacing, write_bytes
from msfp_gen.common.tables import TABLE_SUFFIXES, parquet_bytes
from msfp_gen.motions.motion import Motion
from msfp_gen.results.gradients import ERROR
from msfp_gen.results.note import Note
from msfp_gen.results.sign import DEFAULT, SIGNED, shown_sign, sign_of
from msfp_gen.results.stored_group import Attribute, StoredGroup, file_in_memory, stored_groups
from msfp_gen.results.variables import Arrays, Places, columns_of

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.results.result import AnyResult

COUNTER, PROVENANCE = "counter_", "provenance_"  # prefixes of the attributes with counters and provenance
EDITION = "edition"  # attribute: of the names in a file; versions of msfp-gen with other names have another
TURNED = {f"{event}{name}{error}" for name in SIGNED for event in ("", "event_") for error in ("", ERROR)}
WORDS = ("scene", "motion", "status", "message", "notes")  # attributes that are texts
# What h5py, json, tomllib and NumPy raise for content that they cannot read.
DAMAGE = (ArithmeticError, AttributeError, LookupError, OSError, RuntimeError, TypeError, ValueError)
REMEDY = "give a file that `run -o` wrote"
OF_BUILDING = "msfp-gen bearing"  # attribute `source` of the file of one bearing of a building


@dataclass(frozen=True)
class Storage:
    """What makes the dataset of one kind of result, and reads its files.

    Attributes:
        to_dataset: the dataset of a result.
        arrays_of: the arrays of a result by field; the variables of the dataset are parts of them.
        columns: of a scene, the columns of an exported table, each with a variable and its index in this variable.
        edition: a digest of the names that a file of this version has.
        fields_in: the fields of a result from an opened file and its attributes, except status, message and provenance.
            Raises InputError, or what `DAMAGE` lists.
        groups_of: the groups of the netCDF-4 file of a result beside the dataset, by name.
        derived: variables of the dataset that follow from the others: they are written but not read.
    """

    to_dataset: Callable[[Any], xr.Dataset]
    arrays_of: Callable[[Any], Arrays]
    columns: Callable[[Any], Places]
    edition: Callable[[], str]
    fields_in: Callable[[StoredGroup, dict[str, Attribute]], dict[str, Any]]
    groups_of: Callable[[Any], dict[str, xr.Dataset]]
    derived: Collection[str] = ()


def to_netcdf(result: AnyResult, path: str | Path) -> Path:
    """Write the dataset and the scene as netCDF-4 file, completely or not at all; a failed run with its status.

    Derivatives with respect to parameters are in its group `gradient`. Displacement and force across bearings have the
    sign of `using_sign`, as the attribute `sign` says.

    Raises InputError where the suffix is not .nc or the folder does not exist.
    """
    from h5netcdf import File
    from xarray.backends import H5NetCDFStore

    path = check_output(path, DATASET_SUFFIXES)
    with file_in_memory() as stored:
        with File(stored, "w") as file:
            for name, group in [(None, result.dataset), *result.groups.items()]:
                content = _with_fixed_texts(signed(group))
                content.dump_to_store(H5NetCDFStore(file, group=name), encoding=_encoding(content, name))
        stored.flush()
        write_bytes(path, [stored.id.get_file_image()])
    return path


def to_csv(result: AnyResult, path: str | Path, columns: Sequence[str] | None = None) -> Path:
    """Write a CSV file: one comment, `name [unit]` as header, one line per row; then the origin as # comments.

    The origin is the attributes of the dataset, the events, and the scene as TOML text. columns: names as in
    `export_columns`. Raises InputError where the suffix is not .csv or the folder does not exist.
    """
    target = check_output(path, (".csv",))
    dataset = signed(result.dataset)
    table = selected_columns(table_of(dataset), columns)
    rows = np.column_stack([column.values for column in table]).tolist()
    title = " ".join(f"{result.title}, status {result.status}".split())
    about = "versions, events and scene stand after them"
    with replacing(target) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"# {title}; {_sign_text()}; {len(rows)} rows; {about}\n")
        file.write(",".join(f"{column.name} [{column.unit}]" for column in table) + "\n")
        file.writelines(",".join(map(repr, row)) + "\n" for row in rows)
        file.writelines(f"# {line}\n" for line in _origin(dataset))
    return target


def to_parquet(result: AnyResult, path: str | Path, columns: Sequence[str] | None = None) -> Path:
    """Write a Parquet file: units and meanings as metadata of columns, the rest as metadata of the file.

    columns: names as in `export_columns`. Raises InputError as `to_csv` does.
    """
    target = check_output(path, (".parquet",))
    dataset = signed(result.dataset)
    table = selected_columns(table_of(dataset), columns)
    about = {str(key): str(value) for key, value in dataset.attrs.items()}
    about |= {"sign": _sign_text(), "events": json.dumps(_events(dataset))}
    arrays = {(column.name, column.unit): np.ascontiguousarray(column.values) for column in table}
    meanings = {column.name: column.meaning for column in table}
    write_bytes(target, [parquet_bytes(arrays, dict.fromkeys(meanings, "double"), about, meanings)])
    return target


def to_mat(result: AnyResult, path: str | Path) -> Path:
    """Write a MATLAB 5 file: every variable of the dataset by name, and structs `units`, `meaning`, `attributes`.

    Raises InputError as `to_csv` does.
    """
    from scipy.io import savemat

    target, dataset = check_output(path, (".mat",)), signed(result.dataset)
    # One-dimensional arrays become column vectors, as usual in MATLAB, and texts become cells.
    arrays = {str(name): variable.to_numpy() for name, variable in dataset.variables.items()}
    content: dict[str, Any] = {n: v.astype(object) if v.dtype.kind == "U" else v for n, v in arrays.items()}
    for key, attribute in (("units", "units"), ("meaning", "long_name")):
        content[key] = {str(n): v.attrs[attribute] for n, v in dataset.variables.items() if attribute in v.attrs}
    content["attributes"] = {str(key): value for key, value in dataset.attrs.items()}
    stream = BytesIO()
    savemat(stream, content, oned_as="column", long_field_names=True, do_compression=True)
    write_bytes(target, [stream.getbuffer()])
    return target


def save(result: AnyResult, path: str | Path) -> Path:
    """Write the format of the suffix: .nc, .parquet, .csv or .mat. Raises InputError as the other writers do."""
    target = check_result_path(path)
    return WRITERS[target.suffix.lower()](result, target)


WRITERS: dict[str, Callable[..., Path]] = {
    ".nc": to_netcdf,
    ".parquet": to_parquet,
    ".csv": to_csv,
    ".mat": to_mat,
}


def check_result_path(path: str | Path, name: str = "output") -> Path:
    """`path` if a result can be written there; raises InputError otherwise.

    name: of the option, for the message.
    """
    return check_output(path, WRITERS, name)


def export_columns(result: AnyResult, path: str | Path, names: Sequence[str] | None = None) -> Path:
    """Write some columns of `result` as CSV or Parquet, by the suffix; time is always the first.

    names: of columns (`displacement_E1`) or of variables of the dataset, for all of their columns (`sliding`), in the
    order in which they are written; None: all. Raises InputError for another name or an invalid path.
    """
    target = check_output(path, TABLE_SUFFIXES, "output")
    return WRITERS[target.suffix.lower()](result, target, names)


class TableColumn(NamedTuple):
    """One column of the table of a run: variable of the dataset, name, unit, meaning, and values, shape (T,) [unit]."""

    variable: str
    name: str
    unit: str
    meaning: str
    values: Array


def table_of(dataset: xr.Dataset) -> list[TableColumn]:
    """Every variable along time as columns; see `columns_of`.

    Surfaces that a bearing of a building does not have are left out.
    """
    columns = [_column(dataset["time"], "time", dataset["time"].to_numpy())]
    for name, variable in dataset.data_vars.items():
        if variable.dims[:1] == ("time",):
            labels = {str(dim): dataset[dim].to_numpy() for dim in variable.dims[1:]}
            for column, index in columns_of(str(name), labels, labels):
                values = variable.to_numpy()[:, *index]
                if not (values.size and np.isnan(values[0])):
                    columns.append(_column(variable, column, values))
    return columns


def selected_columns(table: list[TableColumn], names: Sequence[str] | None) -> list[TableColumn]:
    """The columns with these names, or of these variables, after time; all for None. Raises InputError."""
    if names is None:
        return table
    chosen = [table[0]]
    for name in names:
        columns = [column for column in table if name in (column.name, column.variable)]
        if not columns:
            known = ", ".join(dict.fromkeys(column.variable for column in table))
            raise InputError(
                f"columns: {name!r} is none; give names of columns, such as displacement_E1, or of {known}"
            )
        chosen += [column for column in columns if column not in chosen]
    return chosen


def _column(variable: xr.DataArray, name: str, values: Array) -> TableColumn:
    return TableColumn(str(variable.name), name, str(variable.attrs["units"]), str(variable.attrs["long_name"]), values)


def _sign_text() -> str:
    sign = shown_sign()
    return f"u = {sign.difference.replace('−', '-')}, F {sign.force}"


def _origin(dataset: xr.Dataset) -> list[str]:
    """Attributes of the dataset, events, and the scene as TOML text, as lines."""
    attributes = dict(dataset.attrs)
    scene = str(attributes.pop("scene")).splitlines()
    about = [f"{key}: {' '.join(str(value).split())}" for key, value in attributes.items()]
    return [*about, *(f"event: {json.dumps(event)}" for event in _events(dataset)), "scene:", *scene]


def _events(dataset: xr.Dataset) -> list[dict[str, Any]]:
    """The events of a run as plain data; none of the run of a building."""
    columns = {str(name): values for name, values in dataset.data_vars.items() if values.dims[:1] == ("event",)}
    rows = zip(*(values.to_numpy().tolist() for values in columns.values()), strict=True)
    names = [name.removeprefix("event_") for name in columns]
    return [dict(zip(names, row, strict=True)) for row in rows]


def signed(dataset: xr.Dataset) -> xr.Dataset:
    """A dataset, or the derivatives in one, with displacement and force across bearings in the sign of `using_sign`."""
    sign = shown_sign()
    if sign.word == DEFAULT:
        return dataset
    of_rows = {str(name) for name, variable in dataset.data_vars.items() if {"time", "event"} & set(variable.dims)}
    changed = {name: dataset[name] for name in of_rows & TURNED}
    turned = dataset.assign({name: one.copy(data=sign.factor * one + 0.0) for name, one in changed.items()})  # no -0.0
    for name in changed:
        about = {"sign": sign.words if "displacement" in name else sign.force}
        turned[name].attrs = {**changed[name].attrs, **about}
    turned.attrs["sign"] = sign.word
    return turned


def attributes_of(
    result: Any, edition: str, scene: str, notes: Sequence[Note], counters: Mapping[str, float]
) -> dict[str, str | int | float]:
    """The attributes of every dataset: name, kind, how the run ended, notes, scene as TOML text, counters, versions."""
    return {
        "title": result.scene.name or "unnamed",
        "source": result.source,
        EDITION: edition,
        "status": result.status,
        "message": result.message,
        "notes": json.dumps([asdict(note) for note in notes]),
        "scene": scene,
        **{COUNTER + name: value for name, value in counters.items()},
        **{PROVENANCE + name: value for name, value in result.provenance.items()},
    }


def _with_fixed_texts(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset whose attributes have texts of fixed length: HDF5 may loop for ever over damaged ones of another."""
    import h5py

    def fixed(value: Any) -> Any:
        if not isinstance(value, str):
            return value
        content = value.encode()
        return np.array(content, h5py.string_dtype(length=max(len(content), 1)))

    stored = dataset.copy()
    for attributes in (stored.attrs, *(variable.attrs for variable in stored.variables.values())):
        attributes.update({name: fixed(value) for name, value in attributes.items()})
    return stored


def _encoding(dataset: xr.Dataset, group: str | None) -> dict[Hashable, dict[str, Any]]:
    """Checksums of all arrays, characters for texts, and compression of rows and of the pieces of a motion."""
    # The lowest compression level suffices: histories of stuck surfaces and of rims repeat most values.
    from msfp_gen.scene.file.stored_motion import COMPRESSED

    encoding: dict[Hashable, dict[str, Any]] = {}
    for name, values in dataset.variables.items():
        if values.size and values.dims:
            encoding[name] = {"fletcher32": True}
            if values.dtype.kind not in "if":
                # h5netcdf does not find a dimension of characters in the group above: those of groups have other names.
                length = f"{'group_' if group else ''}{name}_characters"
                encoding[name] |= {"dtype": "S1", "char_dim_name": length}
            elif name in COMPRESSED or (name in dataset.data_vars and "time" in values.dims):
                encoding[name] |= {"zlib": True, "complevel": 1}
    return encoding


def _is_read(name: str) -> bool:
    return name in (*WORDS, "source", EDITION, "extremes", "fidelity", "sign") or name.startswith((COUNTER, PROVENANCE))


def read_result(path: str | Path, kind_of: Callable[[str], Any]) -> Any:
    """The result in a file of `to_netcdf`. kind_of: class of results, by the attribute `source`; None: there is none.

    Raises InputError for other files.
    """
    path = Path(path)
    try:
        if not path.is_file():
            raise InputError("no such file; give the name of a result")
        with stored_groups(path) as root:
            return _result_in(root, kind_of)
    except InputError as error:
        raise InputError(f"path = {str(path)!r}: {error}") from None
    except DAMAGE as error:
        raise InputError(f"path = {str(path)!r}: no netCDF-4 file that can be read ({error}); {REMEDY}") from error
    except MemoryError:
        raise InputError(f"path = {str(path)!r}: this result does not fit into memory; free some") from None


def _result_in(root: StoredGroup, kind_of: Callable[[str], Any]) -> Any:
    about = root.attributes(_is_read)
    source, edition = str(about.pop("source", None)), about.pop(EDITION, None)
    if source == OF_BUILDING:
        raise InputError("this is the result of one bearing of a building; give the file of the building, which has it")
    if (kind := kind_of(source)) is None:
        raise InputError(f"no result of msfp-gen; {REMEDY}")
    try:
        return _read(root, about, kind)
    except (InputError, *DAMAGE) as error:
        if edition != kind.storage.edition():
            raise InputError(
                "another version of msfp-gen wrote this result, which this one cannot read; run its scene again "
                "(attribute scene)"
            ) from error
        raise


def _read(root: StoredGroup, about: dict[str, Attribute], kind: Any) -> Any:
    if not all(isinstance(about.get(name), str) for name in WORDS):
        raise ValueError(f"an attribute of {', '.join(WORDS)} is no text")
    if sign_of(str(about.pop("sign", DEFAULT))).word != DEFAULT:
        root = root.turning(TURNED - set(kind.storage.derived))
    fields = kind.storage.fields_in(root, about)
    if not str(about["status"]).isidentifier():
        raise ValueError(f"status = {about['status']!r} is no word")
    for name, value in without(COUNTER, about).items():
        if not isinstance(value, float if name == "wall_time" else int) or not 0 <= value < math.inf:
            raise ValueError(f"attribute {COUNTER}{name} is no count")
    fields |= {name: str(about[name]) for name in ("status", "message")}
    fields["provenance"] = {name: str(value) for name, value in without(PROVENANCE, about).items()}
    return kind(**fields)


def without(prefix: str, attributes: Mapping[str, Attribute]) -> dict[str, Attribute]:
    """The attributes with a prefix, by their names without it."""
    return {name.removeprefix(prefix): value for name, value in attributes.items() if name.startswith(prefix)}


def notes_in(about: Mapping[str, Attribute]) -> tuple[Note, ...]:
    """The notes of a file; the numbers in them are finite. Raises ValueError."""
    notes = tuple(Note(**table) for table in json.loads(str(about["notes"])))
    for note in notes:
        texts, numbers = (note.kind, note.text, note.action), (note.time, note.value)
        valid = all(isinstance(text, str) for text in texts) and type(note.surface) is type(note.bearing) is int
        if not valid or not all(type(x) in (int, float) and math.isfinite(x) for x in numbers):
            raise ValueError("a note is damaged")
    return notes


def motion_in(root: StoredGroup, name: str = "motion") -> Motion:
    """The motion that a group of a file has as polynomials."""
    from msfp_gen.scene.file.stored_motion import from_pieces

    group = root.group(name)
    count = group.rows("knots")
    shapes = {"knots": (count,), "coefficients": (max(0, count - 1), 6, 6), "jumps": (group.rows("jumps"),)}
    pieces = {key: group.array(key, shape, compressed=key != "knots") for key, shape in shapes.items()}
    return from_pieces(pieces, group.attributes(lambda key: key in ("name", "metadata", "max_step")))
