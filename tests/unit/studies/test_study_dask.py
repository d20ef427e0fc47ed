"""A study on a Dask cluster of this machine, also when one of its workers is killed."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from threading import Thread
from typing import Any

import pandas as pd
import pytest
from support.study_tables import cheap_study, rows_of

import msfp_gen
from msfp_gen import InputError

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as started:
        yield started


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    """The rows of the study without Dask."""
    folder = tmp_path_factory.mktemp("whole")
    msfp_gen.study(many(), folder, threads=True)
    return rows_of(folder)


def many() -> dict[str, Any]:
    return cheap_study(sampling={"samples": 50, "seed": 3}, chunk=2)


def test_rows_are_those_of_threads(cluster: Any, whole: pd.DataFrame, tmp_path: Path) -> None:
    assert msfp_gen.study(many(), tmp_path, dask=cluster.scheduler_address) == (100, 0, 100, 0)
    pd.testing.assert_frame_equal(rows_of(tmp_path), whole)


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
    monkeypatch.setattr("msfp_gen.studies.pool.CONNECT", "1s")
    with pytest.raises(InputError, match=r"--dask = 'tcp://127.0.0.1:9': no scheduler answers there") as caught:
        msfp_gen.study(many(), tmp_path / "out", dask="tcp://127.0.0.1:9")
    assert "\n" not in str(caught.value) and not (tmp_path / "out").exists()
