"""What docs/bearing.md, docs/effects.md and docs/other-programs.md state is what runs and tables give."""

from __future__ import annotations

import csv
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from support import ROOT

from msfp_gen import load_scene, presets, simulate
from msfp_gen.specification import contract

BEARING, COMPARISON, EFFECTS = (
    (ROOT / "docs" / name).read_text(encoding="utf-8") for name in ("bearing.md", "other-programs.md", "effects.md")
)


@pytest.mark.parametrize("stiffness", [1, 10, pytest.param(100, marks=pytest.mark.slow)])
def test_peak_force_and_compression_by_rim_stiffness(stiffness: int) -> None:
    """Test 5 of PEER 2017/07 with other rims, [MN/m]."""
    row = re.search(rf"^\| {stiffness} MN/m[^|]*\| ([\d.]+) kN \| ([\d.]+) mm", BEARING, re.MULTILINE)
    assert row
    scene = load_scene("fenz-test5")
    run = simulate(replace(scene, bearing=scene.bearing.replace(rim_stiffness=stiffness * 1e6)))
    peak = run.summary["peak_force"]["radial"] / 1e3
    assert peak == pytest.approx(float(row[1]), rel=0.01)
    assert -1e3 * run.history.gap[:, 0].min() == pytest.approx(float(row[2]), rel=0.1)


def test_the_monitors_of_notes_are_those_of_the_contract() -> None:
    table = EFFECTS.split("| monitor in the note", 1)[1].split("\n\n", 1)[0]
    named = set(re.findall(r"^\| `(\w+)`", table, re.MULTILINE))
    assert named - {"plane"} <= {word.name for word in contract.MONITORS}


def test_the_comparison_states_the_differences_of_the_validation() -> None:
    text = (ROOT / "benchmarks" / "results" / "comparisons.csv").read_text(encoding="utf-8")
    rows = [row for row in csv.DictReader(text.splitlines()) if row["quantity"] == "largest F/W"]
    ranges = re.search(
        r"differ by (\d+) to (\d+) % .*? with it by ([\d.]+) to ([\d.]+) %", " ".join(COMPARISON.split())
    )
    assert rows and ranges
    told = iter(float(number) / 100 for number in ranges.groups())
    for pivot in (False, True):
        off = np.array([abs(float(row["difference"])) for row in rows if ("at the pivot" in row["source"]) == pivot])
        assert off.min() == pytest.approx(next(told), abs=0.005) and off.max() == pytest.approx(next(told), abs=0.005)


def test_the_licence_is_that_of_the_project() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert f"| licence | {project['license']} |" in COMPARISON


def test_layouts_of_the_page_are_those_of_the_presets() -> None:
    """A preset named in a row has the layout of the row."""
    found = 0
    for row in re.findall(r"^\|.*\|$", BEARING, re.MULTILINE):
        layout = re.search(r"\((\d+), (\d+), (\d+)\)|(\d+)_(\d+)_(\d+)", row)
        for name in re.findall(r"`([\w-]+)`", row):
            if layout and name in presets.names("bearing"):
                own = presets.bearing(name).layout
                assert tuple(int(x) for x in layout.groups() if x) == (own.n, own.m, own.p), row
                found += 1
    assert found > 3
