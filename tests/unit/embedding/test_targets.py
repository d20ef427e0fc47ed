"""`msfp-gen export --target`: the C library compiled for other platforms; that for Windows is run under Wine."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest

from msfp_gen import cli
from msfp_gen.errors import CompileError
from msfp_gen.jit import platforms
from msfp_gen.jit.compiler import find_compiler

LAYOUT = ("3", "1", "1")
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


def export(folder: Path, *arguments: str) -> Path:
    assert cli.main(["export", *LAYOUT, "--prefix", str(folder), *arguments]) == 0
    return folder


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The prefix of each platform."""
    root = tmp_path_factory.mktemp("targets")
    return {target: export(root / target, "--target", target) for target in platforms.TARGETS}


def program(prefix: Path, target: str, library: str, folder: Path) -> Path:
    """example.c, linked with a library of the prefix."""
    compiler, _ = platforms.find_tools(platforms.TARGETS[target])
    path = folder / f"example{'.exe' if target.startswith('windows') else ''}"
    source = prefix / "share/msfp/examples/example.c"
    command = [*compiler.command, *FLAGS, f"-I{prefix / 'include'}", str(source), str(prefix / library), "-lm"]
    subprocess.run([*command, "-o", str(path)], check=True)
    return path


def rows(output: str) -> np.ndarray:
    name, _, *found, last = output.splitlines()
    assert (name, last) == ("msfp_3_1_1", "ok: the run reached its end")
    return np.array([row.split() for row in found], dtype=float)


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """What the example prints, compiled for this machine by its own compiler."""
    folder = tmp_path_factory.mktemp("native")
    prefix = export(folder / "msfp")
    source, library = prefix / "share/msfp/examples/example.c", prefix / "lib/libmsfp.a"
    command = [*find_compiler().command, *FLAGS, f"-I{prefix / 'include'}", str(source), str(library), "-lm"]
    subprocess.run([*command, "-o", "example"], cwd=folder, check=True)
    return rows(subprocess.run([folder / "example"], text=True, capture_output=True, check=True).stdout)


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
    assert set(re.findall(rb"__imp_(\w+)", imports)) == {b"msfp_3_1_1"}


@needs_zig
@pytest.mark.skipif(shutil.which("wine") is None, reason="wine is not installed")
@pytest.mark.parametrize("kind", ["shared", "static"])
def test_the_example_runs_under_wine(built: dict[str, Path], expected: np.ndarray, kind: str, tmp_path: Path) -> None:
    """A program for Windows prints what one for this machine prints, to the last digit but one."""
    prefix, platform = built["windows-x86_64"], platforms.TARGETS["windows-x86_64"]
    library = platform.linker_name if kind == "shared" else "lib/libmsfp.a"
    path = program(prefix, "windows-x86_64", library, tmp_path)
    if kind == "shared":
        shutil.copy(prefix / platform.shared, tmp_path)
    environment = {**os.environ, "WINEPREFIX": str(tmp_path / "wine"), "WINEDEBUG": "-all", "DISPLAY": ""}
    done = subprocess.run(["wine", path], env=environment, cwd=tmp_path, text=True, capture_output=True, timeout=300)
    assert done.returncode == 0, done.stderr[-2000:]
    np.testing.assert_allclose(rows(done.stdout), expected, rtol=0, atol=1.1e-4)


@needs_zig
def test_a_library_for_an_older_linux_gives_the_numbers_of_this_one(
    built: dict[str, Path], expected: np.ndarray, tmp_path: Path
) -> None:
    if os.uname().machine != "x86_64" or not Path("/proc").exists():
        pytest.skip("this machine runs no programs for Linux on x86-64")
    path = program(built["linux-x86_64"], "linux-x86_64", "lib/libmsfp.a", tmp_path)
    output = subprocess.run([path], text=True, capture_output=True, check=True).stdout
    np.testing.assert_allclose(rows(output), expected, rtol=0, atol=1.1e-4)


def test_without_ziglang_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platforms, "zig_program", lambda: None)
    with pytest.raises(CompileError, match=r"--target needs ziglang.*pip install 'msfp-gen\[compiler\]'"):
        platforms.find_tools(platforms.TARGETS["macos-arm64"])
