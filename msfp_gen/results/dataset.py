"""The result of one bearing as an xarray.Dataset, its derivatives as another, and what a netCDF-4 file of it holds."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import MISSING, asdict, fields
from hashlib import sha256
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.results.extremes import Extremes
from msfp_gen.results.files import COUNTER, REMEDY, WORDS, Arrays, attributes_of, motion_in, notes_in, without
from msfp_gen.results.gradient import ENERGIES, ERROR, SERIES, WITH_INTEGRALS, Gradients
from msfp_gen.results.history import ENERGY, LABELS, STACK, Counters, Event, History, quantities
from msfp_gen.results.run_data import RunData
from msfp_gen.results.stored_group import Attribute, StoredGroup
from msfp_gen.scene.parameters import Parameter
from msfp_gen.scene.scene import Scene
from msfp_gen.specification.contract import EVENT_KINDS, names

if TYPE_CHECKING:
    import xarray as xr

Variables = Iterator[tuple[str, tuple[tuple[str, ...], Any, dict[str, str]]]]


def to_dataset(result: RunData) -> xr.Dataset:
    """The rows of `result` along `time`, its events along `event`; scene, status and provenance in the attributes."""
    import xarray as xr

    history = result.history
    variables = dict([*row_variables(history), *energy_variables(history), *_event_variables(result)])
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
    names = rows.columns(field)
    for column, name in enumerate(names):
        about = {"units": rows.unit, "long_name": rows.meaning.format(name)}
        yield name, (("time", *rows.column_dims), values[..., column] if len(names) > 1 else values, about)


def energy_variables(history: History) -> Variables:
    """Every energy of the rows."""
    for name, meaning in ENERGY.items():
        yield f"energy_{name}", (("time",), history.energy[name], {"units": "J", "long_name": meaning})


# Field of an event -> dimensions, type, unit and meaning of its variable `event_...`.
EVENTS: dict[str, tuple[tuple[str, ...], Any, str, str]] = {
    "time": ((), np.float64, "s", "time of the event"),
    "surface": ((), np.int64, "1", "surface, 0 for a stop"),
    "kind": ((), "<U16", "", "kind of the event"),
    "displacement": (("axis",), np.float64, "m", "displacement u then"),
    "top_force": (("axis",), np.float64, "N", "F_top then"),
}


def _event_variables(result: RunData) -> Variables:
    for field, (dims, kind, unit, meaning) in EVENTS.items():
        shape = (len(result.events), *(len(LABELS[dim]) for dim in dims))
        values = np.array([getattr(event, field) for event in result.events], dtype=kind).reshape(shape)
        yield f"event_{field}", (("event", *dims), values, {"long_name": meaning} | ({"units": unit} if unit else {}))


def _attributes(result: RunData) -> dict[str, str | int | float]:
    from msfp_gen.scene.file.stored_motion import PIECES, RECIPE, needs_pieces, scene_attribute

    scene, counters = scene_attribute(result.scene), asdict(result.counters)
    return attributes_of(result, edition(), scene, result.notes, counters) | {
        "extremes": json.dumps(result.extremes.table),
        "motion": PIECES if needs_pieces(result.scene) else RECIPE,
    }


DERIVED: dict[str, Any] = {}  # all variables are read


def edition() -> str:
    """A digest of the names that a file of this version has: of rows, energies, counters and labels."""
    rows = [rows.columns(field) for field, rows in quantities().items()]
    table = [*rows, ENERGY, *LABELS.items(), [field.name for field in fields(Counters)], WORDS]
    return sha256(json.dumps([list(each) for each in table]).encode()).hexdigest()[:12]


def fields_in(root: StoredGroup, about: dict[str, Attribute], arrays: Arrays) -> dict[str, Any]:
    """Scene, rows, events, counters, notes, extremes and derivatives, as `ResultFiles.fields_in`."""
    scene = _scene(root, about, arrays)
    surfaces = scene.bearing.layout.surfaces
    history = _history(root, surfaces, arrays)
    events = _events(root, surfaces, arrays)
    return {
        "scene": scene,
        "history": history,
        "events": events,
        "gradients": _gradients(root, history, len(events), about, arrays),
        "counters": Counters(**without(COUNTER, about)),  # type: ignore[arg-type]
        "notes": notes_in(about),
        "recorded_extremes": _extremes(json.loads(str(about["extremes"])), surfaces) if "extremes" in about else None,
    }


def _gradients(
    root: StoredGroup, history: History, events: int, about: dict[str, Attribute], arrays: Arrays
) -> Gradients | None:
    """The derivatives with respect to parameters, where the file has some."""
    if GRADIENT not in root:
        return None
    group, count = root.group(GRADIENT), len(history.time)
    read = group.attributes(lambda name: name in ("parameters", "extremes", f"extremes{ERROR}"))
    parameters = tuple(_parameter(table) for table in json.loads(str(read["parameters"])))
    sizes = dict.fromkeys(STACK, history.surfaces) | {name: len(labels) for name, labels in LABELS.items()}
    about |= {f"{GRADIENT}/{name}": value for name, value in read.items()}

    def array(name: str, *shape: int) -> Array:
        values: Array = group.array(name, (len(parameters), *shape))
        if not np.isfinite(values).all():
            raise ValueError(f"{name} of the gradient is not finite")
        arrays[f"{GRADIENT}/{name}"] = values
        return values

    def gradients(suffix: str = "", error: Gradients | None = None) -> Gradients:
        extremes = tuple(Extremes.of_table(table) for table in json.loads(str(read[f"extremes{suffix}"])))
        if len(extremes) != len(parameters) or not extremes:
            raise ValueError("the derivatives of the extremes are not those of the parameters")
        rows = {}
        for field, quantity in quantities().items():
            names = [name for name in (f"{name}{suffix}" for name in quantity.columns(field)) if name in group]
            if field != "time" and names:
                shape = (count, *(sizes[dim] for dim in quantity.column_dims))
                rows[field] = quantity.joined([array(name, *shape) for name in names])
        energies = WITH_INTEGRALS if "energy_input" in group else ENERGIES
        energy = {name: array(f"energy_{name}{suffix}", count) for name in energies}
        time, displacement, force = (
            array(f"event_{name}{suffix}", events, *(len(LABELS[dim]) for dim in EVENTS[name][0]))
            for name in EVENT_DERIVATIVES
        )
        return Gradients(parameters, rows, energy, time, displacement, force, extremes, error)

    derivatives = gradients(error=gradients(ERROR) if f"extremes{ERROR}" in read else None)
    needed = {field for field, _ in SERIES.values() if getattr(history, field) is not None}
    if missing := sorted(needed - derivatives.rows.keys()):
        raise ValueError(f"the gradient has no {missing[0]}")
    return derivatives


def _parameter(table: dict[str, Any]) -> Parameter:
    parameter = Parameter(**(table | {"index": tuple(table["index"])}))
    if not np.isfinite(parameter.value):
        raise ValueError(f"the value of {parameter.path} is not finite")
    return parameter


def _scene(root: StoredGroup, about: dict[str, Attribute], arrays: Arrays) -> Scene:
    """The scene of the file; its motion is in the scene, or as polynomials in a group of the file."""
    from msfp_gen.scene.file.loader import scene_from_table, toml_table
    from msfp_gen.scene.file.stored_motion import PIECES, RECIPE

    table, motion = toml_table(str(about["scene"])), None
    if about["motion"] == PIECES:
        motion, pieces, motion_about = motion_in(root)
        arrays |= pieces
        about |= motion_about
    elif about["motion"] != RECIPE:
        raise ValueError(f"motion = {about['motion']!r} is unknown")
    elif isinstance(table.get("motion"), dict) and table["motion"].get("file") is not None:
        raise InputError(f"motion.file = {table['motion']['file']!r}: a result opens no other file; {REMEDY}")
    return scene_from_table(table, motion=motion)


def _history(root: StoredGroup, surfaces: int, arrays: Arrays) -> History:
    """The rows; the time, which is stored as it is, gives their number."""
    count = root.length("time")
    sizes = dict.fromkeys(STACK, surfaces) | {name: len(labels) for name, labels in LABELS.items()}
    optional = {field.name for field in fields(History) if field.default is not MISSING}
    rows: Arrays = {}
    for field, quantity in quantities().items():
        if field in optional and not any(name in root for name in quantity.columns(field)):
            continue  # a quantity of an effect that the run did not model
        shape = (count, *(sizes[dim] for dim in quantity.column_dims))
        columns = {name: root.array(name, shape, compressed=name != "time") for name in quantity.columns(field)}
        arrays |= columns
        rows[field] = quantity.joined(list(columns.values()))
    energy = {name: root.array(f"energy_{name}", (count,)) for name in ENERGY}
    arrays |= {f"energy_{name}": values for name, values in energy.items()}
    return History(**rows, energy=energy)


def _events(root: StoredGroup, surfaces: int, arrays: Arrays) -> tuple[Event, ...]:
    count, columns = root.length("event_time"), dict[str, Any]()
    for field, (dims, kind, *_) in EVENTS.items():
        name, shape = f"event_{field}", (count, *(len(LABELS[dim]) for dim in dims))
        texts = field == "kind"
        values = root.texts(name, count, names(EVENT_KINDS)) if texts else root.array(name, shape, kind)
        arrays[name] = columns[field] = np.array(values, dtype=object) if texts else values
        if kind is np.float64 and not np.isfinite(values).all():
            raise ValueError("an event is not finite")
    surface = columns["surface"]
    if np.any((surface < 0) | (surface > surfaces)):
        raise ValueError("an event is of no surface")
    rows = zip(*columns.values(), strict=True)
    return tuple(Event(float(t), int(s), kind, u, force) for t, s, kind, u, force in rows)


def _extremes(given: dict[str, list[float]], surfaces: int) -> Extremes:
    """Extremes of all steps; the numbers are finite."""
    found = Extremes.of_table(given)
    for name, values in found.table.items():
        shape = np.shape(values)
        if shape != ((4,) if name in ("displacement", "top_force") else (surfaces,)) or not np.isfinite(values).all():
            raise ValueError(f"extremes: {name} is no list of finite numbers of the right length")
    return found


PARAMETER = "parameter"
GRADIENT = "gradient"  # group of the file
EVENT_DERIVATIVES = ("time", "displacement", "top_force")  # in the order of `Gradients`


def gradients_of(result: RunData) -> Gradients:
    """The derivatives of a run. Raises InputError where none were asked for."""
    if result.gradients is None:
        raise InputError("gradient: this run computed none; call simulate(scene, gradients=[path, ...])")
    return result.gradients


def to_gradient_dataset(result: RunData) -> xr.Dataset:
    """Derivatives of the variables of the dataset of a run, under their names, with the first dimension `parameter`.

    Where the errors of the derivatives were measured, each has a variable `..._error` beside it.
    Attributes of a variable: `units`, those of the quantity over `parameter_unit`, which differs between parameters;
    coordinate `parameter_unit`: unit of each parameter; `parameter_value`: its value in the scene.
    """
    import xarray as xr

    gradients = gradients_of(result)
    about = (("path", "", str), ("unit", "_unit", str), ("value", "_value", float))
    coordinates: dict[str, Any] = {
        f"{PARAMETER}{suffix}": (PARAMETER, np.array([getattr(p, name) for p in gradients.parameters], kind))
        for name, suffix, kind in about
    }
    variables = dict(_variables(gradients))
    if gradients.error is not None:
        for name, (dims, values, meaning) in _variables(gradients.error):
            variables[f"{name}{ERROR}"] = (
                dims,
                values,
                meaning | {"long_name": f"error of the {meaning['long_name']}"},
            )
    return xr.Dataset(variables, coordinates_of(result.history.time, result.history.surfaces) | coordinates)


def _variables(gradients: Gradients) -> Variables:
    yield from _rows(gradients)
    yield from _energies(gradients)
    yield from _event_derivatives(gradients)


def _derivative(unit: str, meaning: str) -> dict[str, str]:
    return {"units": f"{unit}/parameter_unit", "long_name": f"derivative of: {meaning}"}


def _rows(gradients: Gradients) -> Variables:
    for field, values in gradients.rows.items():
        for name, (dims, array, about) in named_columns(field, values):
            yield name, ((PARAMETER, *dims), array, _derivative(about["units"], about["long_name"]))


def _energies(gradients: Gradients) -> Variables:
    for name, values in gradients.energy.items():
        yield f"energy_{name}", ((PARAMETER, "time"), values, _derivative("J", ENERGY[name]))


def _event_derivatives(gradients: Gradients) -> Variables:
    for field in EVENT_DERIVATIVES:
        dims, _, unit, meaning = EVENTS[field]
        name = f"event_{field}"
        yield name, ((PARAMETER, "event", *dims), getattr(gradients, name), _derivative(unit, meaning))


def gradient_group(result: RunData) -> xr.Dataset:
    """The derivatives of a run, with its parameters and the derivatives of the extremes as attributes."""
    gradients, dataset = gradients_of(result), to_gradient_dataset(result)
    dataset.attrs["parameters"] = json.dumps([asdict(parameter) for parameter in gradients.parameters])
    dataset.attrs["extremes"] = json.dumps([extremes.table for extremes in gradients.extremes])
    if gradients.error is not None:
        dataset.attrs["extremes_error"] = json.dumps([extremes.table for extremes in gradients.error.extremes])
    return dataset


def groups_of(result: RunData) -> dict[str, xr.Dataset]:
    """The polynomials of the motion, where its table cannot make it again, and the derivatives of the run."""
    from msfp_gen.scene.file.stored_motion import GROUP, needs_pieces, to_pieces

    motion = {GROUP: to_pieces(result.scene.motion)} if needs_pieces(result.scene) else {}
    return motion | ({} if result.gradients is None else {GRADIENT: gradient_group(result)})
