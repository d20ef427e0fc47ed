"""A model as an ordinary differential equation for library integrators."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.errors import InputError, RunError
from msfp_gen.packing import Array, load_values
from msfp_gen.piecewise import derivatives

if TYPE_CHECKING:
    from msfp_gen.bearing import Bearing
    from msfp_gen.model import Model
    from msfp_gen.motion import Motion
    from msfp_gen.top import Top


class Ode:
    """y' = fun(t, y) with y = (q, v, h) flattened, shape (8(n-1),): angles [rad], rates [rad/s], Y and Z.

    `jac(t, y)` is exact: the implicit function theorem on the report's balances. `y0` is centred and at rest.
    Unpacks as `fun, jac, y0`.
    """

    def __init__(self, model: Model, bearing: Bearing, motion: Motion, top: Top) -> None:
        if model.effects.sliders == "massless":
            raise InputError("as_ode: a massless model is no ordinary differential equation; use sliders = 'inertial'")
        if model.effects.law is not None and model.effects.law.heats:
            raise InputError(
                f"as_ode: effects.friction = {model.effects.friction!r} has temperatures, which are no part of y; use "
                "simulate, or a law without T"
            )
        if model.planar and motion.plane() != 0.0:
            raise InputError(
                "as_ode: a planar model takes a motion in the E1-E3 plane; turn it with motion.rotated(angle)"
            )
        self.model, self.motion = model, motion
        self.count = model.layout.surfaces
        self.stack = model.stack(bearing, top, anchor=motion.displacement(0.0)[:2])
        self.load = load_values(top)
        self.y0: Array = np.zeros(8 * self.count)

    def __iter__(self):  # type: ignore[no-untyped-def]
        return iter((self.fun, self.jac, self.y0))

    def _split(self, y: Array) -> tuple[Array, Array, Array]:
        k = 3 * self.count
        q, v, h = y[:k].reshape(-1, 3), y[k : 2 * k].reshape(-1, 3), y[2 * k :].reshape(-1, 2)
        return np.ascontiguousarray(q, float), np.ascontiguousarray(v, float), np.ascontiguousarray(h, float)

    def _base(self, t: float) -> Array:
        """Displacement, velocity and acceleration of the base; `fun` is called tens of thousands of times."""
        knots, coefficients = self.motion.knots, self.motion.coefficients
        if not 0 <= t <= knots[-1]:
            self.motion.evaluate(t)  # says what is wrong
        piece = min(int(np.searchsorted(knots, t, side="right")) - 1, len(knots) - 2)
        return np.ascontiguousarray(derivatives(float(t - knots[piece])) @ coefficients[piece].T)

    def _accelerations(self, t: float, y: Array) -> tuple[Array, Array, Array, int]:
        """Accelerations, the recorded row, friction rates and Newton iterations. RunError where there are none."""
        q, v, h = self._split(np.asarray(y))
        status, a, row, rates, _, iterations, *_ = self.stack.accelerations(q, v, h, self._base(t), self.load)
        if status != "ok":
            raise RunError(f"as_ode: {status} at t = {t:.6g} s", status=status)
        return a, row, rates, iterations

    def fun(self, t: float, y: Array) -> Array:
        """State derivative, shape (8(n-1),). Raises RunError where no acceleration is found."""
        return self.rates(t, y)[0]

    def rates(self, t: float, y: Array) -> tuple[Array, int]:
        """`fun`, and the Newton iterations that it took."""
        a, _, rates, iterations = self._accelerations(t, y)
        return np.concatenate([self._split(np.asarray(y))[1].ravel(), a.ravel(), rates.ravel()]), iterations

    def observe(self, t: float, y: Array) -> dict[str, Array]:
        """Everything that a run records of this state, by the names of the runtime. Raises RunError as `fun` does."""
        return self.model.unpack(self._accelerations(t, y)[1])

    def jac(self, t: float, y: Array) -> Array:
        """D fun / d y, shape (8(n-1), 8(n-1))."""
        q, v, h = self._split(np.asarray(y))
        base = self._base(t)
        a, row, *_ = self._accelerations(t, y)
        # The solution of `fun` itself: Newton on the report's balances might end on another root.
        found, keep = self.model.unpack(row), [1] if self.model.planar else [0, 1, 2]
        angles = found["angles"][:, 1:] if self.model.planar else found["angles"]
        unknowns = np.concatenate([a[:, keep].ravel(), angles.ravel(), found["normal"]])
        inner, outer = self.model._unknown_columns(), self.model._state_columns()
        _, jacobian, rates = self.stack.report(q, v, h, base, self.load, unknowns, [*inner, *outer])
        split = len(inner)
        sensitivity = -np.linalg.solve(jacobian[:, :split], jacobian[:, split:])  # d unknowns / d y
        k = 3 * self.count
        out = np.zeros((8 * self.count, 8 * self.count))
        out[:k, k : 2 * k] = np.eye(k)
        accelerations = sensitivity[: split // (3 if self.model.planar else 2)]
        if self.model.planar:
            out[k + 1 : 2 * k : 3] = accelerations
        else:
            out[k : 2 * k] = accelerations
        out[2 * k :] = rates[:, split:] + rates[:, :split] @ sensitivity
        return out
