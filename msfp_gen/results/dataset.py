"""A result as an xarray.Dataset, and as a netCDF-4 file."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.output import DATASET_SUFFIXES, check_output, write_bytes
from msfp_gen.results.history import ENERGY, LABELS, History, quantities
from msfp_gen.results.reading import COUNTER, DIGEST, PROVENANCE, digest_of
from msfp_gen.results.run_data import RunData

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.results.stored_group import ArrayDigest


Variables = Iterator[tuple[str, tuple[tuple[str, ...], Any, dict[str, str]]]]


def to_dataset(result: RunData) -> xr.Dataset:
    """The rows of `result` along `time`, its events along `event`; scene, status and provenance in the attributes."""
    import xarray as xr

    history = result.history
    variables = dict([*row_variables(history), *energy_variables(history), *_events(result)])
    return xr.Dataset(variables, coordinates_of(history), attrs=_attributes(result))


def coordinates_of(history: History) -> dict[str, Any]:
    """The coordinates of the dataset: time, bodies, surfaces, and the labels of dimensions of fixed length."""
    return {
        "time": ("time", history.time, {"units": "s", "long_name": "time t"}),
        "body": ("body", np.arange(2, history.surfaces + 2), {"long_name": "moving body k, base is 1"}),
        "surface": ("surface", np.arange(1, history.surfaces + 1), {"long_name": "sliding surface, bottom first"}),
        **{dim: (dim, np.array(labels)) for dim, labels in LABELS.items()},
    }


def write_netcdf(result: RunData, path: str | Path) -> Path:
    """Write the dataset of `result` to `path`, completely or not at all. Raises InputError for an invalid path."""
    from msfp_gen.scene.file.stored_motion import GROUP, PIECES, to_pieces

    path = check_output(path, DATASET_SUFFIXES)
    dataset = to_dataset(result)
    pieces = to_pieces(result.scene.motion) if dataset.attrs["motion"] == PIECES else None
    dataset.attrs[DIGEST] = digest_of_dataset(dataset, pieces)
    write_groups(path, dataset, {} if pieces is None else {GROUP: pieces})
    return path


def write_groups(path: Path, dataset: xr.Dataset, groups: Mapping[str, xr.Dataset]) -> None:
    """Write a dataset, and others as groups, as one netCDF-4 file, completely or not at all."""
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    from msfp_gen.scene.file.stored_motion import COMPRESSED

    # The lowest compression level suffices: histories of stuck surfaces and of rims repeat most values.
    encoding = {
        name: {"zlib": True, "complevel": 1}
        for name, variable in dataset.data_vars.items()
        if "time" in variable.dims and variable.size
    }
    # The file is made in memory, because HDF5 crashes instead of raising an error when the disk is full.
    content = BytesIO()
    with h5netcdf.File(content, "w") as file:
        dataset.dump_to_store(H5NetCDFStore(file), encoding=encoding)
        for name, group in groups.items():
            used = {key: value for key, value in COMPRESSED.items() if key in group}
            group.dump_to_store(H5NetCDFStore(file, group=name), encoding=used)
    write_bytes(path, [content.getbuffer()])


def digest_of_dataset(
    dataset: xr.Dataset, pieces: xr.Dataset | None, rows: Mapping[str, ArrayDigest] | None = None
) -> str:
    """The digest of the values that `read_result` reads. rows: of what was written in blocks, instead of `dataset`."""
    from msfp_gen.scene.file.stored_motion import GROUP

    arrays: dict[str, Any] = {str(name): variable.to_numpy() for name, variable in dataset.data_vars.items()}
    arrays["time"] = dataset["time"].to_numpy()
    about = dict(dataset.attrs)
    arrays |= rows or {}
    if pieces is not None:
        arrays |= {f"{GROUP}/{name}": variable.to_numpy() for name, variable in pieces.data_vars.items()}
        about |= {f"{GROUP}/{name}": value for name, value in pieces.attrs.items()}
    return digest_of(about, arrays)


def row_variables(history: History) -> Variables:
    """Every quantity of the rows but their time."""
    for field, values in history.arrays().items():
        if field != "time":
            yield from named_columns(field, values)


def named_columns(field: str, values: Any) -> Variables:
    """The variables of one field of `History`: several where each of its components has a name."""
    rows = quantities()[field]
    dims, names = ("time", *rows.dims), rows.names or (field,)
    split = len(names) > 1  # one variable for each component
    for column, name in enumerate(names):
        about = {"units": rows.unit, "long_name": rows.meaning.format(name)}
        yield name, (dims[:-1], values[..., column], about) if split else (dims, values, about)


def energy_variables(history: History) -> Variables:
    """Every energy of the rows."""
    for name, meaning in ENERGY.items():
        yield f"energy_{name}", (("time",), history.energy[name], {"units": "J", "long_name": meaning})


def _events(result: RunData) -> Variables:
    events = result.events
    vectors = (len(events), 3)
    columns: dict[str, tuple[tuple[str, ...], Any, str, str]] = {
        "event_time": ((), np.array([event.time for event in events], float), "s", "time of the event"),
        "event_surface": ((), np.array([event.surface for event in events], np.int64), "1", "surface, 0 for a stop"),
        "event_kind": ((), np.array([event.kind for event in events], dtype="<U16"), "", "kind of the event"),
        "event_displacement": (
            ("axis",),
            np.reshape([event.displacement for event in events], vectors),
            "m",
            "displacement u then",
        ),
        "event_top_force": (("axis",), np.reshape([event.top_force for event in events], vectors), "N", "F_top then"),
    }
    for name, (dims, values, unit, meaning) in columns.items():
        attributes = {"long_name": meaning} | ({"units": unit} if unit else {})
        yield name, (("event", *dims), values, attributes)


def _attributes(result: RunData) -> dict[str, str | int | float]:
    from msfp_gen.scene.file.stored_motion import PIECES, RECIPE, needs_pieces, scene_attribute

    return {
        "title": result.scene.name or "unnamed",
        "source": "msfp-gen",
        "status": result.status,
        "message": result.message,
        "notes": json.dumps([asdict(note) for note in result.notes]),
        "extremes": json.dumps(result.extremes.table),
        "scene": scene_attribute(result.scene),
        "motion": PIECES if needs_pieces(result.scene) else RECIPE,
        **_prefixed(COUNTER, asdict(result.counters)),
        **_prefixed(PROVENANCE, result.provenance),
    }


def _prefixed(prefix: str, values: Mapping[str, Any]) -> dict[str, Any]:
    return {prefix + name: value for name, value in values.items()}
