"""docs/results.md says what runs give: the verdicts of the hospital, the keys, and what scenes reach."""

from __future__ import annotations

import re
import sys
from dataclasses import fields
from typing import Any

import pytest
from support import ROOT

from msfp_gen import Limits, load_scene
from msfp_gen.cli import main
from msfp_gen.results.verdict import LIMITS

sys.path.append(str(ROOT / "benchmarks"))
import limits

PAGE = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
ROWS = [[cell.strip() for cell in line.split("|")[1:-1]] for line in PAGE.splitlines() if line.startswith("| C")]
LONG = 21.0  # of the runs of single rows: rims are met before [s]
SHORT = [("CCC", scale, "lower") for scale in ("1", "2")]


def same(shown: list[str], result: Any) -> None:
    """Words as they are, numbers as far as they hold on every machine."""
    found = limits.cells(result)
    assert found[0] == shown[0], (shown, found)
    u, capacity, force = (float(cell) for cell in found[1:4])
    assert u == pytest.approx(float(shown[1]), rel=0.02, abs=1.0)
    assert capacity == pytest.approx(float(shown[2]), abs=0.02)
    assert force == pytest.approx(float(shown[3]), rel=0.1, abs=0.02)


def test_the_table_has_every_run() -> None:
    runs = [(record, scale, case) for record in ("CCC", "CLC") for scale in ("1", "1.5", "2") for case in limits.CASES]
    assert [tuple(row[:3]) for row in ROWS] == runs


@pytest.mark.slow  # a model of their own, whose bearings lift off
@pytest.mark.parametrize("run", SHORT, ids="-".join)
def test_a_row_of_the_hospital(run: tuple[str, str, str]) -> None:
    record, scale, case = run
    shown = next(row for row in ROWS if tuple(row[:3]) == run)
    ((_, result),) = limits.hospital(f"hospital-{record.lower()}", float(scale), LONG, (case,))
    same(shown[3:], result)


@pytest.mark.slow
@pytest.mark.parametrize("record", ["CCC", "CLC"])
@pytest.mark.parametrize("scale", ["1", "1.5", "2"])
def test_all_rows_of_the_hospital(record: str, scale: str) -> None:
    for case, result in limits.hospital(f"hospital-{record.lower()}", float(scale)):
        row = next(row for row in ROWS if tuple(row[:3]) == (record, scale, case))
        same(row[3:], result)
        assert int(limits.cells(result)[4]) == pytest.approx(int(row[7]), abs=1)


@pytest.mark.slow  # layouts of their own
def test_scenes_reach_what_the_page_says() -> None:
    lines = re.findall(r"^\| ([\w-]+) \| (\d of \d) \| ([\d.]+) \| (\d+) \|$", PAGE, re.M)
    shown = {name: cells for name, *cells in lines}
    found = {name: values for name, values in limits.demanding() if values["rims"] or values["temperature"] > 100}
    assert shown.keys() == found.keys()
    for name, values in found.items():
        rims, force, temperature = shown[name]
        assert rims == f"{values['rims']:.0f} of {values['surfaces']:.0f}"
        assert values["force"] == pytest.approx(float(force), abs=0.006)
        assert values["temperature"] == pytest.approx(float(temperature), abs=0.6)


def test_commands_print_what_the_page_shows(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    saved = str(tmp_path / "out.nc")
    assert main(["run", "fenz-test5", "-o", saved]) == 0 and main(["characterise", saved]) == 0
    printed = capsys.readouterr().out.splitlines()
    shown = PAGE.split("```text\n")[1].split("```")[0].splitlines()
    assert len(shown) == 6
    for line in shown:
        assert any(other.startswith(line.removesuffix(" ...")) for other in printed), line


def test_the_page_has_every_limit() -> None:
    for limit in LIMITS:
        assert f"| `{limit.key}` |" in PAGE
    given = {field.name for field in fields(Limits)}
    fixed = {line.split("`")[1] for line in PAGE.splitlines() if line.startswith("| `") and "not to be given" in line}
    assert {limit.key for limit in LIMITS} == given | fixed and not given & fixed


def test_the_scene_file_of_the_page_is_valid(tmp_path: Any) -> None:
    block = PAGE.split("```toml\n")[1].split("```")[0]
    example = (ROOT / "examples" / "triple.toml").read_text(encoding="utf-8")
    (tmp_path / "scene.toml").write_text(f"{example}\n{block}", encoding="utf-8")
    assert load_scene(tmp_path / "scene.toml").limits == Limits(rim_force=6e5, axial_load=4e6, displacement=0.65)
