"""The page of a fit: its numbers, what it says about limits, its figures, and that it loads no other file."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support import scene_of

from msfp_gen import InputError
from msfp_gen.report import fit_html, write_fit_report
from msfp_gen.studies.calibration import Fit, FittedTest, FittedValue, Measurement
from msfp_gen.studies.calibration.fit_result import ACROSS, DRAWN, plot_fit, plot_residuals

RNG = np.random.default_rng(0)


def fitted(name: str, load: float | None = None) -> FittedTest:
    """A loop with noise, beside the loop."""
    time = np.linspace(0, 10, 200)
    force = 2e4 * np.sin(time + 0.3) - 2e4 * np.sin(0.3)
    return FittedTest(Measurement(name, time, 0.05 * np.sin(time), force + 200 * RNG.standard_normal(200), load), force)


def made(tests: list[FittedTest], **changes: object) -> Fit:
    estimates = (
        FittedValue("bearing.surfaces[0].friction", "", 0.03, 0.04, 0.001, 0.028, 0.032, 5e-5, (0.004, 0.4)),
        FittedValue("bearing.surfaces[0].radius", "m", 0.47, 0.473, np.inf, -np.inf, np.inf, np.inf, (0.1, 1.0)),
        FittedValue("offset of a.csv", "N", 12.5, 0.0, 3.0, 6.5, 18.5, 0.5),
    )
    correlation = np.array([[1.0, np.nan, 0.25], [np.nan, np.nan, np.nan], [0.25, np.nan, 1.0]])
    found = Fit(scene_of("fenz-test2"), estimates, correlation, 12.5, tuple(tests), (), (), 7, 1e-6)
    return replace(found, **changes)  # type: ignore[arg-type]


def texts(html: str) -> str:
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", html))


def test_numbers_and_limits_stand_on_the_page(tmp_path: Path) -> None:
    found = made([fitted("a.csv"), fitted("b <i>.csv", 2e5)], unidentified=("not seen by the tests: x",), notes=("hm",))
    html = write_fit_report(found, tmp_path / "fit.html").read_text(encoding="utf-8")
    text = texts(html)
    assert "2 values of the scene and 1 offset of force fitted to 2 laboratory tests of 400 rows" in text
    assert "0.028 to 0.032 0.04 - 5e-05 -25.0 % 0.004 to 0.4" in text
    assert "not determined 0.473 m not measured -0.6 % 0.1 to 1" in text
    assert "6.5 to 18.5 0 N 0.5 - none" in text
    assert "0.0001 in the search, 1e-06 at its end" in text
    assert "+0.250" in text and "condition 12.5" in text
    assert "not seen by the tests: x" in text and "hm" in text and "Nothing was found" not in text
    assert "b &lt;i&gt;.csv" in html and "b <i>" not in html
    row = re.search(r"a\.csv ([\d.]+) ([\d.]+) 200 50 ([\d.]+) 112 1 (-?[\d.]+)", text)
    assert row and float(row[1]) == pytest.approx(found.tests[0].deviation, rel=1e-3)
    assert abs(float(row[4])) < 0.3, "noise is not correlated"
    assert re.search(r"b &lt;i&gt;\.csv [\d.]+ [\d.]+ 200 50 [\d.]+ 200 1 ", text)
    assert html.count("data:image/webp;base64,") == 2
    assert not re.search(r"(src|href)=\"(?!data:|#)", html) and "default-src 'none'" in html


def test_a_fit_without_limits_says_so_and_one_value_has_no_correlation() -> None:
    found = made([fitted("a.csv")])
    text = texts(fit_html(replace(found, estimates=found.estimates[:1], correlation=found.correlation[:1, :1])))
    assert "Nothing was found" in text and "1 value of the scene fitted to 1 laboratory test of 200 rows" in text
    assert "Correlation parameter" not in text


def test_a_path_of_another_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.html"):
        write_fit_report(made([fitted("a.csv")]), tmp_path / "fit.pdf")


def test_loops_of_many_tests_stand_in_rows() -> None:
    tests = [fitted("a.csv")] * (DRAWN + 2)
    assert len(plot_fit(tests[: ACROSS + 1]).axes) == 2 * (ACROSS + 1)
    figure = plot_fit(tests)
    assert len(figure.axes) == 2 * DRAWN
    assert f"{DRAWN + 2} tests, the first {DRAWN}" in figure.get_suptitle()
    over_u, over_force, normal = plot_residuals(tests[:2]).axes
    assert len(over_u.lines) == 3 and len(over_force.lines) == 3, "two tests and the line of zero"
    assert normal.lines[1].get_ydata() == pytest.approx(np.sort(normal.lines[1].get_ydata()))
