"""Matrices of a building: from arrays and files (.npz, Matrix Market), checks that they are those of one, damping."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.buildings.storey import FREEDOMS, MOTIONS, Node, rigid
from msfp_gen.common.arrays import Array
from msfp_gen.common.inputs import read_input
from msfp_gen.errors import InputError, MsfpError


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


MOST = 5000  # coordinates of a building, whose matrices are dense
SYMMETRY = 1e-9  # largest difference of a matrix from its transpose, relative to its largest entry
STRAIN = 1e-6  # largest force of a rigid motion, relative to that which the same matrix exerts on single coordinates
Matrix = ArrayLike | str | PathLike[str]


def matrix_of(source: Matrix, name: str) -> Array:
    """A square symmetric matrix, ndarray, shape (n, n).

    source: an array, or a file of Matrix Market (.mtx) or of NumPy (.npz, the array `name`).

    Raises InputError that names `building.name`.
    """
    path = f"building.{name}"
    values = _read(Path(source), path, name) if isinstance(source, str | PathLike) else source
    try:
        found = np.array(values.toarray() if hasattr(values, "toarray") else values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{path}: these are no numbers; give a square array or the path of a file") from None
    if found.ndim != 2 or found.shape[0] != found.shape[1] or not 0 < len(found) <= MOST:
        raise InputError(f"{path} has the shape {found.shape}: give a square matrix of 1 to {MOST} coordinates")
    if not np.all(np.isfinite(found)):
        row, column = np.argwhere(~np.isfinite(found))[0]
        raise InputError(f"{path}[{row}, {column}] = {found[row, column]}: give finite numbers")
    difference = np.abs(found - found.T)
    if difference.max() > SYMMETRY * np.abs(found).max():
        row, column = np.unravel_index(int(difference.argmax()), found.shape)
        raise InputError(
            f"{path}[{row}, {column}] = {found[row, column]:.9g} and [{column}, {row}] = {found[column, row]:.9g}: "
            "give a symmetric matrix"
        )
    average: Array = (found + found.T) / 2
    return average


def _read(path: Path, field: str, name: str) -> Any:
    try:
        if path.suffix == ".npz":
            with np.load(BytesIO(read_input(path)), allow_pickle=False) as file:
                if name not in file:
                    raise InputError(f"{field} = {str(path)!r}: it has no array {name!r} but {', '.join(file)}")
                return file[name]
        if path.suffix == ".mtx":
            from scipy.io import mmread

            return mmread(BytesIO(read_input(path)))
    except OSError as error:
        raise InputError(f"{field} = {str(path)!r}: cannot be read ({error.strerror}); check the file") from None
    except MsfpError:
        raise
    except Exception as error:  # readers raise several types of exception for a damaged file
        raise InputError(f"{field} = {str(path)!r}: {error}; check the file") from None
    raise InputError(f"{field} = {str(path)!r}: give a file of Matrix Market (.mtx) or of NumPy (.npz)")


def check_semidefinite(matrix: Array, name: str) -> None:
    """Raise InputError where a matrix has an eigenvalue below zero, beyond rounding."""
    values = np.linalg.eigvalsh(matrix)
    if values[0] < -1e-9 * max(abs(values[0]), abs(values[-1])):
        raise InputError(f"building.{name} has the eigenvalue {values[0]:.3g}: give a matrix without negative ones")


def boundary_of(nodes: tuple[Node, ...]) -> tuple[int, ...]:
    """Coordinates on which the nodes that carry bearings depend. Raises InputError where two share one."""
    found: list[int] = []
    for node in nodes:
        if node.carries:
            own = np.flatnonzero(np.any(node.rows, axis=0)).tolist()
            if shared := set(own) & set(found):
                raise InputError(f"building.nodes[{node.name!r}]: coordinate {min(shared)} is that of another node")
            if len(own) != FREEDOMS or np.linalg.matrix_rank(node.rows[:, own]) < FREEDOMS:
                raise InputError(f"building.nodes[{node.name!r}] depends on {own}: give six different coordinates")
            found += own
    if not found:
        raise InputError("building.nodes: none carries bearings; give at least one with its six coordinates")
    return tuple(sorted(found))


def rigid_motions(nodes: tuple[Node, ...], follow: Array, boundary: tuple[int, ...]) -> Array:
    """Coordinates of the six rigid motions of the building, shape (n, 6).

    follow: static response of all coordinates to those of the boundary, shape (n, boundary).
    """
    motions = np.zeros((len(follow), FREEDOMS))
    for node in nodes:
        if node.carries:
            own = np.flatnonzero(np.any(node.rows, axis=0))
            motions[own] = np.linalg.solve(node.rows[:, own], rigid(node.position))
    moved: Array = follow @ motions[list(boundary)]
    return moved


def check_free(matrix: Array, name: str, motions: Array) -> None:
    """Raise InputError where stiffness or damping resist a rigid motion of the building, which only bearings may do."""
    forces = np.abs(matrix @ motions)
    scale = np.abs(matrix) @ np.abs(motions)
    for index, motion in enumerate(MOTIONS):
        if forces[:, index].max(initial=0.0) > STRAIN * max(float(scale[:, index].max(initial=0.0)), 1e-300):
            remedy = {
                "stiffness": "leave out its supports, which the bearings are, and give the positions of the nodes",
                "damping": "leave it out and give damping_ratio, or give one relative to the attachments",
            }[name]
            raise InputError(f"building.{name} resists a {motion} of the whole building; {remedy}")
