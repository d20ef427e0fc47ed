"""Every script of `benchmarks/`, `docs/` and `tools/` runs to its end in its quick mode, and the README names it.

Programs that a script compares with are used where they are installed; it says what it leaves out.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from support import ROOT

FOLDERS = ("benchmarks", "docs", "tools")
MODULES = [path for folder in FOLDERS for path in sorted((ROOT / folder).glob("*.py"))]
SCRIPTS = [path for path in MODULES if '\nif __name__ == "__main__":\n' in path.read_text(encoding="utf-8")]
README = (ROOT / "benchmarks" / "README.md").read_text(encoding="utf-8")


def tracked() -> str:
    """What differs from the last commit: a quick run changes nothing."""
    done = subprocess.run(["git", "status", "--porcelain"], cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout


def test_the_page_of_the_folder_names_each_module() -> None:
    for path in MODULES:
        assert f"`{path.name}`" in README, path.name


def test_a_script_has_the_option_of_all() -> None:
    assert SCRIPTS
    without = [path.name for path in SCRIPTS if "parser(__doc__)" not in path.read_text(encoding="utf-8")]
    assert not without, "import `parser` of benchmarks/quick.py"


def test_figures_say_when_they_were_made() -> None:
    """Beside each command in a text its last date; commands that stand alone, or in a table, are no figures."""
    for page in sorted((ROOT / "docs").glob("*.md")):
        for paragraph in page.read_text(encoding="utf-8").split("\n\n"):
            stated = re.findall(
                r"(?<!\| )`python (benchmarks/\w+\.py)", "" if paragraph.startswith("<!--") else paragraph
            )
            assert all((ROOT / path).is_file() for path in stated)
            assert not stated or re.search(r"20\d\d-\d\d-\d\d", paragraph), paragraph


@pytest.mark.slow
@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.name)
def test_a_quick_run_ends(path: Path, tmp_path: Path) -> None:
    before = tracked()
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    done = subprocess.run(
        [sys.executable, str(path), "--quick"],
        cwd=tmp_path,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=1800,
    )
    assert done.returncode == 0, (done.stdout + done.stderr)[-4000:]
    assert not re.search(r"^Traceback", done.stderr, re.MULTILINE), done.stderr[-4000:]
    assert tracked() == before
