"""`estimate`: a mean of a study, or a probability of exceedance, from cheap and exact runs.

A study and a question come in; rounds of runs (`model_runs.py`) are planned until the interval (`estimators.py`) is
enough; an `Estimate` goes out. Its table for a terminal and its figure are here too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Choice, Quantity, check_fields, to_si
from msfp_gen.common.tables import Table
from msfp_gen.figures.style import COLOURS, FAINT, INK, headline, page
from msfp_gen.scene.fidelity import at_fidelity
from msfp_gen.scene.plausibility import require_meant
from msfp_gen.studies.assessment.rows import labelled
from msfp_gen.studies.axes import SceneFactory
from msfp_gen.studies.definition import Study, load_study
from msfp_gen.studies.estimation.estimators import (
    EXACT,
    Moment,
    mean_of,
    optimal_runs,
    work,
)
from msfp_gen.studies.estimation.model_runs import ModelRuns, StudyModelRuns
from msfp_gen.studies.workers import pool_from

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STATISTICS = {
    "mean": "the mean",
    "probability": "the probability that the quantity is at least `threshold`",
}
LEVELS = {"equivalent": 1, "rigid": 2, "massless": 2, "loose": 2}  # cheaper model -> rank, cheapest 1
BOUNDS = {"most": "a lower bound", "least": "an upper bound", "": ""}  # `Quantity.side` -> of a run that ended early
CHOICE = 32  # exact runs from which the cheap model is chosen
PILOT = 500  # exact runs at least: what one draw in a hundred does is in 99 % of such samples
ENOUGH = 0.25  # work over plain Monte Carlo below which no dearer model is tried
NO_BENEFIT = 0.8  # work over plain Monte Carlo above which only exact runs are made
ROUNDS = 8
GROWTH = 3.0  # exact runs of a round over the exact runs of the round before, at most
MARGIN = 0.9  # half width that the runs are planned for, over the target
MOST = 200_000  # draws
CHEAP = 8  # runs of the cheap model for each exact run, at least
Z = 1.96  # quantile of the normal distribution for an interval of 95 %
WIDTH, HEIGHT = 6.8, 4.6  # of the figure [inch]


@dataclass(frozen=True)
class Question:
    """What is estimated, and how accurately: the table `[accuracy]` of a study file.

    quantity: a column of the study. statistic: a key of STATISTICS. threshold: of a probability [unit of the quantity].
    target: half the width of the interval of 95 %, over the value; for a probability not over the value. budget: core
    time of all runs [s]. pilot: exact runs at least, unless the budget ends before. models: cheaper models to try;
    None: `estimate` chooses them.
    seed: of the draws. side: how runs that ended early bound the quantity, as `Quantity.side`. Raises InputError.
    """

    quantity: str | None = None
    statistic: Annotated[str, Choice(STATISTICS)] = "mean"
    threshold: Annotated[float | None, Quantity("")] = None
    target: Annotated[float | None, Quantity("", above=0.0)] = None
    budget: Annotated[float | None, Quantity("s", above=0.0)] = None
    pilot: Annotated[int, Quantity("", least=16, whole=True)] = PILOT
    models: tuple[str, ...] | None = None
    seed: Annotated[int, Quantity("", least=0, whole=True)] = 0
    side: str = field(default="most", repr=False)

    def __post_init__(self) -> None:
        check_fields(self, "accuracy")
        if (self.statistic == "probability") != (self.threshold is not None):
            rule = "give it" if self.threshold is None else "leave it out"
            raise InputError(f"accuracy.threshold = {self.threshold}: {rule} with statistic = {self.statistic!r}")
        if self.target is None and self.budget is None:
            raise InputError("accuracy: give target, such as '2 %', or budget, such as '10 min'")
        for name in self.models or ():
            if name not in LEVELS:
                raise InputError(f"accuracy.models has {name!r}: give some of {', '.join(map(repr, LEVELS))}")

    def target_half(self, value: float) -> float:
        """The target for half the width of the interval about an estimate [unit of `value`]."""
        assert self.target is not None
        return self.target if self.threshold is not None else self.target * abs(value)


@dataclass(frozen=True)
class Estimate:
    """Result of `estimate`.

    Attributes:
        quantity, statistic, threshold: as in `Question`.
        unit: of `value`.
        value: the estimate.
        interval: (low, high), of 95 % [unit of `value`].
        runs: model -> number of its runs.
        seconds: core time of all runs [s].
        plain_seconds: core time of plain Monte Carlo for this interval, from variance and cost of exact runs [s].
        correlation: cheaper model -> correlation with the exact model, over the draws by which it was chosen [-].
        costs: model -> core time of a run [s].
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
    trace: tuple[tuple[float, float], ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def half(self) -> float:
        """Half the width of the interval [unit of `value`]."""
        return (self.interval[1] - self.interval[0]) / 2

    def as_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON."""
        return asdict(self)


def question_of(study: Study, **changes: Any) -> Question:
    """The question of `[accuracy]` in a study file; changes other than None replace its keys. Raises InputError."""
    table = {key: value for key, value in study.table.get("accuracy", {}).items() if key != "draws"}
    known = [field.name for field in fields(Question) if field.name != "side"]
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
    executor: Executor | None = None,
    dask: str | None = None,
    force: bool = False,
    progress: Any = None,
) -> Estimate:
    """Estimate a statistic of a quantity over the draws of a study, with few exact runs.

    A draw is a combination of the values of the gridded axes, all equally likely, and one value of each random axis.
    The folder is the folder of a study with the exact runs; the runs of each cheaper model are a study in a folder
    within it. The same call continues an interrupted estimate.

    source, workers, executor, dask, force: see `study`. folder: of the study. quantity to seed: as in
    `Question`, by default the keys of `[accuracy]` in the study file; target and budget also as texts, such as "2 %"
    and "10 min". progress: called with the name of a model and a number of draws before the runs of these draws.

    Raises InputError: invalid input, or the pilot shows that the budget does not permit the target, and a new folder is
    removed again; RunError: workers died; the same call continues.
    """
    study = source if isinstance(source, Study) else load_study(source)
    require_meant(*study.ends, force=force)
    question = question_of(
        study, quantity=quantity, statistic=statistic, threshold=threshold, target=target, budget=budget,
        models=None if models is None else tuple(models), pilot=pilot, seed=seed,
    )  # fmt: skip
    levels = (EXACT, *(cheaper_models(study) if question.models is None else question.models))
    assert question.quantity is not None
    existed = Path(folder).exists()
    try:
        with pool_from(workers, executor, dask) as pool:
            runs = StudyModelRuns(study, Path(folder), question.quantity, levels, question.seed, pool, progress)
            result = estimated(runs, replace(question, side=study.keep.side(question.quantity)))
    except _BudgetError:
        if not existed:
            rmtree(folder, ignore_errors=True)
        raise
    units = {column.name: column.unit for column in study.keep.columns}
    return replace(result, unit=units[question.quantity] if question.threshold is None else "")


def cheaper_models(study: Study) -> list[str]:
    """The models that the scene of a study has, cheapest first."""
    found = []
    for level in ("equivalent", "massless" if "peak_sliding_1" in study.keep.known else "rigid"):
        with suppress(InputError):
            at_fidelity(SceneFactory(study.inputs).base, level)
            found.append(level)
    return found


class _State:
    """The models of an estimate and the numbers of their runs: both run the same draws, from the first."""

    # cheap: the cheap model; None: exact runs only.
    # exact, many: numbers of runs of the exact and of the cheap model.
    # early: model -> runs that ended early.

    def __init__(self, source: ModelRuns, question: Question) -> None:
        self.source, self.question = source, question
        self.limit = min(MOST, source.population or MOST)
        self.exact = min(question.pilot, CHOICE, self.limit)
        self.cheap: str | None = None
        self.many = 0
        self.rounds = 0  # planned after the pilot
        self.early: dict[str, int] = {}

    def outcomes(self, level: str, count: int) -> Array:
        """The values of a model at the first draws, shape (count,) [unit of the quantity].

        For a probability, a run that ended early is infinite unless it exceeded the threshold before; of a least value
        it is minus infinity unless it was below the threshold before. Raises InputError where it is no bound.
        """
        values, early = self.source.values(level, count)
        self.early[level] = int(early.sum())
        if (bound := self.question.threshold) is not None:
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
                "status in the folder"
            )
        return values

    def moment(self) -> Moment:
        """The estimate from all runs so far; missing runs are computed."""
        exact = self.outcomes(EXACT, self.exact)
        cheap = None if self.cheap is None else self.controls(self.cheap, self.many, exact)
        population = self.source.population or np.inf
        if self.question.threshold is not None:
            return mean_of((exact >= self.question.threshold).astype(float), cheap, population, share=True)
        return mean_of(exact, cheap, population)

    def controls(self, level: str, count: int, exact: Array) -> Array:
        """What a cheap model gives at the first draws, shape (count, k): its quantities, or whether they exceed.

        exact: outcomes of the exact model. In a probability each quantity of the cheap model has the threshold beyond
        which, or at an early end, as many of the same draws lie as in the exact model: midway between two draws, for at
        the least exceedance too few of all others lie beyond.
        """
        values, early = self.source.values(level, count)
        self.early[level] = int(early.sum())
        values = values.reshape(count, -1)
        if self.question.threshold is None:
            return np.stack([_finite(each) for each in values.T], axis=1)
        beyond = int((exact >= self.question.threshold).sum())
        if self.question.side == "least":  # the least values are the worst, beside the largest displacement
            beyond = len(exact) - beyond
            values = np.column_stack([-values[:, :1], values[:, 1:]])
        worst = np.where(early[:, None], np.inf, values)
        if not beyond:
            return np.zeros_like(worst)
        ordered = np.sort(worst[: len(exact)], axis=0)
        reached, below = ordered[-beyond], ordered[-min(beyond + 1, len(exact))]
        limits = np.where(np.isfinite(reached) & np.isfinite(below), reached / 2 + below / 2, reached)
        exceeds: Array = (worst >= limits).astype(float)
        return exceeds

    def work(self, moment: Moment, level: str) -> float:
        """Time by a cheap model for an interval, over the time of exact runs alone [-]."""
        return work(moment.correlation, self.source.cost(level) / self.source.cost(EXACT))

    def plan(self, wanted: Array) -> bool:
        """Set the numbers of runs, shape (models,); whether there are more than before."""
        before = self.exact, self.many
        self.exact = min(max(int(np.ceil(wanted[0])), self.exact), self.limit)
        if self.cheap is not None:
            self.many = min(max(int(np.ceil(wanted[-1] / 64)) * 64, self.many, CHEAP * self.exact), self.limit)
        return before != (self.exact, self.many)


def _finite(values: Array) -> Array:
    """The values of a cheap model, a failed run with the largest of all others, shape (runs,) [unit of `values`]."""
    finite = values[np.isfinite(values)]
    return np.where(np.isfinite(values), values, float(finite.max()) if len(finite) else 0.0)


def estimated(source: ModelRuns, question: Question) -> Estimate:
    """The estimate of a statistic from a source of runs. Raises InputError."""
    state, notes = _State(source, question), []
    correlation = _choose(state)
    trace: list[tuple[float, float]] = []
    for _ in range(ROUNDS):
        moment = state.moment()
        if state.cheap is not None and state.work(moment, state.cheap) > NO_BENEFIT:
            state.cheap = None
            moment = state.moment()
        spent, runs = source.spent()
        trace.append((spent, moment.half))
        if not _plan_round(state, moment, spent):
            break
    if state.cheap is None:
        notes.append("no cheaper model saves time here (correlation too low, or too dear): exact runs only")
    if question.threshold is None and state.exact < min(PILOT, source.population or PILOT):
        notes.append(
            f"the interval leaves out what fewer than one draw in {state.exact / 4:.0f} does, which {state.exact} "
            f"exact runs may not show; {PILOT} show what one in a hundred does"
        )
    value, half = moment.value, moment.half
    costs = {level: source.cost(level) for level in runs}
    if question.target is not None and half > 1.02 * question.target_half(value):
        notes.append(f"the target was not reached: the half width is {half:.3g}")
    if question.budget is not None and spent > 1.1 * question.budget:
        notes.append(f"the runs took {spent:.3g} s in place of {question.budget:g} s: a pilot needs that; give fewer")
    for level, count in state.early.items():
        if count and question.threshold is not None:
            where = "below" if question.side == "least" else "above"
            notes.append(f"{count} runs of {level} ended early; they count as {where} every value")
        elif count:
            word = (BOUNDS[question.side] if level == EXACT else "") or "what they reached"
            notes.append(f"{count} of {runs.get(level, count)} runs of {level} ended early; their value is {word}")
    plain = max(value * (1 - value), 1e-12) if question.threshold is not None else moment.plain
    seconds = costs[EXACT] * plain * Z**2 / half**2 if half > 0 else spent
    return Estimate(
        question.quantity or "", question.statistic, question.threshold, "", value, moment.interval, runs,
        spent, seconds, correlation, costs, trace=tuple(trace), notes=tuple(notes),
    )  # fmt: skip


def _choose(state: _State) -> dict[str, float]:
    """Choose the cheap model by the first draws, and plan the pilot; returns cheaper model -> correlation."""
    source, question, count = state.source, state.question, state.exact
    exact = state.outcomes(EXACT, count)
    correlation: dict[str, float] = {}
    best = NO_BENEFIT
    for level in sorted(source.levels[1:], key=lambda name: LEVELS.get(name, 9)):
        if best < ENOUGH and question.models is None:
            break
        moment = _moment_of_choice(state, level, exact)
        correlation[level] = moment.correlation
        if (needed := state.work(moment, level)) < best:
            best, state.cheap = needed, level
    pilot = float(question.pilot)
    if question.budget is not None:
        pilot = min(pilot, question.budget / source.cost(EXACT))
    state.plan(np.array([max(pilot, count), 0.0]))
    return correlation


def _moment_of_choice(state: _State, level: str, exact: Array) -> Moment:
    """The mean by the first draws; for a probability of the exceedances, where some runs exceed."""
    threshold, count = state.question.threshold, len(exact)
    if threshold is not None and 2 <= (exact >= threshold).sum() <= count - 2:
        return mean_of((exact >= threshold).astype(float), state.controls(level, count, exact), allowed=0.0)
    values = state.source.values(level, count)[0].reshape(count, -1)
    return mean_of(_finite(exact), np.stack([_finite(each) for each in values.T], axis=1), allowed=0.0)


class _BudgetError(InputError):
    """The pilot shows that the target needs more time than the budget."""


def _plan_round(state: _State, moment: Moment, spent: float) -> bool:
    """Plan the next round, and return whether there is one. spent: core time so far [s]."""
    # Raises _BudgetError where the pilot alone shows that the budget does not permit the target. After the pilot the
    # estimate ends with the budget, and a note says so.
    question, half, exact = state.question, moment.half, state.exact
    models = (EXACT,) if state.cheap is None else (EXACT, state.cheap)
    costs = np.array([state.source.cost(level) for level in models])
    variances = np.maximum([moment.residual, moment.explained][: len(models)], 1e-12 * max(moment.value**2, 1e-300))
    runs, needed = np.zeros(len(costs)), np.inf
    if question.target is not None:
        target_half = question.target_half(moment.value)
        if half <= target_half:
            return False
        planned = (MARGIN * target_half / moment.quantile) ** 2
        runs = optimal_runs(variances, costs, variance=planned)
        if moment.unseen:  # such a variance falls with the square of the number of exact runs
            runs[0] = min(runs[0], exact * half / (MARGIN * target_half))
        needed = float(runs @ costs)
        if question.budget is not None and needed > question.budget and not state.rounds:
            raise _BudgetError(
                f"target = {question.target:g} needs about {needed:.3g} s, budget = {question.budget:g} s: give a "
                f"target of {question.target * np.sqrt(needed / question.budget):.2g}, or the time"
            )
    if question.budget is not None and needed > question.budget:
        if spent > 0.95 * question.budget:
            return False
        runs = optimal_runs(variances, costs, seconds=question.budget)
    runs *= min(1.0, GROWTH * exact / runs[0])
    state.rounds += 1
    return state.plan(runs)


def estimate_table(result: Estimate) -> Table:
    """The estimate as a table for a terminal, ten lines at most."""
    unit = f" {result.unit}" if result.unit else ""
    threshold = "" if result.threshold is None else f" {result.threshold:g}"
    runs = ", ".join(f"{count} {name}" for name, count in result.runs.items())
    rows = [
        ("value", f"{result.value:.4g}{unit}"),
        ("interval of 95 %", f"{result.interval[0]:.4g} to {result.interval[1]:.4g}{unit}"),
    ]
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
    """Half the width of the interval over core time, round by round, beside plain Monte Carlo. path: see `page`."""
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
