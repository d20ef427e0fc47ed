"""The quantities of a run that tables, studies and bounds report: names, units, and places in a result.

A result comes in and one row of a table goes out. A study keeps quantities of the summary and of the characterisation,
extremes of columns of the history, and formulas of these (`Keep`).
"""

from __future__ import annotations

import ast
import json
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.errors import InputError
from msfp_gen.results.files import Storage
from msfp_gen.results.variables import Arrays, Places
from msfp_gen.scene.file.catalogue import suggestion
from msfp_gen.specification import formula

if TYPE_CHECKING:
    from msfp_gen.scene.system import System


class Quantity(NamedTuple):
    """A quantity of a run.

    path: dotted path of the value in the summary, or in the characterisation if `characterised`; `.*` stands for each
    surface, floor, storey or bearing, bottom first or in the order of the file, and gives one column for each. governs:
    whether the largest or the least value governs a design; "" if neither does. at_rest: whether the quantity is
    defined only if the run ends at rest.
    """

    unit: str
    path: str
    governs: Literal["most", "least", ""] = ""
    characterised: bool = False
    at_rest: bool = False


RUN = {
    "status": Quantity("", "status"),
    "message": Quantity("", "message"),
    "duration": Quantity("s", "duration"),
    "peak_displacement": Quantity("m", "peak_displacement.radial", "most"),
    "peak_force": Quantity("N", "peak_force.radial", "most"),
    "peak_force_ratio": Quantity("", "peak_force_ratio"),
    "rims_met": Quantity("", "rims_met"),
    "verdict": Quantity("", "verdict.word"),
    "limits_exceeded": Quantity("", "verdict.limits"),
    "closure_error": Quantity("", "energy.closure_error"),
    "steps": Quantity("", "counters.steps"),
    "wall_time": Quantity("s", "wall_time"),
    "secant_stiffness": Quantity("N/m", "secant_stiffness", characterised=True),
    "energy_dissipated": Quantity("J", "energy_dissipated", characterised=True),
    "residual_displacement": Quantity("m", "residual_displacement", "most", characterised=True, at_rest=True),
    # means over the cycles
    "effective_stiffness": Quantity("N/m", "envelope.effective_stiffness.mean", characterised=True),
    "effective_period": Quantity("s", "envelope.effective_period.mean", characterised=True),
    "effective_damping": Quantity("", "envelope.effective_damping.mean", characterised=True),
    "zero_displacement_force": Quantity("N", "envelope.zero_displacement_force.mean", characterised=True),
}
BEARING = RUN | {
    "axial_load": Quantity("N", "axial_load"),
    "peak_input_energy": Quantity("J", "energy.peak_input"),
    "dissipated_share": Quantity("", "energy.dissipated_share"),
    "peak_sliding": Quantity("m", "peak_sliding.*"),
    "minimum_gap": Quantity("m", "minimum_gap.*"),
    "minimum_normal_force": Quantity("N", "minimum_normal_force.*"),
    "maximum_normal_force": Quantity("N", "maximum_normal_force.*"),
    "least_friction": Quantity("", "least_friction.*"),
    "most_friction": Quantity("", "most_friction.*"),
    "peak_temperature": Quantity("degC", "peak_temperature.*"),
    "peak_rim_force": Quantity("N", "peak_rim_force.*"),
    "uplift_height": Quantity("m", "uplift.height"),
    "uplift_duration": Quantity("s", "uplift.duration"),
    "maximum_uplift": Quantity("m", "maximum_uplift", "most", characterised=True),
    "capacity_left": Quantity("m", "surfaces.*.capacity_left", "least", characterised=True),
    "peak_velocity": Quantity("m/s", "surfaces.*.peak_velocity", "most", characterised=True),
    "peak_heat_flux": Quantity("W/m^2", "surfaces.*.peak_heat_flux", "most", characterised=True),
}
BUILDING = RUN | {
    "peak_base_torsion": Quantity("N m", "peak_base_torsion"),
    "peak_overturning_moment": Quantity("N m", "peak_overturning_moment.radial", "most"),
    "peak_floor_acceleration": Quantity("m/s^2", "peak_floor_acceleration.radial", "most"),
    "peak_vertical_acceleration": Quantity("m/s^2", "peak_floor_acceleration.E3"),
    "peak_drift_ratio": Quantity("", "peak_drift_ratio", "most"),
    "peak_corner_drift_ratio": Quantity("", "peak_corner_drift_ratio", "most"),
    "minimum_load_ratio": Quantity("", "minimum_load_ratio", "least"),
    "maximum_load_ratio": Quantity("", "maximum_load_ratio", "most"),
    "floor_acceleration": Quantity("m/s^2", "floors.*.peak_acceleration.radial", "most"),
    "storey_drift_ratio": Quantity("", "storeys.*.peak_drift_ratio", "most"),
    "storey_corner_drift_ratio": Quantity("", "storeys.*.peak_corner_drift_ratio", "most"),
    "storey_shear": Quantity("N", "storeys.*.peak_shear.radial", "most"),
    "bearing_displacement": Quantity("m", "bearings.*.peak_displacement.radial", "most"),
    "bearing_load_ratio": Quantity("", "bearings.*.minimum_load_ratio", "least"),
    "bearing_maximum_load_ratio": Quantity("", "bearings.*.maximum_load_ratio", "most"),
    "bearing_uplift_height": Quantity("m", "bearings.*.uplift.height", "most"),
    "bearing_uplift_duration": Quantity("s", "bearings.*.uplift.duration", "most"),
    "secant_period": Quantity("s", "secant_period", characterised=True),
    "capacity_left": Quantity("m", "capacity_left", "least", characterised=True),
}


MOVING = "the run ends while the bearing still moves: give motion.hold, such as 20 s, for time without motion"


class Source(NamedTuple):
    """Where the value of a column comes from: a quantity of the run, or of one of its parts.

    place: index from 0 of the surface, floor, storey or bearing; None: of the run. part: name of that part in messages.
    """

    quantity: Quantity
    place: int | None = None
    part: str = ""

    def reason(self, characterisation: Any) -> str:
        """Why a characterised run has no value of the quantity; "" where no reason is known."""
        rests = getattr(characterisation, "at_rest", True)
        return "" if rests or not self.quantity.at_rest else MOVING

    @property
    def compared(self) -> bool:
        """Whether `bound` compares the quantity; quantities of parts of a building are compared in suites only."""
        of_part = self.quantity.path.partition(".*")[0] in ("floors", "storeys", "bearings")
        return not of_part and (self.quantity.characterised or bool(self.quantity.governs))

    def value(self, summary: Mapping[str, Any], characterisation: Any) -> Any:
        """The value of the quantity; None where the run has none.

        characterisation: of the run; None where it is not needed, or not possible.
        """
        quantity = self.quantity
        if quantity.at_rest and not getattr(characterisation, "at_rest", False):
            return None
        value = value_at(characterisation if quantity.characterised else summary, quantity.path)
        if self.place is None or value is None:
            return value
        return value[self.place] if self.place < len(value) else None


class Counts(NamedTuple):
    """Number of columns for a quantity of each kind of part: surfaces (the most of any bearing), parts of a building.

    A scene of one bearing has no floors, storeys and bearings.
    """

    surfaces: int = 0
    floors: int = 0
    storeys: int = 0
    bearings: int = 0

    @classmethod
    def of(cls, scene: System) -> Counts:
        """The counts of a scene."""
        surfaces = max(len(bearing.surfaces) for bearing in scene.every_bearing)
        if not isinstance(scene, BuildingScene):
            return cls(surfaces)
        return cls(surfaces, len(scene.building.nodes), len(scene.building.columns), len(scene.bearings))

    def or_more(self, other: Counts) -> Counts:
        """The larger count of each kind of part."""
        return Counts(*map(max, self, other))


@lru_cache(maxsize=16)
def catalogue(counts: Counts) -> dict[str, Source]:
    """Column -> where its value comes from, for a bearing or for a building."""
    sources: dict[str, Source] = {}
    for name, quantity in (BUILDING if counts.bearings else BEARING).items():
        head, several, _ = quantity.path.partition(".*")
        if several:
            numbers = range(getattr(counts, head, counts.surfaces))
            sources |= {f"{name}_{index + 1}": Source(quantity, index) for index in numbers}
        else:
            sources[name] = Source(quantity)
    return sources


def value_at(table: Any, path: str) -> Any:
    """The value at a dotted path of keys or attributes, None where there is none; `*` gives a list over all rows."""
    value = table
    head, several, rest = path.partition(".*")
    for part in head.split("."):
        value = value.get(part) if isinstance(value, Mapping) else getattr(value, part, None)
    if not several or value is None:
        return value
    return [value_at(row, rest.lstrip(".")) for row in value] if rest else value


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
# (word, field of the history) -> field of `Extremes` with the same quantity over all steps of a run.
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
CAPACITY_USED = "capacity_used"  # 1 - minimum gap / capacity; 1 where a slider meets its rim
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
    """The columns that a study keeps of each run.

    Attributes:
        names: quantities, as in the study file.
        formulas: (name, formula). A formula has quantities, axes, and `peak(...)`, `least(...)`, `most(...)`,
            `last(...)` of a column of the history: over all steps if the run records these, else over the rows.
        axes: names of the axes that hold numbers.
        counts: the largest of any scene of the study.
        history: columns of the history, as in an exported file.
    """

    names: tuple[str, ...]
    formulas: tuple[tuple[str, str], ...]
    axes: tuple[str, ...]
    counts: Counts = field(default_factory=Counts)
    history: tuple[str, ...] = ()

    @cached_property
    def known(self) -> dict[str, Source]:
        """Column -> where its value comes from, for all columns that a study can keep."""
        sources = {name: source for name, source in catalogue(self.counts).items() if name not in _LEFT_OUT}
        if not self.counts.bearings:
            sources |= {f"{CAPACITY_USED}_{k + 1}": Source(_CAPACITY_USED, k) for k in range(self.counts.surfaces)}
        return sources

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """The columns, in the order of the study file. Raises InputError: unknown quantity, or invalid formula."""
        known, columns = self.known, []
        for name in self.names:
            columns_of_name = [key for key in known if key == name or re.fullmatch(rf"{re.escape(name)}_\d+", key)]
            if not columns_of_name:
                words = sorted({re.sub(r"_\d+$", "", key) for key in known})
                hint = suggestion(name, words) or f"; the quantities are {', '.join(words)}"
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
    """Reads quantities of one run; summary and characterisation are computed when first needed.

    problem: why a quantity of the characterisation has no value; "" where none was missing.
    """

    def __init__(self, result: Any, keep: Keep) -> None:
        self.result = result
        self._storage: Storage = result.storage
        self.problem = ""
        self._keep = keep
        self._known = keep.known

    def value(self, name: str) -> Any:
        """The value of a quantity; None where the run has none."""
        source = self._known[name]
        if source.quantity is _CAPACITY_USED:
            surfaces, place = self.result.scene.bearing.surfaces, source.place or 0
            gap = self.result.summary["minimum_gap"]
            return 1.0 - float(gap[place]) / float(surfaces[place].capacity) if place < len(surfaces) else None
        value = source.value(self.result.summary, self._characterisation if source.quantity.characterised else None)
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
        if not self._keep.counts.bearings and (name := _OVER_STEPS.get((word, variable.field))):
            return _finite(getattr(self.result.extremes, name)[index[0]])
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
