"""The methods and simplified models of a study of accuracy, each as a function from a scene to a trial.

Integrators of SciPy on the same equations are here; `series.py` has the models of other programs.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.model.model import build_model
from msfp_gen.studies.accuracy.series import run_opensees, run_series
from msfp_gen.studies.accuracy.timed_run import (
    CUT_OFF,
    OK,
    Trial,
    comparison_times,
    of_bearing,
    refused_trial,
    require_base_motion_only,
    run_native,
)

if TYPE_CHECKING:
    from msfp_gen.model.model import Ode
    from msfp_gen.scene.scene import Scene
    from msfp_gen.scene.system import System

FIRST_STEP = 1e-4  # [s], as in the runtime; some integrators choose a first step that leaves the range of the model
WITH_JACOBIAN = ("Radau", "BDF", "LSODA")


@dataclass
class Work:
    """Cost of a run so far.

    evaluations: of the rates. newton: Newton iterations of these evaluations. steps: accepted steps.
    """

    evaluations: int = 0
    newton: int = 0
    steps: int = 0


def run_library(name: str, system: System, rtol: float, limit: float) -> Trial:
    """Run one bearing by the SciPy integrator `name` at `rtol`, for at most about `limit` seconds of wall time.

    Absolute tolerances: a hundredth of `rtol` for angles [rad], as in `Solver`, and for angular rates [rad/s]; `rtol`
    for Y and Z. No step is longer than the sampling of the motion resolves, and integration restarts at each declared
    jump. Raises InputError if the model cannot be written as an ordinary differential equation.
    """
    scene = require_base_motion_only(system)
    if scene.modelled.uplift:
        raise InputError("effects.uplift: library integrators are compared without it; leave it out")
    ode = build_model(scene.bearing.layout, scene.modelled).as_ode(scene.bearing, scene.motion, scene.top)
    from scipy import integrate  # imported before timing starts

    begin, work, times = time.perf_counter(), Work(), comparison_times(scene.end)
    y, start = ode.y0, scene.initial_state
    if start is not None:
        y = np.concatenate([np.ravel(part) for part in (start.q, start.v, start.h)]).astype(float)
    states, status, message = [y[None]], OK, ""
    jumps = [float(t) for t in scene.motion.jumps if 0 < t < scene.end]  # of the base acceleration
    try:
        for first, last in pairwise([0.0, *jumps, scene.end]):
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
    cost = work.newton, work.evaluations, work.steps
    return Trial(name, rtol, status, seconds, reached, scene.end, *cost, of_bearing(force, sliding), message)


def _solver(kind: Any, scene: Scene, ode: Ode, work: Work, first: float, last: float, y: Array, rtol: float) -> Any:
    """A solver of class `kind` of SciPy from time `first` to `last` [s], from state y; it counts its cost in `work`."""
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
    options |= {"max_step": min(steps, default=np.inf), "first_step": min(FIRST_STEP, 1e-3 * (last - first))}
    solver = kind(fun, first, y, last, rtol=rtol, atol=tolerance, **options)
    started.append(True)
    return solver


def _advance(solver: Any, times: Array, work: Work) -> Array:
    """Take one step; returns the states at the comparison times within it, shape (k, 8(n-1)). Raises RunError."""
    message = solver.step()
    if solver.status == "failed":
        raise RunError(message or "the solver failed without a message", status="failed")
    work.steps += 1
    inside = times[(times > solver.t_old) & (times <= solver.t)]
    return solver.dense_output()(inside).T if len(inside) else np.zeros((0, len(solver.y)))


def _force_and_sliding(ode: Ode, times: Array, states: Array) -> tuple[Array, Array]:
    """Horizontal force on the top support, shape (k, 2) [N], and sliding, shape (k, n-1) [m], of `states`."""
    # The rows end before the first state at which no acceleration is found.
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
    """A method of integration, or a simplified model by the default method.

    Attributes:
        name: as in options, tables and figures.
        family: methods of one family share their formulas or their code, so that their agreement confirms little.
        run: (scene, setting, limit of wall time [s]) -> Trial; raises InputError where the method cannot run the scene.
        stepped: whether the method has no error control; its settings are then numbers of steps, else tolerances.
    """

    name: str
    family: str
    run: Callable[[System, Any, float], Trial]
    stepped: bool = False

    def attempt(self, scene: System, setting: float, limit: float) -> Trial:
        """Run `scene`. The status of the trial is "refused" where the method cannot run the scene.

        The trial of a run that fails states the failure. Raises RunError where the user interrupts.
        """
        try:
            return replace(self.run(scene, setting, limit), method=self.name)
        except (InputError, RunError) as error:
            if isinstance(error, RunError) and error.status == "interrupted":
                raise
            rtol = scene.end / setting if self.stepped else setting
            trial = replace(refused_trial(self.name, rtol, scene, str(error)), stepped=self.stepped)
            return trial if isinstance(error, InputError) else replace(trial, status=error.status or "failed")


# Method of the compiled runtime -> its family.
NATIVE = {
    "implicit": "implicit",  # the default: TR-BDF2, order 2, L-stable
    "esdirk4": "implicit",  # ESDIRK4(3), order 4, L-stable: the same condensed equations and Newton steps
    "dopri5": "dopri5",  # PEER 2017/07: Dormand-Prince 5(4), Newton on all 6(n-1) balances
}
LIBRARY = (
    "Radau",  # Radau IIA, order 5, L-stable
    "BDF",  # backward differences, orders 1 to 5
    "LSODA",  # Adams and backward differences, switching
    "DOP853",  # Dormand-Prince 8(5,3), explicit
)  # of SciPy, each a family of its own
METHODS = {name: Method(name, family, partial(run_native, name)) for name, family in NATIVE.items()}
METHODS |= {name: Method(name, name, partial(run_library, name)) for name in LIBRARY}


def methods_named(names: list[str] | None) -> list[Method]:
    """Methods by name; None: all. Raises InputError for an unknown name."""
    for name in names or ():
        if name not in METHODS:
            raise InputError(f"methods = {name!r}: give some of {', '.join(METHODS)}")
    return [METHODS[name] for name in names or METHODS]


def _effects(name: str, **changes: Any) -> Method:
    """A simplified model: other effects, by the default method."""
    return Method(name, "implicit", partial(_with_effects, changes))


def _stepped(name: str, run: Callable[[System, int], Trial]) -> Method:
    """A model without error control. run: (scene, number of steps) -> Trial."""
    return Method(name, name, lambda scene, steps, _: run(scene, steps), stepped=True)


def _with_effects(changes: dict[str, Any], scene: System, rtol: float, limit: float) -> Trial:
    """Run the scene by the default method with other effects."""
    if all(getattr(effects, name) == value for effects in scene.every_effects for name, value in changes.items()):
        raise InputError(f"the scene itself has {', '.join(f'{name} = {value!r}' for name, value in changes.items())}")
    scenes = scene.along_axes() if changes.get("dimension") == "planar" else (scene,)
    return _combined([run_native("implicit", one.with_effects(**changes), rtol, limit) for one in scenes])


def _combined(trials: list[Trial]) -> Trial:
    """One run, or the uncoupled runs of one bearing along both horizontal axes as one."""
    if len(trials) == 1:
        return trials[0]
    along_x, along_y = trials
    worse = max(along_x, along_y, key=lambda trial: not trial.finished)
    rows = min(along_x.rows, along_y.rows)
    x, y = ({name: values[:rows, :, 0] for name, values in one.histories.items()} for one in (along_x, along_y))
    costs = ("seconds", "newton", "evaluations", "steps")
    sums = {name: getattr(along_x, name) + getattr(along_y, name) for name in costs}
    return replace(
        worse,
        **sums,
        reached=min(along_x.reached, along_y.reached),
        histories=of_bearing(
            np.column_stack([x["force"], along_y.histories["force"][:rows, 0, 1]]), np.hypot(x["sliding"], y["sliding"])
        )
        if rows
        else {},
    )


# Simplified models.
VARIANTS: tuple[Method, ...] = (
    _effects("planar", dimension="planar"),  # one vertical plane; a motion in two directions is run axis by axis
    _effects("massless", sliders="massless"),  # no inertia of the sliders
    _effects("no rims", rims=False),  # sliders travel beyond their capacity
    _effects("planar massless", dimension="planar", sliders="massless"),
    _stepped("linearised", run_series),  # published closed form: springs, friction and gaps in series
    _stepped("linearised, arms", partial(run_series, arms=True)),  # with friction at the radius of its surface
    _stepped("OpenSees", run_opensees),  # element TripleFrictionPendulum
)
