"""A study on MPI processes, where MPI is installed."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from support.study_tables import cheap_study, rows_of

import msfp_gen
from msfp_gen import InputError
from msfp_gen.scene.file.toml_text import dumps

pytest.importorskip("mpi4py")
LAUNCHER = shutil.which("mpiexec")


@pytest.mark.skipif(LAUNCHER is None, reason="needs an MPI library and its mpiexec")
def test_rows_are_those_of_threads(tmp_path: Path) -> None:
    file, out, whole = tmp_path / "study.toml", tmp_path / "out", tmp_path / "whole"
    file.write_text(dumps(cheap_study()), encoding="utf-8")
    command = [str(LAUNCHER), "-n", "3", sys.executable, "-m", "mpi4py.futures", "-m", "msfp_gen"]
    command += ["study", str(file), "-o", str(out), "--mpi"]
    run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert run.returncode == 0 and "12 of 12 runs" in run.stdout, run.stderr
    msfp_gen.study(file, whole, threads=True)
    pd.testing.assert_frame_equal(rows_of(out), rows_of(whole))


def test_one_process_or_no_library_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--mpi: (this is one process; start it as mpiexec|.*install an MPI library)"):
        msfp_gen.study(cheap_study(), tmp_path / "out", mpi=True)
    assert not (tmp_path / "out").exists()
