"""The compile room: finding tools, building, and believing only what is complete."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import pytest
from support import fake_model
from support.fake_model import run_child

from msfp_gen.common.errors import CompileError, InputError
from msfp_gen.jit import build, cache, compiler
from msfp_gen.model import model
from msfp_gen.specification.layout import Effects, Layout, ModelSpec

SPEC = ModelSpec(Layout.dfp())
MODULE = "msfp_3_1_1"


@pytest.fixture(autouse=True)
def house(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(model, "_models", {})
    return fake_model.house(tmp_path, monkeypatch)


@pytest.fixture(scope="module")
def prebuilt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fake_model.prebuilt(tmp_path_factory)


@pytest.fixture
def models(prebuilt: Path, tmp_path: Path) -> Path:
    shutil.copytree(prebuilt, tmp_path / "models")
    return tmp_path / "models"


@pytest.fixture
def wrapper(prebuilt: Path, tmp_path: Path) -> None:
    """An empty cache but for the object of the wrapper, whose Cython takes most of the build of a fake model."""
    fake_model.keep_wrapper(prebuilt, tmp_path / "models")


def break_generator(monkeypatch: pytest.MonkeyPatch, **texts: str) -> None:
    def generate(spec: ModelSpec) -> object:
        generated = fake_model.generate(spec)
        generated.files.update(fake_model.sources(**texts))
        return generated

    monkeypatch.setitem(sys.modules, "msfp_gen.generator", fake_model.generator(generate))


def refuse_generator(monkeypatch: pytest.MonkeyPatch) -> None:
    def generate(spec: ModelSpec) -> object:
        raise AssertionError("the generator was called for a model that is in the cache")

    monkeypatch.setitem(sys.modules, "msfp_gen.generator", fake_model.generator(generate))


def entry_of(models: Path) -> Path:
    return next(path for path in models.glob("msfp_*") if path.is_dir())


# --- building


def test_cold_build_keeps_sources_log_and_manifest() -> None:
    said: list[tuple[str, float]] = []
    info = build.prepare(SPEC, lambda *told: said.append(told))
    assert not info.cached
    assert {key: info.stages[key] for key in fake_model.STAGES} == fake_model.STAGES
    assert 0 < info.stages["compile"] < info.seconds
    words, shares = [text.split()[0] for text, _ in said], [share for _, share in said]
    assert words == ["deriving", *["compiling"] * 5] and said[-1][0].endswith("(4 of 4 files)")
    assert shares[0] == 0 and shares == sorted(shares) and shares[-1] == 1
    log = (info.folder / "build.log").read_text()
    assert "-Wextra" in log and "-m cython" in log and "[exit 0]" in log
    manifest = cache.Manifest.read(info.folder)
    assert set(manifest.files) == {path.name for path in info.folder.iterdir()} - {"manifest.json"}
    assert {"unit.c", "msfp_model.h", "msfp_module.pyx", info.path.name} <= set(manifest.files)
    assert str(info.folder) not in log, "commands name files relative to the folder, so that it can move"


def test_build_model_hands_over_and_remembers(models: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    @dataclass
    class Model:
        spec: ModelSpec
        extension: ModuleType
        info: build.BuildInfo

    monkeypatch.setattr(model, "Model", Model)
    refuse_generator(monkeypatch)
    found = model.build_model(Layout.dfp())
    assert found.extension.twice(1.5) == 3.0
    assert found.info.cached and found.info.path.parent.parent == models
    assert found.spec == SPEC
    assert model.build_model(Layout.dfp(), Effects()) is found


def test_warm_path_imports_no_tool(prebuilt: Path, house: Path) -> None:
    out, _ = run_child(house, prebuilt).communicate()
    assert out.split() == ["True", "42.0"], "cached, right, and none of sympy, Cython, jinja2, filelock imported"


# --- the key


@pytest.mark.parametrize(
    "name",
    ["common/fields.py", "specification/one.py", "generator/one.py", "templates/one.jinja", "runtime/unit.c"],
)
def test_key_follows_what_is_written_by_hand(name: str, house: Path) -> None:
    before = cache.Entry.of(SPEC).key
    (house / name).write_text("2\n")
    assert cache.Entry.of(SPEC).key != before


def test_key_follows_spec_flags_tools_and_compiler(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    keys = {cache.Entry.of(SPEC).key, cache.Entry.of(ModelSpec(SPEC.layout, Effects(rims=False))).key}
    with monkeypatch.context() as patch:
        patch.setitem(compiler.FLAGS, "c", (*compiler.FLAGS["c"], "-O3"))
        keys.add(cache.Entry.of(SPEC).key)
    with monkeypatch.context() as patch:
        patch.setattr(cache, "tool_version", lambda tool: "99")
        keys.add(cache.Entry.of(SPEC).key)
    other = tmp_path / "mycc"
    other.write_text("#!/bin/sh\necho mycc 1.0\n")
    other.chmod(0o755)
    monkeypatch.setenv("CC", str(other))
    keys.add(cache.Entry.of(SPEC).key)
    assert len(keys) == 5


def test_an_empty_room_is_an_error(house: Path) -> None:
    (house / "templates" / "one.jinja").unlink()
    with pytest.raises(InputError, match=r"templates: no \*\.jinja"):
        cache.Entry.of(SPEC)


def test_cache_of_a_checkout_and_of_an_installation(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("MSFP_GEN_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert "msfp-gen" in cache.cache_root().parts
    (tmp_path / "pyproject.toml").touch()
    (tmp_path / "build").mkdir()
    assert cache.cache_root() == tmp_path / "build" / "models"


def test_models_of_processors_differ_in_the_key_and_not_in_the_identity(monkeypatch: pytest.MonkeyPatch) -> None:
    entries = [cache.Entry.of(SPEC, portable=True)]
    for level in (3, 4):
        monkeypatch.setattr(cache, "processor_flags", lambda _, flag=f"-DMSFP_X86_64_LEVEL={level}": (flag,))
        entries.append(cache.Entry.of(SPEC))
    assert len({entry.key for entry in entries}) == len({entry.folder for entry in entries}) == 3
    assert len({entry.identity for entry in entries}) == 1
    assert cache.Entry.of(SPEC, portable=True) == entries[0]


def test_flags_of_the_processor_reach_the_compiler(wrapper: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "processor_flags", lambda _: ("-DMSFP_X86_64_LEVEL=2",))
    info = build.prepare(SPEC)
    assert "-DMSFP_X86_64_LEVEL=2" in (info.folder / "build.log").read_text()
    assert cache.cached_models()[0].state == "current"
    monkeypatch.setattr(cache, "processor_flags", lambda _: ("-DMSFP_X86_64_LEVEL=3",))
    assert cache.Entry.of(SPEC).find() is None
    assert cache.cached_models()[0].state == "current", "of this version, though not for this processor"


# --- the wrapper


def test_the_wrapper_of_all_models_is_compiled_once(models: Path) -> None:
    folder = entry_of(models)
    other = build.prepare(ModelSpec(Layout.tfp()))
    assert "-m cython" in (folder / "build.log").read_text()
    log = (other.folder / "build.log").read_text()
    assert not other.cached and "-m cython" not in log and "-c msfp_module.c" not in log
    assert build.load_extension(other.path, "msfp_5_2_2").twice(2.0) == 4.0


def test_a_header_of_the_wrapper_decides_which_object_is_used(models: Path) -> None:
    inputs, files = cache.Entry.of(SPEC).inputs, fake_model.sources()
    known = build.kept_wrapper(files, inputs)
    for name, text in files.items():
        path = build.kept_wrapper({**files, name: text + "\n"}, inputs)
        assert (path == known) == (name in ("msfp_kernels.c", "msfp_symbols.h")), name
    assert build.kept_wrapper(files, inputs | {"compiler": ["other"]}) != known


def compiled(info: build.BuildInfo) -> set[str]:
    """The C files that the compiler compiled for a model."""
    return set(re.findall(r" -c (\w+\.c) ", (info.folder / "build.log").read_text()))


def test_a_file_of_the_same_preprocessed_text_is_compiled_once(wrapper: None, monkeypatch: pytest.MonkeyPatch) -> None:
    assert compiled(build.prepare(SPEC)) == {"unit.c", "msfp_kernels.c", "msfp_entry.c"}
    break_generator(monkeypatch, kernel=fake_model.KERNEL + "/* nothing but a comment */\n")
    assert compiled(build.prepare(ModelSpec(Layout.tfp()))) == {"msfp_entry.c"}
    break_generator(monkeypatch, kernel=fake_model.KERNEL.replace("return ", "return 2.0 * "))
    other = build.prepare(ModelSpec(Layout(2, 1, 0)))
    assert compiled(other) == {"msfp_kernels.c", "msfp_entry.c"}
    assert build.load_extension(other.path, other.module).twice(2.0) == 8.0
    for path in cache.objects_folder().glob("*.o"):
        path.write_bytes(path.read_bytes()[: None if path.name.startswith("wrapper-") else -1])
    shutil.rmtree(other.folder)
    again = build.prepare(ModelSpec(Layout(2, 1, 0)))
    assert compiled(again) == {"unit.c", "msfp_kernels.c", "msfp_entry.c"}, "a damaged object is not used"
    monkeypatch.setitem(compiler.FLAGS, "user", ("--coverage",))
    shutil.rmtree(again.folder)
    assert (build.prepare(ModelSpec(Layout(2, 1, 0))).folder / "unit.gcno").is_file(), "a flag that writes more"


# --- failures


@pytest.mark.parametrize(
    ("texts", "line"),
    [
        ({"kernel": "int msfp_f(void)\n{\n  return nothing;\n}\n"}, "msfp_kernels.c:3:10: error: "),
        ({"wrapper": "def f():\n    return nothing\n"}, "msfp_module.pyx:2:11: undeclared name"),
    ],
)
def test_refused_sources_name_file_line_and_log(
    texts: dict[str, str], line: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    break_generator(monkeypatch, **texts)
    with pytest.raises(CompileError) as caught:
        build.prepare(SPEC)
    error, message = caught.value, str(caught.value)
    assert message.startswith(f"cannot compile {line.split(':')[0]}: {line}")
    assert "\n" not in message and str(error.log) in message
    assert error.log is not None and error.command in error.log.read_text()
    assert line in error.output
    assert not list((tmp_path / "models").glob("*/manifest.json")), "a failed build is not an entry"


def test_a_symbol_that_nobody_defines(wrapper: None, monkeypatch: pytest.MonkeyPatch) -> None:
    break_generator(monkeypatch, kernel="typedef int msfp_none;\n")
    info = build.prepare(SPEC)
    with pytest.raises(CompileError, match=r"does not load: .*msfp_twice.*build\.log"):
        build.load_extension(info.path, info.module)


def test_compiler_that_is_not_there(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("CC", "no-such-cc -m64")
    with pytest.raises(CompileError, match=r"looked for CC=no-such-cc -m64.*install one .*CC=") as caught:
        build.prepare(SPEC)
    assert "\n" not in str(caught.value)
    monkeypatch.delenv("CC")
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(compiler.sysconfig, "get_config_var", lambda name: "mycc -pthread")
    monkeypatch.setattr(compiler, "zig_program", lambda: None)
    with pytest.raises(CompileError, match=r"looked for mycc -pthread, cc, gcc, clang\)"):
        compiler.find_compiler()


def test_cache_that_cannot_be_written(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("MSFP_GEN_CACHE", str(tmp_path / "file"))
    with pytest.raises(InputError, match=r"MSFP_GEN_CACHE: cannot write .*/file"):
        build.prepare(SPEC)


# --- what is believed


def test_truncated_extension_is_built_again(models: Path) -> None:
    extension = entry_of(models) / f"{MODULE}{compiler.EXTENSION_SUFFIX}"
    whole = extension.stat().st_size
    os.truncate(extension, whole // 2)
    with pytest.warns(RuntimeWarning, match="is damaged and is built again"):
        info = build.prepare(SPEC)
    assert not info.cached and info.path == extension and extension.stat().st_size == whole
    assert build.load_extension(info.path, MODULE).twice(2.0) == 4.0


@pytest.mark.parametrize("damage", ["no manifest", "half a manifest", "other key", "no extension", "one byte"])
def test_damaged_entry_is_not_believed(damage: str, models: Path) -> None:
    folder = entry_of(models)
    manifest, extension = folder / "manifest.json", folder / f"{MODULE}{compiler.EXTENSION_SUFFIX}"
    text, data, entry = manifest.read_text(), bytearray(extension.read_bytes()), cache.Entry.of(SPEC)
    assert entry.find() is not None
    data[len(data) // 2] ^= 1
    {
        "no manifest": manifest.unlink,
        "half a manifest": lambda: manifest.write_text(text[: len(text) // 2]),
        "other key": lambda: manifest.write_text(text.replace(entry.key, "0" * 64)),
        "no extension": extension.unlink,
        "one byte": lambda: extension.write_bytes(data),
    }[damage]()
    with pytest.warns(RuntimeWarning, match="damaged"):
        assert entry.find() is None


@pytest.mark.slow
def test_two_processes_build_once(house: Path, tmp_path: Path) -> None:
    children = [run_child(house, tmp_path / "models") for _ in range(2)]
    answers = sorted(child.communicate()[0].split()[:2] for child in children)
    assert answers == [["False", "42.0"], ["True", "42.0"]]


def test_killed_build_is_not_believed_and_not_in_the_way(house: Path, tmp_path: Path) -> None:
    models = tmp_path / "models"
    child = run_child(house, models)
    deadline = time.monotonic() + 20
    while not list(models.glob("*.part-*/build.log")):
        assert child.poll() is None and time.monotonic() < deadline, "the build did not begin"
        time.sleep(0.005)
    child.send_signal(signal.SIGKILL)
    child.communicate()
    assert list(models.glob("*.part-*")) and not list(models.glob("*/manifest.json"))
    info = build.prepare(SPEC)
    assert not info.cached and build.load_extension(info.path, MODULE).twice(2.0) == 4.0
    assert not list(models.glob("*.part-*"))


# --- a folder of the user's


def test_generate_to_gives_a_module_for_a_plain_import(models: Path, tmp_path: Path) -> None:
    target = tmp_path / "out" / "dfp"
    info = build.generate_to(SPEC, target)
    assert info.path == target / f"{MODULE}{compiler.EXTENSION_SUFFIX}" and info.folder == target
    assert {"derived", "runtime", "manifest.json"} <= {path.name for path in target.iterdir()}
    assert (target / "derived" / "msfp_model.h").is_file() and (target / "runtime" / "unit.c").is_file()
    code = f"import sys; sys.path.insert(0, {str(target)!r}); import {MODULE}; print({MODULE}.twice(4.0))"
    done = subprocess.run([sys.executable, "-I", "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "8.0\n"
    script = target / "mine.py"
    script.write_text("mine\n")
    unit = target / "runtime" / "unit.c"
    unit.write_text("damaged\n")
    build.generate_to(SPEC, target)
    assert script.read_text() == "mine\n" and unit.read_text() == fake_model.RUNTIME


def test_generate_to_never_touches_what_is_not_ours(models: Path, tmp_path: Path) -> None:
    target = tmp_path / "out"
    target.mkdir()
    (target / "thesis.tex").write_text("years of work\n")
    with pytest.raises(InputError, match="holds files that msfp-gen did not write"):
        build.generate_to(SPEC, target)
    with pytest.raises(InputError, match="this is a file"):
        build.generate_to(SPEC, target / "thesis.tex")
    assert [path.name for path in target.iterdir()] == ["thesis.tex"]
    ours = tmp_path / "ours"
    build.generate_to(SPEC, ours)
    with pytest.raises(InputError, match=f"it holds {MODULE}: name another folder for msfp_5_2_2"):
        build.generate_to(ModelSpec(Layout.tfp()), ours)
