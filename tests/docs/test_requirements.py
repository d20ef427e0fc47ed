"""docs/requirements.md: every requirement has a test that exists, and the page is that of the sources.

A new test need not be on the page; a new requirement, one that lost its tests, or a new figure must.
"""

from __future__ import annotations

import re

import make_requirements
import pytest
from support import ROOT

AGAIN = "python docs/make_requirements.py writes docs/requirements.md again"
SECTIONS = [title for title, _, _ in make_requirements.SECTIONS]


def rows(title: str) -> list[list[str]]:
    """Cells of the rows of a section of the page."""
    page = (ROOT / "docs" / "requirements.md").read_text(encoding="utf-8")
    table = page.split(f"## {title}\n", 1)[1].split("\n## ", 1)[0]
    lines = [line for line in table.splitlines() if line.startswith("| ")][2:]
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]


@pytest.mark.parametrize("title", SECTIONS)
def test_every_requirement_has_a_test(title: str) -> None:
    found = make_requirements.requirements()[title]
    assert found, title
    without = [each.name for each in found if not each.tests]
    assert not without, f"no test cites, uses or compares {without}"
    missing = [test for each in found for test in each.tests if test.startswith("MISSING")]
    assert not missing


@pytest.mark.parametrize("title", SECTIONS)
def test_the_page_is_up_to_date(title: str) -> None:
    found, shown = make_requirements.requirements()[title], rows(title)
    assert [each.name for each in found] == [cells[0] for cells in shown], AGAIN
    for each, cells in zip(found, shown, strict=True):
        assert set(re.findall(r"`([^`]+)`", cells[1])) <= set(each.tests), f"{each.name}: {AGAIN}"
        assert len(cells) < 3 or cells[2] == (each.figure or "–"), f"{each.name}: {AGAIN}"


def test_citations_are_read_from_ranges_and_names() -> None:
    assert make_requirements.numbers("(3.4)-(3.6) and (2.36)") == {"3.4", "3.5", "3.6", "2.36"}
    assert make_requirements.numbers("test_slips_3_14_2_90_contact_") == {"3.14", "2.90"}
    assert not make_requirements.numbers("f(3.14159, 2.5)")


def test_a_requirement_without_a_test_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the tests of the physics no equation has one."""
    few = tuple(each for each in make_requirements.modules() if each.path.startswith("tests/cli/"))
    monkeypatch.setattr(make_requirements, "modules", lambda: few)
    assert not any(each.tests for each in make_requirements.equations())
