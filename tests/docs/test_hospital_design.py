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
from support.peers import opensees_runs

from msfp_gen import Bearing, BuildingScene, InputError, load_scene
from msfp_gen.cli import main
from msfp_gen.motions.records import Record, response_spectrum
from msfp_gen.motions.records.scaling import read_spectrum
from msfp_gen.scene.file.loader import load_sheet, toml_file

FOLDER = ROOT / "examples" / "hospital-design"
PAGE = (ROOT / "docs" / "hospital.md").read_text(encoding="utf-8")


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
    _, sheet, bearing = load_sheet(FOLDER / "hospital.toml")
    assert (sheet, bearing) == (design.SHEET, design.BEARING) and bearing == scene.bearings[0].bearing
    limits = scene.limits
    assert limits is not None
    assert (limits.displacement, limits.axial_load, limits.rim_force) == pytest.approx((0.7, 8e6, 6e5))
    assert "a gap of 700 mm around the building, 8 MN on a bearing, 600 kN on a rim" in PAGE
    suite = toml_file(FOLDER / "suite.toml")
    assert len(suite["records"]) == 11 and suite["scale_to"]["between"] == [1.5, 4.5]


def test_opensees_that_lacks_a_library_is_left_out(design: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """OpenSeesPy raises RuntimeError where a library of the system is missing."""

    def broken(name: str) -> ModuleType:
        raise RuntimeError(f"Failed to import {name}.")

    monkeypatch.setattr("opensees_cycle.import_module", broken)
    text = design.checks()
    assert "by hand" in text and "by a run" in text and "by OpenSees" not in text


def test_checks_by_hand_are_on_the_page(design: ModuleType) -> None:
    """Stiffness by hand again from the numbers of the page; three lines as printed, the fourth with OpenSees."""
    length, inner = 2.235 - 0.178, 0.406 - 0.045
    friction = 0.06 - 0.04 * inner / length
    stiffness = 1850e3 * (1 / (2 * length) + friction / 0.5)
    found = design.by_hand()
    assert found.stiffness == pytest.approx(stiffness, rel=1e-12) == pytest.approx(645.7e3, abs=50.0)
    damping = pytest.approx(2 * friction * 1850e3 / (np.pi * stiffness * 0.5), rel=1e-12)
    assert found.by_area == damping and found.by_height == damping
    (shown,) = re.findall(r"^by hand.*?(?=\nby OpenSees)", PAGE, re.MULTILINE | re.DOTALL)
    assert shown in design.checks()


@pytest.mark.skipif(not opensees_runs(), reason="OpenSeesPy cannot be imported")
def test_opensees_has_the_loop_of_the_page() -> None:
    """In a process of its own, as OpenSees keeps its model; within 0.5 % of the sheet, whose loop it has."""
    done = subprocess.run(
        [sys.executable, "-c", "import design; print(design.checks())"],
        cwd=FOLDER, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    rows = {line[:14].strip(): line for line in done.stdout.splitlines() if "k_eff" in line}
    assert rows["by OpenSees"] in PAGE
    stiffness = {name: float(line.split()[line.split().index("k_eff") + 1]) for name, line in rows.items()}
    assert stiffness["by OpenSees"] == pytest.approx(stiffness["by the sheet"], rel=5e-3)
    assert stiffness["by a run"] == pytest.approx(stiffness["by the sheet"], rel=0.02)


def test_equivalent_procedure_is_that_of_the_page(design: ModuleType, capsys: pytest.CaptureFixture[str]) -> None:
    """The table as printed; the spectrum that of the suite; D and D_T by hand."""
    command = ["equivalent", str(FOLDER / "hospital.toml"), "--spectrum", str(FOLDER / "spectrum.csv")]
    assert main([*command, "--torsion", design.TORSION]) == 0
    (shown,) = re.findall(r"^  friction  .*?(?=\n```)", PAGE, re.MULTILINE | re.DOTALL)
    assert shown in capsys.readouterr().out
    period, values = np.array(read_spectrum(FOLDER / "spectrum.csv")).T
    records = sys.modules["records"]
    at = np.geomspace(0.1, 8.0, 50)
    mine = np.exp(np.interp(np.log(at), np.log(period), np.log(values)))
    whole = records.TARGET.curve(at)
    assert mine == pytest.approx(np.interp(at, *whole), rel=2e-3)
    assert 1.542 / 1.564 * (3.180 / (2 * np.pi)) ** 2 == pytest.approx(0.2526, abs=2e-4)
    total = 252.6 * (1 + 16 * 12 * 1.7 / (34**2 + 26**2))
    assert total == pytest.approx(297.6, abs=0.1)


def test_dishes_of_the_first_draft_are_refused() -> None:
    sheet = toml_file(FOLDER / "hospital.toml")["bearings"]["isolator"]["sheet"]
    with pytest.raises(InputError, match="dishes of surfaces 2 and 3") as raised:
        Bearing.from_sheet(**{**sheet, "dish_diameter": ["1220 mm", "417 mm"]})
    assert str(raised.value) in PAGE


def test_artificial_record_has_the_spectrum_that_it_was_made_to(design: ModuleType) -> None:
    """Its own spectrum: the target times a random factor, of a known scatter; the motion ends at rest."""
    records = sys.modules["records"]
    shown = (records.PERIODS > 0.1) & (records.PERIODS < 5)
    motion, wanted = records.artificial(1), records.wanted_spectra(np.random.default_rng(1))
    found = response_spectrum(Record("", records.STEP, motion), records.PERIODS).psa[:, :3]
    ratio = np.log(found / wanted)[shown]
    # After eight rounds it is on its spectrum in the mean, and about it by 6 % from period to period.
    assert np.abs(ratio.mean(axis=0)).max() < 0.02 and ratio.std(axis=0).max() < 0.08
    velocity = np.cumsum(motion, axis=0) * records.STEP
    assert np.abs(velocity[-1]).max() < 0.1 * np.abs(velocity).max()
    # The factors of all records: their logarithms are about zero with the given scatter at the nine knots.
    every = np.stack([records.wanted_spectra(np.random.default_rng(seed)) for seed in range(400)])
    target = np.column_stack([records.target(axis == 2) for axis in range(3)])
    scatter = np.log(every / target)[:, [0, -1]]
    assert abs(scatter.mean()) < 0.02 and scatter.std() == pytest.approx(records.SCATTER, rel=0.05)


@pytest.mark.slow
def test_the_whole_job_shortened(tmp_path) -> None:
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, str(FOLDER / "design.py"), "--short", "-o", str(tmp_path)]
    environment = {**os.environ, "MPLBACKEND": "agg", "PYTHONPATH": path}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (
        "k_eff  645.7" in done.stdout and "total displacement D_T" in done.stdout and (tmp_path / "sheet.png").is_file()
    )
    html = (tmp_path / "report.html").read_text(encoding="utf-8")
    titles = re.findall(r"<h2 [^>]*>\d+\. (.*?)</h2>", html)
    assert {"Bearing", "Floor spectra", "Loops", "Vertical component of the ground"} <= set(titles)
    assert "700 mm" in html and "8000 kN" in html  # limits of the device
    assert "All 6 runs reached their end" in html and len(html) < 2e6
