"""The presets as plain tables, read from their TOML files; `presets` and `loader` convert them to objects."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from difflib import get_close_matches
from functools import lru_cache
from importlib.resources import files
from typing import Any

from msfp_gen.errors import InputError

Table = dict[str, Any]

# Effects of a preset unless its table gives others: the complete model of PEER 2017/07.
PRESET_EFFECTS = {"dimension": "spatial", "sliders": "inertial", "rims": True, "uplift": False}


def bearing_table(name: str) -> Table:
    """The bearing preset `name`, without its description; raises InputError for an unknown name."""
    return _find("bearing", _catalogue()[0], name)


def scene_table(name: str) -> Table:
    """The scene preset `name`, complete, without its description; raises InputError for an unknown name."""
    table = _find("scene", _catalogue()[1], name)
    return table | {"name": name, "effects": {**PRESET_EFFECTS, **table.get("effects", {})}}


def descriptions(kind: str) -> dict[str, str]:
    """Name -> one line of description of each preset of a kind, "bearing" or "scene". Raises InputError for another."""
    kinds = dict(zip(("bearing", "scene"), _catalogue(), strict=True))
    if kind not in kinds:
        raise InputError(f"kind = {kind!r}: give 'bearing' or 'scene'")
    return {name: table["description"] for name, table in kinds[kind].items()}


def suggestion(word: str, known: Mapping[str, Any] | list[str]) -> str:
    """`; did you mean 'x'?` where one of the known words is similar to `word`, else an empty text."""
    close = get_close_matches(word, list(known), n=1)
    return f"; did you mean {close[0]!r}?" if close else ""


def _find(kind: str, tables: dict[str, Table], name: str) -> Table:
    if name not in tables:
        hint = suggestion(str(name), tables) or f"; the presets are {', '.join(tables)}"
        raise InputError(f"{kind} = {name!r}: no preset of that name{hint}")
    return {key: value for key, value in tables[name].items() if key != "description"}


@lru_cache(maxsize=1)
def _catalogue() -> tuple[dict[str, Table], dict[str, Table]]:
    bearings: dict[str, Table] = {}
    scenes: dict[str, Table] = {}
    folder = files(__package__) / "presets"
    for path in sorted(folder.iterdir(), key=lambda path: path.name):
        if not path.name.endswith(".toml"):
            continue
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        common = tables.pop("common", {})
        (bearings if path.name == "bearings.toml" else scenes).update(
            {name: common | table for name, table in tables.items()}
        )
    return bearings, scenes
