"""What docs/robustness.md says of naive code is what benchmarks/naive.py finds."""

from __future__ import annotations

import re
from collections.abc import Callable

import naive
import pytest
from support import ROOT, thinned


def words(text: str) -> str:
    """Without numbers, which solvers and platforms may change a little, and without the marks of tables."""
    return re.sub(r"[-+\d.e$\\ |]+", " ", text.replace("lvert", "").replace("rvert", ""))


@pytest.mark.parametrize(
    "case", thinned(naive.CASES, lambda case: case is not naive.unrolled_expressions), ids=lambda case: case.__name__
)
def test_naive_code_still_fails_as_the_page_says(case: Callable[[], str]) -> None:
    assert words(case()).strip() in words((ROOT / "docs" / "robustness.md").read_text(encoding="utf-8"))


def test_naive_code_is_wrong_where_the_page_says_so() -> None:
    assert "the result is 0" in naive.tilt_by_arc_cosine() and "0 events" in naive.wall_met_by_an_event()
    assert re.search(r"[1-4] of 4 solvers report success", naive.quasi_static_by_ode())
    assert "response 0 m" in naive.pulse_between_steps() and "succeeds 2 times" in naive.two_accelerations()
