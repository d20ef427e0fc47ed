"""What a worker needs to make the scene of a run: the base scene as a table, and what the axes change in it.

Only this module knows what the base of a study is; parts, engines and evaluations know rows.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache, partial
from typing import Any, NamedTuple

from msfp_gen.buildings.opening import AnyScene, scene_of
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.fields import Quantity, Rule, errors_at, ruled_fields
from msfp_gen.errors import InputError
from msfp_gen.motions.motion import Motion
from msfp_gen.scene.bearing import Bearing, Body, Surface
from msfp_gen.scene.file.changes import changed_table
from msfp_gen.scene.file.motion_tables import RecordMotion
from msfp_gen.studies.bounding import bounded_scene
from msfp_gen.studies.bounding.factors import FactorTable
from msfp_gen.studies.study.axes import Axis

Table = dict[str, Any]
INTENSITY = "intensity"  # column of the intensity measure of [records]
KEPT_SCENES, KEPT_MOTIONS = 64, 8  # of one worker; a motion of a minute takes some MB
_OF_BUILDING = re.compile(r"building\.bearing\[(\*|\d+)\]\.bearing\.(\w+)")  # a field of bearings of a building
_PARTS: dict[str, tuple[type, ...]] = {"bearing": (Bearing, Surface, Body)}


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


class SceneMaker:
    """Makes the scenes of a study; base scenes and motions are kept, so that one costs a fraction of a millisecond."""

    def __init__(self, recipe: Recipe) -> None:
        self.recipe = recipe
        self._bases: Callable[[tuple[tuple[int, Any], ...]], AnyScene] = lru_cache(KEPT_SCENES)(self._base)
        self._motions: Callable[[str], tuple[Table, Motion]] = lru_cache(KEPT_MOTIONS)(self._motion)
        plain = scene_of(recipe.scene)
        self._slow = {  # axis -> its fields that only a table can take
            index: [path for path in axis.paths if not _is_quick(plain, path)]
            for index, axis in enumerate(recipe.axes)
            if axis.change == "sets"
        }

    def scene(self, values: Sequence[Any]) -> AnyScene:
        """The scene of one value for each axis, in their order. Raises InputError."""
        axes = self.recipe.axes
        slow = tuple((index, _key(values[index])) for index, paths in self._slow.items() if paths)
        scene = self._bases(slow)
        given = list(zip(axes, values, strict=True))
        scene = self._with_motion(scene, {axis.change: value for axis, value in given})
        for axis, value in given:
            for path in axis.paths if axis.change == "sets" else ():
                if path not in self._slow[axes.index(axis)]:
                    scene = _each(scene, path, partial(_set, axis=axis, value=value))
        for axis, value in given:
            for path in axis.paths if axis.change == "multiplies" else ():
                scene = _each(scene, path, partial(_multiplied, axis=axis, factor=value))
            if axis.change == "factors":
                scene = bounded_scene(scene, self.recipe.factors[axis.paths[0]], value)
        return scene

    def _base(self, slow: tuple[tuple[int, Any], ...]) -> AnyScene:
        """The base scene with the values that only a table can take."""
        changes = {path: _value(key) for index, key in slow for path in self._slow[index]}
        return scene_of(changed_table(self.recipe.scene, changes))

    def _motion(self, name: str) -> tuple[Table, Motion]:
        table = self.recipe.records[name]
        return table, RecordMotion(**table).build()

    def _with_motion(self, scene: AnyScene, values: Mapping[str, Any]) -> AnyScene:
        """The scene under its record, times its scale."""
        if "record" not in values:
            return scene
        table, motion = self._motions(values["record"])
        return _scaled(scene, motion, table, values.get("scale", 1.0))


def _key(value: Any) -> Any:
    """A value that can be hashed; lists as tuples."""
    if isinstance(value, list):
        return ("list", *map(_key, value))
    return ("table", *((k, _key(v)) for k, v in value.items())) if isinstance(value, dict) else value


def _value(key: Any) -> Any:
    """The inverse of `_key`."""
    if not isinstance(key, tuple):
        return key
    return [_value(item) for item in key[1:]] if key[0] == "list" else {k: _value(v) for k, v in key[1:]}


def _scaled(scene: AnyScene, motion: Motion, table: Table, factor: float) -> AnyScene:
    """The scene under a record times a factor."""
    if not factor > 0:
        raise InputError(f"scale = {factor:g}: give a number above 0")
    whole = float(motion.metadata.get("scale", 1.0)) * factor
    if factor != 1.0:
        coefficients = motion.coefficients.copy()
        coefficients[:, :3] *= factor
        motion = replace(motion, coefficients=coefficients, metadata={**motion.metadata, "scale": whole})
    if isinstance(scene, BuildingScene):
        return replace(scene, motion=motion)
    rest = {key: value for key, value in table.items() if key not in ("scale", "scale_to")}
    return replace(scene, motion=motion, motion_table={"kind": RecordMotion.kind, **rest, "scale": whole})


def rule_of(scene: AnyScene, path: str) -> Rule | None:
    """The rule of a field that is changed without a table: of bearing, top or solver; None for any other field."""
    if isinstance(scene, BuildingScene):
        inside = _OF_BUILDING.fullmatch(path)
        path = path if inside is None else f"bearing.{inside[2]}"
        if inside is None and not path.startswith("solver."):
            return None
    part, _, name = path.partition(".")
    kinds = _PARTS.get(part) or ((type(getattr(scene, part)),) if part in ("top", "solver") else ())
    return next((rule for kind in kinds for field, rule, _ in ruled_fields(kind) if field == name), None)


def _is_quick(scene: AnyScene, path: str) -> bool:
    return rule_of(scene, path) is not None


def _in_si(rule: Rule, value: Any) -> Any:
    """A value, or each value of a list, with texts such as "112 kN" in SI units."""
    if isinstance(value, list):
        return [_in_si(rule, item) for item in value]
    if isinstance(value, str) and isinstance(rule, Quantity):
        return replace(rule, shape=(), pair=False).parse(value, text=True)
    return value


class _One(NamedTuple):
    """A bearing of a building, where `bearing.` of a scene is meant."""

    bearing: Bearing


def _with_values(scene: Any, changes: Mapping[str, Any], axis: Axis | None) -> Any:
    """The scene with fields of bearing, top and solver set; of some surfaces only where the axis says so."""
    parts: dict[str, dict[str, Any]] = {}
    for path, value in changes.items():
        part, _, name = path.partition(".")
        if (rule := rule_of(scene, path)) is None:
            raise InputError(f"{path}: this {part} has no such field")
        try:
            plain = _in_si(rule, value)
        except ValueError as error:
            raise InputError(f"{path} = {value!r}: {error}") from None
        if axis is not None and axis.surfaces is not None:
            old = surface_values(scene, path)
            plain = [plain if number + 1 in axis.surfaces else was for number, was in enumerate(old)]
        parts.setdefault(part, {})[name] = plain
    for part, values in parts.items():
        with errors_at(type(getattr(scene, part)).__name__.lower(), part):
            old = getattr(scene, part)
            new = old.replace(**values) if part == "bearing" else replace(old, **values)
            scene = scene._replace(bearing=new) if isinstance(scene, _One) else replace(scene, **{part: new})
    return scene


def _each(scene: AnyScene, path: str, change: Callable[[Any, str], Any]) -> Any:
    """The scene with a change of the part that a path names: itself, or those bearings of a building."""
    inside = _OF_BUILDING.fullmatch(path)
    if inside is None or not isinstance(scene, BuildingScene):
        return change(scene, path)
    chosen, own = bearings_at(scene, path), f"bearing.{inside[2]}"
    bearings = [
        replace(each, bearing=change(_One(each.bearing), own).bearing) if index in chosen else each
        for index, each in enumerate(scene.bearings)
    ]
    return replace(scene, bearings=bearings)


def bearings_at(scene: AnyScene, path: str) -> list[int]:
    """Indices of the bearings of a building to which a path leads. Raises InputError: there is none."""
    inside = _OF_BUILDING.fullmatch(path)
    if inside is None or not isinstance(scene, BuildingScene):
        return []
    count = len(scene.bearings)
    if inside[1] != "*" and int(inside[1]) >= count:
        raise InputError(f"{path}: there are {count} bearings; give an index from 0 to {count - 1}, or *")
    return list(range(count)) if inside[1] == "*" else [int(inside[1])]


def surface_values(scene: Any, path: str) -> list[Any]:
    """The values of a field of all surfaces. Raises InputError where surfaces have no such field."""
    name = path.removeprefix("bearing.")
    if name not in {field.name for field in fields(Surface)}:
        raise InputError(f"surfaces: {path} is no field of a surface; leave surfaces out")
    return [getattr(surface, name) for surface in scene.bearing.surfaces]


def _set(one: Any, path: str, axis: Axis, value: Any) -> Any:
    return _with_values(one, {path: value}, axis)


def _multiplied(one: Any, path: str, axis: Axis, factor: float) -> Any:
    return _with_values(one, {path: _product(one, path, axis, factor)}, None)


def _product(scene: Any, path: str, axis: Axis, factor: float) -> Any:
    """The value of a field, or its values for all surfaces or bodies, times a factor."""
    part, _, name = path.partition(".")
    rows = next((rows for rows in ("surfaces", "bodies") if part == "bearing" and _has(rows, name)), None)
    if rows is None and axis.surfaces is None:
        return _times(path, getattr(getattr(scene, part), name), factor)
    values = [getattr(row, name) for row in scene.bearing.surfaces if rows == "surfaces"] or [
        getattr(row, name) for row in scene.bearing.bodies
    ]
    if axis.surfaces is not None:
        values = surface_values(scene, path)
    chosen = axis.surfaces or range(1, len(values) + 1)
    return [_times(path, v, factor) if number in chosen else v for number, v in enumerate(values, start=1)]


def _has(rows: str, name: str) -> bool:
    return name in {field.name for field in fields(Surface if rows == "surfaces" else Body)}


def _times(path: str, value: Any, factor: float) -> Any:
    if isinstance(value, tuple):
        return tuple(_times(path, item, factor) for item in value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{path} = {value!r}: this is no number to multiply; set it")
    return value * factor
