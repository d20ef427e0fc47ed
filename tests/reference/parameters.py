"""Stacks for the reference: records with the field names of `msfp_gen.scene.bearing`, so either kind can be passed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class Counts:
    """n bodies, m surfaces concave up, then p concave down (chapter 3)."""

    n: int
    m: int
    p: int


@dataclass(frozen=True)
class Surface:
    """R [m], s_c [m], mu, d_y [m], k_c [N/m], c_c [N s/m], T [s]."""

    radius: float
    capacity: float
    friction: float
    yield_displacement: float
    rim_stiffness: float
    rim_damping: float
    contact_damping: float = 0.0


@dataclass(frozen=True)
class Body:
    """l [m], z [m], m [kg], (transverse, axial) inertia [kg m^2], r [m], p [m]."""

    height: float
    centroid: float
    mass: float
    inertia: tuple[float, float]
    rim_radius: float
    rim_offset: float


@dataclass(frozen=True)
class Stack:
    """All the values of one bearing; `surfaces[g - 1]` is surface g, `bodies[k - 2]` is body k."""

    layout: Counts
    surfaces: tuple[Surface, ...]
    bodies: tuple[Body, ...]
    base_height: float
    gravity: float = 9.8
    base_rim_radius: float = 0.0
    base_rim_offset: float = 0.0
    base_centroid: float | None = None


def fenz() -> Stack:
    """The triple pendulum of Tables A.1-A.4; d_y is R_0/R per metre (model choice 1 of the project)."""
    outer, inner = (0.473, 0.065), (0.076, 0.0215)
    surfaces = tuple(
        Surface(radius, capacity, mu, 5e-5 / radius, 1e7, 5.0)
        for (radius, capacity), mu in zip((outer, inner, inner, outer), (0.03, 0.017, 0.017, 0.107), strict=True)
    )
    slider = Body(0.015, 0.0075, 0.45, (3.01e-4, 5.85e-4), 0.051, 0.0028)
    middle = Body(0.046, 0.023, 0.34, (1.15e-4, 1.11e-4), 0.0255, 0.0044)
    top = Body(0.013, 0.0065, 8.0, (3.14e-2, 6.25e-2), 0.0, 0.0)
    return Stack(Counts(5, 2, 2), surfaces, (slider, middle, slider, top), 0.013)


def random_stack(rng: np.random.Generator, n: int, m: int, p: int) -> Stack:
    """Every value different, so that an index mixed up anywhere shows."""

    def between(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    surfaces = tuple(
        Surface(
            between(0.2, 0.6),
            between(0.02, 0.05),
            between(0.02, 0.15),
            between(1e-4, 1e-3),
            between(1e5, 1e6),
            between(5.0, 500.0),
        )
        for _ in range(n - 1)
    )
    bodies = tuple(
        Body(
            between(0.01, 0.05),
            between(0.003, 0.008),
            between(0.3, 8.0),
            (between(4e-3, 1e-2), between(1e-3, 8e-3)),
            between(0.02, 0.06),
            between(0.001, 0.005),
        )
        for _ in range(n - 1)
    )
    return Stack(
        Counts(n, m, p),
        surfaces,
        bodies,
        between(0.01, 0.05),
        9.8,
        between(0.02, 0.06),
        between(0.001, 0.005),
        between(0.003, 0.008),
    )
