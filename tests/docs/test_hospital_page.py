"""docs/hospital.md does what it says: its file is the preset, and its commands print what it shows."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest
import run_tutorial
from matplotlib.image import imread
from support import ROOT
from support.pages import coarse, same

from msfp_gen import BuildingScene, load_scene
from msfp_gen.cli import main

PAGE = ROOT / "docs" / "hospital.md"


def test_the_file_of_the_page_is_the_preset(tmp_path: Path):
    text = next(block.text for block in run_tutorial.blocks(PAGE) if block.language == "toml")
    (tmp_path / "hospital.toml").write_text(text, encoding="utf-8")
    found, preset = load_scene(tmp_path / "hospital.toml"), load_scene("hospital-ccc")
    assert isinstance(found, BuildingScene) and isinstance(preset, BuildingScene)
    for name in ("mass", "damping", "stiffness"):
        assert getattr(found.building, name) == pytest.approx(getattr(preset.building, name), rel=1e-9, abs=1e-3)
    assert [replaced(each) for each in found.bearings] == [replaced(each) for each in preset.bearings]
    assert found.motion == preset.motion and found.solver == preset.solver


def replaced(each):
    return each.bearing, each.interface, each.position, each.node, each.effects, each.name


@pytest.mark.slow
def test_its_commands_print_what_it_shows(tmp_path: Path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def run(command, folder):
        program, *arguments = shlex.split(command, comments=True)
        if program != "msfp-gen":
            return run_tutorial.run(command, folder)
        assert main(arguments) == 0, command
        return capsys.readouterr().out

    steps = list(run_tutorial.follow(tmp_path, run, PAGE))
    assert sum(len(step.commands) for step in steps) == 6 and sum(bool(step.shown) for step in steps) == 4
    for step in steps:
        printed = iter(step.printed.splitlines())
        for line in filter(str.strip, step.shown.splitlines()):
            assert any(same(line, other) for other in printed), f"{step.commands}: {line!r} is not printed, or not here"
    kept, made = coarse(ROOT / "docs" / "figures" / "hospital.png"), coarse(tmp_path / "hospital.png")
    assert kept.shape == made.shape and np.abs(kept - made).mean() < 0.004
    assert imread(tmp_path / "spectra.png").size and (tmp_path / "hospital.html").stat().st_size > 1e6
    assert (tmp_path / "bounds" / "bounds.png").is_file() and (tmp_path / "both.csv").is_file()
