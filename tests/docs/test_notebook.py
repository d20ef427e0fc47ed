"""The notebooks in examples/: well formed, without stored output, and every cell runs."""

from __future__ import annotations

import json
import re
import subprocess
import sys

import numpy as np
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


@pytest.mark.slow
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
    CHECKS[path.stem](run.stdout, code)
    assert len(list(tmp_path.glob("figure-*.png"))) == FIGURES[path.stem]


def check_earthquake(printed, code):
    assert "<xarray.Dataset>" in printed and "(True, True)" in printed.splitlines()[-1]
    assert sum(".plot." in cell and "data[" in "".join(code) for cell in code) >= 3  # xarray draws its own data


def check_design(printed, code):
    """The optimum is the one that docs/design.md states and a scan confirms (benchmarks/design.py)."""
    found = re.search(
        r"friction (\S+), radius (\S+) m, shear (\S+), (\d+) iterations: Optimization terminated", printed
    )
    assert [float(value) for value in found.groups()[:3]] == pytest.approx([0.0836, 1.252, 0.1700], rel=2e-3)
    assert int(found[4]) <= 12
    (displacement, shear), (other, less) = np.array(re.findall(r"0\.\d+", printed.split("array(")[-1]), float).reshape(
        2, 2
    )
    assert displacement == pytest.approx(0.2, rel=1e-3) == other, "both limits are reached"
    assert less < shear == pytest.approx(float(found[3]), rel=1e-3), "the bound is the larger shear"


def test_the_design_page_shows_the_code_of_its_notebook():
    page = (ROOT / "docs" / "design.md").read_text(encoding="utf-8")
    shown = re.findall(r"^```python\n(.*?)^```$", page, flags=re.MULTILINE | re.DOTALL)
    code = "\n".join(sources(ROOT / "examples" / "design.ipynb"))
    parts = [part for block in shown for part in block.strip().split("\n\n\n")]
    assert len(parts) == 4 and all(part in code for part in parts)


CHECKS = {"earthquake": check_earthquake, "design": check_design}
FIGURES = {"earthquake": 4, "design": 1}
