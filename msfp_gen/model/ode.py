"""A model as an ordinary differential equation, for library integrators."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError, RunError
from msfp_gen.model.evaluation import state_columns, unknown_columns
from msfp_gen.motions.piecewise import derivatives
from msfp_gen.scene.top import is_sprung, load_values

if TYPE_CHECKING:
    from msfp_gen.model.compiled import Stack
    from msfp_gen.motions.motion import Motion
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.top import Top
    from msfp_gen.specification.layout import Effects, Layout


class Equations(Protocol):
    """The part of `Model` that the adapter uses."""

    effects: Effects
    layout: Layout

    @property
    def planar(self) -> bool:
        """Whether the model is planar."""

    def stack(self, bearing: Bearing, top: Top | None = None, anchor: ArrayLike = (0.0, 0.0)) -> Stack:
        """See `Model.stack`."""

    def unpack(self, rows: Array) -> dict[str, Array]:
        """See `Model.unpack`: rows, shape (..., row size), as arrays by name."""


class Ode:
    """y' = fun(t, y) with y = (q, v, h) flattened, shape (8(n-1),): angles [rad], rates [rad/s], Y and Z.

    `jac(t, y)` is exact: it follows from the balances (3.26)-(3.29) by the implicit function theorem. `y0`: centred and
    at rest. An instance unpacks as `fun, jac, y0`. Raises InputError for massless models, friction laws with
    a memory of the surface, a top on a vertical spring, and a planar model with a motion outside the E1-E3 plane.
    """

    def __init__(self, model: Equations, bearing: Bearing, motion: Motion, top: Top) -> None:
        if model.effects.sliders == "massless":
            raise InputError("as_ode: a massless model is no ordinary differential equation; use sliders = 'inertial'")
        if model.effects.law is not None and model.effects.law.memory is not None:
            raise InputError(
                f"as_ode: effects.friction = {model.effects.friction!r} has temperatures or paths, which y does not "
                "contain; use simulate, or a law without them"
            )
        if is_sprung(top):
            raise InputError(
                f"as_ode: top.vertical_stiffness = {top.vertical_stiffness!r}: y does not contain the height of the "  # type: ignore[attr-defined]
                "foot; use simulate, or leave the vertical spring out"
            )
        if model.planar and motion.plane() != 0.0:
            raise InputError(
                "as_ode: a planar model needs a motion in the E1-E3 plane; rotate it with motion.rotated(angle)"
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
        """Displacement, velocity and acceleration of the base, shape (3, 6).

        Equal to `Motion.evaluate`, but faster at a single time: integrators call `fun` tens of thousands of times.
        """
        knots, coefficients = self.motion.knots, self.motion.coefficients
        if not 0 <= t <= knots[-1]:
            self.motion.evaluate(t)  # raises the InputError for this time
        piece = min(int(np.searchsorted(knots, t, side="right")) - 1, len(knots) - 2)
        return np.ascontiguousarray(derivatives(float(t - knots[piece])) @ coefficients[piece].T)

    def _accelerations(self, t: float, y: Array) -> tuple[Array, Array, Array, int]:
        """Accelerations, the row of this state, friction rates and Newton iterations. Raises RunError on failure."""
        q, v, h = self._split(np.asarray(y))
        status, a, row, rates, _, iterations, *_ = self.stack.accelerations(q, v, h, self._base(t), self.load)
        if status != "ok":
            raise RunError(f"as_ode: {status} at t = {t:.6g} s", status=status)
        return a, row, rates, iterations

    def fun(self, t: float, y: Array) -> Array:
        """State derivative, ndarray, shape (8(n-1),), [rad/s, rad/s^2, 1/s]. Raises RunError: no acceleration."""
        return self.rates(t, y)[0]

    def rates(self, t: float, y: Array) -> tuple[Array, int]:
        """The value of `fun`, shape (8(n-1),) [rad/s, rad/s^2, 1/s], and the number of Newton iterations."""
        a, _, rates, iterations = self._accelerations(t, y)
        return np.concatenate([self._split(np.asarray(y))[1].ravel(), a.ravel(), rates.ravel()]), iterations

    def observe(self, t: float, y: Array) -> dict[str, Array]:
        """The row that a run would record of this state, as arrays by name; shapes and units of `History` less time.

        Raises RunError as `fun` does.
        """
        return self.model.unpack(self._accelerations(t, y)[1])

    def jac(self, t: float, y: Array) -> Array:
        """Jacobian d fun/d y, ndarray, shape (8(n-1), 8(n-1)), [SI]. Raises RunError as `fun` does."""
        q, v, h = self._split(np.asarray(y))
        base = self._base(t)
        a, row, *_ = self._accelerations(t, y)
        # The unknowns of `fun` are used here: solving the balances again could converge to another root.
        jacobians, free = self.model.unpack(row), [1] if self.model.planar else [0, 1, 2]
        angles = jacobians["angles"][:, 1:] if self.model.planar else jacobians["angles"]
        unknowns = np.concatenate([a[:, free].ravel(), angles.ravel(), jacobians["normal"]])
        inner, outer = unknown_columns(self.count, self.model.planar), state_columns(self.count)
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
