"""Rows streamed to disk: the file of an unstreamed run, number by number, in memory that does not grow."""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import ROOT, preset_run, scene_of, thinned
from support.resuming import assert_same, interrupted, stopping_at

from msfp_gen import Auto, InputError, Load, Motion, RunError, Scene, Top, load_scene, presets, simulate
from msfp_gen.cli import main
from msfp_gen.results import joining
from msfp_gen.results.joining import thinned_history
from msfp_gen.results.result import Result
from msfp_gen.scene.file.loader import scene_text
from msfp_gen.scene.scene_fields import Stop
from msfp_gen.simulation import memory, rows
from msfp_gen.simulation import simulate as simulation
from msfp_gen.simulation.checkpoint import Checkpoint
from msfp_gen.simulation.rows import RowFile

CLOCK = ("counter_wall_time", "provenance_build_seconds", "digest")
PIECE = 71  # rows of a block: no run has a multiple of it


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows go to disk and from there to the file in many blocks."""
    monkeypatch.setattr(simulation, "STEPS_PER_CALL", 20)
    monkeypatch.setattr(simulation, "ROWS_HELD", 16)
    monkeypatch.setattr(rows, "BLOCK", PIECE)
    monkeypatch.setattr(rows, "blocks", lambda count, read: joining.blocks(count, read, PIECE))


def leaving() -> Scene:
    """A planar run that continues in space, at even rows, when a load across its plane begins."""
    load = Load.from_arrays([0, 3, 3.5, 40], np.outer([0.0, 0.0, 1.0, 1.0], [-2e3, 2e3, 0.0]))
    top = Top.rig(112e3, stiffness=1e6, damping=5.0, rotational_stiffness=1e5, rotational_damping=5.0)
    motion = Motion.harmonic(0.05, 1.0, cycles=4, direction=0.3)
    return Scene(presets.bearing("fenz-tfp"), motion, top, load=load, output_step=0.007, effects=Auto(uplift=False))


def heating() -> Scene:
    """A run that continues with a model of heat, which records temperatures the first model has not."""
    bearing = presets.bearing("fenz-tfp").replace(reference_pressure=15e6)
    scene = replace(load_scene("fenz-test2"), bearing=bearing, duration=None, effects=Auto())
    return replace(scene, motion=Motion.harmonic(0.08, 0.5, cycles=2))


SCENES = {
    "own steps": scene_of("fenz-test2"),
    "even rows": scene_of("fenz-test2", output_step=0.06),
    "a planar model aslant": scene_of("fenz-test2", motion=Motion.harmonic(0.05, 0.4, direction=0.3), effects=None),
    "a stop": scene_of("fenz-test5", stop=Stop(displacement=0.06)),
}


def shown(result: Result) -> dict[str, Any]:
    return {key: value for key, value in result.summary.items() if key not in ("wall_time", "real_time_factor")}


def assert_same_file(whole: Result, path: Path, other: Path) -> Result:
    """The file at `path` is the one that `whole` writes, but for what the clock says; returns what it holds."""
    found, expected = Result.from_netcdf(path), Result.from_netcdf(whole.to_netcdf(other))
    datasets = [result.dataset for result in (found, expected)]
    for dataset in datasets:
        for name in CLOCK:
            dataset.attrs.pop(name, None)
    assert datasets[0].identical(datasets[1])
    assert shown(found) == shown(expected) and found.extremes.table == expected.extremes.table
    return found


@pytest.mark.parametrize("case", thinned(SCENES, lambda case: case in ("even rows", "a planar model aslant")))
def test_the_file_is_that_of_an_unstreamed_run(case: str, tmp_path: Path) -> None:
    scene = SCENES[case]
    whole, part = simulate(scene), simulate(scene, stream=tmp_path / "run.nc")
    found = assert_same_file(whole, tmp_path / "run.nc", tmp_path / "whole.nc")
    assert_same(whole, found)
    assert_same(whole, part)  # few rows: all of them
    assert sorted(file.name for file in tmp_path.iterdir()) == ["run.nc", "whole.nc"]


@pytest.mark.parametrize("scene", [leaving, heating])
def test_several_models_are_one_file(scene: Any, tmp_path: Path) -> None:
    whole = simulate(scene())
    assert ", then " in whole.provenance["model"]
    simulate(scene(), stream=tmp_path / "run.nc")
    assert_same_file(whole, tmp_path / "run.nc", tmp_path / "whole.nc")


@pytest.mark.slow
def test_a_long_run_keeps_its_summary_in_few_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joining, "GROUPS", 64)
    monkeypatch.setattr(joining, "BLOCK", 128)
    scene = scene_of("fenz-test2", output_step=0.01)
    whole, part = simulate(scene), simulate(scene, stream=tmp_path / "run.nc")
    count, rows = len(whole.history.time), part.history
    assert count > 5000 and 64 < len(rows.time) < 500 and np.isin(rows.time, whole.history.time).all()
    found = assert_same_file(whole, tmp_path / "run.nc", tmp_path / "whole.nc")
    assert shown(part) == shown(whole) and part.notes == found.notes == whole.notes
    for name, values in whole.history.energy.items():
        assert rows.energy[name].min() == values.min() and rows.energy[name].max() == values.max(), name
    assert rows.time[-1] == whole.history.time[-1] and np.diff(rows.time).max() <= 2 * 128 * 0.01
    np.testing.assert_array_equal(rows.top_force, thinned_history(whole.history).top_force)


def test_short_sliding_is_among_the_rows_that_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    history = preset_run("fenz-test2").history
    fast = np.zeros((len(history.time), 4, 2))
    fast[101] = 0.3  # one row, which is no extreme of any surface
    fast[7] = 0.5
    monkeypatch.setattr(joining, "GROUPS", 16)
    rows = thinned_history(replace(history, slip_velocity=fast))
    assert history.time[101] in rows.time and len(rows.time) < len(history.time)


def test_a_row_of_a_block_is_that_of_the_whole() -> None:
    """No digit depends on how many rows are converted together."""
    whole = simulate(SCENES["a planar model aslant"])
    assert abs(whole.history.top_force[:, 1]).max() > 1.0
    scene = SCENES["a planar model aslant"]
    sequence = simulation.RunSequence.of(scene)
    sequence.run_segment()
    (segment,) = sequence.segments
    rows = segment.run.rows
    for count in (1, 2, 3, 5):
        block = row_unpacked(segment, rows[20 : 20 + count], rows[0])
        for name, values in whole.history.arrays().items():
            np.testing.assert_array_equal(block.arrays()[name], values[20 : 20 + count], err_msg=name)
        for name, values in whole.history.energy.items():
            np.testing.assert_array_equal(block.energy[name], values[20 : 20 + count], err_msg=name)


def row_unpacked(segment: Any, rows: Any, first: Any) -> Any:
    from msfp_gen.simulation.rows import history_of

    return history_of(segment.model, rows, segment.azimuth, False, first)


# ---- runs that do not reach their end


def test_an_interrupted_run_keeps_what_it_has(tmp_path: Path) -> None:
    whole = preset_run("fenz-test2")
    with pytest.raises(RunError, match="interrupted") as caught:
        simulate(scene_of("fenz-test2"), progress=stopping_at(20.0), stream=tmp_path / "run.nc")
    found = Result.from_netcdf(tmp_path / "run.nc")
    count = len(found.history.time)
    assert found.status == "interrupted" and found.history.time[-1] >= 20.0 and count < len(whole.history.time)
    assert_same(found, caught.value.result)  # type: ignore[arg-type]
    np.testing.assert_array_equal(found.history.top_force, whole.history.top_force[:count])


def test_a_failed_run_keeps_what_it_has(tmp_path: Path) -> None:
    path = tmp_path / "run.nc"
    scene = scene_of("fenz-test2", solver={"max_steps": 50})
    with pytest.raises(RunError) as caught:
        simulate(scene)
    with pytest.raises(RunError):
        simulate(scene, stream=path)
    assert_same_file(caught.value.result, path, tmp_path / "whole.nc")  # type: ignore[arg-type]
    assert Result.from_netcdf(path).status == "steps"


def test_a_run_without_a_row_writes_no_file(tmp_path: Path) -> None:
    lifted = scene_of("fenz-test2", load=Load.constant((0.0, 0.0, 2e5)))  # pulls from the start, without uplift
    with pytest.raises(RunError, match="would have to"):
        simulate(lifted, stream=tmp_path / "run.nc")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "scene",
    [
        pytest.param(SCENES["even rows"], marks=pytest.mark.slow, id="one model"),
        pytest.param(leaving(), id="two models"),
    ],
)
def test_a_checkpoint_and_its_rows_continue_to_the_same_file(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(simulation, "STEPS_PER_CALL", 100)
    path, file = tmp_path / "run.ck", tmp_path / "run.nc"
    end = scene.end
    for when in (0.3 * end, 0.6 * end, 0.9 * end):
        with pytest.raises(RunError, match="interrupted"):
            simulate(
                scene,
                progress=stopping_at(when),
                checkpoint=path,
                every=0.0,
                stream=file,
                resume=when > 0.3 * end,
            )
        rows = sorted(tmp_path.glob("run.ck*.rows"))[-1]
        with rows.open("ab") as more:  # what the process still wrote before it was killed
            more.write(b"\1" * 12345)
    simulate(scene, checkpoint=path, resume=True, stream=file)
    assert_same_file(simulate(scene), file, tmp_path / "whole.nc")


def test_rows_of_another_run_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Checkpoint, "save_if_due", Checkpoint.save)
    path, file, scene = tmp_path / "run.ck", tmp_path / "run.nc", SCENES["even rows"]
    with pytest.raises(RunError):
        simulate(scene, progress=stopping_at(20.0), checkpoint=path, every=0.0, stream=file)
    rows = tmp_path / "run.ck.rows"
    content = rows.read_bytes()
    with pytest.raises(InputError, match=r"run\.ck\.rows' exists; resume it, or remove it to start anew"):
        simulate(scene, checkpoint=path, stream=file)
    with pytest.raises(InputError, match="made by a run that streams its rows"):
        simulate(scene, checkpoint=path, resume=True)
    changed = content[:5000] + bytes([content[5000] ^ 1]) + content[5001:]
    for wrong in (content[:4000], changed, b""):
        rows.write_bytes(wrong)
        with pytest.raises(InputError, match=r"damaged \(rows (are missing|were changed)\)"):
            simulate(scene, checkpoint=path, resume=True, stream=file)
        rows.write_bytes(content)
    simulate(scene, checkpoint=path, resume=True, stream=file)
    assert_same(simulate(scene), Result.from_netcdf(file))


@pytest.mark.slow
def test_a_checkpoint_with_all_rows_continues_in_a_stream(tmp_path: Path) -> None:
    path, scene = tmp_path / "run.ck", SCENES["even rows"]
    interrupted(scene, path, 20.0, every=0.0)
    simulate(scene, checkpoint=path, resume=True, stream=tmp_path / "run.nc")
    assert_same(simulate(scene), Result.from_netcdf(tmp_path / "run.nc"))


# ---- memory and disk


@pytest.mark.slow
def test_rows_of_one_long_step_are_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stuck, the run takes steps of minutes; rows at even times inside them would all be in memory at once."""
    held, take = [], RowFile.take

    def counted(self: RowFile, run: Any) -> None:
        held.append(run.row_count)
        take(self, run)

    monkeypatch.setattr(RowFile, "take", counted)
    monkeypatch.setattr(rows, "blocks", joining.blocks)
    scene = scene_of("fenz-test2", motion=Motion.harmonic(1e-4, 1e-4), duration=200.0, output_step=0.002)
    simulate(scene, stream=tmp_path / "run.nc")
    assert 5000 < max(held) < 10_020


def test_rows_that_do_not_fit_on_the_disk_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = shutil.disk_usage(tmp_path)._replace(free=10**9)
    monkeypatch.setattr(memory.shutil, "disk_usage", lambda _: usage)
    message = r"output_step = 1e-06: 5\.6e\+07 rows need .* GB on the disk of .* 1 GB are free"
    with pytest.raises(InputError, match=message):
        simulate(scene_of("fenz-test2", output_step=1e-6), stream=tmp_path / "run.nc")
    monkeypatch.setattr(memory, "available", lambda: 1.0)
    monkeypatch.setattr(memory, "SMALL", 0)
    with pytest.raises(InputError, match="or stream the rows to disk"):
        simulate(SCENES["even rows"])
    simulate(SCENES["even rows"], stream=tmp_path / "run.nc")


def test_a_disk_that_fills_while_rows_are_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: RowFile, view: memoryview) -> None:
        raise OSError(28, "No space left on device", self._named)

    path, file = tmp_path / "run.ck", tmp_path / "run.nc"
    with pytest.raises(RunError):
        simulate(SCENES["own steps"], progress=stopping_at(20.0), checkpoint=path, every=0.0, stream=file)
    file.unlink()
    with monkeypatch.context() as patch:
        patch.setattr(RowFile, "_write", full)
        with pytest.raises(OSError, match=r"No space left on device: '.*run\.ck\.rows'"):
            simulate(SCENES["own steps"], checkpoint=path, resume=True, stream=file)
        assert not file.exists()
    simulate(SCENES["own steps"], checkpoint=path, resume=True, stream=file)
    assert_same(preset_run("fenz-test2"), Result.from_netcdf(file))


FULL = """
import resource, sys
from pathlib import Path
from msfp_gen.results.result import Result
from msfp_gen.results.joining import blocks, taken
from msfp_gen.simulation.rows import write_blocks
path = Path(sys.argv[1])
result = Result.from_netcdf(path)
count, size = len(result.history.time), path.stat().st_size
for limit in (1, 1000, size // 2):
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
    rows = blocks(count, lambda start, end: taken(result.history, slice(start, end)))
    try:
        write_blocks(result, path.with_name("full.nc"), count, rows)
    except OSError as error:
        print(limit, error)
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the limit of a file's size stands for a full disk")
def test_a_disk_that_fills_while_the_result_is_written(tmp_path: Path) -> None:
    """HDF5 would end the process."""
    path = preset_run("fenz-test2").to_netcdf(tmp_path / "run.nc")
    done = subprocess.run([sys.executable, "-c", FULL, str(path)], cwd=ROOT, text=True, capture_output=True)
    lines = done.stdout.splitlines()
    assert done.returncode == 0 and len(lines) == 3, done.stderr
    assert all("File too large" in line and str(tmp_path / "full.nc") in line for line in lines)
    assert [file.name for file in tmp_path.iterdir()] == ["run.nc"]


MEASURED = """
import resource, sys
from dataclasses import replace
from msfp_gen import Auto, load_scene, simulate
scene = replace(load_scene("fenz-test2"), effects=Auto())
for step in (1e-3, 1.5e-4):  # 60 and 400 MB of rows
    simulate(replace(scene, output_step=step), stream=sys.argv[1])
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="other systems count in other units")
def test_the_memory_of_a_streamed_run_does_not_grow(tmp_path: Path) -> None:
    simulate(replace(scene_of("fenz-test2"), effects=Auto(), output_step=1.0))  # builds
    command = [sys.executable, "-c", MEASURED, str(tmp_path / "run.nc")]
    few, many = map(float, subprocess.run(command, cwd=ROOT, text=True, capture_output=True, check=True).stdout.split())
    assert many < few + 60.0, (few, many)


# ---- the command


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "run.nc"
    assert main(["run", "fenz-test2", "-o", str(file), "--stream", "--checkpoint", str(tmp_path / "run.ck")]) == 0
    shown = capsys.readouterr()
    assert "peak displacement" in shown.out and f"wrote {file}" in shown.err
    assert_same(preset_run("fenz-test2"), Result.from_netcdf(file))
    assert [each.name for each in tmp_path.iterdir()] == ["run.nc"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--stream"], "--stream: rows go to a netCDF file; give --output FILE.nc"),
        (["--stream", "-o", "run.csv"], "--stream: rows go to a netCDF file; give --output FILE.nc"),
        (["--stream", "-o", "run.nc", "--error", "1%"], "--stream"),
    ],
)
def test_options_that_do_not_fit(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "fenz-test2", *words]) == 2
    assert message in capsys.readouterr().err


def test_a_failed_run_of_the_command_is_in_its_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "run.nc"
    scene = tmp_path / "scene.toml"
    scene.write_text(scene_text(scene_of("fenz-test2", solver={"max_steps": 50})), encoding="utf-8")
    assert main(["run", str(scene), "-o", str(file), "--stream"]) == 1
    assert f"what was computed until then is in {file}" in capsys.readouterr().err
    assert Result.from_netcdf(file).status == "steps"


def test_a_stream_is_a_name_of_a_result(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"stream = '.*run\.csv': give a name that ends in \.nc"):
        simulate(SCENES["own steps"], stream=tmp_path / "run.csv")
