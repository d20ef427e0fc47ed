"""The level of the processor, from what Linux reports about it."""

from __future__ import annotations

from pathlib import Path

import pytest

from msfp_gen.jit import compiler
from msfp_gen.jit.compiler import LEVELS, processor_flags, x86_64_level


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file in which an x86-64 machine describes itself; it is not there yet."""
    monkeypatch.setattr(compiler.platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(compiler, "CPUINFO", tmp_path / "cpuinfo")
    return tmp_path / "cpuinfo"


def flags_of(*levels: int) -> str:
    return " ".join(["lm sse2", *(LEVELS[level] for level in levels)])


@pytest.mark.parametrize(
    ("flags", "level"),
    [
        (flags_of(), 1),
        (flags_of(2), 2),
        (flags_of(2, 3), 3),
        (flags_of(2, 3, 4), 4),
        (flags_of(2, 3).replace(" fma", ""), 2),
        (flags_of(2, 3, 4).replace(" fma", ""), 2),
        (flags_of(2, 3, 4).replace("avx512vl", "avx512vnni"), 3),
    ],
)
def test_level_is_the_highest_whose_flags_are_all_there(flags: str, level: int, machine: Path) -> None:
    machine.write_text(f"processor\t: 0\nflags\t\t: {flags}\nbugs\t\t: some\n\nprocessor\t: 1\nflags\t\t: lm\n")
    assert x86_64_level() == level
    assert processor_flags() == (f"-DMSFP_X86_64_LEVEL={level}",)


@pytest.mark.parametrize("text", [None, "", "model name: some\n"])
def test_a_processor_that_is_not_known_gets_all_versions(text: str | None, machine: Path) -> None:
    if text is not None:
        machine.write_text(text)
    assert x86_64_level() is None and processor_flags() == ()


def test_other_architectures_have_no_level(machine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    machine.write_text(f"flags : {flags_of(2, 3)}\n")
    monkeypatch.setattr(compiler.platform, "machine", lambda: "aarch64")
    assert processor_flags() == ()


def test_flags_of_the_user_that_select_a_processor_count(machine: Path) -> None:
    """GCC inlines no function of another -march, so the two are not mixed."""
    machine.write_text(f"flags : {flags_of(2, 3)}\n")
    assert processor_flags(("-march=native", "-g")) == () and processor_flags(("-g",)) == ("-DMSFP_X86_64_LEVEL=3",)
