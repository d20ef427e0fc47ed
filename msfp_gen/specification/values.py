"""`Value`: a number of an input, with the rule that Python and the compiled C check; `Bound`: a limit by others."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from math import asin, pi
from typing import Any

from msfp_gen.common.fields import Quantity

_FUNCTIONS: dict[str, Any] = {"asin": asin, "pi": pi}  # that limits use


@dataclass(frozen=True)
class Value:
    """One number that a run takes.

    zero: what 0 means where it is permitted beside the numbers of the rule. base: whether the base has it, of a body.
    other_unit: in place of the rule's, for a number of several units.
    """

    name: str
    rule: Quantity
    meaning: str
    zero: str = ""
    base: bool = True
    other_unit: str = ""

    @property
    def unit(self) -> str:
        """SI unit; "-" for a plain number."""
        return self.other_unit or self.rule.unit or "-"


@dataclass(frozen=True)
class Array(Value):
    """The numbers behind a pointer of msfp_scene. count: in C. default: NULL stands for zeros."""

    count: str = ""
    default: bool = True


@dataclass(frozen=True)
class Bound:
    """The value `name` is at most `limit`, or below it (open): an expression in other values, in C as in Python."""

    name: str
    limit: str
    meaning: str
    open: bool = False

    def excess(self, values: Mapping[str, float]) -> float | None:
        """The limit [unit of the value], where the value is beyond it; else None."""
        names, function = _function(self.limit)
        limit = float(function(*(values[name] for name in names)))
        return None if values[self.name] < limit or (values[self.name] == limit and not self.open) else limit

    @property
    def remedy(self) -> str:
        """What to give, such as `give at most the height of the body`."""
        return f"give {'less than' if self.open else 'at most'} {self.meaning}"


@cache
def _function(limit: str) -> tuple[tuple[str, ...], Callable[..., float]]:
    """An expression of this package as a function, and the names of its arguments."""
    names = tuple(name for name in compile(limit, "limit", "eval").co_names if name not in _FUNCTIONS)
    return names, eval(f"lambda {', '.join(names)}: {limit}", {"__builtins__": {}, **_FUNCTIONS})


def rules(values: Iterable[Value]) -> dict[str, Quantity]:
    """The rules of values by name, for the annotations of fields."""
    return {value.name: value.rule for value in values}
