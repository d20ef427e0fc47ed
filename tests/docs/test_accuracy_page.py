"""docs/accuracy.md is written by one command, and holds what its template says."""

from __future__ import annotations

import re

import accuracy as page
import pytest
from support import ROOT

TEMPLATE = (ROOT / "benchmarks" / "accuracy.md.in").read_text(encoding="utf-8")
WRITTEN = (ROOT / "docs" / "accuracy.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_one_command_writes_figures_numbers_and_page(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "TOLERANCES", (1e-2, 1e-4))
    monkeypatch.setattr(page, "MODEL_TOLERANCES", (1e-2, 1e-4))
    monkeypatch.setattr(page, "CASES", (page.Case("A short push", "fenz-monotonic", 0.1, 0.2, models=True),))
    monkeypatch.setattr(page, "PEER_METHOD", page.Case("The method of PEER 2017/07", "fenz-monotonic", 0.05, 2.0))
    monkeypatch.setattr(page, "PEER_METHOD_TOLERANCES", (0.3, 1e-3))
    monkeypatch.setattr(page, "RINGING", (("fenz-monotonic", 0.05, 1e-6),))
    monkeypatch.setattr(page, "ESTIMATED", ("double-push",))
    monkeypatch.setattr(page, "TARGETS", (0.02,))
    page.main([str(tmp_path), "--share", "0.9"])
    text = (tmp_path / "accuracy.md").read_text(encoding="utf-8")
    assert "{{" not in text and "A short push" in text and "processor" in text and "compiler" in text
    drawn = set(re.findall(r"\]\((figures/[^)]+)\)", text)) - {"figures/accuracy-damping.png"}  # by damped.py
    for target in drawn:
        assert (tmp_path / target).is_file() and (tmp_path / target).with_suffix(".csv").is_file()
    assert len(drawn) == 2
    assert re.search(r"\| `implicit` \| 0\.\d+ \|", text) and "| planar |" in text and "| double-push |" in text


@pytest.mark.slow
def test_only_some_scenes_leave_the_page(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(page, "TOLERANCES", (1e-2,))
    monkeypatch.setattr(page, "CASES", (page.Case("A short push", "fenz-monotonic", 0.05, 0.2),))
    page.main([str(tmp_path), "--only", "fenz-monotonic"])
    assert "A short push" in capsys.readouterr().out and not (tmp_path / "accuracy.md").exists()
    page.main([str(tmp_path), "--only", "fenz-test1"])
    assert not capsys.readouterr().out


def test_page_says_what_the_template_says():
    for part in re.split(r"\{\{\w+\}\}", TEMPLATE):
        assert part in WRITTEN
    assert "{{" not in WRITTEN


def test_bounds_are_ten_times_what_the_references_are_known_to():
    """Of every table of methods: the bound, and by how much the two references differ RMS in force and sliding."""
    found = re.findall(
        r"Within ([\d.]+) %:.*?differ by (\S+) RMS and \S+ at most in force, (\S+) RMS and", WRITTEN, re.DOTALL
    )
    assert len(found) == len(page.ALL_CASES)
    for bound, *floors in found:
        assert float(bound) / 100 >= 10 * max(map(float, floors))


def test_every_case_has_its_figures():
    for case in page.CASES:
        assert f"figures/accuracy-{case.scene}.png" in WRITTEN
        assert (f"figures/accuracy-models-{case.scene}.png" in WRITTEN) is case.models


@pytest.mark.parametrize(("value", "told"), [(0.00123, "1.2 ms"), (0.5, "0.5 s"), (250.4, "250 s")])
def test_seconds_are_told_in_two_digits(value, told):
    assert page.seconds(value) == told
