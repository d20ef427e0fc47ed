"""The validation page: its rows say what they claim, and they are what a run gives."""

from __future__ import annotations

import re

import pytest
import validation
from support import ROOT

from msfp_gen import presets

PAGE = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
KINDS = {"experiment", "model", "program", "formula", "closed form"}


def rows() -> list[list[str]]:
    """Cells of the rows of the table."""
    table = PAGE.split("| --- |", 1)[1].split("\n\n", 1)[0]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in table.splitlines()[1:]]


def test_differences_are_those_of_the_numbers() -> None:
    assert len(rows()) > 50
    for case, _, kind, quantity, reference, ours, difference, _ in rows():
        assert kind in KINDS
        share = float(ours) / float(reference) - 1
        told = float(difference.rstrip("%")) / (100 if difference.endswith("%") else 1)
        rounding = 1.1 * 10.0 ** -len(ours.partition(".")[2]) / float(reference) + 6e-4
        assert told == pytest.approx(share, abs=rounding), f"{case}, {quantity}"


def test_every_source_and_command_exists() -> None:
    for *_, command in rows():
        program, *words = command.strip("`").split()
        if program == "msfp-gen":
            assert words[0] == "run" and (words[1] in presets.names("scene") or (ROOT / words[1]).exists())
        else:
            assert program == "python" and (ROOT / words[0]).exists()
    text = " ".join(cell for row in rows() for cell in row)
    for name in ("Fenz", "Becker", "Sarlis", "Kumar", "OpenSees", "friction circles", "Lee & Constantinou"):
        assert name in PAGE and (name == "Becker" or name in text)


def test_closed_forms_are_met() -> None:
    """By all but the loop that stays in the elastic part of friction, and the start of the last surface of a push."""
    for case, source, kind, quantity, _, _, difference, _ in rows():
        if kind == "closed form" and case != "`fenz-test1`" and not quantity.startswith("u**"):
            assert abs(float(difference.rstrip("%"))) <= 1.0, f"{case}, {source}"


def test_rows_are_what_runs_give() -> None:
    """The quick ones, to the digits of the page."""
    listed = set(PAGE.splitlines())
    for case in (*validation.table_42(), *validation.laws()):
        assert validation.line(case) in listed


@pytest.mark.slow
def test_all_rows_but_those_of_other_programs_are_what_runs_give() -> None:
    listed = set(PAGE.splitlines())
    for case in validation.cases(opensees=False):
        assert validation.line(case) in listed
