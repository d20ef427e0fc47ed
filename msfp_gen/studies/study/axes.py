"""The axes of a study, what each of them changes in the base scene, and the scenes of their values.

Workers make the scene of a run from the base scene as a table. Only this module knows what the base of a study is;
parts, pools and evaluations know rows.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from msfp_gen.buildings.file import AnyScene, located_value, reduced, scene_of
from msfp_gen.errors import InputError
from msfp_gen.scene.file.catalogue import suggestion
from msfp_gen.scene.file.changes import changed_table, keys_of, multiplied_table
from msfp_gen.scene.file.motion_tables import RecordMotion
from msfp_gen.scene.scene import Scene
from msfp_gen.studies.bounding import bounded_scene
from msfp_gen.studies.bounding.factors import FactorTable
from msfp_gen.studies.study.sampling import Distribution, distribution_from, number_of

Table = dict[str, Any]
KEYS = ("sets", "multiplies", "factors", "surfaces", "values", "labels", "range", "points", "spacing", "distribution")
RESERVED = ("run", "status", "message")
SPACINGS = ("linear", "log")
MOST_VALUES = 10_000  # of one axis; workers receive them all


@dataclass(frozen=True)
class Axis:
    """One axis of a study.

    Attributes:
        name: of its column in the table.
        change: what a value does to the scene: "sets" fields, "multiplies" fields, selects the case of a table of
            lambda "factors", selects a "record", scales it ("scale"), or nothing ("free").
        paths: the fields, such as `bearing.friction`; for "factors" the table of factors.
        surfaces: of these surfaces only (1..n-1); None: of all.
        values: of a grid; None for a random axis.
        labels: the values in the column of the table, all numbers or all texts.
        distribution: of a random axis; None for a grid.
    """

    name: str
    change: str
    paths: tuple[str, ...] = ()
    surfaces: tuple[int, ...] | None = None
    values: tuple[Any, ...] | None = None
    labels: tuple[Any, ...] = ()
    distribution: Distribution | None = None

    @property
    def random(self) -> bool:
        """Whether the values are drawn from a distribution."""
        return self.distribution is not None

    @property
    def numeric(self) -> bool:
        """Whether the column of the axis holds numbers."""
        return self.random or all(isinstance(label, float) for label in self.labels)


def axis_from(name: str, table: Any) -> Axis:
    """The axis of a table `[axes.NAME]`. Raises InputError of one line that starts with `axes.NAME`."""
    path = f"axes.{name}"
    if not isinstance(table, Mapping):
        raise InputError(f"{path} = {table!r}: give a table, such as sets = 'bearing.friction', values = [0.05, 0.08]")
    if not re.fullmatch(r"[^\W\d]\w*", name) or name in RESERVED:
        why = "the table has such a column" if name in RESERVED else "a name has letters, digits and _ only"
        raise InputError(f"{path}: {why}; give another name")
    try:
        change, paths = _change(table)
        axis = Axis(name, change, paths, _surfaces(table))
        complete, used = _with_values(axis, table)
    except InputError as error:
        raise InputError(f"{path}.{error}") from None
    known = {*used, "sets", "multiplies", "factors", "surfaces"}
    if extra := [key for key in table if key not in known]:
        everything = {*KEYS, "between", "low", "mode", "high", "mean", "deviation", "median", "dispersion"}
        if extra[0] in everything:
            raise InputError(f"{path}.{extra[0]}: not together with {', '.join(sorted(used))}; leave one out")
        hint = suggestion(extra[0], sorted(everything)) or f"; the keys here are {', '.join(KEYS)}"
        raise InputError(f"{path}.{extra[0]}: unknown key{hint}")
    return complete


def _change(table: Mapping[str, Any]) -> tuple[str, tuple[str, ...]]:
    changes = [key for key in ("sets", "multiplies", "factors") if key in table]
    if len(changes) > 1:
        raise InputError(f"{changes[1]}: not together with {changes[0]}; use one axis for each")
    if not changes:
        return "free", ()
    value = table[changes[0]]
    paths = (value,) if isinstance(value, str) else tuple(value) if isinstance(value, list) else ()
    if not paths or not all(isinstance(path, str) and all(path.split(".")) for path in paths):
        raise InputError(f"{changes[0]} = {value!r}: give a field of the scene in quotes, such as 'bearing.friction'")
    return changes[0], paths


def _surfaces(table: Mapping[str, Any]) -> tuple[int, ...] | None:
    if "surfaces" not in table:
        return None
    value = table["surfaces"]
    if not isinstance(value, list) or not value or not all(type(item) is int and item > 0 for item in value):
        raise InputError(f"surfaces = {value!r}: give a list of surfaces, 1 for the lowest")
    return tuple(value)


def _with_values(axis: Axis, table: Mapping[str, Any]) -> tuple[Axis, set[str]]:
    """The axis with its values or its distribution, and the keys of the table that give them."""
    if "distribution" in table:
        distribution, used = distribution_from(table)
        return replace(axis, distribution=distribution), used
    if axis.change == "factors":
        return grid(axis, table.get("values", ["lower", "nominal", "upper"])), {"values"}
    if "values" in table:
        return grid(axis, table["values"], table.get("labels")), {"values", "labels"}
    if "range" in table:
        return grid(axis, _range(table)), {"range", "points", "spacing"}
    raise InputError("values is missing: give values = [...], range = [low, high] with points, or a distribution")


def grid(axis: Axis, values: Any, labels: Any = None) -> Axis:
    """The axis with these values. Raises InputError."""
    if not isinstance(values, list) or not values or len(values) > MOST_VALUES:
        raise InputError(f"values = {_short(values)}: give a list of 1 to {MOST_VALUES} values")
    if len({json.dumps(value, default=str) for value in values}) < len(values):
        raise InputError(f"values = {_short(values)}: a value occurs twice; give each once")
    if labels is not None and (not isinstance(labels, list) or len(labels) != len(values)):
        raise InputError(f"labels = {_short(labels)}: give one for each of the {len(values)} values")
    shown = [_label(value) for value in (values if labels is None else labels)]
    if not all(isinstance(label, float) for label in shown):
        shown = [
            str(value) if isinstance(value, str | int | float) else json.dumps(value) for value in labels or values
        ]
    return replace(axis, values=tuple(values), labels=tuple(shown))


def located(axis: Axis, folder: Path | None) -> Axis:
    """The axis with absolute paths of the files that its values name, relative to a folder. Raises InputError."""
    if axis.change != "sets" or axis.values is None:
        return axis
    values = axis.values
    for path in axis.paths:
        values = tuple(located_value(path, value, folder) for value in values)
    return replace(axis, values=values)


def _range(table: Mapping[str, Any]) -> list[float]:
    value, points, spacing = table["range"], table.get("points"), table.get("spacing", "linear")
    if not isinstance(value, list) or len(value) != 2:
        raise InputError(f"range = {value!r}: give the first and the last value")
    low, high = (number_of({"range": end}, "range") for end in value)
    if type(points) is not int or not 2 <= points <= MOST_VALUES:
        raise InputError(f"points = {points!r}: give a whole number of values, 2 or more")
    if spacing not in SPACINGS or (spacing == "log" and not 0 < low < high):
        raise InputError(f"spacing = {spacing!r}: give 'linear', or 'log' with a range above 0")
    if not low < high:
        raise InputError(f"range = {value!r}: give two numbers, the smaller first")
    spaced = np.linspace(low, high, points) if spacing == "linear" else np.geomspace(low, high, points)
    return [float(number) for number in spaced]


def _label(value: Any) -> Any:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else value


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


INTENSITY = "intensity"  # column of the intensity measure of [records]


@dataclass(frozen=True)
class Recipe:
    """How the scenes of a study are made; small, so that it travels to workers.

    Attributes:
        scene: table of the base scene; paths in it are absolute.
        axes: in the order of the columns.
        records: name -> `[motion]` table, without its key `kind`.
        factors: name in the study file -> table of lambda factors.
        intensities: name of a record -> its intensity measure at scale 1 [m/s^2]; empty where none is asked for.
    """

    scene: Table
    axes: tuple[Axis, ...]
    records: dict[str, Table]
    factors: dict[str, FactorTable]
    intensities: dict[str, float]

    def intensity(self, at: Mapping[str, Any]) -> dict[str, float]:
        """The intensity measure of a run under its name [m/s^2]; empty where none is asked for. at: axis -> value."""
        if not self.intensities:
            return {}
        return {INTENSITY: self.intensities[at["record"]] * at.get("scale", 1.0)}


def motion_of(record: Table) -> Table:
    """The `[motion]` table of a scene, of a record."""
    return {"kind": RecordMotion.kind, **record}


class SceneFactory:
    """Makes the scenes of a study: each is what the reader of scene files makes of the table of the run.

    A motion that no axis changes is resolved once; what is made of other motions and of the frame of a building is kept
    by the reader.
    """

    def __init__(self, recipe: Recipe) -> None:
        self.recipe = recipe
        self._fidelity = recipe.scene.get("fidelity", "exact")
        base = {key: value for key, value in recipe.scene.items() if key != "fidelity"}
        self.base = scene_of(base)
        reduced(self.base, self._fidelity)  # raises its errors
        self._setting = sorted(  # a table before its fields
            (len(keys_of(path)), index, path)
            for index, axis in enumerate(recipe.axes)
            for path in axis.paths
            if axis.change == "sets"
        )
        changed = {path.partition(".")[0] for axis in recipe.axes for path in axis.paths}
        self._given: Table = {}
        if not recipe.records and "motion" not in changed:
            self._given["motion"] = self.base.motion
            if isinstance(self.base, Scene):
                self._given["motion_table"] = self.base.motion_table
        self._table = {key: value for key, value in base.items() if key not in self._given}

    def scene(self, values: Sequence[Any]) -> AnyScene:
        """The scene of one value for each axis, in their order. Raises InputError."""
        axes, table = self.recipe.axes, self._table
        for _, index, path in self._setting:
            table = changed_table(table, {path: values[index]}, axes[index].surfaces)
        chosen = list(zip(axes, values, strict=True))
        for axis, value in chosen:
            if axis.change == "record":
                scale = next((number for axis, number in chosen if axis.change == "scale"), 1.0)
                table = {**table, "motion": motion_of(self._scaled(value, scale))}
            for path in axis.paths if axis.change == "multiplies" else ():
                table = multiplied_table(table, path, value, axis.surfaces)
        scene = scene_of(table, **self._given)
        for axis, value in chosen:
            if axis.change == "factors":
                scene = bounded_scene(scene, self.recipe.factors[axis.paths[0]], value)
        return reduced(scene, self._fidelity)

    def _scaled(self, name: str, factor: float) -> Table:
        """The `[motion]` table of a record times a factor."""
        table = self.recipe.records[name]
        if not factor > 0:
            raise InputError(f"scale = {factor:g}: give a number above 0")
        if factor == 1.0:
            return table
        whole = float(RecordMotion(**table).build().metadata["scale"]) * factor
        return {**{key: value for key, value in table.items() if key not in ("scale", "scale_to")}, "scale": whole}
