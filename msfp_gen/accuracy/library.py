"""Runs by the integrators of SciPy: the same equations through `model.as_ode`, stepped so that time can be watched."""

from __future__ import annotations

import time
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.accuracy.trial import CUT_OFF, OK, Trial, base_alone, grid
from msfp_gen.build import build_model
from msfp_gen.errors import InputError, RunError
from msfp_gen.history import Array

if TYPE_CHECKING:
    from msfp_gen.ode import Ode
    from msfp_gen.scene import Scene

FIRST_STEP = 1e-4  # [s], as the runtime's; left to themselves some begin with a step that leaves the model
WITH_JACOBIAN = ("Radau", "BDF", "LSODA")


@dataclass
class Work:
    """What a run has cost so far."""

    evaluations: int = 0
    newton: int = 0
    steps: int = 0


def run_library(name: str, scene: Scene, rtol: float, limit: float) -> Trial:
    """`scene` by the SciPy integrator `name` at `rtol`, for at most about `limit` seconds.

    Absolute tolerances: a hundredth of `rtol` for angles [rad], as `Solver` has it, and for their rates [rad/s];
    `rtol` for Y and Z. Steps are kept to what the motion resolves, and a run starts anew at a declared jump.
    Raises InputError where the model is no ordinary differential equation.
    """
    base_alone(scene)
    if scene.modelled.uplift:
        raise InputError("effects.uplift: as_ode keeps all surfaces closed")
    ode = build_model(scene.bearing.layout, scene.modelled).as_ode(scene.bearing, scene.motion, scene.top)
    from scipy import integrate  # loaded before the clock starts

    begin, work, times = time.perf_counter(), Work(), grid(scene.end)
    y = _start(scene, ode)
    states, status, message = [y[None]], OK, ""
    try:
        for first, last in _stretches(scene):
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
    force, sliding = _observed(ode, times, rows)
    reached = float(times[len(force) - 1])
    if status == OK and len(force) < len(times):
        status, message = "failed", f"no acceleration at t = {reached:.6g} s"
    return Trial(name, rtol, status, seconds, reached, scene.end, work.newton, work.evaluations, work.steps, force,
                 sliding, message)  # fmt: skip


def _start(scene: Scene, ode: Ode) -> Array:
    if scene.initial_state is None:
        return ode.y0
    state = scene.initial_state
    return np.concatenate([np.ravel(part) for part in (state.q, state.v, state.h)]).astype(float)


def _stretches(scene: Scene) -> list[tuple[float, float]]:
    """Pieces of the run between the jumps of the base acceleration."""
    inside = [float(t) for t in scene.motion.jumps if 0 < t < scene.end]
    ends = [0.0, *inside, scene.end]
    return list(pairwise(ends))


def _solver(kind: Any, scene: Scene, ode: Ode, work: Work, first: float, last: float, y: Array, rtol: float) -> Any:
    solving: list[bool] = []  # not yet: at the start there must be an acceleration
    before = np.nextafter(last, first)  # at a jump the acceleration is the one after it

    def fun(t: float, y: Array) -> Array:
        work.evaluations += 1
        try:
            rates, iterations = ode.rates(min(t, before), y)
        except RunError:  # no number: most integrators then try a shorter step
            if kind.__name__ == "LSODA" or not solving:
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
        fun, first, y, last, rtol=rtol, atol=tolerance, max_step=min(steps, default=np.inf),
        first_step=min(FIRST_STEP, 1e-3 * (last - first)), **options,
    )  # fmt: skip
    solving.append(True)
    return solver


def _advance(solver: Any, times: Array, work: Work) -> Array:
    """One step; states at the instants that lie in it, shape (k, 8(n-1)). RunError where the solver gives up."""
    message = solver.step()
    if solver.status == "failed":
        raise RunError(message or "the solver gave up", status="failed")
    work.steps += 1
    inside = times[(times > solver.t_old) & (times <= solver.t)]
    return solver.dense_output()(inside).T if len(inside) else np.zeros((0, len(solver.y)))


def _observed(ode: Ode, times: Array, states: Array) -> tuple[Array, Array]:
    """Horizontal force on the top support and sliding of every state, as far as they can be formed."""
    force, sliding = np.zeros((len(states), 2)), np.zeros((len(states), ode.count))
    for row, (t, y) in enumerate(zip(times, states, strict=False)):
        try:
            found = ode.observe(t, y)
        except RunError:
            return force[:row], sliding[:row]
        force[row], sliding[row] = found["top_force"][:2], found["sliding"]
    return force, sliding
