"""What quick runs of the scripts say of their numbers, what a script needs, and options of other programs that act."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import ROOT

BENCHMARKS = ROOT / "benchmarks"
NO_PAGES = ('validation.pytemporary.write_text(text, encoding="utf-8")',)  # the points, which a quick run leaves alone
WITHOUT_TESTS = """
import runpy, sys

class Missing:
    def find_spec(self, name, *_):
        if name.partition(".")[0] in ("pytest", "hypothesis"):
            raise ModuleNotFoundError(f"No module named {name!r}")

sys.meta_path.insert(0, Missing())
sys.argv = sys.argv[1:]
sys.path.insert(0, sys.argv[0].rpartition("/")[0])
runpy.run_path(sys.argv[0], run_name="__main__")
"""


@pytest.mark.parametrize("quick", [True, False])
def test_verification_without_the_tests_says_what_it_needs(quick: bool, tmp_path: Path) -> None:
    """As `make demo` installs the package: without pytest."""
    arguments = [str(BENCHMARKS / "verification.py"), *["--quick"] * quick, str(tmp_path)]
    command = [sys.executable, "-c", WITHOUT_TESTS, *arguments]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == (0 if quick else 1) and not done.stderr, done.stderr
    assert "pip install -e .[test]: all tables" in done.stdout.splitlines()[-1]
    assert not list(tmp_path.iterdir())


def test_a_quick_run_says_that_it_measures_nothing() -> None:
    code = "import quick; quick.parser('x'); print(quick.labelled('# Page'))"
    for option in ([], ["--quick"]):
        command = [sys.executable, "-c", code, *option]
        done = subprocess.run(command, cwd=BENCHMARKS, capture_output=True, text=True, check=True)
        assert done.stdout.count("no number or table below is a measurement") == (2 if option else 0)


def test_every_page_of_a_script_is_labelled() -> None:
    """Whatever writes a page of the docs writes it by `labelled`."""
    for path in BENCHMARKS.glob("*.py"):
        for line in path.read_text(encoding="utf-8").splitlines():
            written = "temporary.write_text(" in line and path.name + line.strip() not in NO_PAGES
            assert not written or "labelled(" in line, f"{path.name}: {line}"


def test_the_option_of_opensees_is_that_of_the_version_and_acts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    monkeypatch.syspath_prepend(str(ROOT / "tests"))
    external = pytest.importorskip("external")
    assert external.lifting("3.7.1.2") == "-inclVertdisp" and external.lifting("3.8.0") == "-inclVertDisp"
    plain = np.array([[1.0, 2.0], [3.0, 4.0]])
    assert external.acted(plain, 1.01 * plain, "3.8.0") is not None
    with pytest.raises(AssertionError, match=r"OpenSees 3\.8\.0 passes over -inclVertDisp: forces change by 0"):
        external.acted(plain, plain.copy(), "3.8.0")
