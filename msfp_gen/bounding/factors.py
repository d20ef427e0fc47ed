"""Property-modification factors: tables in TOML, and the formulas by which codes combine what is in them."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from math import prod
from pathlib import Path
from typing import Any, NamedTuple

from msfp_gen.catalogue import suggestion
from msfp_gen.errors import InputError
from msfp_gen.fields import Quantity, Text

Pair = tuple[float, float]


class Rule(NamedTuple):
    """How a code reduces environmental factors by its adjustment: their product at once, or each by itself."""

    each: bool
    adjustment: float | None  # where the code fixes it
    formula: str
    remedy: str


RULES = {
    "asce7": Rule(False, 0.75, "lambda = (1 + a (product of environment - 1)) x product of direct", "give 0.75"),
    "en1998-2": Rule(
        True, None, "lambda = product of (1 + psi (environment - 1)) x product of direct",
        "give psi: 0.90, 0.70 or 0.60 for importance class III, II or I"),
    "aashto": Rule(
        True, None, "lambda = product of (1 + f_a (environment - 1)) x product of direct",
        "give f_a: 1.00, 0.75 or 0.66 for critical, essential or other bridges"),
}  # fmt: skip
# What a factor may multiply -> the fields of `Surface` that go with it; a law of friction may have two coefficients.
PROPERTIES = {
    "friction": ("friction", "friction_slow"),
    "yield_displacement": ("yield_displacement",),
    "rim_stiffness": ("rim_stiffness",),
    "rim_damping": ("rim_damping",),
}
_PAIR = Quantity("", above=0.0, shape=(2,))
_SHARE = Quantity("", least=0.0)
_LISTS = Quantity("", least=1, whole=True, shape=(None,))
_TOP_KEYS = ("description", "source", "rule", "adjustment", "limits", "factor")
_KEYS = ("property", "surfaces", "environment", "direct")


@dataclass(frozen=True)
class Factor:
    """Causes that change one property of some surfaces (1..n-1; none named: of all), each a pair (least, most).

    environment: ageing, contamination, temperature and so on, which codes reduce since they seldom meet. direct: tests
    and specification, which they do not.
    """

    property: str
    surfaces: tuple[int, ...]
    environment: Mapping[str, Pair]
    direct: Mapping[str, Pair]


@dataclass(frozen=True)
class FactorTable:
    """A table of factors and the rule that combines them; limits: (most of lambda_min, least of lambda_max)."""

    name: str
    description: str
    source: str
    rule: str
    adjustment: float
    limits: Pair | None
    factors: tuple[Factor, ...]

    def combined(self, factor: Factor) -> Pair:
        """(lambda_min, lambda_max) of `factor` by the table's rule and limits."""
        low, high = (self._combined(factor, end) for end in (0, 1))
        return (low, high) if self.limits is None else (min(low, self.limits[0]), max(high, self.limits[1]))

    def _combined(self, factor: Factor, end: int) -> float:
        environment = [pair[end] for pair in factor.environment.values()]
        adjusted = environment if RULES[self.rule].each else [prod(environment)]
        direct = [pair[end] for pair in factor.direct.values()]
        return prod(1 + self.adjustment * (value - 1) for value in adjusted) * prod(direct)


def factor_tables() -> dict[str, str]:
    """Name -> description of the tables that come with the package."""
    return {name: load_factors(name).description for name in _shipped()}


def factor_text(name: str) -> str:
    """The TOML text of a table that comes with the package, to be edited. Raises InputError for an unknown name."""
    known = _shipped()
    if name not in known:
        hint = suggestion(name, known) or f"; the tables are {', '.join(known)}"
        raise InputError(f"factors = {name!r}: no file, and no table of that name{hint}")
    return known[name]


def load_factors(source: str | Path) -> FactorTable:
    """The table in a TOML file, or the one of that name that comes with the package.

    Raises InputError of one line that names the file, the field, the value and the remedy.
    """
    path = Path(source)
    if str(source) in _shipped() or not path.is_file():
        return _read(str(source), factor_text(str(source)))
    try:
        return _read(path.stem, path.read_text(encoding="utf-8"))
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: no UTF-8 text at byte {error.start}; save the file as UTF-8") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _shipped() -> dict[str, str]:
    folder = files("msfp_gen") / "presets" / "factors"
    found = {path.name.removesuffix(".toml"): path for path in folder.iterdir() if path.name.endswith(".toml")}
    return {name: found[name].read_text(encoding="utf-8") for name in sorted(found)}


def _read(name: str, text: str) -> FactorTable:
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"no valid TOML: {error}") from None
    _known_keys(table, _TOP_KEYS, "")
    rule = _word(table.get("rule"), RULES, "rule")
    default = RULES[rule].adjustment
    if "adjustment" not in table and default is None:
        raise InputError(f"adjustment is missing: {RULES[rule].remedy}")
    adjustment = _parsed(_SHARE, table.get("adjustment", default), "adjustment")
    if adjustment > 1:
        raise InputError(f"adjustment = {adjustment}: {RULES[rule].remedy}")
    rows = table.get("factor", [])
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        raise InputError("factor is missing: give at least one table [[factor]] with property and its causes")
    factors = tuple(_factor(row, f"factor[{index}]") for index, row in enumerate(rows))
    limits = _around_one(table["limits"], "limits") if "limits" in table else None
    description, source = (_parsed(Text(), table.get(key, ""), key) for key in ("description", "source"))
    return FactorTable(name, description, source, rule, adjustment, limits, factors)


def _factor(row: Mapping[str, Any], path: str) -> Factor:
    _known_keys(row, _KEYS, f"{path}.")
    named = _word(row.get("property"), PROPERTIES, f"{path}.property")
    surfaces = _parsed(_LISTS, row.get("surfaces", []), f"{path}.surfaces")
    if "surfaces" in row and not surfaces:
        raise InputError(f"{path}.surfaces = []: give numbers of surfaces, from 1, or leave it out for all")
    causes = {key: _causes(row.get(key, {}), f"{path}.{key}") for key in ("environment", "direct")}
    if not any(causes.values()):
        raise InputError(f"{path}: no causes; give environment or direct, such as ageing = [1.0, 1.3]")
    return Factor(named, surfaces, **causes)


def _causes(table: Any, path: str) -> dict[str, Pair]:
    if not isinstance(table, dict):
        raise InputError(f"{path} = {table!r}: give a table of causes, such as {{ ageing = [1.0, 1.3] }}")
    return {cause: _around_one(pair, f"{path}.{cause}") for cause, pair in table.items()}


def _around_one(value: Any, path: str) -> Pair:
    low, high = _parsed(_PAIR, value, path)
    if not low <= 1 <= high:
        raise InputError(
            f"{path} = {value!r}: give [least, most] with least <= 1 <= most; the scene is the nominal case"
        )
    return low, high


def _parsed(rule: Quantity | Text, value: Any, path: str) -> Any:
    try:
        return rule.parse(value)
    except ValueError as error:
        raise InputError(f"{path} = {value!r}: {error}") from None


def _word(value: Any, known: Mapping[str, Any], path: str) -> str:
    if value is None:
        raise InputError(f"{path} is missing: give one of {', '.join(known)}")
    if not isinstance(value, str) or value not in known:
        hint = suggestion(str(value), known) or f"; give one of {', '.join(known)}"
        raise InputError(f"{path} = {value!r}: not known here{hint}")
    return value


def _known_keys(table: Mapping[str, Any], known: Iterable[str], path: str) -> None:
    names = list(known)
    for key in table:
        if key not in names:
            hint = suggestion(key, names) or f"; the keys here are {', '.join(names)}"
            raise InputError(f"{path}{key}: unknown key{hint}")
