"""A result as an xarray.Dataset, and that as a netCDF-4 file."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.errors import InputError
from msfp_gen.history import ENERGY, LABELS, Counters, Event, History, quantities
from msfp_gen.notes import Note
from msfp_gen.output import DATASET_SUFFIXES, check_output, write_bytes

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.result import Result

COUNTER, PROVENANCE = "counter_", "provenance_"  # prefixes of attributes
Variables = Iterator[tuple[str, tuple[tuple[str, ...], Any, dict[str, str]]]]


def to_dataset(result: Result) -> xr.Dataset:
    """The rows of `result` along `time`, its events along `event`, and where they came from in the attributes."""
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


def write_netcdf(result: Result, path: str | Path) -> Path:
    """Write the dataset of `result` to `path`, whole or not at all. Raises InputError for a path that cannot be."""
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    from msfp_gen.kept_motion import COMPRESSED, GROUP, PIECES, to_pieces

    path = check_output(path, DATASET_SUFFIXES)
    dataset = result.dataset
    # Light compression: histories of stuck surfaces and closed rims are mostly repeats.
    encoding = {
        name: {"zlib": True, "complevel": 1}
        for name, variable in dataset.data_vars.items()
        if "time" in variable.dims and variable.size
    }
    # Made in memory: on a disk that is full HDF5 itself does not fail, it crashes.
    content = BytesIO()
    with h5netcdf.File(content, "w") as file:
        dataset.dump_to_store(H5NetCDFStore(file), encoding=encoding)
        if dataset.attrs["motion"] == PIECES:
            to_pieces(result.scene.motion).dump_to_store(H5NetCDFStore(file, group=GROUP), encoding=COMPRESSED)
    write_bytes(path, [content.getbuffer()])
    return path


def read_netcdf(path: str | Path, group: str | None = None) -> xr.Dataset:
    """The dataset that `Result.to_netcdf` wrote, in memory. Raises InputError where `path` is not such a file.

    group: of the file; "motion" holds the motion of the base where the scene alone would not make it again.
    """
    import xarray as xr

    try:
        with xr.open_dataset(path, engine="h5netcdf", group=group) as dataset:
            return dataset.load()
    except FileNotFoundError as error:
        raise InputError(f"path = {str(path)!r}: no such file; give the name of a result") from error
    except OSError as error:
        raise InputError(f"path = {str(path)!r}: not a netCDF-4 file that can be read; give the name of one") from error


def read_result(path: str | Path) -> Result:
    """The result that `Result.to_netcdf` wrote, its scene included. Raises InputError where `path` holds none."""
    from msfp_gen.kept_motion import GROUP, PIECES, from_pieces
    from msfp_gen.result import Result
    from msfp_gen.scenefile import scene_from_table

    dataset = read_netcdf(path)
    if dataset.attrs.get("source") != "msfp-gen":
        raise InputError(f"path = {str(path)!r}: no result of msfp-gen; give a file that `run -o` wrote")
    attributes = dataset.attrs
    scene = tomllib.loads(attributes["scene"])
    if attributes.get("motion") == PIECES:
        scene["motion"] = from_pieces(read_netcdf(path, GROUP))
    return Result(
        scene_from_table(scene), _history(dataset), _event_list(dataset),
        Counters(**_without(COUNTER, attributes)), attributes["status"], attributes["message"],
        _without(PROVENANCE, attributes), tuple(Note(**note) for note in json.loads(attributes.get("notes", "[]"))),
    )  # fmt: skip


def _rows(history: History) -> Variables:
    for field, values in history.arrays().items():
        if field == "time":
            continue
        rows = quantities()[field]
        dims, names = ("time", *rows.dims), rows.names or (field,)
        split = len(names) > 1  # one variable a component
        for column, name in enumerate(names):
            about = {"units": rows.unit, "long_name": rows.meaning.format(name)}
            yield name, (dims[:-1], values[..., column], about) if split else (dims, values, about)


def _energies(history: History) -> Variables:
    for name, meaning in ENERGY.items():
        yield f"energy_{name}", (("time",), history.energy[name], {"units": "J", "long_name": meaning})


def _events(result: Result) -> Variables:
    events = result.events
    vectors = (len(events), 3)
    columns: dict[str, tuple[tuple[str, ...], Any, str, str]] = {
        "event_time": ((), np.array([event.time for event in events], float), "s", "time of the event"),
        "event_surface": ((), np.array([event.surface for event in events], np.int64), "1", "surface, 0 for a stop"),
        "event_kind": ((), np.array([event.kind for event in events], dtype="<U16"), "", "what happened"),
        "event_displacement": (
            ("axis",), np.reshape([event.displacement for event in events], vectors), "m", "displacement u then"
        ),
        "event_top_force": (("axis",), np.reshape([event.top_force for event in events], vectors), "N", "F_top then"),
    }  # fmt: skip
    for name, (dims, values, unit, meaning) in columns.items():
        attributes = {"long_name": meaning} | ({"units": unit} if unit else {})
        yield name, (("event", *dims), values, attributes)


def _attributes(result: Result) -> dict[str, str | int | float]:
    from msfp_gen.kept_motion import PIECES, RECIPE, needs_pieces, recipe

    return {
        "title": result.scene.name or "unnamed",
        "source": "msfp-gen",
        "status": result.status,
        "message": result.message,
        "notes": json.dumps([asdict(note) for note in result.notes]),
        "scene": recipe(result.scene),
        "motion": PIECES if needs_pieces(result.scene) else RECIPE,
        **_prefixed(COUNTER, asdict(result.counters)),
        **_prefixed(PROVENANCE, result.provenance),
    }


def _prefixed(prefix: str, values: Mapping[str, Any]) -> dict[str, Any]:
    return {prefix + name: value for name, value in values.items()}


def _without(prefix: str, attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """The inverse of `_prefixed`; numbers of numpy as Python's."""
    return {
        str(name).removeprefix(prefix): value.item() if isinstance(value, np.generic) else value
        for name, value in attributes.items()
        if str(name).startswith(prefix)
    }


def _history(dataset: xr.Dataset) -> History:
    arrays = {}
    for field, rows in quantities().items():
        if not set(rows.names or (field,)) <= set(dataset.variables):
            continue  # an effect that the run did not have
        columns = [dataset[name].to_numpy() for name in rows.names or (field,)]
        arrays[field] = columns[0] if len(columns) == 1 else np.stack(columns, axis=-1)
    return History(**arrays, energy={name: dataset[f"energy_{name}"].to_numpy() for name in ENERGY})


def _event_list(dataset: xr.Dataset) -> tuple[Event, ...]:
    columns = [dataset[f"event_{name}"].to_numpy() for name in ("time", "surface", "kind", "displacement", "top_force")]
    return tuple(
        Event(float(time), int(surface), str(kind), displacement, force)  # type: ignore[arg-type]
        for time, surface, kind, displacement, force in zip(*columns, strict=True)
    )
