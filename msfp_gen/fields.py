"""Rules of input fields as data: one place says what a field may hold, in Python and in scene files.

A dataclass writes `radius: Annotated[float, Quantity("m", above=0)]` and calls `check_fields` in `__post_init__`; the
scene reader builds its tables from the same annotations.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from dataclasses import fields as dataclass_fields
from functools import lru_cache
from numbers import Integral, Real
from typing import Any, Literal, get_args, get_origin, get_type_hints

from msfp_gen.errors import InputError
from msfp_gen.quantities import to_si


@dataclass(frozen=True)
class Quantity:
    """Finite numbers of one unit: `shape` () for one number, (3,) for three, (None, 3) for any number of triples.

    `above` and `least` are the open and the closed lower bound, in SI. `pair` lets one number stand for both of two.
    """

    unit: str
    above: float | None = None
    least: float | None = None
    shape: tuple[int | None, ...] = ()
    whole: bool = False
    pair: bool = False

    def parse(self, value: object, *, text: bool = False) -> Any:
        """`value` as float, int or nested tuples of them; with `text`, strings with units are read too.

        Raises ValueError with the remedy alone; the caller adds the field and the value.
        """
        if self.pair and not _is_sequence(value):
            value = (value, value)
        return self._parse(value, self.shape, text)

    def _parse(self, value: object, shape: tuple[int | None, ...], text: bool) -> Any:
        if not shape:
            return self._number(value, text)
        if not _is_sequence(value) or (shape[0] is not None and len(value) != shape[0]):  # type: ignore[arg-type]
            raise ValueError(self._remedy())
        return tuple(self._parse(item, shape[1:], text) for item in value)  # type: ignore[attr-defined]

    def _number(self, value: object, text: bool) -> float | int:
        if text and isinstance(value, str):
            value = to_si(value, self.unit)
        kind = Integral if self.whole else Real
        if isinstance(value, bool) or not isinstance(value, kind):
            raise ValueError(self._remedy())
        number = int(value) if self.whole else _float(value)  # type: ignore[call-overload]
        low = (self.above is not None and number <= self.above) or (self.least is not None and number < self.least)
        if low or not math.isfinite(_float(number)):
            raise ValueError(self._remedy())
        return number

    def _remedy(self) -> str:
        counts = ["any number of" if count is None else str(count) for count in self.shape]
        noun = "whole number" if self.whole else "finite number"
        head = f"give {' lists of '.join(counts)} {noun}s" if counts else f"give a {noun}"
        bounds = {"above": self.above, "not below": self.least}
        limit = "".join(f" {word} {bound:g}" for word, bound in bounds.items() if bound is not None)
        return head + limit + (f" [{self.unit}]" if self.unit else "")


@dataclass(frozen=True, eq=False)
class Choice:
    """One of a few words, or of True and False; as a mapping, each with what it means."""

    words: Collection[Any]

    @property
    def meanings(self) -> Mapping[Any, str]:
        """Word -> what it means, "" where nothing is said."""
        return self.words if isinstance(self.words, Mapping) else dict.fromkeys(self.words, "")

    def parse(self, value: object, *, text: bool = False) -> Any:
        """`value` itself if it is one of the words; raises ValueError with the remedy alone."""
        if not any(type(value) is type(word) and value == word for word in self.words):
            raise ValueError("give one of " + ", ".join(repr(word) for word in self.words))
        return value


@dataclass(frozen=True)
class Text:
    """Any text."""

    def parse(self, value: object, *, text: bool = False) -> str:
        """`value` itself; raises ValueError with the remedy alone."""
        if not isinstance(value, str):
            raise ValueError("give a text in quotes")
        return value


@dataclass(frozen=True)
class Notes:
    """A table of names with texts or finite numbers."""

    def parse(self, value: object, *, text: bool = False) -> dict[str, str | float]:
        """A copy of `value`; raises ValueError with the remedy alone."""
        fine = isinstance(value, Mapping) and all(
            isinstance(key, str) and (isinstance(item, str) or (isinstance(item, Real) and math.isfinite(_float(item))))
            for key, item in value.items()
        )
        if not fine:
            raise ValueError("give a table of texts and finite numbers")
        return dict(value)  # type: ignore[call-overload, no-any-return]


Rule = Quantity | Choice | Text | Notes


def check_fields(instance: Any, path: str) -> None:
    """Check and normalise every ruled field of a frozen dataclass in place. None passes where None is the default.

    Raises InputError that names `path.field`, the value and the remedy.
    """
    for name, rule, default in ruled_fields(type(instance)):
        value = getattr(instance, name)
        if value is None and default is None:
            continue
        try:
            object.__setattr__(instance, name, rule.parse(value))
        except ValueError as error:
            raise InputError(f"{path}.{name} = {value!r}: {error}") from None


@contextmanager
def located(word: str, path: str) -> Iterator[None]:
    """Give a message that names its field `word.field` the whole path of that field."""
    try:
        yield
    except InputError as error:
        text = str(error)
        raise InputError(path + text.removeprefix(word) if text.startswith(f"{word}.") else text) from None


def require_type(value: object, kind: type | tuple[type, ...], path: str) -> None:
    """Raise InputError unless `value` is an instance of `kind`."""
    if not isinstance(value, kind):
        names = " or ".join(each.__name__ for each in (kind if isinstance(kind, tuple) else (kind,)))
        raise InputError(f"{path} = {value!r}: give a {names}")


def ruled_fields(kind: type) -> Iterator[tuple[str, Rule, object]]:
    """(name, rule, default) of every field of a dataclass whose annotation carries a rule; MISSING without default."""
    rules = _rules(kind)
    return ((field.name, rules[field.name], field.default) for field in dataclass_fields(kind) if field.name in rules)


_PLAIN: dict[Any, Rule] = {bool: Choice((True, False)), str: Text(), str | None: Text()}


@lru_cache(maxsize=64)
def _rules(kind: type) -> dict[str, Rule]:
    hints = get_type_hints(kind, include_extras=True)
    found = {name: _rule(hint) for name, hint in hints.items()}
    return {name: rule for name, rule in found.items() if rule is not None}


def _rule(hint: Any) -> Rule | None:
    if hint in _PLAIN:
        return _PLAIN[hint]
    if get_origin(hint) is Literal:
        return Choice(get_args(hint))
    return next((item for item in getattr(hint, "__metadata__", ()) if isinstance(item, Rule)), None)


def _float(value: Any) -> float:
    """`value` as a float; infinite where it is too large for one."""
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _is_sequence(value: object) -> bool:
    array = hasattr(value, "ndim") and hasattr(value, "__len__")  # numpy, without importing it
    return (isinstance(value, Sequence) and not isinstance(value, str | bytes)) or (array and value.ndim > 0)  # type: ignore[attr-defined]
