"""`msfp-gen study`: runs, continues after `kill -9` and Ctrl-C, and says how far it is."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pandas as pd
import pytest
from support import hearing, scene_of
from support.study_tables import cheap_study, rows_of

from msfp_gen import changed_scene
from msfp_gen.cli import main
from msfp_gen.scene.file.loader import dumps, scene_text
from msfp_gen.studies import load_study

MOTIONS = [
    {"name": f"CLC-{number}", "bundled": "ridgecrest-2019-ci-clc", "components": ["E1"], "duration": 8.0}
    for number in (1, 2)
]


def written(folder: Path, **changes: Any) -> Path:
    path = folder / "study.toml"
    path.write_text(dumps(cheap_study(**changes)), encoding="utf-8")
    return path


def planar(folder: Path) -> str:
    """The scene of the cheap study in its plane, whose massless model other tests build, as a file beside the study."""
    (folder / "scene.toml").write_text(scene_text(scene_of("fenz-test1", {"dimension": "planar"})), encoding="utf-8")
    return "scene.toml"


def started(*arguments: str | Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "msfp_gen", "study", *map(str, arguments)]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=hearing, start_new_session=True
    )


def await_parts(folder: Path, count: int) -> None:
    limit = time.monotonic() + 60
    while len(list(folder.glob("part-*.parquet"))) < count:
        assert time.monotonic() < limit, "no parts appear"
        time.sleep(0.01)


def test_a_study_runs_continues_and_says_how_far_it_is(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = written(tmp_path), tmp_path / "out"
    assert main(["study", str(path), "-o", str(out), "--shard", "1/2"]) == 0
    assert capsys.readouterr().out == f"8 of 8 runs are in {out}; 0 failed\n"
    assert main(["study", "status", str(out)]) == 0
    shown = capsys.readouterr().out
    assert "8 of 12 done (66.7 %)" in shown and "parts   2 of 3" in shown
    assert main(["study", str(path), "-o", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"runs": 12, "before": 8, "done": 4, "failed": 0}
    assert main(["study", "status", str(out), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["done"], found["failed"], found["running"], found["chunks"]) == (12, 0, False, 3)


def test_doubtful_values_of_a_study_are_printed_before_its_runs(tmp_path: Any, capsys: Any, monkeypatch: Any) -> None:
    """A line for all runs, and a line for all values of an axis with a doubt of one kind; also of an equivalent."""
    calls: list[Any] = []
    monkeypatch.setattr("msfp_gen.studies.run.study", lambda *_, **options: calls.append(options) or Mock())
    monkeypatch.setattr("msfp_gen.cli.study_commands._report", lambda *_: None)
    table: dict[str, Any] = {
        "scene": tomllib.loads(scene_text(changed_scene("ridgecrest-clc", {"bearing.gravity": 8.0}))),
        "records": {"motions": MOTIONS, "scales": [1.0, 8.0, 9.0]},
        "axes": {"friction": {"multiplies": "bearing.friction", "values": np.linspace(1, 40, 100).tolist()}},
    }
    (tmp_path / "study.toml").write_text(dumps(table), encoding="utf-8")
    given = ["study", str(tmp_path / "study.toml"), "-o", str(tmp_path / "out")]
    assert main(given) == 0 and calls[0]["force"]
    gravity, scale, *friction = capsys.readouterr().err.splitlines()
    assert gravity.startswith("bearing.gravity = 8 m/s^2")
    assert scale.startswith("scale 8: motion.scale = 8 ") and scale.endswith("; likewise scale 9")
    assert [line.partition(" = ")[0] for line in friction] == [
        f"friction {first}: bearing.surfaces[{index}].friction"
        for first, index in (("4.152", 0), ("4.152", 3), ("9.273", 1), ("9.273", 2))
    ]
    del table["axes"]
    table["scene"]["fidelity"] = "equivalent"
    (tmp_path / "study.toml").write_text(dumps(table), encoding="utf-8")
    assert main(given) == 0
    (scale,) = capsys.readouterr().err.splitlines()
    assert scale.startswith("scale 8: motion.scale = 8 ")


def test_an_estimate_is_printed_and_kept_as_json(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = (
        written(tmp_path, scene=planar(tmp_path), accuracy={"models": ["massless"], "pilot": 16}),
        tmp_path / "out",
    )
    arguments = ["study", str(path), "-o", str(out), "--workers", "1", "--target", "20%"]
    assert main([*arguments, "--estimate", "peak_force"]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert "mean of peak_force" in shown[0]
    assert main([*arguments, "--estimate", "peak_force", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["runs"]["exact"] >= 16
    share = [*arguments, "--estimate", "peak_force", "--statistic", "probability", "--threshold", "1e3"]
    assert main(share) == 0
    assert "probability 1000 of peak_force" in capsys.readouterr().out
    assert main([*share[:-1], "high"]) == 2
    assert capsys.readouterr().err == "error: accuracy.threshold = 'high': give a number, or a share such as '2 %'\n"
    assert main([*arguments, "--estimate", "drift"]) == 2
    assert capsys.readouterr().err.startswith("error: quantity = 'drift': the study keeps ")
    assert main([*arguments, "--estimate", "peak_force", "--shard", "1/2"]) == 2


def test_the_example_can_be_loaded(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", "--example"]) == 0
    path = tmp_path / "example.toml"
    path.write_text(capsys.readouterr().out, encoding="utf-8")
    assert load_study(path).runs == 256


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-o", "out"], "no FILE is given"),
        (["study.toml"], "--output is missing"),
        (["none.toml", "-o", "out"], "none.toml.*no such file"),
        (["study.toml", "-o", "out", "--shard", "3/2"], "shard = '3/2': give i/n"),
        (["study.toml", "-o", "out", "--shard", "x"], "--shard = 'x': give i/n"),
        (["study.toml", "-o", "out", "--workers", "0"], "workers = 0"),
        (["status", "out"], "no study.toml here"),
    ],
)
def test_bad_input_writes_nothing(
    arguments: list[str], message: str, tmp_path: Any, capsys: pytest.CaptureFixture[str], monkeypatch: Any
) -> None:
    written(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert main(["study", *arguments]) == 2
    error = capsys.readouterr().err
    assert re.search(message, error) and error.count("\n") == 1 and not Path("out").exists()


def test_killed_studies_continue_to_the_same_table(tmp_path: Any) -> None:
    """`kill -9` of the main process: its workers end too, and nothing is lost but the chunks at hand."""
    sampling = {"samples": 30, "seed": 3}
    path, out, whole = written(tmp_path, sampling=sampling, chunk=2), tmp_path / "out", tmp_path / "whole"
    process = started(path, "-o", out, "--workers", "2")
    await_parts(out, 2)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate(timeout=30)  # ends only when no worker holds its pipes
    before = len(list(out.glob("part-*.parquet")))
    assert 2 <= before < 30 and (out / "study.toml").is_file()
    assert main(["study", str(path), "-o", str(out)]) == 0
    assert main(["study", str(path), "-o", str(whole)]) == 0
    pd.testing.assert_frame_equal(rows_of(out), rows_of(whole))


def test_killed_estimates_continue_with_the_same_draws(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(
        tmp_path, scene=planar(tmp_path), accuracy={"models": ["massless"], "pilot": 16, "target": "5 %"}, chunk=2
    )
    out, whole = tmp_path / "out", tmp_path / "whole"
    process = started(path, "-o", out, "--estimate", "peak_force", "--workers", "2")
    await_parts(out, 2)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate(timeout=30)
    before = {part.name: part.stat().st_mtime_ns for part in out.glob("part-*.parquet")}
    found = []
    for folder in (out, whole):
        assert main(["study", str(path), "-o", str(folder), "--estimate", "peak_force", "--json"]) == 0
        found.append(json.loads(capsys.readouterr().out))
    assert before.items() <= {part.name: part.stat().st_mtime_ns for part in out.glob("part-*.parquet")}.items()
    pd.testing.assert_frame_equal(rows_of(out).head(16), rows_of(whole).head(16))
    # How many runs follow the first ones depends on measured seconds, so that the values differ within both intervals.
    assert max(one["interval"][0] for one in found) <= min(one["interval"][1] for one in found)
    assert all(one["runs"]["exact"] >= 16 for one in found)


def test_ctrl_c_keeps_what_is_done(tmp_path: Any) -> None:
    path, out = written(tmp_path, sampling={"samples": 300, "seed": 3}, chunk=2), tmp_path / "out"
    process = started(path, "-o", out, "--workers", "1")
    await_parts(out, 3)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=30)
    assert process.returncode == 130 and f"what is done is kept in {out}; the same command continues" in error
    rows = rows_of(out)
    assert 6 <= len(rows) < 600 and (rows.status == "ok").all() and len(rows) % 2 == 0
    assert not [path for path in out.iterdir() if path.name.startswith(".")]
