"""Public docstrings state shape and unit of arrays, private ones are one line."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from support import ROOT

LINKED = {"generator", "templates"}  # the same folders again, under their import names
SOURCES = [p for p in (ROOT / "msfp_gen").rglob("*.py") if not LINKED & set(p.relative_to(ROOT).parts)]
ARRAY = re.compile(r"\b(Array|ndarray|NDArray)\b")
# `shape (k, 3)`, `(k, 3)`, `(u,)`, the dimensions of a row of a result, or where it is described.
SHAPE = re.compile(
    r"\bshapes?\b|\((?:[\w.+* -]+,)+[\w.+* -]*\)|\bRowField\(|\b[Ss]ee `|\b[Aa]s (?:of |in )?`", re.ASCII
)
# `[m/s^2]`, `[N, N m]`, `[-]` for a number, `[SI]` where numbers of several units are side by side, the unit of another
# value, the dimensions of a row of a result, or where it is described. Truth values and indices have no unit.
SYMBOL = r"(?:1|m|s|kg|N|J|W|Pa|K|degC|rad|Hz|g)(?:\^-?\d)?"
UNITS = rf"{SYMBOL}(?:[ /]{SYMBOL})*"
OF_ANOTHER = r"unit|its unit(?: squared)?|(?:\w+ )*units? of [^\]]+"
UNIT = re.compile(
    rf"\[(?:-|SI|{UNITS}(?:, {UNITS})*|{OF_ANOTHER})\]"
    r"|\bRowField\(|\b[Ss]ee `|\b[Aa]s (?:of|in) `|\bunits? (?:of|in) `",
    re.ASCII,
)
UNITLESS_ARRAY = re.compile(r"(?:NDArray\[|ndarray\[Any, np\.dtype\[)np\.(?:bool_|intp|int64)\]")


def public(name: str) -> bool:
    return not name.startswith("_") or name == "__call__"


def unstated(text: str) -> Iterator[str]:
    """What is missing of the arrays of a module: of what functions and methods return, and of attributes."""
    lines = text.splitlines()

    def missing(name: str, annotation: str, stated: str) -> Iterator[str]:
        if ARRAY.search(annotation) and not SHAPE.search(stated):
            yield f"shape of {name}"
        if ARRAY.search(UNITLESS_ARRAY.sub("", annotation)) and not UNIT.search(stated):
            yield f"unit of {name}"

    def walk(node: ast.Module | ast.ClassDef, owner: str) -> Iterator[str]:
        described = ast.get_docstring(node) or ""
        for item in node.body:
            if isinstance(item, ast.ClassDef) and public(item.name):
                yield from walk(item, f"{item.name}.")
            elif isinstance(item, ast.FunctionDef) and public(item.name) and item.returns is not None:
                returned = re.sub(r"Callable\[.*\]", "", ast.unparse(item.returns))
                yield from missing(owner + item.name, returned, ast.get_docstring(item) or "")
            elif owner and isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name):
                name = item.target.id
                _, listed, entries = described.partition("Attributes:\n")
                entry = re.search(rf"^ +(?:\w+, )*{name}(?:, \w+)*: (.+(?:\n {{8,}}.+)*)", entries, re.MULTILINE)
                stated = (entry[1] if entry else "") if listed else described
                stated = " ".join([stated, *lines[item.lineno - 1 : item.end_lineno]])
                if public(name):
                    yield from missing(owner + name, ast.unparse(item.annotation), stated)

    yield from walk(ast.parse(text), "")


def test_the_reader_sees_what_has_no_shape_or_unit() -> None:
    text = '''
class History:
    """Rows.

    Attributes:
        time: ndarray, shape (k,), [s].
        force: of the top [N].
    """

    time: Array
    force: Array
    count: int
    sliding: Array  # (k, n-1) [m]
    met: NDArray[np.bool_]  # (k, n-1)

    def peak(self) -> Array:
        """The largest [N]."""

    def at(self, time: float) -> Array:
        """Those at a time, shape (3,), by the index rows[i]."""

    def _inner(self) -> Array: ...


def mean(x: Array) -> Array:
    """The mean of every column, shape (3,) [unit of `x`]."""


def total(x: Array) -> tuple[float, Array]:
    """The total."""
'''
    missing = [
        "shape of History.force",
        "shape of History.peak",
        "unit of History.at",
        "shape of total",
        "unit of total",
    ]
    assert list(unstated(text)) == missing


def test_arrays_have_a_shape_and_a_unit() -> None:
    for folder in sorted({path.parent.relative_to(ROOT).as_posix() for path in SOURCES}):
        missing = [
            f"{path.name}: {name}"
            for path in sorted((ROOT / folder).glob("*.py"))
            for name in unstated(path.read_text(encoding="utf-8"))
        ]
        assert not missing, missing


def private_functions(node: ast.AST, inside: bool = False) -> Iterator[ast.FunctionDef]:
    """Functions with an underscore, and those in functions."""
    for item in ast.iter_child_nodes(node):
        is_function = isinstance(item, ast.FunctionDef)
        if is_function and (inside or (not public(item.name) and not item.name.startswith("__"))):
            yield item
        yield from private_functions(item, inside or is_function)


def test_docstrings_of_private_functions_are_one_line() -> None:
    long = [
        f"{path.relative_to(ROOT)}:{function.lineno}: {function.name}"
        for path in (*SOURCES, *sorted((ROOT / "generator").glob("*.py")))
        for function in private_functions(ast.parse(path.read_text(encoding="utf-8")))
        if "\n" in (ast.get_docstring(function) or "")
    ]
    assert not long, long
    text = "class A:\n    def _inner(self):\n        '''One.\n\n        Two.\n        '''\n"
    assert [function.name for function in private_functions(ast.parse(text))] == ["_inner"]
