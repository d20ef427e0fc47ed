"""Bad input as a user meets it: files and words on the command line, one line each, exit code 2, nothing written."""

from __future__ import annotations

import gzip
import os
import random
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import malformed_scenes
from support import record_writers as w
from support.damaged_records import CSV, MUTATIONS, WAVES

from msfp_gen.cli import main
from msfp_gen.common.errors import InputError
from msfp_gen.scene.file.loader import dumps, scene_text
from msfp_gen.scene.file.motion_tables import RECORDS
from msfp_gen.scene.file.source import load_scene

HEAD = "bearing = 'fenz-tfp'\ntop = {kind = 'rig', axial_load = 1e5, stiffness = 1e8, rotational_stiffness = 1e8}\n"
GOOD = HEAD + "motion = {kind = 'harmonic', amplitude = 0.01, frequency = 1.0, cycles = 0.5}\n"
PEER, KNET = w.peer(WAVES[0]), w.knet("E-W", WAVES[0])
LONG = w.peer(np.sin(np.arange(4000) * 0.03))
COSMOS = w.cosmos("acceleration", "90 deg", WAVES[0], 0.05)


def motion(**values: Any) -> str:
    return HEAD + dumps({"motion": values})


# Whole scene files: text -> words that the line must hold.
SCENES = {
    "an open text": ("name = 'a", ("no valid TOML", "end of document")),
    "lists without end": ("a = " + "[" * 100000, ("no valid TOML", "nested too deeply")),
    "tables without end": ("a = " + "{b = " * 5000, ("no valid TOML", "nested too deeply")),
    "a key of 3000 tables": (GOOD + "a." * 3000 + "b = 1", ("no valid TOML", "nested too deeply")),
    "a row of 3000 tables": (GOOD + "[" + "a." * 3000 + "b]", ("no valid TOML", "nested too deeply")),
    "a number of 5000 digits": (GOOD + "duration = " + "9" * 5000, ("no valid TOML", "digits")),
    "a number of 400 digits": (GOOD + "duration = " + "9" * 400, ("duration = 9", "finite number above 0 [s]")),
    "a count of 400 digits": (GOOD + "solver = {max_steps = " + "9" * 400 + "}", ("solver.max_steps", "whole number")),
    "a huge number in hexadecimal": (GOOD + "duration = 0x" + "f" * 4000, ("duration = ", "finite number")),
    "a date": (GOOD + "duration = 1979-05-27", ("duration = datetime.date(1979, 5, 27)", "finite number")),
    "a key of nothing": (GOOD + "'' = 3", ("'': unknown key",)),
    "a key of two lines": (GOOD + '"a\\nb" = 3', ("'a\\nb': unknown key",)),
    "a key of 5000 letters": (GOOD + "k" * 5000 + " = 3", ("kkk...: unknown key",)),
    "a key that a terminal obeys": (GOOD + '"\\u001b[2J" = 3', ("'\\x1b[2J': unknown key",)),
    "a value that a terminal obeys": (GOOD + 'duration = "\\u001b[2J"', ("duration = '\\x1b[2J'", "no number")),
    "a value of two lines": (GOOD + 'duration = "1\\n2"', ("duration = '1\\n2'", "[s]")),
    "a unit of 5000 factors": (GOOD + "duration = '1 " + "s*" * 5000 + "s'", ("duration = '1 s*s*", "is unknown")),
    "a text of 100000 digits": (GOOD + "duration = '" + "1" * 100000 + " s'", ("duration = '111", "finite number")),
    "a table twice": (GOOD + "[motion]\nkind = 'ramp'", ("no valid TOML", "motion")),
    "a value with a table below": (GOOD + "solver.rtol.x = 3", ("solver.rtol = {'x': 3}", "number")),
    "rows for a hundred machines": (GOOD + "output_step = 1e-12", ("output_step = 1e-12", "rows", "at least")),
    "python in a number": (GOOD + "duration = \"exec('1')\"", ("duration = ", "no number")),
    "arithmetic": (GOOD + "duration = '9**9**9 s'", ("duration = '9**9**9 s'", "no number")),
    "a template": (GOOD + "duration = '{{ 1 }} s'", ("duration = '{{ 1 }} s'", "no number")),
    "more bodies than atoms": (
        "[bearing]\nbase_height = 0.1\nsurfaces = []\nbodies = []\n[bearing.layout]\nn = 2000000001\nm = 1000000000\n"
        "p = 1000000000\n[motion]\nkind = 'ramp'\nacceleration = 1\nduration = 1\n[top]\nkind = 'rig'\naxial_load = 1\n"
        "stiffness = 1\n",
        ("bearing.surfaces has 0 entries", "2000000000"),
    ),
    "a preset that is a path": ("bearing = '../fenz-tfp'\n" + GOOD.split("\n", 1)[1], ("bearing = '../fenz-tfp'",)),
    "waves without end": (motion(kind="harmonic", amplitude=0.1, frequency=0.1, cycles=1e12), ("motion.cycles",)),
    "waves too fast": (motion(kind="circle", amplitude=0.1, angular_frequency=1e9, cycles=1e6), ("motion.cycles",)),
    "a frequency below all": (
        motion(kind="harmonic", amplitude=0.1, frequency=1e-320),
        ("motion.frequency = 1e-320", "1e-30 to 1e+30"),
    ),
    "a frequency above all": (
        motion(kind="harmonic", amplitude=0.1, frequency=1e300),
        ("motion.frequency = 1e+300", "1e-30 to 1e+30"),
    ),
    "a corner below all": (
        motion(kind="record", bundled="ridgecrest-2019-ci-clc", corner=1e-9),
        ("motion.corner: 1e-09 Hz", "give a higher one"),
    ),
    "no cycle at all": (motion(kind="harmonic", amplitude=0.1, frequency=0.1, cycles=1e-29), ("motion.cycles",)),
    "a rest for ever": (
        motion(kind="harmonic", amplitude=0.1, frequency=0.1, hold=1e300),
        ("motion.hold = 1e+300", "1e-30 to 1e+30"),
    ),
    "a name with NUL": (GOOD + 'name = "a\\u0000b"', ("name = 'a\\x00b'", "without the NUL character")),
    "a motion whose name has NUL": (
        motion(kind="harmonic", amplitude=0.1, frequency=0.1, name="a\0b"),
        ("motion.name = 'a\\x00b'", "without the NUL character"),
    ),
    "a bundled path": (motion(kind="record", bundled="../../x"), ("bundled = '../../x': no such record",)),
    "a file with NUL": (HEAD + 'motion = {kind = "record", file = "a\\u0000b"}', ("file = 'a\\x00b'", "no path")),
    "a file of 5000 letters": (motion(kind="record", file="a" * 5000), ("motion.file", "no such file")),
    "a file without a name": (motion(kind="record", file=""), ("no such file",)),
    "a folder": (motion(kind="record", file="."), ("no such file",)),
    "a device": (motion(kind="record", file="/dev/zero"), ("outside the folder of the scene file", RECORDS)),
    "a file of the system": (motion(kind="record", file="/etc/passwd"), ("outside the folder of the scene file",)),
    "the folder above": (motion(kind="record", file="../secret.at2"), ("outside the folder of the scene file",)),
    "above by detours": (motion(kind="record", file="a/../../secret.at2"), ("outside the folder of the scene file",)),
    "one of two outside": (motion(kind="record", file=["a.at2", "/etc/passwd"]), ("'/etc/passwd'", "outside")),
    "a table of the system": (motion(kind="arrays", file="/etc/passwd"), ("outside the folder of the scene file",)),
    "an address of the web": (motion(kind="record", file="http://example.org/a.at2"), ("no such file",)),
    "somebody's home": (motion(kind="record", file="~/a.at2"), ("no such file",)),
}

# Records beside a scene that names them: bytes -> words.
FILES: dict[str, tuple[bytes, tuple[str, ...]]] = {
    "nothing": (b"", ("the file is empty",)),
    "blanks": (b" \n\t\n", ("the file is empty",)),
    "a picture": (b"\x89PNG\r\n\x1a\n\0\0", ("a binary file",)),
    "half a gzip": (gzip.compress(PEER.encode(), mtime=0)[:90], ("damaged gzip",)),
    "a letter": (b"Dear Sir,\nplease find\n", ("unknown format", "PEER")),
    "a page of the web": (b"<html><body>404</body></html>", ("unknown format",)),
    "cut in the data": (PEER[:300].encode(), ("NPTS promises 40",)),
    "a count too high": (PEER.replace("NPTS=     40", "NPTS=     41").encode(), ("NPTS promises 41",)),
    "a step of zero": (PEER.replace("0.01000", "0.00000").encode(), ("DT is", "positive")),
    "a letter among numbers": (PEER.replace("E-0", "X-0", 1).encode(), ("not a finite number",)),
    "not a number": (PEER.replace(PEER.split("\n")[4][:15], f"{'nan':>15}").encode(), ("'nan' is not a finite",)),
    "beyond all measure": (PEER.replace(PEER.split("\n")[4][:15], f"{'1e200':>15}").encode(), ("not a finite number",)),
    "a K-NET file cut": (KNET[: len(KNET) - 40].encode(), ("promise 40 values",)),
    "no direction": (KNET.replace("E-W", "X-Y").encode(), ("unknown direction 'X-Y'",)),
    "a COSMOS file cut": (COSMOS[: len(COSMOS) - 90].encode(), ("line",)),
    "a V1 file cut": (w.csmip_v1([("90 Deg", WAVES[0])])[:700].encode(), ("line",)),
    "one horizontal channel twice": (
        w.csmip_v1([("90 Deg", WAVES[0]), ("90 Deg", WAVES[1]), ("Up", WAVES[2])]).encode(),
        ("90 Deg",),
    ),
    "a table without units": (b"time, a1\n0, 0\n", ("unknown format", "time [s]")),
    "a table of other columns": (CSV.replace("a1", "b1").encode(), ("b1",)),
    "a unit of something else": (CSV.replace("[g]", "[kN]").encode(), ("'kN' is not a unit of [m/s^2]",)),
    "a row too short": (CSV.replace("0.05, ", "", 1).encode(), ("line", "columns")),
    "time that stands still": (CSV.replace("0.05, ", "0.04, ", 1).encode(), ("evenly spaced",)),
    "a gap in the times": (re.sub(r"0\.05, .*\n", "", CSV, count=1).encode(), ("line 8", "from 0.04 to 0.06 s")),
    "silence": (b"time [s], a1 [g]\n" + b"".join(b"%d, 0\n" % i for i in range(9)), ("zero",)),
    "two rows": (b"time [s], a1 [g]\n0, 1\n1, 2\n", ("fewer than 4",)),
}

LAYOUTS = ["5 2 1", "1 0 0", "0 0 -1", "3 -1 3", "5.0 2 2", "5 2 two", "nan 2 2", "1e1 4 5", "٥x 2 2", "5 2", "5 2 2 1"]


@contextmanager
def unchanged(folder: Path) -> Iterator[None]:
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    yield
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.delenv(RECORDS, raising=False)
    (tmp_path / "secret.at2").write_text(LONG)
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path / "here"


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The line of a command that must refuse its input."""
    assert main(list(arguments)) == 2, arguments
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("error: ") and err.endswith("\n") and err.count("\n") == 1
    assert err.strip().isprintable() and len(err) < 600
    return err


def run_refused(folder: Path, text: str, capsys: pytest.CaptureFixture[str]) -> str:
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    with unchanged(folder.parent):
        return refused(capsys, "run", "scene.toml", "-o", "out.nc", "--plot", "out.png")


@pytest.mark.parametrize("case", SCENES)
def test_scene_files(case: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, words = SCENES[case]
    line = run_refused(folder, text, capsys)
    assert "scene.toml: " in line and all(word in line for word in words), line


@pytest.mark.parametrize("case", FILES)
def test_records(case: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    content, words = FILES[case]
    (folder / "record.txt").write_bytes(content)
    line = run_refused(folder, motion(kind="record", file="record.txt"), capsys)
    assert all(word in line for word in words), line


@pytest.mark.parametrize("words", LAYOUTS)
def test_layouts(words: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with unchanged(folder.parent):
        refused(capsys, "generate", *words.replace("-", " -").split(), "-o", "models")
    assert not (folder / "models").exists()


@pytest.mark.parametrize("rows", [slice(None, None, 8), pytest.param(slice(None), marks=pytest.mark.slow)], ids=str)
def test_the_table_of_malformed_fields_ends_with_exit_code_2(
    rows: slice, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Their messages are those of the loader, which `tests/unit/scene` compares for every row."""
    written, chosen = 0, malformed_scenes.ROWS[rows]
    for path, value, _ in chosen:
        try:
            text = dumps(malformed_scenes.broken(path, value))
        except TypeError:  # lists of tables and numbers, which our writer of TOML does not write
            continue
        run_refused(folder, text, capsys)
        written += 1
    assert written >= len(chosen) - 3


def test_a_scene_that_cannot_be_one(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(folder / "pipe")
    for name in ("pipe", "/dev/zero", "a" * 5000, "gone.toml", ".", ""):
        assert (name[:40] or "scene") in refused(capsys, "run", name)


def test_mutated_scenes_load_or_say_why(folder: Path) -> None:
    """Seeded damage to the text of good scenes; whatever still loads can be written and read again."""
    dice, path = random.Random(9), folder / "scene.toml"
    samples = [GOOD, scene_text(load_scene("fenz-test5"))]
    loaded = 0
    for number in range(600):
        content = samples[number % 2].encode()
        for _ in range(dice.randrange(1, 3)):
            content = dice.choice(MUTATIONS[:-1])(content, dice) or b"\n"
        path.write_bytes(content)
        try:
            scene = load_scene(path)
        except InputError as error:
            assert str(error).isprintable() and len(str(error)) <= 500
            continue
        loaded += 1
        path.write_text(scene_text(scene), encoding="utf-8")
        assert load_scene(path) == scene
    assert 20 < loaded < 580


# --- no path outside what the user named


def test_records_may_lie_where_the_user_says(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for file in ("../secret.at2", str(folder.parent / "secret.at2")):
        (folder / "scene.toml").write_text(motion(kind="record", file=file))
        monkeypatch.delenv(RECORDS, raising=False)
        with pytest.raises(InputError, match="outside the folder of the scene file"):
            load_scene(folder / "scene.toml")
        monkeypatch.setenv(RECORDS, os.pathsep.join(["/nowhere", str(folder.parent)]))
        assert load_scene(folder / "scene.toml").motion.duration > 0


def test_a_link_leads_nowhere_else(folder: Path) -> None:
    """A link that came with somebody's scene is no permission; a loop of links is no path."""
    (folder / "link.at2").symlink_to(folder.parent / "secret.at2")
    (folder / "loop").symlink_to(folder / "loop")
    for name, words in (("link.at2", "outside the folder"), ("loop", "motion.file")):
        (folder / "scene.toml").write_text(motion(kind="record", file=name))
        with pytest.raises(InputError, match=words):
            load_scene(folder / "scene.toml")


# What a scene could try in every text it may hold.
TRICKS = ["../../escape", "/tmp/escape.nc", "$(touch escape)", "`touch escape`", "{{ 7 * 7 }}", "__import__('os')"]
_heard: list[tuple[str, str, bool]] | None = None


def _hook(event: str, arguments: tuple[Any, ...]) -> None:
    if _heard is None:
        return
    if event == "open" and isinstance(arguments[0], str | bytes | os.PathLike):
        mode, flags = arguments[1], arguments[2] or 0
        writes = bool(flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)) or any(c in "wax+" for c in mode or "")
        _heard.append((event, os.fsdecode(arguments[0]), writes))
    elif event in (
        "exec",
        "compile",
        "os.system",
        "os.exec",
        "os.posix_spawn",
        "subprocess.Popen",
        "socket.connect",
        "os.remove",
        "os.rename",
        "os.mkdir",
        "os.link",
        "os.symlink",
        "pickle.find_class",
    ):
        _heard.append((event, str(arguments[0])[:200], True))


@contextmanager
def heard() -> Iterator[list[tuple[str, str, bool]]]:
    """Every file opened, and everything run, made or removed, within the block."""
    global _heard
    if _hook not in _installed:
        _installed.append(_hook)
        sys.addaudithook(_hook)  # stays for good, deaf outside of such a block
    _heard = found = []
    try:
        yield found
    finally:
        _heard = None


_installed: list[Any] = []


def test_text_in_a_scene_opens_runs_and_writes_nothing(folder: Path) -> None:
    (folder / "record.at2").write_text(LONG)
    (folder / "scene.toml").write_text(motion(kind="record", file="record.at2", name="plain"))
    load_scene(folder / "scene.toml")  # what is imported late is imported now
    for trick in TRICKS:
        text = dumps({"name": trick}) + motion(kind="record", file="record.at2", name=trick)
        (folder / "scene.toml").write_text(text)
        with heard() as found:
            scene = load_scene(folder / "scene.toml")
        assert scene.name == scene.motion.name == trick, "kept as it is, and no more"
        assert {Path(path).name for event, path, _ in found if event == "open"} == {"scene.toml", "record.at2"}
        assert not [item for item in found if item[0] != "open" or item[2]], found
    assert sorted(path.name for path in folder.iterdir()) == ["record.at2", "scene.toml"]


def test_a_refused_path_is_not_even_opened(folder: Path) -> None:
    for file in ("/etc/passwd", "../secret.at2", "/dev/zero"):
        (folder / "scene.toml").write_text(motion(kind="record", file=file))
        with heard() as found, pytest.raises(InputError, match="outside"):
            load_scene(folder / "scene.toml")
        assert [path for event, path, _ in found if event == "open"] == ["scene.toml"] or all(
            Path(path).name == "scene.toml" for event, path, _ in found if event == "open"
        )


def test_a_run_writes_what_its_command_names_whatever_the_scene_is_called(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "scene.toml").write_text(GOOD)
    assert main(["run", "scene.toml", "-o", "out.nc", "--plot", "out.png"]) == 0  # models built, libraries loaded
    for path in ("out.nc", "out.png"):
        (folder / path).unlink()
    (folder / "scene.toml").write_text('name = "../../escape"\n' + GOOD)
    with heard() as found:
        assert main(["run", "scene.toml", "-o", "out.nc", "--plot", "out.png"]) == 0
    written = {Path(path).resolve() for event, path, writes in found if event == "open" and writes}
    assert written and all(path.parent == folder and path.suffix in (".nc", ".png") for path in written), written
    assert not [item for item in found if item[0] in ("os.system", "socket.connect")], found
    assert sorted(path.name for path in folder.iterdir()) == ["out.nc", "out.png", "scene.toml"]
    assert not (folder.parent.parent / "escape").exists()


def test_a_name_is_shown_and_not_obeyed(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "scene.toml").write_text('name = "a\\u001b[2Jb"\n' + GOOD)
    assert main(["run", "scene.toml"]) == 0
    out, err = capsys.readouterr()
    assert "\x1b" not in out + err and "a\\x1b[2Jb" in out
