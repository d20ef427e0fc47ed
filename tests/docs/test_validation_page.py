"""The validation page: its rows say what they claim, and they are what a run gives."""

from __future__ import annotations

import csv
import re
from collections import Counter

import external
import outside
import pytest
import validation
from support import ROOT

from msfp_gen import presets
from msfp_gen.common.tables import markdown_row

PAGE = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
KINDS = {"experiment", "model", "program", "formula", "closed form"}


def rows() -> list[list[str]]:
    """Cells of the rows of the table."""
    table = PAGE.split("## Single numbers", 1)[1].split("| --- |", 1)[1].split("\n\n", 1)[0]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in table.splitlines()[1:]]


def test_differences_are_those_of_the_numbers() -> None:
    assert len(rows()) > 50
    for case, _, kind, quantity, reference, ours, difference, _ in rows():
        assert kind in KINDS
        share = float(ours) / float(reference) - 1
        told = float(difference.rstrip("%")) / (100 if difference.endswith("%") else 1)
        rounding = 1.1 * 10.0 ** -len(ours.partition(".")[2]) / float(reference) + 6e-4
        assert told == pytest.approx(share, abs=rounding), f"{case}, {quantity}"


def test_every_command_exists() -> None:
    for *_, command in rows():
        program, *words = command.strip("`").split()
        if program == "msfp-gen":
            assert words[0] == "run" and (words[1] in presets.names("scene") or (ROOT / words[1]).exists())
        else:
            assert program == "python" and (ROOT / words[0]).exists()


def test_closed_forms_are_met() -> None:
    """By all but the loop that stays in the elastic part of friction, and the start of the last surface of a push.

    Both are met with a tenth of the yield displacement.
    """
    for case, source, kind, quantity, _, _, difference, _ in rows():
        yields = source == "friction circles" and (case == "`fenz-test1`" or quantity.startswith("u**"))
        if kind == "closed form" and not yields:
            assert abs(float(difference.rstrip("%"))) <= 1.0, f"{case}, {source}"


def test_rows_are_what_runs_give() -> None:
    """The quick ones, to the digits of the page."""
    listed = set(PAGE.splitlines())
    for case in (*validation.table_42(), *validation.laws()):
        assert markdown_row(validation.line(case)) in listed


@pytest.mark.slow
def test_all_rows_but_those_of_other_programs_are_what_runs_give() -> None:
    listed = set(PAGE.splitlines())
    for case in validation.cases(opensees=False):
        assert markdown_row(validation.line(case)) in listed
    assert validation.plant_words() in PAGE


def comparisons() -> list[dict[str, str]]:
    return list(csv.DictReader(validation.POINTS.read_text(encoding="utf-8").splitlines()))


def test_every_comparison_has_source_and_tolerance() -> None:
    """More than a thousand, most of them with other programs; the page states how many, and how many are within."""
    found = comparisons()
    for one in found:
        assert one["source"] and float(one["tolerance"]) == external.TOLERANCE[one["kind"]]
        assert float(one["reference"]) != 0 or float(one["ours"]) == 0 or one["at"]
    kinds = Counter(one["kind"] for one in found)
    assert kinds["program"] > 300 and set(kinds) == set(external.TOLERANCE)
    within = sum(abs(float(one["difference"])) <= float(one["tolerance"]) for one in found)
    assert f"{len(found)} comparisons, {within} of them within the tolerance" in PAGE.replace("\n", " ")
    last = history()[-1]
    assert (last["comparisons"], last["within"]) == (str(len(found)), str(within)) and within > 0.95 * len(found)


def history() -> list[dict[str, str]]:
    return list(csv.DictReader(validation.HISTORY.read_text(encoding="utf-8").splitlines()))


def test_history_has_every_release_that_had_the_page() -> None:
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    releases = re.findall(r"^## (\d\S*) \(", changes, re.MULTILINE)
    assert [row["version"] for row in history()] == [
        *(version for version in reversed(releases) if version != "0.1.0"),
        *(["unreleased"] if "\n## Unreleased\n" in changes else []),
    ]
    for row in history():
        assert markdown_row(row.values()) in PAGE


def test_every_difference_beyond_its_tolerance_has_a_cause() -> None:
    """And the same cases are within the tolerance where the cause is taken out; two points have another cause too."""
    found = comparisons()
    assert outside.causes(found) in PAGE
    for cause in outside.CAUSES:
        rest = outside.without(found, cause)
        assert bool(rest) == bool(cause.without), cause.label
        assert len(outside.outside(rest)) <= 0.02 * len(rest), cause.label


def test_a_difference_without_cause_is_an_error() -> None:
    other = {"case": "block", "source": "Newmark 1965", "quantity": "slip [m]", "at": "", "difference": "0.02"}
    with pytest.raises(ValueError, match=r"block, Newmark 1965, slip \[m\].*not of one cause"):
        outside.causes([*comparisons(), {**other, "tolerance": "0.01"}])


def test_tables_of_others_name_their_source() -> None:
    for path in external.DATA.iterdir():
        assert re.match(r"# .*\(.*commit [0-9a-f]{12}\)", path.read_text(encoding="utf-8")), path.name


@pytest.mark.slow
@pytest.mark.parametrize("part", ["circle_with_friction", "sliding_block"])
def test_closed_forms_of_sliding_are_met(part: str) -> None:
    for series in getattr(external, part)():
        assert series.within == len(series.points)


@pytest.mark.slow
def test_series_but_those_of_running_programs_are_those_of_the_page() -> None:
    listed = set(PAGE.splitlines())
    for series in validation.series(opensees=False):
        assert markdown_row(validation.series_line(series)) in listed
