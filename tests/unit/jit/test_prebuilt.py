"""Models that came compiled with the wheel: which one is used, and that it needs no compiler and no cache."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from support import fake_model

from msfp_gen.common.errors import InputError
from msfp_gen.jit import build, cache, compiler, doctor
from msfp_gen.specification.layout import Effects, Layout, ModelSpec

SPEC = ModelSpec(Layout.dfp(), Effects())


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A package with one prebuilt model for every processor and one for those with AVX2."""
    folder = tmp_path_factory.mktemp("prebuilt")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cache, "PACKAGE", fake_model.write_house(folder / "house"))
        patch.setenv("MSFP_GEN_CACHE", str(folder / "models"))
        patch.setitem(__import__("sys").modules, "msfp_gen.generator", fake_model.generator())
        built = build.prepare(SPEC, portable=True)
        for level in build.PREBUILT_LEVELS:
            build.add_prebuilt(level, built.folder, build.prebuilt_folder())
    return folder / "house"


@pytest.fixture
def installed(house: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of that package where there is no compiler; returns the folder of its prebuilt models."""
    monkeypatch.setattr(cache, "PACKAGE", Path(shutil.copytree(house, tmp_path / "house")))
    monkeypatch.setenv("MSFP_GEN_CACHE", str(tmp_path / "models"))
    monkeypatch.setenv("PATH", "")
    for name in ("CC", "MSFP_GEN_CFLAGS"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(compiler, "zig_program", lambda: None)
    monkeypatch.setattr(compiler.sysconfig, "get_config_var", lambda _: None)
    return tmp_path / "house" / "prebuilt"


def test_a_prebuilt_model_needs_no_compiler_and_writes_nothing(installed: Path, tmp_path: Path) -> None:
    info = build.prepare(SPEC)
    assert info.cached and info.path.parent.parent == installed and info.path.name == "msfp_3_1_1.abi3.so"
    assert build.load_extension(info.path, info.module).twice(21.0) == 42.0
    assert not (tmp_path / "models").exists()
    assert doctor.check_prebuilt().detail == "1 that need no compiler"


@pytest.mark.parametrize(("reached", "level"), [(None, 1), (1, 1), (2, 1), (3, 3), (4, 3)])
def test_the_model_of_the_processor_is_used(
    installed: Path, reached: int | None, level: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    keys = set()
    for found in (reached, 3):
        monkeypatch.setattr(build, "x86_64_level", lambda found=found: found)
        info = build.prepare(SPEC)
        keys.add(info.key)
        assert info.folder.name.endswith(f"-v{level if found == reached else 3}")
    assert len(keys) == 1, "a checkpoint may be continued on another processor"


@pytest.mark.parametrize(("name", "value"), [("CC", "gcc-of-mine"), ("MSFP_GEN_CFLAGS", "-O3")])
def test_a_compiler_or_flags_of_the_user_come_first(
    installed: Path, name: str, value: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert build.find_prebuilt(SPEC) is not None
    monkeypatch.setenv(name, value)
    assert build.find_prebuilt(SPEC) is None


def test_refused_flags_are_named_as_without_prebuilt_models(installed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MSFP_GEN_CFLAGS", "-Ofast")
    with pytest.raises(InputError, match="-Ofast removes the checks"):
        build.prepare(SPEC)
    assert not doctor.check_prebuilt().ok


@pytest.mark.parametrize("damage", ["one byte", "no extension", "half a manifest"])
def test_a_damaged_one_is_not_used(installed: Path, damage: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "x86_64_level", lambda: 1)
    (folder,) = installed.glob("*-v1")
    extension = folder / "msfp_3_1_1.abi3.so"
    if damage == "one byte":
        data = extension.read_bytes()
        extension.write_bytes(data[:1000] + bytes([data[1000] ^ 1]) + data[1001:])
    elif damage == "no extension":
        extension.unlink()
    else:
        os.truncate(folder / cache.MANIFEST_NAME, 100)
    with pytest.warns(RuntimeWarning, match=r"-v1 is damaged and not used; install msfp-gen again"):
        assert build.find_prebuilt(SPEC) is None


def test_a_prebuilt_model_is_of_these_sources(installed: Path) -> None:
    (cache.PACKAGE / "runtime" / "unit.c").write_text(fake_model.RUNTIME.replace("2.0", "3.0"))
    assert build.find_prebuilt(SPEC) is None


def test_presets_are_among_the_prebuilt_models() -> None:
    from msfp_gen import load_scene
    from msfp_gen.scene.effect_selection import select_effects
    from msfp_gen.scene.file.source import load_scene as load_building

    names = {spec.key for spec in build.prebuilt_specs()}
    assert len(names) == 34
    for preset in ("fenz-test1", "becker-circle-50", "single-push", "double-push", "triple-push", "ridgecrest-clc"):
        scene = load_scene(preset)
        assert scene.spec.key in names
        assert select_effects(scene).effects == scene.spec.effects
    for preset in ("hospital-ccc", "hospital-clc"):
        assert {spec.key for spec in load_building(preset).specs} <= names
