"""The compiler of the package ziglang: used where there is no other, and a preset runs with it."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from support import ROOT

from msfp_gen import load_scene, simulate
from msfp_gen.common.errors import CompileError
from msfp_gen.jit import compiler

needs_zig = pytest.mark.skipif(
    importlib.util.find_spec("ziglang") is None, reason="the extra 'compiler' (ziglang) is not installed"
)


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package that looks like ziglang, in an environment without any other compiler."""
    folder = tmp_path / "ziglang"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "zig").write_text('#!/bin/sh\n[ "$1" = cc ] && echo "clang version 99"\n')
    (folder / "zig").chmod(0o755)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "ziglang", raising=False)
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(compiler.sysconfig, "get_config_var", lambda _: None)
    return folder


def test_it_is_used_where_there_is_no_compiler(package: Path) -> None:
    found = compiler.find_compiler()
    assert found.command == (str(package / "zig"), *compiler.ZIG_OPTIONS)
    assert found.path == str(package / "zig") and found.version == "clang version 99"


def test_it_is_the_last_that_is_tried(package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "clang").write_text("#!/bin/sh\necho another clang\n")
    (tmp_path / "clang").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert compiler.find_compiler().version == "another clang"
    monkeypatch.setenv("CC", "no-such-cc")  # a compiler that the user names is not replaced by another
    with pytest.raises(CompileError, match=r"looked for CC=no-such-cc"):
        compiler.find_compiler()


def test_without_it_the_remedy_names_it(package: Path) -> None:
    (package / "zig").unlink()
    with pytest.raises(CompileError, match=r"pip install ziglang") as caught:
        compiler.find_compiler()
    assert "\n" not in str(caught.value)


def without_cc(tmp_path: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command line in an environment in which no program can be found."""
    environment = {name: value for name, value in os.environ.items() if name not in ("CC", "MSFP_GEN_CFLAGS")}
    environment |= {"PATH": str(tmp_path), "MSFP_GEN_CACHE": str(tmp_path / "models"), "PYTHONPATH": _python_path()}
    command = [sys.executable, "-m", "msfp_gen", *arguments]
    return subprocess.run(command, env=environment, cwd=tmp_path, text=True, capture_output=True)


def _python_path() -> str:
    return os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])


@pytest.mark.slow
@needs_zig
def test_the_doctor_finds_it_and_builds_with_it(tmp_path: Path) -> None:
    done = without_cc(tmp_path, "doctor")
    rows = {line[:16].strip(): line for line in done.stdout.splitlines()}
    assert done.returncode == 0, done.stdout
    assert "zig cc" in rows["C compiler"] and "clang version" in rows["C compiler"]
    assert " ok " in rows["build a module"]


@needs_zig
@pytest.mark.slow
def test_a_preset_runs_with_it(tmp_path: Path) -> None:
    """Compiled by zig and by the compiler at hand, a run gives the same numbers."""
    done = without_cc(tmp_path, "run", "fenz-test1", "--json")
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    expected = simulate(load_scene("fenz-test1")).summary
    for name in ("peak_force_ratio", "peak_displacement", "peak_sliding", "maximum_normal_force"):
        assert summary[name] == pytest.approx(expected[name], rel=1e-9)
