"""Memory of runs: refused before, ended with their rows while they run, and estimated as it is."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support import ROOT, preset_run, scene_of
from support.resuming import assert_same

from msfp_gen import Auto, InputError, Motion, RunError, simulate, simulate_batch
from msfp_gen.cli import main
from msfp_gen.results.result import Result, load_result
from msfp_gen.simulation import bearing_run as simulation
from msfp_gen.simulation import memory


def with_memory(monkeypatch: pytest.MonkeyPatch, size: float) -> None:
    """A machine with this much memory [bytes], on which no run is too small to look."""
    monkeypatch.setattr(memory, "available", lambda: size)
    monkeypatch.setattr(memory, "SMALL", 0)


def test_rows_that_cannot_fit_are_refused_before_anything_runs(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr(memory, "available", lambda: 8e9)
    scene = scene_of("fenz-test2", output_step=1e-6)
    words = r"output_step = 1e-06: 5\.6e\+07 rows need 263 GB of memory and 8 GB are available; give at least 3\.4e-05"
    with pytest.raises(InputError, match=words):
        simulate(scene)
    monkeypatch.setattr("msfp_gen.cli.console.build", None)  # not even built
    monkeypatch.setattr("msfp_gen.scene.file.source.load_scene", lambda _: scene)
    assert main(["run", "fenz-test2", "-o", str(tmp_path / "run.nc")]) == 2
    assert "give at least 3.4e-05 [s], or a shorter duration" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
    assert memory._needed(replace(scene, output_step=3.3e-5)) < 8e9


def test_a_longest_step_is_the_least_number_of_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    """A step of a microsecond would end a run after minutes, with the memory full."""
    monkeypatch.setattr(memory, "available", lambda: 8e9)
    scene = scene_of("fenz-test2", solver={"max_step": 1e-6}, output_step=None)
    field, remedy = r"solver\.max_step = 1e-06: 5\.6e\+07 rows", "give an output_step of at least"
    with pytest.raises(InputError, match=rf"{field} need 263 GB of memory .*; {remedy} 3\.4e-05"):
        simulate(scene)


def test_the_rows_of_a_batch_count_together(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of("fenz-test2", output_step=0.01)
    with_memory(monkeypatch, 3.5 * memory._needed(scene))
    memory.require_memory([scene] * 3)
    monkeypatch.setattr("msfp_gen.studies.batch.build_model", None)
    with pytest.raises(InputError, match=r"output_step = 0\.01: 4 runs need .* GB of memory"):
        simulate_batch([scene] * 4)


def test_a_run_that_outgrows_the_memory_keeps_its_rows(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    whole, path = preset_run("fenz-test2"), tmp_path / "run.ck"
    monkeypatch.setattr(simulation, "STEPS_PER_CALL", 20)
    with pytest.MonkeyPatch.context() as patch:
        with_memory(patch, (memory.COPIES - 1) * 100 * memory.row_size(4))
        with pytest.raises(RunError, match="no memory for more rows; give output_step") as caught:
            simulate(scene_of("fenz-test2"), checkpoint=path, every=0.0)
    part = caught.value.result
    assert caught.value.status == "memory" and isinstance(part, Result)
    count = len(part.history.time)
    assert 100 < count <= 121
    np.testing.assert_array_equal(part.history.top_force, whole.history.top_force[:count])
    assert load_result(part.to_netcdf(tmp_path / "part.nc")).status == "memory"
    assert_same(whole, simulate(scene_of("fenz-test2"), checkpoint=path, resume=True))  # with more memory


def test_a_rest_for_ever_ends_with_what_there_is(monkeypatch: pytest.MonkeyPatch) -> None:
    with_memory(monkeypatch, 5e7)
    scene = scene_of("fenz-test2", motion=Motion.harmonic(0.02, 0.04).held(1e9), duration=None)
    with pytest.raises(RunError, match="no memory for more rows") as caught:
        simulate(scene)
    assert isinstance(caught.value.result, Result) and caught.value.result.history.time[-1] > 60.0


def test_the_size_of_a_row_is_that_of_the_result() -> None:
    history = preset_run("fenz-test2").history
    numbers = sum(values.size for values in history.arrays().values()) // len(history.time) + len(history.energy)
    others = 3 * 4 + 1  # friction coefficients, temperatures, memories and the settlement, with other laws and tops
    assert memory.row_size(4) == 8 * (numbers + others)


MEASURED = """
import sys
from dataclasses import replace
from pathlib import Path
from msfp_gen import Auto, load_scene, simulate
from msfp_gen.simulation import memory

def peak():  # of this process; ru_maxrss begins at the size of the process that started it
    text = Path("/proc/self/status").read_text()
    return 1024 * int(text.partition("VmHWM:")[2].split()[0])

scene = replace(load_scene("fenz-test2"), effects=Auto(), output_step=3e-4)
simulate(replace(scene, output_step=1.0)).to_netcdf(sys.argv[1])
before = peak()
simulate(scene).to_netcdf(sys.argv[1])
print((peak() - before) / memory._needed(scene))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="other systems count in other units")
def test_a_run_and_its_file_need_no_more_than_estimated(tmp_path: Path) -> None:
    # A build in the process that is measured would be its largest need of memory.
    simulate(replace(scene_of("fenz-test2"), effects=Auto(), output_step=1.0))
    command = [sys.executable, "-c", MEASURED, str(tmp_path / "run.nc")]
    share = float(subprocess.run(command, cwd=ROOT, text=True, capture_output=True, check=True).stdout)
    assert 0.3 < share < 1.0


# ---- what there is


def test_the_least_of_all_limits_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(memory.VARIABLE, raising=False)
    monkeypatch.setattr(memory, "_PROC", tmp_path)
    monkeypatch.setattr(memory, "_CGROUP", tmp_path)
    (tmp_path / "meminfo").write_text("MemTotal:  9000 kB\nMemAvailable:    4000 kB\n")
    assert memory._of_machine() == memory.available() == 4000 * 1024
    (tmp_path / "memory.max").write_text("3000000\n")
    (tmp_path / "memory.current").write_text("1000000\n")
    (tmp_path / "memory.stat").write_text("anon 5\ninactive_file 500000\n")
    assert memory.available() == 2500000
    (tmp_path / "memory.max").write_text("max\n")
    assert memory._of_group() == float("inf")
    (tmp_path / "memory").mkdir()
    for name, value in (("limit_in_bytes", 2000000), ("usage_in_bytes", 500000), ("stat", "total_inactive_file 7")):
        (tmp_path / "memory" / f"memory.{name}").write_text(str(value))
    assert memory.available() == 1500007


def test_a_limit_of_the_user(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(memory.VARIABLE, "1e6")
    assert 0.9e15 < memory._of_variable() < 1e15
    for text in ("much", "-1", "nan", "0"):
        monkeypatch.setenv(memory.VARIABLE, text)
        with pytest.raises(InputError, match=f"MSFP_GEN_MEMORY = '{text}': give the memory"):
            memory.available()
        with pytest.raises(InputError, match="MSFP_GEN_MEMORY"):  # where nothing is needed too
            memory.require_memory([])


def test_no_memory_left_is_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def full(*_: object, **__: object) -> None:
        raise MemoryError

    monkeypatch.setattr("msfp_gen.simulation.simulate.simulate", full)
    assert main(["run", "fenz-test2"]) == 1
    assert capsys.readouterr().err == "error: no memory is left; give output_step, a shorter duration or fewer scenes\n"
