"""plot and animate on the command line: files, exit codes, one line for bad input."""

from __future__ import annotations

import pytest
from support import preset_run

from msfp_gen.cli import main
from msfp_gen.figures import FIGURES


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "test5.nc"
    preset_run("fenz-test5").to_netcdf(path)
    return str(path)


def test_all_figures_of_a_saved_run(saved, tmp_path):
    assert main(["plot", saved, "--figure", "all", "-o", str(tmp_path / "new")]) == 0
    assert {path.name for path in (tmp_path / "new").iterdir()} == {f"{name}.png" for name in FIGURES}


def test_one_figure_of_a_scene(tmp_path, capsys):
    path = tmp_path / "s.svg"
    assert main(["plot", "fenz-test2", "--figure", "section", "--time", "20", "--azimuth", "0", "-o", str(path)]) == 0
    assert path.read_bytes().startswith(b"<?xml")
    assert f"wrote {path}" in capsys.readouterr().err


def test_a_folder_takes_the_name_of_the_figure(saved, tmp_path):
    assert main(["plot", saved, "--figure", "loops", "-o", str(tmp_path)]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["loops.png"]


def test_movie_of_a_saved_run(saved, tmp_path):
    path = tmp_path / "m.gif"
    assert main(["animate", saved, "-o", str(path), "--seconds", "0.5", "--rate", "4", "--start", "10"]) == 0
    assert path.read_bytes().startswith(b"GIF8")


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["plot", "SAVED", "--figure", "pie"], "--figure = 'pie': give one of overview, loops"),
        (["plot", "SAVED", "--figure", "loops", "--time", "3"], "--time: only section and force-path have it"),
        (["plot", "SAVED", "--figure", "loops", "--friction-circles"], "--friction-circles: only section"),
        (["plot", "SAVED", "--figure", "all", "--time", "999", "-o", "."], "time = 999 s: the run holds"),
        (["plot", "SAVED", "--figure", "all", "-o", "a.png"], "--figure all writes several files; give a folder"),
        (["plot", "SAVED", "--figure", "loops", "-o", "a.gif"], "--output = 'a.gif': give a name that ends in .png"),
        (["plot", "nowhere.nc"], "nowhere.nc"),
        (["plot", "no-such-scene", "--figure", "all", "-o", "new"], "no-such-scene"),
        (["animate", "SAVED", "-o", "m.avi"], "--output = 'm.avi': give a name that ends in .gif or .mp4"),
        (["animate", "SAVED", "-o", "m.gif", "--end", "999"], "time = 999 s"),
    ],
    ids=lambda value: " ".join(value[2:]) if isinstance(value, list) else "",
)
def test_bad_input_is_one_line_and_writes_nothing(arguments, reason, saved, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main([saved if word == "SAVED" else word for word in arguments]) == 2
    error = capsys.readouterr().err.strip()
    assert error.startswith("error: ") and reason in error and "\n" not in error
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("command", ["plot", "animate"])
def test_help_has_an_example(command, capsys):
    assert main([command, "--help"]) == 0
    assert f"msfp-gen {command} " in capsys.readouterr().out.split("xample", 1)[1]
