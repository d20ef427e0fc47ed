"""Equivalent lateral procedure: each formula by hand."""

from __future__ import annotations

import csv
import dataclasses
import json
import re
from math import pi, sqrt
from pathlib import Path
from typing import Any

import pytest
from support import ROOT

from msfp_gen import Bearing, InputError, load_scene, simulate
from msfp_gen.cli import main
from msfp_gen.design.effective import published_backbone
from msfp_gen.design.equivalent import DAMPING, damping_of, damping_table, equivalent, total_displacement
from msfp_gen.studies.bounding import bound_suite, suite_study
from msfp_gen.studies.bounding.suite import write_records

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


def scene_file(folder: Path, sheet: dict[str, Any], *others: str) -> Path:
    """A scene file with a sheet, and other tables."""
    lines = [f"{key} = {json.dumps(value)}" for key, value in sheet.items()]
    path = folder / "b.toml"
    path.write_text("\n".join(["[bearing]", "gravity = 9.81", "[bearing.sheet]", *lines, *others]), encoding="utf-8")
    return path


def spectrum_file(folder: Path, velocity: float) -> Path:
    """The file of `spectrum_of`."""
    rows = [f"{period}, {acceleration!r}" for period, acceleration in spectrum_of(velocity)]
    (folder / "s.csv").write_text("\n".join(["period [s], Sa [m/s^2]", *rows]), encoding="utf-8")
    return folder / "s.csv"


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The command at each bound of the sheet, with torsion; JSON has the same numbers."""
    file = scene_file(tmp_path, {**SINGLE, "friction_lower": [0.04], "friction_upper": [0.09]})
    command = ["equivalent", str(file), "--spectrum", str(spectrum_file(tmp_path, 0.9))]
    command += ["--torsion", "288 in,28.8 in,576 in,576 in"]
    assert main([*command, "--json"]) == 0
    cases = json.loads(capsys.readouterr().out)
    expected = equivalent(published_backbone(Bearing.from_sheet(**SINGLE)), spectrum_of(0.9), DAMPING["asce7"][0], G)
    assert cases["nominal"]["displacement"] == pytest.approx(expected.at.displacement, rel=1e-9)
    assert cases["nominal"]["base_shear"] == pytest.approx(2e6 * expected.at.force)
    for case in cases.values():
        assert case["total_displacement"] == pytest.approx(1.15 * case["displacement"])
        assert "building_base_shear" not in case
    assert cases["lower"]["displacement"] > cases["nominal"]["displacement"] > cases["upper"]["displacement"]
    assert main(command) == 0
    printed = capsys.readouterr().out
    assert f"{cases['upper']['displacement'] * 1e3:.1f}" in printed and "D_T = D (1 + y/P_T^2" in printed
    assert main([*command[:-1], "1 m,2 m"]) == 2
    assert "--torsion" in capsys.readouterr().err


def test_inputs_are_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Spectrum and its range, rule of B, g, friction of each bound, axial load."""
    file = scene_file(tmp_path, {**SINGLE, "friction_lower": [0.04], "friction_upper": [0.09]})
    assert main(["equivalent", str(file), "--spectrum", str(spectrum_file(tmp_path, 0.9)), "--damping", "aashto"]) == 0
    inputs = capsys.readouterr().out.partition("formulas and inputs\n")[2].splitlines()
    words = dict(re.split("  +", line.strip(), maxsplit=1) for line in inputs)
    assert words["spectrum of 5 % damping"].startswith("s.csv, 2 rows from 0.1 to 10 s")
    assert words["gravity g"] == "9.81 m/s2" and words["axial load W"] == "2000 kN"
    friction = [words[f"friction at the pivot, {case}"] for case in ("lower", "nominal", "upper")]
    assert friction == ["0.04", "0.06", "0.09"] and "(beta/0.05)^0.3" in words["damping factor"]
    assert "bearings of the building" not in words


HOSPITAL = ROOT / "examples" / "hospital-design"


def hospital(folder: Path, **changes: str) -> list[str]:
    """The command for the hospital without its record, which loads at rest do not need. changes: of its text."""
    text = (HOSPITAL / "hospital.toml").read_text(encoding="utf-8")
    for old, new in {'bundled = "ridgecrest-2019-ci-ccc"': 'file = "none.csv"', **changes}.items():
        assert old in text
        text = text.replace(old, new)
    (folder / "hospital.toml").write_text(text, encoding="utf-8")
    return ["equivalent", str(folder / "hospital.toml"), "--spectrum", str(HOSPITAL / "spectrum.csv")]


def test_base_shear_of_a_building(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """850 + 4 600 + 525.5 t: V = W (mu + D/(2 R_eff1)), mu = mu_1 - (mu_1 - mu_2) R_eff2/R_eff1."""
    assert main([*hospital(tmp_path), "--json"]) == 0
    cases = json.loads(capsys.readouterr().out)
    weight, outer, inner = 3775.5e3 * 9.8, 2.235 - 0.178, 0.406 - 0.045
    for case, (mu1, mu2) in {"lower": (0.045, 0.012), "nominal": (0.06, 0.02), "upper": (0.085, 0.035)}.items():
        force = mu1 - (mu1 - mu2) * inner / outer + cases[case]["displacement"] / (2 * outer)
        assert cases[case]["building_base_shear"] == pytest.approx(weight * force, rel=1e-6)
        assert cases[case]["base_shear"] == pytest.approx(1850e3 * force, rel=1e-6)
    assert main(hospital(tmp_path)) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert f"base shear of the building [MN] {cases['lower']['building_base_shear'] / 1e6:.4g} " in printed
    assert "bearings of the building 20, all of this sheet; weight on them 37 MN" in printed and "9.8 m/s2" in printed


def test_no_base_shear_of_a_building_on_several_sheets(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Sixteen of twenty bearings have this sheet, four a preset: D of this sheet alone is not the building's."""
    rows = '{ bearing = "isolator", grid = { x = [-16.0, -8.0, 0.0, 8.0], y = [-12.0, -4.0, 4.0, 12.0] } }, '
    rows += '{ name = "P", bearing = "building-tfp", grid = { x = [16.0]'
    command = hospital(tmp_path, **{'{ bearing = "isolator", grid = { x = [-16.0, -8.0, 0.0, 8.0, 16.0]': rows})
    assert main(command) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "bearings of the building 16 of 20 are of this sheet" in printed and "building [MN]" not in printed


FENZ = {
    "device": "triple", "radius": [0.473, 0.076], "height": [0.038, 0.023], "friction": [0.03, 0.017, 0.017, 0.107],
    "friction_lower": [0.02, 0.01, 0.01, 0.08], "friction_upper": [0.04, 0.02, 0.02, 0.13],
    "slider_diameter": [0.102, 0.051], "capacity": [0.065, 0.0215], "plate_height": 0.013, "axial_load": 112e3,
}  # fmt: skip
MASS = """
[top]
kind = "mass"
mass = 11400.0
inertia = [300.0, 300.0]
height = 0.5
rotational_stiffness = 1e7
rotational_damping = 1e4
vertical_stiffness = 7e7
vertical_damping = 1.8e5
[motion]
kind = "record"
bundled = "ridgecrest-2019-ci-clc"
duration = 5.0
"""
SUITE = """
records = [
    { bundled = "ridgecrest-2019-ci-ccc", duration = 5.0, scale = 0.5, name = "CCC" },
    { bundled = "ridgecrest-2019-ci-clc", duration = 5.0, scale = 0.5, name = "CLC" },
]
"""


def test_a_suite_is_compared_bound_by_bound(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Means of the records of each bound, from the table of runs, over D, D_T and V of the same bound."""
    file, out = scene_file(tmp_path, FENZ, MASS), tmp_path / "out"
    (tmp_path / "suite.toml").write_text(SUITE, encoding="utf-8")
    bounds = bound_suite(suite_study(file, tmp_path / "suite.toml", "sheet"), out)
    with write_records(bounds, tmp_path / "records.csv").open(encoding="utf-8") as table:
        runs = list(csv.DictReader(table))
    command = ["equivalent", str(file), "--spectrum", str(spectrum_file(tmp_path, 0.3)), "--history", str(out)]
    for options, names in ([], ["CCC", "CLC"]), (["--leave-out", "CCC"], ["CLC"]):
        assert main([*command, "--torsion", "16,1.7,34,26", *options, "--json"]) == 0
        cases = json.loads(capsys.readouterr().out)
        assert list(cases) == ["lower", "nominal", "upper"]
        for case, found in cases.items():
            of_case = [run for run in runs if run["case"] == case and run["record"] in names]
            u = sum(float(run["peak displacement [m]"]) for run in of_case) / len(names)
            shear = sum(float(run["peak force [N]"]) for run in of_case) / len(names) / (11400 * G)
            total = found["displacement"] * (1 + 16 * 12 * 1.7 / (34**2 + 26**2))
            assert found["history_displacement"] == pytest.approx(u, rel=1e-12)
            assert found["history_displacement_ratio"] == pytest.approx(u / found["displacement"], rel=1e-12)
            assert found["history_total_displacement_ratio"] == pytest.approx(u / total, rel=1e-12)
            assert found["history_base_shear_over_weight"] == pytest.approx(shear, rel=1e-12)
            ratio = shear / (found["base_shear"] / 112e3)
            assert found["history_base_shear_ratio"] == pytest.approx(ratio, rel=1e-12)
        assert len({found["history_displacement"] for found in cases.values()}) == 3
    assert main([*command, "--leave-out", "CCC"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "out: mean of 1 record at each bound; left out: CCC" in printed
    assert main([*command, "--leave-out", "CCD"]) == 2
    assert capsys.readouterr().err.startswith("error: --leave-out = 'CCD'")


def test_bounds_by_factors_are_no_bounds_of_the_sheet(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, out = scene_file(tmp_path, FENZ, MASS), tmp_path / "out"
    suite = SUITE.partition('    { bundled = "ridgecrest-2019-ci-clc"')[0] + "]\n"
    (tmp_path / "suite.toml").write_text(suite, encoding="utf-8")
    bound_suite(suite_study(file, tmp_path / "suite.toml", "asce7"), out)
    command = ["equivalent", str(file), "--spectrum", str(spectrum_file(tmp_path, 0.3)), "--history", str(out)]
    assert main(command) == 2
    error = capsys.readouterr().err
    assert "--history" in error and "asce7" in error and "without --factors" in error and error.count("\n") == 1


def test_a_run_is_compared_at_every_bound(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = scene_file(tmp_path, {**SINGLE, "friction_lower": [0.04], "friction_upper": [0.09]})
    command = ["equivalent", str(file), "--spectrum", str(spectrum_file(tmp_path, 0.9))]
    run = simulate(load_scene("fenz-test1"))
    assert main([*command, "--json", "--history", str(run.save(tmp_path / "run.nc"))]) == 0
    cases = json.loads(capsys.readouterr().out)
    peak, shear = run.extremes.displacement[3], run.extremes.top_force[3] / 112e3
    for found in cases.values():
        assert found["history_displacement_ratio"] == pytest.approx(peak / found["displacement"], rel=1e-9)
        assert found["history_base_shear_ratio"] == pytest.approx(shear / found["base_shear_over_weight"], rel=1e-9)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--history", "single-push"], "--history = 'single-push': give a saved result"),
        (["--history", "{folder}"], "give the folder of `msfp-gen bound --suite"),
        (["--leave-out", "CLC"], "--leave-out: "),
    ],
)
def test_other_histories_are_refused(
    options: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = [option.format(folder=tmp_path) for option in options]
    command = ["equivalent", str(scene_file(tmp_path, SINGLE)), "--spectrum", str(spectrum_file(tmp_path, 0.9))]
    assert main([*command, *given]) == 2
    error = capsys.readouterr().err
    assert words in error and error.count("\n") == 1


def test_a_run_that_failed_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    failed = dataclasses.replace(simulate(load_scene("fenz-test1")), status="newton", message="stopped at t = 3 s")
    command = ["equivalent", str(scene_file(tmp_path, SINGLE)), "--spectrum", str(spectrum_file(tmp_path, 0.9))]
    assert main([*command, "--history", str(failed.save(tmp_path / "run.nc"))]) == 2
    assert "its run failed (newton)" in capsys.readouterr().err
