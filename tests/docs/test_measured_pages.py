"""Pages of figures are measured by one command, and say with which version (`benchmarks/pages.py`)."""

from __future__ import annotations

import re
import shlex

import pages
import pytest
from support import ROOT

import msfp_gen

PAGE = """Measured by `python benchmarks/pages.py` on 2020-01-01: processor A; msfp_gen 0.0.1.

By `python benchmarks/a.py` (2020-01-01), and `python benchmarks/b.py --table x`, 2020-01-02:

<!-- python benchmarks/a.py -->
| a | b |
|---|---|
| 1 | 2 |

<!-- python benchmarks/b.py --table x -->

| c |
|---|
| 3 |

<!-- python benchmarks/a.py -->
| e |
|---|
| 5 |

| by hand |
|---|
| 7 |
"""
PRINTED = {
    "python benchmarks/a.py": "words\n\n| a | b |\n|---|---|\n| 10 | 20 |\n| 30 | 40 |\n\n| f |\n|---|\n| 50 |\n",
    "python benchmarks/b.py --table x": "no table: left out",
}


def test_each_marked_table_is_the_next_that_its_command_prints(tmp_path, monkeypatch):
    """A command that prints fewer tables leaves the others in a quick run, and is an error otherwise."""
    (tmp_path / "page.md").write_text(PAGE)
    with pytest.raises(SystemExit, match=r"b\.py --table x: it prints fewer tables"):
        pages.measure(tmp_path / "page.md", tmp_path / "out.md", PRINTED.__getitem__)
    assert not (tmp_path / "out.md").exists()
    monkeypatch.setattr(pages, "QUICK", True)
    monkeypatch.setattr(pages, "labelled", str)
    pages.measure(tmp_path / "page.md", tmp_path / "out.md", PRINTED.__getitem__)
    text = (tmp_path / "out.md").read_text()
    assert "<!-- python benchmarks/a.py -->\n| a | b |\n|---|---|\n| 10 | 20 |\n| 30 | 40 |\n\n<!--" in text
    assert "| f |\n|---|\n| 50 |\n\n| by hand |\n|---|\n| 7 |\n" in text and "| 1 | 2 |" not in text
    assert "| c |\n|---|\n| 3 |" in text and "| 5 |" not in text
    assert "2020" not in text and f"msfp_gen {msfp_gen.__version__}" in text.splitlines()[0]


@pytest.mark.parametrize("name", pages.PAGES)
def test_commands_above_tables_are_scripts(name):
    found = pages.commands(pages.PAGES[name].read_text(encoding="utf-8"))
    assert found and all((ROOT / shlex.split(command)[1]).is_file() for command in found)


@pytest.mark.parametrize("name", pages.PAGES)
def test_pages_are_measured_with_this_version(name):
    text = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
    assert re.findall(r"; msfp_gen ([^;.]+\.[^;.]+\.[^;.]+)[;.]", text) == [msfp_gen.__version__]
