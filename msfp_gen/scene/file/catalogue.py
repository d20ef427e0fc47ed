"""The presets as plain tables, from TOML files, which `presets` and `loader` make objects of; checks of tables."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any

from msfp_gen.common.aliases import SceneTable
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Rule
from msfp_gen.scene.system import kinds

# Effects of a preset unless its table gives others: the complete model of PEER 2017/07.
PRESET_EFFECTS = {"dimension": "spatial", "sliders": "inertial", "rims": True, "uplift": False}


def preset_bearing_table(name: str) -> SceneTable:
    """The bearing preset `name`, without its description; raises InputError for an unknown name."""
    return _find("bearing", name)


def preset_scene_table(name: str) -> SceneTable:
    """The preset `name` of a scene of one bearing, complete, without its description; raises InputError without one."""
    table = _find("scene", name)
    return table | {"name": name, "effects": {**PRESET_EFFECTS, **table.get("effects", {})}}


def preset_table(name: str) -> SceneTable | None:
    """The complete table of a scene preset, of one bearing or of another kind; None: there is none of that name."""
    if name in _tables("scene"):
        return preset_scene_table(name)
    return next((_find(word, name) | {"name": name} for word in kinds() if name in _tables(word)), None)


def words_of_presets() -> tuple[str, ...]:
    """The words for what presets are of: bearings, scenes of one bearing, and the other kinds of systems."""
    return ("bearing", "scene", *kinds())


def descriptions(word: str) -> dict[str, str]:
    """Name -> one line of description of each preset, by one of `words_of_presets`. Raises InputError for another."""
    if word not in words_of_presets():
        raise InputError(f"kind = {word!r}: give one of {', '.join(map(repr, words_of_presets()))}")
    return {name: table["description"] for name, table in _tables(word).items()}


def scene_descriptions() -> dict[str, str]:
    """Name -> one line of description of every scene preset of any kind."""
    return {name: line for word in words_of_presets()[1:] for name, line in descriptions(word).items()}


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


def _find(word: str, name: str) -> SceneTable:
    tables = _tables(word)
    if name not in tables:
        hint = suggestion(str(name), tables) or f"; the presets are {', '.join(tables)}"
        raise InputError(f"{word} = {name!r}: no preset of that name{hint}")
    return {key: value for key, value in tables[name].items() if key != "description"}


@cache
def _tables(word: str) -> dict[str, SceneTable]:
    """Name -> table of each preset, by one of `words_of_presets`. `[common]` lies under every table of its file."""
    if word not in ("bearing", "scene"):
        folder = kinds()[word].presets
        return {} if folder is None else dict(_read(folder, lambda _: True))
    own = files(__package__) / "presets"
    return dict(_read(own, lambda name: (name == "bearings.toml") == (word == "bearing")))


def _read(folder: Traversable, wanted: Callable[[str], bool]) -> Iterator[tuple[str, SceneTable]]:
    for path in sorted(folder.iterdir(), key=lambda path: path.name):
        if path.name.endswith(".toml") and wanted(path.name):
            tables = tomllib.loads(path.read_text(encoding="utf-8"))
            common = tables.pop("common", {})
            yield from ((name, common | table) for name, table in tables.items())
