"""Commands name the limits of the device that a run exceeded; their exit code is that of the computation."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from msfp_gen import changed_scene, load_scene
from msfp_gen.cli import main
from msfp_gen.scene.file.loader import scene_text
from msfp_gen.studies import read_study

TEXT = "limits of the device exceeded: rim force 15.12 kN, limit 5 kN (surface 1, "
Capture = pytest.CaptureFixture[str]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Test 5 of PEER 2017/07 with rims that bear 5 kN, of which it asks 15 kN."""
    path = tmp_path / "scene.toml"
    path.write_text(f'{scene_text(load_scene("fenz-test5"))}\n[limits]\nrim_force = "5 kN"\n', encoding="utf-8")
    return path


def test_run_ends_with_what_was_exceeded(file: Path, capsys: Capture) -> None:
    assert main(["run", str(file)]) == 0
    printed = capsys.readouterr()
    assert "verdict exceeded: rim force 15.12 kN, limit 5 kN (surface 1, " in " ".join(printed.out.split())
    assert "EXCEEDED" in printed.out and printed.err.splitlines()[-1].startswith(TEXT)
    assert main(["run", str(file), "--json"]) == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out)["verdict"]["limits"] == "rim_force" and not printed.err
    assert main(["run", "fenz-test5"]) == 0
    printed = capsys.readouterr()
    assert "verdict within the limits of the device" in " ".join(printed.out.split()) and "limits" not in printed.err


def test_a_failed_run_says_what_it_exceeded_before(file: Path, capsys: Capture) -> None:
    text = file.read_text(encoding="utf-8").replace("max_steps = 10000000", "max_steps = 400")
    file.write_text(text, encoding="utf-8")
    assert main(["run", str(file)]) == 1
    assert "the run failed" in capsys.readouterr().out


def test_batch_has_a_verdict_for_each_run(file: Path, tmp_path: Path, capsys: Capture) -> None:
    table = tmp_path / "table.csv"
    assert main(["batch", str(file), "--vary", "limits.rim_force=5e3,5e4", "--table", str(table)]) == 0
    printed = capsys.readouterr()
    assert [line.split()[-2] for line in printed.out.splitlines()[-2:]] == ["exceeded", "within"]
    assert "1 of 2 runs exceeded limits of the device; --table FILE names them" in printed.err
    rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))
    assert [row["verdict"] for row in rows] == ["exceeded", "within"]
    assert [row["limits_exceeded"] for row in rows] == ["rim_force", ""]


def test_bound_has_a_verdict_for_each_case(file: Path, tmp_path: Path, capsys: Capture) -> None:
    assert main(["bound", str(file), "-o", str(tmp_path / "bounds")]) == 0
    printed = capsys.readouterr()
    assert "verdicts: limits of the device" in printed.out and "lower    exceeded: rim force" in printed.out
    lines = [line for line in printed.err.splitlines() if "limits of the device exceeded" in line]
    assert [line.partition(":")[0] for line in lines] == ["lower", "nominal", "upper"]
    rows = list(csv.DictReader((tmp_path / "bounds" / "bounds.csv").read_text(encoding="utf-8").splitlines()))
    assert rows[-1]["quantity"] == "verdict" and rows[-1]["nominal"].startswith("exceeded: rim force 15.12 kN")


def test_a_report_is_green_only_within_the_limits(file: Path, tmp_path: Path, capsys: Capture) -> None:
    page = tmp_path / "page.html"
    assert main(["report", str(file), "-o", str(page), "--frames", "20"]) == 0
    text = page.read_text(encoding="utf-8")
    assert 'class="status exceeded">The run reached its end. Limits of the device exceeded: rim force 15.12 kN' in text
    assert "EXCEEDED" in text and TEXT in capsys.readouterr().err
    assert main(["report", "fenz-test1", "-o", str(page), "--frames", "20"]) == 0
    assert 'class="status within">The run reached its end, within the limits of the device.' in page.read_text("utf-8")


def test_a_run_that_met_its_stop_condition_is_green_nowhere(tmp_path: Path, capsys: Capture) -> None:
    """Not in its tables, its report, a batch, a bounding analysis and a study."""
    scene = changed_scene("fenz-test2", {"stop": {"displacement": 5e-3}})
    (tmp_path / "scene.toml").write_text(scene_text(scene), encoding="utf-8")
    file, page, study = str(tmp_path / "scene.toml"), tmp_path / "page.html", tmp_path / "study.toml"
    assert main(["run", file]) == main(["report", file, "-o", str(page), "--frames", "20"]) == 0
    assert "verdict the run met its stop condition at " in " ".join(capsys.readouterr().out.split())
    assert 'class="status stopped">The run met its stop condition at ' in page.read_text("utf-8")
    assert main(["batch", file, "--vary", "solver.rtol=1e-4,1e-5"]) == 0
    assert [line.split()[-2] for line in capsys.readouterr().out.splitlines()[-2:]] == ["stopped", "stopped"]
    study.write_text('scene = "scene.toml"\nkeep = ["verdict"]\n[axes.a]\nsets = "solver.rtol"\nvalues = [1e-4]\n')
    assert main(["study", str(study), "-o", str(tmp_path / "out")]) == 0
    assert read_study(tmp_path / "out")["verdict"].tolist() == ["stopped"]


def test_a_study_keeps_the_limits_that_were_exceeded(file: Path, tmp_path: Path, capsys: Capture) -> None:
    study = tmp_path / "study.toml"
    study.write_text('scene = "scene.toml"\n[axes.limit]\nsets = "limits.rim_force"\nvalues = [5e3, 5e4]\n', "utf-8")
    assert main(["study", str(study), "-o", str(tmp_path / "out")]) == 0
    assert "1 of the runs exceeded limits of the device: see the column limits_exceeded" in capsys.readouterr().err
    rows = read_study(tmp_path / "out")
    assert rows["limits_exceeded"].tolist() == ["rim_force", ""] and "verdict" not in rows
