"""`Building`: a linear superstructure with nodes for bearings, from a frame or from matrices (docs/buildings.md).

Floors and columns, or arrays and files, come in; M, C, K and nodes go out, for a `BuildingScene`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from io import BytesIO
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.buildings.oscillators import FixedBase, Oscillators
from msfp_gen.buildings.storey import FREEDOMS, MOTIONS, BaseSlab, Node, Storey, StoreyColumns, frame, rigid
from msfp_gen.common.arrays import Array, Indices
from msfp_gen.common.errors import InputError, MsfpError
from msfp_gen.common.fields import LARGEST, quantities, require_type
from msfp_gen.common.inputs import read_input
from msfp_gen.common.tables import LabelledValues, Printed

_FORMS = {"coordinate": 3, "array": 2}  # form of a Matrix Market file -> numbers in the line of sizes
_HEADER = "%%MatrixMarket matrix coordinate|array real|integer general|symmetric"


def read_matrix(text: str, most: int) -> Array:
    """The matrix in the text of a Matrix Market file: ndarray, shape (rows, columns), [SI].

    Real or integer, general or symmetric, dense or as coordinates. most: largest number of rows and of columns. Raises
    ValueError of one line.
    """
    lines = text.splitlines()
    words = lines[0].lower().split() if lines else []
    if len(words) != 5 or words[:2] != ["%%matrixmarket", "matrix"]:
        raise ValueError(f"the first line is not {_HEADER}")
    form, field, symmetry = words[2:]
    if form not in _FORMS or field not in ("real", "integer") or symmetry not in ("general", "symmetric"):
        raise ValueError(f"{form[:20]!r} {field[:20]!r} {symmetry[:20]!r} in the first line; give {_HEADER}")
    rows = [line.split() for line in lines[1:] if line.strip() and not line.lstrip().startswith("%")]
    if not rows or len(rows[0]) != _FORMS[form] or not all(word.isdecimal() for word in rows[0]):
        raise ValueError(f"the line of sizes has not {_FORMS[form]} whole numbers")
    shape = int(rows[0][0]), int(rows[0][1])
    if not all(0 < size <= most for size in shape) or (symmetry == "symmetric" and shape[0] != shape[1]):
        raise ValueError(f"a {symmetry} matrix of the size {rows[0][0][:12]} x {rows[0][1][:12]}; at most {most}")
    width = 3 if form == "coordinate" else 1
    if any(len(row) != width for row in rows[1:]):
        raise ValueError(f"a line of an entry has not {width} numbers")
    values = np.array(rows[1:], dtype=float).reshape(-1, width)
    at = _indices_of_coordinates(values, shape) if form == "coordinate" else _indices_of_array(shape, symmetry)
    expected = int(rows[0][2]) if form == "coordinate" else len(at[0])
    if len(values) != expected:
        raise ValueError(f"{len(values)} entries, the line of sizes says {expected}")
    matrix = np.zeros(shape)
    np.add.at(matrix, at, values[:, -1])
    return matrix if symmetry == "general" else matrix + np.tril(matrix, -1).T + np.triu(matrix, 1).T


def _indices_of_coordinates(values: Array, shape: tuple[int, int]) -> tuple[Indices, Indices]:
    """Row and column of every entry of the form "coordinate", from 0, shape (entries,). Raises ValueError."""
    positions = values[:, :2]
    if not np.all((positions >= 1) & (positions <= shape) & (positions == np.floor(positions))):
        raise ValueError("an entry is outside the matrix; rows and columns are counted from 1")
    indices = positions.astype(np.intp) - 1
    return indices[:, 0], indices[:, 1]


def _indices_of_array(shape: tuple[int, int], symmetry: str) -> tuple[Indices, Indices]:
    """Row and column of every entry of the form "array", from 0, shape (entries,)."""
    # Entries are by columns; a column of a symmetric matrix begins at the diagonal.
    columns, rows = (index.ravel() for index in np.indices(shape[::-1]))
    stored = rows >= columns if symmetry == "symmetric" else np.full(rows.shape, True)
    return rows[stored], columns[stored]


_HIGHEST = 1e6  # largest frequency that is accepted [Hz]


@dataclass(frozen=True, eq=False, repr=False)
class Building(Printed):
    """A linear superstructure that is held by its bearings alone: M, C, K and nodes.

    The coordinates are displacements relative to the position at rest, in axes that do not move; rotations are small.
    `Building.shear` and `Building.from_matrices` make one.

    mass, damping, stiffness: ndarray, shape (n, n), [kg], [N s/m], [N/m] and the like for rotations. nodes: points
    whose motion is a result; bearings are attached to nodes with `carries`. columns: of the storeys of a shear frame.
    """

    mass: Array
    damping: Array
    stiffness: Array
    nodes: tuple[Node, ...]
    columns: tuple[StoreyColumns, ...] = ()

    def printed_rows(self) -> tuple[str, LabelledValues]:
        """Sizes and frequencies in four rows."""
        listed = ", ".join(f"{frequency:.4g}" for frequency in self.frequencies[:6])
        more = f", ... of {len(self.frequencies)}" if len(self.frequencies) > 6 else ""
        rows = [
            ("mass", f"{self.uniform_acceleration((0, 0, 1)) @ self.rigid_motions[:, 2]:.6g} kg"),
            ("nodes", ", ".join(node.name for node in self.nodes)),
            ("coordinates", str(len(self.mass))),
            ("frequencies", f"{listed}{more} Hz on a fixed base" if listed else "none: a rigid body"),
        ]
        return "Building", rows

    @classmethod
    @quantities(damping_ratio="", rayleigh_frequencies="Hz")
    def shear(
        cls,
        base: BaseSlab,
        storeys: Sequence[Storey],
        damping_ratio: float | Sequence[float] = 0.02,
        rayleigh_frequencies: tuple[float, float] | None = None,
    ) -> Building:
        """A frame of rigid floors on columns, with its base on the bearings; see `BaseSlab` and `Storey`.

        Bearings are attached to the node "base", at any position in plan. The node of a floor is its centre of mass.

        damping_ratio: of the modes on a fixed base: one number for all modes, or one for each mode from the lowest.
        rayleigh_frequencies: two frequencies at which Rayleigh damping has the damping ratio, then one number [Hz].
        Raises InputError.
        """
        require_type(base, BaseSlab, "base")
        for index, storey in enumerate(storeys):
            require_type(storey, Storey, f"storeys[{index}]")
        mass, stiffness, nodes, columns = frame(base, storeys)
        undamped = cls(mass, np.zeros_like(mass), stiffness, nodes, columns)
        return undamped._damped(damping_ratio, rayleigh_frequencies)

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

        The arrays of a .npz file have the names mass, damping and stiffness. stiffness: of the structure without
        supports. damping: None: by damping_ratio, as in `shear`. nodes: to which bearings may be attached, name ->
        (indices of the six coordinates of displacements along E1, E2, E3 and rotations about these axes; position [m]).
        Raises InputError.
        """
        m, k = matrix_of(mass, "mass"), matrix_of(stiffness, "stiffness")
        c = np.zeros_like(m) if damping is None else matrix_of(damping, "damping")
        for name, matrix in (("damping", c), ("stiffness", k)):
            if len(matrix) != len(m):
                raise InputError(f"building.{name} has {len(matrix)} rows: building.mass has {len(m)}; give as many")
        for name, matrix in (("mass", m), ("stiffness", k)):
            check_semidefinite(matrix, name)
        points = tuple(_node(name, *place, len(m)) for name, place in nodes.items())
        building = cls(m, c, k, points)
        return building._damped(damping_ratio, rayleigh_frequencies) if damping is None else building._checked()

    @cached_property
    def boundary(self) -> tuple[int, ...]:
        """Indices of the coordinates of the nodes that carry bearings. Raises InputError where nodes share any."""
        boundary: list[int] = []
        first: dict[int, Node] = {}  # of each coordinate
        for node in self.nodes:
            if node.carries:
                own = np.flatnonzero(np.any(node.rows, axis=0)).tolist()
                if (shared := first.keys() & set(own)) and not _linked(node, [first.get(index) for index in own]):
                    raise InputError(f"building.nodes[{node.name!r}]: coordinate {min(shared)} belongs to another node")
                if len(own) != FREEDOMS or np.linalg.matrix_rank(node.rows[:, own]) < FREEDOMS:
                    raise InputError(f"building.nodes[{node.name!r}] depends on {own}: give six different coordinates")
                boundary += [] if shared else own
                first = dict.fromkeys(own, node) | first
        if not boundary:
            raise InputError("building.nodes: none carries bearings; give at least one with its six coordinates")
        return tuple(sorted(boundary))

    @cached_property
    def fixed(self) -> FixedBase:
        """The building with the coordinates of `boundary` fixed. Raises InputError where other parts move freely."""
        from scipy.linalg import eigh

        boundary = np.asarray(self.boundary, dtype=int)
        inner = np.setdiff1d(np.arange(len(self.mass)), boundary)
        if not inner.size:
            return FixedBase(boundary, inner, np.zeros((0, boundary.size)), np.zeros(0), *2 * (np.zeros((0, 0)),))
        k, m = self.stiffness[np.ix_(inner, inner)], self.mass[np.ix_(inner, inner)]
        lowest = float(np.linalg.eigvalsh(k)[0])
        if lowest <= 1e-14 * float(np.abs(k).max()):
            raise InputError(
                f"building.stiffness: on fixed attachments its least eigenvalue is {lowest:.3g}, so that parts move "
                "without force; connect or remove them"
            )
        # M x = K x / w^2 instead of K x = w^2 M x: K has an inverse; coordinates without mass give eigenvalues of zero.
        squares, vectors = eigh(m, k)
        with_mass = squares > 1e-14 * max(float(squares[-1]), 0.0)
        order = np.flatnonzero(with_mass)[::-1]
        modes = vectors[:, order] / np.sqrt(squares[order])
        follow = -np.linalg.solve(k, self.stiffness[np.ix_(inner, boundary)])
        return FixedBase(boundary, inner, follow, 1 / np.sqrt(squares[order]), modes, vectors[:, ~with_mass])

    @cached_property
    def oscillators(self) -> Oscillators:
        """The attachments of the bearings, and an oscillator on them for each mode. Raises InputError, as `fixed`."""
        return Oscillators.of(self.fixed, self.mass, self.damping, self.stiffness)

    @property
    def frequencies(self) -> Array:
        """Natural frequencies of the undamped building on fixed attachments, ascending, shape (modes,) [Hz]."""
        return self.fixed.frequencies / (2 * np.pi)

    @cached_property
    def rigid_motions(self) -> Array:
        """Coordinates in the six rigid motions of the building about the origin: ndarray, shape (n, 6), [SI]."""
        motions = np.zeros((len(self.mass), FREEDOMS))
        for node in self.nodes:
            if node.carries:
                own = np.flatnonzero(np.any(node.rows, axis=0))
                motions[own] = np.linalg.solve(node.rows[:, own], rigid(node.position))
        moved: Array = self._static @ motions[list(self.boundary)]
        return moved

    def uniform_acceleration(self, acceleration: ArrayLike) -> Array:
        """Forces on the coordinates under which all points of the building have one acceleration, shape (n,) [SI].

        acceleration: shape (3,) [m/s^2]; (0, 0, -g) gives the forces of gravity.
        """
        forces: Array = self.mass @ self.rigid_motions[:, :3] @ np.asarray(acceleration, dtype=float)
        return forces

    def node(self, name: str) -> Node:
        """The node of a name. Raises InputError where there is none."""
        for node in self.nodes:
            if node.name == name:
                return node
        names = ", ".join(repr(node.name) for node in self.nodes)
        raise InputError(f"node = {name!r}: the building has no such node; give one of {names}")

    def reduced(self, frequency: float) -> Building:
        """The building reduced by the method of Craig and Bampton. frequency: of the highest mode that is kept [Hz].

        The coordinates are the coordinates of the attachments, which the rest follows statically, and amplitudes of the
        modes on fixed attachments. All nodes and columns are kept. Raises InputError.
        """
        if not 0 < float(frequency) < _HIGHEST:
            raise InputError(f"frequency = {frequency!r}: give a number above 0 and below {_HIGHEST:g} [Hz]")
        fixed = self.fixed
        low = fixed.frequencies <= 2 * np.pi * frequency
        modes = np.zeros((len(self.mass), int(low.sum())))
        modes[fixed.inner] = fixed.modes[:, low]
        basis = np.hstack([self._static, modes])
        nodes = tuple(replace(node, rows=node.rows @ basis) for node in self.nodes)
        columns = tuple(
            StoreyColumns(column.name, column.deformation @ basis, column.inertia @ basis) for column in self.columns
        )
        mass, damping, stiffness = (_congruent(matrix, basis) for matrix in (self.mass, self.damping, self.stiffness))
        return Building(mass, damping, stiffness, nodes, columns)

    def _damped(self, ratio: float | Sequence[float], frequencies: tuple[float, float] | None) -> Building:
        """The building with damping of its modes on fixed attachments, or Rayleigh damping C = a M + b K."""
        # ratio, frequencies: see `shear`. M: of the motion relative to the attachments. Raises InputError.
        ratios = np.atleast_1d(np.asarray(ratio, dtype=float))
        if ratios.ndim != 1 or not ratios.size or not np.all((ratios >= 0) & (ratios < 1)):
            raise InputError(f"building.damping_ratio = {ratio!r}: give a number, or a list, from 0 to below 1")
        fixed, rows = self.fixed, self.fixed.relative
        mass = self.mass[np.ix_(fixed.inner, fixed.inner)]
        if frequencies is None:
            count = len(fixed.frequencies)
            of_modes = np.pad(ratios, (0, max(count - len(ratios), 0)), "edge")[:count]
            modal = fixed.modes.T @ mass @ rows
            return replace(self, damping=modal.T * (2 * of_modes * fixed.frequencies) @ modal)._checked()
        pair = np.asarray(frequencies, dtype=float)
        if pair.shape != (2,) or not 0 < pair[0] < pair[1] < _HIGHEST or len(ratios) > 1:
            raise InputError(
                f"building.rayleigh_frequencies = {frequencies!r}: give two rising frequencies [Hz] and one "
                "damping_ratio"
            )
        low, high = 2 * np.pi * pair
        a, b = 2 * ratios[0] * low * high / (low + high), 2 * ratios[0] / (low + high)
        return replace(self, damping=a * rows.T @ mass @ rows + b * self.stiffness)._checked()

    def _checked(self) -> Building:
        """The building; raises InputError where stiffness or damping resist a rigid motion, as only bearings may."""
        check_semidefinite(self.damping, "damping")
        remedies = {
            "stiffness": "leave out its supports, which the bearings are, and give the positions of the nodes",
            "damping": "leave it out and give damping_ratio, or give one relative to the attachments",
        }
        for name, remedy in remedies.items():
            matrix = getattr(self, name)
            forces, scale = np.abs(matrix @ self.rigid_motions), np.abs(matrix) @ np.abs(self.rigid_motions)
            for index, motion in enumerate(MOTIONS):
                if forces[:, index].max(initial=0.0) > STRAIN * max(float(scale[:, index].max(initial=0.0)), 1e-300):
                    raise InputError(f"building.{name} resists a {motion} of the whole building; {remedy}")
        return self

    @property
    def _static(self) -> Array:
        """Static response of all coordinates to the coordinates of the attachments, shape (n, boundary) [SI]."""
        fixed = self.fixed
        rows = np.zeros((len(self.mass), len(fixed.boundary)))
        rows[fixed.boundary] = np.eye(len(fixed.boundary))
        rows[fixed.inner] = fixed.follow
        return rows


def _linked(node: Node, others: Sequence[Node | None]) -> bool:
    """Whether a node is part of the rigid body of one other, whose coordinates it has."""
    body = others[0]
    if body is None or any(other is not body for other in others):
        return False
    return np.allclose(node.rows, body.linked(node.position), rtol=0.0, atol=1e-9 * float(np.abs(node.rows).max()))


def _congruent(matrix: Array, basis: Array) -> Array:
    """A symmetric matrix in the coordinates of a basis."""
    product: Array = basis.T @ matrix @ basis
    return (product + product.T) / 2


def _node(name: str, indices: Sequence[int], position: ArrayLike, count: int) -> Node:
    """A node by the indices of its six coordinates among `count`. Raises InputError."""
    path = f"building.nodes[{name!r}]"
    own = np.asarray(indices)
    if own.shape != (FREEDOMS,) or own.dtype.kind not in "iu" or len(set(own.tolist())) < FREEDOMS:
        raise InputError(
            f"{path}: {list(indices)} are not six different indices; give one each for u1 ... and rotations"
        )
    if own.min() < 0 or own.max() >= count:
        raise InputError(f"{path}: {own.tolist()} has an index outside of 0 ... {count - 1}")
    place = np.asarray(position, dtype=float)
    if place.shape != (3,) or not np.all(np.isfinite(place)):
        raise InputError(f"{path}: position = {position!r}; give three finite numbers [m]")
    return Node(name, place, np.eye(count)[own], carries=True)


MOST = 5000  # coordinates of a building, whose matrices are dense
SYMMETRY = 1e-9  # largest difference of a matrix from its transpose, relative to its largest entry
STRAIN = 1e-6  # largest force in a rigid motion, over the sum of the sizes of its terms
Matrix = ArrayLike | str | PathLike[str]


def matrix_of(source: Matrix, name: str) -> Array:
    """A square symmetric matrix, ndarray, shape (n, n), [SI].

    source: an array, or a file of Matrix Market (.mtx) or of NumPy (.npz, the array `name`).

    Raises InputError that names `building.name`.
    """
    path = f"building.{name}"
    values = _read(Path(source), path, name) if isinstance(source, str | PathLike) else source
    try:
        if np.iscomplexobj(values):
            raise TypeError
        matrix = np.array(values.toarray() if hasattr(values, "toarray") else values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{path}: these are no real numbers; give a square array or the path of a file") from None
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not 0 < len(matrix) <= MOST:
        raise InputError(f"{path} has the shape {matrix.shape}: give a square matrix of 1 to {MOST} coordinates")
    if not np.all(np.abs(matrix) <= LARGEST):
        row, column = np.argwhere(~(np.abs(matrix) <= LARGEST))[0]
        raise InputError(f"{path}[{row}, {column}] = {matrix[row, column]}: give finite numbers up to {LARGEST:g}")
    difference = np.abs(matrix - matrix.T)
    if difference.max() > SYMMETRY * np.abs(matrix).max():
        row, column = np.unravel_index(int(difference.argmax()), matrix.shape)
        raise InputError(
            f"{path}[{row}, {column}] = {matrix[row, column]:.9g} and [{column}, {row}] = {matrix[column, row]:.9g}: "
            "give a symmetric matrix"
        )
    average: Array = (matrix + matrix.T) / 2
    return average


def _read(path: Path, field: str, name: str) -> Any:
    """The array `name` of a file. field: path of the input, for messages. Raises InputError."""
    try:
        if path.suffix == ".npz":
            with np.load(BytesIO(read_input(path)), allow_pickle=False) as file:
                if name not in file:
                    raise InputError(f"{field} = {str(path)!r}: it has no array {name!r} but {', '.join(file)}")
                return file[name]
        if path.suffix == ".mtx":
            return read_matrix(read_input(path).decode("utf-8"), MOST)
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
