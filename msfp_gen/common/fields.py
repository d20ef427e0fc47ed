"""Validation rules of input fields, written as annotations: one definition serves Python and scene files.

A dataclass declares `radius: Annotated[float, Quantity("m", above=0)]` and calls `check_fields` in `__post_init__`. The
reader of scene files builds its schema from the same annotations. Functions that take quantities name their units in
`quantities`.

Texts with units become SI: "112 kN" becomes 112000.0. All other code uses SI only. Pint is slow to import, so it is
imported only for a text with a unit. Pint would evaluate expressions, so a text must first match a small grammar of
numbers and units: nothing in a scene file is executed.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from dataclasses import fields as dataclass_fields
from functools import cached_property, lru_cache, wraps
from inspect import signature
from numbers import Integral, Real
from typing import Any, Literal, ParamSpec, TypeVar, get_args, get_origin, get_type_hints

from msfp_gen.common.errors import InputError

P = ParamSpec("P")
R = TypeVar("R")
G = 9.80665  # standard gravity [m/s^2], the unit g of texts, records and figures, whatever the gravity of a bearing

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_TERM = r"[A-Za-zµμ°%_]+(?:(?:\^|\*\*)-?\d|[234])?[²³]?"
_PRODUCT = rf"{_TERM}(?:\s*[*·⋅]\s*{_TERM}|\s+{_TERM})*"
_FACTOR = rf"(?:\s*[*/·⋅]\s*{_TERM}|\s+{_TERM}|\s*/\s*\(\s*{_PRODUCT}\s*\))"
_TEXT = re.compile(rf"\s*({_NUMBER})\s*((?:1\s*/\s*)?{_TERM}{_FACTOR}*)?\s*")

# Pint treats radians as dimensionless and would accept 0.1 Hz for 0.1 rad/s, so angular units are checked here.
_ANGLE = re.compile(r"(?<![A-Za-z])(?:[mµμ]?rad(?:ian)?s?|deg(?:ree)?s?|°|turns?|rev(?:olution)?s?|rpm)(?![A-Za-z])")
_ANGULAR = {"rad", "rad/s"}
_NOT_ANGULAR = {"Hz"}

# Pint reads g as gram and gal as gallon; in an acceleration they are the standard gravity and cm/s^2.
_ACCELERATION_NAMES = {"g": "standard_gravity", "gal": "Gal"}
_PERCENT = {"%": 0.01, "percent": 0.01}


def number_and_unit(text: str) -> tuple[float, str | None] | None:
    """The number of a text such as "75 mm", and its unit, None without one. None for a text of another form."""
    match = _TEXT.fullmatch(text)
    return None if match is None else (float(match[1]), match[2])


def to_si(text: str, unit: str) -> float:
    """The value of a quantity such as "75 mm", in SI.

    Args:
        text: a number and its unit.
        unit: SI unit of the result; "" for a plain number, which may be given in percent.

    Raises:
        ValueError: the text is not a quantity, or has another dimension. The message states the remedy; the caller
            adds the field and the value.
    """
    remedy = f"give a number [{unit}] or a text with a unit of [{unit}]" if unit else "give a plain number"
    parts = number_and_unit(text)
    if parts is None:
        raise ValueError(f"this is no number with a unit; {remedy}")
    number, unit_text = parts
    if unit_text is None:
        raise ValueError(f"this text names no unit; {remedy}")
    if not unit:
        if unit_text not in _PERCENT:
            raise ValueError(f"this field has no unit; {remedy}")
        return number * _PERCENT[unit_text]
    angular = _ANGLE.search(unit_text) is not None
    if (unit in _ANGULAR and not angular) or (unit in _NOT_ANGULAR and angular):
        raise ValueError(f"the unit {unit_text!r} is not a unit of [{unit}]; {remedy}")
    return _convert(number, unit_text, unit, remedy)


def _convert(number: float, unit_text: str, unit: str, remedy: str) -> float:
    import pint

    name = re.sub(r"(?<=[A-Za-zµμ])[234]", r"^\g<0>", unit_text)  # "cm/s2"
    if unit == "m/s^2":
        name = re.sub(r"[A-Za-z_]+", lambda word: _ACCELERATION_NAMES.get(word[0], word[0]), name)
    try:
        return float(_registry().Quantity(number, name.replace("⋅", "·").replace("·", "*")).to(unit).magnitude)
    except pint.DimensionalityError:
        raise ValueError(f"the unit {unit_text!r} is not a unit of [{unit}]; {remedy}") from None
    except Exception:  # pint raises several types of exception for a unit that it cannot parse
        raise ValueError(f"the unit {unit_text!r} is unknown; {remedy}") from None


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


LARGEST = 1e30  # of an input in SI units, and the reciprocal of the smallest positive one: powers of them are finite


@dataclass(frozen=True)
class Quantity:
    """Rule of a field that holds finite numbers of one unit, of at most `LARGEST`.

    Attributes:
        unit: SI unit; "" for a plain number.
        above: exclusive lower bound [unit]; None: unbounded.
        least: inclusive lower bound [unit]; None: unbounded.
        below: exclusive upper bound [unit]; None: `LARGEST`.
        shape: () for one number, (3,) for three numbers, (None, 3) for any number of triples.
        whole: only integers are accepted.
        pair: a single number is accepted for two equal ones.
        computed: numbers that another program computed, such as coefficients; they have no bounds but these.
    """

    unit: str
    above: float | None = None
    least: float | None = None
    below: float | None = None
    shape: tuple[int | None, ...] = ()
    whole: bool = False
    pair: bool = False
    computed: bool = False

    def parse(self, value: object, *, text: bool = False) -> Any:
        """`value` as a float, an int or nested tuples of them [unit]; with `text`, strings with units are accepted.

        Raises ValueError that states the remedy only; the caller adds the field and the value.
        """
        if type(value) is float and not (self.shape or self.whole) and self.limits[0] <= value <= self.limits[1]:
            return value  # the most frequent case, without the questions of the others
        if self.pair and not _is_sequence(value):
            value = (value, value)
        return self._parse(value, self.shape, text)

    def _parse(self, value: object, shape: tuple[int | None, ...], text: bool) -> Any:
        if not shape:
            return self._number(value, text)
        if not _is_sequence(value) or (shape[0] is not None and len(value) != shape[0]):  # type: ignore[arg-type]
            raise ValueError(self.remedy)
        return tuple(self._parse(item, shape[1:], text) for item in value)  # type: ignore[attr-defined]

    def _number(self, value: object, text: bool) -> float | int:
        if text and isinstance(value, str):
            value = to_si(value, self.unit)
        kinds = (int, Integral) if self.whole else (float, int, Real)  # abstract classes last: they take longest
        if isinstance(value, bool) or not isinstance(value, kinds):
            raise ValueError(self.remedy)
        number = int(value) if self.whole else _float(value)  # type: ignore[arg-type]
        low, high = self.limits
        if low <= number <= high:
            return number
        beyond = math.isfinite(_float(number)) and (number > high or number < low == -LARGEST or 0 < number < low)
        raise ValueError(self.remedy_with_limits if beyond else self.remedy)

    @cached_property
    def limits(self) -> tuple[float, float]:
        """The least and the largest permitted number [unit]; what is emitted to C as well."""
        largest = sys.float_info.max if self.computed else LARGEST
        low = -largest if self.least is None else self.least
        if self.above is not None:
            low = math.nextafter(self.above, math.inf) if self.above else 1 / LARGEST
        return low, largest if self.below is None else math.nextafter(self.below, -math.inf)

    @property
    def remedy(self) -> str:
        """What to give, such as `give a finite number above 0 [m]`."""
        counts = ["any number of" if count is None else str(count) for count in self.shape]
        noun = "whole number" if self.whole else "finite number"
        head = f"give {' lists of '.join(counts)} {noun}s" if counts else f"give a {noun}"
        bounds = {"above": self.above, "not below": self.least, "below": self.below}
        limit = " and".join(f" {word} {bound:g}" for word, bound in bounds.items() if bound is not None)
        return head + limit + (f" [{self.unit}]" if self.unit else "")

    @property
    def remedy_with_limits(self) -> str:
        """The same with the largest number, and the least positive one."""
        if LARGEST not in self.limits:
            return self.remedy
        least = f"{1 / LARGEST:g} to " if self.above == 0 else "at most "
        return f"{self.remedy}, {least}{LARGEST:g}"


def paired(rule: Quantity) -> Quantity:
    """The rule of two numbers of one kind, for which a single one is accepted."""
    return replace(rule, shape=(2,), pair=True)


@dataclass(frozen=True, eq=False)
class Choice:
    """Rule of a field that takes one of a few values: words, or True and False.

    Attributes:
        words: the permitted values; as a mapping, each with its meaning.
    """

    words: Collection[Any]

    @property
    def meanings(self) -> Mapping[Any, str]:
        """Permitted value -> its meaning; "" where `words` gives none."""
        return self.words if isinstance(self.words, Mapping) else dict.fromkeys(self.words, "")

    def parse(self, value: object, *, text: bool = False) -> Any:
        """The permitted value that `value` equals. Raises ValueError that states the remedy only."""
        for word in self.words:
            if isinstance(value, type(word)) and value == word:  # a text of NumPy too, but 1 is not True
                return word
        raise ValueError("give one of " + ", ".join(repr(word) for word in self.words))


@dataclass(frozen=True)
class Text:
    """Rule of a field that takes a text, which every file format can hold."""

    def parse(self, value: object, *, text: bool = False) -> str:
        """`value` itself if it is a text. Raises ValueError that states the remedy only."""
        if not isinstance(value, str):
            raise ValueError("give a text in quotes")
        if not is_storable(value):
            raise ValueError("give a text without the NUL character and without halves of surrogate pairs")
        return value


def is_storable(text: str) -> bool:
    """Whether files can hold a text: HDF5 ends it at a NUL character, and UTF-8 has no lone surrogates."""
    return "\0" not in text and not any("\ud800" <= letter <= "\udfff" for letter in text)


@dataclass(frozen=True)
class Notes:
    """Rule of a field that takes a table: names with texts or finite numbers as values."""

    def parse(self, value: object, *, text: bool = False) -> dict[str, str | float]:
        """A copy of `value`. Raises ValueError that states the remedy only."""
        valid = isinstance(value, Mapping) and all(
            isinstance(key, str)
            and is_storable(key)
            and (
                (isinstance(item, str) and is_storable(item))
                or (isinstance(item, Real) and math.isfinite(_float(item)))
            )
            for key, item in value.items()
        )
        if not valid:
            raise ValueError("give a table of texts and finite numbers")
        return dict(value)  # type: ignore[call-overload, no-any-return]


Rule = Quantity | Choice | Text | Notes


def check_fields(instance: Any, path: str) -> None:
    """Check every field of a frozen dataclass that has a rule, and replace its value by the normalised one, in SI.

    Texts with units are accepted, such as radius="39 in"; None is accepted where it is the default. Raises InputError
    that names `path.field`, the value and the remedy.
    """
    values = vars(instance)
    for name, rule, default in ruled_fields(type(instance)):
        value = values[name]
        if value is None and default is None:
            continue
        try:
            parsed = rule.parse(value, text=True)
        except ValueError as error:
            raise InputError(f"{path}.{name} = {value!r}: {error}") from None
        if parsed is not value:
            object.__setattr__(instance, name, parsed)


def quantities(**units: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Decorate a function whose arguments of these names may be texts with a unit, alone or in lists, of this SI unit.

    The function gets them in SI. Raises InputError that names the argument, the text and the remedy.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        names = list(signature(function).parameters)

        @wraps(function)
        def called(*args: P.args, **kwargs: P.kwargs) -> R:
            given = [_in_si(name, value, units.get(name)) for name, value in zip(names, args, strict=False)]
            named = {name: _in_si(name, value, units.get(name)) for name, value in kwargs.items()}
            return function(*given, *args[len(names) :], **named)  # type: ignore[arg-type]

        return called

    return decorate


def _in_si(name: str, value: object, unit: str | None) -> object:
    """A value with the texts in it in SI, if it has a unit; lists and tuples of numbers are returned as they are."""
    if unit is not None and isinstance(value, str):
        try:
            return to_si(value, unit)
        except ValueError as error:
            raise InputError(f"{name} = {value!r}: {error}") from None
    if unit is not None and isinstance(value, list | tuple) and any(isinstance(x, str | list | tuple) for x in value):
        return [_in_si(name, item, unit) for item in value]
    return value


@contextmanager
def errors_at(prefix: str, path: str) -> Iterator[None]:
    """Replace `prefix` by `path` in every InputError of the block whose message begins with `prefix.`.

    An object checks its fields under a short name, such as `surface.radius`. Where it is part of a larger input, the
    message must name the field in that input, such as `bearing.surfaces[2].radius`.
    """
    try:
        yield
    except InputError as error:
        text = str(error)
        raise InputError(path + text.removeprefix(prefix) if text.startswith(f"{prefix}.") else text) from None


def require_type(value: object, kind: type | tuple[type, ...], path: str) -> None:
    """Raise InputError unless `value` is an instance of `kind`."""
    if not isinstance(value, kind):
        names = " or ".join(option.__name__ for option in (kind if isinstance(kind, tuple) else (kind,)))
        raise InputError(f"{path} = {_one_line(value)}: give a {names}")


def _one_line(value: object, most: int = 80) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= most else f"{text[:most]}..."


def ruled_fields(kind: type) -> tuple[tuple[str, Rule, object], ...]:
    """(name, rule, default) of every field of the dataclass `kind` that has a rule; MISSING for no default."""
    return _ruled_fields(kind)


@lru_cache(maxsize=64)
def _ruled_fields(kind: type) -> tuple[tuple[str, Rule, object], ...]:
    hints = get_type_hints(kind, include_extras=True)
    ruled = ((field, _rule(hints[field.name])) for field in dataclass_fields(kind))
    return tuple((field.name, rule, field.default) for field, rule in ruled if rule is not None)


# Rules of fields that are annotated with a plain type.
_TYPE_RULES: dict[Any, Rule] = {bool: Choice((True, False)), str: Text(), str | None: Text()}


def _rule(hint: Any) -> Rule | None:
    if hint in _TYPE_RULES:
        return _TYPE_RULES[hint]
    if get_origin(hint) is Literal:
        return Choice(get_args(hint))
    return next((item for item in getattr(hint, "__metadata__", ()) if isinstance(item, Rule)), None)


def _float(value: Any) -> float:
    """`value` as a float; infinity where it exceeds the range of a float."""
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _is_sequence(value: object) -> bool:
    is_array = hasattr(value, "ndim") and hasattr(value, "__len__")  # recognises ndarrays without importing numpy
    return (isinstance(value, Sequence) and not isinstance(value, str | bytes)) or (is_array and value.ndim > 0)  # type: ignore[attr-defined]
