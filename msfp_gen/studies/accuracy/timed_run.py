"""One run of a study of accuracy, as a `Trial`: its cost, the compared histories, and its error against a reference."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.simulation.simulate import simulate
from msfp_gen.studies.batch import OUT_OF_TIME, run_to_end

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene

ERRORS = {
    "force_max": "top force, maximum",
    "force_rms": "top force, RMS",
    "sliding_max": "sliding, maximum",
    "sliding_rms": "sliding, RMS",
}
ROWS = 2000  # intervals between the instants at which runs are compared
QUICK, REPEATS = 0.1, 5  # a run shorter than the first [s] is timed as often as the second; the fastest counts
CUT_OFF, REFUSED, OK = "cut off", "refused", "ok"


@dataclass(frozen=True)
class Errors:
    """Errors of one run [-]: of the horizontal top force over its peak, of sliding over its peak on any surface.

    Attributes:
        force_max, sliding_max: at the worst instant; of sliding, of the worst surface.
        force_rms, sliding_rms: RMS over time; of sliding, of the worst surface.
        force_peak, sliding_peak: of the peak value, whenever it occurs.

    Errors of sliding are NaN for a run without sliding displacements.
    """

    force_max: float
    force_rms: float
    sliding_max: float
    sliding_rms: float
    force_peak: float
    sliding_peak: float

    @property
    def worst_rms(self) -> float:
        """The larger of the RMS errors of force and sliding [-]."""
        return float(np.fmax(self.force_rms, self.sliding_rms))

    def as_dict(self) -> dict[str, float]:
        """Name -> error."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class Reference:
    """The run that errors are measured against, and the run that confirms it.

    Attributes:
        trial: the reference run.
        second: the confirming run, or None.
        floor: difference of the two runs, below which errors are unknown; None without a second run.
        independent: whether the two runs are by methods of different families.
    """

    trial: Trial
    second: Trial | None
    floor: Errors | None
    independent: bool = True


def errors(trial: Trial, reference: Trial) -> Errors | None:
    """Errors of `trial` against `reference` over the common rows; None if there are none.

    Raises InputError if force or sliding of the reference are zero, so that relative errors are undefined.
    """
    rows = min(len(trial.force), len(reference.force))
    if not rows:
        return None
    force = np.linalg.norm(trial.force[:rows] - reference.force[:rows], axis=1)
    computed = trial.sliding if trial.sliding.shape[1] else np.full((rows, 1), np.nan)
    sliding = np.abs(computed[:rows] - reference.sliding[:rows])
    peak_force, peak_sliding = _peaks(reference)
    if not peak_force or not peak_sliding:
        raise InputError("scene: the bearing did not move, so relative errors are not defined; give it a motion")
    return Errors(
        float(force.max() / peak_force),
        float(_rms(force) / peak_force),
        float(sliding.max() / peak_sliding),
        float(_rms(sliding).max() / peak_sliding),
        abs(_peaks(trial)[0] / peak_force - 1),
        abs(_peaks(trial)[1] / peak_sliding - 1),
    )


def largest_error(differences: Errors) -> float:
    """The relative error that a target bounds: the largest of the RMS and peak errors of force and sliding [-]."""
    return max(differences.force_rms, differences.sliding_rms, differences.force_peak, differences.sliding_peak)


def _peaks(trial: Trial) -> tuple[float, float]:
    """Peak horizontal force [N] and largest sliding displacement [m], NaN for a run without sliding."""
    sliding = float(trial.sliding.max()) if trial.sliding.size else float("nan")
    return float(np.linalg.norm(trial.force, axis=1).max()), sliding


def _rms(values: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(np.square(values), axis=0)))


def best_reference(trials: Iterable[Trial], families: dict[str, str]) -> Reference:
    """The two runs that agree best among the tightest finished runs of all methods; the tighter is the reference.

    Two runs of different families are preferred. Without these, two methods of one family or two tolerances of one
    method are used: the floor is then a lower bound, and `Reference.independent` is false.

    Args:
        trials: runs of one scene.
        families: method -> family.

    Raises:
        RunError: no run finished.
    """
    finished = sorted((t for t in trials if t.finished), key=lambda t: t.rtol)
    if not finished:
        raise RunError("no run reached the end in the time given: raise the limit or shorten the scene", status="limit")
    tightest = list({trial.method: trial for trial in reversed(finished)}.values())
    pairs = list(combinations(sorted(tightest, key=lambda t: t.rtol), 2))
    independent = [pair for pair in pairs if families[pair[0].method] != families[pair[1].method]]
    candidates = independent or pairs or [(finished[0], second) for second in finished[1:2]]
    if not candidates:
        return Reference(finished[0], None, None, independent=False)
    known = ((errors(second, first), first, second) for first, second in candidates)
    compared = [(floor, first, second) for floor, first, second in known if floor is not None]
    floor, first, second = min(compared, key=lambda pair: pair[0].worst_rms)  # finished runs have rows
    return Reference(first, second, floor, independent=bool(independent))


@dataclass(frozen=True, eq=False)
class Trial:
    """One run by one method at one tolerance.

    Attributes:
        method: name of the method or model.
        rtol: relative tolerance [-]; the step [s] if `stepped`.
        status: "ok", "cut off" (by the time limit), "refused" (the method cannot run this scene), or the failure.
        seconds: wall time of the integration [s], for a run that was cut off until then.
        reached, end: simulated time at the end of the run, and end of the scene [s].
        newton: number of Newton iterations on the equations of motion, in all loops.
        evaluations, steps: numbers of evaluations of the equations, and of accepted steps.
        force: horizontal force on the top support at the first K of `comparison_times(end)`, shape (K, 2) [N].
        sliding: sliding of every surface at these times, shape (K, n-1) [m].
        message: one line about a failure.
        stepped: whether the method has no error control.
    """

    method: str
    rtol: float
    status: str
    seconds: float
    reached: float
    end: float
    newton: int
    evaluations: int
    steps: int
    force: Array
    sliding: Array
    message: str = ""
    stepped: bool = False

    @property
    def setting(self) -> str:
        """The tolerance, or for a stepped method the step with its unit, as text."""
        return f"{self.rtol:.3g} s" if self.stepped else f"{self.rtol:g}"

    @property
    def finished(self) -> bool:
        """Whether the run reached its end."""
        return self.status == OK

    @property
    def expected_seconds(self) -> float:
        """Wall time of the whole run [s]; for a run that was cut off, extrapolated from the simulated time reached."""
        if self.status != CUT_OFF or not self.reached:
            return self.seconds
        return self.seconds * self.end / self.reached


def comparison_times(end: float) -> Array:
    """Instants at which runs are compared [s], shape (ROWS + 1,)."""
    return np.linspace(0.0, end, ROWS + 1)


def refused_trial(method: str, rtol: float, scene: Scene, why: str) -> Trial:
    """The trial of a method that cannot run a scene. why: its message."""
    empty = np.zeros((0, 2)), np.zeros((0, scene.bearing.layout.surfaces))
    return Trial(method, rtol, REFUSED, 0.0, 0.0, scene.end, 0, 0, 0, *empty, message=why)


def require_base_motion_only(scene: Scene) -> None:
    """Raise InputError for a scene with a load or a rotation of the top, which the calling method would ignore."""
    for name in ("load", "top_rotation"):
        if getattr(scene, name) is not None:
            raise InputError(f"{name}: this method applies the motion of the base only; leave {name} or the method out")


def run_native(name: str, scene: Scene, rtol: float, limit: float, repeats: int = REPEATS) -> Trial:
    """Run `scene` by a method of the compiled runtime at `rtol`, for at most about `limit` seconds of wall time.

    repeats: number of repetitions of a run shorter than QUICK, for its time. Raises InputError if the method cannot run
    the scene.
    """
    solver = replace(scene.solver, method=cast("Any", name), rtol=rtol, atol_angle=None)
    sampled = replace(scene, solver=solver, output_step=scene.end / ROWS)
    try:
        result = run_to_end(sampled, seconds=limit)
        status, message = OK if result.succeeded else result.status, result.message
    except RunError as error:
        result, status, message = None, error.status or "failed", str(error)
        if status == OUT_OF_TIME:
            result, status, message = error.result, CUT_OFF, f"cut off after {limit:g} s"
        if result is None:
            return replace(refused_trial(name, rtol, scene, message), status=status)
    if status == "interrupted":  # by the user
        raise RunError(message, status=status, result=result)
    counters = result.counters
    if repeats and status == OK and counters.wall_time < QUICK:
        unsampled = replace(scene, solver=solver, output_step=None)
        seconds = min(simulate(unsampled).counters.wall_time for _ in range(repeats))
        counters = replace(counters, wall_time=seconds)
    history = result.history
    return Trial(
        method=name,
        rtol=rtol,
        status=status,
        seconds=counters.wall_time,
        reached=scene.end if status == OK else float(history.time[-1]),
        end=scene.end,
        newton=counters.newton_iterations,
        evaluations=counters.evaluations,
        steps=counters.steps,
        force=history.top_force[:, :2],
        sliding=history.sliding,
        message=message,
    )


def dopri5_cost(scene: Scene) -> tuple[str, ...]:
    """The cost of the method of PEER 2017/07 as text, extrapolated from half a second of wall time."""
    try:
        trial = run_native("dopri5", scene, 1e-3, 0.5, repeats=0)
    except InputError as error:
        return (f"dopri5 cannot run this scene: {error}",)
    if trial.finished:
        return (f"dopri5, the method of PEER 2017/07, takes {trial.seconds:.2g} s at rtol 1e-3",)
    if trial.status != CUT_OFF or not trial.reached:
        return (f"dopri5, the method of PEER 2017/07, fails here: {trial.message}",)
    return (
        f"dopri5, the method of PEER 2017/07, resolves the ringing: about {trial.expected_seconds:.2g} s at its rate "
        f"over the first {trial.reached:.2g} s of motion",
    )
