"""`msfp-gen batch`: runs are written as they end, one table has them all, and Ctrl-C keeps what has ended."""

from __future__ import annotations

import csv
import json
import re
import shlex
import signal
import subprocess
import sys
import time
import weakref
from contextlib import closing
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from support import ROOT, endless, hearing

from msfp_gen import InputError, RunError, Scene, changed_scene, load_scene, simulate
from msfp_gen.cli import main
from msfp_gen.cli.console import signals_as_interrupts
from msfp_gen.motions import records
from msfp_gen.results.result import load_result
from msfp_gen.studies import batch
from msfp_gen.studies.batch import completed_runs
from msfp_gen.studies.sweep import row_of, sweep_table, variations, varied_field, write_table


def test_runs_and_table_are_written(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    folder, table = tmp_path / "runs", tmp_path / "runs.csv"
    arguments = ["--vary", "solver.rtol=1e-2,1e-3", "-o", str(folder), "--table", str(table)]
    assert main(["batch", "fenz-test1", "fenz-test2", *arguments]) == 0
    out, err = capsys.readouterr()
    assert "4 runs" in out and err == f"wrote 4 runs to {folder}\nwrote {table}\n"
    names = sorted(path.name for path in folder.iterdir())
    assert names[0] == "1-fenz-test1-solver.rtol-0.01.nc" and len(names) == 4
    rows = list(csv.DictReader(StringIO(table.read_text(encoding="utf-8"))))
    assert [row["file"] for row in rows] == names
    for row in rows:
        kept = load_result(folder / row["file"])
        alone = simulate(changed_scene(row["scene"], {"solver.rtol": float(row["solver.rtol"])}))
        assert float(row["peak_displacement [m]"]) == alone.summary["peak_displacement"]["radial"]
        assert float(row["minimum_gap_3 [m]"]) == alone.summary["minimum_gap"][2] == kept.summary["minimum_gap"][2]
        assert kept.scene.solver.rtol == float(row["solver.rtol"]) and row["status"] == "ok"


def test_the_table_as_parquet_holds_numbers_and_units(tmp_path: Any) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "runs.parquet"
    arguments = ["--vary", "bearing.friction=[0.05,0.02,0.02,0.08],0.04", "--vary", "solver.rtol=1e-2"]
    assert main(["batch", "fenz-test1", *arguments, "--table", str(path)]) == 0
    table = parquet.read_table(path)
    assert table["bearing.friction"].to_pylist() == ["[0.05, 0.02, 0.02, 0.08]", "0.04"]
    assert table["solver.rtol"].to_pylist() == [0.01, 0.01]
    assert table.schema.field("peak_force").metadata == {b"units": b"N"}


def test_json_carries_the_varied_values(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["batch", "fenz-test1", "--vary", "solver.rtol=1e-2,1e-3", "--json", "--workers", "1"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [run["varied"] for run in found] == [{"solver.rtol": 1e-2}, {"solver.rtol": 1e-3}]
    assert [(run["number"], run["source"], run["status"], run["file"]) for run in found] == [
        (1, "fenz-test1", "ok", None),
        (2, "fenz-test1", "ok", None),
    ]


def test_rows_of_a_varied_fidelity_state_it(capsys: pytest.CaptureFixture[str]) -> None:
    command = ["batch", "fenz-test1", "--workers", "1", "--vary"]
    assert main([*command, "fidelity='exact','loose'"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any("fidelity" in line for line in lines)
    assert [word for line in lines for word in ("exact", "loose") if word in line] == ["exact", "loose"]
    assert main([*command, "fidelity='exact','rigid'"]) == 2  # before the first run: nothing is kept
    printed = capsys.readouterr()
    assert not printed.out and "one bearing has no such model" in printed.err and "ended" not in printed.err


def test_names_sort_and_need_no_quotes(tmp_path: Any) -> None:
    values = ",".join(f"[{0.01 * k:.2f}, 0.02, 0.02, 0.08]" for k in range(1, 11))
    varied = ["--vary", f"bearing.friction={values}", "--vary", "duration=0.1"]
    assert main(["batch", "fenz-test1", *varied, "-o", str(tmp_path)]) == 0
    names = sorted(path.name for path in tmp_path.iterdir())
    assert [int(name[:2]) for name in names] == list(range(1, 11))
    assert names[8] == "09-fenz-test1-bearing.friction-0.09-0.02-0.02-0.08-duration-0.1.nc"
    assert all(shlex.quote(name) == name and re.fullmatch(r"[A-Za-z0-9._-]+", name) for name in names)


def test_the_terminal_table_fits_80_columns() -> None:
    fields = [
        varied_field(f"bearing.{name}={value}") for name, value in (("gravity", "9.8,9.81"), ("friction", "0.05,0.06"))
    ]
    fields += [varied_field("top.stiffness=1e8,2e8"), varied_field("motion.amplitude='1.2 mm','1.3 mm'")]
    fields += [varied_field("solver.rtol=1e-4")]  # of one value: not worth a column
    chosen = variations("fenz-test1", fields)
    rows = [row_of(k + 1, chosen[k], r, None) for k, r in completed_runs([v.scene for v in chosen], 1)]
    table = sweep_table(rows)
    assert (
        max(map(len, table.text.splitlines()[2:])) <= 80 and "not shown: top.stiffness, motion.amplitude" in table.title
    )
    from rich.console import Console

    console = Console(width=80, record=True, file=StringIO())
    console.print(table.rich())
    text = console.export_text()
    assert "9.81" in text and "…" not in text
    assert len([line for line in text.splitlines() if line.strip()]) == 2 + 2 + len(rows)  # title, heading, rows


def test_a_record_is_read_once_unless_it_changes(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    read, found = records.read_record, []
    monkeypatch.setattr(
        records, "read_record", lambda *paths, **options: found.append(paths) or read(*paths, **options)
    )
    path = tmp_path / "quake.csv"
    path.write_text("time [s], a1 [m/s^2]\n" + "".join(f"{0.02 * k:.2f}, {k % 7 - 3}\n" for k in range(400)))
    scene = tmp_path / "scene.toml"
    scene.write_text(
        'bearing = "fenz-tfp"\n[motion]\nkind = "record"\nfile = "quake.csv"\nscale = 0.01\n'
        '[top]\nkind = "rig"\naxial_load = "112 kN"\nstiffness = 1e8\n',
        encoding="utf-8",
    )
    chosen = variations(scene, [varied_field("motion.scale=0.01,0.02,0.03")])
    assert len(found) == 1
    peaks = [abs(v.scene.motion.acceleration(v.scene.motion.knots)).max() for v in chosen]
    assert peaks[2] == pytest.approx(3 * peaks[0]) and peaks[1] == pytest.approx(2 * peaks[0])
    path.write_text(path.read_text().replace(", 3\n", ", 2.5\n"))
    assert load_scene(scene).motion != chosen[0].scene.motion and len(found) == 2


def test_runs_are_handed_over_as_they_end() -> None:
    """A run of a minute does not keep the others back, and ends when nobody waits for it."""
    scenes = [*endless(1), load_scene("fenz-test1"), load_scene("fenz-test2")]
    begin = time.monotonic()
    with closing(completed_runs(scenes, 2)) as runs:
        assert sorted((next(runs)[0], next(runs)[0])) == [1, 2]
    assert time.monotonic() - begin < 20


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--table", "runs.xlsx"], "--table = 'runs.xlsx': give a name that ends in .csv or .parquet"),
        (["--workers", "0"], "workers = 0: give a whole number"),
        (["--vary", "solver.method='dopri5'", "--vary", "effects.sliders='massless'"], "massless sliders have no"),
    ],
)
def test_input_is_checked_before_anything_runs(
    arguments: list[str], words: str, tmp_path: Any, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["batch", "fenz-test1", *arguments, "-o", "runs"]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("error: ") and err.count("\n") == 1 and words in err
    assert not list(tmp_path.iterdir())


def test_what_failed_is_named_and_kept(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["batch", "fenz-test1", "--vary", "solver.max_steps=5,100000", "-o", str(tmp_path)]) == 1
    out, err = capsys.readouterr()
    assert "steps" in out and "error: 1 of 2 runs did not reach their end; the first: fenz-test1" in err
    assert len(list(tmp_path.iterdir())) == 2


def test_a_run_without_rows_is_a_row_of_the_table(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run_to_end = batch.run_to_end

    def second_fails(scene: Scene, **options: Any) -> Any:
        if scene.solver.rtol == 2e-3:
            raise RunError("stopped at t = 0 s: jammed", status="newton")
        return run_to_end(scene, **options)

    monkeypatch.setattr(batch, "run_to_end", second_fails)
    words = ["batch", "fenz-test1", "--vary", "solver.rtol=1e-3,2e-3,3e-3", "-o", str(tmp_path / "runs")]
    assert main([*words, "--table", str(tmp_path / "runs.csv")]) == 1
    out, err = capsys.readouterr()
    assert "newton" in out and "error: 1 of 3 runs did not reach their end; the first: fenz-test1, solver.rtol" in err
    assert len(list((tmp_path / "runs").iterdir())) == 2
    rows = list(csv.DictReader((tmp_path / "runs.csv").read_text(encoding="utf-8").splitlines()))
    assert [row["status"] for row in rows] == ["ok", "newton", "ok"]
    assert rows[1]["message"].endswith("jammed") and rows[1]["peak_force [N]"] == rows[1]["file"] == ""


def test_a_building_without_rows_has_the_columns_of_buildings(tmp_path: Path) -> None:
    (variation,) = variations("hospital-clc", [])
    row = row_of(1, variation, RunError("stopped at t = 0 s: jammed", status="newton"), None)
    header = write_table([row], tmp_path / "runs.csv").read_text(encoding="utf-8").splitlines()[0]
    assert "peak_drift_ratio" in header and "axial_load" not in header
    assert "newton" in str(sweep_table([row]).rows)


@pytest.mark.slow
def test_ctrl_c_keeps_what_has_ended(tmp_path: Any) -> None:
    long = tmp_path / "long.toml"
    long.write_text('bearing = "fenz-tfp"\n[motion]\nkind = "harmonic"\namplitude = 0.05\nfrequency = 0.5\n'
        'cycles = 2000\n[top]\nkind = "rig"\naxial_load = "112 kN"\nstiffness = 1e8\n'
        '[solver]\nmethod = "dopri5"\nrtol = 1e-5\n[effects]\nsliders = "inertial"\n')  # fmt: skip
    folder, table = str(tmp_path / "runs"), str(tmp_path / "runs.csv")
    words = ["batch", "fenz-test1", str(long), "-o", folder, "--table", table, "--json", "--workers", "2"]
    process = subprocess.Popen(
        [sys.executable, "-m", "msfp_gen", *words],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=hearing,
    )  # fmt: skip
    limit = time.monotonic() + 60
    while not list(tmp_path.glob("runs/[0-9]*.nc")) and time.monotonic() < limit:  # not the temporary file
        time.sleep(0.05)
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130 and "1 of 2 runs had ended and are kept" in err, err
    assert [path.name for path in tmp_path.glob("runs/*")] == ["1-fenz-test1.nc"]
    assert load_result(tmp_path / "runs" / "1-fenz-test1.nc").status == "ok"
    assert [run["source"] for run in json.loads(out)] == ["fenz-test1"]
    assert [row["scene"] for row in csv.DictReader(StringIO(Path(table).read_text(encoding="utf-8")))] == ["fenz-test1"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_in_a_callback_is_not_lost(number: signal.Signals) -> None:
    """Python ignores it there; libraries that read and write files have such callbacks."""

    class Item:
        pass

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    item = Item()
    reference = weakref.ref(item, lambda _: signal.raise_signal(number))
    begin = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt), signals_as_interrupts():
            del item
            time.sleep(10)
    finally:
        signal.signal(signal.SIGINT, before)
    assert reference() is None and time.monotonic() - begin < 5


def test_a_table_needs_a_known_suffix(tmp_path: Any) -> None:
    with pytest.raises(InputError, match=r"output = .*ends in .csv or .parquet"):
        write_table([], tmp_path / "runs.txt")
