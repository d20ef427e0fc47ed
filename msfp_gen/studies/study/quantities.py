"""What is kept of each run: columns of its summary and characterisation, peaks of any history, and formulas of them."""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from msfp_gen.errors import InputError
from msfp_gen.results.files import Storage
from msfp_gen.results.variables import Arrays, Places
from msfp_gen.scene.file.catalogue import suggestion
from msfp_gen.specification import formula
from msfp_gen.studies.columns import Counts, Quantity, Source, catalogue, plain_cell

# Word in a formula -> what it takes of a column of the history.
EXTREMES: dict[str, Callable[[Any], Any]] = {
    "peak": lambda values: np.abs(values).max(),
    "least": np.min,
    "most": np.max,
    "last": lambda values: values[-1],
}
# Word and field of the history -> the extreme over all steps of a run that is the same quantity.
_OVER_STEPS = {
    ("peak", "displacement"): "displacement",
    ("peak", "top_force"): "top_force",
    ("peak", "sliding"): "sliding",
    ("most", "sliding"): "sliding",
    ("least", "gap"): "gap",
    ("least", "normal_force"): "least_normal",
    ("most", "normal_force"): "most_normal",
    ("least", "friction_coefficient"): "least_friction",
    ("most", "friction_coefficient"): "most_friction",
    ("most", "temperature"): "temperature",
}
_EXTREME = re.compile(rf"\b({'|'.join(EXTREMES)})\(\s*([^()]*?)\s*\)")
CAPACITY_USED = "capacity_used"  # 1 - least gap / capacity: 1 where a slider meets its rim
TEXTS = ("rims_met", "verdict", "limits_exceeded")
_CAPACITY_USED = Quantity("", CAPACITY_USED)
_LEFT_OUT = ("status", "message")  # every row has them
_OPERATIONS = {**formula.FLOAT_OPERATIONS, "power": math.pow}


class Column(NamedTuple):
    """A column of the table of a study: name, unit, and whether it holds texts."""

    name: str
    unit: str
    text: bool = False


@dataclass(frozen=True)
class Keep:
    """What is kept of each run.

    Attributes:
        names: quantities, as in the study file.
        formulas: pairs of a name and a formula of quantities, axes, and `peak(...)`, `least(...)`, `most(...)`,
            `last(...)` of a column of the history: over all steps where the run records them, else of the rows.
        axes: names of the axes that hold numbers.
        counts: the most of any scene of the study.
        history: columns of the history, as in an exported file.
    """

    names: tuple[str, ...]
    formulas: tuple[tuple[str, str], ...]
    axes: tuple[str, ...]
    counts: Counts = field(default_factory=Counts)
    history: tuple[str, ...] = ()

    @cached_property
    def known(self) -> dict[str, Source]:
        """Column -> where it comes from, of everything that can be kept."""
        sources = catalogue(self.counts)
        sources = {name: source for name, source in sources.items() if name not in _LEFT_OUT}
        if not self.counts.bearings:
            sources |= {f"{CAPACITY_USED}_{k + 1}": Source(_CAPACITY_USED, k) for k in range(self.counts.surfaces)}
        return sources

    def columns(self) -> tuple[Column, ...]:
        """The columns, in the order of the study file. Raises InputError: an unknown quantity, or no valid formula."""
        return _columns(self)

    def values(self, result: Any, at: Mapping[str, float]) -> tuple[dict[str, Any], str]:
        """Column -> value, None where it is not defined; and a line about a characterisation that is not possible.

        at: the values of the axes that hold numbers.
        """
        reader = _Reader(result, self)
        formulas = dict(self.formulas)
        kept = {
            column.name: self._evaluated(column.name, formulas[column.name], reader, at)
            if column.name in formulas
            else reader.value(column.name)
            for column in self.columns()
        }
        return kept, reader.problem

    def _evaluated(self, name: str, text: str, reader: _Reader, at: Mapping[str, float]) -> float | None:
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


@lru_cache(maxsize=16)
def _columns(keep: Keep) -> tuple[Column, ...]:
    known, columns = keep.known, []
    for name in keep.names:
        columns_of_name = [key for key in known if key == name or re.fullmatch(rf"{re.escape(name)}_\d+", key)]
        if not columns_of_name:
            words = sorted({re.sub(r"_\d+$", "", key) for key in known})
            hint = suggestion(name, words) or f"; the quantities are {', '.join(words)}"
            raise InputError(f"keep: {name!r} is no quantity{hint}")
        columns += [Column(key, known[key].quantity.unit, key in TEXTS) for key in columns_of_name]
    for name, text in keep.formulas:
        _tree(keep, name, text)
        columns.append(Column(name, ""))
    return tuple(dict.fromkeys(columns))


@lru_cache(maxsize=64)
def _tree(keep: Keep, name: str, text: str) -> tuple[ast.expr, dict[str, tuple[str, str]]]:
    """Syntax tree of a formula, and the extremes in it: symbol -> (word, column of the history)."""
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
        return formula.parse(plain, [*numbers, *keep.axes, *extremes]), extremes
    except ValueError as error:
        word, named, _ = str(error).partition(" is no name of a law")
        why = f"{word} is no quantity and no axis that holds numbers; see docs/studies.md" if named else str(error)
        raise InputError(f"quantities.{name} = {text!r}: {why}") from None


def _finite(value: Any) -> float | None:
    number = float(value)
    return number if math.isfinite(number) else None


class _Reader:
    """Reads quantities of one run; its summary and its characterisation are made when they are first needed."""

    def __init__(self, result: Any, keep: Keep) -> None:
        self.result = result
        self._storage: Storage = result.storage()
        self.problem = ""
        self._keep = keep
        self._known = keep.known

    def value(self, name: str) -> Any:
        """The value of a quantity; None where the run has none."""
        source = self._known[name]
        if source.quantity is _CAPACITY_USED:
            return self._capacity_used(source.place or 0)
        value = source.value(self.result.summary, self._characterisation if source.quantity.characterised else None)
        if value is None and source.quantity.characterised and (why := source.reason(self._characterisation)):
            self.problem = f"no {name}: {why}"
        if name in TEXTS:
            return plain_cell(value)
        return None if value is None else _finite(value)

    def extreme(self, word: str, column: str) -> float | None:
        """An extreme of a column of the history; None where the run has no such column.

        Over all steps where the run records it, else of the rows.
        """
        if column not in self._columns:
            return None
        variable, index = self._columns[column]
        if variable.field not in self._arrays:
            return None
        if not self._keep.counts.bearings and (name := _OVER_STEPS.get((word, variable.field))):
            return _finite(getattr(self.result.extremes, name)[index[0]])
        return _finite(EXTREMES[word](variable.of(self._arrays)[:, *index]))

    @cached_property
    def _columns(self) -> Places:
        return self._storage.columns(self.result.scene)

    @cached_property
    def _arrays(self) -> Arrays:
        return self._storage.arrays_of(self.result)

    def _capacity_used(self, surface: int) -> float | None:
        surfaces = self.result.scene.bearing.surfaces
        if surface >= len(surfaces):
            return None
        capacity = float(surfaces[surface].capacity)
        return 1.0 - float(self.result.summary["minimum_gap"][surface]) / capacity

    @cached_property
    def _characterisation(self) -> Any:
        """None, and the problem, where it is not possible."""
        try:
            return self.result.characterise()
        except InputError as error:
            self.problem = f"not characterised: {error}"
            return None
