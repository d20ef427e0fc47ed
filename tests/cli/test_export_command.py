"""`msfp-gen export`: a result as CSV or Parquet, with chosen columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from msfp_gen import load_scene, simulate
from msfp_gen.cli import main


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return simulate(load_scene("fenz-test1")).save(tmp_path_factory.mktemp("export") / "run.nc")


def test_chosen_columns_come_in_the_order_given(saved: Path, tmp_path: Path) -> None:
    path = tmp_path / "loop.csv"
    names = "top_force_E1, sliding, displacement_E1,sliding_2"
    assert main(["export", str(saved), "-o", str(path), "--columns", names]) == 0
    header = path.read_text(encoding="utf-8").splitlines()[1].split(",")
    assert header == [
        "time [s]", "top_force_E1 [N]", *(f"sliding_{k} [m]" for k in range(1, 5)), "displacement_E1 [m]",
    ]  # fmt: skip
    rows = np.loadtxt(path, delimiter=",", skiprows=2, comments="#")
    history = simulate(load_scene("fenz-test1")).history
    np.testing.assert_array_equal(rows[:, 6], history.displacement[:, 0])
    np.testing.assert_array_equal(rows[:, 1], history.top_force[:, 0])


def test_parquet_and_the_run_of_a_scene(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "loop.parquet"
    assert main(["export", "fenz-test1", "-o", str(path), "--columns", "gap"]) == 0
    assert parquet.read_schema(path).names == ["time", "gap_1", "gap_2", "gap_3", "gap_4"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-o", "loop.mat"], "--output = 'loop.mat': give a name that ends in .csv or .parquet"),
        (["-o", "loop.csv", "--columns", "force"], "columns: 'force' is none; give names of columns, such as disp"),
        (["-o", "loop.csv", "--columns", ""], "columns: '' is none"),
    ],
)
def test_bad_exports_are_refused_in_one_line(
    arguments: list[str], words: str, saved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert main(["export", str(saved), *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("error: ") and err.count("\n") == 1 and words in err
    assert not list(tmp_path.iterdir())
