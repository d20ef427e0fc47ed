"""What the parts of the program were compared with: the page with the numbers, and the tests that make them again."""

from __future__ import annotations

from typing import NamedTuple

from msfp_gen.common.tables import Table


class Comparison(NamedTuple):
    """A part of the program, what it was compared with, the page of docs/ that says how, and the tests in tests/.

    used: the kind of the analyses that use the part; "" for all.
    """

    part: str
    reference: str
    page: str
    tests: tuple[str, ...]
    used: str = ""


COMPARISONS = (
    Comparison("forces and motions of a bearing", "tests and models of PEER 2017/07 and of Fenz and Constantinou "
               "(2008)", "validation", ("docs/test_validation_page.py",)),
    Comparison("equations of motion, their solution", "a second formulation, written by hand; motions that are known "
               "beforehand", "verification", ("physics/test_manufactured.py",)),
    Comparison("superstructure on its bearings", "closed forms; an eccentric frame under a record in OpenSees",
               "buildings", ("physics/test_buildings.py", "physics/test_building_opensees.py"), "building"),
    Comparison("uplift of bearings below a building", "statics, energy, smaller tolerances", "uplift",
               ("physics/test_building_uplift.py",), "building"),
    Comparison("bounds of friction", "the rules of the codes by hand, as the literature quotes them; friction circles",
               "properties", ("unit/studies/test_bounding.py",)),
    Comparison("spectra of records", "closed forms and an independent integration", "motion",
               ("unit/motions/records/test_spectrum.py",)),
    Comparison("capacities, backbone and effective properties of a data sheet", "published devices; formulas by hand",
               "bearing", ("unit/scene/test_sheet.py", "cli/test_sheet_command.py"), "sheet"),
)  # fmt: skip


def compared_table(kinds: set[str]) -> Table:
    """The comparisons of the parts that an analysis uses. kinds: "building", "sheet", where it has them."""
    rows = [(one.part, one.reference, one.page) for one in COMPARISONS if one.used in {"", *kinds}]
    return Table("parts of the program, and what each was compared with", ("part", "compared with", "page"), rows)
