"""Nothing lost: runs that are stopped, killed or meet a full disk, and go on to the very same rows."""

from __future__ import annotations

import ctypes
import errno
import hashlib
import json
import os
import random
import re
import shutil
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import hearing, preset_run, scene_of, thinned
from support.flights import shaken
from support.resuming import assert_same, interrupted, stopping_at

from msfp_gen import InputError, Motion, RunError, Scene, build_model, simulate
from msfp_gen.cli import main
from msfp_gen.common.identity import fingerprint
from msfp_gen.common.output import replacing
from msfp_gen.results.result import Result, load_result
from msfp_gen.scene.scene_fields import Stop
from msfp_gen.simulation import bearing_run as simulation
from msfp_gen.simulation import checkpoint
from msfp_gen.simulation.start import start_compiled_run
from msfp_gen.specification.contract import STATUSES, names

SCENES = {
    "own steps": ("fenz-test2", {}, {}, {}),
    "even rows": ("fenz-test2", {}, {}, {"output_step": 0.01}),
    "the report's method": ("fenz-test2", {}, {"method": "dopri5", "rtol": 1e-3}, {"duration": 0.3}),
    "massless": ("fenz-test5", {"dimension": "planar", "sliders": "massless"}, {}, {"duration": 100.0}),
    "planar, rims met": ("fenz-test5", {"dimension": "planar"}, {}, {"duration": 100.0}),
    "a record, step by step": ("ridgecrest-clc", {}, {}, {"duration": 15.0, "output_step": 0.02}),
    "seats, where bodies may part": ("fenz-test2", {"uplift": True, "dimension": "planar"}, {}, {"duration": 20.0}),
    "a stop": ("fenz-test5", {}, {}, {"stop": Stop(displacement=0.06)}),
}
FLIGHT = "bodies part, fly and land"
OFTEN = ("even rows", FLIGHT)


@pytest.fixture(autouse=True)
def short_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Look around often, so that a run of milliseconds can be stopped in many places."""
    monkeypatch.setattr(simulation, "STEPS_PER_CALL", 20)


def scene_for(case: str) -> Scene:
    if case == FLIGHT:
        return shaken(1.4, sideways=0.03, duration=1.1)
    name, effects, solver, changes = SCENES[case]
    return scene_of(name, effects, solver, **changes)


@pytest.mark.parametrize("case", thinned([*SCENES, FLIGHT], lambda case: case in OFTEN))
def test_a_run_stopped_twice_gives_the_same_rows(case: str, tmp_path: Path) -> None:
    scene, path = scene_for(case), tmp_path / "run.ck"
    whole = simulate(scene)
    end = float(whole.history.time[-1])
    first = interrupted(scene, path, 0.3 * end)
    before = checkpoint.read_checkpoint(path)[1][0].wall
    second = interrupted(scene, path, 0.7 * end, resume=True)
    then = checkpoint.read_checkpoint(path)[1][0].wall
    assert 1 < len(first.history.time) < len(second.history.time) < len(whole.history.time)
    resumed = simulate(scene, checkpoint=path, resume=True)
    assert_same(whole, resumed)
    assert resumed.counters.wall_time > then > before > 0, "the time of all processes together"
    # Done, the file holds the whole run, and to resume it is to read it.
    assert_same(whole, simulate(scene, checkpoint=path, resume=True, progress=stopping_at(-1.0)))
    assert [each.name for each in tmp_path.iterdir()] == ["run.ck"]


def test_a_snapshot_of_a_run_with_a_single_row_is_restored() -> None:
    """Before the first step, and with the last row alone."""
    scene = scene_of("fenz-test2", duration=1.0)
    model = build_model(scene.bearing.layout, scene.modelled)
    run, later = (start_compiled_run(scene, model, scene.effect_selection, scene.end, None, ())[0] for _ in range(2))
    later.restore(run.snapshot())
    assert len(run.rows) == 1 and len(later.rows) == 1
    run.advance(20)
    later.restore(run.snapshot(1))
    assert len(run.rows) > 1 and len(later.rows) == 1
    for _ in iter(lambda: run.advance() | later.advance(), False):
        pass
    assert run.rows[-1].tolist() == later.rows[-1].tolist() and run.status == later.status


def test_what_an_interrupted_run_had_is_a_beginning_of_the_whole(tmp_path: Path) -> None:
    whole, part = preset_run("fenz-test2"), interrupted(scene_of("fenz-test2"), tmp_path / "run.ck", 20.0)
    count = len(part.history.time)
    assert np.array_equal(part.history.tilt_angles, whole.history.tilt_angles[:count])
    saved = load_result(part.to_netcdf(tmp_path / "part.nc"))
    assert saved.status == "interrupted" and re.search(r"at t = .* s of 56\.25 s: interrupted", saved.message)


def test_checkpoints_are_written_every_so_often(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    times: list[float] = []
    write = checkpoint.write_checkpoint

    def seen(path: Path, identity: checkpoint.Identity, segments: list[checkpoint.Saved]) -> None:
        times.append(segments[-1].time)
        write(path, identity, segments)

    monkeypatch.setattr(checkpoint, "write_checkpoint", seen)
    monkeypatch.setattr(checkpoint, "WRITE_INTERVAL", 0)
    simulate(scene_of("fenz-test2"), checkpoint=tmp_path / "a.ck", every=0.0)
    assert len(times) > 10 and times == sorted(times) and times[-1] == 56.25
    times.clear()
    simulate(scene_of("fenz-test2"), checkpoint=tmp_path / "b.ck", every=1e6)
    assert times == [56.25], "only at the end"


# --- whose checkpoint it is


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("saved") / "run.ck"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simulation, "STEPS_PER_CALL", 20)
        interrupted(scene_of("fenz-test2"), path, 10.0)
    return path


def refusal(scene: Scene, path: Path, **options: Any) -> str:
    with pytest.raises(InputError) as caught:
        simulate(scene, checkpoint=path, **({"resume": True} | options))
    text = str(caught.value)
    assert "\n" not in text and len(text) < 300, text
    return text


@pytest.mark.parametrize(
    ("effects", "solver", "changes", "words"),
    [
        ({}, {"rtol": 2e-4}, {}, "solver.rtol was 0.0001, now it is 0.0002"),
        ({}, {}, {"duration": 40.0}, "duration was not given, now it is 40.0"),
        ({}, {}, {"output_step": 0.1}, "output_step was not given, now it is 0.1"),
        ({"bouc_wen": "isotropic"}, {}, {}, "effects.bouc_wen was 'report', now it is 'isotropic'"),
        ({}, {}, {"motion": Motion.harmonic(0.02, 0.04)}, "motion.kind was 'harmonic', now it is 'pieces'"),
    ],
)
def test_another_scene_is_told_by_what_differs(
    effects: Any, solver: Any, changes: Any, words: str, saved: Path
) -> None:
    text = refusal(scene_of("fenz-test2", effects, solver, **changes), saved)
    assert "made for another scene" in text and words in text, text


def test_a_changed_bearing_is_named_by_its_surface(saved: Path) -> None:
    scene = scene_of("fenz-test2")
    friction = [surface.friction for surface in scene.bearing.surfaces]
    friction[2] += 0.01
    text = refusal(replace(scene, bearing=scene.bearing.replace(friction=friction)), saved)
    assert "bearing.surfaces[2].friction was" in text


def test_a_record_whose_data_changed_is_another_scene(saved: Path) -> None:
    """The same words, other numbers: as when the file that a scene names is edited between two runs."""
    scene = scene_of("fenz-test2")
    coefficients = scene.motion.coefficients * (1 + 1e-15)
    changed = replace(scene, motion=replace(scene.motion, coefficients=coefficients))
    assert fingerprint(changed) != fingerprint(scene)
    assert "made for another scene" in refusal(changed, saved)
    assert fingerprint(scene_of("fenz-test2")) == fingerprint(scene)


def test_another_build_is_refused(saved: Path, tmp_path: Path) -> None:
    identity, (segment,) = checkpoint.read_checkpoint(saved)
    checkpoint.write_checkpoint(tmp_path / "run.ck", identity, [replace(segment, build="0" * 64)])
    assert "made by another build of the model" in refusal(scene_of("fenz-test2"), tmp_path / "run.ck")


def test_no_checkpoint_is_overwritten_or_missing(saved: Path, tmp_path: Path) -> None:
    scene, before = scene_of("fenz-test2"), saved.read_bytes()
    assert "this file exists; resume it" in refusal(scene, saved, resume=False)
    assert saved.read_bytes() == before
    assert "No such file" in refusal(scene, tmp_path / "none.ck")
    assert "folder" in refusal(scene, tmp_path / "none" / "run.ck", resume=False)
    assert "every = -1" in refusal(scene, tmp_path / "run.ck", resume=False, every=-1)
    assert not list(tmp_path.iterdir())


def test_a_checkpoint_that_is_a_folder_is_named_by_the_reason(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"': cannot be read \(Is a directory\); give the checkpoint of this run"):
        simulate(scene_of("fenz-test2"), checkpoint=tmp_path, resume=True)


def test_no_damage_is_believed(saved: Path, tmp_path: Path) -> None:
    """A byte flipped anywhere, a file cut anywhere, and files that are something else."""
    whole, path, scene = saved.read_bytes(), tmp_path / "run.ck", scene_of("fenz-test2")
    dice = random.Random(5)
    flips = [*range(0, 120), *(dice.randrange(len(whole)) for _ in range(120)), len(whole) - 1]
    cuts = [0, 1, len(checkpoint.MAGIC), 60, 90, *(dice.randrange(len(whole)) for _ in range(40)), len(whole) - 1]
    identity = checkpoint.Identity("", "")
    damaged = [whole[:at] + bytes([whole[at] ^ (1 << dice.randrange(8))]) + whole[at + 1 :] for at in flips]
    for content in [*damaged, *(whole[:at] for at in cuts), whole + b"\0", b"bearing = 'fenz-tfp'\n" * 9]:
        path.write_bytes(content)
        with pytest.raises(InputError, match="damaged, or no checkpoint of msfp-gen"):
            checkpoint.Checkpoint(path, identity, resume=True)
    path.write_bytes(damaged[-1])
    assert "damaged" in refusal(scene, path)


# Magic, version, sizes of a row and an event, identity, size of the state, counts, checksum.
HEADER = struct.Struct("<8s8Q")


def forged(snapshot: bytes, start: int, content: bytes, **changes: int) -> bytes:
    """A snapshot with other content at a place of its body, and a checksum that fits; of the header too."""
    magic, version, row, event, identity, state, rows, events, _ = HEADER.unpack_from(snapshot)
    body = bytearray(snapshot[HEADER.size :])
    body[start : start + len(content)] = content
    total = 14695981039346656037
    for offset in range(0, len(body) - len(body) % 8, 8):
        total = ((total ^ int.from_bytes(body[offset : offset + 8], "little")) * 1099511628211) % 2**64
        total ^= total >> 32
    for byte in body[len(body) - len(body) % 8 :]:
        total = ((total ^ byte) * 1099511628211) % 2**64
    rows, events, version = changes.get("rows", rows), changes.get("events", events), changes.get("version", version)
    identity = changes.get("identity", identity)
    return HEADER.pack(magic, version, row, event, identity, state, rows, events, total) + bytes(body)


def test_the_checksum_of_a_snapshot_is_the_one_computed_here(saved: Path) -> None:
    snapshot = checkpoint.read_checkpoint(saved)[1][0].snapshot
    assert forged(snapshot, 0, b"") == snapshot


def test_a_forged_snapshot_is_refused_before_it_is_used(saved: Path, tmp_path: Path) -> None:
    """Digest and checksum are right, the content is not: no number in it that counts or selects is out of range."""
    about, (segment,) = checkpoint.read_checkpoint(saved)
    snapshot = segment.snapshot
    _, _, row, _, identity, size, rows, _, _ = HEADER.unpack_from(snapshot)
    dice, path = random.Random(7), tmp_path / "forged.ck"
    last_time = size + (rows - 1) * row
    contents = {
        "ones": forged(snapshot, 0, b"\xff" * size),
        "sevens": forged(snapshot, 0, b"\x7f" * size),
        "random": forged(snapshot, 0, dice.randbytes(size)),
        "rows that are not there": forged(snapshot, 0, b"", rows=rows + 1),
        "rows beyond any size": forged(snapshot, 0, b"", rows=2**61),
        "events that are not there": forged(snapshot, 0, b"", events=5),
        "version": forged(snapshot, 0, b"", version=1),
        "identity": forged(snapshot, 0, b"", identity=identity ^ 1),
        "a row out of time": forged(snapshot, size, struct.pack("<d", 1e9)),
        "a last row after the end": forged(snapshot, last_time, struct.pack("<d", 1e9)),
        "a row that is not finite": forged(snapshot, last_time, struct.pack("<d", float("nan"))),
        "half": snapshot[: len(snapshot) // 2],
        "nothing": b"",
        "a bit": snapshot[:-3] + bytes([snapshot[-3] ^ 1]) + snapshot[-2:],
    }
    for name, content in contents.items():
        checkpoint.write_checkpoint(path, about, [replace(segment, snapshot=content)])
        assert "damaged (" in refusal(scene_of("fenz-test2"), path), name


def test_a_forged_event_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.ck"
    interrupted(scene_for("planar, rims met"), path, 70.0)
    about, (segment,) = checkpoint.read_checkpoint(path)
    snapshot = segment.snapshot
    _, _, row, _, _, size, rows, events, _ = HEADER.unpack_from(snapshot)
    assert events > 0
    first = size + rows * row
    for place, content in (
        (0, struct.pack("<d", float("nan"))),
        (8, struct.pack("<i", 99)),
        (12, struct.pack("<i", 99)),
    ):
        checkpoint.write_checkpoint(path, about, [replace(segment, snapshot=forged(snapshot, first + place, content))])
        assert "damaged (" in refusal(scene_for("planar, rims met"), path), place


def test_a_byte_changed_anywhere_in_the_state_ends_no_process(saved: Path) -> None:
    """Refused, or a run goes on from it to a status: with the right checksum, whatever the byte is."""
    snapshot = checkpoint.read_checkpoint(saved)[1][0].snapshot
    size, dice, ends = HEADER.unpack_from(snapshot)[5], random.Random(11), set()
    scene = scene_of("fenz-test2", solver={"max_steps": 200})
    model = build_model(scene.bearing.layout, scene.modelled)
    for _ in range(60):
        place = dice.randrange(size)
        run = start_compiled_run(scene, model, scene.effect_selection, scene.end, None, ())[0]
        try:
            identity = HEADER.unpack_from(run.snapshot())[4]  # of fewer steps
            run.restore(forged(snapshot, place, dice.randbytes(4), identity=identity))
        except ValueError:
            ends.add("refused")
            continue
        run.advance(50)
        ends.add(run.status[0])
    assert "ok" in ends and ends <= {"refused", *names(STATUSES)}


def parts(path: Path) -> tuple[dict[str, Any], bytes]:
    """Header and snapshots of a file."""
    header, _, snapshots = path.read_bytes()[len(checkpoint.MAGIC) + 65 :].partition(b"\n")
    about: dict[str, Any] = json.loads(header)
    return about, snapshots


def write_parts(path: Path, header: bytes, snapshots: bytes) -> None:
    rest = header + b"\n" + snapshots
    path.write_bytes(checkpoint.MAGIC + hashlib.sha256(rest).hexdigest().encode() + b"\n" + rest)


@pytest.mark.parametrize("name", ["scene", "digest", "segments", *range(4)])
@pytest.mark.parametrize("value", [None, [], {}, "x", -1.0, 1e999])
def test_a_forged_header_is_refused(saved: Path, tmp_path: Path, name: str | int, value: Any) -> None:
    about, snapshots = parts(saved)
    if isinstance(name, int):  # of a segment: build, time, wall, size
        about["segments"][0][name] = value
    else:
        about[name] = value
    path = tmp_path / "forged.ck"
    write_parts(path, json.dumps(about).encode(), snapshots)
    if name == 1 and isinstance(value, float):
        return  # the time is only shown
    text = refusal(scene_of("fenz-test2"), path)
    assert "\n" not in text and ("damaged" in text or "made " in text)


HOSTILE = [
    b"[",
    b"[[" * 50000,
    b'"',
    b"null",
    b"NaN",
    b"1e999",
    b"9" * 5000,
    b"{",
    b"\xff",
    b"a." * 3000,
    b"\\n",
    b"-",
]
TEXTS: list[Any] = ["a." * 3000 + "b=1", "x=[", "x=" + "[" * 100000, "\ud800", "\x00", {}, [1], None, True, 1e308]


def altered(about: dict[str, Any], dice: random.Random) -> bytes:
    """A header with another value, or with something inserted."""
    head = json.dumps(
        {**about, **({dice.choice([*about]): dice.choice(TEXTS)} if dice.random() < 0.5 else {})}
    ).encode()
    for _ in range(dice.choice([0, 1, 1, 3])):
        at, hostile = dice.randrange(len(head)), dice.choice(HOSTILE)
        head = head[:at] + hostile + head[at + dice.choice([0, 1, len(hostile)]) :]
    return dice.choice([b"", b"[" * 100000]) + head if dice.random() < 0.1 else head


@pytest.mark.parametrize("count", [60, pytest.param(3000, marks=pytest.mark.slow)])
def test_an_altered_header_with_the_right_digest_is_refused_or_resumed(saved: Path, tmp_path: Path, count: int) -> None:
    about, snapshots = parts(saved)
    path, ends = tmp_path / "run.ck", set()
    scenes = [scene_of("fenz-test2"), scene_of("fenz-test2", solver={"rtol": 2e-4})]
    for seed in range(count):
        dice = random.Random(seed)
        write_parts(path, altered(about, dice), snapshots)
        try:
            simulate(dice.choice(scenes), checkpoint=path, resume=True, progress=stopping_at(-1.0))
        except (InputError, RunError) as error:
            ends.add(error.status if isinstance(error, RunError) else "refused")
    assert ends == {"refused", "interrupted"}


# --- processes that are told to end, and processes that are not asked

RUN = """
import sys
from pathlib import Path
from msfp_gen.simulation import bearing_run as simulation, checkpoint
from msfp_gen.cli import main
simulation.STEPS_PER_CALL, checkpoint.WRITE_INTERVAL = int(sys.argv[1]), 0
sys.exit(main(sys.argv[2:]))
"""
LONG = ["run", "fenz-test2", "--method", "dopri5", "--rtol", "1e-3", "--duration", "0.5", "--json"]


def started(folder: Path, *arguments: str, chunk: int = 200) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", RUN, str(chunk), *LONG, "-o", "run.nc", "--every", "0", *arguments]
    return subprocess.Popen(
        command, cwd=folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=hearing
    )


def finished(folder: Path) -> int:
    process = started(folder, "--resume", "run.ck", chunk=4000)
    process.communicate()
    return process.returncode


def wait_for(path: Path, process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 60
    while not path.exists():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> Result:
    folder = tmp_path_factory.mktemp("whole")
    process = started(folder, "--checkpoint", "run.ck", chunk=4000)
    assert process.communicate()[1].splitlines()[-1] == "wrote run.nc" and process.returncode == 0
    assert [path.name for path in folder.iterdir()] == ["run.nc"], "a checkpoint that has served is gone"
    return load_result(folder / "run.nc")


@pytest.mark.parametrize("name", thinned(["SIGINT", "SIGTERM", "SIGHUP"], lambda name: name == "SIGTERM"))
def test_a_signal_leaves_a_valid_part_that_says_so(name: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    process = started(tmp_path, "--checkpoint", "run.ck")
    wait_for(tmp_path / "run.ck", process)
    process.send_signal(getattr(signal, name))
    errors = process.communicate()[1].splitlines()
    assert process.returncode == 128 + getattr(signal, name)
    assert errors[-1].endswith("; what was computed until then is in run.nc; continue with --resume run.ck")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.ck", "run.nc"]
    part = load_result(tmp_path / "run.nc")
    assert part.status == "interrupted" and len(part.history.time) > 1 and part.history.time[-1] < 0.5
    if name == "SIGINT":
        assert finished(tmp_path) == 0
        assert_same(request.getfixturevalue("uninterrupted"), load_result(tmp_path / "run.nc"))
        assert [path.name for path in tmp_path.iterdir()] == ["run.nc"]


@pytest.mark.slow
def test_kill_at_any_moment_loses_no_checkpoint(tmp_path: Path, uninterrupted: Result) -> None:
    """SIGKILL, again and again, mostly in the middle of writing: with chunks this short that is all the run does."""
    dice, path = random.Random(3), tmp_path / "run.ck"
    reached = [0.0]
    for _ in range(3):
        process = started(tmp_path, "--resume" if path.exists() else "--checkpoint", "run.ck", chunk=20)
        before = path.stat().st_mtime_ns if path.exists() else 0
        deadline = time.monotonic() + 60
        while process.poll() is None and (not path.exists() or path.stat().st_mtime_ns == before):
            assert time.monotonic() < deadline
            time.sleep(0.01)
        time.sleep(dice.random() * 0.2)
        process.kill()
        process.communicate()
        assert process.returncode == -signal.SIGKILL and not (tmp_path / "run.nc").exists()
        reached.append(checkpoint.read_checkpoint(path)[1][0].time)
    assert reached == sorted(set(reached)) and reached[-1] < 0.5
    assert finished(tmp_path) == 0
    assert_same(uninterrupted, load_result(tmp_path / "run.nc"))
    assert [each.name for each in tmp_path.iterdir()] == ["run.nc"], "what killed processes left is gone too"


# --- a disk that is full


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 64 KiB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    libc = ctypes.CDLL(None, use_errno=True)
    if not hasattr(libc, "mount") or libc.mount(b"tmpfs", bytes(folder), b"tmpfs", 0, b"size=64k"):
        pytest.skip("only root may mount a small file system")
    yield folder
    libc.umount2(bytes(folder), 2)


def test_a_full_disk_leaves_no_file(small_disk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "fenz-test2", "-o", str(small_disk / "run.nc")]) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.count("\n") == 1 and "No space left" in error
    assert str(small_disk / "run.nc") in error
    assert not list(small_disk.iterdir())


def test_a_full_disk_for_results_does_not_lose_a_kept_run(
    small_disk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "run.ck"
    assert main(["run", "fenz-test2", "-o", str(small_disk / "run.nc"), "--checkpoint", str(path)]) == 1
    assert f"the run is not lost: make room and give --resume {path}" in capsys.readouterr().err
    assert not list(small_disk.iterdir())
    assert main(["run", "fenz-test2", "-o", str(tmp_path / "run.nc"), "--resume", str(path)]) == 0
    assert_same(preset_run("fenz-test2"), load_result(tmp_path / "run.nc"))


def test_a_full_disk_for_checkpoints_stops_no_run(small_disk: Path) -> None:
    with pytest.warns(RuntimeWarning, match=r"run\.ck not written \(No space left on device\); the run continues"):
        result = simulate(scene_of("fenz-test2"), checkpoint=small_disk / "run.ck", every=1e6)
    assert_same(preset_run("fenz-test2"), result)
    assert not list(small_disk.iterdir())


def test_the_last_checkpoint_outlives_a_disk_that_fills(
    tmp_path: Path, saved: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a small disk: the system refuses to bring the file to the disk."""
    path = Path(shutil.copy(saved, tmp_path / "run.ck"))

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.warns(RuntimeWarning, match="No space left on device"):
        result = simulate(scene_of("fenz-test2"), checkpoint=path, every=1e6, resume=True)
    assert_same(preset_run("fenz-test2"), result)
    assert path.read_bytes() == saved.read_bytes() and [each.name for each in tmp_path.iterdir()] == ["run.ck"]


def test_what_a_killed_writer_left_is_cleared_by_the_next(tmp_path: Path) -> None:
    old, new, other = (tmp_path / name for name in (".a-0123abcd.nc", ".a-89abcdef.nc", ".b-0123abcd.nc"))
    for path in (old, new, other):
        path.write_bytes(b"half")
    for path in (old, other):
        os.utime(path, (1.0, 1.0))
    with replacing(tmp_path / "a.nc") as temporary:
        temporary.write_bytes(b"whole")
    assert sorted(path.name for path in tmp_path.iterdir()) == [".a-89abcdef.nc", ".b-0123abcd.nc", "a.nc"]
    assert (tmp_path / "a.nc").read_bytes() == b"whole"


# --- the options


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--every", "5"], "--every = 5: there is no checkpoint to write"),
        (["--checkpoint", "a.ck", "--resume", "b.ck"], "--checkpoint = 'a.ck': --resume continues to write its own"),
        (["--resume", "none.ck"], "checkpoint = 'none.ck': cannot be read"),
        (["--checkpoint", "a.ck", "--every", "-1"], "every = -1"),
        (["--checkpoint", "a.ck", "--every", "nan"], "every = nan"),
    ],
)
def test_options_that_cannot_be(
    options: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", "fenz-test2", *options]) == 2
    assert words in capsys.readouterr().err and not list(tmp_path.iterdir())
