"""From bearing, top and motion to the arrays that a compiled stack takes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from msfp_gen.errors import InputError
from msfp_gen.law_numbers import numbers
from msfp_gen.top import MassTop, PrescribedTop, RigTop, Top

if TYPE_CHECKING:
    from msfp_gen.bearing import Bearing
    from msfp_gen.layout import Effects

Array = NDArray[np.float64]

BODY_COLUMNS = ("height", "centroid", "mass", "inertia_transverse", "inertia_axial", "rim_radius", "rim_offset")
SURFACE_COLUMNS = ("radius", "capacity", "friction", "yield_displacement", "rim_stiffness", "rim_damping")
SEAT_COLUMNS = ("seat_stiffness", "seat_damping")


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


def bodies_and_surfaces(bearing: Bearing, effects: Effects) -> tuple[Array, Array]:
    """Arrays (n, 7) and (n-1, 6) in the order of the columns above; uplift and a law of friction add to a surface."""
    arrays = bearing.arrays()
    bodies = np.ascontiguousarray(np.column_stack([arrays[name] for name in BODY_COLUMNS]))
    columns = [arrays[name] for name in SURFACE_COLUMNS + (SEAT_COLUMNS if effects.uplift else ())]
    if (law := effects.law) is not None:
        rows = [numbers(law, bearing, index) for index in range(bearing.layout.surfaces)]
        columns += [np.array([row[name] for row in rows]) for name in law.columns]
    return bodies, np.ascontiguousarray(np.column_stack(columns))


def top_values(top: Top | None, anchor: ArrayLike = (0.0, 0.0)) -> Array:
    """Array (10,): stiffness, damping, rotational ones, mass, inertias, height, anchor of the springs (x, y) [m]."""
    values = np.zeros(10)
    values[8:] = np.asarray(anchor, dtype=float)
    if isinstance(top, RigTop):
        values[:4] = top.stiffness, top.damping, top.rotational_stiffness, top.rotational_damping
    elif isinstance(top, MassTop):
        inertia = top.inertia if isinstance(top.inertia, tuple) else (top.inertia, top.inertia)
        values[2:8] = top.rotational_stiffness, top.rotational_damping, top.mass, *inertia, top.height
    return values


def load_values(top: Top) -> Array:
    """Array (6,): constant force [N] and moment [N m] that the top applies to the top plate at r_nn."""
    if isinstance(top, RigTop):
        return np.array([0.0, 0.0, -top.axial_load, 0.0, 0.0, 0.0])
    if isinstance(top, PrescribedTop):
        return np.array([*top.force, *top.moment], dtype=float)
    return np.zeros(6)


def seated(bearing: Bearing, top: Top | None, pressing: float = 0.0) -> Array:
    """Separations at which the seats carry the weights and the vertical load at rest, ndarray, shape (n-1, 3), [m].

    pressing: vertical load beside that of the top [N].
    """
    load = pressing + (0.0 if top is None else -float(load_values(top)[2]))
    mass = top.mass if isinstance(top, MassTop) else 0.0
    masses = np.array([body.mass for body in bearing.bodies])
    masses[-1] += mass
    carried = load + bearing.gravity * np.cumsum(masses[::-1])[::-1]
    out = np.zeros((len(masses), 3))
    out[:, 2] = -carried / np.array([surface.seat_stiffness for surface in bearing.surfaces])
    return out
