"""Matrix Market files as SciPy writes and reads them, and the line for each kind of damage."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from scipy.io import mmread, mmwrite
from scipy.sparse import coo_array

from msfp_gen.buildings.building import read_matrix

GENERAL = np.array([[2.0, -0.5, 0.0], [1e-7, 3.0, 1 / 3], [0.0, 0.25, -1.5]])
HEAD = "%%MatrixMarket matrix coordinate real symmetric\n"


@pytest.mark.parametrize("matrix", [GENERAL, GENERAL + GENERAL.T, GENERAL[:2]], ids=["general", "symmetric", "oblong"])
@pytest.mark.parametrize("form", [np.array, coo_array], ids=["array", "coordinate"])
def test_files_of_scipy(matrix: np.ndarray, form: type) -> None:
    file = BytesIO()
    mmwrite(file, form(matrix), comment="two\nlines", precision=17)
    text = file.getvalue()
    expected = mmread(BytesIO(text))
    expected = expected.toarray() if hasattr(expected, "toarray") else expected
    assert np.array_equal(read_matrix(text.decode(), 5), expected) and np.array_equal(expected, matrix)


def test_entries_that_are_given_twice_are_added() -> None:
    assert np.array_equal(read_matrix(HEAD + "2 2 3\n1 1 1\n2 1 2\n2 1 3\n", 5), [[1, 5], [5, 0]])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the first line is not"),
        (HEAD.replace("real", "complex") + "1 1 1\n1 1 2 3\n", "'complex'"),
        (HEAD, "the line of sizes"),
        (HEAD + "2 -2 1\n1 1 1\n", "the line of sizes"),
        (HEAD + "2 3 1\n1 1 1\n", "symmetric matrix of the size 2 x 3"),
        (HEAD + "6 6 1\n1 1 1\n", "at most 5"),
        (HEAD + "2 2 2\n1 1 1\n", "1 entries, the line of sizes says 2"),
        (HEAD + "2 2 1\n3 1 1\n", "outside the matrix"),
        (HEAD + "2 2 1\n1.5 1 1\n", "outside the matrix"),
        (HEAD + "2 2 1\n1 1\n", "has not 3 numbers"),
        (HEAD + "2 2 1\n1 1 x\n", "could not convert"),
    ],
)
def test_damage(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        read_matrix(text, 5)
