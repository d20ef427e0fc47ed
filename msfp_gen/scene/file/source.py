"""`load_scene`: a file, a preset or a table comes in; a scene of one bearing goes out, or a system of another kind."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

from msfp_gen.common.errors import InputError
from msfp_gen.scene.file.changes import changed_table, keys_of_path
from msfp_gen.scene.file.loader import NO_PARTS, Parts, scene_from_table, scene_table
from msfp_gen.scene.file.motion_tables import KINDS, paths_in, resolved, with_spectrum
from msfp_gen.scene.file.schema import SCENE
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.system import Kind, System, kinds

MOTION_PATHS = paths_in(*KINDS.values())  # keys of `[motion]` that are paths of files


def load_scene(source: str | Path) -> Any:
    """The scene in a TOML file, or the preset of a name. Paths inside a file are relative to the file.

    Returns a `Scene`, or a system of another kind: a file with a table `[building]` gives a `BuildingScene`. Raises
    InputError of one line that names the file, the path of the field, the value and the remedy.
    """
    return changed_scene(source, {})


def load_bearing_scene(source: str | Path) -> Scene:
    """The scene of one bearing in a file or preset. Raises InputError as `load_scene`, and for other systems."""
    scene = load_scene(source)
    if not isinstance(scene, Scene):
        raise InputError(f"scene = {str(source)!r}: this is not one bearing alone; give a scene of one bearing here")
    return scene


def changed_scene(source: str | Path, changes: Mapping[str, Any]) -> Any:
    """The scene of `load_scene(source)` with some fields changed.

    changes: path of a field, such as `motion.scale`, `bearing.surfaces[0].friction` or
    `building.bearing[*].bearing.friction`, -> value. Raises InputError as `load_scene` does.
    """
    table, path = scene_table(source)
    try:
        return scene_of(changed_table(table, changes), None if path is None else path.parent)
    except InputError as error:
        if path is None:
            raise
        raise InputError(f"{path}: {error}") from None


def scene_of(table: Mapping[str, Any], folder: Path | None = None, parts: Parts = NO_PARTS) -> System:
    """The scene of a plain table, as in a file; folder, parts: as in `scene_from_table`. Raises InputError."""
    kind = kind_of(table)
    return (scene_from_table if kind is None else kind.from_table)(table, folder, parts)


def kind_of(table: Mapping[str, Any]) -> Kind | None:
    """The kind of the system of a table; None: a scene of one bearing. Raises InputError for tables of two kinds."""
    others = [key for key in table if key not in SCENE.keys]
    found = [kinds()[key] for key in others if key in kinds()]
    if len(found) > 1:
        raise InputError(f"{found[0].key} and {found[1].key}: a scene is of one kind; leave one of the tables out")
    return found[0] if found else None


def with_absolute_paths(table: Mapping[str, Any], folder: Path | None) -> dict[str, Any]:
    """The table of a scene with absolute paths of its files; `folder`: as in `scene_from_table`. Raises InputError."""
    absolute = deepcopy(dict(table))
    kind = kind_of(absolute)
    for place, inner, names in (*_motions(absolute), *(() if kind is None else kind.files(absolute))):
        for name in names:
            if name in inner and _are_texts(inner[name]):  # the schema refuses other values
                inner[name] = resolved(inner[name], folder, f"{place}.{name}")
        if isinstance(inner.get("scale_to"), dict):
            inner["scale_to"] = with_spectrum(inner["scale_to"], folder, f"{place}.scale_to")
    return absolute


def located_value(path: str, value: Any, folder: Path | None) -> Any:
    """A value of the field `path` with absolute paths of files; folder, errors: see `with_absolute_paths`."""
    keys = keys_of_path(path)
    nested: Any = value
    for key in reversed(keys):
        nested = {key: nested} if isinstance(key, str) else [nested]
    nested = with_absolute_paths(nested, folder)
    for key in keys:
        nested = nested[key if isinstance(key, str) else 0]
    return nested


def _are_texts(value: Any) -> bool:
    return isinstance(value, str) or (isinstance(value, list | tuple) and all(isinstance(item, str) for item in value))


def _motions(table: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any], tuple[str, ...]]]:
    """The `[motion]` table, with its place and which of its keys are paths of files."""
    if isinstance(table.get("motion"), dict):
        yield "motion", table["motion"], MOTION_PATHS
