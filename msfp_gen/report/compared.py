"""What the parts of the program were compared with: the page with the numbers, and the tests that make them again."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import singledispatch
from typing import Any, NamedTuple

from msfp_gen.common.tables import Table
from msfp_gen.scene.scene import Scene


class Comparison(NamedTuple):
    """A part of the program, what it was compared with, the page of docs/ that says how, and the tests in tests/."""

    part: str
    reference: str
    page: str
    tests: tuple[str, ...]


COMPARISONS = (
    Comparison("forces and motions of a bearing", "tests and models of PEER 2017/07 and of Fenz and Constantinou "
               "(2008)", "validation", ("docs/test_validation_page.py",)),
    Comparison("equations of motion, their solution", "a second formulation, written by hand; motions that are known "
               "beforehand", "verification", ("physics/test_manufactured.py",)),
    Comparison("bounds of friction", "the rules of the codes by hand, as the literature quotes them; friction circles",
               "properties", ("unit/studies/test_bounding.py",)),
    Comparison("spectra of records", "closed forms and an independent integration", "motion",
               ("unit/motions/records/test_spectrum.py",)),
)  # fmt: skip
OF_SHEETS = Comparison(
    "capacities, backbone and effective properties of a data sheet",
    "published devices; formulas by hand",
    "bearing",
    ("unit/scene/test_sheet.py", "cli/test_sheet_command.py"),
)


@singledispatch
def comparisons_of(scene: Any) -> Sequence[Comparison]:
    """The comparisons of the parts that a system uses beside its bearings."""
    found: Sequence[Comparison] = scene.comparisons
    return found


@comparisons_of.register(Scene)
def _none(_: Scene) -> Sequence[Comparison]:
    return ()


def compared_table(comparisons: Iterable[Comparison]) -> Table:
    """The comparisons of the parts that an analysis uses."""
    rows = [(one.part, one.reference, one.page) for one in comparisons]
    return Table("parts of the program, and what each was compared with", ("part", "compared with", "page"), rows)
