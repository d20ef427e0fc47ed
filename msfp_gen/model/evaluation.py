"""The result of one evaluation of the equations, and the reasons for which it may fail."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.specification.contract import STATUSES

FAILURES = {status.name: status.evaluation for status in STATUSES if status.evaluation is not None}
"""Why there are no accelerations, by status."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """One evaluation of the equations of motion.

    acceleration: ndarray, shape (n-1, 3), second derivatives of psi, theta, phi [rad/s^2]; None in a massless model,
    which does not determine accelerations. normal_force (n-1,) [N]; contact_angles (n-1, 2) psi~, theta~
    [rad]; friction_rate (n-1, 2) dY/dt, dZ/dt [1/s]; interface_force (n-1, 3) P on the body above [N]; slip_velocity
    (n-1, 2) u~, v~ [m/s]; friction_coefficient (n-1,), None where it is constant; sliding, gap (n-1,) [m].
    residual_norm: largest residual of a balance over its scale [-]; massless: largest moment over the largest normal
    force, a measure of the distance from equilibrium [m]. determinant: sign of the determinant of the equations.
    """

    acceleration: Array | None
    normal_force: Array
    contact_angles: Array
    friction_rate: Array
    interface_force: Array
    slip_velocity: Array
    friction_coefficient: Array | None
    sliding: Array
    gap: Array
    residual_norm: float
    newton_iterations: int
    determinant: int

    @property
    def unknowns(self) -> Array:
        """The unknowns in the order of (2.119): accelerations, contact positions, normal forces; shape (6(n-1),).

        Raises InputError for a massless model.
        """
        if self.acceleration is None:
            raise InputError("unknowns: a massless model has no accelerations; build it with sliders = 'inertial'")
        return np.concatenate([self.acceleration.ravel(), self.contact_angles.ravel(), self.normal_force])


def named_vectors(n: int, points: Array, rotations: Array, bases: Array) -> dict[str, Array]:
    """Vectors by their names in `Model.kinematics`, from the arrays of the extension.

    points: of each body and named point position, velocity and acceleration. rotations: omega, omega', alpha, alpha'
    of each body. bases: rows t_1, t_2, t_3 of each body.
    """
    out: dict[str, Array] = {}
    between = "" if n < 10 else "_"  # "11" would be both a point of body 1 and the centre of body 11
    for k in range(1, n + 1):
        bottom = "01" if k == 1 else f"{k - 1}{between}{k}"
        top = f"{k}{between}{k}"
        names = (bottom, str(k), top) if k == n else (bottom, str(k), top, f"{k}c")
        for i, name in enumerate(names):
            for j, kind in enumerate("rva"):
                out[f"{kind}_{name}"] = points[k - 1, i, j]
        for i, kind in enumerate(("omega_{}", "omega'_{}", "alpha_{}", "alpha'_{}")):
            out[kind.format(k)] = rotations[k - 1, i]
        out[f"t_{k}"] = bases[k - 1]
    return out
