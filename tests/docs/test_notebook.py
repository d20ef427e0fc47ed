"""The notebooks in examples/: well formed, without stored output, and every cell runs."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from support import ROOT

NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))
CELL = {"markdown": {"cell_type", "id", "metadata", "source"}}
CELL["code"] = CELL["markdown"] | {"execution_count", "outputs"}
# As a notebook does: all cells in one namespace, the last expression of each worked out, and shown by its repr.
RUNNER = """
import ast, json, sys
names = {"__name__": "__main__"}
for number, source in enumerate(json.load(sys.stdin)):
    tree = ast.parse(source, f"cell {number}")
    last = tree.body.pop().value if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, f"cell {number}", "exec"), names)
    if last is not None:
        print(f"[{number}]", repr(eval(compile(ast.Expression(last), f"cell {number}", "eval"), names)))
import matplotlib.pyplot as plt
for number in plt.get_fignums():
    plt.figure(number).savefig(f"figure-{number}.png")
"""


def cells(path):
    return json.loads(path.read_text(encoding="utf-8"))["cells"]


def sources(path, kind="code"):
    return ["".join(cell["source"]) for cell in cells(path) if cell["cell_type"] == kind]


def test_there_is_a_notebook():
    assert NOTEBOOKS


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_is_of_format_4_and_holds_no_output(path):
    book = json.loads(path.read_text(encoding="utf-8"))
    assert (book["nbformat"], book["nbformat_minor"]) == (4, 5) and book["metadata"]["kernelspec"]["name"] == "python3"
    assert len({cell["id"] for cell in book["cells"]}) == len(book["cells"])
    for cell in book["cells"]:
        assert set(cell) == CELL[cell["cell_type"]]
        assert cell.get("outputs", []) == [] and cell.get("execution_count") is None
    assert path.stat().st_size < 20e3 and "tests/docs/test_notebook.py" in sources(path, "markdown")[0]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_cell_runs(path, tmp_path, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    code = sources(path)
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", RUNNER],
        input=json.dumps(code),
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    assert "<xarray.Dataset>" in run.stdout and "(True, True)" in run.stdout.splitlines()[-1]
    assert sum(".plot." in cell and "data[" in "".join(code) for cell in code) >= 3  # xarray draws its own data
    assert len(list(tmp_path.glob("figure-*.png"))) == 4
