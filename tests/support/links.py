"""Bearings as chains of tilting links under a load, in two directions: an independent model for small tilts.

Links of lengths L tilt by theta and displace the top by the sum of L theta. Surfaces slip by S theta; each is an
elastic spring up to its friction, a circle, and a stiff ring beyond its capacity. In every step the energy, with
plastic slips by radial return, is least under the given displacement. `stack` and `series` are two readings of a triple
pendulum: in a stack of bodies a surface slips by the tilt of one body against the next, and the friction of a nested
surface acts on the body around it; in a series (Dao 2013, TripleFrictionPendulum of OpenSees) each link slips for
itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from msfp_gen import Bearing, Body, Layout, Surface
from support import Array

# Radii of Dao's example times four and a third of its friction: tilts below 0.06 rad, as links assume. Inner surfaces,
# lower, upper.
RADII, FRICTIONS, CAPACITIES, WEIGHT = (1.44, 5.0, 5.0), (0.004, 0.017, 0.047), (0.1, 0.2, 0.2), 1000.0

RING = 1e6  # stiffness of the rings [N/m]
EYE = np.eye(2)


def shallow(yielding: float, frictions: Sequence[float] = FRICTIONS) -> Bearing:
    """A triple pendulum with plates and sliders of 2 mm, so that effective radii are the radii."""
    order = (1, 0, 0, 2)
    values = [(RADII[i], CAPACITIES[i], frictions[i], yielding) for i in order]
    surfaces = [Surface(*value, rim_stiffness=RING, contact_damping=1e-4) for value in values]
    light = [Body(height=2e-3, centroid=1e-3, mass=0.01, inertia=(1e-6, 1e-6), rim_radius=0.05) for _ in range(4)]
    return Bearing(Layout.tfp(), 2e-3, surfaces, light, gravity=0.0)


def eight(amplitude: float, count: int, across: float = 0.5) -> Array:
    """A path like an 8, in `count` rows, shape (count, 2) [m]."""
    angle = np.linspace(0.0, 2 * np.pi, count + 1)[1:]
    return amplitude * np.column_stack([np.sin(angle), across * np.sin(2 * angle)])


def beginning(frictions: Sequence[float]) -> list[float]:
    """The coefficients at which a force begins to move each surface, in a stack pushed along one axis: (mu R - mu' R')/
    (R - R'), with ' for the next surface inwards (docs/bearing.md)."""
    inside = frictions[0] * RADII[0]
    outer = [(mu * r - inside) / (r - RADII[0]) for mu, r in zip(frictions[1:], RADII[1:], strict=True)]
    return [frictions[0], *outer]


@dataclass
class Surfaces:
    """slips: matrix S, shape (surfaces, links) [m]; friction [N], stiffness [N/m] and capacity [m] of each."""

    slips: Array
    friction: Array
    stiffness: Array
    capacity: Array

    def __post_init__(self) -> None:
        self.plastic = np.zeros((len(self.friction), 2))

    def forces(self, tilts: Array) -> tuple[Array, Array, Array]:
        """Forces and their stiffnesses, shapes (surfaces, 2) and (surfaces, 2, 2), and the plastic slips after them."""
        slip = self.slips @ tilts
        elastic = self.stiffness[:, None] * (slip - self.plastic)
        size = np.maximum(np.linalg.norm(elastic, axis=1), 1e-300)
        sliding = size > self.friction
        share = np.where(sliding, self.friction / size, 1.0)
        along, across = np.where(sliding, 0.0, self.stiffness), self.stiffness * share
        distance = np.maximum(np.linalg.norm(slip, axis=1), 1e-300)
        beyond = np.maximum(distance - self.capacity, 0.0)
        ring, turning = RING * (beyond > 0), RING * beyond / distance
        matrix = polar(elastic / size[:, None], along, across) + polar(slip / distance[:, None], ring, turning)
        found = share[:, None] * elastic + turning[:, None] * slip
        return found, matrix, slip - share[:, None] * elastic / self.stiffness[:, None]


def polar(direction: Array, along: Array, across: Array) -> Array:
    """Matrices with these values along and across directions."""
    outer = direction[:, :, None] * direction[:, None, :]
    return along[:, None, None] * outer + across[:, None, None] * (EYE - outer)


def forces(path: Array, length_of: Sequence[float], load: float, surfaces: Surfaces, parts: int) -> Array:
    """Horizontal forces, shape (rows, 2) [N], at displacements [m] of a path, in `parts` steps from row to row."""
    length = np.array(length_of)
    count = len(length)
    free = np.vstack([np.eye(count - 1), -length[:-1] / length[-1]])  # the last tilt follows from the displacement
    tilts, found, before = np.zeros((count, 2)), [], np.zeros(2)
    for row in path:
        for part in range(1, parts + 1):
            tilts[-1] += ((before + (row - before) * part / parts) - length @ tilts) / length[-1]
            tilts, force, surfaces.plastic = balance(tilts, free, load * length, surfaces)
        before = row
        found.append(force / length[0])
    return np.array(found)


def balance(tilts: Array, free: Array, weights: Array, surfaces: Surfaces) -> tuple[Array, Array, Array]:
    """Tilts of least energy from others of the same displacement, the force times the first length, and plastic slips.

    Newton's method, with steps shortened to where the energy along them is least.
    """

    def gradient(at: Array) -> tuple[Array, Array, Array, Array]:
        force, matrix, plastic = surfaces.forces(at)
        total = weights[:, None] * at + surfaces.slips.T @ force
        return free.T @ total, total, matrix, plastic

    slips = surfaces.slips @ free
    spring = np.einsum("ka,k,kb,xy->axby", free, weights, free, EYE)
    left, total, matrix, plastic = gradient(tilts)
    for _ in range(200):
        if np.abs(left).max() < 1e-9 * weights.max():
            return tilts, total[0], plastic
        tangent = spring + np.einsum("ja,jxy,jb->axby", slips, matrix, slips)
        step = free @ -np.linalg.solve(tangent.reshape(left.size, -1), left.ravel()).reshape(left.shape)
        slope = float((total * step).sum())
        low, high, share = 0.0, 1.0, 1.0
        for _ in range(60):
            left, total, matrix, plastic = gradient(tilts + share * step)
            now = float((total * step).sum())
            if abs(now) <= 0.5 * abs(slope) or (now < 0 and share == 1.0):
                break
            low, high = (share, high) if now < 0 else (low, share)
            share = 0.5 * (low + high)
        tilts = tilts + share * step
    raise AssertionError(f"no balance: {np.abs(left).max():g} N m left")


def stack(path: Array, frictions: Sequence[float], uy: float) -> Array:
    """The forces of that bearing as a stack of bodies; uy: yield displacement [m]."""
    inner, lower, upper = RADII
    slips = np.array([[inner, -inner, 0.0], [0.0, lower, 0.0], [inner, 0.0, -inner], [0.0, 0.0, upper]])
    order = [0, 1, 0, 2]
    friction, capacity = WEIGHT * np.array(frictions)[order], np.array(CAPACITIES)[order]
    return forces(path, lengths(), WEIGHT, Surfaces(slips, friction, friction / uy, capacity), parts=5)


def lengths() -> list[float]:
    """Lengths of the links: both inner surfaces, lower, upper."""
    return [2 * RADII[0], *(r - RADII[0] for r in RADII[1:])]


def series(path: Array, frictions: Sequence[float], uy: float, parts: int) -> Array:
    """The forces of a series of links as TripleFrictionPendulum has it: one elastic stiffness 3 mu W/uy, of the inner
    friction, for all links; a part of it is the pendulum's, and by this share the friction is smaller."""
    length = np.array(lengths())
    elastic, pendulum = 3 * WEIGHT * frictions[0] / uy, WEIGHT / length
    gaps = [2 * (RADII[0] / RADII[2] * CAPACITIES[2] + CAPACITIES[0])]
    gaps += [c * (1 - RADII[0] / r) for r, c in zip(RADII[1:], CAPACITIES[1:], strict=True)]
    friction = WEIGHT * np.array(frictions) * (1 - pendulum / elastic)
    surfaces = Surfaces(np.diag(length), friction, elastic - pendulum, np.array(gaps))
    return forces(path, length.tolist(), WEIGHT, surfaces, parts)
