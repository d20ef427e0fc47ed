"""Run a scene to a requested error: search the cheapest tolerance that meets the error on this scene.

A reference run by a method of other stages, at a tenth of the tolerance, estimates the error. Its steps are at most
half the mean step. Where nothing damps the ringing of stuck sliders, its tolerance is so small that it resolves what
the other runs filter, and a run by the default method, which resolves the ringing too, confirms it. Where this ringing
exceeds the target, where these two runs differ by more than a tenth of it, or where there is no time for them, no error
is stated, but what the ringing changes in this scene is. SAFETY covers the error of the reference run; docs/accuracy.md
compares such estimates with true errors. Half of the requested error is for effect selection, half for the method.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import cached_property
from math import inf, pi
from typing import TYPE_CHECKING, Any, Final

from msfp_gen.common.aliases import Progress
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.common.tables import Table
from msfp_gen.model.model import build_model, working_time
from msfp_gen.scene.effect_selection import slider_period
from msfp_gen.scene.system import System
from msfp_gen.simulation.simulate import simulate
from msfp_gen.studies.accuracy.timed_run import (
    CUT_OFF,
    Errors,
    Trial,
    check_measurable,
    dopri5_cost,
    errors,
    run_native,
)

if TYPE_CHECKING:
    from msfp_gen.results.result import AnyResult
    from msfp_gen.scene.solver import Solver

CANDIDATE_TOLERANCES = tuple(float(f"{10 ** (-k / 2):.1g}") for k in range(4, 21))  # 1e-2, 3e-3, 1e-3 ... 1e-10
REFERENCE_OFFSET = 2  # candidates from a tolerance to the tolerance of its reference run: a factor of ten
STEPS_PER_PERIOD = 40  # of a reference run in the period of a damped slider
MOST_STEPS = 200_000  # of such a run: some seconds; longer runs do without
RESOLVING, CONFIRMING = 1e-8, 1e-7  # tolerances of a reference run that resolves undamped ringing, and of a second one
RESOLVING_SHARE = 0.5  # of the time left, which each of them may take
KNOWN = 0.1  # of the target: what these two runs may differ by
SAFETY = 1.5  # factor on the difference from the reference run, which has an error of its own
DAMPED = 0.02  # damping ratio above which the ringing of stuck sliders decays
STAGNATION_RATIO = 0.7  # ratio of errors over two candidates above which the tolerance is not their cause
BUDGET = 120.0  # wall time of the whole search [s]
METHOD: Final = "implicit"
REFERENCE_METHOD = "esdirk4"  # other stages, order and dense output


@dataclass(frozen=True)
class Attempt:
    """One run of the search: its settings, its cost and its estimated error.

    Attributes:
        method: name of the method.
        rtol: relative tolerance [-].
        seconds: wall time [s]; measured for the chosen run, else iterations times the time per iteration of the chosen
            run.
        newton: number of Newton iterations.
        estimate: largest of the RMS and peak errors of force and sliding, relative to peaks, times a factor of safety
            [-]; None if the run has no reference run, or failed.
        errors: differences from the reference run; None as for `estimate`.
        status: how the run ended.
    """

    method: str
    rtol: float
    seconds: float
    newton: int
    estimate: float | None
    errors: Errors | None
    status: str


@dataclass(frozen=True, eq=False)
class Within:
    """Result of a run to a requested error.

    Attributes:
        result: the run.
        target: requested relative error [-].
        chosen: tolerance, cost and estimated error of `result`.
        next_step: tolerance, cost and estimated error at the next tighter candidate; None if there is none, or no time
            was left.
        attempts: at all candidate tolerances that were tried, loosest first.
        seconds: wall time of search and run [s].
        left_out: undamped ringing that the estimate does not include, and what it changes in this scene, as text; ""
            if none.
        reasons: for the settings, as text.
        explained: whether `tables` lists attempts and reasons.
    """

    result: AnyResult
    target: float
    chosen: Attempt
    next_step: Attempt | None
    attempts: tuple[Attempt, ...]
    seconds: float
    left_out: str
    reasons: tuple[str, ...]
    explained: bool

    @property
    def estimate(self) -> float | None:
        """Estimated error of `result` [-]; None where it is not known because undamped ringing exceeds it."""
        return None if self.left_out else self.chosen.estimate

    @property
    def tables(self) -> list[Table]:
        """Tables for the console; with attempts and reasons if an explanation was requested."""
        chosen, step, errors = self.chosen, self.next_step, self.chosen.errors
        components = (
            "not estimated"
            if errors is None
            else "; ".join(
                f"{name.replace('_', ' ')} {share(one.rms)} RMS, {share(one.peak)} at its peak"
                for name, one in errors.parts.items()
            )
        )
        tighter = "not run in the time given"
        if step is not None:
            smaller = (step.estimate or 1.0) < (chosen.estimate or 0.0)
            error = f"about {share(step.estimate)}" if smaller else "no smaller estimate"
            tighter = f"rtol {step.rtol:g}: {error} in {_seconds(step.seconds)}"
        estimate = f"{share(chosen.estimate)}: {components}"
        known = self.estimate is not None
        cost = (
            f"{_seconds(chosen.seconds)}, {chosen.newton} Newton iterations; with the search {_seconds(self.seconds)}"
        )
        rows = [
            ("requested error", share(self.target)),
            ("estimated error of this run", estimate if known else f"not known; without what is left out {estimate}"),
            *([("not in the estimate", self.left_out)] if self.left_out else []),
            ("settings", f"{chosen.method}, rtol {chosen.rtol:g}"),
            ("cost of this run", cost),
            ("next tighter tolerance", tighter),
        ]
        tables = [Table("accuracy, relative to peaks", (), rows)]
        if not self.explained:
            return tables
        columns = ("rtol", "outcome", "time", "Newton iterations", "estimated error")
        tried = [
            (f"{a.rtol:g}", a.status, _seconds(a.seconds), str(a.newton), share(a.estimate)) for a in self.attempts
        ]
        reasons = [("-", reason) for reason in self.reasons]
        tables.append(Table("tolerances tried, each compared with a tighter one", columns, tried))
        return [*tables, Table("reasons", (), reasons)]

    def as_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON."""
        return {
            "target": self.target,
            "estimate": self.estimate,
            "chosen": asdict(self.chosen),
            "next_step": None if self.next_step is None else asdict(self.next_step),
            "seconds": self.seconds,
            "left_out": self.left_out,
            "attempts": [asdict(attempt) for attempt in self.attempts],
            "reasons": list(self.reasons),
        }


def check_target(error: float, budget: float) -> None:
    """Raise InputError for an error [-] or a time of the search [s] out of range."""
    if not 1e-8 <= error < 1:
        raise InputError(f"error = {error:g}: give a share such as 0.5% or 0.005, from 1e-8 to below 1")
    if not 0 < budget < float("inf"):
        raise InputError(f"budget = {budget:g}: give seconds above zero")


def simulate_within(
    scene: System, error: float, *, budget: float = BUDGET, explain: bool = False, progress: Progress | None = None
) -> Within:
    """Run `scene` so that its relative error is at most `error`, at the least cost found.

    Args:
        scene: of a bearing, a building or any other system; its method and tolerance are chosen here.
        error: bound of the RMS error over time and of the error of the peak, each relative to the peak [-], such as
            0.005: of the horizontal force on the top and of sliding; of a building, of bearing displacement, base
            shear, floor accelerations and storey drifts.
        budget: wall time of the search [s], without the time to build models.
        explain: also measure the cost of `dopri5`, the method of PEER 2017/07.
        progress: as for `simulate`, called during the final run.

    Raises:
        InputError: an error or a budget out of range.
        RunError: the error is not reached within the budget, or the runs fail.
    """
    check_target(error, budget)
    check_measurable(scene)
    scene = replace(scene, solver=replace(scene.solver, method=METHOD))
    scene, effect_reasons = scene.with_effects_for(error)
    for candidate in (scene, scene.with_all_effects()):
        for spec in candidate.specs:
            build_model(spec.layout, spec.effects)
    begin = working_time()
    search = _Search(scene, error, begin + budget)
    try:
        index = search.loosest()
    except _ModelErrorTooLargeError as failure:
        scene, effect_reasons = scene.with_all_effects(), f"all effects: {effect_reasons}; but {failure}"
        search = _Search(scene, error, begin + budget)
        index = search.loosest()
    index = search.cheapest(index)
    result = simulate(replace(scene, solver=search.solver(index)), progress=progress)
    if any(note.kind == "vibration" for note in result.notes):  # its estimate is the coarser one
        result = replace(result, notes=tuple(note for note in result.notes if note.kind != "vibration"))
    chosen = replace(search.attempt(index), seconds=result.work["wall_time"])
    seconds_per_iteration = chosen.seconds / max(chosen.newton, 1)  # runs of the search write more rows than this one
    tighter = search.next_step(index)
    reasons = (effect_reasons, *search.reasons(index), *(dopri5_cost(scene) if explain else ()))
    within = Within(
        result=result,
        target=error,
        chosen=chosen,
        next_step=None if tighter is None else replace(tighter, seconds=seconds_per_iteration * tighter.newton),
        attempts=tuple(
            replace(attempt, seconds=seconds_per_iteration * attempt.newton)
            for attempt in map(search.attempt, sorted(search.trials))
        ),
        seconds=working_time() - begin,
        left_out=search.left_out(index),
        reasons=reasons,
        explained=explain,
    )
    stated = "unknown" if within.estimate is None else f"{within.estimate:.3g}"
    provenance = {"error_target": f"{error:g}", "error_estimate": stated}
    return replace(within, result=replace(result, provenance=result.provenance | provenance))


def ringing(system: System) -> tuple[float, bool]:
    """Longest period of a slider on its stuck surface [s]; infinite without inertia. Whether nothing damps it."""
    bearings = zip(system.every_bearing, system.every_effects, system.loads_at_rest, strict=False)
    period, rings = 0.0, False
    for bearing, effects, load in bearings:
        if effects.sliders == "inertial":
            own = slider_period(bearing, load)
            period = max(period, own)
            damping = min(surface.contact_damping for surface in bearing.surfaces)
            rings = rings or pi * damping / own <= DAMPED
    return period or float("inf"), rings


class _ModelErrorTooLargeError(Exception):
    """The selected effects keep a run from its end, or leave an error above the target at any tolerance."""


class _Search:
    """Runs of one scene at the candidate tolerances, each compared with a reference run."""

    # `index`: of a candidate tolerance, loosest first. Where the effects were selected (`Auto`), the reference runs
    # model all effects, so that the estimate includes the error of the selection.

    def __init__(self, scene: System, target: float, deadline: float) -> None:
        self.scene, self.target, self.deadline = scene, target, deadline
        self.trials: dict[int, Trial] = {}
        self.references: dict[int, Trial] = {}  # index of a run -> its reference run
        self.reference_scene = scene.with_all_effects()
        self.period, self.rings = ringing(self.reference_scene)
        self.filtered = False  # whether the reference runs filter undamped ringing, which no estimate then includes

    def solver(self, index: int) -> Solver:
        """Solver options at a candidate tolerance."""
        return replace(self.scene.solver, method=METHOD, rtol=CANDIDATE_TOLERANCES[index], atol_angle=None)

    def trial(self, index: int) -> Trial:
        """The run at a candidate tolerance. Raises RunError when the budget is used up."""
        if index not in self.trials:
            self.trials[index] = self._run(METHOD, self.scene, CANDIDATE_TOLERANCES[index])
        return self.trials[index]

    def reference(self, index: int) -> Trial:
        """The reference run of the run at a candidate tolerance. Raises RunError as `trial`."""
        if index not in self.references:
            tolerance = CANDIDATE_TOLERANCES[index + REFERENCE_OFFSET]
            self.filtered = self.filtered or (self.rings and self.doubt > KNOWN * self.target)
            if self.rings and not self.filtered and tolerance >= RESOLVING:
                self.references[index] = self.resolved
            else:
                scene, shorter = self._with_short_steps(index)
                tolerance = max(tolerance * shorter, CANDIDATE_TOLERANCES[-1])
                self.references[index] = self._run(REFERENCE_METHOD, scene, tolerance)
        return self.references[index]

    def _with_short_steps(self, index: int) -> tuple[System, float]:
        """The reference scene with steps of at most half the mean step of a run, and several in a slider's period."""
        # Also the longest step over that half. Newton's method leaves a share of the tolerance as a residual in every
        # stage. What it leaves adds up over the steps, so the tolerance has to shrink with them.
        scene, half = self.reference_scene, self.reference_scene.end / (2 * max(self.trial(index).steps, 1))
        steps = [half, *([scene.solver.max_step] if scene.solver.max_step is not None else [])]
        if not self.filtered and STEPS_PER_PERIOD * scene.end <= MOST_STEPS * self.period:
            steps.append(self.period / STEPS_PER_PERIOD)
        solver = replace(scene.solver, max_step=min(steps), first_step=None)
        return replace(scene, solver=solver), min(steps) / half

    @cached_property
    def resolved(self) -> Trial:
        """The run that resolves undamped ringing, as far as it came in its share of the time."""
        return run_native(
            REFERENCE_METHOD, self.reference_scene, RESOLVING, RESOLVING_SHARE * self._remaining, repeats=0
        )

    @cached_property
    def doubt(self) -> float:
        """Difference of `resolved` from a run by the other method [-]; infinite where one of the two did not end."""
        if not self.resolved.finished:
            return inf
        second = run_native(METHOD, self.reference_scene, CONFIRMING, RESOLVING_SHARE * self._remaining, repeats=0)
        found = errors(second, self.resolved) if second.finished else None
        return inf if found is None else found.largest

    @property
    def _remaining(self) -> float:
        return max(self.deadline - working_time(), 0.05)

    def _run(self, method: str, scene: System, tolerance: float) -> Trial:
        trial = run_native(method, scene, tolerance, self._remaining, repeats=0)
        if trial.status == CUT_OFF:
            raise RunError(self._target_missed(), status="accuracy")
        return trial

    def loosest(self) -> int:
        """Index of the loosest tolerance that meets the target.

        Raises RunError if no tolerance does, if a run and its reference run both fail, or if three reference runs fail.
        """
        first = next(
            k
            for k, rtol in enumerate(CANDIDATE_TOLERANCES)
            if rtol <= 10 * self.target or rtol == CANDIDATE_TOLERANCES[-1 - REFERENCE_OFFSET]
        )
        for index in range(first, len(CANDIDATE_TOLERANCES) - REFERENCE_OFFSET):
            trial, reference = self.trial(index), self.reference(index)
            if not trial.finished and not reference.finished:
                raise RunError(reference.message, status=reference.status)
            estimate = self.attempt(index).estimate
            if estimate is not None and estimate <= self.target:
                return index
            if self.rings and not self.filtered and self._stagnates(index, first):
                self.filtered, self.references = True, {}
                return self.loosest()
            self._check_model_error(index, first, trial)
            if sum(not reference.finished for reference in self.references.values()) > REFERENCE_OFFSET:
                break
        raise RunError(self._target_missed(), status="accuracy")

    def _check_model_error(self, index: int, first: int, trial: Trial) -> None:
        """Raise _ModelErrorTooLargeError if the selected effects keep a run from its end or from the target."""
        # They keep it from the target if two tighter tolerances did not reduce the error. first: index of the first
        # run.
        if self.reference_scene is self.scene:
            return
        if not trial.finished:
            raise _ModelErrorTooLargeError(f"a run with them ends early: {trial.message}")
        if self._stagnates(index, first):
            raise _ModelErrorTooLargeError(
                f"they leave an error of {self.attempt(index).estimate:.2g} at any tolerance"
            )

    def _stagnates(self, index: int, first: int) -> bool:
        """Whether the last two tighter tolerances did not reduce the error."""
        known = [self.attempt(k).estimate for k in range(max(first, index - REFERENCE_OFFSET), index + 1)]
        if len(known) <= REFERENCE_OFFSET or None in known:
            return False
        return (known[-1] or 0.0) > STAGNATION_RATIO * (known[0] or 0.0)

    def cheapest(self, index: int) -> int:
        """`index`, or a tighter tolerance that takes no more iterations, since fewer of its steps are rejected."""
        while (tighter := self.next_step(index)) is not None and tighter.newton <= self.trials[index].newton:
            if tighter.estimate is None or tighter.estimate > self.target:
                break
            index += 1
        return index

    def attempt(self, index: int) -> Attempt:
        """Cost and estimated error at a candidate tolerance, by its reference run or its looser neighbour's."""
        trial, differences, estimate = self.trials[index], None, None
        reference = next((self.references[k] for k in (index, index - 1) if k in self.references), None)
        if trial.finished and reference is not None and reference.finished:
            differences = errors(trial, reference)
        if differences is not None:
            # The reference run of the looser neighbour has a third of the tolerance: more of its own error counts.
            close = index not in self.references and reference is not None and reference.rtol > 0.2 * trial.rtol
            factor = 2 * SAFETY if close else SAFETY
            estimate = factor * differences.largest
            if self.rings and (not self.filtered or self._error_of_ringing(index) <= self.target):
                estimate = max(estimate, self._error_of_ringing(index))
        return Attempt(trial.method, trial.rtol, trial.seconds, trial.newton, estimate, differences, trial.status)

    def _error_of_ringing(self, index: int) -> float:
        """Estimated error of a run against one that resolves undamped ringing; infinite where none is confirmed."""
        found = errors(self.trial(index), self.resolved) if self.doubt <= KNOWN * self.target else None
        return inf if found is None else found.largest + max((SAFETY - 1) * found.largest, self.doubt)

    def next_step(self, index: int) -> Attempt | None:
        """The attempt at the next tighter tolerance, run where needed; None if there is no time for it."""
        try:
            self.trial(index + 1)
        except RunError:
            return None
        return self.attempt(index + 1)

    def reasons(self, index: int) -> tuple[str, ...]:
        """The reasons for the method and the tolerance, as text."""
        looser = [k for k in sorted(self.trials) if k < index and self.attempt(k).estimate is not None]
        method = (
            f"{METHOD}: L-stable, so that stuck sliders, which ring at hundreds to thousands of hertz, do not "
            "limit its steps; where that ringing is filtered, not resolved, esdirk4, of order 4, takes more "
            "Newton iterations for the same error (docs/accuracy.md)"
        )
        reference = self.references[next(k for k in (index, index - 1) if k in self.references)]
        compared = f"{reference.method} at rtol {reference.rtol:.2g} in {reference.steps} steps"
        text = f"the run at rtol {CANDIDATE_TOLERANCES[index]:g} was compared with {compared}"
        if self.reference_scene is not self.scene:
            text += " with every effect"
        if self.rings and not self.filtered:
            confirmed = f"{METHOD} at rtol {CONFIRMING:g} is within {share(self.doubt)} of it"
            text += f", which resolves {self._ringing}; {confirmed}"
        if looser and (self.attempt(looser[-1]).estimate or 0.0) <= self.target:
            return method, f"{text}; looser tolerances meet the target too, but lose more iterations to rejected steps"
        if not looser:
            return method, f"{text}; it is the loosest tolerance tried for this target"
        last = self.attempt(looser[-1])
        return method, f"{text}; the next looser tolerance, {last.rtol:g}, has an error of about {last.estimate:.2g}"

    def left_out(self, index: int) -> str:
        """Ringing that no estimate of the search includes, with its effect on this scene, as text; "" if none."""
        if not self.filtered or self._error_of_ringing(index) <= self.target:
            return ""
        resolved, found = self.resolved, errors(self.trial(index), self.resolved)
        words = (
            "a run that resolves it" if resolved.finished else f"until {resolved.reached:.3g} s a run that resolves it"
        )
        effect = (
            f"{words} differs in RMS by "
            + ", ".join(f"{share(one.rms)} in {name.replace('_', ' ')}" for name, one in found.parts.items())
            if found
            else "no run resolved it"
        )
        second, remedy = "no second run confirmed it in time", "give contact_damping or a larger budget"
        if self.doubt < inf:
            second, remedy = f"a second such run by {share(self.doubt)} from the first", "give contact_damping"
        effect += f", and {second}" if resolved.finished else ""
        return f"{self._ringing}, which nothing damps: {effect}; {remedy}"

    @property
    def _ringing(self) -> str:
        return f"the ringing of stuck sliders at {1 / self.period:.0f} Hz and above"

    def _target_missed(self) -> str:
        """Message that the target was not reached, with the best run so far."""
        attempts = [self.attempt(k) for k in sorted(self.trials)]
        estimated = [attempt for attempt in attempts if attempt.estimate is not None]
        best = min(estimated, key=lambda a: a.estimate or 0.0, default=None)
        failed = [trial.message for trial in self.references.values() if not trial.finished]
        so_far = f"a run with every effect fails: {failed[-1]}" if failed else "no error was estimated until then"
        if best is not None:
            so_far = f"the best is rtol = {best.rtol:g}, an error of about {best.estimate:.2g} in {best.seconds:.2g} s"
        if self.rings and not self.filtered:
            so_far += f", with {self._ringing}, which nothing damps: give contact_damping"
        return (
            f"an error of {self.target:g} was not reached{'' if failed else ' in the time given'}: {so_far}; "
            "give a larger error, a larger budget, or a tolerance (rtol) to run without an estimate"
        )


def share(value: float | None) -> str:
    """`value` as a percentage with two digits."""
    return "not known" if value is None else f"{100 * value:.2g} %"


def _seconds(value: float) -> str:
    return f"{1e3 * value:.3g} ms" if value < 1 else f"{value:.3g} s"
