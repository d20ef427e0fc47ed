"""The result of one bearing as an xarray.Dataset, its derivatives as another, and what a netCDF-4 file of it holds."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, asdict, fields, replace
from functools import lru_cache, singledispatch
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.errors import InputError
from msfp_gen.results.files import (
    COUNTER,
    OF_BUILDING,
    REMEDY,
    WORDS,
    Storage,
    attributes_of,
    motion_in,
    notes_in,
    without,
)
from msfp_gen.results.gradients import ERROR, EVENTS, Gradients, energy_terms
from msfp_gen.results.history import (
    ENERGY,
    ENERGY_BELOW,
    LABELS,
    SERIES,
    STACK,
    BearingRows,
    Counters,
    Event,
    Extremes,
    History,
    row_fields,
)
from msfp_gen.results.note import Note
from msfp_gen.results.stored_group import Attribute, StoredGroup
from msfp_gen.results.variables import (
    Arrays,
    Labels,
    Places,
    Variable,
    column_places,
    dataset_of,
    digest_of_names,
    label_coordinates,
    stored_fields,
)
from msfp_gen.scene.parameters import Parameter
from msfp_gen.scene.scene import Scene
from msfp_gen.specification.contract import EVENT_KINDS, names

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.results.result import Mounting, Result


def _rows() -> Iterator[tuple[str, Variable]]:
    """Every quantity of the rows: several variables where each of its components has a name. Then every energy."""
    for field, rows in row_fields().items():
        dims, several = ("time", *rows.dims), len(rows.names) > 1
        for index, name in enumerate(rows.names or (field,)):
            part: Any = {"dims": dims[:-1], "part": (..., index), "whole": dims} if several else {"dims": dims}
            yield name, Variable(unit=rows.unit, meaning=rows.meaning.format(name), field=field, **part)
    for name, meaning in ENERGY.items():
        yield f"energy_{name}", Variable(("time",), "J", meaning, f"energy_{name}")


ROWS = dict(_rows())
VARIABLES = ROWS | {
    "event_time": Variable(("event",), "s", "time of the event", "event_time"),
    "event_surface": Variable(("event",), "1", "surface, 0 for a stop", "event_surface", kind=np.int64),
    "event_kind": Variable(
        ("event",), "", "kind of the event", "event_kind", kind="<U16", words=tuple(names(EVENT_KINDS))
    ),
    "event_displacement": Variable(("event", "axis"), "m", "displacement u then", "event_displacement"),
    "event_top_force": Variable(("event", "axis"), "N", "F_top then", "event_top_force"),
}
OPTIONAL = {field.name for field in fields(History) if field.default is not MISSING}  # of effects
BELOW = {  # of a bearing of a building
    name: Variable(("time",), "J", meaning, name)
    for name, meaning in ((f"energy_{name}", meaning) for name, meaning in ENERGY_BELOW.items())
}


def to_dataset(result: Result) -> xr.Dataset:
    """The rows of `result` along `time`, its events along `event`; scene, status and provenance in the attributes."""
    about = _attributes(result) if result.mounting is None else _attributes_below(result, result.mounting)
    return dataset_of(
        VARIABLES | BELOW, arrays_of(result), label_coordinates(labels_of(result.history.surfaces)), about
    )


def arrays_of(result: Result) -> Arrays:
    """The arrays of a result by field; each variable is one of them or a part of one."""
    return rows_of(result.history) | {
        name: np.array([getattr(event, name.removeprefix("event_")) for event in result.events], variable.kind).reshape(
            len(result.events), *(len(LABELS[dim]) for dim in variable.dims[1:])
        )
        for name, variable in VARIABLES.items()
        if variable.dims[0] == "event"
    }


def rows_of(history: BearingRows) -> Arrays:
    """The arrays of the rows, by field."""
    return history.arrays() | {f"energy_{name}": values for name, values in history.energy.items()}


def labels_of(surfaces: int) -> Labels:
    """Numbers of bodies and surfaces, and the labels of dimensions of fixed length."""
    return {"body": range(2, surfaces + 2), "surface": range(1, surfaces + 1), **LABELS}


@lru_cache(maxsize=16)
def _columns(surfaces: int) -> Places:
    return column_places(ROWS, labels_of(surfaces))


@singledispatch
def columns(system: Any) -> Places:
    """The columns of a table of all rows, as in `column_places`; a run has the columns of its effects."""
    places: Places = system.columns()
    return places


@columns.register(Scene)
def _columns_of_scene(scene: Scene) -> Places:
    return _columns(scene.bearing.layout.surfaces)


def _attributes(result: Result) -> dict[str, str | int | float]:
    from msfp_gen.scene.file.stored_motion import PIECES, RECIPE, needs_pieces, scene_attribute

    scene, _, counters = result.alone
    return attributes_of(result, edition(), scene_attribute(scene), result.notes, asdict(counters)) | {
        "extremes": json.dumps(result.extremes.table),
        "motion": PIECES if needs_pieces(scene) else RECIPE,
        **({} if scene.fidelity == "exact" else {"fidelity": scene.fidelity}),
    }


def _attributes_below(one: Result, mounting: Mounting) -> dict[str, str | int | float]:
    """Attributes of a bearing of a building, for other programs: its file is not read again."""
    from msfp_gen.scene.file.loader import bearing_table, dumps, plain_table

    parts = {"bearing": bearing_table(mounting.bearing), "interface": plain_table(mounting.interface)}
    text = dumps({"axial_load": mounting.axial_load, **parts})
    return attributes_of(one, "", text, one.notes, {}) | {"source": OF_BUILDING, "bearing": mounting.label}


def edition() -> str:
    """A digest of the names that a file of this version has: of variables, counters and labels."""
    classes = (Counters, Extremes, Note)
    return digest_of_names([*VARIABLES, *LABELS.items(), *([f.name for f in fields(one)] for one in classes), WORDS])


def fields_in(root: StoredGroup, about: Mapping[str, Attribute]) -> dict[str, Any]:
    """Scene, rows, events, counters, notes, extremes and derivatives, as `Storage.fields_in`."""
    scene = _scene(root, about)
    surfaces = scene.bearing.layout.surfaces
    sizes = dict.fromkeys(STACK, surfaces) | {name: len(labels) for name, labels in LABELS.items()}
    sizes |= {"time": root.rows("time"), "event": root.rows("event_time")}
    variables = {name: v for name, v in VARIABLES.items() if v.field not in OPTIONAL or name in root}
    read = stored_fields(root, variables, sizes)
    energy = {name: read.pop(f"energy_{name}") for name in ENERGY}
    history = History(**{field: read[field] for field in row_fields() if field in read}, energy=energy)
    return {
        "scene": scene,
        "history": history,
        "events": _events(read, surfaces),
        "gradients": _gradients(root, sizes),
        "counters": Counters(**without(COUNTER, about)),  # type: ignore[arg-type]
        "notes": notes_in(about),
        "recorded_extremes": _extremes(json.loads(str(about["extremes"])), surfaces) if "extremes" in about else None,
    }


def _gradients(root: StoredGroup, sizes: dict[str, int]) -> Gradients | None:
    """The derivatives with respect to parameters, where the file has some."""
    if GRADIENT not in root:
        return None
    group = root.group(GRADIENT)
    attributes = group.attributes(lambda name: name in ("parameters", "extremes", f"extremes{ERROR}"))
    parameters = tuple(_parameter(table) for table in json.loads(str(attributes["parameters"])))
    sizes = {**sizes, PARAMETER: len(parameters)}
    quantity = {name for name, variable in ROWS.items() if variable.field in row_fields()} - {"time"}
    terms = energy_terms("energy_input" in group, "energy_seat_stored" in group)
    energies = [f"energy_{name}" for name in terms]

    def gradients(suffix: str = "", error: Gradients | None = None) -> Gradients:
        extremes = tuple(Extremes.of_table(table) for table in json.loads(str(attributes[f"extremes{suffix}"])))
        if len(extremes) != len(parameters) or not extremes:
            raise ValueError("the derivatives of the extremes are by other parameters")
        rows = [name for name in ROWS if name in quantity and name + suffix in group]
        variables = {f"{name}{suffix}": _derivative(VARIABLES[name]) for name in (*rows, *energies, *EVENTS)}
        read = stored_fields(group, variables, sizes)
        return Gradients(parameters, read, extremes, error)

    derivatives = gradients(error=gradients(ERROR) if f"extremes{ERROR}" in attributes else None)
    needed = {SERIES[name][0] for name in derivatives.extremes[0].arrays}
    if missing := sorted(needed - derivatives.arrays.keys()):
        raise ValueError(f"the gradient has no {missing[0]}")
    return derivatives


def _parameter(table: dict[str, Any]) -> Parameter:
    parameter = Parameter(**(table | {"index": tuple(table["index"])}))
    if not np.isfinite(parameter.value):
        raise ValueError(f"the value of {parameter.path} is not finite")
    return parameter


def _scene(root: StoredGroup, about: Mapping[str, Attribute]) -> Scene:
    """The scene of the file; its motion is in the scene, or as polynomials in a group of the file."""
    from msfp_gen.scene.file.loader import scene_from_table, toml_table
    from msfp_gen.scene.file.stored_motion import PIECES, RECIPE

    table, motion = toml_table(str(about["scene"])), None
    if about["motion"] == PIECES:
        motion = motion_in(root)
    elif about["motion"] != RECIPE:
        raise ValueError(f"motion = {about['motion']!r} is unknown")
    elif isinstance(table.get("motion"), dict) and table["motion"].get("file") is not None:
        raise InputError(f"motion.file = {table['motion']['file']!r}: a result opens no other file; {REMEDY}")
    table = table if motion is None else {name: part for name, part in table.items() if name != "motion"}
    scene = scene_from_table(table, parts={} if motion is None else {"motion": motion})
    return replace(scene, fidelity=str(about["fidelity"])) if "fidelity" in about else scene


def _events(read: Arrays, surfaces: int) -> tuple[Event, ...]:
    """The events of arrays by field."""
    surface = read["event_surface"]
    if np.any((surface < 0) | (surface > surfaces)):
        raise ValueError("an event is of no surface")
    columns = (read[name] for name, variable in VARIABLES.items() if variable.dims[0] == "event")
    rows = zip(*columns, strict=True)
    return tuple(Event(float(t), int(s), kind, u, force) for t, s, kind, u, force in rows)


def _extremes(table: dict[str, Any], surfaces: int) -> Extremes:
    """Extremes of all steps and their times; the numbers are finite."""
    extremes = Extremes.of_table(table)
    if extremes.times.keys() != extremes.arrays.keys():
        raise ValueError("extremes: times and values have different names")
    for name, values in (*extremes.arrays.items(), *extremes.times.items()):
        shape = (4,) if name in ("displacement", "top_force") else (surfaces,)
        if values.shape != shape or not np.isfinite(values).all():
            raise ValueError(f"extremes: {name} is no list of finite numbers of the right length")
    return extremes


PARAMETER = "parameter"
GRADIENT = "gradient"  # group of the file


def gradients_of(result: Result) -> Gradients:
    """The derivatives of a run. Raises InputError where none were asked for."""
    if result.gradients is None:
        raise InputError("gradient: this run computed none; call simulate(scene, gradients=[path, ...])")
    return result.gradients


def to_gradient_dataset(result: Result) -> xr.Dataset:
    """Derivatives of the variables of the dataset of a run, under their names, with the first dimension `parameter`.

    Where the errors of the derivatives were measured, each has a variable `..._error` beside it.
    Attributes of a variable: `units`, the unit of the quantity over `parameter_unit`, which differs between parameters;
    coordinate `parameter_unit`: unit of each parameter; `parameter_value`: its value in the scene.
    """
    gradients = gradients_of(result)
    about = (("path", "", str), ("unit", "_unit", str), ("value", "_value", float))
    coordinates: dict[str, Any] = {
        f"{PARAMETER}{suffix}": (PARAMETER, np.array([getattr(p, name) for p in gradients.parameters], kind))
        for name, suffix, kind in about
    }
    time = ROWS["time"]
    coordinates |= {"time": (time.dims, result.history.time, time.about)}
    variables = {name: _derivative(variable) for name, variable in VARIABLES.items()}
    arrays = dict(gradients.arrays)
    if gradients.error is not None:
        errors = {f"{name}{ERROR}": v._replace(field=f"{v.field}{ERROR}") for name, v in variables.items()}
        variables |= {name: v._replace(meaning=f"error of the {v.meaning}") for name, v in errors.items()}
        arrays |= {f"{field}{ERROR}": values for field, values in gradients.error.arrays.items()}
    return dataset_of(variables, arrays, label_coordinates(labels_of(result.history.surfaces)) | coordinates, {})


def _derivative(variable: Variable) -> Variable:
    """The derivatives of a variable."""
    return variable._replace(
        dims=(PARAMETER, *variable.dims),
        whole=(PARAMETER, *variable.whole),
        unit=f"{variable.unit}/parameter_unit",
        meaning=f"derivative of: {variable.meaning}",
    )


def gradient_group(result: Result) -> xr.Dataset:
    """The derivatives of a run, with its parameters and the derivatives of the extremes as attributes."""
    gradients, dataset = gradients_of(result), to_gradient_dataset(result)
    dataset.attrs["parameters"] = json.dumps([asdict(parameter) for parameter in gradients.parameters])
    dataset.attrs["extremes"] = json.dumps([extremes.table for extremes in gradients.extremes])
    if gradients.error is not None:
        dataset.attrs["extremes_error"] = json.dumps([extremes.table for extremes in gradients.error.extremes])
    return dataset


def groups_of(result: Result) -> dict[str, xr.Dataset]:
    """The polynomials of the motion, where its table cannot make it again, and the derivatives of the run.

    None below a building: such a file is for other programs.
    """
    from msfp_gen.scene.file.stored_motion import GROUP, needs_pieces, to_pieces

    if result.mounting is not None:
        return {}
    scene = result.alone.scene
    motion = {GROUP: to_pieces(scene.motion)} if needs_pieces(scene) else {}
    return motion | ({} if result.gradients is None else {GRADIENT: gradient_group(result)})


STORAGE = Storage(to_dataset, arrays_of, columns, edition, fields_in, groups_of)
