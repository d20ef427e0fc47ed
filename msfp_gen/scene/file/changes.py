"""Changes of fields in the table of a scene, by paths such as `motion.scale` or `bearing.surfaces[0].friction`."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from copy import deepcopy
from typing import Any

from msfp_gen.errors import InputError
from msfp_gen.scene.file.loader import bearing_from_table, bearing_table
from msfp_gen.scene.file.toml_text import plain_values

Table = dict[str, Any]
Key = str | int | None  # of a table, of a list, of all rows of a list
_STEP = re.compile(r"([^\[\].]+)((?:\[(?:\d+|\*)\])*)")
ROWS = ("surfaces", "bodies")


def changed_table(table: Mapping[str, Any], changes: Mapping[str, Any]) -> Table:
    """A copy of a table with the fields at some paths set; the schema checks afterwards that they exist.

    `[i]` in a path is a row of a list, from 0; `[*]` stands for all rows. A bearing that a preset gives, or the name of
    one in `[bearings]`, becomes a table of its own where a path leads into it. Raises InputError.
    """
    changed = deepcopy(dict(table))
    for path, value in changes.items():
        try:
            for holder, key in _places(changed, changed, keys_of(path)):
                holder[key] = deepcopy(value)
        except InputError as error:
            raise InputError(f"{path} = {value!r}: {error}") from None
    return changed


def keys_of(path: str) -> list[Key]:
    """The keys of a path: names of tables, numbers of rows, None for all rows. Raises InputError."""
    found: list[Key] = []
    for part in path.split("."):
        step = _STEP.fullmatch(part)
        if step is None:
            raise InputError("no path of a field; give one such as motion.scale or bearing.surfaces[0].friction")
        found.append(step[1])
        found += [None if index == "*" else int(index) for index in re.findall(r"\d+|\*", step[2])]
    return found


def _places(root: Table, inner: Any, keys: list[Key]) -> Iterator[tuple[Any, Any]]:
    """Holder and key of every place to which `keys` lead from `inner`."""
    key, *rest = keys
    for each in [key] if isinstance(key, str) else _rows(inner, key):
        if not rest:
            yield inner, each
            continue
        if isinstance(each, str):
            inner.setdefault(each, {})
        if each == "bearing":
            inner[each] = _own_bearing(root, inner[each], rest[0])
        if isinstance(rest[0], str) and not isinstance(inner[each], dict):
            raise InputError(f"{each} is {inner[each]!r} here, which has no fields to change")
        yield from _places(root, inner[each], rest)


def _rows(inner: Any, index: int | None) -> list[int]:
    if not isinstance(inner, list):
        raise InputError(f"{inner!r:.60} is no list here, which has no [{'*' if index is None else index}]")
    if index is not None and index >= len(inner):
        raise InputError(f"there are {len(inner)} of them; give an index from 0 to {len(inner) - 1}, or *")
    return list(range(len(inner))) if index is None else [index]


def _own_bearing(root: Table, given: Any, following: Key) -> Any:
    """A bearing as a table that can be changed; complete where a row of its surfaces or bodies is."""
    if isinstance(given, str):
        named = root.get("bearings", {})
        given = deepcopy(named[given]) if isinstance(named, dict) and given in named else {"preset": given}
        given = {"preset": given} if isinstance(given, str) else given
    if following in ROWS and isinstance(given, dict) and "preset" in given:
        return plain_values(bearing_table(bearing_from_table(given)))
    return given
