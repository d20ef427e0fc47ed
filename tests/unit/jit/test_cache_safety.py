"""The cache of models: altered entries are not believed, killed builds are not in the way, old models can go."""

from __future__ import annotations

import errno
import os
import random
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from filelock import FileLock
from support import fake_model
from support.fake_model import run_child

from msfp_gen.cli import main
from msfp_gen.common.errors import InputError
from msfp_gen.jit import build, cache, compiler
from msfp_gen.specification.layout import Layout, ModelSpec

SPEC = ModelSpec(Layout.dfp())
MODULE = "msfp_3_1_1"
EXTENSION = f"{MODULE}{compiler.EXTENSION_SUFFIX}"


@pytest.fixture(autouse=True)
def house(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    return fake_model.house(tmp_path, monkeypatch)


@pytest.fixture(scope="module")
def prebuilt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fake_model.prebuilt(tmp_path_factory)


@pytest.fixture
def entry(prebuilt: Path, tmp_path: Path) -> cache.Entry:
    """An entry that is built, in a cache of this test's own."""
    shutil.copytree(prebuilt, tmp_path / "models")
    found = cache.Entry.of(SPEC)
    assert found.find() is not None
    return found


def assert_not_believed(entry: cache.Entry) -> None:
    with pytest.warns(RuntimeWarning, match="is damaged and is built again"):
        assert entry.find() is None


def assert_works() -> None:
    info = build.prepare(SPEC)
    assert build.load_extension(info.path, MODULE).twice(2.0) == 4.0


def kept_wrapper() -> Path:
    return build.kept_wrapper(fake_model.sources(), cache.Entry.of(SPEC).inputs)


# --- what is not as it was written


def test_no_altered_byte_is_believed(entry: cache.Entry) -> None:
    """One bit flipped anywhere in the manifest, the extension, a source or the log; and then the entry as it was."""
    dice = random.Random(11)
    for path in sorted(entry.folder.iterdir()):
        whole = path.read_bytes()
        chances = 150 if path.name == cache.MANIFEST_NAME else 12
        for at in {0, len(whole) - 1, *(dice.randrange(len(whole)) for _ in range(chances))}:
            path.write_bytes(whole[:at] + bytes([whole[at] ^ (1 << dice.randrange(8))]) + whole[at + 1 :])
            assert_not_believed(entry)
        path.write_bytes(whole)
    assert entry.find() is not None


@pytest.mark.parametrize("name", [EXTENSION, cache.MANIFEST_NAME, "unit.c"])
def test_no_truncated_or_missing_file_is_believed(name: str, entry: cache.Entry) -> None:
    path = entry.folder / name
    whole, dice = path.read_bytes(), random.Random(2)
    for size in (0, 1, *(dice.randrange(len(whole)) for _ in range(10)), len(whole) - 1):
        path.write_bytes(whole[:size])
        assert_not_believed(entry)
    path.write_bytes(whole + b"\0")
    assert_not_believed(entry)
    path.unlink()
    assert_not_believed(entry)


def test_an_entry_of_another_version_is_not_believed_in_this_ones_place(entry: cache.Entry, house: Path) -> None:
    """Whole and sound, but made from other sources: only the key tells."""
    (house / "runtime" / "unit.c").write_text(fake_model.RUNTIME.replace("2.0", "3.0"))
    other = cache.Entry.of(SPEC)
    assert other.key != entry.key and other.find() is None
    shutil.copytree(entry.folder, other.folder)
    assert_not_believed(other)


NO_MANIFESTS = [b"", b"[]", b"7", b'{"key": 1}', b"\xff\xfe", b"null", b'[["a", 1]]', b"[" * 10000]


@pytest.mark.parametrize("content", NO_MANIFESTS)
def test_a_manifest_that_is_something_else(content: bytes, entry: cache.Entry) -> None:
    (entry.folder / cache.MANIFEST_NAME).write_bytes(content)
    assert_not_believed(entry)


def test_a_damaged_entry_is_replaced_by_a_sound_one(entry: cache.Entry) -> None:
    (entry.folder / "unit.c").write_text("damaged\n")
    with pytest.warns(RuntimeWarning, match="damaged"):
        assert not build.prepare(SPEC).cached
    assert build.prepare(SPEC).cached
    assert_works()


def test_altered_sources_are_not_handed_out(prebuilt: Path, tmp_path: Path) -> None:
    fake_model.keep_wrapper(prebuilt, tmp_path / "models")
    (build.prepare(SPEC, portable=True).folder / "unit.c").write_text("int evil;\n")
    with pytest.warns(RuntimeWarning, match="damaged"):
        build.generate_to(SPEC, tmp_path / "out")
    assert (tmp_path / "out" / "runtime" / "unit.c").read_text() == fake_model.RUNTIME


def test_an_altered_object_of_the_wrapper_is_made_again(entry: cache.Entry) -> None:
    path = kept_wrapper()
    whole, dice = path.read_bytes(), random.Random(5)
    assert compiler.read_kept(path) == whole.partition(b"\n")[2]
    for at in {0, 64, 65, len(whole) - 1, *(dice.randrange(len(whole)) for _ in range(50))}:
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
        assert compiler.read_kept(path) is None
        path.write_bytes(whole[:at])
        assert compiler.read_kept(path) is None
    shutil.rmtree(entry.folder)
    assert not build.prepare(SPEC).cached and path.read_bytes() == whole
    assert_works()


# --- builds that are killed, and builds at the same time


def test_a_full_disk_in_the_middle_of_a_build_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(sources: dict[str, str], module: str, folder: Path, *_: object, **__: object) -> Path:
        (folder / "half.c").write_text("int x")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(folder / "half.c"))

    monkeypatch.setattr(build, "compile_extension", full)
    with pytest.raises(InputError, match=r"MSFP_GEN_CACHE: cannot write .*models \(No space left on device\): name a"):
        build.prepare(SPEC)
    assert not list((tmp_path / "models").glob("*.part-*"))


@pytest.mark.slow
def test_builds_killed_at_any_moment(house: Path, tmp_path: Path) -> None:
    """SIGKILL to the build and its compilers, at times spread over its whole length and a little beyond."""
    models, dice = tmp_path / "models", random.Random(1)
    begin = time.monotonic()
    assert run_child(house, models).communicate()[0].split()[0] == "False"
    whole = time.monotonic() - begin
    for part in range(5):
        shutil.rmtree(models)
        child = run_child(house, models)
        time.sleep(whole * (0.35 + 0.15 * part + 0.1 * dice.random()))
        os.killpg(child.pid, signal.SIGKILL)
        child.communicate()
        manifest = cache.Entry.of(SPEC).find()  # never a warning: an entry is whole or is not there
        assert manifest is None or manifest.module == MODULE
    assert run_child(house, models).communicate()[0].split()[1] == "42.0"
    names = sorted(path.name for path in models.iterdir())
    folder = cache.Entry.of(SPEC).folder.name
    assert names == [folder, f"{folder}.lock", "objects"], "what the killed ones left is cleared away"
    assert_works()


def two_builders(house: Path, models: Path) -> tuple[subprocess.Popen[str], subprocess.Popen[str]]:
    """Two processes that want one model: the second starts when the first compiles."""
    first = run_child(house, models)
    deadline = time.monotonic() + 30
    while not list(models.glob("*.part-*/build.log")):
        assert first.poll() is None and time.monotonic() < deadline
        time.sleep(0.005)
    return first, run_child(house, models)


def test_two_builders_of_which_the_first_is_killed(house: Path, tmp_path: Path) -> None:
    """The other one waits for the lock, gets it and builds: nobody waits for the dead."""
    models = tmp_path / "models"
    first, second = two_builders(house, models)
    time.sleep(0.3)
    os.killpg(first.pid, signal.SIGKILL)
    first.communicate()
    assert second.communicate(timeout=60)[0].split()[:2] == ["False", "42.0"]
    assert not list(models.glob("*.part-*"))


def test_four_builders_build_once(house: Path, tmp_path: Path) -> None:
    children = [run_child(house, tmp_path / "models") for _ in range(4)]
    answers = sorted(child.communicate()[0].split()[:2] for child in children)
    assert answers == [["False", "42.0"], *[["True", "42.0"]] * 3]
    folder = cache.Entry.of(SPEC).folder.name
    assert sorted(path.name for path in (tmp_path / "models").glob("msfp_*")) == [folder, f"{folder}.lock"]


@pytest.mark.slow
def test_a_builder_that_came_second_leaves_no_folder(house: Path, tmp_path: Path) -> None:
    """It waits for the lock while the first one builds, and finds the model when it has the lock."""
    models = tmp_path / "models"
    first, second = two_builders(house, models)
    assert first.communicate()[0].split()[:2] == ["False", "42.0"]
    assert second.communicate()[0].split()[:2] == ["True", "42.0"]
    folder = cache.Entry.of(SPEC).folder.name
    assert sorted(path.name for path in models.glob("msfp_*")) == [folder, f"{folder}.lock"]


# --- what lies there, and what may go


def aged(folder: Path, days: float) -> None:
    then = time.time() - days * cache.DAY
    for path in (folder / cache.MANIFEST_NAME, folder):
        if path.exists():
            os.utime(path, (then, then))


@pytest.fixture
def stock(entry: cache.Entry, house: Path) -> Callable[[], dict[str, str]]:
    """One current model, one of another version, a damaged one, a killed build, and things of the user's."""
    root = entry.folder.parent
    names = {"other": f"{MODULE}-{'0' * 20}", "bad": f"{MODULE}-{'1' * 20}", "left": f"{entry.folder.name}.part-4711"}
    names |= {"lanes": f"{MODULE}_lanes8-{'2' * 20}", "empty": f"{MODULE}_lanes8-{'3' * 20}.part-4712"}
    for name in names.values():
        shutil.copytree(entry.folder, root / name)
    manifest = cache.Manifest.read(entry.folder)
    manifest.inputs["sources"] = "before"
    manifest.write(root / names["other"])
    (root / names["bad"] / cache.MANIFEST_NAME).write_text("{}")
    manifest.write(root / names["lanes"])
    shutil.rmtree(root / names["empty"])
    (root / names["empty"]).mkdir()
    for kind in ("bad", "lanes"):
        (root / f"{names[kind]}.lock").touch()
    (root / f"{MODULE}-{'4' * 20}.lock").touch()
    (root / "thesis").mkdir()
    (root / "thesis" / "results.nc").touch()
    (root / "msfp_notes.txt").touch()
    states = {
        entry.folder.name: "current",
        names["other"]: "other version",
        names["bad"]: "damaged or old",
        names["left"]: "unfinished",
        names["lanes"]: "other version",
        names["empty"]: "unfinished",
    }
    assert {item.folder.name: item.state for item in cache.cached_models()} == states
    return lambda: {path.name: states.get(path.name, "") for path in sorted(root.iterdir())}


def test_only_what_was_not_used_goes(stock: Callable[[], dict[str, str]], entry: cache.Entry) -> None:
    for item in cache.cached_models():
        aged(item.folder, 40.0)
    assert entry.find() is not None, "to be found is to be used"
    removed, held = cache.prune(30.0)
    assert {item.state for item in removed} == {"damaged or old", "other version", "unfinished"}
    assert len(removed) == 5 and not held
    left = {entry.folder.name, f"{entry.folder.name}.lock", "objects"}
    assert set(stock()) == left | {"thesis", "msfp_notes.txt"}
    then = time.time() - 40.0 * cache.DAY
    os.utime(kept_wrapper(), (then, then))
    assert cache.prune(30.0) == ([], []) and not kept_wrapper().exists()
    assert_works()


def test_clear_removes_all_of_ours_and_nothing_else(
    stock: Callable[[], dict[str, str]], entry: cache.Entry, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["cache"]) == 0
    listed = capsys.readouterr().out
    assert SPEC.key in listed and "6 models" in listed and "other version" in listed and "unfinished" in listed
    assert main(["cache", "--clear"]) == 0
    assert capsys.readouterr().out.startswith("removed 6 models, ")
    assert set(stock()) == {"thesis", "msfp_notes.txt"}
    assert (entry.folder.parent / "thesis" / "results.nc").is_file()
    assert entry.find() is None
    assert main(["cache"]) == 0 and "(0 models, 0.0 MB)" in capsys.readouterr().out


def test_what_a_build_holds_stays(entry: cache.Entry, capsys: pytest.CaptureFixture[str]) -> None:
    with FileLock(f"{entry.folder}.lock"):
        assert main(["cache", "--prune", "0"]) == 0
    assert capsys.readouterr().out == "removed 0 models, 0.0 MB\nkept 1 model in use by another process\n"
    assert entry.find() is not None


def test_a_cache_that_is_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["cache", "--clear"]) == 0 and "removed 0 models" in capsys.readouterr().out
    assert not (tmp_path / "models").exists()


@pytest.mark.parametrize("options", ["--prune -1", "--prune nan", "--prune old", "--prune 1 --clear"])
def test_bad_options_remove_nothing(options: str, entry: cache.Entry, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["cache", *options.split()]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert entry.find() is not None
    with pytest.raises(InputError):
        cache.prune(-1.0)
