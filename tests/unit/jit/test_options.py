"""CC and MSFP_GEN_CFLAGS: what is refused, what is named, and what runs without a compiler."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support import ROOT, fake_model

from msfp_gen.common.errors import CompileError, InputError
from msfp_gen.jit import build, cache, compiler, doctor
from msfp_gen.jit.compiler import FORBIDDEN, words_of_variable
from msfp_gen.specification.layout import Layout, ModelSpec

SPEC = ModelSpec(Layout.dfp())


@pytest.fixture
def models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache, and a package whose models build in a second."""
    fake_model.house(tmp_path, monkeypatch)
    return tmp_path / "models"


@pytest.mark.parametrize("name", ["CC", "MSFP_GEN_CFLAGS"])
@pytest.mark.parametrize("value", ['gcc "', "-O3 'x", "a\\"])
def test_an_open_quote_is_named(name: str, value: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(name, value)
    with pytest.raises(InputError, match=rf"^{name} = .*no (closing quotation|escaped character); quote it"):
        compiler.find_compiler()
    assert not doctor.check_compiler().ok


@pytest.mark.parametrize("flag", FORBIDDEN)
def test_flags_that_remove_the_checks_of_numbers_are_refused(flag: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MSFP_GEN_CFLAGS", f"-O3 {flag}")
    with pytest.raises(InputError, match=f"{flag} removes the checks"):
        cache.Entry.of(SPEC)
    monkeypatch.delenv("MSFP_GEN_CFLAGS")
    monkeypatch.setenv("CC", f"gcc {flag}")
    with pytest.raises(InputError, match=f"CC = .*{flag} removes the checks"):
        cache.Entry.of(SPEC)


def test_safe_flags_are_words_as_of_a_shell(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MSFP_GEN_CFLAGS", " -O3  '-DA=b c' ")
    assert words_of_variable("MSFP_GEN_CFLAGS") == ("-O3", "-DA=b c")


def test_a_command_says_it_in_one_line() -> None:
    """In a process of its own: the variable is read before anything else."""
    environment = {**os.environ, "MSFP_GEN_CFLAGS": "-Ofast"}
    command = [sys.executable, "-m", "msfp_gen", "run", "fenz-test1", "--duration", "0.1"]
    done = subprocess.run(command, cwd=ROOT, env=environment, text=True, capture_output=True)
    assert done.returncode == 2 and done.stderr.startswith("error: MSFP_GEN_CFLAGS = '-Ofast'")
    assert done.stderr.count("\n") == 1 and not done.stdout


def test_a_program_that_is_no_compiler_is_named(models: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", str(shutil.which("true")))
    with pytest.raises(CompileError, match=r"/true wrote no msfp_3_1_1.*this is no C compiler; name one"):
        build.prepare(SPEC)
    assert not list(models.glob("*/manifest.json"))


def test_a_file_that_is_no_program_is_no_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "cc"
    path.write_bytes(b"\x7fELF no program")
    path.chmod(0o755)
    monkeypatch.setenv("CC", str(path))
    with pytest.raises(CompileError, match="no C compiler found"):
        compiler.find_compiler()


def test_a_built_model_needs_no_compiler(models: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built = build.prepare(SPEC)
    assert not built.cached
    for name, value in (("CC", "/nonexistent"), ("PATH", str(tmp_path)), ("PATH", "")):
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv(name, value)
            if name == "PATH":
                patch.setattr(compiler.sysconfig, "get_config_var", lambda _: None)
                patch.setattr(compiler, "zig_program", lambda: None)
            with pytest.raises(CompileError):
                compiler.find_compiler()
            found = build.prepare(SPEC)
            assert found.cached and (found.path, found.key) == (built.path, built.key)
            with pytest.raises(CompileError, match="no C compiler found"):  # of another model there is none
                build.prepare(ModelSpec(Layout.tfp()))
    # Of other sources it is another model.
    (cache.PACKAGE / "runtime" / "unit.c").write_text(fake_model.RUNTIME.replace("2.0", "3.0"))
    monkeypatch.setenv("CC", "/nonexistent")
    with pytest.raises(CompileError, match="no C compiler found"):
        build.prepare(SPEC)
