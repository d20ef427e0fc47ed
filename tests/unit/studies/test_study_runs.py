"""Running a study: parts, continuing, failures, shards, engines."""

from __future__ import annotations

import math
import os
import random
import re
import sys
import threading
import time
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq
import pytest
from support.damaged_files import flip, noise, zeros
from support.study_tables import cheap_study, rows_of

import msfp_gen
from msfp_gen import InputError, RunError, simulate
from msfp_gen.scene.file.catalogue import preset_scene_table
from msfp_gen.studies import load_study, read_study, study_status
from msfp_gen.studies import run as running
from msfp_gen.studies.axes import SceneFactory
from msfp_gen.studies.batch import run_to_end

LONG = {  # a run of about a minute
    "bearing": "fenz-tfp",
    "motion": {"kind": "harmonic", "amplitude": 0.025, "frequency": 0.04, "cycles": 2.0},
    "top": {"kind": "rig", "axial_load": 112e3, "stiffness": 1e8, "rotational_stiffness": 1e6},
    "solver": {"method": "dopri5", "rtol": 1e-5},
    "effects": {"dimension": "spatial", "sliders": "inertial", "bouc_wen": "report", "rims": True, "uplift": False},
}


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.glob("part-*.parquet")}


def test_rows_are_those_of_simulate(tmp_path: Path) -> None:
    shown: list[tuple[int, int]] = []
    done = msfp_gen.study(cheap_study(), tmp_path, progress=lambda *now: shown.append(now))
    assert done == (12, 0, 12, 0) and shown[0] == (0, 12) and shown[-1] == (12, 12)
    rows, study = rows_of(tmp_path), load_study(cheap_study())
    assert list(rows.run) == list(range(1, 13)) and (rows.status == "ok").all() and (rows.message == "").all()
    for run in (1, 8):
        summary = simulate(study.scene(run)).summary
        row = rows.iloc[run - 1]
        assert row.peak_force == summary["peak_force"]["radial"] and row.rims_met == ""
        assert [row[f"peak_sliding_{k}"] for k in range(1, 5)] == list(summary["peak_sliding"])
    part = pq.read_schema(next(tmp_path.glob("part-*.parquet")))
    assert part.field("peak_force").metadata == {b"units": b"N"}
    assert [field.name for field in part][:5] == ["run", "rtol", "friction", "status", "message"]


def test_what_is_missing_is_computed_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    msfp_gen.study(cheap_study(), tmp_path)
    whole = contents(tmp_path)
    lost = sorted(whole)[1]
    (tmp_path / lost).unlink()
    asked, run_chunk = [], running.run_chunk
    monkeypatch.setattr(running, "run_chunk", lambda order, task: asked.append(task.number) or run_chunk(order, task))
    assert msfp_gen.study(cheap_study(), tmp_path) == (12, 8, 4, 0)
    assert asked == [1] and contents(tmp_path) == whole
    assert msfp_gen.study(cheap_study(), tmp_path) == (12, 12, 0, 0) and asked == [1]
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_an_interrupted_study_keeps_what_is_done(tmp_path: Path) -> None:
    def interrupt(done: int, _: int) -> None:
        if done == 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        msfp_gen.study(cheap_study(), tmp_path, workers=1, progress=interrupt)
    assert len(contents(tmp_path)) == 2
    assert msfp_gen.study(cheap_study(), tmp_path) == (12, 8, 4, 0)


def test_shards_make_one_study(tmp_path: Path) -> None:
    whole, shards = tmp_path / "whole", tmp_path / "shards"
    msfp_gen.study(cheap_study(), whole)
    assert msfp_gen.study(cheap_study(), shards, shard=(1, 2)) == (8, 0, 8, 0)
    assert study_status(shards).done == 8
    assert msfp_gen.study(cheap_study(), shards, shard=(2, 2)) == (4, 0, 4, 0)
    assert contents(shards) == contents(whole)
    pd.testing.assert_frame_equal(rows_of(shards), rows_of(whole))
    with pytest.raises(InputError, match="shard = '3/2': give i/n"):
        msfp_gen.study(cheap_study(), shards, shard=(3, 2))


def test_a_run_that_fails_is_a_row(tmp_path: Path) -> None:
    """Here with more steps than the scene permits."""
    axes = {"steps": {"sets": "solver.max_steps", "values": [10, 1_000_000]}}
    table = cheap_study(axes=axes, sampling=None, chunk=1)
    done = msfp_gen.study(table, tmp_path)
    rows = rows_of(tmp_path)
    assert done == (2, 0, 2, 1) and list(rows.status) == ["steps", "ok"]
    assert "step" in rows.message[0] and rows.peak_displacement[0] > 0 and study_status(tmp_path).failed == 1


def test_a_run_ends_at_its_limit_of_time(tmp_path: Path) -> None:
    table = cheap_study(scene=LONG, axes={}, sampling=None, limits={"run_seconds": 0.02})
    assert msfp_gen.study(table, tmp_path) == (1, 0, 1, 1)
    rows = rows_of(tmp_path)
    assert (rows.status == "limit").all() and rows.peak_displacement.isna().all()
    assert "limits.run_seconds" in rows.message[0]


def test_a_study_ends_where_too_many_runs_fail(tmp_path: Path) -> None:
    axes = {"steps": {"sets": "solver.max_steps", "values": list(range(1, 13))}}
    table = cheap_study(axes=axes, sampling=None, limits={"failures": 5})
    with pytest.raises(RunError, match=r"8 of 8 runs failed, more than limits.failures = 5; see the column message"):
        msfp_gen.study(table, tmp_path, workers=1)
    kept = contents(tmp_path)
    assert len(kept) == 2
    with pytest.raises(RunError, match="8 of 8"):  # again: they are counted, and nothing is run
        msfp_gen.study(table, tmp_path, workers=1)
    assert contents(tmp_path) == kept


def test_values_that_a_scene_refuses_are_rows(tmp_path: Path) -> None:
    """Two axes together: each value alone is tried before the first run."""
    axes = {
        "a": {"multiplies": "bearing.capacity", "values": [1.0, 3.0]},
        "b": {"multiplies": "bearing.capacity", "values": [1.0, 3.0]},
    }
    table = cheap_study(axes=axes, sampling=None)
    assert msfp_gen.study(table, tmp_path).failed == 1
    row = rows_of(tmp_path).iloc[3]
    assert row.status == "input" and "capacity" in row.message and row.isna().peak_displacement


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"sampling": {"samples": 6, "seed": 4}}, "sampling differs"),
        ({"keep": ["peak_displacement"]}, "keep differs"),
        ({"scene": "fenz-test2"}, "scene differs"),
        ({"chunk": 3}, "chunk differs"),
    ],
)
def test_a_folder_holds_one_study(tmp_path: Path, change: dict[str, Any], word: str) -> None:
    msfp_gen.study(cheap_study(), tmp_path)
    before = contents(tmp_path) | {"study.toml": (tmp_path / "study.toml").read_bytes()}
    with pytest.raises(InputError, match=f"this folder has parts of another study .{word}.; give another folder"):
        msfp_gen.study(cheap_study(**change), tmp_path)
    assert contents(tmp_path) | {"study.toml": (tmp_path / "study.toml").read_bytes()} == before


def test_a_study_may_grow_by_values_of_its_first_axis(tmp_path: Path) -> None:
    axes = cheap_study()["axes"]
    longer = {**axes, "rtol": {**axes["rtol"], "values": [1e-2, 5e-3, 4e-3]}}
    msfp_gen.study(cheap_study(chunk=None), tmp_path)  # chunks of 8: the last one has 4 runs
    assert len(contents(tmp_path)) == 2
    done = msfp_gen.study(cheap_study(axes=longer, chunk=None), tmp_path)
    assert done == (18, 8, 10, 0)
    assert list(rows_of(tmp_path).run) == list(range(1, 19))


def test_a_study_runs_again_from_the_file_in_its_folder(tmp_path: Path) -> None:
    msfp_gen.study(cheap_study(), tmp_path / "a")
    msfp_gen.study(tmp_path / "a" / "study.toml", tmp_path / "b")
    assert contents(tmp_path / "a") == contents(tmp_path / "b")


def test_a_changed_record_is_another_study(tmp_path: Path) -> None:
    record = tmp_path / "record.csv"
    rows = "".join(f"{0.01 * k:.2f},{0.3 * math.sin(math.pi * k / 10):.6f}\n" for k in range(101))
    record.write_text(f"time [s], a1 [m/s^2]\n{rows}", encoding="utf-8")
    table = {
        "scene": "ridgecrest-ccc",
        "records": {"motions": [{"file": str(record), "correct": False}]},
        "axes": {"a": {"sets": "solver.rtol", "values": [1e-2]}},
        "keep": ["peak_displacement"],
    }
    msfp_gen.study(table, tmp_path / "out")
    record.write_text(record.read_text(encoding="utf-8").replace("0.300000", "0.310000"), encoding="utf-8")
    with pytest.raises(InputError, match=r"parts of another study .its files or the equations have changed"):
        msfp_gen.study(table, tmp_path / "out")


def test_any_executor_serves(tmp_path: Path) -> None:
    threads = set()

    class Mine(ThreadPoolExecutor):
        def submit(self, *arguments: Any, **named: Any) -> Any:
            threads.add(threading.get_ident())
            return super().submit(*arguments, **named)

    with Mine(2) as executor:
        assert msfp_gen.study(cheap_study(), tmp_path, executor=executor) == (12, 0, 12, 0)
        assert executor.submit(int).result() == 0  # it stays open
    assert threads
    with pytest.raises(InputError, match="executor and dask: give one engine"):
        msfp_gen.study(cheap_study(), tmp_path / "b", executor=executor, dask="tcp://127.0.0.1:9")


@pytest.mark.parametrize("error", [BrokenExecutor("a process died"), None], ids=["broken", "cancelled"])
def test_workers_that_die_are_one_line(error: Exception | None, tmp_path: Path) -> None:
    class Dying(ThreadPoolExecutor):
        def submit(self, *_: Any, **__: Any) -> Any:
            future: Future[Any] = Future()
            if error is None:
                future.cancel()
                future.set_running_or_notify_cancel()
            else:
                future.set_exception(error)
            return future

    with pytest.raises(RunError, match=r"workers died .Dying: .*; check their memory, and run the same command again"):
        msfp_gen.study(cheap_study(), tmp_path, executor=Dying(1))
    assert msfp_gen.study(cheap_study(), tmp_path) == (12, 0, 12, 0)


def test_few_calls_wait_at_a_time(tmp_path: Path) -> None:
    """Memory does not grow with the number of chunks."""
    waiting, most = 0, 0
    lock = threading.Lock()

    class Counting(ThreadPoolExecutor):
        def submit(self, *arguments: Any, **named: Any) -> Any:
            nonlocal waiting, most
            with lock:
                waiting, most = waiting + 1, max(most, waiting + 1)
            future = super().submit(*arguments, **named)
            future.add_done_callback(ended)
            return future

    def ended(_: Any) -> None:
        nonlocal waiting
        with lock:
            waiting -= 1

    with Counting(1) as executor:
        msfp_gen.study(cheap_study(chunk=1), tmp_path, executor=executor)
    assert most <= 2


def test_status_says_how_far_and_how_fast(tmp_path: Path) -> None:
    msfp_gen.study(cheap_study(chunk=2), tmp_path, shard=(1, 2))
    now = time.time()
    for place, path in enumerate([tmp_path / "study.toml", *sorted(tmp_path.glob("part-*.parquet"))]):
        stamp = now - 14 + 4 * place
        os.utime(path, (stamp, stamp))
    found = study_status(tmp_path)
    assert (found.runs, found.done, found.parts, found.chunks, found.failed) == (12, 6, 3, 6, 0)
    assert found.rate == pytest.approx(0.5) and found.seconds_left == pytest.approx(12) and found.running
    with pytest.raises(InputError, match=r"no study.toml here; give the folder of a study"):
        study_status(tmp_path / "nothing")
    text = (tmp_path / "study.toml").read_text(encoding="utf-8")
    for chunk in ("0", "inf", "'two'"):
        (tmp_path / "study.toml").write_text(re.sub(r"(?m)^chunk = .*$", f"chunk = {chunk}", text), encoding="utf-8")
        with pytest.raises(InputError, match="not written by msfp-gen"):
            study_status(tmp_path)


def test_the_rate_is_that_of_the_study_where_chunks_end_in_bunches(tmp_path: Path) -> None:
    """Two workers whose chunks of 20 s end within 0.1 s of each other: 0.1 runs per second, not 10."""
    msfp_gen.study(cheap_study(chunk=1, sampling={"samples": 4, "seed": 3}), tmp_path)
    begin = time.time() - 100
    parts = sorted(tmp_path.glob("part-*.parquet"))
    stamps = [begin - 1000, *(begin + 20 * round_ + late for round_ in (1, 2, 3) for late in (0.0, 0.1))]
    for path, stamp in zip(parts, stamps, strict=False):  # the first is of an earlier call, the last is missing
        os.utime(path, (stamp, stamp))
    parts[-1].unlink()
    os.utime(tmp_path / "study.toml", (begin, begin))
    found = study_status(tmp_path)
    assert (found.done, found.parts) == (7, 7) and found.running
    assert found.rate == pytest.approx(6 / 60.1) and found.seconds_left == pytest.approx(60.1 / 6)


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match=r"output = .*file"):
        msfp_gen.study(cheap_study(), tmp_path / "file")


def test_a_damaged_part_is_an_error_that_says_so(tmp_path: Path) -> None:
    """Bytes of its pages that were zeroed or changed, and a missing end: never other rows."""
    msfp_gen.study(cheap_study(), tmp_path, workers=1)
    expected = read_study(tmp_path)
    part = sorted(tmp_path.glob("part-*.parquet"))[1]
    whole, refused = part.read_bytes(), 0
    footer = len(whole) - 8 - int.from_bytes(whole[-8:-4], "little")
    for seed in range(60):
        content, dice = bytearray(whole[:footer]), random.Random(seed)
        dice.choice([zeros, noise, flip])(content, dice)
        part.write_bytes(content + whole[footer:] if seed % 10 else whole[: dice.randrange(len(whole))])
        try:
            assert read_study(tmp_path).equals(expected)
        except InputError as error:
            assert "a part of the study is damaged" in str(error)
            refused += 1
    assert refused >= 50


def test_a_row_costs_few_calls() -> None:
    """Calls of Python in a planar row, which do not depend on the load of the machine: 3100, and 4500 before."""
    effects = {"dimension": "planar", "sliders": "massless", "rims": False, "bouc_wen": "plastic"}
    scene = {**preset_scene_table("fenz-test1"), "effects": effects, "solver": {"rtol": 1e-2}}
    axes = {"friction": {"multiplies": "bearing.friction", "values": [0.9, 1.0, 1.1, 1.2]}}
    study = load_study({"scene": scene, "axes": axes, "keep": ["peak_displacement", "peak_force", "peak_sliding"]})
    factory, calls = SceneFactory(study.inputs), 0

    def count(_: object, event: str, __: object) -> None:
        nonlocal calls
        calls += event in ("call", "c_call")

    try:
        for factor in (1.0, 1.1, 1.2):
            sys.setprofile(count if factor > 1.0 else None)  # the first row loads the model
            study.keep.values(run_to_end(factory.scene([factor])), {"friction": factor})
    finally:
        sys.setprofile(None)
    assert calls / 2 < 3600
