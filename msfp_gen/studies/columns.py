"""What a study keeps of a run: a result comes in, and one row of a table goes out.

A study keeps quantities of the summary and of the characterisation, extremes of columns of the history, and formulas of
these (`Keep`).
"""

from __future__ import annotations

import ast
import json
import math
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import Any, NamedTuple

import numpy as np

from msfp_gen.common.errors import InputError
from msfp_gen.results.files import Storage
from msfp_gen.results.quantities import ColumnSource, Side
from msfp_gen.results.variables import Arrays, Places
from msfp_gen.scene.file.catalogue import suggestion
from msfp_gen.specification import formula


def plain_cell(value: Any) -> Any:
    """A value for a cell of a table: a list of whole numbers (`rims_met`) with spaces, other collections as JSON."""
    if isinstance(value, list) and all(type(item) is int for item in value):
        return " ".join(map(str, value))
    return json.dumps(value, default=str) if isinstance(value, list | tuple | dict) else value


# Word in a formula -> function of a column of the history.
EXTREMES: dict[str, Callable[[Any], Any]] = {
    "peak": lambda values: np.abs(values).max(),
    "least": np.min,
    "most": np.max,
    "last": lambda values: values[-1],
}
_EXTREME = re.compile(rf"\b({'|'.join(EXTREMES)})\(\s*([^()]*?)\s*\)")
TEXTS = ("rims_met", "verdict", "verdict_text", "limits_exceeded", "limits_reached", "floor_spectra")
_LEFT_OUT = ("status", "message")  # every row has them
_OPERATIONS = {**formula.FLOAT_OPERATIONS, "power": math.pow}


def usual_names(sources: Mapping[str, ColumnSource]) -> tuple[str, ...]:
    """Names of the quantities that a study keeps where its file names none."""
    return names_of({name: source for name, source in sources.items() if source.quantity.kept})


def names_of(sources: Mapping[str, ColumnSource]) -> tuple[str, ...]:
    """Names, without the numbers of surfaces or parts, that keep all columns of `sources`."""
    kept = [name if source.place is None else name.rpartition("_")[0] for name, source in sources.items()]
    return tuple(dict.fromkeys(kept))


FLIPPED: dict[Side, Side] = {"most": "least", "least": "most", "": ""}
_SIDES: dict[str, Side] = {"peak": "most", "most": "most", "least": "least", "last": ""}  # of `EXTREMES`
_Sided = Side | float  # in a formula: the side of a value that a longer run changes, or a number


def _both(combine: Callable[[float, float], float], a: _Sided, b: _Sided) -> _Sided:
    """The side of what grows with both values, such as their sum."""
    if isinstance(a, float) and isinstance(b, float):
        return combine(a, b)
    sides = {x for x in (a, b) if not isinstance(x, float)}
    return sides.pop() if len(sides) == 1 else ""


def _negative(a: _Sided) -> _Sided:
    return -a if isinstance(a, float) else FLIPPED[a]


def _times(a: _Sided, b: _Sided) -> _Sided:
    """The side of a product, which is known where one of the two is a number."""
    if isinstance(a, float):
        a, b = b, a
    if isinstance(a, float) and isinstance(b, float):
        return a * b
    return "" if not isinstance(b, float) or b == 0 else a if b > 0 else _negative(a)


def _rising(function: Callable[[float], float]) -> Callable[[_Sided], _Sided]:
    return lambda a: function(a) if isinstance(a, float) else a


def _unsided(function: Callable[..., float]) -> Callable[..., _Sided]:
    return lambda *values: function(*values) if all(isinstance(value, float) for value in values) else ""


# Operations of a formula on sides.
_OF_SIDES: formula.Operations = {
    "number": float,
    "neg": _negative,
    "add": partial(_both, operator.add),
    "sub": lambda a, b: _both(operator.add, a, _negative(b)),
    "mul": _times,
    "div": lambda a, b: _times(a, 1 / b) if isinstance(b, float) and b else "",
    **{name: partial(_both, function) for name, function in (("Min", min), ("Max", max))},
    **{name: _rising(getattr(math, name)) for name in ("exp", "log", "sqrt", "tanh")},
    **{name: _unsided(function) for name, function in (("pow", math.pow), ("power", math.pow), ("Abs", abs))},
}


class Column(NamedTuple):
    """A column of the table of a study: name, unit, and whether it holds texts."""

    name: str
    unit: str
    text: bool = False


@dataclass(frozen=True)
class Keep:
    """The columns that a study keeps of each run.

    Attributes:
        names: quantities, as in the study file.
        formulas: (name, formula). A formula has quantities, axes, and `peak(...)`, `least(...)`, `most(...)`,
            `last(...)` of a column of the history: over all steps if the run records these, else over the rows.
        axes: names of the axes that hold numbers.
        sources: column -> where its value comes from, of the quantities of all scenes of the study.
        history: columns of the history, as in an exported file.
    """

    names: tuple[str, ...]
    formulas: tuple[tuple[str, str], ...]
    axes: tuple[str, ...]
    sources: tuple[tuple[str, ColumnSource], ...] = ()
    history: tuple[str, ...] = ()

    @cached_property
    def known(self) -> dict[str, ColumnSource]:
        """Column -> where its value comes from, for all columns that a study can keep."""
        return {name: source for name, source in self.sources if name not in _LEFT_OUT}

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """The columns, in the order of the study file. Raises InputError: unknown quantity, or invalid formula."""
        known, columns = self.known, []
        for name in self.names:
            columns_of_name = [key for key in known if key == name or re.fullmatch(rf"{re.escape(name)}_\d+", key)]
            if not columns_of_name:
                words = sorted({re.sub(r"_\d+$", "", key) for key in known})
                listed = f"the quantities are {', '.join(words)}" if words else "this system has none; give keep = []"
                hint = suggestion(name, words) or f"; {listed}"
                raise InputError(f"keep: {name!r} is no quantity{hint}")
            columns += [Column(key, known[key].quantity.unit, key in TEXTS) for key in columns_of_name]
        for name, text in self.formulas:
            _tree(self, name, text)
            columns.append(Column(name, ""))
        return tuple(dict.fromkeys(columns))

    @property
    def numbers(self) -> list[str]:
        """Names of the columns that hold numbers."""
        return [column.name for column in self.columns if not column.text]

    def side(self, name: str) -> Side:
        """How a run that ended early bounds a column, as `Quantity.side`; a formula by the sides of what is in it."""
        text = dict(self.formulas).get(name)
        if text is None:
            return self.known[name].quantity.side
        tree, extremes = _tree(self, name, text)
        symbols: dict[str, _Sided] = {symbol: _SIDES[word] for symbol, (word, _) in extremes.items()}
        for symbol in formula.names_in(tree) - symbols.keys():
            symbols[symbol] = self.known[symbol].quantity.side if symbol in self.known else ""
        try:
            found = formula.fold(tree, symbols, _OF_SIDES)
        except (ArithmeticError, ValueError):  # of numbers that have no value
            return ""
        return "" if isinstance(found, float) else found

    def values(self, result: Any, at: Mapping[str, float]) -> tuple[dict[str, Any], str]:
        """Column -> value, None where undefined; and a line that says why there is no characterisation, "" if there is.

        at: name -> value of the axes that hold numbers.
        """
        reader, formulas, row = _Reader(result, self), dict(self.formulas), {}
        for name, _, _ in self.columns:
            text = formulas.get(name)
            row[name] = reader.value(name) if text is None else self._formula_value(name, text, reader, at)
        return row, reader.problem

    def _formula_value(self, name: str, text: str, reader: _Reader, at: Mapping[str, float]) -> float | None:
        """The value of a formula; None where one of its quantities, or the formula, has none."""
        tree, extremes = _tree(self, name, text)
        values: dict[str, float] = {}
        for symbol in formula.names_in(tree):
            value = reader.extreme(*extremes[symbol]) if symbol in extremes else at.get(symbol)
            value = reader.value(symbol) if value is None and symbol not in extremes else value
            if value is None:
                return None
            values[symbol] = value
        try:
            return _finite(formula.fold(tree, values, _OPERATIONS))
        except (ArithmeticError, ValueError):  # such as a division by zero
            return None


@lru_cache(maxsize=64)
def _tree(keep: Keep, name: str, text: str) -> tuple[ast.expr, dict[str, tuple[str, str]]]:
    """Syntax tree of a formula, and the extremes in the formula: symbol -> (word, column of the history)."""
    columns, extremes = keep.history, dict[str, tuple[str, str]]()

    def symbol(match: re.Match[str]) -> str:
        word, column = match.groups()
        if column not in columns:
            hint = suggestion(column, list(columns)) or "; `msfp-gen export` writes them all"
            raise InputError(f"quantities.{name}: {column!r} is no column of a history{hint}")
        extremes[replaced := f"{word}_of_column_{columns.index(column) + 1}"] = (word, column)
        return replaced

    plain = _EXTREME.sub(symbol, text)
    numbers = [key for key in keep.known if key not in TEXTS]
    try:
        tree = formula.parse(plain, [*numbers, *keep.axes, *extremes])
    except ValueError as error:
        word, named, _ = str(error).partition(" is no name of a law")
        why = f"{word} is no quantity and no axis that holds numbers; see docs/studies.md" if named else str(error)
        raise InputError(f"quantities.{name} = {text!r}: {why}") from None
    if both := [word for word in sorted(formula.names_in(tree)) if word in keep.axes and word in numbers]:
        raise InputError(f"quantities.{name} = {text!r}: {both[0]} is a quantity and an axis; rename the axis")
    return tree, extremes


def _finite(value: Any) -> float | None:
    number = float(value)
    return number if math.isfinite(number) else None


class _Reader:
    """Reads quantities of one run; summary and characterisation are computed when first needed."""

    # problem: why a quantity of the characterisation has no value; "" where none was missing.

    def __init__(self, result: Any, keep: Keep) -> None:
        self.result = result
        self._storage: Storage = result.storage
        self.problem = ""
        self._known = keep.known

    def value(self, name: str) -> Any:
        """The value of a quantity; None where the run has none."""
        source = self._known[name]
        value = source.value(self.result.entry, self._characterisation if source.quantity.characterised else None)
        if value is None and source.quantity.characterised and (why := source.reason(self._characterisation)):
            self.problem = f"no {name}: {why}"
        if name in TEXTS:
            return plain_cell(value)
        return None if value is None else _finite(value)

    def extreme(self, word: str, column: str) -> float | None:
        """An extreme of a column of the history, over all steps if the run records these, else over the rows.

        None where the run has no such column.
        """
        if column not in self._columns:
            return None
        variable, index = self._columns[column]
        if variable.field not in self._arrays:
            return None
        over_steps = self.result.over_steps(word, variable.field)
        if over_steps is not None:
            return _finite(over_steps[index[0]])
        return _finite(EXTREMES[word](variable.of(self._arrays)[:, *index]))

    @cached_property
    def _columns(self) -> Places:
        return self._storage.columns(self.result.scene)

    @cached_property
    def _arrays(self) -> Arrays:
        return self._storage.arrays_of(self.result)

    @cached_property
    def _characterisation(self) -> Any:
        """The characterisation of the run; None, with the reason in `problem`, where it is not possible."""
        try:
            return self.result.characterise()
        except InputError as error:
            self.problem = f"not characterised: {error}"
            return None
