"""A result as an xarray.Dataset."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.files import attributes_of
from msfp_gen.results.history import ENERGY, LABELS, History, quantities
from msfp_gen.results.run_data import RunData

if TYPE_CHECKING:
    import xarray as xr


Variables = Iterator[tuple[str, tuple[tuple[str, ...], Any, dict[str, str]]]]


def to_dataset(result: RunData) -> xr.Dataset:
    """The rows of `result` along `time`, its events along `event`; scene, status and provenance in the attributes."""
    import xarray as xr

    history = result.history
    variables = dict([*row_variables(history), *energy_variables(history), *_events(result)])
    return xr.Dataset(variables, coordinates_of(history.time, history.surfaces), attrs=_attributes(result))


def coordinates_of(time: Array, surfaces: int) -> dict[str, Any]:
    """The coordinates of the dataset: time [s], bodies, surfaces, and the labels of dimensions of fixed length."""
    return {
        "time": ("time", time, {"units": "s", "long_name": "time t"}),
        "body": ("body", np.arange(2, surfaces + 2), {"long_name": "moving body k, base is 1"}),
        "surface": ("surface", np.arange(1, surfaces + 1), {"long_name": "sliding surface, bottom first"}),
        **{dim: (dim, np.array(labels)) for dim, labels in LABELS.items()},
    }


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

    scene, counters = scene_attribute(result.scene), asdict(result.counters)
    return attributes_of(result, scene, result.notes, counters) | {
        "extremes": json.dumps(result.extremes.table),
        "motion": PIECES if needs_pieces(result.scene) else RECIPE,
    }
