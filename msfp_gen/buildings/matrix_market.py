"""Reader of Matrix Market files; that of SciPy 1.17.1 ends Python on some damaged ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from msfp_gen.common.arrays import Array

Indices = NDArray[np.intp]
_FORMS = {"coordinate": 3, "array": 2}  # with the number of sizes
_HEADER = "%%MatrixMarket matrix coordinate|array real|integer general|symmetric"


def read_matrix(text: str, most: int) -> Array:
    """The matrix of a file, real, general or symmetric, dense or as coordinates: ndarray, shape (rows, columns), [SI].

    most: largest number of rows and of columns. Raises ValueError of one line.
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
    at = _places(values, shape) if form == "coordinate" else _columns(shape, symmetry)
    expected = int(rows[0][2]) if form == "coordinate" else len(at[0])
    if len(values) != expected:
        raise ValueError(f"{len(values)} entries, the line of sizes says {expected}")
    matrix = np.zeros(shape)
    np.add.at(matrix, at, values[:, -1])
    return matrix if symmetry == "general" else matrix + np.tril(matrix, -1).T + np.triu(matrix, 1).T


def _places(values: Array, shape: tuple[int, int]) -> tuple[Indices, Indices]:
    """Row and column of every entry, from 0."""
    places = values[:, :2]
    if not np.all((places >= 1) & (places <= shape) & (places == np.floor(places))):
        raise ValueError("an entry is outside the matrix; rows and columns are counted from 1")
    indices = places.astype(np.intp) - 1
    return indices[:, 0], indices[:, 1]


def _columns(shape: tuple[int, int], symmetry: str) -> tuple[Indices, Indices]:
    """Row and column of the entries of a dense matrix, by columns; of a symmetric one, from the diagonal on."""
    columns, rows = (index.ravel() for index in np.indices(shape[::-1]))
    kept = rows >= columns if symmetry == "symmetric" else np.full(rows.shape, True)
    return rows[kept], columns[kept]
