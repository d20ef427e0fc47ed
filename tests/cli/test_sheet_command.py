"""`msfp-gen sheet` prints and draws the data sheet of docs/bearing.md; its numbers by formulas written out."""

from __future__ import annotations

import json
import re
from math import asin, pi, sqrt
from pathlib import Path

import pytest
from support import ROOT

from msfp_gen.cli import main

PAGE = (ROOT / "docs" / "bearing.md").read_text(encoding="utf-8")
Capture = pytest.CaptureFixture[str]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """The file of the page."""
    found = re.search(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    assert found
    path = tmp_path / "bearing.toml"
    path.write_text(found[1], encoding="utf-8")
    return path


def test_prints_what_follows_by_hand(file: Path, capsys: Capture) -> None:
    """Fenz and Constantinou (2008), with u* = 2 (mu_1 - mu_2) R_eff2 and so on; F at 300 mm on the main regime."""
    assert main(["sheet", str(file), "--displacement", "300 mm"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    outer, inner = 2.200 - 0.115, 0.400 - 0.055
    arcs = [R * (asin(D / 2 / R) - asin(b / 2 / R)) for R, D, b in ((2.2, 0.9, 0.35), (0.4, 0.27, 0.2))]
    first = 2 * (0.06 - 0.025) * inner
    second = first + 0.03 * (outer + inner)
    third = second + 2 * outer * (0.06 + arcs[0] / 2.2 - 0.09)
    assert f"nominal 1 0 {first * 1e3:.4g} u* 0.0250 0.0600" in printed
    assert f"2 {first * 1e3:.4g} {second * 1e3:.4g} u** 0.0600 0.0900" in printed
    assert f"3 {second * 1e3:.4g} {third * 1e3:.4g} u_dr1 0.0900" in printed
    capacity = 2 * (arcs[0] * outer / 2.2 + arcs[1] * inner / 0.4)
    assert f"displacement capacity {capacity * 1e3:.4g} mm" in printed
    force = 0.09 + (0.3 - second) / (2 * outer)
    assert f"300 {2500 * force:.4g} {2.5 * force / 0.3:.4g} {2 * pi * sqrt(0.3 / (9.8 * force)):.3f}" in printed


def test_prints_what_the_page_shows(file: Path, capsys: Capture) -> None:
    assert main(["sheet", str(file)]) == 0
    printed = capsys.readouterr().out.splitlines()
    shown = re.search(r"```\n(bearing: .*?)```", PAGE, re.DOTALL)
    assert shown
    lines = shown[1].replace("nominal  ", "         ").splitlines()
    assert len(lines) == 7 and not set(lines) - {line.replace("nominal  ", "         ") for line in printed}


def test_bounds_and_numbers_as_json(file: Path, capsys: Capture) -> None:
    assert main(["sheet", str(file), "--json"]) == 0
    cases = json.loads(capsys.readouterr().out)["cases"]
    assert list(cases) == ["lower", "nominal", "upper"]
    for case, (mu1, mu2, mu4) in {"lower": (0.045, 0.015, 0.07), "upper": (0.08, 0.04, 0.12)}.items():
        mean = (mu1 + mu4) / 2
        assert cases[case]["zero_displacement_force"] == pytest.approx(mean - (mean - mu2) * 345 / 2085)
        assert cases[case]["radius"] == pytest.approx(2 * 2.085) and len(cases[case]["effective"]) == 4


def test_draws_the_section_and_the_backbone(file: Path, tmp_path: Path, capsys: Capture) -> None:
    target = tmp_path / "sheet.svg"
    assert main(["sheet", str(file), "-o", str(target)]) == 0
    assert f"wrote {target}" in capsys.readouterr().err
    assert target.read_text(encoding="utf-8").count("<path") > 30


def test_sheets_of_a_building_by_their_names(file: Path, tmp_path: Path, capsys: Capture) -> None:
    """Of one sheet the name is not needed; of two it is."""
    one = file.read_text(encoding="utf-8").replace("[bearing.sheet]", "[bearings.corner.sheet]")
    building = tmp_path / "building.toml"
    building.write_text(one, encoding="utf-8")
    assert main(["sheet", str(building)]) == 0
    alone = capsys.readouterr().out
    assert alone.startswith("corner: ")
    building.write_text(one + one.replace(".corner.", ".middle."), encoding="utf-8")
    assert main(["sheet", str(building), "--bearing", "corner"]) == 0 and capsys.readouterr().out == alone
    for options in ([], ["--bearing", "edge"]):
        assert main(["sheet", str(building), *options]) == 2
        assert "the file has the sheets of corner, middle" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("[bearing]\npreset = 'fenz-tfp'\n", [], "bearing.sheet is missing"),
        ("", ["--displacement", "3 s"], "--displacement = '3 s': the unit 's' is not a unit of [m]"),
        ("", ["--displacement", "0.7"], "names no unit"),
        ("", ["--displacement", "700 mm"], "displacement = 0.7 [m]: give more than 0, at most the capacity"),
        ("", ["-o", "sheet.doc"], "--output = 'sheet.doc'"),
    ],
)
def test_bad_input_is_one_line(file: Path, capsys: Capture, text: str, options: list[str], message: str) -> None:
    if text:
        file.write_text(text, encoding="utf-8")
    assert main(["sheet", str(file), *options]) == 2
    printed = capsys.readouterr()
    assert message in printed.err and printed.err.count("\n") == 1 and not printed.out
