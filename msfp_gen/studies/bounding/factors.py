"""Property-modification factors (lambda): read from tables in TOML, and combined by the rule of a code.

First step of a bounding analysis; `runs.py` multiplies the properties of a scene by the combined factors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from math import prod
from pathlib import Path
from typing import Any, NamedTuple

from msfp_gen.common.errors import InputError, prefixed
from msfp_gen.common.fields import Quantity, Text
from msfp_gen.common.inputs import is_input
from msfp_gen.scene.file.catalogue import check_whole_numbers, known_keys, parsed, suggestion
from msfp_gen.scene.file.loader import toml_file, toml_table

Pair = tuple[float, float]


class CombinationRule(NamedTuple):
    """How a code combines factors.

    Attributes:
        separately: whether the adjustment reduces each environmental factor; otherwise it reduces their product.
        adjustment: value that the code fixes [-]; None if the table gives it.
        formula: the rule as text.
        remedy: values to give, for error messages.
    """

    separately: bool
    adjustment: float | None
    formula: str
    remedy: str


RULES = {
    "asce7": CombinationRule(
        False, 0.75, "lambda = (1 + a (product of environment - 1)) x product of direct", "give 0.75"
    ),
    "en1998-2": CombinationRule(
        True,
        None,
        "lambda = product of (1 + psi (environment - 1)) x product of direct",
        "give psi: 0.90, 0.70 or 0.60 for importance class III, II or I",
    ),
    "aashto": CombinationRule(
        True,
        None,
        "lambda = product of (1 + f_a (environment - 1)) x product of direct",
        "give f_a: 1.00, 0.75 or 0.66 for critical, essential or other bridges",
    ),
}
# Property -> fields of `Surface` that its factor multiplies; a friction law may have two coefficients.
PROPERTIES = {
    "friction": ("friction", "friction_slow"),
    "yield_displacement": ("yield_displacement",),
    "rim_stiffness": ("rim_stiffness",),
    "rim_damping": ("rim_damping",),
}
_PAIR = Quantity("", above=0.0, shape=(2,))
_SHARE = Quantity("", least=0.0)
_SURFACES = Quantity("", least=1, whole=True, shape=(None,))
_TABLE_KEYS = ("description", "source", "rule", "adjustment", "limits", "factor")
_FACTOR_KEYS = ("property", "surfaces", "environment", "direct")


@dataclass(frozen=True)
class Factor:
    """The causes that change one property of surfaces.

    Attributes:
        property: a key of PROPERTIES.
        surfaces: numbers of the surfaces, 1..n-1; empty for all surfaces.
        environment: cause, such as ageing, contamination or temperature -> (least, most) factor [-]. Codes reduce these
            factors, since the causes seldom occur together.
        direct: cause, such as tests or specification -> (least, most) factor [-], which codes do not reduce.
    """

    property: str
    surfaces: tuple[int, ...]
    environment: Mapping[str, Pair]
    direct: Mapping[str, Pair]


@dataclass(frozen=True)
class FactorTable:
    """A table of factors and the rule that combines them.

    Attributes:
        name: of the table or file.
        description, source: texts.
        rule: a key of RULES.
        adjustment: system property adjustment factor of the rule [-].
        limits: upper limit of lambda_min and lower limit of lambda_max [-]; None without limits.
        factors: of all properties.
    """

    name: str
    description: str
    source: str
    rule: str
    adjustment: float
    limits: Pair | None
    factors: tuple[Factor, ...]

    def combined(self, factor: Factor) -> Pair:
        """(lambda_min, lambda_max) of a factor by the rule and the limits of this table [-]."""
        low, high = (self._combined(factor, end) for end in (0, 1))
        return (low, high) if self.limits is None else (min(low, self.limits[0]), max(high, self.limits[1]))

    def _combined(self, factor: Factor, end: int) -> float:
        environment = [pair[end] for pair in factor.environment.values()]
        adjusted = environment if RULES[self.rule].separately else [prod(environment)]
        direct = [pair[end] for pair in factor.direct.values()]
        return prod(1 + self.adjustment * (value - 1) for value in adjusted) * prod(direct)


SHEET = FactorTable("sheet", "lower and upper friction of the bearing's data sheet, no factors", "", "", 1.0, None, ())


def factor_tables() -> dict[str, str]:
    """Name -> description of the tables that come with the package."""
    return {name: load_factors(name).description for name in _bundled()}


def factor_text(name: str) -> str:
    """The TOML text of a table that comes with the package, to be edited. Raises InputError for an unknown name."""
    known = _bundled()
    if name not in known:
        hint = suggestion(name, known) or f"; the tables are {', '.join(known)}"
        raise InputError(f"factors = {name!r}: neither a file nor the name of a table{hint}")
    return known[name]


def load_factors(source: str | Path) -> FactorTable:
    """Read a table of factors. source: a TOML file, the name of a table that comes with the package, or "sheet".

    "sheet" stands for the bounds of friction that the bearing itself has. Raises InputError of one line that names
    file, field, value and remedy.
    """
    path = Path(source)
    if str(source) == SHEET.name:
        return SHEET
    if str(source) in _bundled() or not is_input(path):
        return _read(str(source), toml_table(factor_text(str(source))))
    with prefixed(f"{path}: "):
        return _read(path.stem, toml_file(path))


def _bundled() -> dict[str, str]:
    """Name -> text of the tables that come with the package."""
    folder = files(__package__) / "codes"
    paths = {path.name.removesuffix(".toml"): path for path in folder.iterdir() if path.name.endswith(".toml")}
    return {name: paths[name].read_text(encoding="utf-8") for name in sorted(paths)}


def _read(name: str, table: Mapping[str, Any]) -> FactorTable:
    """Check and read the table of a TOML file. Raises InputError."""
    check_whole_numbers(table)
    known_keys(table, _TABLE_KEYS, "")
    rule = _choice(table.get("rule"), RULES, "rule")
    default = RULES[rule].adjustment
    if "adjustment" not in table and default is None:
        raise InputError(f"adjustment is missing: {RULES[rule].remedy}")
    adjustment = parsed(_SHARE, table.get("adjustment", default), "adjustment")
    if adjustment > 1:
        raise InputError(f"adjustment = {adjustment}: {RULES[rule].remedy}")
    rows = table.get("factor", [])
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        raise InputError("factor is missing: give at least one table [[factor]] with a property and its causes")
    factors = tuple(_factor(row, f"factor[{index}]") for index, row in enumerate(rows))
    limits = _pair(table["limits"], "limits") if "limits" in table else None
    description, source = (parsed(Text(), table.get(key, ""), key) for key in ("description", "source"))
    return FactorTable(name, description, source, rule, adjustment, limits, factors)


def _factor(row: Mapping[str, Any], path: str) -> Factor:
    """Read a table [[factor]]. path: of the table, for messages. Raises InputError."""
    known_keys(row, _FACTOR_KEYS, f"{path}.")
    property_name = _choice(row.get("property"), PROPERTIES, f"{path}.property")
    surfaces = parsed(_SURFACES, row.get("surfaces", []), f"{path}.surfaces")
    if "surfaces" in row and not surfaces:
        raise InputError(f"{path}.surfaces = []: give numbers of surfaces, from 1, or leave it out for all")
    causes = {key: _causes(row.get(key, {}), f"{path}.{key}") for key in ("environment", "direct")}
    if not any(causes.values()):
        raise InputError(f"{path}: no causes; give environment or direct, such as {{ ageing = [1.0, 1.3] }}")
    return Factor(property_name, surfaces, **causes)


def _causes(table: Any, path: str) -> dict[str, Pair]:
    if not isinstance(table, dict):
        raise InputError(f"{path} = {table!r}: give a table of causes, such as {{ ageing = [1.0, 1.3] }}")
    return {cause: _pair(pair, f"{path}.{cause}") for cause, pair in table.items()}


def _pair(value: Any, path: str) -> Pair:
    """Read (least, most). Raises InputError unless the pair encloses 1, since the scene is the nominal case."""
    low, high = parsed(_PAIR, value, path)
    if not low <= 1 <= high:
        raise InputError(
            f"{path} = {value!r}: give [least, most] with least <= 1 <= most; the scene is the nominal case"
        )
    return low, high


def _choice(value: Any, known: Mapping[str, Any], path: str) -> str:
    if value is None:
        raise InputError(f"{path} is missing: give one of {', '.join(known)}")
    if not isinstance(value, str) or value not in known:
        hint = suggestion(str(value), known) or f"; give one of {', '.join(known)}"
        raise InputError(f"{path} = {value!r}: unknown name{hint}")
    return value
