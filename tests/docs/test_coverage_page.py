"""docs/coverage.md states what it promises for each part of the physics, and lines of C are counted right."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import line_coverage
import pytest
from support import ROOT

PAGE = (ROOT / "docs" / "coverage.md").read_text(encoding="utf-8")
ROWS = [
    (name, int(lines), int(ran), float(share))
    for name, lines, ran, share in re.findall(
        r"^\| ([\w`/, ]+) \| (\d+) \| (\d+) \| ([\d.]+) \|$", PAGE, flags=re.MULTILINE
    )
]
PHYSICS = [*line_coverage.PYTHON, *line_coverage.C]


def test_each_row_of_physics_has_the_share_that_the_page_promises() -> None:
    shares = {name.strip("`"): share for name, _, _, share in ROWS}
    assert sorted(name for name in shares if name in PHYSICS) == sorted(PHYSICS)
    assert min(shares[name] for name in PHYSICS) >= line_coverage.LEAST >= 95
    assert f"below {line_coverage.LEAST:.0f} %" in PAGE and not line_coverage.low(PAGE)
    assert line_coverage.low(PAGE.replace(f"| {shares['buildings']} |", "| 94.9 |", 1))


def test_sums_and_shares_follow_from_the_lines() -> None:
    assert all(share == 1000 * ran // lines / 10 for _, lines, ran, share in ROWS)
    at = [i for i, row in enumerate(ROWS) if row[0] == "all"]
    for of_physics, total in ((ROWS[: at[0]], ROWS[at[0]]), (ROWS[at[0] + 1 : at[1]], ROWS[at[1]])):
        assert total[1:3] == tuple(sum(row[i] for row in of_physics) for i in (1, 2))


def test_lines_of_the_kinds_and_of_the_files_are_those_that_did_not_run() -> None:
    at = [row for row in ROWS if row[0] == "all"]
    missed = [lines - ran for _, lines, ran, _ in at]
    of_kinds = re.findall(r"^\| [\w ]+ \| (\d+) \| (\d+) \|$", PAGE, flags=re.MULTILINE)
    assert [sum(int(row[i]) for row in of_kinds) for i in (0, 1)] == missed
    of_files = re.findall(r"^\| `([\w/.]+\.(?:py|c|h))` \| (\d+) \| (\d+) \| [\d.–]+ \| (.+) \|$", PAGE, re.MULTILINE)
    for path, lines, ran, functions in of_files:
        assert sum(map(int, re.findall(r"` (\d+)", functions))) == int(lines) - int(ran), path
    for suffixes, count in zip(((".py",), (".c", ".h")), missed, strict=True):
        assert sum(int(lines) - int(ran) for path, lines, ran, _ in of_files if path.endswith(suffixes)) == count


def test_the_files_are_those_of_the_sources() -> None:
    """No hand-written C file of the package is left out, but that of the explorer, which runs in a browser."""
    groups = line_coverage.C | line_coverage.INTERFACE
    counted = {**line_coverage.sources(groups, "*.c"), **line_coverage.sources(groups, "*.h")}
    written = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "msfp_gen").rglob("*.[ch]")
        if path.parent.name != "standard"
    }
    assert written - set(counted) == {"msfp_gen/report/assets/explorer/explorer.c"}
    tests = [path for paths in line_coverage.TESTS for path in paths]
    assert tests and all((ROOT / path).exists() for path in tests)


PROGRAM = """
static int half(int x)
{
    if (x % 2)
        return -1;
    return x / 2;
}

int main(void)
{
    return half(4) == 2 ? 0 : 1;
}
"""


@pytest.mark.skipif(not shutil.which("gcc") or not shutil.which("gcov"), reason="no gcc or gcov")
def test_the_lines_of_a_program_are_counted_also_where_its_folder_is_gone(tmp_path: Path) -> None:
    known, built = tmp_path / "half.c", tmp_path / "built"
    known.write_text(PROGRAM, encoding="utf-8")
    compiler = line_coverage.compiler(tmp_path)
    environment = {**os.environ, "GCOV_PREFIX": str(tmp_path / "counts")}
    built.mkdir()
    shutil.copy(known, built)
    subprocess.run([compiler, "-c", "half.c", "-o", "half.o"], cwd=built, check=True)
    subprocess.run([compiler, "half.o", "-o", "half"], cwd=built, check=True)
    subprocess.run([built / "half"], env=environment, check=True)
    shutil.rmtree(built)
    lines, emitted = line_coverage.read_c(tmp_path / "counts", {"half.c": known})
    assert lines["half.c"].ran == {2: True, 4: True, 5: False, 6: True, 9: True, 11: True} and not emitted
    assert lines["half.c"].function[5] == "half"
