"""`Building`: a linear superstructure on attachment nodes (docs/buildings.md)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.buildings.matrices import (
    FixedBase,
    Matrix,
    boundary_of,
    check_free,
    check_semidefinite,
    fixed_base,
    matrix_of,
    modal_damping,
    rayleigh_damping,
    rigid_motions,
)
from msfp_gen.buildings.storey import FREEDOMS, BaseSlab, Columns, Node, Storey, frame
from msfp_gen.common.arrays import Array
from msfp_gen.common.fields import require_type
from msfp_gen.errors import InputError

_HIGHEST = 1e6  # frequency [Hz]


@dataclass(frozen=True, eq=False)
class Building:
    """A linear superstructure that only its bearings hold: M, C, K and nodes.

    The coordinates are displacements relative to the position at rest, in axes that do not move; rotations are small.
    Make one with `Building.shear` or `Building.from_matrices`.

    mass, damping, stiffness: ndarray, shape (n, n), [kg], [N s/m], [N/m] and the like for rotations. nodes: points
    whose motion is stated; bearings are attached to those that carry them. columns: of the storeys of a shear frame.
    """

    mass: Array
    damping: Array
    stiffness: Array
    nodes: tuple[Node, ...]
    columns: tuple[Columns, ...] = ()

    @classmethod
    def shear(
        cls,
        base: BaseSlab,
        storeys: Sequence[Storey],
        damping_ratio: float | Sequence[float] = 0.02,
        rayleigh_frequencies: tuple[float, float] | None = None,
    ) -> Building:
        """A frame of rigid floors on columns, its base on the bearings; see `BaseSlab` and `Storey`.

        damping_ratio: of the modes on a fixed base, one for all or one for each from the lowest. rayleigh_frequencies
        [Hz]: the damping is that of Rayleigh with this one ratio at both frequencies. Its node that carries bearings
        is "base", at any place of the plan. Raises InputError.
        """
        require_type(base, BaseSlab, "base")
        for index, storey in enumerate(storeys):
            require_type(storey, Storey, f"storeys[{index}]")
        made = frame(base, storeys)
        damping = _damping(made.mass, made.stiffness, made.nodes, damping_ratio, rayleigh_frequencies)
        return cls(made.mass, damping, made.stiffness, made.nodes, made.columns)._checked()

    @classmethod
    def from_matrices(
        cls,
        mass: Matrix,
        damping: Matrix | None,
        stiffness: Matrix,
        *,
        nodes: Mapping[str, tuple[Sequence[int], ArrayLike]],
        damping_ratio: float | Sequence[float] = 0.02,
        rayleigh_frequencies: tuple[float, float] | None = None,
    ) -> Building:
        """A building of given matrices: square arrays, or files of Matrix Market (.mtx) or NumPy (.npz).

        In a .npz file the arrays are called mass, damping and stiffness. The stiffness is that of the structure without
        supports. damping: None: of the ratio, as in `shear`. nodes: name -> (indices of the six coordinates that are
        displacements along E1, E2, E3 and rotations about them; position [m]), where bearings may be attached. Raises
        InputError.
        """
        m, k = matrix_of(mass, "mass"), matrix_of(stiffness, "stiffness")
        c = None if damping is None else matrix_of(damping, "damping")
        for name, matrix in (("damping", c), ("stiffness", k)):
            if matrix is not None and len(matrix) != len(m):
                raise InputError(f"building.{name} has {len(matrix)} rows: building.mass has {len(m)}; give as many")
        for name, matrix in (("mass", m), ("stiffness", k)):
            check_semidefinite(matrix, name)
        points = tuple(_node(name, *given, len(m)) for name, given in nodes.items())
        if c is None:
            c = _damping(m, k, points, damping_ratio, rayleigh_frequencies)
        return cls(m, c, k, points)._checked()

    @cached_property
    def boundary(self) -> tuple[int, ...]:
        """Coordinates of the nodes that carry bearings."""
        return boundary_of(self.nodes)

    @cached_property
    def fixed(self) -> FixedBase:
        """The building with these coordinates held: frequencies [rad/s] and modes."""
        return fixed_base(self.mass, self.stiffness, self.boundary)

    @property
    def frequencies(self) -> Array:
        """Natural frequencies on fixed attachments, ascending, shape (modes,) [Hz]; without damping."""
        return self.fixed.frequencies / (2 * np.pi)

    @cached_property
    def rigid_motions(self) -> Array:
        """Coordinates of the six rigid motions of the whole about the origin: ndarray, shape (n, 6)."""
        return rigid_motions(self.nodes, self._static(self.fixed), self.boundary)

    def uniform_acceleration(self, acceleration: ArrayLike) -> Array:
        """Forces on the coordinates under which the building accelerates as one, shape (n,); acceleration [m/s^2].

        Gravity is the force of (0, 0, -g).
        """
        forces: Array = self.mass @ self.rigid_motions[:, :3] @ np.asarray(acceleration, dtype=float)
        return forces

    def node(self, name: str) -> Node:
        """The node of that name. Raises InputError: there is none."""
        for node in self.nodes:
            if node.name == name:
                return node
        names = ", ".join(repr(node.name) for node in self.nodes)
        raise InputError(f"node = {name!r}: the building has no such node; give one of {names}")

    def reduced(self, frequency: float) -> Building:
        """The building by Craig and Bampton: its attachments, and its modes on fixed attachments up to a frequency.

        frequency [Hz]. The coordinates are those of the attachments, with the static response of the rest, and the
        modal coordinates. Nodes and columns are those of the whole building. Raises InputError.
        """
        if not 0 < float(frequency) < _HIGHEST:
            raise InputError(f"frequency = {frequency!r}: give a number above 0 and below {_HIGHEST:g} [Hz]")
        fixed = self.fixed
        kept = fixed.frequencies <= 2 * np.pi * frequency
        modes = np.zeros((len(self.mass), int(kept.sum())))
        modes[fixed.inner] = fixed.modes[:, kept]
        basis = np.hstack([self._static(fixed), modes])
        nodes = tuple(Node(node.name, node.position, node.rows @ basis, node.carries) for node in self.nodes)
        columns = tuple(Columns(each.name, each.deformation @ basis, each.inertia @ basis) for each in self.columns)
        mass, damping, stiffness = (_congruent(each, basis) for each in (self.mass, self.damping, self.stiffness))
        return Building(mass, damping, stiffness, nodes, columns)

    def _checked(self) -> Building:
        check_semidefinite(self.damping, "damping")
        for name in ("stiffness", "damping"):
            check_free(getattr(self, name), name, self.rigid_motions)
        return self

    def _static(self, fixed: FixedBase) -> Array:
        """All coordinates from those of the attachments, shape (n, boundary)."""
        rows = np.zeros((len(self.mass), len(fixed.boundary)))
        rows[fixed.boundary] = np.eye(len(fixed.boundary))
        rows[fixed.inner] = fixed.follow
        return rows


def _congruent(matrix: Array, basis: Array) -> Array:
    product: Array = basis.T @ matrix @ basis
    return (product + product.T) / 2


def _node(name: str, indices: Sequence[int], position: ArrayLike, count: int) -> Node:
    path = f"building.nodes[{name!r}]"
    own = np.asarray(indices)
    if own.shape != (FREEDOMS,) or own.dtype.kind not in "iu" or len(set(own.tolist())) < FREEDOMS:
        raise InputError(f"{path}: {list(indices)} are not six different indices; give those of u1 ... and rotations")
    if own.min() < 0 or own.max() >= count:
        raise InputError(f"{path}: {own.tolist()} has an index outside of 0 ... {count - 1}")
    place = np.asarray(position, dtype=float)
    if place.shape != (3,) or not np.all(np.isfinite(place)):
        raise InputError(f"{path}: position = {position!r}; give three finite numbers [m]")
    return Node(name, place, np.eye(count)[own], carries=True)


def _damping(
    mass: Array,
    stiffness: Array,
    nodes: tuple[Node, ...],
    ratio: float | Sequence[float],
    frequencies: tuple[float, float] | None,
) -> Array:
    ratios = np.atleast_1d(np.asarray(ratio, dtype=float))
    if ratios.ndim != 1 or not ratios.size or not np.all((ratios >= 0) & (ratios < 1)):
        raise InputError(f"building.damping_ratio = {ratio!r}: give a number, or a list, from 0 to below 1")
    fixed = fixed_base(mass, stiffness, boundary_of(nodes))
    if frequencies is None:
        return modal_damping(mass, fixed, ratios)
    pair = np.asarray(frequencies, dtype=float)
    if pair.shape != (2,) or not 0 < pair[0] < pair[1] < _HIGHEST or len(ratios) > 1:
        raise InputError(
            f"building.rayleigh_frequencies = {frequencies!r}: give two rising frequencies [Hz] and one damping_ratio"
        )
    return rayleigh_damping(mass, stiffness, fixed, float(ratios[0]), (float(pair[0]), float(pair[1])))
