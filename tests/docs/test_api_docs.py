"""The API reference is built from the docstrings by the command of `make docs`, without a warning."""

import subprocess
import sys

from support import ROOT


def test_reference_is_built_without_a_warning(tmp_path):
    rule = (ROOT / "Makefile").read_text(encoding="utf-8").split("\ndocs: $(STAMP)\n\t$(BIN)/python ")[1]
    words = rule.splitlines()[0].replace("build/docs", str(tmp_path)).split()
    run = subprocess.run([sys.executable, *words], cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 0, run.stderr
    page = (tmp_path / "msfp_gen.html").read_text(encoding="utf-8")
    assert all(f'id="{name}"' in page for name in ("simulate", "load_scene", "Bearing", "Scene", "RunError"))
    assert "Integrate a scene" in page and "of the Bouc-Wen equations" in page
