"""One run of a study: what it cost, how far it came, and what of it is compared."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from msfp_gen.errors import InputError, RunError
from msfp_gen.history import Array, Counters
from msfp_gen.simulation import simulate

if TYPE_CHECKING:
    from msfp_gen.result import Result
    from msfp_gen.scene import Scene

ROWS = 2000  # instants at which runs are compared
QUICK, REPEATS = 0.1, 5  # [s]: shorter runs are timed several times, and the fastest counts
CUT_OFF, REFUSED, OK = "cut off", "refused", "ok"


@dataclass(frozen=True, eq=False)
class Trial:
    """One run by one method at one tolerance.

    status: "ok", "cut off" (the time limit), "refused" (the method cannot run this scene) or how the run failed;
    message: one line in words. seconds: wall time of the integration [s], of a run that was cut off what it had taken.
    reached, end: time simulated and asked for [s]. newton: iterations of Newton's method on the equations of motion, in
    whatever loop; evaluations of them; steps accepted. force: horizontal force on the top support, ndarray, shape
    (K, 2), [N]; sliding of every surface, shape (K, n-1), [m]: at the first K of `grid(end)`. stepped: there is no
    error control, and `rtol` is the step [s].
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
        """The tolerance, or the step with its unit."""
        return f"{self.rtol:.3g} s" if self.stepped else f"{self.rtol:g}"

    @property
    def finished(self) -> bool:
        """Whether the run reached its end."""
        return self.status == OK

    @property
    def expected_seconds(self) -> float:
        """Wall time of the whole run [s]: measured, or of a run that was cut off at the pace it had until then."""
        if self.status != CUT_OFF or not self.reached:
            return self.seconds
        return self.seconds * self.end / self.reached


def grid(end: float) -> Array:
    """Instants of comparison, ndarray, shape (ROWS + 1,), [s]."""
    return np.linspace(0.0, end, ROWS + 1)


def refused(method: str, rtol: float, scene: Scene, why: str) -> Trial:
    """The trial of a method that cannot run this scene."""
    nothing = np.zeros((0, 2)), np.zeros((0, scene.bearing.layout.surfaces))
    return Trial(method, rtol, REFUSED, 0.0, 0.0, scene.end, 0, 0, 0, *nothing, message=why)


class _OutOfTime(KeyboardInterrupt):
    """Ends a run as Ctrl-C does: what was computed until then is kept."""


def watch(limit: float) -> Callable[[float, float], None]:
    """What `simulate` calls now and then; it ends the run after `limit` seconds."""
    begin = time.perf_counter()

    def look(reached: float, end: float) -> None:
        if time.perf_counter() - begin > limit and reached < end:
            raise _OutOfTime

    return look


def base_alone(scene: Scene) -> None:
    """Raise InputError where more than the base drives a scene: methods of others would leave it out unsaid."""
    for name in ("load", "top_rotation"):
        if getattr(scene, name) is not None:
            raise InputError(f"{name}: this method follows the motion of the base alone; leave {name} out, or it")


def run_native(name: str, scene: Scene, rtol: float, limit: float, repeats: int = REPEATS) -> Trial:
    """`scene` by a method of the compiled runtime at `rtol`, for at most about `limit` seconds.

    repeats: of runs too quick to be timed once; 0: none. Raises InputError where the method cannot run the scene.
    """
    solver = replace(scene.solver, method=cast(Any, name), rtol=rtol, atol_angle=None)
    compared = replace(scene, solver=solver, output_step=scene.end / ROWS)
    result, status, message = _attempt(compared, limit)
    if result is None:
        return replace(refused(name, rtol, scene, message), status=status)
    counters = result.counters
    if repeats and status == OK and counters.wall_time < QUICK:
        plain = replace(scene, solver=solver, output_step=None)
        seconds = min(simulate(plain).counters.wall_time for _ in range(repeats))
        counters = replace(counters, wall_time=seconds)
    return _trial(name, rtol, scene, result, counters, status, message)


def _attempt(scene: Scene, limit: float) -> tuple[Result | None, str, str]:
    """What there is of the run, its status and why it ended."""
    from msfp_gen.result import Result

    started = time.perf_counter()
    try:
        return simulate(scene, progress=watch(limit)), OK, ""
    except RunError as error:
        result = error.result if isinstance(error.result, Result) else None
        if error.status != "interrupted":
            return result, error.status or "failed", str(error)
        if time.perf_counter() - started < limit:
            raise  # a person's Ctrl-C
        return result, CUT_OFF, f"cut off after {limit:g} s"


def _trial(
    name: str, rtol: float, scene: Scene, result: Result, counters: Counters, status: str, message: str
) -> Trial:
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
