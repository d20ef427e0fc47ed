"""The presets as plain tables, from TOML files, which `presets` and `loader` make objects of; checks of tables."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from functools import lru_cache
from importlib.resources import files
from typing import Any

from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Rule

Table = dict[str, Any]
KINDS = ("bearing", "scene", "building")

# Effects of a preset unless its table gives others: the complete model of PEER 2017/07.
PRESET_EFFECTS = {"dimension": "spatial", "sliders": "inertial", "rims": True, "uplift": False}


def bearing_table(name: str) -> Table:
    """The bearing preset `name`, without its description; raises InputError for an unknown name."""
    return _find("bearing", name)


def scene_table(name: str) -> Table:
    """The scene preset `name`, complete, without its description; raises InputError for an unknown name."""
    table = _find("scene", name)
    return table | {"name": name, "effects": {**PRESET_EFFECTS, **table.get("effects", {})}}


def building_table(name: str) -> Table:
    """The building preset `name`, complete, without its description; raises InputError for an unknown name."""
    return _find("building", name) | {"name": name}


def descriptions(kind: str) -> dict[str, str]:
    """Name -> one line of description of each preset of a kind, a word of `KINDS`. Raises InputError for another."""
    if kind not in KINDS:
        raise InputError(f"kind = {kind!r}: give one of {', '.join(map(repr, KINDS))}")
    return {name: table["description"] for name, table in _catalogue()[kind].items()}


def suggestion(word: str, known: Mapping[str, Any] | list[str]) -> str:
    """`; did you mean 'x'?` where one of the known words is similar to `word`, else an empty text."""
    close = get_close_matches(word, list(known), n=1)
    return f"; did you mean {close[0]!r}?" if close else ""


def known_keys(table: Mapping[str, Any], keys: Iterable[str], where: str) -> None:
    """Raise InputError for a key of a table, which lies at `where`, that is not one of `keys`."""
    for key in table:
        if key not in keys:
            hint = suggestion(key, list(keys)) or f"; the keys here are {', '.join(keys)}"
            raise InputError(f"{where}{key}: unknown key{hint}")


def check_whole_numbers(table: Mapping[str, Any]) -> None:
    """Raise InputError for a whole number of more than 64 bits, which TOML does not have.

    Python makes no float of some of them, and writes some into no message.
    """
    parts: list[tuple[str, Any]] = [("", table)]
    while parts:
        path, part = parts.pop()
        if isinstance(part, int) and not -(2**63) <= part < 2**63:
            raise InputError(f"{path}: a whole number has more than 64 bits; give a shorter one")
        if isinstance(part, Mapping):
            parts += [(f"{path}.{key}".lstrip("."), value) for key, value in part.items()]
        elif isinstance(part, list):
            parts += [(f"{path}[{index}]", value) for index, value in enumerate(part)]


def parsed(rule: Rule, value: object, path: str) -> Any:
    """A value by a rule of `common.fields`. Raises InputError that names its path."""
    try:
        return rule.parse(value)
    except ValueError as error:
        raise InputError(f"{path} = {value!r}: {error}") from None


def _find(kind: str, name: str) -> Table:
    tables = _catalogue()[kind]
    if name not in tables:
        hint = suggestion(str(name), tables) or f"; the presets are {', '.join(tables)}"
        raise InputError(f"{kind} = {name!r}: no preset of that name{hint}")
    return {key: value for key, value in tables[name].items() if key != "description"}


@lru_cache(maxsize=1)
def _catalogue() -> dict[str, dict[str, Table]]:
    catalogue: dict[str, dict[str, Table]] = {kind: {} for kind in KINDS}
    folder = files(__package__) / "presets"
    for path in sorted(folder.iterdir(), key=lambda path: path.name):
        if not path.name.endswith(".toml"):
            continue
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        common = tables.pop("common", {})
        for name, table in tables.items():
            whole = common | table
            kind = "bearing" if path.name == "bearings.toml" else "building" if "building" in whole else "scene"
            catalogue[kind][name] = whole
    return catalogue
