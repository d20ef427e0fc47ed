"""A result as an xarray.Dataset, and as a netCDF-4 file."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from msfp_gen.common.output import DATASET_SUFFIXES, check_output, write_bytes
from msfp_gen.errors import InputError
from msfp_gen.results.extremes import Extremes
from msfp_gen.results.history import ENERGY, LABELS, Counters, Event, History, quantities
from msfp_gen.results.note import Note
from msfp_gen.results.run_data import RunData

if TYPE_CHECKING:
    import xarray as xr


COUNTER, PROVENANCE = "counter_", "provenance_"  # prefixes of the attributes with counters and provenance
R = TypeVar("R", bound=RunData)
Variables = Iterator[tuple[str, tuple[tuple[str, ...], Any, dict[str, str]]]]


def to_dataset(result: RunData) -> xr.Dataset:
    """The rows of `result` along `time`, its events along `event`; scene, status and provenance in the attributes."""
    import xarray as xr

    history = result.history
    coordinates = {
        "time": ("time", history.time, {"units": "s", "long_name": "time t"}),
        "body": ("body", np.arange(2, history.surfaces + 2), {"long_name": "moving body k, base is 1"}),
        "surface": ("surface", np.arange(1, history.surfaces + 1), {"long_name": "sliding surface, bottom first"}),
        **{dim: (dim, np.array(labels)) for dim, labels in LABELS.items()},
    }
    variables = dict([*_rows(history), *_energies(history), *_events(result)])
    return xr.Dataset(variables, coordinates, attrs=_attributes(result))


def write_netcdf(result: RunData, path: str | Path) -> Path:
    """Write the dataset of `result` to `path`, completely or not at all. Raises InputError for an invalid path."""
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    from msfp_gen.scene.file.stored_motion import COMPRESSED, GROUP, PIECES, to_pieces

    path = check_output(path, DATASET_SUFFIXES)
    dataset = to_dataset(result)
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
        if dataset.attrs["motion"] == PIECES:
            to_pieces(result.scene.motion).dump_to_store(H5NetCDFStore(file, group=GROUP), encoding=COMPRESSED)
    write_bytes(path, [content.getbuffer()])
    return path


def read_netcdf(path: str | Path, group: str | None = None) -> xr.Dataset:
    """The dataset of a file that `Result.to_netcdf` wrote, in memory. Raises InputError for any other file.

    group: "motion" for the base motion of files whose scene does not contain it; None: the run.
    """
    import xarray as xr

    try:
        with xr.open_dataset(path, engine="h5netcdf", group=group) as dataset:
            return dataset.load()
    except FileNotFoundError as error:
        raise InputError(f"path = {str(path)!r}: no such file; give the name of a result") from error
    except OSError as error:
        raise InputError(f"path = {str(path)!r}: not a netCDF-4 file that can be read; give the name of one") from error


def read_result(path: str | Path, kind: type[R]) -> R:
    """The result in a file of `Result.to_netcdf`, as an instance of `kind`. Raises InputError for any other file."""
    from msfp_gen.scene.file.loader import scene_from_table
    from msfp_gen.scene.file.stored_motion import GROUP, PIECES, from_pieces

    dataset = read_netcdf(path)
    if dataset.attrs.get("source") != "msfp-gen":
        raise InputError(f"path = {str(path)!r}: no result of msfp-gen; give a file that `run -o` wrote")
    attributes = dataset.attrs
    scene = tomllib.loads(attributes["scene"])
    if attributes.get("motion") == PIECES:
        scene["motion"] = from_pieces(read_netcdf(path, GROUP))
    return kind(
        scene_from_table(scene),
        _history(dataset),
        _event_list(dataset),
        Counters(**_without(COUNTER, attributes)),
        attributes["status"],
        attributes["message"],
        _without(PROVENANCE, attributes),
        tuple(Note(**note) for note in json.loads(attributes.get("notes", "[]"))),
        Extremes.of_table(json.loads(attributes["extremes"])) if "extremes" in attributes else None,
    )


def _rows(history: History) -> Variables:
    for field, values in history.arrays().items():
        if field == "time":
            continue
        rows = quantities()[field]
        dims, names = ("time", *rows.dims), rows.names or (field,)
        split = len(names) > 1  # one variable for each component
        for column, name in enumerate(names):
            about = {"units": rows.unit, "long_name": rows.meaning.format(name)}
            yield name, (dims[:-1], values[..., column], about) if split else (dims, values, about)


def _energies(history: History) -> Variables:
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


def _without(prefix: str, attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """The inverse of `_prefixed`; NumPy scalars become Python numbers."""
    return {
        str(name).removeprefix(prefix): value.item() if isinstance(value, np.generic) else value
        for name, value in attributes.items()
        if str(name).startswith(prefix)
    }


def _history(dataset: xr.Dataset) -> History:
    arrays = {}
    for field, rows in quantities().items():
        if not set(rows.names or (field,)) <= set(dataset.variables):
            continue  # a quantity of an effect that the run did not model
        columns = [dataset[name].to_numpy() for name in rows.names or (field,)]
        arrays[field] = columns[0] if len(columns) == 1 else np.stack(columns, axis=-1)
    return History(**arrays, energy={name: dataset[f"energy_{name}"].to_numpy() for name in ENERGY})


def _event_list(dataset: xr.Dataset) -> tuple[Event, ...]:
    columns = [dataset[f"event_{name}"].to_numpy() for name in ("time", "surface", "kind", "displacement", "top_force")]
    return tuple(
        Event(float(time), int(surface), str(kind), displacement, force)  # type: ignore[arg-type]
        for time, surface, kind, displacement, force in zip(*columns, strict=True)
    )
