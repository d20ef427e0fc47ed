"""The methods of integration that are compared, as a table, and SciPy's integrators on the same equations."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.model.model import build_model
from msfp_gen.studies.accuracy.timed_run import (
    CUT_OFF,
    OK,
    Trial,
    comparison_times,
    refused_trial,
    require_base_motion_only,
    run_native,
)

if TYPE_CHECKING:
    from msfp_gen.model.model import Ode
    from msfp_gen.scene.scene import Scene

FIRST_STEP = 1e-4  # [s], as in the runtime; the first step that some integrators choose leaves the model's range
WITH_JACOBIAN = ("Radau", "BDF", "LSODA")


@dataclass
class Work:
    """Cost of a run so far: evaluations of the rates, Newton iterations within them, accepted steps."""

    evaluations: int = 0
    newton: int = 0
    steps: int = 0


def run_library(name: str, scene: Scene, rtol: float, limit: float) -> Trial:
    """Run `scene` by the SciPy integrator `name` at `rtol`, for at most about `limit` seconds of wall time.

    Absolute tolerances: a hundredth of `rtol` for angles [rad], as in `Solver`, and for their rates [rad/s]; `rtol` for
    Y and Z. No step is longer than the motion's sampling resolves, and integration restarts at each declared jump.
    Raises InputError if the model cannot be written as an ordinary differential equation.
    """
    require_base_motion_only(scene)
    if scene.modelled.uplift:
        raise InputError("effects.uplift: as_ode keeps all surfaces in contact")
    ode = build_model(scene.bearing.layout, scene.modelled).as_ode(scene.bearing, scene.motion, scene.top)
    from scipy import integrate  # imported before timing starts

    begin, work, times = time.perf_counter(), Work(), comparison_times(scene.end)
    y = _initial_state(scene, ode)
    states, status, message = [y[None]], OK, ""
    try:
        for first, last in _smooth_intervals(scene):
            solver = _solver(getattr(integrate, name), scene, ode, work, first, last, y, rtol)
            while solver.status == "running":
                states.append(_advance(solver, times, work))
                if time.perf_counter() - begin > limit:
                    raise TimeoutError
            y = solver.y
    except TimeoutError:
        status, message = CUT_OFF, f"cut off after {limit:g} s"
    except (RunError, FloatingPointError, ValueError, np.linalg.LinAlgError) as error:
        status, message = "failed", str(error)
    seconds = time.perf_counter() - begin
    rows = np.concatenate(states)[: len(times)]
    force, sliding = _force_and_sliding(ode, times, rows)
    reached = float(times[len(force) - 1])
    if status == OK and len(force) < len(times):
        status, message = "failed", f"no acceleration at t = {reached:.6g} s"
    return Trial(
        name,
        rtol,
        status,
        seconds,
        reached,
        scene.end,
        work.newton,
        work.evaluations,
        work.steps,
        force,
        sliding,
        message,
    )


def _initial_state(scene: Scene, ode: Ode) -> Array:
    if scene.initial_state is None:
        return ode.y0
    state = scene.initial_state
    return np.concatenate([np.ravel(part) for part in (state.q, state.v, state.h)]).astype(float)


def _smooth_intervals(scene: Scene) -> list[tuple[float, float]]:
    """Intervals of the run [s] between jumps of the base acceleration."""
    inside = [float(t) for t in scene.motion.jumps if 0 < t < scene.end]
    return list(pairwise([0.0, *inside, scene.end]))


def _solver(kind: Any, scene: Scene, ode: Ode, work: Work, first: float, last: float, y: Array, rtol: float) -> Any:
    started: list[bool] = []  # empty until the solver exists: a failure at the initial state is an error
    before = np.nextafter(last, first)  # at a jump the motion returns the acceleration after it

    def fun(t: float, y: Array) -> Array:
        work.evaluations += 1
        try:
            rates, iterations = ode.rates(min(t, before), y)
        except RunError:  # NaN makes most integrators try a shorter step
            if kind.__name__ == "LSODA" or not started:
                raise
            return np.full(len(y), np.nan)
        work.newton += iterations
        return rates

    def jac(t: float, y: Array) -> Array:
        return ode.jac(min(t, before), y)

    tolerance = np.full(len(y), 1e-2 * rtol)
    tolerance[6 * ode.count :] = rtol
    steps = [s for s in (scene.solver.max_step, scene.motion.max_step) if s is not None]
    options: dict[str, Any] = {"jac": jac} if kind.__name__ in WITH_JACOBIAN else {}
    solver = kind(
        fun,
        first,
        y,
        last,
        rtol=rtol,
        atol=tolerance,
        max_step=min(steps, default=np.inf),
        first_step=min(FIRST_STEP, 1e-3 * (last - first)),
        **options,
    )
    started.append(True)
    return solver


def _advance(solver: Any, times: Array, work: Work) -> Array:
    """Take one step; states at the comparison times inside it, shape (k, 8(n-1)). RunError if the solver fails."""
    message = solver.step()
    if solver.status == "failed":
        raise RunError(message or "the solver failed without a message", status="failed")
    work.steps += 1
    inside = times[(times > solver.t_old) & (times <= solver.t)]
    return solver.dense_output()(inside).T if len(inside) else np.zeros((0, len(solver.y)))


def _force_and_sliding(ode: Ode, times: Array, states: Array) -> tuple[Array, Array]:
    """Horizontal force on the top support [N], shape (k, 2), and sliding [m], shape (k, n-1), of `states`.

    The rows end before the first state at which no acceleration is found.
    """
    force, sliding = np.zeros((len(states), 2)), np.zeros((len(states), ode.count))
    for row, (t, y) in enumerate(zip(times, states, strict=False)):
        try:
            observed = ode.observe(t, y)
        except RunError:
            return force[:row], sliding[:row]
        force[row], sliding[row] = observed["top_force"][:2], observed["sliding"]
    return force, sliding


@dataclass(frozen=True)
class Method:
    """A method of integration.

    Attributes:
        name: as in options and output.
        family: methods of one family share their formulas or their code, so their agreement confirms little.
        about: one line of description.
        run: (scene, rtol, limit of wall time [s]) -> Trial; raises InputError if it cannot run the scene.
    """

    name: str
    family: str
    about: str
    run: Callable[[Scene, float, float], Trial]

    def attempt(self, scene: Scene, rtol: float, limit: float) -> Trial:
        """Run `scene`; a scene that the method cannot run gives a trial with status "refused"."""
        try:
            return self.run(scene, rtol, limit)
        except InputError as error:
            return refused_trial(self.name, rtol, scene, str(error))


def _native(name: str, family: str, about: str) -> Method:
    return Method(name, family, about, partial(run_native, name))


def _library(name: str, about: str) -> Method:
    return Method(name, name, f"SciPy: {about}", partial(run_library, name))


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        _native("implicit", "implicit", "the default: TR-BDF2, order 2, L-stable"),
        _native("esdirk4", "implicit", "ESDIRK4(3), order 4, L-stable: the same condensed equations and Newton steps"),
        _native("dopri5", "dopri5", "PEER 2017/07: Dormand-Prince 5(4), Newton on all 6(n-1) balances"),
        _library("Radau", "Radau IIA, order 5, L-stable"),
        _library("BDF", "backward differences, orders 1 to 5"),
        _library("LSODA", "Adams and backward differences, switching"),
        _library("DOP853", "Dormand-Prince 8(5,3), explicit"),
    )
}


def methods_named(names: list[str] | None) -> list[Method]:
    """Methods by name; all of them for None. Raises InputError for an unknown name."""
    for name in names or ():
        if name not in METHODS:
            raise InputError(f"methods = {name!r}: give some of {', '.join(METHODS)}")
    return [METHODS[name] for name in names or METHODS]
