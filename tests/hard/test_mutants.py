"""The mutants of `make mutants`: each changes code, and nothing but code."""

from __future__ import annotations

import ast
import json
import subprocess
from fnmatch import fnmatch
from pathlib import Path

import mutants
import pytest
from support import ROOT

TEXT = """
def share(x: float) -> float:
    # x + 1 is no code
    return 0.5 * x + 1 if x < 2 and "a + b" else x**2
"""
SOURCE = """/* a + b < 3 */
#define HALF (1 / 2)
static double share(double x) { return x < 2.0 ? fmin(x, 1e-3) * x : x - 1.0; } // x + 1
"""


def test_python_is_changed_where_it_computes() -> None:
    found = {mutant.applied(TEXT).splitlines()[3].strip() for mutant in mutants.python_mutants("results", "a.py", TEXT)}
    unchanged = 'return 0.5 * x + 1 if x < 2 and "a + b" else x**2'
    assert {line.replace("0.5 *", "0.5 /") for line in [unchanged]} < found and unchanged not in found
    assert 'return 1.0 * x + 1 if x < 2 and "a + b" else x**2' in found
    assert 'return 0.5 * x + 1 if x <= 2 and "a + b" else x**2' in found
    assert 'return 0.5 * x + 1 if x < 2 or "a + b" else x**2' in found
    assert all(
        len(mutant.applied(TEXT).splitlines()) == 4 for mutant in mutants.python_mutants("results", "a.py", TEXT)
    )
    assert not any('"a - b"' in line for line in found)


def test_c_is_changed_outside_comments_and_directives() -> None:
    found = list(mutants.c_mutants("runtime", "a.c", SOURCE))
    assert {mutant.line for mutant in found} == {3}
    changed = {mutant.applied(SOURCE).splitlines()[2].split("return ")[1] for mutant in found}
    assert "x <= 2.0 ? fmin(x, 1e-3) * x : x - 1.0; } // x + 1" in changed
    assert "x < 2.0 ? fmax(x, 1e-3) * x : x - 1.0; } // x + 1" in changed
    assert "x < 2.0 ? fmin(x, 0.002) * x : x - 1.0; } // x + 1" in changed
    assert all(line.endswith("// x + 1") for line in changed)


@pytest.mark.slow
def test_a_round_is_the_same_again_and_of_every_part() -> None:
    one, two = (mutants.drawn(40, 1, list(mutants.PARTS)) for _ in range(2))
    assert one == two != mutants.drawn(40, 2, list(mutants.PARTS))
    for part in mutants.PARTS:
        assert sum(mutant.part == part for mutant in one) == 10
    for mutant in one:
        text = (ROOT / mutant.path).read_text(encoding="utf-8")
        assert text[mutant.start : mutant.stop] == mutant.before
        if mutant.path.endswith(".py"):
            ast.parse(mutant.applied(text))


def test_every_test_file_of_a_part_exists() -> None:
    for part in mutants.PARTS.values():
        assert all((ROOT / name).exists() for name in part.tests)
    assert "tests/unit/simulation/test_segment_ends.py" in mutants.near("msfp_gen/results/joining.py")
    assert mutants.near("generator/unilateral.py") == ("tests/physics/test_uplift.py",)
    for pattern, tests in mutants.CHOSEN.items():
        assert any(fnmatch(str(file.relative_to(ROOT)), pattern) for file in ROOT.rglob("*.[cp]*")), pattern
        assert all((ROOT / name).exists() for name in tests)


@pytest.mark.slow
def test_a_round_in_a_small_checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One number that a test checks and one that none does."""
    root, table = tmp_path / "checkout", tmp_path / "table.json"
    (root / "tests").mkdir(parents=True)
    (root / "shares.py").write_text("SEEN = 3\nUNSEEN = 5\n", encoding="utf-8")
    test = "from shares import SEEN\n\n\ndef test_seen():\n    assert SEEN == 3\n"
    (root / "tests" / "test_shares.py").write_text(test, encoding="utf-8")
    for words in (["init", "-q"], ["add", "."]):
        subprocess.run(["git", *words], cwd=root, check=True)
    monkeypatch.setattr(mutants, "ROOT", root)
    monkeypatch.setattr(mutants, "PARTS", {"all": mutants.Part("*.py", ("tests/test_shares.py",))})
    assert mutants.main(["--count", "1", "--output", str(table)]) == 0
    assert mutants.main(["--count", "9", "--output", str(table)]) == 0  # goes on
    ends = {row["before"]: row["end"] for row in json.loads(table.read_text(encoding="utf-8"))}
    assert ends == {"3": "failed", "5": "survived"}
    assert (root / "shares.py").read_text(encoding="utf-8") == "SEEN = 3\nUNSEEN = 5\n"
    (root / "tests" / "test_shares.py").write_text(test.replace("== 3", "== 4"), encoding="utf-8")
    assert mutants.main(["--count", "1"]) == 1
