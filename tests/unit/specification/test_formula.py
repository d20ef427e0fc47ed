"""Formulas that nest deeply: one line, wherever a formula is taken, and no RecursionError."""

from __future__ import annotations

from typing import Any

import pytest
from support.study_tables import cheap_study

from msfp_gen import InputError
from msfp_gen.scene.file.changes import keys_of_path
from msfp_gen.specification.formula import FLOAT_OPERATIONS, MAX_DEPTH, fold, parse, units_of
from msfp_gen.specification.friction_laws import law_of
from msfp_gen.studies import load_study

DEEP = (
    "-" * 480 + "mu",
    "mu" + "+1" * 240,
    "mu" + "*mu" * 150,
    "Abs(" * 99 + "-mu" + ")" * 99,
    "-(" * 160 + "mu" + ")" * 160,
)


@pytest.mark.parametrize("text", DEEP)
def test_a_formula_that_nests_too_deeply_is_one_line(text: str) -> None:
    with pytest.raises(InputError, match=r"at most 100 operations inside each other") as caught:
        law_of("custom", text)
    assert "\n" not in str(caught.value)


def test_a_formula_of_a_study_that_nests_too_deeply_is_one_line() -> None:
    with pytest.raises(InputError, match=r"quantities.x = .*at most 100 operations inside each other") as caught:
        load_study(cheap_study(quantities={"x": "-" * 480 + "peak_displacement"}))
    assert "\n" not in str(caught.value)


def test_a_formula_of_the_greatest_depth_is_evaluated_far_down_a_program() -> None:
    tree = parse("mu" + "+mu" * (MAX_DEPTH - 1), ["mu"])

    def below(calls: int) -> Any:
        if calls:
            return below(calls - 1)
        return fold(tree, {"mu": 1.0}, FLOAT_OPERATIONS), units_of(tree, [], {})

    assert below(300) == (MAX_DEPTH, {})


def test_a_path_that_leads_too_deeply_is_one_line() -> None:
    path = ".".join(["a"] * 2000)
    with pytest.raises(InputError, match="deeper than any table"):
        keys_of_path(path)
    with pytest.raises(InputError, match=r"axes.a"):
        load_study(cheap_study(axes={"a": {"sets": path, "values": [1]}}, sampling=None))
