"""Bearing and top as the arrays of a compiled stack."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.scene.friction_parameters import law_parameters
from msfp_gen.scene.seats import seat_stiffness
from msfp_gen.scene.top import MassTop, Top, load_values
from msfp_gen.specification import contract

if TYPE_CHECKING:
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.specification.layout import Effects


def vector(value: ArrayLike, name: str, shape: tuple[int, ...], unit: str) -> Array:
    """`value` as a finite, contiguous float64 array of the given shape, or an InputError that names it."""
    try:
        array = np.ascontiguousarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} = {value!r}: give numbers [{unit}], shape {shape}") from error
    if array.shape != shape:
        raise InputError(f"{name} has shape {array.shape}: give shape {shape} [{unit}]")
    if not np.isfinite(array).all():
        raise InputError(f"{name} has an entry that is not finite: give finite numbers [{unit}]")
    return array


def bodies_and_surfaces(bearing: Bearing, effects: Effects, top: Top | None = None) -> tuple[Array, Array]:
    """Arrays of bodies, shape (n, values of a body), and surfaces, (n-1, values of a surface), in contract order.

    top: on which the stiffness of unilateral contacts depends where it is not given. Raises InputError as it does.
    """
    arrays = bearing.arrays()
    if effects.uplift:
        arrays["seat_stiffness"] = seat_stiffness(bearing, top)
    if (law := effects.law) is not None:
        rows = [law_parameters(law, bearing, index) for index in range(bearing.layout.surfaces)]
        arrays = {**arrays, **{name: np.array([row[name] for row in rows]) for name in law.columns}}
    bodies, surfaces = (
        np.ascontiguousarray(np.column_stack([arrays[name] for name in columns]))
        for columns in (contract.names(contract.BODY), contract.surface_values(effects))
    )
    return bodies, surfaces


def top_values(top: Top | None, anchor: ArrayLike = (0.0, 0.0)) -> Array:
    """Parameters of the top in contract order. anchor: horizontal position of the fixed end of its springs [m]."""
    values = dict.fromkeys(contract.names(contract.TOP), 0.0)
    values["anchor_x"], values["anchor_y"] = np.asarray(anchor, dtype=float)
    given = {} if top is None else vars(top)
    if isinstance(top, MassTop):
        inertia = top.inertia if isinstance(top.inertia, tuple) else (top.inertia, top.inertia)
        given = {**given, "inertia_transverse": inertia[0], "inertia_axial": inertia[1]}
    values |= {name: value for name, value in given.items() if name in values and value is not None}
    return np.array([float(value) for value in values.values()])


def separations_at_rest(bearing: Bearing, top: Top | None, added_load: float = 0.0) -> Array:
    """Separations at which the unilateral contacts carry all weights and loads, ndarray, shape (n-1, 3) [m].

    added_load: vertical load in addition to that of the top, downward positive [N].
    """
    load = added_load + (0.0 if top is None else -float(load_values(top)[2]))
    mass = top.mass if isinstance(top, MassTop) else 0.0
    masses = np.array([body.mass for body in bearing.bodies])
    masses[-1] += mass
    carried = load + bearing.gravity * np.cumsum(masses[::-1])[::-1]
    out = np.zeros((len(masses), 3))
    out[:, 2] = -carried / seat_stiffness(bearing, top)
    return out
