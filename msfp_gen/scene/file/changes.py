"""Changes of fields in the table of a scene, by paths such as `motion.scale` or `bearing.surfaces[0].friction`."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from copy import copy, deepcopy
from types import MappingProxyType
from typing import Any, NamedTuple

from msfp_gen.common.aliases import SceneTable
from msfp_gen.common.errors import InputError, prefixed
from msfp_gen.common.fields import Quantity, number_and_unit, ruled_fields
from msfp_gen.scene.bearing import Body, Surface
from msfp_gen.scene.file.loader import MAX_DEPTH, complete_bearing, complete_part, named_bearings
from msfp_gen.scene.file.schema import SCENE
from msfp_gen.scene.system import kinds

PathKey = str | int | None  # of a table, of a list, of all rows of a list
_STEP = re.compile(r"([^\[\].]+)((?:\[(?:\d+|\*)\])*)")
NO_TABLES: Mapping[str, Any] = MappingProxyType({})
ROWS = {"surfaces": Surface, "bodies": Body}
_COLUMNS = {  # a field of surfaces or bodies -> their list, and whether one value is a list of numbers
    name: (rows, isinstance(rule, Quantity) and bool(rule.shape))
    for rows, kind in ROWS.items()
    for name, rule, _ in ruled_fields(kind)
}


class _Place(NamedTuple):
    """A place in a table: what holds it, its key there, and the index and number of the row of a column."""

    holder: Any
    key: Any
    row: tuple[int, int] | None = None


class _Walk(NamedTuple):
    """How a table is walked: from its root; whether bearings are made complete; to which surfaces (from 1), or all."""

    root: SceneTable
    complete: bool = False
    surfaces: Collection[int] | None = None


def changed_table(
    table: Mapping[str, Any], changes: Mapping[str, Any], surfaces: Collection[int] | None = None
) -> SceneTable:
    """A copy of a table with the fields at some paths set; the schema checks afterwards that they exist.

    `[i]` in a path is a row of a list, from 0; `[*]` stands for all rows. A bearing that a preset gives, or the name of
    one in `[bearings]`, becomes a table of its own where a path leads into it; so does what a bearing of a building
    has in common with others. `bearing.friction` is a column: one value for all surfaces or a list, in a complete
    bearing too. surfaces: of a column only these, from 1. Raises InputError.
    """
    changed = dict(table)
    for path, value in changes.items():
        try:
            for place in _places(_Walk(changed, surfaces is not None, surfaces), path):
                place.holder[place.key] = deepcopy(value if place.row is None else _of_row(place, value))
        except InputError as error:
            raise InputError(f"{path} = {value!r}: {error}") from None
    return changed


def multiplied_table(
    table: Mapping[str, Any], path: str, factor: float, surfaces: Collection[int] | None = None
) -> SceneTable:
    """A copy of a table with the numbers at a path multiplied; arguments and errors as in `changed_table`."""
    changed = dict(table)
    part = path.partition(".")[0]
    with prefixed(f"{path}: "):
        if part in ("top", "solver"):
            changed[part] = complete_part(part, changed.get(part, {}))
        for holder, key, _ in _places(_Walk(changed, True, surfaces), path):
            holder[key] = _times(holder.get(key) if isinstance(holder, dict) else holder[key], factor)
    return changed


def keys_of_path(path: str) -> list[PathKey]:
    """The keys of a path: names of tables, numbers of rows, None for all rows. Raises InputError."""
    keys: list[PathKey] = []
    for part in path.split("."):
        step = _STEP.fullmatch(part)
        if step is None:
            raise InputError("no path of a field; give one such as motion.scale or bearing.surfaces[0].friction")
        keys.append(step[1])
        keys += [None if index == "*" else int(index) for index in re.findall(r"\d+|\*", step[2])]
    if len(keys) > MAX_DEPTH:
        raise InputError("no path of a field: it leads deeper than any table of a scene")
    return keys


def _places(walk: _Walk, path: str) -> Iterator[_Place]:
    """Every place to which a path leads. Raises InputError where surfaces are chosen and it is no column of them."""
    keys = keys_of_path(path)
    column = _COLUMNS.get(str(keys[-1]), ("", False))[0] if keys[-2:-1] == ["bearing"] else ""
    if walk.surfaces is not None and column != "surfaces":
        raise InputError("surfaces: this is no field of a surface; leave surfaces out")
    return _inner_places(walk, walk.root, keys)


def _inner_places(
    walk: _Walk, inner: Any, keys: list[PathKey], common: Mapping[str, Any] = NO_TABLES
) -> Iterator[_Place]:
    """The places to which keys lead from `inner`, which is a copy, as all that they lead through becomes one."""
    # common: the tables that rows of a kind of systems have where they have none of their own.
    key, *rest = keys
    for step in [key] if isinstance(key, str) else _rows(inner, key):
        if not rest:
            yield _Place(inner, step)
            continue
        if isinstance(step, str):
            inner.setdefault(step, copy(common[step]) if isinstance(common.get(step), dict) else {})
        inner[step] = _own_bearing(walk, inner[step], rest[0]) if step == "bearing" else copy(inner[step])
        if isinstance(rest[0], str) and not isinstance(inner[step], dict):
            raise InputError(f"{step} is {inner[step]!r} here, which has no fields to change")
        if inner is walk.root and isinstance(step, str) and isinstance(inner[step], dict) and _is_kind(step):
            inner[step] = kinds()[step].written_out(inner[step])
            common = {name: inner[step].get(name) for name in kinds()[step].common}
        if step == "bearing" and len(rest) == 1 and rest[0] in _COLUMNS and "layout" in inner[step]:
            yield from _column(walk, inner[step], str(rest[0]))
        else:
            yield from _inner_places(walk, inner[step], rest, common)


def _is_kind(key: str) -> bool:
    """Whether a table of a scene file tells its kind; the tables of one bearing are asked first, and load no kinds."""
    return key not in SCENE.keys and key in kinds()


def _column(walk: _Walk, bearing: SceneTable, name: str) -> Iterator[_Place]:
    """The places of a field of the surfaces or bodies of a complete bearing."""
    rows = _COLUMNS[name][0]
    bearing[rows] = [dict(row) for row in bearing.get(rows, [])]
    for index, row in enumerate(bearing[rows]):
        if walk.surfaces is None or index + 1 in walk.surfaces:
            yield _Place(row, name, (index, len(bearing[rows])))


def _of_row(place: _Place, value: Any) -> Any:
    """The value of a column for one of its rows: one for all, or one of a list."""
    assert place.row is not None
    index, count = place.row
    if not isinstance(value, list) or (_COLUMNS[place.key][1] and not any(isinstance(item, list) for item in value)):
        return value
    if len(value) != count:
        raise InputError(f"there are {count} of them; give {count} values, or one for all")
    return value[index]


def _rows(inner: Any, index: int | None) -> list[int]:
    if not isinstance(inner, list):
        raise InputError(f"{inner!r:.60} is no list here, which has no [{'*' if index is None else index}]")
    if index is not None and index >= len(inner):
        raise InputError(f"there are {len(inner)} of them; give an index from 0 to {len(inner) - 1}, or *")
    return list(range(len(inner))) if index is None else [index]


def _own_bearing(walk: _Walk, bearing: Any, following: PathKey) -> Any:
    """A bearing as a table that can be changed; complete where a row of its surfaces or bodies is."""
    if isinstance(bearing, str):
        bearing = named_bearings(walk.root).get(bearing, {"preset": bearing})
    if isinstance(bearing, str):
        bearing = {"preset": bearing}
    if isinstance(bearing, dict) and (walk.complete or (following in ROWS and "preset" in bearing)):
        return complete_bearing(bearing)
    return copy(bearing)


def _times(value: Any, factor: float) -> Any:
    """A number, one with its unit, or each of a list, times a factor."""
    if isinstance(value, list):
        return [_times(item, factor) for item in value]
    if isinstance(value, str) and (parts := number_and_unit(value)) is not None and parts[1] is not None:
        return f"{parts[0] * factor!r} {parts[1]}"
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{value!r} is no number to multiply; set it, or give a number of bearing, top or solver")
    return value * factor
