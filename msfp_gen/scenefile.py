"""Scene files: TOML in, a checked Scene out, and back. A file is data: nothing in it is evaluated."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from msfp_gen import catalogue, schema
from msfp_gen.bearing import Bearing, Body, Surface
from msfp_gen.errors import InputError
from msfp_gen.fields import located, ruled_fields
from msfp_gen.layout import CHOSEN, Auto, Effects, Layout
from msfp_gen.motion import Motion
from msfp_gen.motion_tables import KINDS, Pieces, is_file, placed
from msfp_gen.prescribed_tables import LOADS, ROTATIONS, history_from, table_of
from msfp_gen.scene import InitialState, Scene, Stop
from msfp_gen.solver import Solver
from msfp_gen.toml_text import dumps
from msfp_gen.top import MassTop, PrescribedTop, RigTop, Top

Table = dict[str, Any]
_TOPS = {kind.kind: kind for kind in (RigTop, PrescribedTop, MassTop)}
_PARTS = {"solver": Solver, "initial_state": InitialState, "stop": Stop}


def load_scene(source: str | Path) -> Scene:
    """The scene in a TOML file, or the preset of that name. Paths inside a file are relative to it.

    Raises InputError of one line that names the file, the path of the field, the value and the remedy.
    """
    return changed_scene(source, {})


def changed_scene(source: str | Path, changes: Mapping[str, Any]) -> Scene:
    """The same with some fields changed: dotted path, such as `motion.scale`, -> value. Raises InputError likewise."""
    known = catalogue.descriptions("scene")
    if str(source) in known:
        return scene_from_table(_changed(catalogue.scene_table(str(source)), changes))
    path = Path(source)
    if not is_file(path):
        hint = catalogue.suggestion(str(source), known) or "; give the path of a TOML file or the name of a preset"
        raise InputError(f"scene = {str(source)!r}: no such file, and no preset of that name{hint}")
    try:
        return scene_from_table(_changed(_toml(path.read_text(encoding="utf-8-sig")), changes), path.parent)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the file") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: no UTF-8 text at byte {error.start}; save the file as UTF-8") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _changed(table: Table, changes: Mapping[str, Any]) -> Table:
    """A table with fields set that dotted paths name; that they are fields of a scene is for the schema to say."""
    table = deepcopy(table)
    for path, value in changes.items():
        *way, last = path.split(".")
        inner: Any = table
        for name in way:
            if name == "bearing" and isinstance(inner.get(name), str):  # a preset, which may have changes
                inner[name] = {"preset": inner[name]}
            inner = inner.setdefault(name, {})
            if not isinstance(inner, dict):
                raise InputError(f"{path} = {value!r}: {name} is {inner!r} here, which has no fields to change")
        inner[last] = value
    return table


def _toml(text: str) -> Table:
    """TOML as a table; InputError for everything that is none."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise InputError("no valid TOML: tables or lists are nested too deeply; a scene needs few levels") from None
    except ValueError as error:  # TOMLDecodeError, and numbers of thousands of digits
        raise InputError(f"no valid TOML: {str(error).partition(';')[0]}") from None


def scene_from_table(table: Mapping[str, Any], folder: Path | None = None) -> Scene:
    """The scene that a plain table describes; paths in it are relative to `folder`. Raises InputError."""
    given = schema.validate_scene(table)
    motion = dict(given["motion"])
    if "file" in motion:
        motion["file"] = placed(motion["file"], folder)
    top = dict(given["top"])
    parts: Table = {name: kind(**given.pop(name)) for name, kind in _PARTS.items() if name in given}
    if "effects" in given:
        parts["effects"] = _effects(given.pop("effects"))
    for name, kinds in (("load", LOADS), ("top_rotation", ROTATIONS)):
        if name in given:
            parts[name] = history_from(kinds, given.pop(name), name)
    if parts.get("top_rotation") is not None and isinstance(parts.get("effects"), Effects):
        parts["effects"] = replace(parts["effects"], top_rotation=True)
    parts["bearing"] = _bearing(given["bearing"])
    parts["top"] = _TOPS[top.pop("kind")](**top)
    parts["motion"] = _motion(motion)
    return Scene(**{**given, **parts, "motion_table": motion})


def bearing_from_table(table: Mapping[str, Any]) -> Bearing:
    """The bearing that a `[bearing]` table describes, in full or as a preset with changes. Raises InputError."""
    return _bearing(schema.validate_bearing(table))


def scene_text(scene: Scene, motion: Mapping[str, Any] | None = None) -> str:
    """The scene as TOML that `load_scene` reads back to an equal scene; everything in SI, bearing in full.

    motion: what to write as `[motion]` instead of what makes the scene's own; an empty table leaves it out.
    """
    own = {name: getattr(scene, name) for name in ("name", "duration", "output_step")}
    tables = {name: getattr(scene, name) for name in ("effects", *_PARTS)}
    histories = {name: getattr(scene, name) for name in ("load", "top_rotation")}
    return dumps(
        {
            **own,
            "bearing": {
                "layout": _plain(scene.bearing.layout),
                **_plain(scene.bearing),
                "surfaces": [_plain(surface) for surface in scene.bearing.surfaces],
                "bodies": [_plain(body) for body in scene.bearing.bodies],
            },
            **({} if motion == {} else {"motion": _motion_table(scene) if motion is None else motion}),
            "top": {"kind": scene.top.kind, **_plain(scene.top)},
            **{name: _plain(value) for name, value in tables.items() if value is not None},
            **{name: table_of(value) for name, value in histories.items() if value is not None},
        }
    )


def _effects(given: Mapping[str, Any]) -> Effects | Auto:
    """A table that says all there is to choose is followed to the letter; what it leaves out is chosen."""
    if "error" in given or any(name not in given for name in CHOSEN):
        return Auto(**given)
    return Effects(**given)


def _bearing(given: Mapping[str, Any]) -> Bearing:
    changes = dict(given)
    if "preset" in changes:
        preset = catalogue.bearing_table(changes.pop("preset"))
        return bearing_from_table(preset).replace(**changes)
    with located("layout", "bearing.layout"):
        changes["layout"] = Layout(**changes["layout"])
    for name, kind, word in (("surfaces", Surface, "surface"), ("bodies", Body, "body")):
        changes[name] = [_row(kind, row, word, f"bearing.{name}[{index}]") for index, row in enumerate(changes[name])]
    return Bearing(**changes)


def _row(kind: type, row: Mapping[str, Any], word: str, path: str) -> Any:
    with located(word, path):
        return kind(**row)


def _motion(table: Mapping[str, Any]) -> Motion:
    values = dict(table)
    return KINDS[values.pop("kind")](**values).build()


def _motion_table(scene: Scene) -> Table:
    """The recipe a file gave, if it still makes the scene's motion; otherwise the motion piece by piece."""
    if scene.motion_table is not None and _motion(scene.motion_table) == scene.motion:
        return {"kind": scene.motion_table["kind"], **scene.motion_table}
    return Pieces.of(scene.motion)


def _plain(value: Top | Bearing | Layout | Surface | Body | Effects | Auto | Solver | InitialState | Stop) -> Table:
    # That the top turns is said by its history.
    names = [name for name, _, _ in ruled_fields(type(value)) if name != "top_rotation"]
    return {field.name: getattr(value, field.name) for field in fields(value) if field.name in names}
