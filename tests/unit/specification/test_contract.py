"""What crosses between Python and C, written once in specification/contract.py: everything else agrees with it."""

from __future__ import annotations

import re
from dataclasses import fields
from typing import get_args, get_type_hints

import numpy as np
import pytest
from support import ROOT, model_of
from support.emitted_c import text

from msfp_gen import Effects, Solver, Surface
from msfp_gen.model.compiled import FAILURES
from msfp_gen.results.history import ENERGY, Counters, Event
from msfp_gen.specification import contract
from msfp_gen.specification.contract import names

PAGE = ROOT / "docs" / "glossary.md"
TABLES = {
    "status": tuple(status for status in contract.STATUSES if status.compiled),
    "integral": contract.WORKS,
    "event_kind": contract.EVENT_KINDS,
    "count": contract.COUNTERS,
    "method": contract.METHODS,
    "monitor": contract.MONITORS,
}


def enum(header: str, name: str) -> list[str]:
    """Enumerators of a named enumeration in order, its count last."""
    found = re.search(rf"^enum msfp_{name} \{{\n(.*?)^\}};", header, re.DOTALL | re.MULTILINE)
    assert found, name
    return re.findall(r"^ +(MSFP_\w+)", found[1], flags=re.MULTILINE)


@pytest.mark.parametrize("name", TABLES)
def test_enumerations_of_the_header_are_the_tables(name: str) -> None:
    """In the public header; the words are known to C (statuses) or to the wrapper, in this order."""
    words = names(TABLES[name])
    *entries, _count = enum(text("msfp.h"), name)
    assert [entry.lower().endswith(word) for entry, word in zip(entries, words, strict=True)] == [True] * len(words)
    if name != "status":
        assert str(words) in text("msfp_module.pyx")
        return
    listed = re.search(r"msfp_status_name\(int value\)\n{\n.*?= { (.*?) };", text("msfp_model.h"), re.DOTALL)
    assert listed and tuple(re.findall(r'"(\w+)"', listed[1])) == words


@pytest.mark.parametrize("effects", [{}, {"uplift": True}, {"friction": "pvt"}], ids=str)
def test_header_lays_out_values_and_rows_in_order(effects: dict[str, object]) -> None:
    """C asserts at compile time that each field of a row begins where its index says."""
    header, given = text("msfp_model.h", **effects), Effects(**effects)  # type: ignore[arg-type]
    for kind, columns in (
        ("body", names(contract.BODY)),
        ("surface", contract.surface_values(given)),
        ("top", names(contract.TOP)),
    ):
        (block,) = re.findall(rf"^/\* {kind}_values \*/\nenum \{{\n(.*?)^\}};", header, re.DOTALL | re.MULTILINE)
        expected = [(f"MSFP_{kind}_VALUES_{name}".upper(), str(i)) for i, name in enumerate((*columns, "size"))]
        assert re.findall(r"^    (\w+) = (\d+)", block, re.MULTILINE) == expected
    row = [quantity.name for quantity in contract.row(given)]
    assert enum(header, "row_field") == [*(f"MSFP_ROW_{name.upper()}" for name in row), "MSFP_ROW_SIZE"]
    asserted = re.findall(r"^MSFP_STATIC_ASSERT\(offsetof\(msfp_row, (\w+)\)", header, flags=re.MULTILINE)
    assert asserted == row and "MSFP_STATIC_ASSERT(sizeof(msfp_row) ==" in header


def test_compiled_module_has_the_tables() -> None:
    extension = model_of((5, 2, 2)).extension
    effects = Effects()
    assert (names(contract.BODY), names(contract.TOP)) == (extension.BODY_VALUES, extension.TOP_VALUES)
    assert contract.surface_values(effects) == extension.SURFACE_VALUES
    assert [name for name, _ in extension.ROW] == [quantity.name for quantity in contract.row(effects)]
    assert dict(extension.ROW)["q"] == (4, 3) and dict(extension.ROW)["work"] == (len(contract.WORKS),)
    assert sum(int(np.prod(shape)) for _, shape in extension.ROW) == extension.ROW_SIZE
    assert names(contract.EVENT_KINDS) == extension.EVENT_KINDS and names(contract.COUNTERS) == extension.COUNTS
    assert tuple(extension.METHODS) == names(contract.METHODS) and names(contract.MONITORS) == extension.MONITORS


def test_python_knows_the_same_words() -> None:
    assert (*names(contract.COUNTERS), "wall_time") == tuple(field.name for field in fields(Counters))
    assert get_args(get_type_hints(Event)["kind"]) == names(contract.EVENT_KINDS)
    assert set(get_args(get_type_hints(Solver)["method"])) == set(names(contract.METHODS))
    assert set(names(contract.WORKS)) <= set(ENERGY)
    assert {value.name for value in contract.EVERY_SURFACE} <= {f.name for f in fields(Surface)}


def test_every_status_that_ends_a_run_says_why() -> None:
    for status in contract.STATUSES:
        assert bool(status.failure) == (status.name not in ("ok", "stopped")), status.name
    assert set(FAILURES) < set(names(contract.STATUSES))


def test_glossary_lists_the_statuses() -> None:
    rows = PAGE.read_text(encoding="utf-8").partition("## Status words")[2]
    listed = re.findall(r"^\| `(\w+)` \| (.+) \|$", rows, flags=re.MULTILINE)
    assert listed == [(status.name, status.meaning) for status in contract.STATUSES]
