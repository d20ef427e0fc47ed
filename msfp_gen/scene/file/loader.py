"""Reading and writing of scene files (TOML), and of suites of ground motions. A file is data: nothing is evaluated.

A suite lists records, and how they are scaled to a mean spectrum (docs/motion.md).
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import lru_cache, partial, singledispatch
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.aliases import Progress, SceneTable
from msfp_gen.common.errors import InputError, prefixed
from msfp_gen.common.fields import errors_at, ruled_fields
from msfp_gen.common.identity import fingerprint
from msfp_gen.common.inputs import InputCache, is_input, read_input
from msfp_gen.motions.motion import Motion
from msfp_gen.scene.bearing import Bearing, Body, Surface
from msfp_gen.scene.fidelity import at_fidelity
from msfp_gen.scene.file import catalogue, schema
from msfp_gen.scene.file.motion_tables import (
    LOADS,
    ROTATIONS,
    PolynomialMotion,
    RecordMotion,
    history_from,
    located,
    motion_from,
    polynomials_of,
    with_spectrum,
)
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.scene_fields import InitialState, Limits, Stop
from msfp_gen.scene.sheet import Sheet
from msfp_gen.scene.solver import Solver
from msfp_gen.scene.system import kinds
from msfp_gen.scene.top import MassTop, PrescribedTop, RigTop, Top
from msfp_gen.specification.layout import SELECTABLE, Auto, Effects, Layout

if TYPE_CHECKING:
    from msfp_gen.motions.records import ScaledSuite

MAX_DEPTH = 16  # of nested tables and lists; a scene has six
_TOO_DEEP = "no valid TOML: tables or lists are nested too deeply; a scene needs few levels"
_TOPS = {kind.kind: kind for kind in (RigTop, PrescribedTop, MassTop)}
Parts = Mapping[str, Any]
NO_PARTS: Parts = MappingProxyType({})
_complete: InputCache[SceneTable] = InputCache(16, lambda _: 1)
_FIELDS_ALONE = {"solver": Solver, "initial_state": InitialState, "stop": Stop, "limits": Limits}


def scene_table(source: str | Path) -> tuple[SceneTable, Path | None]:
    """The table of a scene file, not validated, and the path of the file; of a preset None.

    Raises InputError of one line that names the file, or the preset that does not exist.
    """
    path = Path(source)
    if path.suffix != ".toml" and (table := catalogue.preset_table(str(source))) is not None:
        return table, None
    if not is_input(path):
        known = catalogue.scene_descriptions()
        hint = catalogue.suggestion(str(source), known) or "; give the path of a TOML file or the name of a preset"
        raise InputError(f"scene = {str(source)!r}: no such file, and no preset of that name{hint}")
    with prefixed(f"{path}: "):
        return toml_file(path), path


def toml_file(path: Path) -> SceneTable:
    """The table of a TOML file; raises InputError, without the path, where it cannot be read or is not valid."""
    try:
        return toml_table(read_input(path).decode("utf-8-sig"))
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror}); check the file") from None
    except UnicodeDecodeError as error:
        raise InputError(f"no UTF-8 text at byte {error.start}; save the file as UTF-8") from None


def toml_table(text: str) -> SceneTable:
    """The table of a TOML text; raises InputError where the text is not valid, or nested more deeply than any scene."""
    try:
        table = tomllib.loads(text)
    except RecursionError:
        raise InputError(_TOO_DEEP) from None
    except ValueError as error:  # TOMLDecodeError, and decimal numbers of thousands of digits
        raise InputError(f"no valid TOML: {str(error).partition(';')[0]}") from None
    level: list[Any] = [table]
    for _ in range(MAX_DEPTH):  # a dotted key nests without a recursion of the parser
        values = (entry.values() if isinstance(entry, dict) else entry for entry in level)
        level = [item for entry in values for item in entry if isinstance(item, dict | list)]
    if level:
        raise InputError(_TOO_DEEP)
    return table


def scene_from_table(table: Mapping[str, Any], folder: Path | None = None, parts: Parts = NO_PARTS) -> Scene:
    """The scene of a plain table, as in a scene file.

    folder: of the scene file, to which paths in the table are relative; None: the working folder, and any path is
    permitted. parts: of a scene by name; they stand for tables which are left out. Raises InputError.
    """
    parts = scene_parts(schema.SCENE, table, folder, parts)
    if parts.get("top_rotation") is not None and isinstance(parts.get("effects"), Effects):
        parts["effects"] = replace(parts["effects"], top_rotation=True)
    word = parts.pop("fidelity", "exact")
    reduced: Scene = at_fidelity(Scene(**parts), word)
    return reduced


def scene_parts(keys: schema.Keys, table: Mapping[str, Any], folder: Path | None, others: Parts) -> SceneTable:
    """The parts of a scene, of one bearing or of a building, by name.

    keys: of its file. others: parts for which there are no tables. Other arguments and errors as in `scene_from_table`.
    What is no part stays as validated.
    """
    parts, valid = dict(others), schema.validate(keys, table, others)
    if "motion" in valid:
        motion = located(valid.pop("motion"), folder)
        parts["motion"] = motion_from(motion)
        if keys is schema.SCENE:
            parts["motion_table"] = motion
    return parts | {name: _PARTS[name](value) if name in _PARTS else value for name, value in valid.items()}


def bearing_from_table(table: Mapping[str, Any]) -> Bearing:
    """The bearing of a `[bearing]` table: complete, or a preset with changes. Raises InputError."""
    return _bearing(schema.validate_part("bearing", table))


def named_bearings(table: Mapping[str, Any]) -> SceneTable:
    """The bearings that the table of a scene file has by name: name -> table, or the name of a preset."""
    if table.keys() <= schema.SCENE.keys.keys():  # of one bearing, whose file loads no kinds
        return {}
    named = (table.get(kind.named) for kind in kinds().values() if kind.named is not None)
    return {name: bearing for one in named if isinstance(one, Mapping) for name, bearing in one.items()}


def bearing_tables(table: Mapping[str, Any]) -> SceneTable:
    """The tables of bearings in the table of a scene file: "" -> `[bearing]`, then by name."""
    found = {"": table.get("bearing"), **named_bearings(table)}
    return {name: one for name, one in found.items() if isinstance(one, Mapping)}


def load_sheet(source: str | Path, kind: str | None = None) -> tuple[str, Sheet, Bearing]:
    """Name, data sheet and bearing of a TOML file, of a scene or alone, with `[bearing.sheet]` or the sheets of a
    building.

    kind: name of a table of `[bearings]`; None: the file has one sheet. Raises InputError.
    """
    path = Path(source)
    with prefixed(f"{path}: "):
        if not is_input(path):
            raise InputError("no such file; give a TOML file with [bearing.sheet]")
        table = toml_file(path)
        found = {name: one for name, one in bearing_tables(table).items() if "sheet" in one}
        if not found:
            raise InputError("bearing.sheet is missing: give the data sheet of the bearing (docs/bearing.md)")
        if (len(found) > 1) if kind is None else (kind not in found):
            names = ", ".join(name or "bearing" for name in found)
            raise InputError(f"--bearing = {kind or ''!r}: the file has the sheets of {names}; give one of these names")
        chosen = next(iter(found)) if kind is None else kind
        with errors_at("bearing", f"bearings.{chosen}" if chosen else "bearing"):
            valid = schema.validate_part("bearing", found[chosen])
            name = chosen or table.get("name")
            return name if isinstance(name, str) and name else path.stem, Sheet(**valid["sheet"]), _bearing(valid)


def parsed_sheet(table: Mapping[str, Any]) -> Sheet:
    """The data sheet of a `[bearing]` table with the key `sheet`. Raises InputError."""
    return Sheet(**schema.validate_part("bearing", dict(table))["sheet"])


def complete_bearing(table: Mapping[str, Any]) -> SceneTable:
    """A `[bearing]` table that states every surface and body, in SI units, of one that names a preset or is complete.

    Friction coefficients stay as in the table, also where they are at the pivot. Raises InputError.
    """
    return dict(_complete.value(fingerprint(table), lambda: _completed(table)))


def _completed(table: Mapping[str, Any]) -> SceneTable:
    valid = schema.validate_part("bearing", table)
    at = _bearing(valid).friction_given_at if "sheet" in valid else valid.get("friction_at", "surface")
    if at == "surface":
        return dict(plain_values(bearing_table(_bearing(valid))))
    _bearing(valid)  # raises its errors
    return {**plain_values(bearing_table(_bearing({**valid, "friction_at": "surface"}))), "friction_at": at}


def complete_part(name: str, table: Mapping[str, Any]) -> SceneTable:
    """The table `[top]` or `[solver]` with all numbers, in SI units. Raises InputError."""
    valid = schema.validate_part(name, table)
    if name == "solver":
        return dict(plain_values(plain_table(Solver(**valid))))
    return {"kind": valid["kind"], **plain_values(plain_table(_top(valid)))}


def bearing_table(bearing: Bearing) -> SceneTable:
    """The complete `[bearing]` table of a bearing, in SI units."""
    return {
        "layout": plain_table(bearing.layout),
        **plain_table(bearing),
        "surfaces": [plain_table(surface) for surface in bearing.surfaces],
        "bodies": [plain_table(body) for body in bearing.bodies],
    }


@singledispatch
def scene_text(system: Any) -> str:
    """A scene as text, for files and checkpoints: see `bearing_scene_text`, which it is of a scene of one bearing."""
    text: str = system.text()
    return text


@scene_text.register(Scene)
def bearing_scene_text(scene: Scene, motion: Mapping[str, Any] | None = None) -> str:
    """The scene as TOML text from which `load_scene` makes an equal scene; in SI units, with the complete bearing.

    motion: table to write as `[motion]`; None: the table of the scene's own motion; an empty table: `[motion]` is
    omitted.
    """
    values = {name: getattr(scene, name) for name in ("name", "duration", "output_step")}
    tables = {name: getattr(scene, name) for name in ("effects", *_FIELDS_ALONE)}
    histories = {name: getattr(scene, name) for name in ("load", "top_rotation")}
    return dumps(
        {
            **values,
            "bearing": bearing_table(scene.bearing),
            **({} if motion == {} else {"motion": _motion_table(scene) if motion is None else motion}),
            "top": {"kind": scene.top.kind, **plain_table(scene.top)},
            **{name: plain_table(value) for name, value in tables.items() if value is not None},
            **{name: polynomials_of(value) for name, value in histories.items() if value is not None},
        }
    )


def effects_from_table(table: Mapping[str, Any]) -> Effects | Auto:
    """`Effects` where a table gives every effect that could be selected, else `Auto`."""
    if "error" in table or any(name not in table for name in SELECTABLE):
        return Auto(**table)
    return Effects(**table)


def _bearing(table: Mapping[str, Any]) -> Bearing:
    changes = dict(table)
    if "preset" in changes:
        return _preset(changes.pop("preset")).replace(**changes)
    if "sheet" in changes:
        with errors_at("sheet", "bearing.sheet"):
            values = Sheet(**changes.pop("sheet")).values
        if "friction_at" in changes:  # where coefficients stay as on the sheet
            values["friction_at"] = changes.pop("friction_at")
        return Bearing.of_values(values).replace(**changes)
    with errors_at("layout", "bearing.layout"):
        changes["layout"] = Layout(**changes["layout"])
    for name, kind, word in (("surfaces", Surface, "surface"), ("bodies", Body, "body")):
        changes[name] = [_row(kind, row, word, f"bearing.{name}[{index}]") for index, row in enumerate(changes[name])]
    return Bearing(**changes)


@lru_cache(maxsize=16)
def _preset(name: str) -> Bearing:
    return bearing_from_table(catalogue.preset_bearing_table(name))


def _row(kind: type, row: Mapping[str, Any], word: str, path: str) -> Any:
    with errors_at(word, path):
        return _row_of(kind, tuple(row.items()))


@lru_cache(maxsize=256)  # bodies of a study of friction are read once
def _row_of(kind: type, values: tuple[tuple[str, Any], ...]) -> Any:
    """A surface or body, which is immutable."""
    return kind(**dict(values))


def _of_fields(kind: Callable[..., Any], table: Mapping[str, Any]) -> Any:
    return kind(**table)


def _top(table: Mapping[str, Any]) -> Top:
    return _TOPS[table["kind"]](**{key: value for key, value in table.items() if key != "kind"})


def _motion_table(scene: Scene) -> SceneTable:
    """The `[motion]` table of the scene file if it still makes the scene's motion, else its polynomials."""
    if scene.motion_table is not None and motion_from(scene.motion_table) == scene.motion:
        return {"kind": scene.motion_table["kind"], **scene.motion_table}
    return PolynomialMotion.of(scene.motion)


def plain_table(value: Any) -> SceneTable:
    """Fields of a part as a table. `top_rotation` is omitted: it follows from the table `[top_rotation]`."""
    names = [name for name, _, _ in ruled_fields(type(value)) if name != "top_rotation"]
    return {field.name: getattr(value, field.name) for field in fields(value) if field.name in names}


def dumps(table: Mapping[str, Any]) -> str:
    """TOML text of a table of texts, numbers, booleans, lists and tables; numbers read back exactly.

    Entries that are None are left out: TOML has no null. Raises TypeError for any other type.
    """
    import tomli_w

    return tomli_w.dumps(plain_values(table))


def plain_values(value: Any) -> Any:
    """`value` without entries that are None, and with NumPy scalars as Python numbers."""
    if isinstance(value, Mapping):
        return {key: plain_values(item) for key, item in value.items() if item is not None}
    if isinstance(value, list | tuple):
        return [plain_values(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value


# Table of a scene file -> what makes the part of its validated values.
_PARTS: dict[str, Callable[[SceneTable], Any]] = {
    **{name: partial(_of_fields, kind) for name, kind in _FIELDS_ALONE.items()},
    "bearing": _bearing,
    "effects": effects_from_table,
    "top": _top,
    "load": lambda table: history_from(LOADS, table, "load"),
    "top_rotation": lambda table: history_from(ROTATIONS, table, "top_rotation"),
}


@dataclass(frozen=True)
class SuiteRecord:
    """A motion of a suite: its name, its `[motion]` table, from which a result file describes it, and the motion."""

    name: str
    table: SceneTable
    motion: Motion


@dataclass(frozen=True)
class Suite:
    """The motions of a suite; of one scaled to a mean spectrum, their spectra, and the table of the target."""

    records: tuple[SuiteRecord, ...]
    scaled: ScaledSuite | None
    target: SceneTable | None = None


def load_suite(path: str | Path, progress: Progress | None = None) -> Suite:
    """The suite in a TOML file; paths inside it are relative to it, and permitted as in a scene file.

    progress: called with the number of spectra computed and of all. Raises InputError of one line that names the file,
    the path of the field, the value and the remedy.
    """
    path = Path(path)
    if not is_input(path):
        raise InputError(f"suite = {str(path)!r}: no such file; give the path of a TOML file with [[records]]")
    with prefixed(f"{path}: "):
        return suite_from_table(toml_file(path), path.parent, progress)


def suite_from_table(table: SceneTable, folder: Path | None, progress: Progress | None = None) -> Suite:
    """The suite of a plain table, as in a suite file. folder: see `scene_from_table`. Raises InputError."""
    valid = schema.validate_suite(table)
    if not valid["records"]:
        raise InputError("records = []: give at least one [[records]]")
    tables = [_located(record, folder, index) for index, record in enumerate(valid["records"])]
    target = valid.get("scale_to")
    return _suite(tables, target and with_spectrum(target, folder, "scale_to"), progress)


def _located(table: SceneTable, folder: Path | None, index: int) -> SceneTable:
    """The table of a record with absolute paths."""
    with errors_at("motion", f"records[{index}]"):
        return located(table, folder)


def _suite(tables: list[SceneTable], target: SceneTable | None, progress: Progress | None) -> Suite:
    if target is None:
        return Suite(_records(tables), None)
    from msfp_gen.motions.records import ScaleTo, scaled_suite

    for index, table in enumerate(tables):
        if own := [name for name in ("scale", "scale_to") if name in table]:
            raise InputError(f"records[{index}].{own[0]}: [scale_to] scales all records of the suite; leave one out")
    values = dict(target)
    share = values.pop("least_share", None)
    scaled = scaled_suite([record.motion for record in _records(tables)], ScaleTo(**values), share, progress)
    factors = scaled.factors.tolist()
    return Suite(_records([{**table, "scale": f} for table, f in zip(tables, factors, strict=True)]), scaled, target)


def _records(tables: list[SceneTable]) -> tuple[SuiteRecord, ...]:
    records = []
    for index, table in enumerate(tables):
        try:
            motion = RecordMotion(**table).build()
        except InputError as error:
            raise InputError(f"records[{index}].{str(error).removeprefix('motion').lstrip('.: ')}") from None
        records.append(SuiteRecord(motion.name, table, motion))
    names = [record.name for record in records]
    return tuple(
        replace(record, name=f"{record.name}-{index}") if names.count(record.name) > 1 else record
        for index, record in enumerate(records, start=1)
    )
