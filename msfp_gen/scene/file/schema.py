"""The schema of scene files: their tables, made from the field rules of the package's dataclasses.

`common.fields` holds the rules of values. Here nested tables are walked, and errors get their place in the file. The
`validate` functions return plain tables in SI units with only the keys that the file gives, or raise one InputError of
one line.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import MISSING
from functools import lru_cache, partial
from typing import Any, NamedTuple

from msfp_gen.common.aliases import SceneTable
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Choice, Quantity, Rule, Text, ruled_fields
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


class Place(NamedTuple):
    """Where a value stands, as in `bearing.surfaces[2].radius`; its number in PEER 2017/07, as in ` (surface 3)`."""

    path: str
    note: str = ""

    def key(self, key: object) -> Place:
        """The place of a key of a table here."""
        return Place(f"{self.path}.{key}" if self.path else str(key), self.note)

    def row(self, index: int) -> Place:
        """The place of a row of a list here."""
        word, first = _NUMBERED.get(self.path, ("", 0))
        return Place(f"{self.path}[{index}]", f" ({word} {index + first})" if word else self.note)

    def fact(self, value: object) -> str:
        """The value at this place, for a message."""
        return f"{self.path} = {_short(value)}{self.note}"


_NUMBERED = {"bearing.surfaces": ("surface", 1), "bearing.bodies": ("body", 2)}


class TableErrors:
    """The errors of one table. A misspelt key is unknown, and the right one missing: the former is more helpful."""

    def __init__(self) -> None:
        self._first: dict[bool, str] = {}

    def add(self, text: str, unknown: bool = False) -> None:
        """Add a line. unknown: whether it is of an unknown key."""
        self._first.setdefault(unknown, text)

    def raise_first(self) -> None:
        """Raise InputError of an unknown key, or of the first other error."""
        if self._first:
            raise InputError(self._first.get(True) or self._first[False])


class Reader(ABC):
    """What reads the value of a key. remedy: what to give where the key is missing."""

    remedy: str = "give this table"

    def tables(self) -> Iterable[tuple[str, Keys]]:
        """The tables that it reads; of several with the words that distinguish them."""
        return ()

    @abstractmethod
    def read(self, value: Any, place: Place, errors: TableErrors) -> Any:
        """The value in SI units; adds its errors."""


class ParsedValue(Reader):
    """Reads a value by the `parse` of a rule, texts with units included."""

    def __init__(self, parse: Callable[..., Any]) -> None:
        self._parse = parse

    @property
    def remedy(self) -> str:  # type: ignore[override]
        """The remedy of the rule."""
        try:
            self._parse(None, text=True)
        except ValueError as error:
            return str(error)
        return Reader.remedy

    def read(self, value: Any, place: Place, errors: TableErrors) -> Any:
        """See `Reader`."""
        try:
            return self._parse(value, text=True)
        except ValueError as error:
            errors.add(f"{place.fact(value)}: {error}")


class Key(NamedTuple):
    """A key of a table. default: MISSING where the table must have it."""

    reader: Reader
    default: Any = None

    @property
    def required(self) -> bool:
        """Whether a table must have it."""
        return self.default is MISSING


class Keys(Reader):
    """A table by its keys. short: what a value that is no table stands for."""

    def __init__(self, keys: Mapping[str, Key], short: Callable[[Any], Any] | None = None) -> None:
        self.keys, self.short = keys, short

    def tables(self) -> Iterable[tuple[str, Keys]]:
        """Itself."""
        return (("", self),)

    def read(self, value: Any, place: Place, errors: TableErrors, absent: Collection[str] = ()) -> Any:
        """See `Reader`. absent: keys that are not missed."""
        value = value if self.short is None else self.short(value)
        if not isinstance(value, Mapping):
            errors.add(f"{place.fact(value)}: give a table")
            return None
        found = {}
        for name, (reader, default) in self.keys.items():
            if name in value:
                found[name] = reader.read(value[name], place.key(name), errors)
            elif default is MISSING and name not in absent:
                errors.add(f"{place.key(name).path}{place.note} is missing: {reader.remedy}")
        for name in value if len(found) < len(value) else ():
            if name not in self.keys:
                hint = suggestion(str(name), list(self.keys)) or f"; the keys here are {', '.join(self.keys)}"
                errors.add(f"{place.key(_key(str(name))).path}{place.note}: unknown key{hint}", unknown=True)
        return {name: found[name] for name in sorted(found)}


class OneOf(Reader):
    """One of several tables.

    word: of a table -> its word, or an unknown one. what: to give in place of a value that is no table. short: see
    `Keys`.
    """

    def __init__(
        self,
        ways: Mapping[str, Keys],
        word: Callable[[Any], Any],
        what: str = "give a table",
        short: Callable[[Any], Any] | None = None,
    ) -> None:
        self.ways, self._word, self._what, self._short = ways, word, what, short

    def tables(self) -> Iterable[tuple[str, Keys]]:
        """The tables of all ways."""
        return self.ways.items()

    def read(self, value: Any, place: Place, errors: TableErrors) -> Any:
        """See `Reader`."""
        value = value if self._short is None else self._short(value)
        if not isinstance(value, Mapping):
            errors.add(f"{place.fact(value)}: {self._what}")
            return None
        word = self._word(value)
        if isinstance(word, str) and word in self.ways:
            return self.ways[word].read(value, place, errors)
        fact = f"{place.path}.kind = {_short(word)}" if "kind" in value else f"{place.path}.kind is missing"
        errors.add(f"{fact}: give one of {', '.join(map(repr, self.ways))}")


class ListOf(Reader):
    """A list of tables."""

    def __init__(self, row: Keys) -> None:
        self.row = row

    def tables(self) -> Iterable[tuple[str, Keys]]:
        """The tables of a row."""
        return self.row.tables()

    def read(self, value: Any, place: Place, errors: TableErrors) -> Any:
        """See `Reader`."""
        if isinstance(value, list | tuple):
            return [self.row.read(row, place.row(index), errors) for index, row in enumerate(value)]
        errors.add(f"{place.fact(value)}: give a list of tables")


def keys_of(kind: type, /, **more: Key) -> Keys:
    """The table of the fields of a dataclass that have a rule, and of `more` keys."""
    return Keys({name: Key(ParsedValue(rule.parse), default) for name, rule, default in ruled_fields(kind)} | more)


def required(reader: Reader) -> Key:
    """A key that a table must have."""
    return Key(reader, MISSING)


def _kinds(kinds: Iterable[Any]) -> OneOf:
    """The tables that their key `kind` distinguishes."""
    ways = {
        kind.kind: keys_of(kind, kind=required(ParsedValue(Choice((kind.kind,)).parse)), **_inner(kind))
        for kind in kinds
    }
    return OneOf(ways, lambda table: table.get("kind"))


def _inner(kind: type) -> dict[str, Key]:
    """Keys of a kind that are tables themselves."""
    scaled = {"scale_to": Key(_SCALE_TO)} if kind is motion_tables.RecordMotion else {}
    return scaled | ({"rotation": Key(_ROTATION)} if issubclass(kind, motion_tables.MotionTable) else {})


def _column(rule: Rule, value: object, *, text: bool) -> Any:
    """A value for all surfaces or bodies, or a list with one value for each."""
    pairs = isinstance(rule, Quantity) and bool(rule.shape)
    if isinstance(value, list) and (not pairs or any(isinstance(item, list) for item in value)):
        return [rule.parse(item, text=text) for item in value]
    return rule.parse(value, text=text)


def _preset_table(value: Any) -> Any:
    """The name of a preset as a table; other values unchanged."""
    return {"preset": value} if isinstance(value, str) else value


def _way(table: Mapping[str, Any]) -> str:
    return next((key for key in ("preset", "sheet") if key in table), "full")


def _auto(value: Any) -> Any:
    """The word "auto" as the empty table: all effects are selected from the scene; other values unchanged."""
    return {} if isinstance(value, str) and value == "auto" else value


_SCALE_TO = keys_of(ScaleTo)
_FRICTION_AT = Key(ParsedValue(Choice(("surface", "pivot")).parse), "surface")
_FULL = keys_of(
    Bearing,
    friction_at=_FRICTION_AT,
    layout=required(keys_of(Layout)),
    surfaces=required(ListOf(keys_of(Surface))),
    bodies=required(ListOf(keys_of(Body))),
)
_CHANGES = {name: Key(ParsedValue(rule.parse)) for name, rule, _ in ruled_fields(Bearing)} | {
    name: Key(ParsedValue(partial(_column, rule))) for kind in (Surface, Body) for name, rule, _ in ruled_fields(kind)
}
_BESIDE_SHEET = {name: key for name, key in _CHANGES.items() if name not in ("friction", *BOUNDS)}
_BEARING = OneOf(
    {
        "full": _FULL,
        "preset": Keys({"preset": required(ParsedValue(Text().parse)), "friction_at": _FRICTION_AT, **_CHANGES}),
        "sheet": Keys({"sheet": required(keys_of(Sheet)), **_BESIDE_SHEET}),
    },
    _way,
    "give a table or the name of a preset",
    _preset_table,
)
_ROTATION = _kinds(ROTATIONS.values())
MOTION = _kinds(motion_tables.KINDS.values())
EFFECTS = Keys(keys_of(Auto).keys, _auto)
SOLVER, LIMITS = keys_of(Solver), keys_of(Limits)
SCENE = keys_of(
    Scene,
    bearing=required(_BEARING),
    motion=required(MOTION),
    top=required(_kinds((RigTop, PrescribedTop, MassTop))),
    load=Key(_kinds(LOADS.values())),
    top_rotation=Key(_ROTATION),
    effects=Key(EFFECTS),
    solver=Key(SOLVER),
    initial_state=Key(keys_of(InitialState)),
    stop=Key(keys_of(Stop)),
    limits=Key(LIMITS),
)
SUITE = Keys(
    {
        "records": required(ListOf(keys_of(motion_tables.RecordMotion, **_inner(motion_tables.RecordMotion)))),
        "scale_to": Key(keys_of(ScaleTo, least_share=Key(ParsedValue(Quantity("", above=0.0).parse)))),
    }
)


def validate_part(name: str, table: Mapping[str, Any]) -> SceneTable:
    """The table `[bearing]`, `[top]` or `[solver]` alone, as in `validate`; raises InputError of one line."""
    return validate(SCENE, {name: table}, SCENE.keys)[name]  # type: ignore[no-any-return]


def validate_suite(table: Mapping[str, Any]) -> SceneTable:
    """The same for a suite of records: `records`, and `scale_to` with `least_share`."""
    return validate(SUITE, table)


def validate(keys: Keys, table: Mapping[str, Any], absent: Collection[str] = ()) -> SceneTable:
    """A table with its quantities in SI units and only the given keys; raises InputError of one line.

    absent: keys that the table need not have.
    """
    errors = TableErrors()
    found: SceneTable = keys.read(table, Place(""), errors, absent)
    errors.raise_first()
    return found


@lru_cache(maxsize=64)
def tables_of(keys: Keys) -> dict[str, Keys]:
    """Every table within a table by its path: of several with the word of its kind, as in `motion.harmonic`."""
    tables = {"": keys}
    for name, key in keys.keys.items():
        for word, inner in key.reader.tables():
            head = f"{name}.{word}" if word else name
            tables |= {f"{head}.{path}" if path else head: table for path, table in tables_of(inner).items()}
    return tables


def _key(name: str) -> str:
    """A key for a message: in quotes where it is not a plain word."""
    return name if name.replace("-", "_").isidentifier() and len(name) <= 60 else _short(name)


def _short(value: Any) -> str:
    """`repr` of a value, at most 60 characters."""
    try:
        text = repr(value)
    except ValueError:  # Python refuses to write out whole numbers of thousands of digits
        text = "a number of thousands of digits"
    return text if len(text) <= 60 else text[:57] + "..."
