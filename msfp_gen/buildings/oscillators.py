"""`FixedBase`, `Oscillators`: modes on fixed attachments, and a building as attachments with oscillators on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array

UNCOUPLED = 1e-10  # share of the masses and springs, in forces at equal motion, below which damping counts as none


class FixedBase(NamedTuple):
    """A structure with fixed boundary coordinates.

    boundary, inner: indices of the boundary coordinates and of all others. follow: static response of the inner
    coordinates to the boundary, shape (inner, boundary) [SI]. frequencies: circular, ascending, shape (modes,) [rad/s].
    modes: of unit modal mass, shape (inner, modes) [SI]. still: motions without mass, which complete these, shape
    (inner, inner - modes) [SI].
    """

    boundary: Array
    inner: Array
    follow: Array
    frequencies: Array
    modes: Array
    still: Array

    @property
    def relative(self) -> Array:
        """Motion of the inner coordinates relative to the static response: rows, shape (inner, n), [SI]."""
        rows = np.zeros((len(self.inner), len(self.inner) + len(self.boundary)))
        rows[:, self.inner] = np.eye(len(self.inner))
        rows[:, self.boundary] = -self.follow
        return rows


@dataclass(frozen=True, eq=False)
class Oscillators:
    """A building in other coordinates: its attachments, which matrices couple, then one oscillator for each mode.

    An oscillator is a unit mass on a spring and a damper, which the attachments move at their other end: its strain is
    y - shares.T @ attachments. All else follows the attachments statically. The mass of the attachments is what the
    oscillators do not carry.

    basis: coordinates of the building from these, shape (n, c + m). mass, damping, stiffness: of the attachments,
    shape (c, c). shares: of the motions of the attachments in each mode, shape (c, m). springs, dampers: shape (m,).
    All [SI].
    """

    basis: Array
    mass: Array
    damping: Array
    stiffness: Array
    shares: Array
    springs: Array
    dampers: Array

    @classmethod
    def of(cls, fixed: FixedBase, mass: Array, damping: Array, stiffness: Array) -> Oscillators:
        """A building of these matrices; where damping couples its modes, all its coordinates are attachments."""
        size, c, m = len(mass), len(fixed.boundary), len(fixed.frequencies)
        on_boundary = np.ix_(fixed.boundary, fixed.boundary)
        static, modes, still = np.zeros((size, c)), np.zeros((size, m)), np.zeros((size, size - c - m))
        static[fixed.boundary], static[fixed.inner] = np.eye(c), fixed.follow
        modes[fixed.inner], still[fixed.inner] = fixed.modes, fixed.still
        lowest = float(fixed.frequencies[0]) if m else 1.0
        rates = _damping_of(np.hstack([static, modes, still]), c, mass, damping, stiffness, lowest)
        if np.any((rates - np.diag(np.diag(rates)))[c:]):
            none = np.zeros(0)
            return cls(np.eye(size), mass, damping, stiffness, np.zeros((size, 0)), none, none)
        shares = static.T @ mass @ modes
        carried = mass[np.ix_(fixed.boundary, fixed.inner)] @ fixed.modes
        return cls(
            np.hstack([static - modes @ shares.T, modes]),
            mass[on_boundary] - carried @ carried.T,
            rates[:c, :c],
            _symmetric(static.T @ stiffness @ static),
            shares,
            fixed.frequencies**2,
            np.diag(rates)[c : c + m],
        )


def _damping_of(
    motions: Array, attached: int, mass: Array, damping: Array, stiffness: Array, frequency: float
) -> Array:
    """Damping in the coordinates of some motions, shape (motions, motions) [SI]; what rounding leaves is zero."""
    # The first `attached` motions are motions of attachments. frequency: circular, with which forces of masses and of
    # springs are compared [rad/s].
    sizes = [np.einsum("ij,ij->j", motions, matrix @ motions) for matrix in (mass, stiffness)]
    scale = np.sqrt(np.maximum(sizes[0] * frequency + sizes[1] / frequency, 0.0))
    rates = motions.T @ damping @ motions
    felt = np.abs(rates) > UNCOUPLED * np.outer(scale, scale)
    felt[:attached, :attached] = felt[:attached, :attached].any()
    found: Array = _symmetric(np.where(felt, rates, 0.0))
    return found


def _symmetric(matrix: Array) -> Array:
    average: Array = (matrix + matrix.T) / 2
    return average
