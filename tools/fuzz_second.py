"""A second method for runs: the balances of PEER 2017/07 in vector form (tests/reference) with an implicit method of its own.

Only the scene is shared with the package. Kinematics, contact, rims and friction come from `reference`, without
condensation; all unknowns (2.119) and Y, Z are solved together, with Jacobians by complex steps. The method is the
two-stage SDIRK of Alexander (1977). It repeats some rows of a run from the state of the first of them.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from reference import forces, kinematics, stack

from msfp_gen import Scene
from msfp_gen.results.history import History
from msfp_gen.scene.top import MassTop, PrescribedTop, RigTop

Array = Any
GAMMA = 1 - 1 / np.sqrt(2)
E3 = np.array([0.0, 0.0, 1.0])


class UnsolvedError(ArithmeticError):
    """The second method found no solution, so the run is not checked."""


@dataclass
class Jacobian:
    """The last Jacobian, which is reused for stages with the same beta."""

    value: Array = None
    beta: float = 0.0

    def at(self, beta: float) -> None:
        if abs(beta - self.beta) > 1e-9 * beta:
            self.value, self.beta = None, beta


@dataclass(frozen=True)
class Marched:
    """Results at rows 1.. of the window: top force (k, 3) [N], angles (k, n-1, 3) [rad], Y and Z (k, n-1, 2)."""

    force: Array
    q: Array
    f: Array


class Second:
    """The second method for one scene."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.bearing, self.top = scene, scene.bearing, scene.top
        self.count = scene.bearing.layout.surfaces
        self.inertial = scene.effects.sliders == "inertial"
        self.anchor = scene.motion.displacement(0.0)[:2]
        gravity = scene.bearing.gravity
        weight = sum(b.mass for b in self.bearing.bodies) * gravity
        loads = {
            RigTop: lambda t: t.axial_load,
            MassTop: lambda t: t.mass * gravity,
            PrescribedTop: lambda t: -t.force[2],
        }
        self.size = weight + loads[type(self.top)](self.top)

    def base(self, t: float) -> Any:
        """Motion of the base at a time."""
        u, v, a = (self.scene.motion.evaluate(t, order) for order in range(3))
        return kinematics.Base(u[:3], v[:3], a[:3], u[3:], v[3:], a[3:])

    def load(self, turn: Any, at: Any, phi: Any) -> stack.Load:
        """Force and moment of the top on the plate at r_nn."""
        n, top = self.bearing.layout.n, self.top
        t3, w, dw = turn.t[n][2], turn.w[n], turn.dw[n]
        total, dtotal = turn.w_total[n], turn.dw_total[n]
        r, v, a = (x[kinematics.joint(self.bearing, n)] for x in at)
        if isinstance(top, PrescribedTop):
            return stack.Load(np.array(top.force), np.array(top.moment))
        spring = -top.rotational_stiffness * (np.array([-t3[1], t3[0], 0 * t3[0]]) + phi * t3)
        moment = spring - top.rotational_damping * total
        if isinstance(top, RigTop):
            side = [-top.stiffness * (r[i] - self.anchor[i]) - top.damping * v[i] for i in range(2)]
            return stack.Load(np.array([*side, -top.axial_load + 0 * side[0]]), moment)
        cross = kinematics.cross
        centre = a + top.height * (cross(dw, t3) + cross(w, cross(w, t3)))
        force = -top.mass * (centre + self.bearing.gravity * E3)
        transverse, axial = top.inertia
        t1, t2, _ = turn.t[n]
        J = transverse * (np.outer(t1, t1) + np.outer(t2, t2)) + axial * np.outer(t3, t3)
        moment = moment - (J @ dtotal + cross(total, J @ total)) + top.height * cross(t3, force)
        return stack.Load(force, moment)

    def balances(self, state: Any, f: Array, angles: Array, normal: Array) -> tuple[Array, Array, Any]:
        """Residuals over the weight (n-1, 6), rates of Y, Z (n-1, 2), and the force of the top."""
        bearing, spin = self.bearing, self.scene.effects.spin
        turn = kinematics.rotation(state)
        at = kinematics.points(bearing, state, turn)
        act = stack.interfaces(bearing, turn, at, f, angles, normal, spin, self.scene.effects.rims)
        load = self.load(turn, at, state.q[-1, 2])
        rows = []
        for k in range(2, bearing.layout.n + 1):
            force, moment = stack._applied(bearing, at, act, load, k)
            linear, angular = -force, -moment
            if self.inertial:
                J, w = stack.inertia(bearing, turn, k), turn.w_total[k]
                linear = bearing.bodies[k - 2].mass * at.a[f"{k}"] - force
                angular = J @ turn.dw_total[k] + kinematics.cross(w, J @ w) - moment
            rows.append(np.concatenate([linear, turn.t[k] @ angular]) / self.size)
            if spin == "locked":
                rows[-1][5] = state.v[k - 2, 2]
        law = self.scene.effects.bouc_wen
        return np.array(rows), forces.friction_rates(bearing, f, act.touch.slip, law), load.force

    def stage(self, t: float, start: tuple[Array, Array, Array], beta: float, guess: Array, known: Jacobian) -> Any:
        """Solve one stage for v, contact angles, N and Y, Z, with q = Q + beta v, a = (v - V)/beta, f = F + beta f'."""
        Q, V, F = start
        n, base = self.count, self.base(t)
        scale = np.concatenate([np.full(3 * n, 1.0), np.full(2 * n, 1.0), np.full(n, self.size), np.full(2 * n, 1.0)])

        def parts(x: Array) -> Any:
            x = x * scale
            v, angles, normal, f = (
                x[: 3 * n].reshape(n, 3),
                x[3 * n : 5 * n].reshape(n, 2),
                x[5 * n : 6 * n],
                x[6 * n :].reshape(n, 2),
            )
            return kinematics.State(Q + beta * v, v, (v - V) / beta, base), f, angles, normal

        def residual(x: Array) -> Array:
            state, f, angles, normal = parts(x)
            rows, rates, _ = self.balances(state, f, angles, normal)
            return np.concatenate([rows.ravel(), (f - F - beta * rates).ravel()])

        x = newton(residual, guess / scale, known)
        state, f, angles, normal = parts(x)
        _, rates, force = self.balances(state, f, angles, normal)
        return x * scale, state, f, rates, force

    def march(self, history: History, rows: range, halved: bool = False) -> Marched:
        """Integrate from the state of the first row to the times of the others, in one step each or in two halves."""
        i = rows[0]
        q, v, f = history.tilt_angles[i], history.tilt_rates[i], history.friction_state[i]
        guess = np.concatenate([v.ravel(), history.contact_angles[i].ravel(), history.normal_force[i], f.ravel()])
        known = Jacobian()
        found: list[tuple[Array, Array, Array]] = []
        for row in rows[1:]:
            t0, t1 = history.time[row - 1], history.time[row]
            times = np.linspace(t0, t1, 3 if halved else 2)
            for a, b in pairwise(times):
                q, v, f, guess, force = self.step(float(a), float(b - a), q, v, f, guess, known)
            found.append((-force, q, f))  # the force of the bearing on its support
        return Marched(*(np.array(column) for column in zip(*found, strict=True)))

    def step(self, t: float, h: float, q: Array, v: Array, f: Array, guess: Array, known: Jacobian) -> Any:
        """One step of two stages; the method is stiffly accurate, so the second stage is the end of the step."""
        beta = GAMMA * h
        known.at(beta)
        guess, one, _, rates, _ = self.stage(t + beta, (q, v, f), beta, guess, known)
        w = (1 - GAMMA) * h
        before = q + w * one.v, v + w * one.a, f + w * rates
        guess, two, f2, _, force = self.stage(t + h, before, beta, guess, known)
        return two.q, two.v, f2, guess, force


def newton(residual: Any, x: Array, known: Jacobian) -> Array:
    """Newton's method, damped with a new Jacobian; an old one is reused while it reduces the residual to a third."""
    r = residual(x)
    size = float(np.abs(r).max())
    for _ in range(80):
        if size < 1e-10:
            return x
        fresh = known.value is None
        if fresh:
            known.value = stack.complex_jacobian(residual, x)
        try:
            step = np.linalg.solve(known.value, -r)
        except np.linalg.LinAlgError as error:
            raise UnsolvedError(str(error)) from error
        for fraction in (0.5**i for i in range(8)) if fresh else (1.0,):
            trial = residual(x + fraction * step)
            new = float(np.abs(trial).max())
            if new < size:
                break
        if not np.isfinite(new):
            break
        if new > size / 3:
            known.value = None
        if fresh or new < size:
            x, r, size = x + fraction * step, trial, new
    if not size < 1e-7:
        raise UnsolvedError(f"residual {size:.1e}")
    return x
