"""`estimate`: a mean, variance, probability, quantile or fragility of a study from cheap and exact runs.

A study and a question come in; rounds of runs (`source.py`) are planned until the interval (`estimators.py`) is narrow
enough; an `Estimate` goes out. Its table for a terminal and its figure are here too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Choice, Quantity, check_fields, to_si
from msfp_gen.common.tables import Table
from msfp_gen.figures.style import COLOURS, FAINT, INK, headline, page
from msfp_gen.studies.assessment.rows import labelled
from msfp_gen.studies.batch import pool_from
from msfp_gen.studies.definition import Study, load_study
from msfp_gen.studies.estimation.estimators import (
    EXACT,
    Indices,
    Moment,
    Runs,
    best_chain,
    curve,
    exceedance,
    exceeding,
    factor_for,
    feature,
    optimal_runs,
    predictions,
    quantile_of,
    quantile_of_t,
    telescoped,
    uncertainty,
    variance_of,
)
from msfp_gen.studies.estimation.source import Searches, Source, StudySource

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STATISTICS = {
    "mean": "the mean",
    "variance": "the variance",
    "probability": "the probability that the quantity is at least `threshold`",
    "quantile": "the value below which the share `threshold` of all draws lies",
    "fragility": "the median scale or intensity at which the quantity reaches `threshold`, and its dispersion",
}
LEVELS = {"backbone": 1, "equivalent": 2, "rigid": 3, "massless": 3, "loose": 3}  # cheaper model -> rank, cheapest 1
BOUNDS = {"most": "a lower bound", "least": "an upper bound", "": ""}  # `Quantity.side` -> of a run that ended early
ENOUGH = 0.25  # work of a chain over plain Monte Carlo below which no dearer model is tried
NO_BENEFIT = 0.8  # work of a chain over plain Monte Carlo above which only exact runs are made
ROUNDS = 8
GROWTH = 3.0  # exact runs of a round over the exact runs of the round before, at most
MARGIN = 0.9  # half width that the runs are planned for, over the target
MOST = 200_000  # draws
MORE = 1.2  # exact runs planned for a round, over the number planned for the round before, at least
CHOSEN = 1.5  # exact runs over the exact runs of the pilot, at least
LEAST_SHARE = 0.2  # time of the cheapest runs over the time of all others, at least: so rare events occur among them
EQUAL = 0.25  # share of the exact runs after the pilot that is chosen with equal chances, whatever the prediction
CHEAP = 8  # runs of the cheapest model for each exact run in the pilot
WIDTH, HEIGHT = 6.8, 4.6  # of the figure [inch]


@dataclass(frozen=True)
class Question:
    """What is estimated, and how accurately: the table `[accuracy]` of a study file.

    quantity: a column of the study. statistic: a key of STATISTICS. threshold: of a probability or a fragility [unit of
    the quantity], or the share of a quantile [-]. target: half the width of the interval of 95 %, over the value; for a
    probability not over the value. budget: core time of all runs [s]. pilot: exact runs at the start. models: cheaper
    models to try; None: `estimate` chooses them. seed: of the draws. logarithmic: whether the values are logarithms,
    for which the target is not over the value. side: how runs that ended early bound the quantity, as `Quantity.side`.
    Raises InputError.
    """

    quantity: str | None = None
    statistic: Annotated[str, Choice(STATISTICS)] = "mean"
    threshold: Annotated[float | None, Quantity("")] = None
    target: Annotated[float | None, Quantity("", above=0.0)] = None
    budget: Annotated[float | None, Quantity("s", above=0.0)] = None
    pilot: Annotated[int, Quantity("", least=16, whole=True)] = 32
    models: tuple[str, ...] | None = None
    seed: Annotated[int, Quantity("", least=0, whole=True)] = 0
    logarithmic: bool = field(default=False, repr=False)
    side: str = field(default="most", repr=False)

    def __post_init__(self) -> None:
        check_fields(self, "accuracy")
        needs_threshold = self.statistic in ("probability", "quantile", "fragility")
        if needs_threshold != (self.threshold is not None):
            rule = "give it" if needs_threshold else "leave it out"
            raise InputError(f"accuracy.threshold = {self.threshold}: {rule} with statistic = {self.statistic!r}")
        if self.statistic == "quantile" and not 0 < self.given_threshold < 1:
            raise InputError(
                f"accuracy.threshold = {self.given_threshold:g}: give the share of a quantile, between 0 and 1"
            )
        if self.target is None and self.budget is None:
            raise InputError("accuracy: give target, such as '2 %', or budget, such as '10 min'")
        for name in self.models or ():
            if name not in LEVELS:
                raise InputError(f"accuracy.models has {name!r}: give some of {', '.join(map(repr, LEVELS))}")

    @property
    def needs_probability(self) -> bool:
        """Whether the statistic is computed from probabilities of exceedance."""
        return self.statistic in ("probability", "quantile")

    @property
    def given_threshold(self) -> float:
        """The threshold, for a statistic that has one."""
        assert self.threshold is not None
        return self.threshold

    def target_half(self, value: float) -> float:
        """The target for half the width of the interval about an estimate [unit of `value`]."""
        assert self.target is not None
        absolute = self.statistic == "probability" or self.logarithmic
        return self.target if absolute else self.target * abs(value)


@dataclass(frozen=True)
class Estimate:
    """Result of `estimate`.

    Attributes:
        quantity, statistic, threshold: as in `Question`.
        unit: of `value`; for a fragility the unit of the intensity.
        value: the estimate.
        interval: (low, high), of 95 % [unit of `value`].
        runs: model -> number of its runs.
        seconds: core time of all runs [s].
        plain_seconds: core time of plain Monte Carlo for this interval, from variance and cost of exact runs [s].
        correlation: cheaper model -> correlation with the exact model, over the draws of the pilot [-].
        costs: model -> core time of a run [s].
        dispersion, dispersion_interval: for a fragility, standard deviation of the logarithm [-]; else None.
        trace: (seconds, half width) after each round.
        notes: what a reader must know, one line each.
    """

    quantity: str
    statistic: str
    threshold: float | None
    unit: str
    value: float
    interval: tuple[float, float]
    runs: dict[str, int]
    seconds: float
    plain_seconds: float
    correlation: dict[str, float]
    costs: dict[str, float]
    dispersion: float | None = None
    dispersion_interval: tuple[float, float] | None = None
    trace: tuple[tuple[float, float], ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def half(self) -> float:
        """Half the width of the interval [unit of `value`]."""
        return half_of(self.interval)

    def as_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON."""
        return asdict(self)


def half_of(interval: tuple[float, float]) -> float:
    """Half the width of an interval (low, high) [its unit]."""
    return (interval[1] - interval[0]) / 2


def question_of(study: Study, **changes: Any) -> Question:
    """The question of `[accuracy]` in a study file; changes other than None replace its keys. Raises InputError."""
    table = {key: value for key, value in study.table.get("accuracy", {}).items() if key != "listed"}
    known = [name for name in Question.__dataclass_fields__ if name not in ("logarithmic", "side")]
    if unknown := [key for key in table if key not in known]:
        raise InputError(f"accuracy.{unknown[0]}: no such key; the keys are {', '.join(known)}")
    goals = ("target", "budget")
    if any(changes.get(name) is not None for name in goals):
        table = {key: value for key, value in table.items() if key not in goals}
    table |= {key: value for key, value in changes.items() if value is not None}
    for name, unit in (("target", ""), ("budget", "s"), ("threshold", "")):
        text = table.get(name)
        if isinstance(text, str):
            try:  # a number with its unit, a plain one, or a share in percent
                share = text.strip().removesuffix("%")
                table[name] = to_si(text, unit) if unit else float(share) / (1 if share == text.strip() else 100)
            except ValueError as error:
                why = error if unit else "give a number, or a share such as '2 %'"
                raise InputError(f"accuracy.{name} = {text!r}: {why}") from None
    if isinstance(table.get("models"), list):
        table["models"] = tuple(table["models"])
    question = Question(**table)
    if question.quantity is None:
        raise InputError("accuracy.quantity is missing: give a column of the study, such as 'peak_displacement'")
    return question


def estimate(
    source: Study | str | Path | Mapping[str, Any],
    folder: str | Path,
    quantity: str | None = None,
    statistic: str | None = None,
    threshold: float | None = None,
    target: float | str | None = None,
    budget: float | str | None = None,
    *,
    models: Sequence[str] | None = None,
    pilot: int | None = None,
    seed: int | None = None,
    workers: int | None = None,
    threads: bool = False,
    executor: Executor | None = None,
    dask: str | None = None,
    progress: Any = None,
) -> Estimate:
    """Estimate a statistic of a quantity over the draws of a study, with few exact runs.

    A draw is a combination of the values of the gridded axes, all equally likely, and one value of each random axis.
    The folder is the folder of a study with the exact runs; the runs of each cheaper model are a study in a folder
    within it. The same call continues an interrupted estimate.

    source, workers, threads, executor, dask: as of `study`. folder: of the study. quantity to seed: as in
    `Question`, by default the keys of `[accuracy]` in the study file; target and budget also as texts, such as "2 %"
    and "10 min". progress: called with the name of a model and a number of draws before the runs of these draws.

    Raises InputError: invalid input, or the pilot shows that the budget does not permit the target, and a new folder is
    removed again; RunError: workers died; the same call continues.
    """
    study = source if isinstance(source, Study) else load_study(source)
    question = question_of(
        study, quantity=quantity, statistic=statistic, threshold=threshold, target=target, budget=budget,
        models=None if models is None else tuple(models), pilot=pilot, seed=seed,
    )  # fmt: skip
    cheaper = ("backbone", "massless" if "peak_sliding_1" in study.keep.known else "rigid")
    levels = (EXACT, *(cheaper if question.models is None else question.models))
    assert question.quantity is not None
    scales, unit = _scales(study, question)
    existed = Path(folder).exists()
    try:
        with pool_from(workers, threads, executor, dask) as pool:
            runs = StudySource(study, Path(folder), question.quantity, levels, question.seed, pool, progress)
            sided = replace(question, side=study.keep.side(question.quantity))
            if scales is not None:
                result = fragility_of(runs, question, scales, lambda draws: np.log(runs.draws.intensity(draws)))
            else:
                result = estimated(runs, sided)
                unit = {column.name: column.unit for column in study.keep.columns}[question.quantity]
                unit = {"probability": "", "variance": f"({unit})^2" if unit else ""}.get(question.statistic, unit)
    except _BudgetError:
        if not existed:
            rmtree(folder, ignore_errors=True)
        raise
    return replace(result, unit=unit)


def _scales(study: Study, question: Question) -> tuple[Array | None, str]:
    """For a fragility the scales of the study, shape (k,) [-], and the unit of the intensity; else None and no unit."""
    if question.statistic != "fragility":
        return None, ""
    axis = next((axis for axis in study.axes if axis.name == "scale"), None)
    if axis is None or axis.values is None or len(axis.values) < 3:
        raise InputError("accuracy.statistic = 'fragility': give records.scales, three or more, rising")
    scales = np.array(axis.values, dtype=float)
    if not (np.diff(scales) > 0).all():
        raise InputError(f"records.scales = {scales.tolist()}: a fragility needs them rising")
    return scales, "m/s^2" if study.recipe.intensities else ""


class _State:
    """The chain of models of an estimate, its runs so far, and the chances with which draws are chosen.

    The last level of the chain runs the first `count` draws. Every dearer level runs the draws of the pilot, and
    after these the draws that are chosen, with chance scale * weight + equal.

    Attributes:
        pilot: draws that every level runs.
        chain: models, the exact model first.
        count: draws of the last level.
        scale, equal: level -> factor of the weights, and chance that every draw has, both [-].
        planned: exact runs that the last plan asked for.
        early: model -> runs that ended early.
        weights: function of the values of the last level, as of `uncertainty`; None before the first use.
        uniform: of every draw, a random number that decides whether a level with a given chance runs it, shape (MOST,).
    """

    def __init__(self, source: Source, question: Question) -> None:
        self.source, self.question = source, question
        self.pilot = min(question.pilot, source.population or question.pilot)
        self.chain: tuple[str, ...] = (EXACT,)
        self.count = self.pilot
        self.scale: dict[str, float] = {}
        self.equal: dict[str, float] = {}
        self.planned = 0.0
        self.early: dict[str, int] = {}
        self.weights: Any = None
        self.uniform = np.random.default_rng([question.seed, 2**31]).random(MOST)

    def outcomes(self, level: str, draws: Indices) -> Array:
        """The values of a model at draws, shape (draws,) [unit of the quantity].

        For a probability or a quantile, a run that ended early is infinite unless it exceeded the threshold before; of
        a least value it is minus infinity unless it was below the threshold before. Raises InputError where it is no
        bound.
        """
        values, early = self.source.values(level, draws)
        self.early[level] = int(early.sum())
        if self.question.needs_probability:
            bound = self.question.given_threshold if self.question.statistic == "probability" else np.inf
            if self.question.side == "least":
                return np.where(early & ~(values < bound), -np.inf, values)
            if early.any() and not self.question.side:
                raise InputError(
                    f"quantity = {self.question.quantity!r}: {int(early.sum())} runs of {level} ended early, and it is "
                    "neither the largest nor the least value over a run, so that they say nothing about it; give "
                    "another quantity"
                )
            return np.where(early & (values < bound), np.inf, values)
        if level == EXACT and np.isinf(values).any():
            raise InputError(
                f"quantity = {self.question.quantity!r}: {int(np.isinf(values).sum())} exact runs have none; see their "
                "message, or ask for a probability or a quantile, in which they count as above all others"
            )
        return values

    def levels(self) -> list[Runs]:
        """The runs of every level of the chain, exact first; missing runs are computed."""
        draws = np.arange(self.count)
        last = Runs(draws, self.outcomes(self.chain[-1], draws), np.ones(self.count))
        if len(self.chain) == 1:
            return [last]
        if self.weights is None:
            exact = self.outcomes(EXACT, draws[: self.pilot])
            x = feature(last.values)[: self.pilot]
            bound = self.bound(exact) if self.question.needs_probability else None
            self.weights = partial(uncertainty, x, exact, bound)
        weights = self.weights(feature(last.values))
        dearer, least = [], np.zeros(self.count)
        for level in self.chain[:-1]:
            own = self.scale.get(level, 0.0) * weights + self.equal.get(level, 0.0)
            least = np.maximum(least, np.minimum(own, 1.0))  # a level also runs every draw of the level before it
            chances = np.where(draws < self.pilot, 1.0, least)
            chosen = draws[self.uniform[: self.count] < chances]
            dearer.append(Runs(chosen, self.outcomes(level, chosen), chances[chosen]))
        return [*dearer, last]

    def bound(self, exact: Array) -> float:
        """The threshold of a probability; for a quantile, the quantile of the exact runs of the pilot."""
        if self.question.statistic == "probability":
            return self.question.given_threshold
        return float(np.quantile(feature(exact), self.question.given_threshold))

    def plan(self, wanted: Array) -> None:
        """Set draws and chances for these numbers of runs of every level, exact first, shape (levels,)."""
        limit = min(MOST, self.source.population or MOST)
        if len(self.chain) == 1:
            self.count = min(max(int(np.ceil(wanted[0])), self.count), limit)
            return
        self.count = min(max(int(np.ceil(wanted[-1] / 64)) * 64, self.count), limit)
        values = feature(self.outcomes(self.chain[-1], np.arange(self.count)))
        weights = self.weights(values)[self.pilot :]
        self.planned = float(wanted[0])
        for level, number in zip(self.chain[:-1], wanted[:-1], strict=True):
            beyond_pilot = max(float(number) - self.pilot, 0.0)
            equal = EQUAL * beyond_pilot / max(len(weights), 1)
            self.equal[level] = max(self.equal.get(level, 0.0), min(equal, 1.0))
            self.scale[level] = max(self.scale.get(level, 0.0), factor_for(weights, beyond_pilot, equal))


def estimated(source: Source, question: Question) -> Estimate:
    """The estimate of a statistic other than a fragility from a source of runs. Raises InputError."""
    return _estimate_and_runs(source, question)[0]


def _estimate_and_runs(source: Source, question: Question) -> tuple[Estimate, list[Runs], int]:
    """The estimate, the runs of every level from which it is computed, and the number of draws in the pilot."""
    state, notes = _State(source, question), []
    correlation = _run_pilot(state)
    if len(state.chain) == 1:
        notes.append("no cheaper model saves time here (correlation too low, or too dear): exact runs only")
    trace: list[tuple[float, float]] = []
    for _ in range(ROUNDS):
        levels = state.levels()
        answer = _answer(question, levels, state.pilot, source.population)
        half = half_of(answer.interval)
        spent, runs = source.spent()
        trace.append((spent, half))
        if not _plan_round(state, answer, spent, len(levels[0].draws)):
            break
    value = answer.value
    costs = {level: source.cost(level) for level in runs}
    if question.target is not None and half > 1.02 * question.target_half(value):
        notes.append(f"the target was not reached: the half width is {half:.3g}")
    if question.budget is not None and spent > 1.1 * question.budget:
        notes.append(f"the runs took {spent:.3g} s in place of {question.budget:g} s: a pilot needs that; give fewer")
    for level, count in state.early.items():
        if count and question.needs_probability:
            where = "below" if question.side == "least" else "above"
            notes.append(f"{count} runs of {level} ended early; they count as {where} every value")
        elif count:
            bound = BOUNDS[question.side] if level == EXACT else ""
            word = bound or "what they reached"
            notes.append(f"{count} of {runs.get(level, count)} runs of {level} ended early; their value is {word}")
    plain = _plain_variance(question, levels, answer)
    seconds = costs[EXACT] * plain * quantile_of_t(np.inf) ** 2 / half**2 if half > 0 else spent
    estimate = Estimate(
        question.quantity or "", question.statistic, question.threshold, "", value, answer.interval, runs, spent,
        seconds, correlation, costs, trace=tuple(trace), notes=tuple(notes),
    )  # fmt: skip
    return estimate, levels, state.pilot


def _run_pilot(state: _State) -> dict[str, float]:
    """Run the pilot of the models and choose the chain; returns cheaper model -> correlation with the exact model.

    The cheapest model runs first, since the search for a crossing by the exact model begins at its crossing.
    """
    draws, source = np.arange(state.pilot), state.source
    cheaper = sorted(source.levels[1:], key=lambda name: LEVELS.get(name, 9))
    for level in cheaper[:1]:
        state.outcomes(level, draws)
    exact = state.outcomes(EXACT, draws)
    correlation, costs = {EXACT: 1.0}, {EXACT: source.cost(EXACT)}
    best = best_chain(correlation, costs)
    for level in cheaper:
        if best.work < ENOUGH and state.question.models is None:
            break
        many = np.arange(min(CHEAP * state.pilot, source.population or MOST)) if LEVELS.get(level) == 1 else draws
        x = feature(state.outcomes(level, many))[: state.pilot]
        costs[level] = source.cost(level)
        correlation[level] = _correlation(state, exact, x)
        best = best_chain(correlation, costs)
    state.chain = best.models if best.work < NO_BENEFIT else (EXACT,)
    if len(state.chain) > 1:
        state.count = min(CHEAP * state.pilot, source.population or MOST)
        state.scale = dict.fromkeys(state.chain[:-1], 0.0)
    return {name: value for name, value in correlation.items() if name != EXACT}


def _correlation(state: _State, exact: Array, x: Array) -> float:
    """The correlation of the exact values of the pilot, shape (pilot,), with their prediction from a cheaper model.

    For a probability or a quantile it is the correlation of the exceedances, unless fewer than two runs of the pilot
    exceed the threshold or fewer than two stay below it. x: values of the cheaper model, shape (pilot,).
    """
    target, draws = exact, np.arange(len(exact))
    if state.question.needs_probability:
        target = feature(exact)
        exceeds = (exact >= state.bound(exact)).astype(float)
        if 2 <= exceeds.sum() <= len(exceeds) - 2:
            predicted = predictions(exceedance(state.bound(exact)), draws, x, draws, exact)
            return _positive_correlation(exceeds, predicted)
    return _positive_correlation(target, predictions(curve, draws, x, draws, target))


def _positive_correlation(first: Array, second: Array) -> float:
    """The correlation of two arrays; 0 where it is negative or one array does not vary."""
    if not (np.std(first) > 0 and np.std(second) > 0):
        return 0.0
    return max(float(np.corrcoef(first, second)[0, 1]), 0.0)


class _Answer(NamedTuple):
    """The value of a statistic, its interval, and the moment from which the next runs are planned."""

    value: float
    interval: tuple[float, float]
    moment: Moment


def _answer(question: Question, levels: list[Runs], pilot: int, population: int | None) -> _Answer:
    if question.statistic == "quantile":
        return _Answer(*quantile_of(levels, question.given_threshold, pilot, population))
    if question.statistic == "probability":
        moment = exceeding(levels, question.given_threshold, pilot, population)
        value, low, high = np.clip(moment.value + moment.half * np.array([0, -1, 1]), 0.0, 1.0).tolist()
        return _Answer(value, (low, high), moment)
    if question.statistic == "variance":
        moment = variance_of(levels, pilot, population)
        ratio = float(np.exp(moment.half / moment.value)) if moment.value > 0 else np.inf
        return _Answer(moment.value, (moment.value / ratio, moment.value * ratio), moment)
    moment = telescoped(levels[0].values, levels, pilot, population)
    return _Answer(moment.value, (moment.value - moment.half, moment.value + moment.half), moment)


class _BudgetError(InputError):
    """The pilot shows that the target needs more time than the budget."""


def _plan_round(state: _State, answer: _Answer, spent: float, exact: int) -> bool:
    """Plan the next round, and return whether there is one. spent: core time so far [s]. exact: number of exact runs.

    Raises _BudgetError where the pilot alone shows that the budget does not permit the target. After the pilot the
    estimate ends with the budget, and a note says so.
    """
    question, moment, half = state.question, answer.moment, half_of(answer.interval)
    costs = np.array([state.source.cost(level) for level in state.chain])
    variances = np.maximum(moment.variances, 1e-12 * max(answer.value**2, 1e-300))
    if question.target is not None:
        target_half = question.target_half(answer.value)
        beyond_pilot = len(state.chain) == 1 or state.scale[EXACT] > 0 or exact >= state.count
        if half <= target_half and beyond_pilot:
            return False
        planned = moment.variance * (MARGIN * target_half / max(half, 1e-300)) ** 2
        runs = optimal_runs(variances, costs, variance=planned)
        if moment.unseen:  # such a variance falls with the square of the number of exact runs
            runs *= min(1.0, exact * half / (MARGIN * target_half) / runs[0])
        needed = float(runs @ costs)
        if question.budget is not None and needed > question.budget and exact <= state.pilot:
            raise _BudgetError(
                f"target = {question.target:g} needs about {needed:.3g} s, budget = {question.budget:g} s: give a "
                f"target of {question.target * np.sqrt(needed / question.budget):.2g}, or the time"
            )
    else:
        runs, needed = np.zeros(len(costs)), np.inf
    if question.budget is not None and needed > question.budget:
        if spent > 0.95 * question.budget:
            return False
        runs = optimal_runs(variances, costs, seconds=question.budget)
    if len(state.chain) > 1:  # uncertain draws may be missing from the pilot: some are always chosen
        runs[0] = max(runs[0], CHOSEN * state.pilot)
        if question.target is not None:  # chance may have chosen fewer draws than planned
            runs[0] = max(runs[0], MORE * state.planned)
    before = (state.count, dict(state.scale))
    runs *= min(1.0, GROWTH * exact / runs[0])
    runs[-1] = max(runs[-1], LEAST_SHARE * float(runs[:-1] @ costs[:-1]) / costs[-1])
    state.plan(runs)
    return before != (state.count, state.scale)


def _plain_variance(question: Question, levels: list[Runs], answer: _Answer) -> float:
    """The variance that plain Monte Carlo divides by its number of runs [squared unit of the estimate]."""
    if question.statistic == "probability":
        return max(answer.value * (1 - answer.value), 1e-12)
    if question.statistic == "quantile":
        slope = half_of(answer.interval) / max(answer.moment.half, 1e-300)
        return question.given_threshold * (1 - question.given_threshold) * slope**2
    values, weights = levels[0].values, 1 / levels[0].chances
    mean = float(np.average(values, weights=weights))
    squares = (values - mean) ** 2
    if question.statistic == "mean":
        return float(np.average(squares, weights=weights))
    return float(np.average((squares - np.average(squares, weights=weights)) ** 2, weights=weights))


def fragility_of(source: Source, question: Question, scales: Array, intensity: Callable[[Indices], Array]) -> Estimate:
    """The fragility of a threshold: median and dispersion of the intensity at which the quantity of a draw reaches it.

    scales: of the study, rising, shape (k,) [-]. intensity: draws -> logarithm of their intensity at scale 1. It is the
    exponential of a mean, and a variance, of the logarithms that `Searches` finds.
    """
    searches = Searches(source, question.given_threshold, scales, intensity)
    of_logarithms = replace(question, statistic="mean", threshold=None, logarithmic=True)
    mean, levels, pilot = _estimate_and_runs(searches, of_logarithms)
    spread = variance_of(levels, pilot, source.population)
    notes = list(mean.notes)
    if searches.beyond:
        notes.append(f"{searches.beyond} draws cross outside records.scales; they count half a step beyond: give more")
    _, runs = source.spent()
    costs = {level: source.cost(level) for level in runs}
    plain = mean.plain_seconds * costs[EXACT] * len(scales) / searches.cost(EXACT)  # plain Monte Carlo runs all scales
    dispersions = [float(np.sqrt(max(spread.value + sign * spread.half, 0.0))) for sign in (-1, 0, 1)]
    return replace(
        mean, statistic="fragility", threshold=question.threshold, value=float(np.exp(mean.value)),
        interval=(float(np.exp(mean.interval[0])), float(np.exp(mean.interval[1]))), dispersion=dispersions[1],
        dispersion_interval=(dispersions[0], dispersions[2]), notes=tuple(notes), runs=runs, costs=costs,
        plain_seconds=plain,
    )  # fmt: skip


def estimate_table(result: Estimate) -> Table:
    """The estimate as a table for a terminal, ten lines at most."""
    unit = f" {result.unit}" if result.unit else ""
    threshold = "" if result.threshold is None else f" {result.threshold:g}"
    runs = ", ".join(f"{count} {name}" for name, count in result.runs.items())
    rows = [
        ("value", f"{result.value:.4g}{unit}"),
        ("interval of 95 %", f"{result.interval[0]:.4g} to {result.interval[1]:.4g}{unit}"),
    ]
    if result.dispersion is not None and result.dispersion_interval is not None:
        low, high = result.dispersion_interval
        rows.append(("dispersion", f"{result.dispersion:.3g}, {low:.3g} to {high:.3g}"))
    gain = result.plain_seconds / result.seconds if result.seconds else 1.0
    rows += [
        ("runs", runs),
        ("seconds", f"{result.seconds:.4g}, on one core"),
        ("plain Monte Carlo", f"{result.plain_seconds:.4g} s for this interval, {gain:.3g} times as many"),
        ("correlation", ", ".join(f"{name} {rho:.4f}" for name, rho in result.correlation.items()) or "none tried"),
        ("cost of a run", ", ".join(f"{name} {1e3 * cost:.3g} ms" for name, cost in result.costs.items())),
    ]
    return Table(f"{result.statistic}{threshold} of {result.quantity}", (), rows)


def plot_estimate(result: Estimate, path: str | Path | None = None, title: str = "") -> Figure:
    """Half the width of the interval over core time, round by round, beside plain Monte Carlo. path: as of `page`."""
    seconds, half = np.array(result.trace).T
    with page(WIDTH, HEIGHT, path) as figure:
        headline(figure, title or f"{result.statistic} of {labelled(result.quantity, '')}: what an interval costs")
        axes = figure.subplots()
        end = half[-1]
        span = np.geomspace(seconds[0] / 2, 2 * max(result.plain_seconds, seconds[-1]), 100)
        axes.plot(span, end * np.sqrt(result.plain_seconds / span), color=FAINT, label="plain Monte Carlo")
        axes.plot(
            span, end * np.sqrt(result.seconds / span), "--", color=COLOURS[0], linewidth=1, label="as the last round"
        )
        axes.plot(seconds, half, "o-", color=COLOURS[0], label="this estimate, round by round")
        axes.axhline(end, color=INK, linewidth=0.5)
        text = f"{result.plain_seconds / max(result.seconds, 1e-300):.3g} times"
        axes.annotate(text, (result.plain_seconds, end), (4, 6), textcoords="offset points")
        axes.set(xscale="log", yscale="log", xlabel="seconds on one core",
                 ylabel=labelled("half the width of the interval of 95 %", result.unit))  # fmt: skip
        axes.legend()
    return figure
