"""`load_scene`: the scene of a file or a preset, of one bearing or of a building."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

from msfp_gen.buildings.file import FILES, building_from_table
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.errors import InputError
from msfp_gen.scene.file.changes import changed_table, keys_of
from msfp_gen.scene.file.loader import scene_from_table, scene_table
from msfp_gen.scene.file.motion_tables import resolved, with_spectrum
from msfp_gen.scene.scene import Scene

AnyScene = Scene | BuildingScene


def load_scene(source: str | Path) -> AnyScene:
    """The scene in a TOML file, or the preset of that name. Paths inside a file are relative to it.

    A file with a table `[building]` gives a `BuildingScene`. Raises InputError of one line that names the file, the
    path of the field, the value and the remedy.
    """
    return changed_scene(source, {})


def load_bearing_scene(source: str | Path) -> Scene:
    """The scene of one bearing in a file or preset. Raises InputError as `load_scene` does, and for a building."""
    scene = load_scene(source)
    if not isinstance(scene, Scene):
        raise InputError(f"scene = {str(source)!r}: this is a building; give a scene of one bearing here")
    return scene


def changed_scene(source: str | Path, changes: Mapping[str, Any]) -> AnyScene:
    """The scene of `load_scene(source)` with some fields changed.

    changes: path of a field, such as `motion.scale`, `bearing.surfaces[0].friction` or
    `building.bearing[*].bearing.friction` -> value. Raises InputError as `load_scene` does.
    """
    table, path = scene_table(source)
    try:
        return scene_of(changed_table(table, changes), None if path is None else path.parent)
    except InputError as error:
        if path is None:
            raise
        raise InputError(f"{path}: {error}") from None


def scene_of(table: Mapping[str, Any], folder: Path | None = None, **given: Any) -> AnyScene:
    """The scene of a plain table, as in a file; folder, given: as in `scene_from_table`. Raises InputError."""
    return (building_from_table if "building" in table else scene_from_table)(table, folder, **given)


def with_absolute_paths(table: Mapping[str, Any], folder: Path | None) -> dict[str, Any]:
    """The table of a scene with absolute paths of its files; `folder`: as in `scene_from_table`. Raises InputError."""
    found = deepcopy(dict(table))
    for place, inner, names in _with_files(found):
        for name in names:
            if name in inner and _are_texts(inner[name]):  # the schema refuses others
                inner[name] = resolved(inner[name], folder, f"{place}.{name}")
        if isinstance(inner.get("scale_to"), dict):
            inner["scale_to"] = with_spectrum(inner["scale_to"], folder, f"{place}.scale_to")
    return found


def located_value(path: str, value: Any, folder: Path | None) -> Any:
    """A value for a path of a scene with absolute paths of its files; `folder`, errors: as of `with_absolute_paths`."""
    keys = keys_of(path)
    nested: Any = value
    for key in reversed(keys):
        nested = {key: nested} if isinstance(key, str) else [nested]
    nested = with_absolute_paths(nested, folder)
    for key in keys:
        nested = nested[key if isinstance(key, str) else 0]
    return nested


def _are_texts(value: Any) -> bool:
    return isinstance(value, str) or (isinstance(value, list | tuple) and all(isinstance(item, str) for item in value))


def _with_files(table: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any], tuple[str, ...]]]:
    """Place, table and keys of every table that may name files; the motions of single bearings are the last."""
    yield from ((part, table[part], names) for part, names in FILES.items() if isinstance(table.get(part), dict))
    frame = table.get("building")
    rows = frame.get("bearing") if isinstance(frame, dict) else None
    for i, row in enumerate(rows if isinstance(rows, list) else ()):
        if isinstance(row, dict) and isinstance(row.get("motion"), dict):
            yield f"building.bearing[{i}].motion", row["motion"], FILES["motion"]
