"""The doctor: says that a sound installation is sound, and what to do about one that is not."""

from __future__ import annotations

from pathlib import Path

import pytest

from msfp_gen.jit import doctor


def test_doctor_finds_this_installation_sound() -> None:
    checks = {check.name: check for check in doctor.diagnose()}
    assert {name for name, check in checks.items() if not check.ok} <= {"free disk"}
    assert {"python", "sympy", "cython", "C compiler", "Python headers", "build a module", "model cache"} <= set(checks)


def test_doctor_names_the_remedy(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("CC", "no-such-cc")
    monkeypatch.setenv("MSFP_GEN_CACHE", str(tmp_path / "file"))
    monkeypatch.setattr(doctor.metadata, "requires", lambda name: ["sympy>=99.1", "no-such-package", 'x; extra == "a"'])
    bad = {check.name: check for check in doctor.diagnose() if not check.ok}
    assert set(bad) - {"free disk"} == {
        "sympy",
        "no-such-package",
        "C compiler",
        "build a module",
        "model cache",
    }
    assert bad["sympy"].remedy == 'pip install "sympy>=99.1"'
    assert "CC=" in bad["C compiler"].remedy and "MSFP_GEN_CACHE" in bad["model cache"].remedy
