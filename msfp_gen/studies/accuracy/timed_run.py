"""One run of a study of accuracy, as a `Trial`: its cost, the compared histories, and its error against a reference."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from math import nan
from typing import Any, NamedTuple, cast

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.system import System, require_field
from msfp_gen.simulation.simulate import simulate
from msfp_gen.studies.batch import OUT_OF_TIME, run_to_end

ROWS = 2000  # intervals between the instants at which runs are compared
QUICK, REPEATS = 0.1, 5  # a run shorter than the first [s] is timed as often as the second; the fastest counts
CUT_OFF, REFUSED, OK = "cut off", "refused", "ok"


class Error(NamedTuple):
    """Errors of one quantity over its peak at any place [-].

    max: at the worst instant of the worst place. rms: over time, of the worst place. peak: of the peak value, whenever
    it occurs. NaN for a run that does not compute the quantity.
    """

    max: float
    rms: float
    peak: float


UNKNOWN = Error(nan, nan, nan)


@dataclass(frozen=True)
class Errors:
    """Errors of one run. parts: quantity, as in `Trial.histories` -> its errors."""

    parts: Mapping[str, Error]

    def __getitem__(self, quantity: str) -> Error:
        """The errors of a quantity."""
        return self.parts[quantity]

    @property
    def worst_rms(self) -> float:
        """The largest RMS error [-]."""
        return _largest(error.rms for error in self.parts.values())

    @property
    def largest(self) -> float:
        """The relative error that a target bounds: the largest of the RMS errors and the errors of peaks [-]."""
        return _largest(value for error in self.parts.values() for value in (error.rms, error.peak))

    def as_dict(self) -> dict[str, float]:
        """Quantity and kind of error, such as force_rms -> error."""
        return {f"{name}_{kind}": value for name, one in self.parts.items() for kind, value in one._asdict().items()}


def _largest(values: Iterable[float]) -> float:
    return float(np.fmax.reduce([nan, *values]))


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
    """Errors of `trial` against `reference` at the times of the one with fewer rows; None if there are none.

    Raises InputError if a quantity of the reference is zero at all times, so that relative errors are undefined.
    """
    if not min(trial.rows, reference.rows):
        return None
    at = min(trial.instants, reference.instants, key=len)  # straight lines between many rows are short
    at = at[at <= min(trial.instants[-1], reference.instants[-1])]
    found, exact = (
        {name: _at(at, one.instants, values) for name, values in one.histories.items()} for one in (trial, reference)
    )
    return Errors({name: _error(found.get(name), values, len(at)) for name, values in exact.items()})


def _at(at: Array, times: Array, values: Array) -> Array:
    """The values of all times where the others are the first of them, and else at the others, by straight lines."""
    if np.array_equal(at, times[: len(at)]):
        return values
    flat = [np.interp(at, times, column) for column in values.reshape(len(times), -1).T]
    return np.column_stack(flat).reshape(len(at), *values.shape[1:])


def _error(found: Array | None, exact: Array, rows: int) -> Error:
    """Errors of one quantity over the first rows. found: None where it was not computed."""
    peak = _peak(exact)
    if not peak:
        raise InputError("scene: nothing moved, so relative errors are not defined; give it a motion")
    if found is None:
        return UNKNOWN
    away = np.linalg.norm(found[:rows] - exact[:rows], axis=2) / peak
    rms = np.sqrt(np.mean(np.square(away), axis=0))
    return Error(float(away.max()), float(rms.max()), abs(_peak(found) / peak - 1))


def _peak(history: Array) -> float:
    """Largest magnitude at any time and place."""
    return float(np.linalg.norm(history, axis=2).max())


def of_bearing(force: Array, sliding: Array) -> dict[str, Array]:
    """The histories of a trial of one bearing.

    force: horizontal force on the top support, ndarray, shape (k, 2) [N]. sliding: of every surface, shape (k, n-1)
    [m]; shape (k, 0) where it is not computed.
    """
    return {"force": force[:, None]} | ({"sliding": sliding[:, :, None]} if sliding.shape[1] else {})


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
        evaluations, steps: numbers of evaluations of the equations, 0 of a building, and of accepted steps.
        histories: quantity -> its values at the first K instants, shape (K, places, components) [SI]; {} for a run
            without rows.
        message: one line about a failure.
        stepped: whether the method has no error control.
        times: the instants [s], shape (K,); None: the first of `comparison_times(end)`.
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
    histories: Mapping[str, Array]
    message: str = ""
    stepped: bool = False
    times: Array | None = None

    @property
    def instants(self) -> Array:
        """The instants of the histories [s], shape (K,)."""
        return comparison_times(self.end)[: self.rows] if self.times is None else self.times[: self.rows]

    @property
    def setting(self) -> str:
        """The tolerance, or for a stepped method the step with its unit, as text."""
        return f"{self.rtol:.3g} s" if self.stepped else f"{self.rtol:g}"

    @property
    def rows(self) -> int:
        """Number of instants at which the run can be compared."""
        return min((len(values) for values in self.histories.values()), default=0)

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


def refused_trial(method: str, rtol: float, system: System, why: str) -> Trial:
    """The trial of a method that cannot run a system. why: its message."""
    return Trial(method, rtol, REFUSED, 0.0, 0.0, system.end, 0, 0, 0, {}, message=why)


def require_base_motion_only(system: System) -> Scene:
    """The scene of one bearing that the base moves; methods outside the runtime ignore all else.

    Raises InputError for another system, and for a scene with a load or a rotation of the top.
    """
    if not isinstance(system, Scene):
        raise InputError("this method runs one bearing alone")
    for name in ("load", "top_rotation"):
        if getattr(system, name) is not None:
            raise InputError(f"{name}: this method applies the motion of the base only; leave {name} or the method out")
    return system


def check_measurable(system: System) -> None:
    """Raise InputError for a system whose tolerance cannot be chosen."""
    require_field(system, "solver", "no error can be measured without it; use simulate alone")


def run_native(name: str, system: System, rtol: float, limit: float, repeats: int = REPEATS) -> Trial:
    """Run a system by a method of the compiled runtime at `rtol`, for at most about `limit` seconds of wall time.

    repeats: number of repetitions of a run shorter than QUICK, for its time. Raises InputError if the method cannot run
    the system, or the tolerance of the system cannot be chosen.
    """
    check_measurable(system)
    solver = replace(system.solver, method=cast("Any", name), rtol=rtol, atol_angle=None)
    rows = {"output_step": system.end / ROWS} if system.rows_between_steps else {}
    sampled = replace(system, solver=solver, **rows)
    try:
        result = run_to_end(sampled, seconds=limit)
        status, message = OK if result.succeeded else result.status, result.message
    except RunError as error:
        result, status, message = None, error.status or "failed", str(error)
        if status == OUT_OF_TIME:
            result, status, message = error.result, CUT_OFF, f"cut off after {limit:g} s"
        if result is None:
            return replace(refused_trial(name, rtol, system, message), status=status)
    if status == "interrupted":  # by the user
        raise RunError(message, status=status, result=result)
    work = result.work
    seconds = work["wall_time"]
    if repeats and status == OK and seconds < QUICK:
        unsampled = replace(sampled, output_step=None) if rows else sampled
        seconds = min(simulate(unsampled).work["wall_time"] for _ in range(repeats))
    return Trial(
        method=name,
        rtol=rtol,
        status=status,
        seconds=seconds,
        reached=system.end if status == OK else float(result.time[-1]),
        end=system.end,
        newton=int(work["newton_iterations"]),
        evaluations=int(work.get("evaluations", 0)),
        steps=int(work["steps"]),
        histories=result.compared,
        message=message,
        times=None if rows else result.time,
    )


def dopri5_cost(system: System) -> tuple[str, ...]:
    """The cost of the method of PEER 2017/07 as text, extrapolated from half a second of wall time."""
    try:
        trial = run_native("dopri5", system, 1e-3, 0.5, repeats=0)
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
