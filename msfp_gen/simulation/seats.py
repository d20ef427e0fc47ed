"""Separations with which a run with uplift starts: those whose contacts hold the bodies together.

As without uplift, the sphere centres of a surface move as one at the start. The contact forces are then the forces of
the model without uplift, whatever the tilts, the loads and the accelerations at the start, unless a slider stands on
its edge.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.model.compiled import separations_under
from msfp_gen.model.model import Model
from msfp_gen.specification import contract

ITERATIONS = 40
ACCURACY = 1e-13  # of the separations, over the largest
RESTING = 1e-9  # change of the separations at rest, over the largest, below which they are left as they are
LARGEST = 10.0  # separations over those at rest; a slider that needs more stands on its edge
STEP = 1e-6  # of a difference, over the size of what changes
SMALLEST = 1e-2  # size of angles, friction states and motions of the base for such a step [SI]


@dataclass(frozen=True)
class Start:
    """What the forces at the start depend on, or its derivatives with respect to a parameter [SI].

    gravity, bodies, surfaces, top: of the extension's `Stack`. q, v, f: angles, their rates and friction states, shapes
    (n-1, 3), (n-1, 3), (n-1, 2). base: motion of the base with two derivatives, shape (3, 6). load: force and moment on
    the top plate, shape (6,). support: rotation of the support of the top and its rate, shape (12,).
    """

    gravity: float
    bodies: Array
    surfaces: Array
    top: Array
    q: Array
    v: Array
    f: Array
    base: Array
    load: Array
    support: Array

    def moved(self, direction: Start, step: float) -> Start:
        """The start, changed by `step` times its derivatives."""
        names = [field.name for field in fields(self)]
        return Start(**{name: getattr(self, name) + step * getattr(direction, name) for name in names})

    def step(self, direction: Start) -> float:
        """Step of a parameter for differences, from its derivatives."""
        largest = 0.0
        for field in fields(self):
            value, slope = np.abs(getattr(self, field.name)), np.abs(getattr(direction, field.name))
            if field.name in ("bodies", "surfaces"):  # a column has one unit
                size = value.max(axis=0)
            elif field.name in ("gravity", "top"):
                size = value
            else:
                size = np.full_like(value, max(float(value.max()), SMALLEST))
            largest = max(largest, float((slope / np.where(size > 0.0, size, 1.0)).max()))
        return STEP / max(largest, 1e-300)


def separations(model: Model, start: Start) -> Array:
    """Separations at the start, ndarray, shape (n-1, 3) [m].

    Where bodies would have to pull, or a slider tips, no contact holds them together: these are the separations under
    weights and loads.
    """
    found, rest = _held_together(model, start), _at_rest(model, start)
    return rest if found is None or np.abs(found - rest).max() < RESTING * np.abs(rest).max() else found


def slopes(model: Model, start: Start, direction: Start) -> Array:
    """Derivative of `separations` by a parameter, ndarray, shape (n-1, 3), [m] per its unit, by differences."""
    step = start.step(direction)

    def difference(separations: Callable[[Start], Array | None]) -> Array | None:
        at, near, far = (
            separations(start.moved(direction, count * step)) for count in range(3)
        )  # some are not below 0
        return None if at is None or near is None or far is None else (4.0 * near - 3.0 * at - far) / (2.0 * step)

    found = difference(lambda at: _held_together(model, at))
    resting = difference(lambda at: _at_rest(model, at))
    assert resting is not None
    return resting if found is None else found


def _at_rest(model: Model, start: Start) -> Array:
    """Separations under the weights above every surface and the force on the top plate."""
    masses = np.array(start.bodies[1:, contract.names(contract.BODY).index("mass")])
    masses[-1] += start.top[contract.names(contract.TOP).index("mass")]
    stiffness = start.surfaces[:, contract.surface_values(model.effects).index("seat_stiffness")]
    return separations_under(start.load[:3], start.gravity, masses, stiffness)


def _held_together(model: Model, start: Start) -> Array | None:
    """Separations that do not accelerate, whose contacts are on the faces of their sliders; None: there are none."""
    # Newton's method on separations and angular accelerations.
    stack = model.extension.Stack(start.gravity, start.bodies, start.surfaces, start.top)
    d = _at_rest(model, start)
    count, apart = len(d), [0, 2] if model.planar else [0, 1, 2]
    v, a = np.hstack([start.v, np.zeros((count, 3))]), np.zeros((count, 6))
    load = np.concatenate([start.load, start.support])
    for _ in range(ITERATIONS):
        q = np.hstack([start.q, d])
        (status, residual, by_a, _), (_, _, by_q, _) = (
            stack.condensed(q, v, a, start.f, start.base, load, *weights, 0.0)
            for weights in ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
        )
        unknowns = len(residual) // count
        angles = unknowns - len(apart)
        separated = np.arange(len(residual)) % unknowns >= angles
        try:
            change = (
                -np.linalg.solve(np.where(separated, by_q, by_a), residual) if status == "ok" else residual * np.nan
            )
        except np.linalg.LinAlgError:
            return None
        if not np.isfinite(change).all():
            return None
        change = change.reshape(count, unknowns)
        a[:, [1] if model.planar else range(angles)] += change[:, :angles]
        d[:, apart] += change[:, angles:]
        if np.abs(change[:, angles:]).max() <= ACCURACY * np.abs(d).max():
            return d if np.abs(d).max() < LARGEST * np.abs(_at_rest(model, start)).max() else None
    return None
