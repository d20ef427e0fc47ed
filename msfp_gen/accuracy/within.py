"""A run to a wanted error: the cheapest settings that meet it, by an error that is measured on this very scene.

Every run of the ladder is judged by one at a tenth of its tolerance. What is left of the error after that tenth is
covered by SAFETY; docs/accuracy.md holds what estimates came to, beside true errors.
"""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, cast

from msfp_gen.accuracy.effects import effects_for, full
from msfp_gen.accuracy.measure import Errors, errors
from msfp_gen.accuracy.trial import CUT_OFF, Trial, run_native
from msfp_gen.errors import InputError, RunError
from msfp_gen.simulation import Progress, simulate

if TYPE_CHECKING:
    from msfp_gen.result import Result
    from msfp_gen.scene import Scene
    from msfp_gen.solver import Solver
    from msfp_gen.tables import Table

LADDER = tuple(float(f"{10 ** (-k / 2):.1g}") for k in range(4, 21))  # 1e-2, 3e-3, 1e-3 ... 1e-10
AHEAD = 2  # rungs between a run and the one that judges it: a tenth of the tolerance
SAFETY = 1.5
STALLED = 0.7  # an estimate that falls by less than this over two rungs is not one of the tolerance
BUDGET = 120.0  # [s] of wall time for the whole search
METHODS_BY_TARGET: tuple[tuple[float, str], ...] = ((0.0, "implicit"),)  # least target of each, first that fits


@dataclass(frozen=True)
class Attempt:
    """One rung: its settings, its cost, and what it is off by (None: not judged, or it failed).

    seconds: of the rung that was chosen as measured; of others by their iterations at its pace.

    estimate: the largest of the RMS errors and the errors of the peaks of force and sliding, relative.
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
    """A result with the error that it was asked for, the one it is estimated to have, and what more would cost.

    chosen: the rung of `result`; next_step: the one above, None at the top. attempts: all that was tried, in order.
    seconds: what everything took, the search included. left_out: what no estimate holds, in words, or nothing.
    reasons: why these settings, in words.
    """

    result: Result
    target: float
    chosen: Attempt
    next_step: Attempt | None
    attempts: tuple[Attempt, ...]
    seconds: float
    left_out: str
    reasons: tuple[str, ...]
    explained: bool

    @property
    def tables(self) -> list[Table]:
        """For a person; why, where that was asked for."""
        from msfp_gen.accuracy.told import within_tables

        return within_tables(self)

    def as_dict(self) -> dict[str, Any]:
        """Plain and JSON-able."""
        return {
            "target": self.target,
            "estimate": self.chosen.estimate,
            "chosen": asdict(self.chosen),
            "next_step": None if self.next_step is None else asdict(self.next_step),
            "seconds": self.seconds,
            "left_out": self.left_out,
            "attempts": [asdict(attempt) for attempt in self.attempts],
            "reasons": list(self.reasons),
        }


def simulate_within(
    scene: Scene, error: float, *, budget: float = BUDGET, explain: bool = False, progress: Progress | None = None
) -> Within:
    """Run `scene` so that its error is at most `error`, relative, at the least cost that is found.

    error: of force on the top and of sliding, RMS over time and at their peaks, over their peaks; such as 0.005.
    budget: wall time of the search [s]. explain: also measure what the report's method would take. `progress`: as for
    `simulate`, of the last run. Raises InputError for an error or a budget that makes no sense; RunError where the
    error cannot be had within the budget, or runs fail.
    """
    if not 1e-8 <= error < 1:
        raise InputError(f"error = {error:g}: give a share such as 0.5% or 0.005, from 1e-8 to below 1")
    if not 0 < budget < float("inf"):
        raise InputError(f"budget = {budget:g}: give seconds above zero")
    begin = time.perf_counter()
    effects, why = effects_for(scene, error)
    scene = replace(scene, effects=effects)
    method = next(name for least, name in METHODS_BY_TARGET if error >= least)
    search = _Search(scene, method, error, begin + budget)
    try:
        rung = search.rung()
    except _ModelTooSmallError as small:
        scene, why = full(scene), f"all effects: {why}; but {small}"
        search = _Search(scene, method, error, begin + budget)
        rung = search.rung()
    rung = search.cheapest(rung)
    result = simulate(replace(scene, solver=search.solver(rung)), progress=progress)
    chosen = replace(search.attempt(rung), seconds=result.counters.wall_time)
    pace = chosen.seconds / max(chosen.newton, 1)  # runs of the search write many rows, and took longer for that
    above = search.next_step(rung)
    reasons = (why, *search.reasons(rung), *(_report_method(scene) if explain else ()))
    provenance = {"error_target": f"{error:g}", "error_estimate": f"{chosen.estimate:.3g}"}
    return Within(
        result=replace(result, provenance=result.provenance | provenance),
        target=error,
        chosen=chosen,
        next_step=None if above is None else replace(above, seconds=pace * above.newton),
        attempts=tuple(replace(a, seconds=pace * a.newton) for a in map(search.attempt, sorted(search.trials))),
        seconds=time.perf_counter() - begin,
        left_out=_left_out(result),
        reasons=reasons,
        explained=explain,
    )


class _ModelTooSmallError(Exception):
    """No tolerance brings the effects that were chosen to the target."""


class _Search:
    """The rungs that were run, and what they tell of each other; where effects were chosen, fuller runs judge."""

    def __init__(self, scene: Scene, method: str, target: float, deadline: float) -> None:
        self.scene, self.method, self.target, self.deadline = scene, method, target, deadline
        self.trials: dict[int, Trial] = {}
        self.judge = full(scene)
        self.judges: dict[int, Trial] = self.trials if self.judge is scene else {}

    def solver(self, rung: int) -> Solver:
        return replace(self.scene.solver, method=cast(Any, self.method), rtol=LADDER[rung], atol_angle=None)

    def trial(self, rung: int, judging: bool = False) -> Trial:
        """The run of a rung, or of what judges there. RunError where the budget is spent."""
        scene, runs = (self.judge, self.judges) if judging else (self.scene, self.trials)
        if rung not in runs:
            left = self.deadline - time.perf_counter()
            found = run_native(self.method, scene, LADDER[rung], max(left, 0.05), repeats=0)
            if found.status == CUT_OFF:
                raise RunError(self._spent(), status="accuracy")
            runs[rung] = found
        return runs[rung]

    def rung(self) -> int:
        """The loosest rung that meets the target. RunError where none does, or two in a row fail."""
        first = next(k for k, rtol in enumerate(LADDER) if rtol <= 10 * self.target or rtol == LADDER[-1 - AHEAD])
        for rung in range(first, len(LADDER) - AHEAD):
            pair = self.trial(rung), self.trial(rung + AHEAD, judging=True)
            if not any(trial.finished for trial in pair):
                raise RunError(pair[1].message, status=pair[1].status)
            estimate = self.attempt(rung).estimate
            if estimate is not None and estimate <= self.target:
                return rung
            self._look_at_model(rung, first)
        raise RunError(self._spent(), status="accuracy")

    def _look_at_model(self, rung: int, first: int) -> None:
        """_ModelTooSmallError where two rungs in a row brought chosen effects no nearer to the full ones."""
        known = [self.attempt(k).estimate for k in range(max(first, rung - AHEAD), rung + 1)]
        if self.judge is self.scene or len(known) <= AHEAD or None in known:
            return
        if (known[-1] or 0.0) > STALLED * (known[0] or 0.0):
            raise _ModelTooSmallError(f"they leave {known[-1]:.2g} at any tolerance")

    def cheapest(self, rung: int) -> int:
        """`rung`, or one above that meets the target too for less work: a looser tolerance may cost rejected steps."""
        while (above := self.next_step(rung)) is not None and above.newton <= self.trials[rung].newton:
            if above.estimate is None or above.estimate > self.target:
                break
            rung += 1
        return rung

    def attempt(self, rung: int) -> Attempt:
        """What is known of a rung: judged by the tightest run within AHEAD of it."""
        trial, found, estimate = self.trials[rung], None, None
        judge = next((self.judges[k] for k in (rung + 2, rung + 1) if k in self.judges), None)
        if trial.finished and judge is not None and judge.finished:
            found = errors(trial, judge)
        if found is not None:
            # One rung ahead is a third of the tolerance, which leaves more of the error unseen.
            estimate = (SAFETY if rung + AHEAD in self.judges else 2 * SAFETY) * worst(found)
        return Attempt(trial.method, trial.rtol, trial.seconds, trial.newton, estimate, found, trial.status)

    def next_step(self, rung: int) -> Attempt | None:
        """The rung above, run if it has not been; None where there is none, or no time for it."""
        try:
            self.trial(rung + 1)
        except RunError:
            return None
        return self.attempt(rung + 1)

    def reasons(self, rung: int) -> tuple[str, ...]:
        """Why this rung of this method."""
        looser = [k for k in sorted(self.trials) if k < rung and self.attempt(k).estimate is not None]
        said = [f"{self.method}: L-stable, so that stuck sliders, which ring at hundreds to thousands of hertz, do not "
                "dictate its steps; that ringing is filtered, not resolved, and then esdirk4, of order 4, takes more "
                "Newton iterations for the same error (docs/accuracy.md)"]  # fmt: skip
        judged = next(k for k in (rung + 2, rung + 1) if k in self.judges)
        judge = f"at rtol {LADDER[rung]:g} the run was judged by one at {LADDER[judged]:g}"
        if self.judge is not self.scene:
            judge += " with every effect"
        if looser and (self.attempt(looser[-1]).estimate or 0.0) <= self.target:
            return (*said, f"{judge}; looser ones meet the target too and take more work, by steps that are rejected")
        if not looser:
            return (*said, f"{judge}; it is the loosest that is tried for this target")
        last = self.attempt(looser[-1])
        return (*said, f"{judge}; the next looser one, {last.rtol:g}, would be off by about {last.estimate:.2g}")

    def _spent(self) -> str:
        known = [self.attempt(k) for k in sorted(self.trials)]
        judged = [attempt for attempt in known if attempt.estimate is not None]
        best = min(judged, key=lambda a: a.estimate or 0.0, default=None)
        so_far = "nothing was judged until then"
        if best is not None:
            so_far = f"the best is rtol = {best.rtol:g}, off by about {best.estimate:.2g} in {best.seconds:.2g} s"
        return (f"an error of {self.target:g} was not reached in the time given: {so_far}; "
                "give a larger error, a larger budget, or a tolerance (rtol) to run without an estimate")  # fmt: skip


def worst(found: Errors) -> float:
    """The error that a target is about: RMS and peaks, of force and sliding."""
    return max(found.force_rms, found.sliding_rms, found.force_peak, found.sliding_peak)


def _left_out(result: Result) -> str:
    """What an impact leaves out of every estimate."""
    if not any(event.kind in ("rim_contact", "landing") for event in result.events):
        return ""
    return ("the ringing after impacts, which is filtered: resolved on purpose it shifted sliding by up to 1 % in "
            "other scenes (docs/accuracy.md)")  # fmt: skip


def _report_method(scene: Scene) -> tuple[str, ...]:
    """What the report's method would take, at its pace over half a second."""
    try:
        burst = run_native("dopri5", scene, 1e-3, 0.5, repeats=0)
    except InputError as error:
        return (f"dopri5 cannot run this scene: {error}",)
    if burst.finished:
        return (f"dopri5, the report's method, takes {burst.seconds:.2g} s at rtol 1e-3",)
    if burst.status != CUT_OFF or not burst.reached:
        return (f"dopri5, the report's method, fails here: {burst.message}",)
    return (f"dopri5, the report's method, follows the ringing: about {burst.expected_seconds:.2g} s at its pace over "
            f"the first {burst.reached:.2g} s of motion",)  # fmt: skip


