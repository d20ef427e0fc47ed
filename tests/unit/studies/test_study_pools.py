"""Studies on every pool: rows are those of runs one by one, on threads, processes, executors and Dask.

Random studies run one after the other on the same workers: their files have the same names and other contents in every
study, in one folder or in several.
"""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pandas as pd
import pytest
from support import ROOT
from support.study_tables import cheap_study, rows_of, write_record

import msfp_gen
from msfp_gen import InputError, simulate
from msfp_gen.scene.file.catalogue import preset_scene_table
from msfp_gen.scene.file.loader import dumps
from msfp_gen.studies import load_study

LAUNCHER = shutil.which("mpiexec")
Table = dict[str, Any]
AXES: tuple[Table, ...] = (
    {"sets": "bearing.friction", "values": [[0.05, 0.02, 0.02, 0.09], 0.06]},
    {"sets": "bearing.friction", "surfaces": [1, 4], "values": [0.04, 0.09]},
    {"multiplies": "bearing.radius", "values": [1.0, 1.1]},
    {"multiplies": "bearing.friction", "surfaces": [1], "distribution": "uniform", "low": 0.7, "high": 1.3},
    {"sets": "top.axial_load", "values": ["100 kN", 120e3]},
    {"sets": "motion.file", "values": ["b.csv", "c.csv"]},
    {"sets": "motion.scale", "distribution": "uniform", "low": 0.5, "high": 2.0},
    {"factors": "asce7"},
    {"sets": "bearing", "values": ["fenz-tfp", "becker-tfp"], "labels": ["fenz", "becker"]},
)


def random_study(rng: np.random.Generator, folder: Path) -> Path:
    """A study of up to 16 runs of a second with its files; the file of the study."""
    for name in ("a", "b", "c"):
        write_record(folder / f"{name}.csv", float(f"{rng.uniform(0.3, 3.0):.2f}"))
    pivot = {"preset": "fenz-tfp", "friction": [0.05, 0.017, 0.017, 0.1], "friction_at": "pivot"}
    scene = {**preset_scene_table("fenz-test1"), "solver": {"rtol": 1e-2}}
    scene |= {"bearing": pivot if rng.random() < 0.5 else "fenz-tfp"}
    scene |= {"motion": {"kind": "record", "file": "a.csv", "correct": False}}
    chosen = [AXES[index] for index in rng.choice(len(AXES), rng.integers(1, 3), replace=False)]
    table: Table = {"scene": scene, "keep": ["peak_displacement", "peak_force"], "chunk": int(rng.integers(1, 4))}
    if rng.random() < 0.5:
        chosen = [axis for axis in chosen if not axis.get("sets", "").startswith("motion")]
        motions = [{"file": f"{name}.csv", "correct": False} for name in ("a", "b")]
        table["records"] = {"motions": motions, "scales": [1.0, float(f"{rng.uniform(0.5, 2.0):.2f}")]}
    table["axes"] = {f"x{number}": axis for number, axis in enumerate(chosen)}
    if any("distribution" in axis for axis in chosen):
        table["sampling"] = {"samples": 2, "seed": int(rng.integers(100))}
    (folder / "study.toml").write_text(dumps(table), encoding="utf-8")
    return folder / "study.toml"


@contextmanager
def engine(name: str) -> Iterator[Executor]:
    if name == "threads":
        with ThreadPoolExecutor(2) as executor:
            yield executor
    elif name == "processes":
        with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as executor:
            yield executor
    else:
        distributed = pytest.importorskip("distributed")
        with (
            distributed.LocalCluster(
                n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50
            ) as made,
            distributed.Client(made) as client,
        ):
            yield client.get_executor(pure=False)


def check(name: str, seeds: range, folder: Path) -> None:
    """Compare the rows of studies on one engine with runs one by one."""
    with engine(name) as executor:
        for seed in seeds:
            rng = np.random.default_rng(seed)
            file = random_study(rng, folder / str(rng.integers(2)))
            out = folder / f"out-{seed}"
            done = msfp_gen.study(file, out, executor=executor, workers=2)
            rows, study = rows_of(out), load_study(file)
            assert done == (study.runs, 0, study.runs, 0) and (rows.status == "ok").all()
            for run in range(1, study.runs + 1):
                summary = simulate(study.scene(run)).summary
                row = rows.iloc[run - 1]
                found = row.peak_displacement, row.peak_force
                assert found == tuple(summary[key]["radial"] for key in ("peak_displacement", "peak_force")), seed


@pytest.mark.slow
def test_studies_on_the_same_threads_are_their_runs(tmp_path: Path) -> None:
    check("threads", range(2), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["threads", "processes", "dask"])
def test_many_studies_on_the_same_workers_are_their_runs(name: str, tmp_path: Path) -> None:
    check(name, range(3, 11), tmp_path)


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as started:
        yield started


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    """The rows of the study without Dask."""
    folder = tmp_path_factory.mktemp("whole")
    msfp_gen.study(many(), folder)
    return rows_of(folder)


def many() -> dict[str, Any]:
    return cheap_study(sampling={"samples": 50, "seed": 3}, chunk=2)


@pytest.mark.slow
def test_rows_of_dask_are_those_of_threads(cluster: Any, whole: pd.DataFrame, tmp_path: Path) -> None:
    assert msfp_gen.study(many(), tmp_path, dask=cluster.scheduler_address) == (100, 0, 100, 0)
    pd.testing.assert_frame_equal(rows_of(tmp_path), whole)


@pytest.mark.slow
def test_a_killed_worker_costs_nothing_but_time(cluster: Any, whole: pd.DataFrame, tmp_path: Path) -> None:
    """Its chunks go to the other worker, and its nanny starts it again."""
    victim = next(iter(cluster.workers.values())).pid

    def kill() -> None:
        while len(list(tmp_path.glob("part-*.parquet"))) < 5:
            time.sleep(0.002)
        os.kill(victim, signal.SIGKILL)

    killer = Thread(target=kill)
    killer.start()
    done = msfp_gen.study(many(), tmp_path, dask=cluster.scheduler_address)
    killer.join()
    assert done == (100, 0, 100, 0)
    pd.testing.assert_frame_equal(rows_of(tmp_path), whole)


def test_no_scheduler_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("msfp_gen.studies.workers.CONNECT", "1s")
    with pytest.raises(InputError, match=r"--dask = 'tcp://127.0.0.1:9': no scheduler answers there") as caught:
        msfp_gen.study(many(), tmp_path / "out", dask="tcp://127.0.0.1:9")
    assert "\n" not in str(caught.value) and not (tmp_path / "out").exists()


@pytest.mark.skipif(LAUNCHER is None, reason="needs an MPI library and its mpiexec")
def test_rows_of_mpi_are_those_of_threads(tmp_path: Path) -> None:
    """The program of examples/libraries."""
    pytest.importorskip("mpi4py")
    file, out, whole = tmp_path / "study.toml", tmp_path / "out", tmp_path / "whole"
    file.write_text(dumps(cheap_study()), encoding="utf-8")
    program = ROOT / "examples" / "libraries" / "mpi.py"
    command = [str(LAUNCHER), "-n", "3", sys.executable, "-m", "mpi4py.futures", str(program), str(file), str(out)]
    run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert run.returncode == 0, run.stderr
    msfp_gen.study(file, whole)
    pd.testing.assert_frame_equal(rows_of(out), rows_of(whole))


@pytest.mark.slow
def test_a_missing_library_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("msfp_gen.studies.workers.find_spec", lambda _: None)
    with pytest.raises(InputError, match="--dask needs distributed; pip install distributed"):
        msfp_gen.study(many(), tmp_path / "out", dask="tcp://127.0.0.1:9")
