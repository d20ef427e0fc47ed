"""The schema of scene files: pydantic models made from the field rules of the package's dataclasses.

Pydantic walks the nested tables and locates errors; `common.fields` holds the rules. The `validate_` functions return
plain tables in SI units with only the keys that the file gives, or raise one InputError of one line.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import MISSING
from functools import lru_cache, partial, reduce
from operator import or_
from types import GenericAlias
from typing import Annotated, Any, Literal, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PlainValidator,
    Tag,
    ValidationError,
    create_model,
)

from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Quantity, Rule, Text, ruled_fields
from msfp_gen.motions.records.scaling import ScaleTo
from msfp_gen.scene.bearing import Bearing, Body, Surface
from msfp_gen.scene.file import motion_tables
from msfp_gen.scene.file.catalogue import suggestion
from msfp_gen.scene.file.motion_tables import LOADS, ROTATIONS
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.scene_fields import InitialState, Limits, Stop
from msfp_gen.scene.sheet import BOUNDS, Sheet
from msfp_gen.scene.solver import Solver
from msfp_gen.scene.top import MassTop, PrescribedTop, RigTop
from msfp_gen.specification.layout import Auto, Layout

Table = dict[str, Any]
Model = type[BaseModel]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


def model_of(kind: type, /, **more: Any) -> Model:
    """A pydantic model of the fields of a dataclass that have a rule, and of `more` fields as (annotation, default)."""
    model_fields = {
        name: (_read(rule.parse), ... if default is MISSING else default) for name, rule, default in ruled_fields(kind)
    }
    return create_model(kind.__name__, __base__=_Strict, **{**model_fields, **more})


def _read(parse: Callable[..., Any]) -> Any:
    """The annotation of a field that `parse` validates, texts with units included."""
    return Annotated[Any, PlainValidator(partial(parse, text=True))]


def _column(rule: Rule, value: object, *, text: bool) -> Any:
    """A value for all surfaces or bodies, or a list with one value for each."""
    pairs = isinstance(rule, Quantity) and bool(rule.shape)
    if isinstance(value, list) and (not pairs or any(isinstance(item, list) for item in value)):
        return [rule.parse(item, text=text) for item in value]
    return rule.parse(value, text=text)


def _union(kinds: Iterable[Any]) -> Any:
    """The union of the tables that their key `kind` distinguishes."""
    models = (model_of(kind, kind=(Literal[kind.kind], ...), **_inner(kind)) for kind in kinds)
    return Annotated[reduce(or_, models), Field(discriminator="kind")]


_SCALE_TO = model_of(ScaleTo)


def _inner(kind: type) -> Table:
    """Fields of a kind that are tables themselves."""
    scaled = {"scale_to": (_SCALE_TO, None)} if kind is motion_tables.RecordMotion else {}
    return scaled | ({"rotation": (_ROTATION, None)} if issubclass(kind, motion_tables.MotionTable) else {})


def _preset_table(value: Any) -> Any:
    """The name of a preset as a table; other values unchanged."""
    return {"preset": value} if isinstance(value, str) else value


def _bearing_kind(value: Any) -> str:
    return next((key for key in ("preset", "sheet") if isinstance(value, Mapping) and key in value), "full")


def rows_of(model: Model) -> Any:
    """The annotation of a list of such tables."""
    return GenericAlias(list, (model,))


def _bearing_union(**kinds: Model) -> Any:
    """A complete bearing, or a preset or a data sheet with changes; a text alone is the name of a preset."""
    union = reduce(or_, (Annotated[model, Tag(word)] for word, model in kinds.items()))
    return Annotated[union, Discriminator(_bearing_kind), BeforeValidator(_preset_table)]


def _auto(model: Model) -> Any:
    """Effects as a table; the word "auto" is the empty table: all effects are selected from the scene."""
    return Annotated[model, BeforeValidator(lambda value: {} if value == "auto" else value)]


_SURFACE, _BODY, _LAYOUT = model_of(Surface), model_of(Body), model_of(Layout)
_FRICTION_AT: Any = (Literal["surface", "pivot"], "surface")
_BEARING = model_of(
    Bearing,
    friction_at=_FRICTION_AT,
    layout=(_LAYOUT, ...),
    surfaces=(rows_of(_SURFACE), ...),
    bodies=(rows_of(_BODY), ...),
)
_CHANGES: Table = {name: (_read(rule.parse), None) for name, rule, _ in ruled_fields(Bearing)} | {
    name: (_read(partial(_column, rule)), None) for kind in (Surface, Body) for name, rule, _ in ruled_fields(kind)
}
_PRESET: Model = create_model(
    "PresetBearing", __base__=_Strict, preset=(_read(Text().parse), ...), friction_at=_FRICTION_AT, **_CHANGES
)
_BESIDE_SHEET = {name: field for name, field in _CHANGES.items() if name not in ("friction", *BOUNDS)}
_SHEET: Model = create_model("SheetBearing", __base__=_Strict, sheet=(model_of(Sheet), ...), **_BESIDE_SHEET)
_EITHER = _bearing_union(full=_BEARING, preset=_PRESET, sheet=_SHEET)
_ROTATION = _union(ROTATIONS.values())
_LOAD = _union(LOADS.values())
MOTION = _union(motion_tables.KINDS.values())
_TOP = _union((RigTop, PrescribedTop, MassTop))
PARTS: dict[str, Model] = {
    name: model_of(kind)
    for name, kind in {
        "effects": Auto,
        "solver": Solver,
        "initial_state": InitialState,
        "stop": Stop,
        "limits": Limits,
    }.items()
}
EFFECTS = _auto(PARTS["effects"])
SCENE = model_of(
    Scene,
    bearing=(_EITHER, ...),
    motion=(MOTION, ...),
    top=(_TOP, ...),
    load=(_LOAD, None),
    top_rotation=(_ROTATION, None),
    **{name: (EFFECTS if name == "effects" else model, None) for name, model in PARTS.items()},
)
_REMEDIES = {"list_type": "give a list of tables"}


def validate_part(name: str, table: Mapping[str, Any]) -> Table:
    """The table `[bearing]`, `[top]` or `[solver]` alone, as of `validate`; raises InputError of one line."""
    others = SCENE.model_fields.keys() - {name}
    return validate(without(SCENE, others, {name: table}), {name: table})[name]  # type: ignore[no-any-return]


def validate_suite(table: Mapping[str, Any]) -> Table:
    """The same for a suite of records: `records`, and `scale_to` with `least_share`."""
    return validate(SUITE, table)


_SHARE = Annotated[Any, PlainValidator(partial(Quantity("", above=0.0).parse, text=True))]
_SUITE_MOTION = model_of(motion_tables.RecordMotion, **_inner(motion_tables.RecordMotion))
_SUITE_TARGET = model_of(ScaleTo, least_share=(_SHARE, None))
SUITE: Model = create_model(
    "Suite",
    __base__=_Strict,
    records=(rows_of(_SUITE_MOTION), ...),
    scale_to=(_SUITE_TARGET, None),
)


def without(model: Model, others: Collection[str], table: Collection[str]) -> Model:
    """The model of tables without some keys; the whole model, which refuses it, where the table has an unknown key."""
    return _without(model, frozenset(others)) if others and model.model_fields.keys() >= set(table) else model


@lru_cache(maxsize=64)
def _without(model: Model, others: frozenset[str]) -> Model:
    chosen: Table = {
        name: (field.annotation, field) for name, field in model.model_fields.items() if name not in others
    }
    return create_model(model.__name__, __base__=_Strict, **chosen)


def validate(model: Model, table: Mapping[str, Any]) -> Table:
    """The table of a model, with its quantities in SI units and only the given keys; raises InputError of one line."""
    try:
        return _plain(model.model_validate(table))  # type: ignore[no-any-return]
    except ValidationError as error:
        details = error.errors(include_url=False)
    # A misspelt key is reported twice, as unknown and as missing: the report of the unknown key is more helpful.
    detail = min(details, key=lambda candidate: candidate["type"] != "extra_forbidden")
    raise InputError(_one_line(model, detail["type"], detail["loc"], detail["input"], detail.get("ctx", {})))


@lru_cache(maxsize=64)
def tables_of(model: Model) -> dict[str, Model]:
    """Every table within a table by its path: of a union with the word of its kind, as in `motion.harmonic`."""
    tables = {"": model}
    for name, field in model.model_fields.items():
        for word, inner in _models_in(field.annotation):
            head = f"{name}.{word}" if word else name
            tables |= {f"{head}.{path}" if path else head: table for path, table in tables_of(inner).items()}
    return tables


def _models_in(annotation: Any) -> Iterator[tuple[str, Model]]:
    """The models in the annotation of a field; of a union with the words by which they are distinguished."""
    tags = [item.tag for item in getattr(annotation, "__metadata__", ()) if isinstance(item, Tag)]
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        kind = annotation.model_fields.get("kind")
        yield ("" if kind is None else str(get_args(kind.annotation)[0])), annotation
    for part in get_args(annotation):
        yield from ((tags[0] if tags else word, model) for word, model in _models_in(part))


def _plain(value: Any) -> Any:
    """Pydantic models as dicts of the given keys."""
    if isinstance(value, BaseModel):
        return {name: _plain(getattr(value, name)) for name in sorted(value.model_fields_set)}
    return [_plain(item) for item in value] if isinstance(value, list) else value


def _one_line(model: Model, kind: str, location: tuple[int | str, ...], value: Any, context: Mapping[str, Any]) -> str:
    tables, (path, note) = tables_of(model), _path(model, location)
    key = str(location[-1])
    table = tables.get(_joined(location[:-1]), _Strict)
    if kind == "extra_forbidden":
        known = list(table.model_fields)
        hint = suggestion(key, known) or f"; the keys here are {', '.join(known)}"
        return f"{path}{note}: unknown key{hint}"
    if kind == "missing":
        return f"{path}{note} is missing: {_remedy(table, key)}"
    if kind.startswith("union_tag") and isinstance(value, Mapping):
        fact = f"{path}.kind = {value['kind']!r}" if "kind" in value else f"{path}.kind is missing"
        kinds = ", ".join(repr(word) for word, _ in _models_in(table.model_fields[key].annotation))
        return f"{fact}: give one of {kinds}"
    if kind == "literal_error":
        return f"{path} = {_short(value)}{note}: give {context['expected']}"
    remedy = str(context["error"]) if "error" in context else _REMEDIES.get(kind, "give a table")
    remedy += " or the name of a preset" if path == "bearing" else ""
    return f"{path} = {_short(value)}{note}: {remedy}"


def _joined(location: Iterable[int | str]) -> str:
    """The path in `tables_of` of a location: without places in lists."""
    return ".".join(part for part in location if isinstance(part, str))


def _path(model: Model, location: tuple[int | str, ...]) -> tuple[str, str]:
    """Path as in `bearing.surfaces[2].radius`, and the number of PEER 2017/07 as in ` (surface 3)`."""
    tables = tables_of(model)
    # What follows a path that is no table is the word of a kind in a union.
    parts = [
        part for index, part in enumerate(location) if isinstance(part, int) or _joined(location[:index]) in tables
    ]
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{_key(part)}" for part in parts).lstrip(".")
    for name, word, first in (("surfaces", "surface", 1), ("bodies", "body", 2)):
        if parts[1:2] == [name] and len(parts) > 2:
            return path, f" ({word} {int(parts[2]) + first})"
    return path, ""


def _key(name: str) -> str:
    """A key for a message: in quotes where it is not a plain word."""
    return name if name.replace("-", "_").isidentifier() and len(name) <= 60 else _short(name)


def _remedy(table: Model, name: str) -> str:
    """The remedy for a missing key: the text of its rule for the value None."""
    for item in table.model_fields[name].metadata if name in table.model_fields else ():
        if isinstance(item, PlainValidator):
            try:
                item.func(None)  # type: ignore[call-arg]
            except ValueError as error:
                return str(error)
    return "give this table"


def _short(value: Any) -> str:
    """`repr` of a value, at most 60 characters."""
    try:
        text = repr(value)
    except ValueError:  # Python refuses to write out whole numbers of thousands of digits
        text = "a number of thousands of digits"
    return text if len(text) <= 60 else text[:57] + "..."
