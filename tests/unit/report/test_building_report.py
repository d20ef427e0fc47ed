"""The HTML report of a building, and its figures."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from support import thinned
from support.buildings import BEARING, INTERFACE, frame, pushed, pushed_scene, scene

from msfp_gen import BaseSlab, Building, BuildingBearing, BuildingScene, Effects, Motion, RunError, Storey, simulate
from msfp_gen.buildings.figures import FIGURES as BUILDING_FIGURES
from msfp_gen.buildings.page import PAGE, building_view, magnification
from msfp_gen.buildings.result import BuildingResult
from msfp_gen.report import TitleBlock, report_html

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage")


@cache
def result() -> BuildingResult:
    return replace(pushed(), scene=replace(pushed_scene(), name="frame <b>"))


@cache
def page() -> str:
    return report_html(result(), title=TitleBlock(project="block B"))


def test_the_page_needs_no_other_file():
    text = page()
    assert not re.search(r"""(src|href)=["']?(https?:|//|file:)""", text) and "block B" in text
    assert "frame &lt;b&gt;" in text and "triple friction pendulum" in text
    assert "peaks of bearings" in text and "isolation system" in text and "4 bearings" in text
    assert text.count("data:image/webp") == 4


def test_the_view_holds_the_motion_of_the_frame():
    data = building_view(result(), 1500)
    assert data["frames"]["time"]["shape"] == [len(result().time)]
    assert data["frames"]["node"]["shape"] == [len(result().time), 4, 6] and data["plates"]
    assert json.dumps(data, allow_nan=False)
    mean = np.mean([np.hypot(*each.history.displacement[:, :2].T) for each in result().bearings], axis=0)
    assert data["peak"] == int(mean.argmax()) and data["scale"] == magnification(result()) >= 1
    assert data["places"][1] == [-3.0, 2.0, 0.0] and data["loads"] == result().scene.axial_loads.tolist()


def test_few_instants_keep_the_peaks():
    few = building_view(result(), 3)
    assert 3 <= few["frames"]["time"]["shape"][0] <= len(result().time)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium to draw the page")
@pytest.mark.slow
def test_a_browser_draws_it(tmp_path: Path):
    path = tmp_path / "frame.html"
    path.write_text(page(), encoding="utf-8")
    command = [CHROMIUM, *FLAGS, "--virtual-time-budget=10000", "--dump-dom", path.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    dom = done.stdout
    assert 'data-ready="true"' in dom
    rows = re.findall(r'<tr><th scope="row"><span class="swatch"[^>]*></span>(\w)</th>((?:<td>[^<]*</td>)+)', dom)
    assert [row[0] for row in rows] == ["A", "B", "3", "4"]  # names, or numbers where there are none
    peak = building_view(result(), 1500)["peak"]
    shown = float(re.findall(r"<td>([^<]*)</td>", rows[0][1])[0].replace("−", "-"))
    assert shown == pytest.approx(1e3 * result().bearings[0].history.displacement[peak, 0], abs=0.06)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium to draw the page")
def test_a_building_of_one_storey_on_one_bearing_is_shown(tmp_path: Path):
    """Rows of one storey and one bearing have one value: none of them is read as a row of that value."""
    mass = 2e4
    slab, upper = BaseSlab(mass, 3 * (mass,)), Storey(3.0, mass, 3 * (mass,), 1e7, 1e7)
    bearing = BuildingBearing(BEARING, INTERFACE, effects=Effects())
    motion = Motion.harmonic(0.02, 0.6, cycles=1)
    small = BuildingScene(Building.shear(slab, [upper], 0.02), [bearing], motion, duration=0.3, output_step=0.02)
    path = tmp_path / "frame.html"
    path.write_text(report_html(simulate(small)), encoding="utf-8")
    command = [CHROMIUM, *FLAGS, "--virtual-time-budget=10000", "--dump-dom", path.as_uri()]
    dom = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    assert 'data-ready="true"' in dom
    assert "NaN" not in re.sub(r"<script.*?</script>|base64,[^\"]*", "", dom, flags=re.DOTALL)


@cache
def first_row() -> BuildingResult:
    """The result of a run that ends before its second row."""

    def interrupt(_: float, __: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(RunError) as caught:
        simulate(scene(frame(), duration=0.8, output_step=0.4), progress=interrupt)
    found = caught.value.result
    assert isinstance(found, BuildingResult) and len(found.time) == 1
    return found


OUTSIDE = thinned(BUILDING_FIGURES, lambda name: name not in PAGE.figures)  # pages draw the others


@pytest.mark.parametrize("name", OUTSIDE)
def test_a_result_of_one_row_is_drawn(name, tmp_path: Path):
    path = tmp_path / f"{name}.png"
    BUILDING_FIGURES[name](first_row(), path)
    assert path.stat().st_size > 1e4


def test_a_result_of_one_row_has_a_page():
    text = report_html(first_row())
    assert "interrupted" in text and text.count("data:image/webp") == 4


@pytest.mark.parametrize("name", OUTSIDE)
def test_every_figure_is_drawn(name, tmp_path: Path):
    path = tmp_path / f"{name}.png"
    BUILDING_FIGURES[name](result(), path)
    assert path.stat().st_size > 1e4
