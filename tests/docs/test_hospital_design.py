"""examples/hospital-design/: its checks by hand, its records, what its page says; the whole job, shortened."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from types import ModuleType

import numpy as np
import pytest
from support import ROOT

from msfp_gen import Bearing, BuildingScene, InputError, load_scene
from msfp_gen.motions.records import Record, response_spectrum
from msfp_gen.scene.file.loader import load_sheet, toml_file

FOLDER = ROOT / "examples" / "hospital-design"
PAGE = (ROOT / "docs" / "hospital-design.md").read_text(encoding="utf-8")


@pytest.fixture
def design(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(FOLDER))
    import design

    return design


def test_building_is_that_of_the_page(design: ModuleType) -> None:
    scene = load_scene(FOLDER / "hospital.toml")
    assert isinstance(scene, BuildingScene)
    assert scene.weight == pytest.approx(37e6, rel=1e-3) and len(scene.bearings) == 20
    assert len(scene.building.columns) == 5
    loads = np.array(scene.loads_at_rest) / 1e6
    assert f"{loads.min():.2f} to {loads.max():.2f} MN" in PAGE
    _, _, bearing = load_sheet(FOLDER / "hospital.toml")
    assert bearing == Bearing.from_sheet(**design.SHEET) == scene.bearings[0].bearing
    suite = toml_file(FOLDER / "suite.toml")
    assert len(suite["records"]) == 11 and suite["scale_to"]["between"] == [1.5, 4.5]


def test_checks_by_hand_are_on_the_page(design: ModuleType) -> None:
    """Stiffness by hand again from the numbers of the page; all three lines as printed."""
    length, inner = 2.235 - 0.178, 0.406 - 0.045
    friction = 0.06 - 0.04 * inner / length
    stiffness = 1850e3 * (1 / (2 * length) + friction / 0.5)
    found = design.by_hand()
    assert found["k_eff"] == pytest.approx(stiffness, rel=1e-12) == pytest.approx(645.7e3, abs=50.0)
    assert found["damping"] == pytest.approx(2 * friction * 1850e3 / (np.pi * stiffness * 0.5), rel=1e-12)
    (shown,) = re.findall(r"^by hand.*?(?=\n```)", PAGE, re.MULTILINE | re.DOTALL)
    assert shown in design.checks()


def test_dishes_of_the_first_draft_are_refused(design: ModuleType) -> None:
    with pytest.raises(InputError, match="dishes of surfaces 2 and 3") as raised:
        Bearing.from_sheet(**{**design.SHEET, "dish_diameter": [1.22, 0.417]})
    assert str(raised.value) in PAGE


def test_artificial_record_has_the_spectrum_of_the_site(design: ModuleType) -> None:
    """Each component about its target, with the scatter that is given; the motion ends at rest."""
    records = sys.modules["records"]
    motion = records.artificial(1)
    found = response_spectrum(Record("", records.STEP, motion), records.PERIODS).psa
    for axis in range(3):
        ratio = np.log(found[:, axis] / records.target(axis == 2))[(records.PERIODS > 0.1) & (records.PERIODS < 5)]
        assert abs(ratio.mean()) < 0.3 and ratio.std() < 0.5
    velocity = np.cumsum(motion, axis=0) * records.STEP
    assert np.abs(velocity[-1]).max() < 0.1 * np.abs(velocity).max()


@pytest.mark.slow
def test_the_whole_job_shortened(tmp_path) -> None:
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, str(FOLDER / "design.py"), "--short", "-o", str(tmp_path)]
    environment = {**os.environ, "MPLBACKEND": "agg", "PYTHONPATH": path}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "k_eff  645.7" in done.stdout and (tmp_path / "sheet.png").is_file()
    html = (tmp_path / "report.html").read_text(encoding="utf-8")
    titles = re.findall(r"<h2 [^>]*>\d+\. (.*?)</h2>", html)
    assert {"Bearing", "Floor spectra", "Loops", "Vertical component of the ground"} <= set(titles)
    assert "All 6 runs reached their end" in html and len(html) < 2e6
