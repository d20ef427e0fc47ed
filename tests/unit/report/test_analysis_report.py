"""The report of a suite at bounds: its numbers, numbered parts, what it refuses, and that it loads no other file."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import ROOT

from msfp_gen import InputError, load_scene, simulate
from msfp_gen.buildings.modes import modes_of
from msfp_gen.cli import main
from msfp_gen.common.tables import decimal_text
from msfp_gen.report import TitleBlock, analysis_html, write_analysis
from msfp_gen.report.analysis import (
    _last_sections,
    _outcome,
    _sections,
    doubt_table,
    limit_table,
    structure_of,
)
from msfp_gen.report.compared import COMPARISONS, OF_SHEETS, comparisons_of
from msfp_gen.report.repeated import FINER, has_vertical, shear_share
from msfp_gen.scene.file.source import scene_of
from msfp_gen.studies.assessment.rows import read_study
from msfp_gen.studies.bounding import CASES, bound_suite, load_suite_bounds, suite_study
from msfp_gen.studies.bounding.suite import uplift_words

SUITE = """
records = [
    { bundled = "ridgecrest-2019-ci-ccc", duration = 5.0, name = "CCC" },
    { file = "records/clc.v1.gz", duration = 5.0, name = "CLC <b>" },
]
scale_to = { sds = "1 g", sd1 = "0.6 g", between = [1.0, 3.0], component = "rotd100" }
"""
SHEET: dict[str, Any] = {
    "device": "triple",
    "radius": [2.2, 0.4],
    "height": [0.115, 0.055],
    "friction": [0.06, 0.025, 0.025, 0.09],
    "friction_lower": [0.045, 0.015, 0.015, 0.07],
    "friction_upper": [0.08, 0.04, 0.04, 0.12],
    "slider_diameter": [0.35, 0.2],
    "dish_diameter": [0.9, 0.27],
    "axial_load": 760e3,
}
NOMINAL = CASES.index("nominal")
TITLE = TitleBlock(project="Block B", author="A. Author")


def building() -> dict[str, Any]:
    """The building of the examples on bearings of a data sheet."""
    table = tomllib.loads((ROOT / "examples" / "building" / "building.toml").read_text(encoding="utf-8"))
    table["bearings"]["isolator"] = {"sheet": SHEET, "reference_pressure": [5.8e6, 23e6, 23e6, 5.8e6]}
    table["motion"]["duration"] = "5 s"
    table["limits"] = {"displacement": "650 mm", "axial_load": "4 MN"}
    return table


@pytest.fixture(scope="module")
def folder(tmp_path_factory: Any) -> Path:
    return small_suite(Path(tmp_path_factory.mktemp("suite")))


def small_suite(folder: Path) -> Path:
    """The folder of the runs of a building under two records at bounds, within a folder."""
    (folder / "suite.toml").write_text(SUITE)
    (folder / "records").mkdir()  # beside the folder of the runs, as in a project
    record = ROOT / "msfp_gen" / "motions" / "records" / "files" / "ridgecrest-2019-ci-clc.v1.gz"
    shutil.copy(record, folder / "records" / "clc.v1.gz")
    bound_suite(suite_study(building(), folder / "suite.toml", "sheet"), folder / "out")
    return folder / "out"


@pytest.fixture(scope="module")
def html(folder: Path) -> str:
    return analysis_html(folder, TITLE)


def texts(html: str) -> str:
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", html))


def test_parts_of_the_report_are_numbered_and_listed(html: str) -> None:
    titles = re.findall(r'<h2 id="part-(\d+)">\d+\. (.*?)</h2>', html)
    assert [int(number) for number, _ in titles] == list(range(1, len(titles) + 1))
    wanted = (
        "Envelope", "Bearing", "Superstructure", "Ground motions", "Floor acc", "Floor spectra", "Displacements",
        "Loops", "Vertical", "Energy", "Which", "Settings",
    )  # fmt: skip
    found = [title for _, title in titles]
    assert [next(title for title in found if title.startswith(word)) for word in wanted]
    contents = html[html.index('class="contents"') : html.index('id="part-1"')]
    for kind, tag in (("Table", "caption"), ("Figure", "figcaption")):
        numbers = [int(n) for n in re.findall(rf"<{tag}>{kind} (\d+)\.", html)]
        assert numbers == list(range(1, len(numbers) + 1)) and len(numbers) > 3
        assert [int(n) for n in re.findall(rf"<li>{kind} (\d+)\.", contents)] == numbers


def test_doubtful_values_of_all_runs_are_in_the_first_section(folder: Path) -> None:
    """With the records that have them, once for all bounds; the settings of one run do not repeat them."""
    text = SUITE.replace('name = "CCC"', 'name = "CCC", scale = 8.0').split("scale_to")[0]
    (folder.parent / "doubtful.toml").write_text(text)
    table = building()
    table["building"]["damping_ratio"] = 0.5
    made = suite_study(table, folder.parent / "doubtful.toml", "sheet")
    _, bounds = load_suite_bounds(folder)  # the records have the same names
    (table_of_doubts,) = doubt_table(made, bounds)
    rows = {text.partition(" = ")[0].partition(":")[0]: records for records, text in table_of_doubts.rows}
    assert rows == {"building.damping_ratio": "all", "motion.scale": "CCC", "motion": "CCC"}
    assert not doubt_table(made, replace(bounds, left_out=("CCC", "CLC <b>")))
    scene, rows_of_runs = replace(made.scene(1), name="x"), read_study(folder)
    first = next(_sections(made, bounds, rows_of_runs, scene))
    assert first.tables[0] == table_of_doubts and len(first.tables) > 2
    *_, settings = _last_sections(made, bounds, rows_of_runs, scene, [])
    assert len(settings.tables) > 5 and not any("hardly meant" in one.title for one in settings.tables)


def test_page_one_names_inputs_author_and_checker(html: str, folder: Path) -> None:
    text = texts(html[: html.index('class="contents"')])
    assert re.search(r"SHA-256 [0-9a-f]{64}", text)
    assert "author A. Author date, signature" in text and "checker date, signature" in text
    assert text.count("A. Author") == 1 and "project Block B" in text
    assert "All 6 runs reached their end; none exceeded a limit of the device." in text
    short = analysis_html(folder, TITLE, loops=False)
    assert analysis_html(folder, TITLE, loops=False) == short, "the page depends on the folder alone"
    assert "Loops" not in short and "Loops" in html


def test_page_one_has_the_main_inputs(html: str, folder: Path) -> None:
    """Beside the hash: bearings, their load and friction at each bound, records with their factors, tolerance."""
    first = html[: html.index('class="contents"')]
    assert first.index("SHA-256") < first.index("Main inputs")
    cells = dict(re.findall(r"<tr><th[^>]*>(.*?)</th><td[^>]*>(.*?)</td></tr>", first))
    study, _ = load_suite_bounds(folder)
    scene: Any = study.scene(1)
    assert cells["bearings"].startswith("4 × triple friction pendulum")
    assert cells["load at rest"].startswith(f"{scene.weight / 1e6:.4g} MN on 4 bearings")
    for case, key in zip(CASES, ("friction_lower", "friction", "friction_upper"), strict=True):
        assert cells[f"friction at the pivot, from below, {case}"] == ", ".join(f"{mu:.4g}" for mu in SHEET[key])
    scales = [study.scene(1 + len(CASES) * record).motion.metadata["scale"] for record in range(2)]
    records = "CCC × {:.4g}, CLC &lt;b&gt; × {:.4g}".format(*map(float, scales))
    assert cells["ground motions and their factors"] == records and scales[0] != scales[1]
    limits = {"displacement 650 mm", "axial load 4000 kN"}
    assert limits <= set(cells["limits of the device"].split("; "))
    assert cells["tolerance of a step"] == f"rtol = {scene.solver.rtol:g}, method implicit"


def test_the_report_loads_nothing_and_escapes_names(html: str, folder: Path) -> None:
    assert not re.search(r"(src|href)=\"(?!data:|#)", html) and "default-src 'none'" in html
    assert "CLC &lt;b&gt;" in html and "CLC <b>" not in html
    assert str(folder.parent) not in html, "no folder of the machine"


def test_envelope_and_parts_are_those_of_the_rows(html: str, folder: Path) -> None:
    """Means and worst values from the rows of the study, by hand."""
    text, rows = texts(html), read_study(folder)
    drift = rows["storey_corner_drift_ratio_1"].to_numpy().reshape(2, 3)
    cells = " ".join(decimal_text(100 * v) for v in (*drift.mean(axis=0), *drift.max(axis=0)))
    assert f"storey 1 {cells}" in text
    peak = rows["peak_displacement"].to_numpy().reshape(2, 3) * 1e3
    assert "peak displacement [mm] " + " ".join(map(decimal_text, (*peak.mean(axis=0), *peak.max(axis=0)))) in text
    assert f"at most {100 * rows['closure_error'].abs().max():.2g} % of the largest energy" in text


def test_shares_of_limits_are_those_of_the_runs(folder: Path) -> None:
    """The share of a limit over the records at one bound, from runs made again."""
    study, bounds = load_suite_bounds(folder)
    table = limit_table(bounds, read_study(folder))
    runs = [simulate(study.scene(1 + CASES.index("upper") + len(CASES) * record)) for record in range(2)]
    labels = [row[0].partition(":")[0] for row in table.rows]
    assert set(labels) == {key.replace("_", " ") for run in runs for key in run.verdict.worst}
    for name, (_, _, _, upper, *_) in zip(labels, table.rows, strict=True):
        share = max(run.verdict.worst[name.replace(" ", "_")].share for run in runs)
        assert float(upper.removesuffix("\N{NO-BREAK SPACE}%")) == pytest.approx(100 * share, rel=6e-3, abs=1e-9)


@pytest.fixture(scope="module")
def largest(folder: Path) -> tuple[int, Any]:
    """Index of the record with the largest displacement at nominal values, and its run made again."""
    study, bounds = load_suite_bounds(folder)
    record = int(bounds.values["peak_displacement"][:, NOMINAL].argmax())
    return record, simulate(study.scene(1 + NOMINAL + len(CASES) * record))


def test_envelope_of_floor_spectra_is_that_of_the_runs(html: str, folder: Path, largest: tuple[int, Any]) -> None:
    """A row has the spectra of its run; the table has the largest ordinate over all rows."""
    record, result = largest
    rows = [json.loads(text)["floors"] for text in read_study(folder)["floor_spectra"]]
    periods = np.geomspace(0.03, 5.0, 40)
    corners = result.floor_spectra(periods).corners[-1]
    own = np.stack([corners[:, :2].max(axis=1), corners[:, 2]])
    assert np.array(rows[NOMINAL + len(CASES) * record]["floor 2"]) == pytest.approx(own, rel=1e-4)
    top = np.max([row["floor 2"][0] for row in rows], axis=0)
    line = next(line for line in table_rows(html, "Floor spectra") if "floor 2</th>" in line)
    cells = re.findall(r"<td>([\d.]+)</td>", line)
    assert float(cells[-2]) == pytest.approx(top.max() / 9.80665, abs=6e-4)
    assert float(cells[-1]) == pytest.approx(periods[top.argmax()], rel=6e-3)


def test_vertical_component_is_what_differs(html: str, folder: Path, largest: tuple[int, Any]) -> None:
    """The run with the largest displacement, and the same on a ground that moves in the plane alone."""
    _, result = largest
    coefficients = result.scene.motion.coefficients * np.array([1.0, 1.0, 0.0, 1.0, 1.0, 1.0])[:, None]
    plane = simulate(replace(result.scene, motion=replace(result.scene.motion, coefficients=coefficients)))
    line = next(line for line in table_rows(html, "Vertical component") if "peak base shear [kN]" in line)
    _, _, _, found, without, ratio, *_ = map(float, re.findall(r"<td>([\d.]+)</td>", line))
    assert found == pytest.approx(result.summary["peak_force"]["radial"] / 1e3, rel=6e-4)
    assert without == pytest.approx(plane.summary["peak_force"]["radial"] / 1e3, rel=6e-4)
    assert ratio == pytest.approx(found / without, abs=6e-3)
    assert "were compared, each equal to its row" in texts(html)


def test_error_is_the_change_at_a_tenth_of_the_tolerance(html: str, folder: Path, largest: tuple[int, Any]) -> None:
    _, result = largest
    finer = simulate(replace(result.scene, solver=result.scene.solver.tightened(FINER)))
    line = next(line for line in table_rows(html, "Energy and numerical error") if "peak base shear [kN]" in line)
    found, fine, change = re.findall(r"<td>([\d.]+)(?: %)?</td>", line)
    values = [run.summary["peak_force"]["radial"] / 1e3 for run in (result, finer)]
    assert [float(found), float(fine)] == pytest.approx(values, rel=6e-5)
    assert float(change) == pytest.approx(100 * abs(values[0] - values[1]) / values[1], rel=0.06)
    assert f"rtol = {result.scene.solver.rtol / FINER:g}" in texts(html)
    unmeasured = texts(analysis_html(folder, loops=False))
    assert f"rtol = {result.scene.solver.rtol:g}" in unmeasured and "was not measured" in unmeasured


def test_uplift_is_stated_also_where_nothing_lifts(html: str, folder: Path) -> None:
    """By the heights of the rows; and of the same rows with one bearing that lifts."""
    _, bounds = load_suite_bounds(folder)
    rows = read_study(folder)
    lifted = rows.filter(regex="^bearing_uplift_height").to_numpy(dtype=float, na_value=0.0) > 0
    least = f"{rows['minimum_load_ratio'].min():.3g} of the load at rest"
    section = texts(html.partition(">Uplift<")[2]) if lifted.any() else texts(html)
    (words,) = uplift_words(bounds)
    assert escape(words) in section and words.startswith("No bearing opened") == (least in words) != lifted.any()
    name = next(name for name in bounds.values if name.startswith("bearing_uplift_height"))
    other = np.full_like(bounds.values[name], 0.0 if lifted.any() else 0.01)
    every = {key: other if key.startswith("bearing_uplift") else values for key, values in bounds.values.items()}
    (changed,) = uplift_words(replace(bounds, values=every))
    assert changed.startswith("No bearing opened") == lifted.any()
    assert lifted.any() or "a surface opened by at most 10 mm" in changed


def test_channels_of_the_records_are_in_their_table(html: str, folder: Path) -> None:
    study, _ = load_suite_bounds(folder)
    for record, name in enumerate(("CCC", "CLC &lt;b&gt;")):
        channels = str(study.scene(1 + len(CASES) * record).motion.metadata["channels"])
        assert re.match(r"E1: .+, E2: .+, E3: .+", channels)
        assert len([line for line in table_rows(html, "Ground motions") if name in line and channels in line]) == 1


def table_rows(html: str, title: str) -> list[str]:
    """The rows of the tables of a section."""
    start = re.search(rf"<h2 [^>]*>\d+\. {title}", html)
    assert start
    return re.findall(r"<tr>(.*?)</tr>", html[start.end() : html.index("</section>", start.end())])


def test_shear_over_axial_force_is_the_friction_of_a_rigid_slope() -> None:
    """Of one pendulum in steady sliding: friction plus the slope of the dish, whatever its axial force."""
    result = simulate(load_scene("fenz-test2"))
    forces = np.abs(result.history.top_force)
    share = (np.hypot(forces[:, 0], forces[:, 1]) / forces[:, 2]).max()
    assert shear_share(result) == pytest.approx(share, rel=1e-12)
    assert not has_vertical(result.scene.motion)


def test_target_and_sheet_are_on_the_page(html: str) -> None:
    text = texts(html)
    assert "target: rotd100 to the ASCE 7 spectrum of 9.807 and 5.884 m/s^2, least squares from 1 to 3 s" in text
    assert "isolator: triple pendulum, axial load 760 kN" in text and "by sheet" in text
    assert "each record in a colour" in text and "storeys as given" in text and "100 t" in text


def test_modes_are_those_of_closed_form() -> None:
    """Two equal masses on equal springs: 0.618 and 1.618 of the frequency of one; masses add up to all above it."""
    table = building()
    for storey in table["building"]["storey"]:
        storey.update(mass=1e5, stiffness=1e8, mass_centre=[0.0, 0.0])
    del table["building"]["highest_frequency"]
    scene: Any = scene_of(table)
    modes = modes_of(scene)
    along = np.argsort(-modes.participating[:, 0])[:2]
    single = np.sqrt(1e8 / 1e5) / (2 * np.pi)
    golden = (np.sqrt(5) - 1) / 2
    assert modes.frequencies[along] == pytest.approx([single * golden, single / golden], rel=1e-9)
    effective = np.array([(1 + 1 / golden) ** 2 / (1 + 1 / golden**2), (1 - golden) ** 2 / (1 + golden**2)])
    assert modes.participating[along, 0] == pytest.approx(effective / 2, rel=1e-9)
    assert modes.participating.sum(axis=0)[:2] == pytest.approx([1.0, 1.0], rel=1e-9)
    assert np.abs(modes.shapes).max(axis=(1, 2))[along] == pytest.approx([1.0, 1.0])


def test_participating_masses_are_of_the_mass_above_the_base(html: str) -> None:
    """All six modes of two rigid floors move their whole mass; modes beyond the highest frequency are missing only."""
    (line,) = [line for line in table_rows(html, "Superstructure") if "sum of all" in line]
    assert re.findall(r"<td>([\d.]+)</td>", line) == ["100.00", "100.00", "0.00"]
    rows = []
    for highest in ("30 Hz", "4 Hz"):
        table = building()
        table["building"]["highest_frequency"] = highest
        _, modes = structure_of(scene_of(table), table)[0]
        rows.append(modes.rows)
    assert len(rows[0]) == 6 + 1 and len(rows[1]) == 2 + 1 and rows[0][:2] == rows[1][:2]
    along = [float(row[3]) for row in rows[1]]
    assert 0 < along[-1] < 100 and along[-1] == pytest.approx(sum(along[:-1]), abs=0.02)


def test_a_record_left_out_is_not_in_the_report(folder: Path, tmp_path: Path) -> None:
    assert main(["report", str(folder), "-o", str(tmp_path / "a.html"), "--leave-out", "CCC", "--no-runs"]) == 0
    text = texts((tmp_path / "a.html").read_text(encoding="utf-8"))
    assert "1 ground motion, CCC left out" in text
    assert "3 nonlinear response histories" in text


def cases(folder: Path, copy: Path) -> Iterator[tuple[list[str], str]]:
    yield [str(copy.parent)], "no study.toml here"
    yield [str(copy), "--leave-out", "XYZ"], "no record of the suite"
    next(copy.glob("part-0000004-*")).unlink()
    yield [str(copy)], "no run of CLC <b> at nominal; continue"
    study = (copy / "study.toml").read_text(encoding="utf-8")
    (copy / "study.toml").write_text(study.replace('mass = "110 t"', 'mass = "120 t"'), encoding="utf-8")
    yield [str(copy)], "inputs or program have changed"
    yield ["fenz-test2", "--leave-out", "CCC"], "give the folder of `bound --suite"
    yield ["fenz-test2", "--no-runs"], "--no-runs: it is for the report of a suite"


def test_what_cannot_be_reported_is_one_line(folder: Path, tmp_path: Path, capsys: Any) -> None:
    copy = Path(shutil.copytree(folder, folder.with_name("copy")))
    page = tmp_path / "page.html"
    for arguments, words in cases(folder, copy):
        assert main(["report", *arguments, "-o", str(page)]) == 2, words
        said = capsys.readouterr().err
        assert words in said and len(said.strip().splitlines()) == 1
        assert not page.exists()
    with pytest.raises(InputError, match=r"\.html"):
        write_analysis(folder, tmp_path / "page.txt")


def test_what_was_compared_is_what_tests_compare() -> None:
    """Every page names the tests, or a test of the page makes its numbers again; and the tests are there."""
    of_buildings = comparisons_of(load_scene("hospital-clc"))
    for one in (*COMPARISONS, OF_SHEETS, *of_buildings):
        page = (ROOT / "docs" / f"{one.page}.md").read_text(encoding="utf-8")
        for test in one.tests:
            path = ROOT / "tests" / test
            assert re.search(r"^def test_", path.read_text(encoding="utf-8"), re.MULTILINE), test
            assert path.name in page or path.name == f"test_{one.page}_page.py", f"{test} is not on the page {one.page}"
    assert of_buildings and not comparisons_of(load_scene("fenz-test2"))


def test_runs_that_ended_early_are_not_among_those_within_the_limits() -> None:
    """What a run that failed had reached until then may be beyond a limit; the table of shares has it."""
    assert _outcome(6, 0, 0, 0) == "All 6 runs reached their end; none exceeded a limit of the device."
    assert _outcome(6, 1, 0, 0) == (
        "1 of 6 runs did not reach their end; none of the 5 that did not fail exceeded a limit of the device."
    )
    assert _outcome(6, 1, 1, 1).startswith("2 of 6 runs did not")
    assert _outcome(6, 1, 0, 1).endswith("; 1 of the 5 that did not fail exceeded limits of the device.")
