"""Damping of a building: of the modes that it has on fixed attachments, so that rigid motions are not damped."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError


class FixedBase(NamedTuple):
    """A structure with its boundary coordinates held.

    inner: indices of the other coordinates. follow: their static response to the boundary, shape (inner, boundary).
    frequencies: angular, ascending [rad/s]. modes: shape (inner, modes), of unit modal mass.
    """

    boundary: Array
    inner: Array
    follow: Array
    frequencies: Array
    modes: Array

    @property
    def relative(self) -> Array:
        """Motion of the inner coordinates relative to the static response: rows, shape (inner, n)."""
        rows = np.zeros((len(self.inner), len(self.inner) + len(self.boundary)))
        rows[:, self.inner] = np.eye(len(self.inner))
        rows[:, self.boundary] = -self.follow
        return rows


def fixed_base(mass: Array, stiffness: Array, boundary: Sequence[int]) -> FixedBase:
    """Modes on fixed boundary coordinates. Raises InputError where the structure is not held by them."""
    from scipy.linalg import eigh

    held = np.asarray(boundary, dtype=int)
    inner = np.setdiff1d(np.arange(len(mass)), held)
    if not inner.size:
        return FixedBase(held, inner, np.zeros((0, held.size)), np.zeros(0), np.zeros((0, 0)))
    k, m = stiffness[np.ix_(inner, inner)], mass[np.ix_(inner, inner)]
    lowest = float(np.linalg.eigvalsh(k)[0])
    if lowest <= 1e-14 * float(np.abs(k).max()):
        raise InputError(
            f"building.stiffness: on fixed attachments its least eigenvalue is {lowest:.3g}, so that parts move "
            "without force; connect or remove them"
        )
    # Of M x = K x / w^2: coordinates without mass are eigenvectors of zero, and K has an inverse.
    squares, vectors = eigh(m, k)
    real = squares > 1e-14 * max(float(squares[-1]), 0.0)
    order = np.flatnonzero(real)[::-1]
    modes = vectors[:, order] / np.sqrt(squares[order])
    follow = -np.linalg.solve(k, stiffness[np.ix_(inner, held)])
    return FixedBase(held, inner, follow, 1 / np.sqrt(squares[order]), modes)


def modal_damping(mass: Array, fixed: FixedBase, ratios: Array) -> Array:
    """C of damping ratios of the modes on fixed attachments, ndarray, shape (n, n) [N s/m], [N m s].

    ratios: from the lowest mode, shape (k,); the last is that of all higher ones.
    """
    count = len(fixed.frequencies)
    each = np.concatenate([ratios, np.full(max(count - len(ratios), 0), ratios[-1])])[:count]
    inner = np.ix_(fixed.inner, fixed.inner)
    rows = fixed.modes.T @ mass[inner] @ fixed.relative
    found: Array = rows.T * (2 * each * fixed.frequencies) @ rows
    return found


def rayleigh_damping(
    mass: Array, stiffness: Array, fixed: FixedBase, ratio: float, frequencies: tuple[float, float]
) -> Array:
    """C = a M + b K, ndarray, shape (n, n) [N s/m], [N m s], of a damping ratio at two frequencies [Hz].

    M is that of the motion relative to the attachments.
    """
    low, high = (2 * np.pi * frequency for frequency in frequencies)
    a, b = 2 * ratio * low * high / (low + high), 2 * ratio / (low + high)
    rows = fixed.relative
    found: Array = a * rows.T @ mass[np.ix_(fixed.inner, fixed.inner)] @ rows + b * stiffness
    return found
