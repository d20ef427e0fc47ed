"""Public docstrings of arrays state a shape: of what functions and properties return, and of attributes."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import pytest
from support import ROOT

LINKED = {"generator", "templates"}  # the same folders again, under their import names
SOURCES = [p for p in (ROOT / "msfp_gen").rglob("*.py") if not LINKED & set(p.relative_to(ROOT).parts)]
ARRAY = re.compile(r"\b(Array|ndarray|NDArray)\b")
# `shape (k, 3)`, `(k, 3)`, `(u,)`, the dimensions of a row of a result, or where it is described.
SHAPE = re.compile(r"\bshapes?\b|\((?:[\w.+* -]+,)+[\w.+* -]*\)|\bRows\(|\b[Ss]ee `|\b[Aa]s (?:of |in )?`", re.ASCII)


def public(name: str) -> bool:
    return not name.startswith("_") or name == "__call__"


def unstated(text: str) -> Iterator[str]:
    """Names of a module whose arrays have no shape: functions and methods by what they return, and attributes."""
    lines = text.splitlines()

    def walk(node: ast.Module | ast.ClassDef, owner: str) -> Iterator[str]:
        described = ast.get_docstring(node) or ""
        for item in node.body:
            if isinstance(item, ast.ClassDef) and public(item.name):
                yield from walk(item, f"{item.name}.")
            elif isinstance(item, ast.FunctionDef) and public(item.name) and item.returns is not None:
                if ARRAY.search(re.sub(r"Callable\[.*\]", "", ast.unparse(item.returns))) and not SHAPE.search(
                    ast.get_docstring(item) or ""
                ):
                    yield owner + item.name
            elif owner and isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name):
                name = item.target.id
                _, listed, entries = described.partition("Attributes:\n")
                entry = re.search(rf"^ +(?:\w+, )*{name}(?:, \w+)*: (.+(?:\n {{8,}}.+)*)", entries, re.MULTILINE)
                stated = (entry[1] if entry else "") if listed else described
                stated = " ".join([stated, *lines[item.lineno - 1 : item.end_lineno]])
                if public(name) and ARRAY.search(ast.unparse(item.annotation)) and not SHAPE.search(stated):
                    yield owner + name

    yield from walk(ast.parse(text), "")


def test_the_reader_sees_what_has_no_shape() -> None:
    text = '''
class Rows:
    """Rows.

    Attributes:
        time: ndarray, shape (k,), [s].
        force: of the top [N].
    """

    time: Array
    force: Array
    count: int
    sliding: Array  # (k, n-1) [m]

    def peak(self) -> Array:
        """The largest [N]."""

    def _inner(self) -> Array: ...


def mean(x: Array) -> Array:
    """The mean of every column, shape (3,)."""


def total(x: Array) -> tuple[float, Array]:
    """The total."""
'''
    assert list(unstated(text)) == ["Rows.force", "Rows.peak", "total"]


@pytest.mark.parametrize("folder", sorted({path.parent.relative_to(ROOT).as_posix() for path in SOURCES}))
def test_arrays_have_a_shape(folder: str) -> None:
    missing = [
        f"{path.name}: {name}"
        for path in sorted((ROOT / folder).glob("*.py"))
        for name in unstated(path.read_text(encoding="utf-8"))
    ]
    assert not missing, missing
