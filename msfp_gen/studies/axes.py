"""The axes of a study: values or distributions, what each axis changes in the base scene, and the scenes that result.

First step of a study: tables of axes come in; `Sampling` draws the values of random axes, and `SceneFactory`, in a
worker, makes the scene of a run from one value for each axis.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from msfp_gen.common.aliases import SceneTable
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, prefixed
from msfp_gen.common.fields import Choice, Quantity, check_fields
from msfp_gen.scene.fidelity import at_fidelity
from msfp_gen.scene.file.catalogue import parsed, suggestion
from msfp_gen.scene.file.changes import changed_table, keys_of_path, multiplied_table
from msfp_gen.scene.file.motion_tables import RecordMotion
from msfp_gen.scene.file.source import located_value, scene_of
from msfp_gen.scene.scene_fields import SceneFields
from msfp_gen.scene.system import System
from msfp_gen.studies.bounding.factors import FactorTable
from msfp_gen.studies.bounding.runs import bounded_scenes

WITHIN = (2.0**-53, 1 - 2.0**-53)  # least and largest probability at which every distribution has a finite value
MOST = 10_000_000  # samples; each takes 8 bytes for each random axis, in the process that starts the study

# Distribution -> its parameters.
DISTRIBUTIONS: dict[str, tuple[str, ...]] = {
    "uniform": ("low", "high"),
    "triangular": ("low", "mode", "high"),
    "normal": ("mean", "deviation"),
    "lognormal": ("median", "dispersion"),
}
METHODS = {
    "latin-hypercube": "one value in each of `samples` intervals of equal probability, for each axis",
    "random": "independent values",
    "sobol-sequence": "a scrambled Sobol' sequence; give a power of two",
    "one-at-a-time": "medians, and each axis alone at two quantiles (`msfp-gen study tornado`)",
    "listed": "the rows of `values`, one value for each axis",
}


@dataclass(frozen=True)
class Distribution:
    """A probability distribution of the values of an axis.

    kind: a key of DISTRIBUTIONS. parameters: numbers in the order of DISTRIBUTIONS [SI]; `deviation` is the standard
    deviation of the value, `dispersion` the standard deviation of its logarithm. between: bounds at which the
    distribution is cut off; None: no bounds. Raises InputError.
    """

    kind: str
    parameters: tuple[float, ...]
    between: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        parameters = dict(zip(DISTRIBUTIONS[self.kind], self.parameters, strict=True))
        for name in ("deviation", "dispersion", "median"):
            if name in parameters and parameters[name] <= 0:
                raise InputError(f"{name} = {parameters[name]:g}: give a number above 0")
        values = [parameters[name] for name in ("low", "mode", "high") if name in parameters]
        if values and (sorted(values) != values or values[0] == values[-1]):
            raise InputError(f"{', '.join(map(str, values))}: give {' < '.join(DISTRIBUTIONS[self.kind])}")
        if self.between is not None and not self.share(self.between[0]) < self.share(self.between[1]):
            raise InputError(f"between = {list(self.between)}: give bounds between which the distribution has values")

    def values(self, shares: Array) -> Array:
        """The quantiles at `shares`, probabilities in (0, 1); of the shape of `shares` [its unit]."""
        if self.between is not None:
            low, high = (self.share(bound) for bound in self.between)
            shares = low + shares * (high - low)
        values = np.asarray(_scipy_distribution(self.kind, self.parameters).ppf(shares))
        if self.kind == "lognormal":  # the exponential of NumPy depends on the processor
            values = self.parameters[0] * np.exp(values)
        return values if self.between is None else np.clip(values, *self.between)

    def share(self, value: float) -> float:
        """The cumulative probability of a value [-], without the bounds `between`."""
        if self.kind == "lognormal":
            value = float(np.log(value / self.parameters[0])) if value > 0 else -np.inf
        return float(_scipy_distribution(self.kind, self.parameters).cdf(value))


@lru_cache(maxsize=64)
def _scipy_distribution(kind: str, parameters: tuple[float, ...]) -> Any:
    """The distribution as in `scipy.stats`; for a lognormal kind, of the logarithm of value over median."""
    from scipy import stats

    if kind == "triangular":
        low, mode, high = parameters
        return stats.triang((mode - low) / (high - low), low, high - low)
    first, second = parameters
    if kind == "uniform":
        return stats.uniform(first, second - first)
    return stats.norm(first if kind == "normal" else 0.0, second)


@dataclass(frozen=True)
class Sampling:
    """How the values of the random axes are drawn: the table `[sampling]` of a study file.

    method: a key of METHODS. samples: number of samples; None for one-at-a-time and listed, where it follows. seed:
    equal seeds give equal values. quantiles: of each axis, for one-at-a-time. values: for listed, one row for each
    sample, shape (samples, random axes) [units of the axes]. cells: for listed, the combination of the values of the
    gridded axes for each sample, shape (samples,), from 1, the last axis fastest; None: every sample has all
    combinations. Raises InputError.
    """

    method: Annotated[str, Choice(METHODS)] = "latin-hypercube"
    samples: Annotated[int | None, Quantity("", least=1, whole=True)] = None
    seed: Annotated[int, Quantity("", least=0, whole=True)] = 0
    quantiles: Annotated[tuple[float, float], Quantity("", above=0.0, shape=(2,))] = (0.1, 0.9)
    values: Annotated[tuple[tuple[float, ...], ...] | None, Quantity("", shape=(None, None))] = None
    cells: Annotated[tuple[int, ...] | None, Quantity("", least=1, whole=True, shape=(None,))] = None

    def __post_init__(self) -> None:
        check_fields(self, "sampling")
        if self.samples is not None and self.samples > MOST:
            raise InputError(f"sampling.samples = {self.samples}: give at most {MOST}")
        if (self.samples is None) != (self.method in ("one-at-a-time", "listed")):
            fact = "is missing" if self.samples is None else f"= {self.samples}"
            rule = "leave it out: the number follows" if self.samples else "give the number of samples"
            raise InputError(f"sampling.samples {fact}: {rule}, with method = {self.method!r}")
        if not self.quantiles[0] < self.quantiles[1] < 1:
            raise InputError(f"sampling.quantiles = {list(self.quantiles)}: give two, rising, between 0 and 1")
        listed = self.values or self.cells
        if bool(listed) != (self.method == "listed"):
            raise InputError("sampling.values: give one row for each sample, with method = 'listed' only")
        if self.values and self.cells and len(self.values) != len(self.cells):
            raise InputError(
                f"sampling.cells: {len(self.cells)} of them and {len(self.values)} rows of values; give one each"
            )

    def drawn(self, distributions: Sequence[Distribution]) -> Array:
        """Values of the axes with these distributions, shape (samples, axes) [units of the axes]. Raises InputError."""
        count = len(distributions)
        if self.values is not None:
            if any(len(row) != count for row in self.values):
                raise InputError(
                    f"sampling.values: give {count} values in each row, one for each axis with a distribution"
                )
            return np.array(self.values)
        if self.cells is not None:
            if count:
                raise InputError(f"sampling.values: give {count} values for each sample, one for each random axis")
            return np.zeros((len(self.cells), 0))
        return values_at(self.shares(count), distributions)

    def shares(self, axes: int) -> Array:
        """Cumulative probabilities in (0, 1), ndarray, shape (samples, axes), [-]; equal for equal seeds."""
        if not axes:
            return np.zeros((1, 0))
        from scipy.stats import qmc

        rng, count = np.random.default_rng(self.seed), self.samples or 0
        if self.method == "latin-hypercube":
            rows = qmc.LatinHypercube(axes, rng=rng).random(count)
        elif self.method == "random":
            rows = rng.random((count, axes))
        elif self.method == "one-at-a-time":  # medians, then two rows for each axis: its lower and its upper quantile
            rows = np.full((1 + 2 * axes, axes), 0.5)
            for axis in range(axes):
                rows[1 + 2 * axis : 3 + 2 * axis, axis] = self.quantiles
        elif count & (count - 1):
            near = 2 ** max(count.bit_length() - 1, 0), 2 ** count.bit_length()
            raise InputError(
                f"sampling.samples = {count}: a Sobol' sequence needs a power of two; give {near[0]} or {near[1]}"
            )
        else:
            rows = qmc.Sobol(axes, rng=rng).random(count)
        return np.asarray(np.clip(rows, *WITHIN))


def values_at(shares: Array, distributions: Sequence[Distribution]) -> Array:
    """Quantiles of the distributions at probabilities `shares`, shape (samples, axes) [units of the axes]."""
    inside = np.clip(shares, *WITHIN)
    return np.column_stack([of_axis.values(inside[:, index]) for index, of_axis in enumerate(distributions)])


def distribution_from(table: Mapping[str, Any]) -> tuple[Distribution, set[str]]:
    """The distribution in the table of an axis, and the keys of the table that define it. Raises InputError."""
    kind = table["distribution"]
    if not isinstance(kind, str) or kind not in DISTRIBUTIONS:
        raise InputError(f"distribution = {kind!r}: give one of {', '.join(map(repr, DISTRIBUTIONS))}")
    names = DISTRIBUTIONS[kind]
    if missing := [name for name in names if name not in table]:
        raise InputError(f"{missing[0]} is missing: distribution = {kind!r} has {', '.join(names)}")
    numbers = {name: number_of(table, name) for name in names}
    if (between := table.get("between")) is not None:
        between = parsed(Quantity("", shape=(2,)), between, "between")
    return Distribution(kind, tuple(numbers.values()), between), {"distribution", "between", *names}


def number_of(table: Mapping[str, Any], name: str) -> float:
    """A finite number of a table. Raises InputError."""
    try:
        return float(Quantity("").parse(table[name]))
    except ValueError as error:
        raise InputError(f"{name} = {table[name]!r}: {error}; in SI units") from None


KEYS = ("sets", "multiplies", "factors", "surfaces", "values", "labels", "range", "points", "spacing", "distribution")
RESERVED = ("run", "status", "message")
SPACINGS = ("linear", "log")
MOST_VALUES = 10_000  # of one axis; workers receive all values


@dataclass(frozen=True)
class Axis:
    """One axis of a study.

    Attributes:
        name: of the axis and of its column in the table.
        change: what a value does to the scene: "sets" fields, "multiplies" fields, selects the case of a table of
            lambda "factors", selects a "record", scales the record ("scale"), or nothing ("free").
        paths: the fields, such as `bearing.friction`; for "factors" the table of factors.
        surfaces: numbers of the surfaces (1..n-1) that the axis changes; None: all.
        values: of a gridded axis; None for a random axis.
        labels: the values as the column of the table shows them, all numbers or all texts.
        distribution: of a random axis; None for a gridded axis.
    """

    name: str
    change: str
    paths: tuple[str, ...] = ()
    surfaces: tuple[int, ...] | None = None
    values: tuple[Any, ...] | None = None
    labels: tuple[Any, ...] = ()
    distribution: Distribution | None = None

    @property
    def random(self) -> bool:
        """Whether the values are drawn from a distribution."""
        return self.distribution is not None

    @property
    def numeric(self) -> bool:
        """Whether the column of the axis holds numbers."""
        return self.random or all(isinstance(label, float) for label in self.labels)


def axis_from(name: str, table: Any, folder: Path | None) -> Axis:
    """The axis of the table `[axes.NAME]` of a study file. folder: of the file, to which paths are relative.

    Raises InputError that starts with `axes.NAME`.
    """
    path = f"axes.{name}"
    if not isinstance(table, Mapping):
        raise InputError(f"{path} = {table!r}: give a table, such as sets = 'bearing.friction', values = [0.05, 0.08]")
    if not re.fullmatch(r"[^\W\d]\w*", name) or name in RESERVED:
        why = "the table has such a column" if name in RESERVED else "a name has letters, digits and _ only"
        raise InputError(f"{path}: {why}; give another name")
    with prefixed(f"{path}."):
        complete, used = _with_values(Axis(name, *_change(table), _surfaces(table)), table)
    known = {*used, "sets", "multiplies", "factors", "surfaces"}
    if extra := [key for key in table if key not in known]:
        everything = {*KEYS, "between", "low", "mode", "high", "mean", "deviation", "median", "dispersion"}
        if extra[0] in everything:
            raise InputError(f"{path}.{extra[0]}: not together with {', '.join(sorted(used))}; leave one out")
        hint = suggestion(extra[0], sorted(everything)) or f"; the keys here are {', '.join(KEYS)}"
        raise InputError(f"{path}.{extra[0]}: unknown key{hint}")
    with prefixed(f"{path}: "):
        return located(complete, folder)


def _change(table: Mapping[str, Any]) -> tuple[str, tuple[str, ...]]:
    """`change` and `paths` of the axis of a table."""
    changes = [key for key in ("sets", "multiplies", "factors") if key in table]
    if len(changes) > 1:
        raise InputError(f"{changes[1]}: not together with {changes[0]}; use one axis for each")
    if not changes:
        return "free", ()
    value = table[changes[0]]
    paths = (value,) if isinstance(value, str) else tuple(value) if isinstance(value, list) else ()
    if not paths or not all(isinstance(path, str) and all(path.split(".")) for path in paths):
        raise InputError(f"{changes[0]} = {value!r}: give a field of the scene in quotes, such as 'bearing.friction'")
    return changes[0], paths


def _surfaces(table: Mapping[str, Any]) -> tuple[int, ...] | None:
    if "surfaces" not in table:
        return None
    value = table["surfaces"]
    if not isinstance(value, list) or not value or not all(type(item) is int and item > 0 for item in value):
        raise InputError(f"surfaces = {value!r}: give a list of surfaces, 1 for the lowest")
    return tuple(value)


def _with_values(axis: Axis, table: Mapping[str, Any]) -> tuple[Axis, set[str]]:
    """The axis with its values or its distribution, and the keys of the table that define these."""
    if "distribution" in table:
        distribution, used = distribution_from(table)
        return replace(axis, distribution=distribution), used
    if axis.change == "factors":
        return grid(axis, table.get("values", ["lower", "nominal", "upper"])), {"values"}
    if "values" in table:
        return grid(axis, table["values"], table.get("labels")), {"values", "labels"}
    if "range" in table:
        return grid(axis, _range(table)), {"range", "points", "spacing"}
    raise InputError("values is missing: give values = [...], range = [low, high] with points, or a distribution")


def grid(axis: Axis, values: Any, labels: Any = None) -> Axis:
    """The axis with a list of values and, unless None, a list of labels. Raises InputError."""
    if not isinstance(values, list) or not values or len(values) > MOST_VALUES:
        raise InputError(f"values = {_short(values)}: give a list of 1 to {MOST_VALUES} values")
    if len({json.dumps(value, default=str) for value in values}) < len(values):
        raise InputError(f"values = {_short(values)}: a value occurs twice; give each once")
    if labels is not None and (not isinstance(labels, list) or len(labels) != len(values)):
        raise InputError(f"labels = {_short(labels)}: give one for each of the {len(values)} values")
    labels = values if labels is None else labels
    if all(isinstance(label, int | float) and not isinstance(label, bool) for label in labels):
        column_labels: tuple[Any, ...] = tuple(map(float, labels))
    else:
        column_labels = tuple(
            str(label) if isinstance(label, str | int | float) else json.dumps(label) for label in labels
        )
    return replace(axis, values=tuple(values), labels=column_labels)


def located(axis: Axis, folder: Path | None) -> Axis:
    """The axis with absolute paths where its values name files relative to a folder. Raises InputError."""
    if axis.change != "sets" or axis.values is None:
        return axis
    values = axis.values
    for path in axis.paths:
        values = tuple(located_value(path, value, folder) for value in values)
    return replace(axis, values=values)


def _range(table: Mapping[str, Any]) -> list[float]:
    """The values of the keys `range`, `points` and `spacing`."""
    value, points, spacing = table["range"], table.get("points"), table.get("spacing", "linear")
    if not isinstance(value, list) or len(value) != 2:
        raise InputError(f"range = {value!r}: give the first and the last value")
    low, high = (number_of({"range": end}, "range") for end in value)
    if type(points) is not int or not 2 <= points <= MOST_VALUES:
        raise InputError(f"points = {points!r}: give a whole number of values, 2 or more")
    if spacing not in SPACINGS or (spacing == "log" and not 0 < low < high):
        raise InputError(f"spacing = {spacing!r}: give 'linear', or 'log' with a range above 0")
    if not low < high:
        raise InputError(f"range = {value!r}: give two numbers, the smaller first")
    spaced = np.linspace(low, high, points) if spacing == "linear" else np.geomspace(low, high, points)
    return [float(number) for number in spaced]


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


INTENSITY = "intensity"  # column of the intensity measure of [records]


@dataclass(frozen=True)
class StudyInputs:
    """All that a worker needs to make the scenes of a study; small, since it is sent to every worker.

    Attributes:
        scene: table of the base scene, with absolute paths.
        axes: in the order of the columns.
        records: name -> `[motion]` table, without its key `kind`.
        factors: name in the study file -> table of lambda factors.
        intensities: name of a record -> intensity measure at scale 1 [m/s^2]; empty for a study without intensity.
    """

    scene: SceneTable
    axes: tuple[Axis, ...]
    records: dict[str, SceneTable]
    factors: dict[str, FactorTable]
    intensities: dict[str, float]

    def intensity(self, at: Mapping[str, Any]) -> dict[str, float]:
        """INTENSITY -> the intensity measure of a run [m/s^2]; empty for a study without. at: axis -> value."""
        if not self.intensities:
            return {}
        return {INTENSITY: self.intensities[at["record"]] * at.get("scale", 1.0)}


def motion_of(record: SceneTable) -> SceneTable:
    """The `[motion]` table of a scene that runs a record."""
    return {"kind": RecordMotion.kind, **record}


class SceneFactory:
    """Makes the scenes of a study: writes the values of a run into the table of the base scene, and reads that table.

    Tables that no axis changes are read once. The reader of scene files caches other motions and frames of buildings.

    Attributes:
        inputs: of the study.
        base: the base scene, at full fidelity.
    """

    def __init__(self, inputs: StudyInputs) -> None:
        self.inputs = inputs
        self._changed = {path.partition(".")[0] for axis in inputs.axes for path in axis.paths}
        self._fidelity = inputs.scene.get("fidelity", "exact")
        base = {key: value for key, value in inputs.scene.items() if key != "fidelity"}
        self.base = scene_of(base)
        at_fidelity(self.base, self._fidelity)  # raises its errors
        self._check_motions(self.base)
        self._set_paths = sorted(  # (depth, index of the axis, path): a table is set before its fields
            (len(keys_of_path(path)), index, path)
            for index, axis in enumerate(inputs.axes)
            for path in axis.paths
            if axis.change == "sets"
        )
        self._table = base
        # Runs share the parts of the base scene; the tables that only other kinds have are read with every scene.
        shared = {field.name for field in fields(SceneFields)} & {field.name for field in fields(self.base)}
        self._parts = {name: getattr(self.base, name) for name in shared}

    def scene(self, values: Sequence[Any]) -> System:
        """The scene of a run. values: one for each axis, in the order of the axes. Raises InputError."""
        axes, table = self.inputs.axes, self._table
        for _, index, path in self._set_paths:
            table = changed_table(table, {path: values[index]}, axes[index].surfaces)
        pairs = list(zip(axes, values, strict=True))
        for axis, value in pairs:
            if axis.change == "record":
                scale = next((number for axis, number in pairs if axis.change == "scale"), 1.0)
                table = {**table, "motion": motion_of(self._scaled(value, scale))}
            for path in axis.paths if axis.change == "multiplies" else ():
                table = multiplied_table(table, path, value, axis.surfaces)
        level: Any = table.get("fidelity", self._fidelity)
        other = {
            key: value for key, value in table.items() if value is not self._table.get(key) or key not in self._parts
        }
        scene = scene_of({key: value for key, value in other.items() if key != "fidelity"}, parts=self._parts)
        for axis, value in pairs:
            if axis.change == "factors":
                scene = bounded_scenes(scene, self.inputs.factors[axis.paths[0]])[value]
        self._check_motions(scene)
        reduced: System = at_fidelity(scene, level)
        return reduced

    def _check_motions(self, scene: System) -> None:
        """Raise InputError where bearings have motions of their own, which the study does not change."""
        own = scene.own_motions
        if own and self.inputs.records:
            what = "records and their scales give the motion of the scene"
        elif own and len(own) == len(scene.every_bearing) and "motion" in self._changed:
            what = "no bearing is left on the motion of the scene, which the study changes"
        else:
            return
        raise InputError(
            f"{own[0]}: this bearing has a motion of its own, and {what}; leave the motions "
            "of bearings out, or vary them by their paths"
        )

    def _scaled(self, name: str, factor: float) -> SceneTable:
        """The `[motion]` table of a record times a factor."""
        table = self.inputs.records[name]
        if not factor > 0:
            raise InputError(f"scale = {factor:g}: give a number above 0")
        if factor == 1.0:
            return table
        scale = float(RecordMotion(**table).build().metadata["scale"]) * factor
        return {**{key: value for key, value in table.items() if key not in ("scale", "scale_to")}, "scale": scale}
