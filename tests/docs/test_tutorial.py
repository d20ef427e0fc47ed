"""The tutorial does what it says: every file, command, printed line and picture of it."""

from __future__ import annotations

import shlex

import numpy as np
import pytest
import run_tutorial
from support import ROOT
from support.pages import coarse, same

from msfp_gen import load_scene
from msfp_gen.cli import main


@pytest.fixture(params=["2500 kN", "2500.000000001 kN"])
def followed(request, tmp_path, monkeypatch, capsys):
    """The steps, done in an empty folder; our own commands in this process, which saves the imports.

    The second load differs by rounding only, as runs on other machines do.
    """
    monkeypatch.chdir(tmp_path)
    shown = run_tutorial.blocks()
    given = [block._replace(text=block.text.replace('"2500 kN"', f'"{request.param}"')) for block in shown]
    assert sum(block not in shown for block in given) == (request.param != "2500 kN")
    monkeypatch.setattr(run_tutorial, "blocks", lambda *_: given)

    def run(command, folder):
        program, *arguments = shlex.split(command, comments=True)
        if program != "msfp-gen":
            return run_tutorial.run(command, folder)
        assert main(arguments) == 0, command
        return capsys.readouterr().out

    return list(run_tutorial.follow(tmp_path, run))


@pytest.mark.slow
def test_a_newcomer_gets_what_the_page_shows(followed, tmp_path):
    assert sum(len(step.commands) for step in followed) == 11
    for step in followed:
        printed = iter(step.printed.splitlines())
        for line in filter(str.strip, step.shown.splitlines()):
            assert any(same(line, other) for other in printed), f"{step.commands}: {line!r} is not printed, or not here"
    assert sum(bool(step.shown) for step in followed) == 7
    for name in run_tutorial.PICTURES:
        kept, made = coarse(ROOT / "docs" / "figures" / name), coarse(tmp_path / name)
        assert kept.shape == made.shape
        assert np.abs(kept - made).mean() < 0.004, f"{name}: python docs/make_figures.py draws it again"
    assert (tmp_path / "bearing.html").stat().st_size > 1e6 and (tmp_path / "bounds" / "bounds.png").is_file()


def test_the_scene_holds_what_the_data_sheet_gives(tmp_path):
    """What `sheet.py` computes, by its own functions, is what stands in the scene."""
    sheet, scene = (next(b.text for b in run_tutorial.blocks() if b.language == x) for x in ("python", "toml"))
    (tmp_path / "bearing.toml").write_text(scene, encoding="utf-8")
    bearing = load_scene(tmp_path / "bearing.toml").bearing
    names = {}
    exec(sheet, names)
    diameters = {0: (0.9, 0.35), 1: (0.27, 0.2), 2: (0.27, 0.2), 3: (0.9, 0.35)}
    for index, (dish, slider) in diameters.items():
        surface = bearing.surfaces[index]
        assert surface.capacity == pytest.approx(names["capacity"](surface.radius, dish, slider), abs=1e-4)
        assert bearing.slider_rim_radius(index) == pytest.approx(slider / 2)
    for body, radius in ((0, 2.2), (1, 0.4), (2, 2.2)):
        offset = names["rim_offset"](radius, 2 * bearing.bodies[body].rim_radius)
        assert bearing.bodies[body].rim_offset == pytest.approx(offset, abs=1e-4)


def test_it_installs_as_the_readme_does():
    """The only commands of the page that no test runs: `make test` and CI install the same way."""
    install = run_tutorial.blocks()[0].text
    assert install.strip() in (ROOT / "README.md").read_text(encoding="utf-8")


def test_a_line_that_is_not_printed_is_found():
    assert same("  a  1.00  kN", "a 1.005 kN") and same("a 1 ...", "a 1 2 3") and same("a -2.8e+05", "a -2.84e+05")
    assert not same("a 1.00 kN", "a 1.006 kN") and not same("a 1", "b 1") and not same("a 1", "a 1 2")
    assert not same("a -2.8e+05", "a -2.86e+05") and not same("a 1.9", "a -1.9")
