"""Random axes of a study: distributions, and the plans by which their values are drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.elementary import exp
from msfp_gen.common.fields import Choice, Quantity, check_fields
from msfp_gen.errors import InputError
from msfp_gen.scene.file.catalogue import parsed

WITHIN = (2.0**-53, 1 - 2.0**-53)  # shares that have a finite value
MOST = 10_000_000  # samples; each takes 8 bytes a random axis, in the process that starts the study

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
    "sobol-indices": "the (axes + 2) x `samples` values that Sobol' indices need (`msfp-gen study sobol`)",
    "one-at-a-time": "medians, and each axis alone at two quantiles (`msfp-gen study tornado`)",
    "listed": "the rows of `values`, one value for each axis",
}


@dataclass(frozen=True)
class Distribution:
    """A probability distribution of the values of an axis.

    kind: a key of DISTRIBUTIONS. parameters: its numbers, in SI; `deviation` is the standard deviation, `dispersion`
    that of the logarithm. between: bounds at which the distribution is cut off; None: not at all. Raises InputError.
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
        """The values below which these `shares` of the distribution lie, in (0, 1); of their shape [its unit]."""
        if self.between is not None:
            low, high = (self.share(bound) for bound in self.between)
            shares = low + shares * (high - low)
        values = np.asarray(_frozen(self.kind, self.parameters).ppf(shares))
        if self.kind == "lognormal":  # the exponential of NumPy depends on the processor
            values = self.parameters[0] * exp(values)
        return values if self.between is None else np.clip(values, *self.between)

    def share(self, value: float) -> float:
        """The share of the distribution, without its bounds, that lies below a value."""
        if self.kind == "lognormal":
            value = float(np.log(value / self.parameters[0])) if value > 0 else -np.inf
        return float(_frozen(self.kind, self.parameters).cdf(value))


@lru_cache(maxsize=64)
def _frozen(kind: str, parameters: tuple[float, ...]) -> Any:
    """The distribution of `scipy.stats`, of a lognormal one that of the logarithm over the median."""
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
    """How the values of the random axes are drawn, together.

    method: a key of METHODS. samples: their number; for one-at-a-time it follows from the axes. seed: equal seeds give
    equal values. quantiles: of each axis, for one-at-a-time. values: of every sample, for listed.
    cells: with listed, the combination of the values of all other axes that each sample has, from 1, the last axis
    fastest; None: every sample has all of them. Raises InputError.
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
        """Values of axes with these distributions, shape (samples, axes) [units of the axes]. Raises InputError."""
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
        """Shares of the distributions, ndarray, shape (samples, axes), [-], in (0, 1); equal for equal seeds."""
        if not axes:
            return np.zeros((1, 0))
        return np.clip(_DRAWS[self.method](self, axes), *WITHIN)


def values_at(shares: Array, distributions: Sequence[Distribution]) -> Array:
    """The values below which these shares of the distributions lie, shape (samples, axes) [units of the axes]."""
    inside = np.clip(shares, *WITHIN)
    return np.column_stack([one.values(inside[:, index]) for index, one in enumerate(distributions)])


def _latin_hypercube(plan: Sampling, axes: int) -> Array:
    from scipy.stats import qmc

    return np.asarray(qmc.LatinHypercube(axes, rng=np.random.default_rng(plan.seed)).random(plan.samples))


def _random(plan: Sampling, axes: int) -> Array:
    return np.random.default_rng(plan.seed).random((plan.samples or 0, axes))


def _sobol_sequence(plan: Sampling, axes: int) -> Array:
    from scipy.stats import qmc

    count = plan.samples or 0
    if count & (count - 1):
        near = 2 ** max(count.bit_length() - 1, 0), 2 ** count.bit_length()
        raise InputError(
            f"sampling.samples = {count}: a Sobol' sequence needs a power of two; give {near[0]} or {near[1]}"
        )
    return np.asarray(qmc.Sobol(axes, rng=np.random.default_rng(plan.seed)).random(count))


def _sobol_indices(plan: Sampling, axes: int) -> Array:
    """Rows A, then A with one column of B for each axis, then B, for each sample: the order that SALib analyses."""
    both = _sobol_sequence(plan, 2 * axes)
    first, second = both[:, :axes], both[:, axes:]
    rows = np.repeat(first[:, None, :], axes + 2, axis=1)
    for axis in range(axes):
        rows[:, axis + 1, axis] = second[:, axis]
    rows[:, -1] = second
    return rows.reshape(-1, axes)


def _one_at_a_time(plan: Sampling, axes: int) -> Array:
    """Medians in the first row, then two rows for each axis: its lower and its upper quantile."""
    rows = np.full((1 + 2 * axes, axes), 0.5)
    for axis in range(axes):
        rows[1 + 2 * axis : 3 + 2 * axis, axis] = plan.quantiles
    return rows


_DRAWS: Mapping[str, Callable[[Sampling, int], Array]] = {
    "latin-hypercube": _latin_hypercube,
    "random": _random,
    "sobol-sequence": _sobol_sequence,
    "sobol-indices": _sobol_indices,
    "one-at-a-time": _one_at_a_time,
}


def distribution_from(table: Mapping[str, Any]) -> tuple[Distribution, set[str]]:
    """The distribution of the table of an axis, and the keys that it takes. Raises InputError."""
    kind = table["distribution"]
    if kind not in DISTRIBUTIONS:
        raise InputError(f"distribution = {kind!r}: give one of {', '.join(map(repr, DISTRIBUTIONS))}")
    names = DISTRIBUTIONS[kind]
    for name in names:
        if name not in table:
            raise InputError(f"{name} is missing: distribution = {kind!r} has {', '.join(names)}")
    numbers = {name: number_of(table, name) for name in names}
    between = table.get("between")
    if between is not None:
        between = parsed(Quantity("", shape=(2,)), between, "between")
    return Distribution(kind, tuple(numbers.values()), between), {"distribution", "between", *names}


def number_of(table: Mapping[str, Any], name: str) -> float:
    """A finite number of a table. Raises InputError."""
    try:
        return float(Quantity("").parse(table[name]))
    except ValueError as error:
        raise InputError(f"{name} = {table[name]!r}: {error}; in SI units") from None
