"""The results page: figures from short runs, numbers where they belong, and a row for every failure."""

from __future__ import annotations

import csv
from functools import cache

import drawing
import inertia_study
import numpy as np
import pytest
import report_figures
import results_page

from msfp_gen import presets, simulate
from msfp_gen.results.result import Result

PNG = b"\x89PNG"
LIGHTEST = np.array([1e6, 10.0])


@cache
def run(name: str) -> Result:
    return report_figures.run(name)


@pytest.mark.slow
def test_stages_and_orbits_are_drawn(tmp_path):
    report_figures.stages(run, tmp_path / "stages.png")
    report_figures.orbits(run, tmp_path / "circle.png", kind="circle")
    report_figures.loops(run, tmp_path / "loops.png")
    for name in ("stages", "circle", "loops"):
        assert (tmp_path / f"{name}.png").read_bytes().startswith(PNG)


def test_a_figure_that_fails_leaves_no_file(tmp_path):
    with pytest.raises(KeyError), drawing.drawn(tmp_path / "half.png", 4, 3):
        raise KeyError
    assert not list(tmp_path.iterdir())


def test_relative_angles_are_sliding_over_radius():
    result = simulate(presets.scene("fenz-test5"))
    radii = [surface.radius for surface in result.scene.bearing.surfaces]
    assert drawing.tilts(result) * radii == pytest.approx(result.history.sliding, abs=1e-7)  # arccos near 1


def test_a_cycle_is_one_period_and_closes():
    result = run("becker-circle-25")
    rows = drawing.cycle(result)
    time, u = result.history.time[rows], result.history.displacement[rows, :2]
    assert time[-1] - time[0] == pytest.approx(2 * np.pi / 0.1, rel=1e-3)
    assert u[-1] == pytest.approx(u[0], abs=1e-4)


def test_row_of_table_42_is_in_millimetres_or_over_the_load():
    row = results_page.table_42_row
    assert row("u_dr1", 0.0865, 0.0859) == ("u_dr1 [mm]", "92.1", "90.0", "87.0", "86.5", "85.9")
    assert row("F_dr4", 0.26458, 0.26298) == ("F_dr4 / N", "0.240", "0.272", "0.275", "0.265", "0.263")
    assert row("u_star", 0.00172, None)[-2:] == ("1.7", "–")


def test_stages_slide_where_section_41_says():
    stages = [sliding for *_, sliding in results_page.stage_rows(run("fenz-monotonic"))]
    main = [sorted(part.split()[0] for part in cell.split(", ") if int(part[3:-2]) > 10) for cell in stages]
    assert main[1:] == [["1", "3"], ["1", "4"], ["2", "4"], ["2", "3"]]
    assert {"2", "3"} <= set(main[0])


def test_variance_by_hand():
    d = np.ones((len(inertia_study.GRID), 4))
    assert inertia_study.variance(1.1 * d, d) == pytest.approx(0.1)


@pytest.mark.slow
def test_study_reports_the_run_that_failed(tmp_path):
    """A bearing that weighs more than its load, on rims made for 112 kN, ends early: said in every place."""
    points = inertia_study.study(LIGHTEST)
    (failed,) = inertia_study.failures(points)
    assert (failed.series, failed.load) == ("fixed-rig", 10.0) and failed.reached < inertia_study.U_MAX
    inertia_study.write(points, tmp_path)
    rows = list(csv.DictReader((tmp_path / "inertia-study.csv").read_text().splitlines()))
    assert len(rows) == 6 and rows[-1]["V"] == "" and rows[-1]["status"] == failed.status
    assert all(row["status"] == "stopped" for row in rows[:-1])
    assert (tmp_path / "inertia-study.png").read_bytes().startswith(PNG)
    assert f"`{failed.status}`" in results_page.study_numbers(points)["failed"]


@pytest.mark.slow
def test_everything_is_regenerated(tmp_path):
    report_figures.main(tmp_path)
    page = (tmp_path / "peer-2017-07.md").read_text(encoding="utf-8")
    named = {part.split(")")[0] for part in page.split("](figures/")[1:]}
    assert named == {path.name for path in (tmp_path / "figures").iterdir()}
    assert "{" not in page and "nan" not in page
