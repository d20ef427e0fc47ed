"""Work and precision: several methods over several tolerances on one scene, each against a confirmed reference."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from msfp_gen.accuracy.effects import full
from msfp_gen.accuracy.measure import Errors, Reference, best_reference, errors
from msfp_gen.accuracy.methods import METHODS, Method, methods_named
from msfp_gen.accuracy.trial import CUT_OFF, REFUSED, Trial
from msfp_gen.errors import InputError
from msfp_gen.simulation import simulate

if TYPE_CHECKING:
    from msfp_gen.scene import Scene

TOLERANCES = tuple(10.0**-k for k in range(2, 10))
LIMIT = 10.0  # [s] of wall time a run
MORE, CONFIRMING = 6.0, 2  # times the limit that a run may take which is to confirm the reference; how many may
TIGHTEST = 1e-11  # what a reference is asked for at most
WRONG = 30.0  # a success is wrong whose RMS error exceeds so many tolerances,
NEVER_WRONG, ALWAYS_WRONG = 1e-3, 0.1  # below the one never, above the other at any tolerance
Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Point:
    """One run in a study: the series it belongs to, what it is off by (None: unknown), and whether it lied."""

    series: str
    trial: Trial
    errors: Errors | None
    wrong: bool


@dataclass(frozen=True, eq=False)
class Study:
    """Points, what they are measured against, and what was left out and why."""

    scene: Scene
    kind: str
    points: tuple[Point, ...]
    reference: Reference
    notes: tuple[str, ...]

    def of(self, series: str) -> list[Point]:
        """The points of one series, loosest tolerance first."""
        return [point for point in self.points if point.series == series]

    @property
    def series(self) -> list[str]:
        """Names of all series in their order."""
        return list(dict.fromkeys(point.series for point in self.points))


def work_precision(
    scene: Scene,
    *,
    methods: Sequence[str] | None = None,
    tolerances: Sequence[float] = TOLERANCES,
    limit: float = LIMIT,
    say: Say = lambda line: None,
) -> Study:
    """Run `scene` by every method at every tolerance and measure what each run is off by.

    methods: names out of `METHODS`, None: all. limit: wall time of one run [s]; a run that takes longer is cut off, and
    after two of those in a row tighter tolerances of the method are not tried. say: told each run as it ends.
    Raises InputError: a tolerance, limit or method; a bearing that does not move. RunError: not one run finished.
    """
    chosen = methods_named(None if methods is None else list(methods))
    check_settings(tolerances, limit)
    scene, trials, notes = without_stop(scene), [], []
    for method in chosen:
        found, left_out = ladder(method, scene, sorted(tolerances, reverse=True), limit, say)
        trials += found
        notes += left_out
    trials = completed(trials, affordable(scene, trials, limit, say))
    reference = best_reference([*trials, *tighter(scene, trials, limit, say)], families())
    return Study(scene, "work-precision", points_of(trials, reference), reference, (*notes, *doubts(reference)))


def check_settings(tolerances: Sequence[float], limit: float) -> None:
    """InputError for a tolerance or a limit that makes no sense."""
    for rtol in tolerances:
        if not 1e-12 <= rtol < 1:
            raise InputError(f"tolerances = {rtol:g}: give numbers from 1e-12 to below 1, such as 1e-2,1e-4")
    if not tolerances:
        raise InputError("tolerances: none given; give some such as 1e-2,1e-4")
    if not 0 < limit < float("inf"):
        raise InputError(f"limit = {limit:g}: give seconds above zero")


def families() -> dict[str, str]:
    """Method -> family."""
    return {name: method.family for name, method in METHODS.items()}


def without_stop(scene: Scene) -> Scene:
    """The scene up to where its stop would end it: SciPy's integrators know nothing of stops.

    Effects that would be chosen are all modelled, so that no run changes them on its way and every method can take it.
    """
    scene = full(scene)
    if scene.stop is None:
        return scene
    end = float(simulate(replace(scene, output_step=None)).history.time[-1])
    return replace(scene, stop=None, duration=end)


def ladder(
    method: Method, scene: Scene, tolerances: Sequence[float], limit: float, say: Say
) -> tuple[list[Trial], list[str]]:
    """One method from loose to tight, and what was left out."""
    trials: list[Trial] = []
    for count, rtol in enumerate(tolerances):
        trial = method.attempt(scene, rtol, limit)
        trials.append(trial)
        say(told(trial))
        if trial.status == REFUSED:
            return [], [f"{method.name} cannot run this scene: {trial.message}"]
        if len(trials) > 1 and all(t.status == CUT_OFF for t in trials[-2:]) and count + 1 < len(tolerances):
            return trials, [f"{method.name}: cut off twice, so tighter than {rtol:g} was not tried"]
    return trials, []


def told(trial: Trial) -> str:
    """A trial in one line."""
    outcome = trial.status if trial.finished else f"{trial.status} at t = {trial.reached:.4g} of {trial.end:.4g} s"
    return f"{trial.method} at {trial.setting}: {outcome}, {trial.seconds:.3g} s"


def tighter(scene: Scene, trials: Sequence[Trial], limit: float, say: Say, name: str = "implicit") -> list[Trial]:
    """Runs of one method beyond the tightest that finished, as long as they finish too: for a reference."""
    done = [t.rtol for t in trials if t.method == name and t.finished]
    rtol, found = min(done, default=1e-2) / 10, []
    while rtol > TIGHTEST:
        trial = METHODS[name].attempt(scene, rtol, limit)
        say(f"reference: {told(trial)}")
        if not trial.finished:
            break
        found.append(trial)
        rtol /= 10
    return found


def affordable(scene: Scene, trials: Sequence[Trial], limit: float, say: Say) -> list[Trial]:
    """Runs that were cut off, taken to their end for a reference: of the methods that would end first the tightest."""
    soon = [t for t in trials if t.status == CUT_OFF and 1.3 * t.expected_seconds < MORE * limit]
    tightest = {t.method: t for t in sorted(soon, key=lambda t: -t.rtol)}
    found = []
    for trial in sorted(tightest.values(), key=lambda t: t.expected_seconds)[:CONFIRMING]:
        found.append(METHODS[trial.method].attempt(scene, trial.rtol, MORE * limit))
        say(f"reference: {told(found[-1])}")
    return found


def completed(trials: Sequence[Trial], ended: Sequence[Trial]) -> list[Trial]:
    """`trials` with those that were taken to their end after all in place of what was cut off."""
    known = {(trial.method, trial.rtol): trial for trial in ended}
    return [known.get((trial.method, trial.rtol), trial) for trial in trials]


def points_of(trials: Sequence[Trial], reference: Reference) -> tuple[Point, ...]:
    """Trials with their errors; the reference itself has none."""
    return tuple(point_of(trial.method, trial, reference) for trial in trials)


def point_of(series: str, trial: Trial, reference: Reference) -> Point:
    """One trial as a point of a series."""
    found = errors(trial, reference.trial) if trial.finished and trial is not reference.trial else None
    return Point(series, trial, found, found is not None and is_wrong(trial, found, reference))


def is_wrong(trial: Trial, found: Errors, reference: Reference) -> bool:
    """Whether a run claimed success and its RMS error is far above its tolerance, and above what is known."""
    if reference.floor is None:
        return False
    known = 3 * reference.floor.worst_rms
    return trial.finished and found.worst_rms > max(min(WRONG * trial.rtol, ALWAYS_WRONG), NEVER_WRONG, known)


def doubts(reference: Reference) -> list[str]:
    """What a reader should know of the reference."""
    if reference.second is None or reference.floor is None:
        return ["only one run reached the end: nothing confirms the reference"]
    if not reference.independent:
        return ["only one family of methods reached the end: the reference is confirmed by its own kind alone"]
    if reference.floor.worst_rms > 1e-2:
        return [f"the two references differ by {reference.floor.worst_rms:.1%} RMS: no error below that means anything"]
    return []
