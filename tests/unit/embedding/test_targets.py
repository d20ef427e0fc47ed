"""`msfp-gen export --target`: the C library for other platforms; programs for Windows run under Wine, bit by bit."""

from __future__ import annotations

import importlib.util
import os
import platform as platform_module
import re
import shutil
import struct
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.replay import REPLAY, inputs

from msfp_gen import Effects, Scene, build_model, cli, load_scene
from msfp_gen.common.errors import CompileError
from msfp_gen.jit import library as platforms
from msfp_gen.simulation.start import start_compiled_run

LAYOUT = ("5", "2", "2", "--dimension", "planar")  # half of the compiling of a spatial model
FLAGS = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic")
# Platform -> the first bytes of its shared library: format, architecture.
MAGIC = {
    "windows-x86_64": (b"MZ", 0x8664),
    "macos-x86_64": (struct.pack("<I", 0xFEEDFACF), 0x01000007),
    "macos-arm64": (struct.pack("<I", 0xFEEDFACF), 0x0100000C),
    "linux-x86_64": (b"\x7fELF", 62),
    "linux-arm64": (b"\x7fELF", 183),
}
needs_zig = pytest.mark.skipif(
    importlib.util.find_spec("ziglang") is None, reason="the extra 'compiler' (ziglang) is not installed"
)


def export(folder: Path, *arguments: str, layout: tuple[str, ...] = LAYOUT) -> Path:
    assert cli.main(["export", *layout, "--prefix", str(folder), *arguments]) == 0
    return folder


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The prefix of each platform."""
    root = tmp_path_factory.mktemp("targets")
    return {target: export(root / target, "--target", target) for target in platforms.TARGETS}


def program(prefix: Path, target: str, library: str, folder: Path, source: Path | None = None) -> Path:
    """example.c, or another program, linked with a library of the prefix."""
    compiler, _ = platforms.find_tools(platforms.TARGETS[target])
    path = folder / f"program{'.exe' if target.startswith('windows') else ''}"
    sources = [str(source or prefix / "share/msfp/examples/example.c"), str(prefix / library), "-lm"]
    command = [*compiler.command, *FLAGS, "-DMODEL=msfp_5_2_2", f"-I{prefix / 'include'}", *sources]
    subprocess.run([*command, "-o", str(path)], check=True)
    return path


def compare(output: str, scene: Scene) -> None:
    """Rows that replay.c printed with those of Python, bit by bit."""
    *lines, steps, status = output.splitlines()
    model = build_model(scene.bearing.layout, scene.effects)
    run, _ = start_compiled_run(scene, model, scene.effect_selection, scene.end, None, ())
    while run.advance():
        pass
    rows = np.array([[float(word) for word in line.split()] for line in lines])
    assert (int(steps), status) == (run.counts["steps"], "ok")
    np.testing.assert_array_equal(rows, run.rows)


@needs_zig
@pytest.mark.parametrize("target", list(platforms.TARGETS))
def test_a_library_is_of_its_platform(built: dict[str, Path], target: str, tmp_path: Path) -> None:
    """Format and architecture; a program links with the shared and with the static library."""
    prefix, platform = built[target], platforms.TARGETS[target]
    data = (prefix / platform.shared).read_bytes()
    magic, machine = MAGIC[target]
    assert data.startswith(magic)
    if target.startswith("windows"):
        (header,) = struct.unpack_from("<I", data, 0x3C)
        assert data[header : header + 4] == b"PE\0\0"
        (found,) = struct.unpack_from("<H", data, header + 4)
    else:
        (found,) = struct.unpack_from("<I", data, 4) if "macos" in target else struct.unpack_from("<H", data, 18)
    assert found == machine
    for library in (platform.linker_name, "lib/libmsfp.a"):
        assert program(prefix, target, library, tmp_path).stat().st_size > 5000
    assert target in (prefix / "share/msfp/README.md").read_text(encoding="utf-8")


@needs_zig
def test_the_library_for_windows_shows_the_table_alone(built: dict[str, Path]) -> None:
    imports = (built["windows-x86_64"] / "lib" / platforms.WINDOWS_IMPORT).read_bytes()
    assert set(re.findall(rb"__imp_(\w+)", imports)) == {b"msfp_5_2_2"}


@needs_zig
@pytest.mark.skipif(shutil.which("wine") is None, reason="wine is not installed")
@pytest.mark.parametrize("kind", ["shared", "static"])
def test_rows_under_wine_are_those_of_python_bit_by_bit(built: dict[str, Path], kind: str, tmp_path: Path) -> None:
    prefix, platform = built["windows-x86_64"], platforms.TARGETS["windows-x86_64"]
    library = platform.linker_name if kind == "shared" else "lib/libmsfp.a"
    path = program(prefix, "windows-x86_64", library, tmp_path, REPLAY)
    if kind == "shared":
        shutil.copy(prefix / platform.shared, tmp_path)
    environment = {**os.environ, "WINEPREFIX": str(tmp_path / "wine"), "WINEDEBUG": "-all", "DISPLAY": ""}
    scene = replace(load_scene("fenz-test2"), effects=Effects(dimension="planar"))
    done = subprocess.run(
        ["wine", path, "rows"], env=environment, input=inputs(scene), text=True, capture_output=True, timeout=300
    )
    assert done.returncode == 0, done.stderr[-2000:]
    compare(done.stdout, scene)


@needs_zig
@pytest.mark.skipif(
    (sys.platform, platform_module.machine()) != ("linux", "x86_64"), reason="this is not Linux on x86-64"
)
def test_rows_of_another_compiler_are_those_of_python_bit_by_bit(tmp_path: Path) -> None:
    """Compiled by zig for an older Linux, and by the compiler at hand for Python; in space."""
    prefix = export(tmp_path / "spatial", "--target", "linux-x86_64", layout=("5", "2", "2"))
    path = program(prefix, "linux-x86_64", "lib/libmsfp.a", tmp_path, REPLAY)
    scene = load_scene("fenz-test2")
    done = subprocess.run([path, "rows"], input=inputs(scene), text=True, capture_output=True, check=True)
    compare(done.stdout, scene)


def test_without_ziglang_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platforms, "zig_program", lambda: None)
    with pytest.raises(CompileError, match=r"--target needs ziglang.*pip install ziglang"):
        platforms.find_tools(platforms.TARGETS["macos-arm64"])
