"""Equivalent lateral procedure: each formula by hand."""

from __future__ import annotations

import json
from math import pi, sqrt
from pathlib import Path
from typing import Any

import pytest

from msfp_gen import Bearing, InputError, load_scene, simulate
from msfp_gen.cli import main
from msfp_gen.design.effective import published_backbone
from msfp_gen.design.equivalent import DAMPING, damping_of, damping_table, equivalent, total_displacement

SINGLE: dict[str, Any] = {
    "device": "single", "radius": [2.2], "height": [0.0], "friction": [0.06], "slider_diameter": [0.24],
    "dish_diameter": [1.4], "axial_load": 2e6,
}  # fmt: skip
G = 9.81


def spectrum_of(velocity: float) -> list[tuple[float, float]]:
    """S_a = 2 pi velocity/T: a straight line in logarithms, which interpolation meets exactly."""
    return [(0.1, 2 * pi * velocity / 0.1), (10.0, 2 * pi * velocity / 10.0)]


def test_total_displacement_of_the_example() -> None:
    """y = 288 in, b = d = 576 in, e = 28.8 in, P_T = 1: 12 28.8/(2 576^2) = 1/1920, factor 1 + 288/1920 = 1.15."""
    inch = 0.0254
    total = total_displacement(14.75 * inch, 288 * inch, 28.8 * inch, 576 * inch, 576 * inch)
    assert total / (14.75 * inch) == pytest.approx(1.150, abs=1e-12)
    assert total / inch == pytest.approx(16.9625) and f"{total / inch:.2f}" == "16.96"
    assert total_displacement(1.0, 288, 28.8, 576, 576, 1.2) == pytest.approx(1 + 0.15 / 1.44)
    for bad in ((0.0, 1, 1, 1, 1), (1, 1, 1, 0, 1), (1, -1, 1, 1, 1), (1, 1, 1, 1, 1, 0)):
        with pytest.raises(InputError, match="give a number"):
            total_displacement(*bad)


@pytest.mark.parametrize(
    ("name", "damping", "factor"),
    [
        ("asce7", 0.01, 0.8), ("asce7", 0.05, 1.0), ("asce7", 0.15, 1.35), ("asce7", 0.25, 1.6), ("asce7", 0.6, 2.0),
        ("aashto", 0.05, 1.0), ("aashto", 0.10, 2**0.3), ("aashto", 0.5, 1.7),
        ("en1998", 0.05, 1.0), ("en1998", 0.20, sqrt(2.5)), ("en1998", 0.9, 1 / 0.55),
    ],
)  # fmt: skip
def test_damping_factors(name: str, damping: float, factor: float) -> None:
    assert DAMPING[name][0](damping) == pytest.approx(factor)


def test_damping_of_a_table_or_a_word() -> None:
    given, words = damping_of("0.05:1,0.1:1.2")
    assert [given(x) for x in (0.01, 0.075, 0.3)] == pytest.approx([1.0, 1.1, 1.2]) and "0.05:1" in words
    for bad in ("asce", "0.05:1", "0.1:1,0.05:1", "0.05:0,0.1:1", "0.05"):
        with pytest.raises(InputError, match="damping"):
            damping_of(bad)


def test_displacement_in_closed_form() -> None:
    """Constant B and S_a = 2 pi v/T: D = v T/(2 pi B) with T = 2 pi sqrt(D/(g (mu + D/R))).

    Then D = (v/B)^2/(g (mu + D/R)), so D^2/R + mu D - (v/B)^2/g = 0.
    """
    velocity, factor = 0.9, 1.4
    backbone = published_backbone(Bearing.from_sheet(**SINGLE))
    found = equivalent(backbone, spectrum_of(velocity), damping_table([(0.01, factor), (0.9, factor)]), G)
    square = (velocity / factor) ** 2 / G
    expected = (-0.06 + sqrt(0.06**2 + 4 * square / 2.2)) * 2.2 / 2
    assert found.at.displacement == pytest.approx(expected, rel=1e-9)
    assert found.at.force == pytest.approx(0.06 + expected / 2.2)
    assert found.acceleration == pytest.approx(2 * pi * velocity / found.at.period) and found.factor == factor


def test_damping_of_the_displacement_is_the_one_that_is_used() -> None:
    backbone = published_backbone(Bearing.from_sheet(**SINGLE))
    found = equivalent(backbone, spectrum_of(0.9), DAMPING["asce7"][0], G)
    force = 0.06 + found.at.displacement / 2.2
    assert found.at.damping == pytest.approx(2 * 0.06 / (pi * force))
    assert found.factor == pytest.approx(1.5 + 0.2 * (found.at.damping - 0.2) / 0.1)
    again = found.acceleration * (found.at.period / (2 * pi)) ** 2 / found.factor
    assert again == pytest.approx(found.at.displacement, rel=1e-9)


@pytest.mark.parametrize(
    ("spectrum", "message"),
    [
        (spectrum_of(5.0), "at the displacement capacity of .* mm it asks for"),
        (spectrum_of(1e-3), "stays stuck|give a spectrum beyond"),
        ([(0.1, 5.0), (1.0, 1.0)], "the effective period at .* is .* s; give a spectrum beyond 0.1 to 1 s"),
    ],
)
def test_what_has_no_solution_is_refused(spectrum: list[tuple[float, float]], message: str) -> None:
    with pytest.raises(InputError, match=message):
        equivalent(published_backbone(Bearing.from_sheet(**SINGLE)), spectrum, DAMPING["asce7"][0], G)


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The command at each bound of the sheet, with torsion; JSON has the same numbers."""
    file, table = tmp_path / "b.toml", tmp_path / "s.csv"
    sheet = {**SINGLE, "friction_lower": [0.04], "friction_upper": [0.09]}
    lines = [f"{key} = {json.dumps(value)}" for key, value in sheet.items()]
    file.write_text("\n".join(["[bearing]", "gravity = 9.81", "[bearing.sheet]", *lines]), encoding="utf-8")
    rows = [f"{period}, {acceleration!r}" for period, acceleration in spectrum_of(0.9)]
    table.write_text("\n".join(["period [s], Sa [m/s^2]", *rows]), encoding="utf-8")
    command = ["equivalent", str(file), "--spectrum", str(table), "--torsion", "288 in,28.8 in,576 in,576 in"]
    assert main([*command, "--json"]) == 0
    cases = json.loads(capsys.readouterr().out)
    expected = equivalent(published_backbone(Bearing.from_sheet(**SINGLE)), spectrum_of(0.9), DAMPING["asce7"][0], G)
    assert cases["nominal"]["displacement"] == pytest.approx(expected.at.displacement, rel=1e-9)
    assert cases["nominal"]["base_shear"] == pytest.approx(2e6 * expected.at.force)
    for case in cases.values():
        assert case["total_displacement"] == pytest.approx(1.15 * case["displacement"])
    assert cases["lower"]["displacement"] > cases["nominal"]["displacement"] > cases["upper"]["displacement"]
    assert main(command) == 0
    printed = capsys.readouterr().out
    assert f"{cases['upper']['displacement'] * 1e3:.1f}" in printed and "D_T = D (1 + y/P_T^2" in printed
    assert main([*command[:-1], "1 m,2 m"]) == 2
    assert "--torsion" in capsys.readouterr().err
    run = simulate(load_scene("fenz-test1"))
    assert main([*command, "--json", "--history", str(run.save(tmp_path / "run.nc"))]) == 0
    ratios = json.loads(capsys.readouterr().out)["nominal"]
    peak, shear = run.extremes.displacement[3], run.extremes.top_force[3] / 112e3
    assert ratios["history_displacement_ratio"] == pytest.approx(peak / expected.at.displacement, rel=1e-3)
    assert ratios["history_base_shear_ratio"] == pytest.approx(shear / expected.at.force, rel=1e-3)
    assert main([*command, "--history", "single-push"]) == 2
    assert "give a saved result" in capsys.readouterr().err
