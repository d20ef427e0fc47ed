"""Help: every command has an example that is itself a command, shells complete, long runs say how long they take."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys

import pytest
import typer.main
from support.synthetic import loops

from msfp_gen import load_scene
from msfp_gen.cli import app, main
from msfp_gen.cli.console import ShownProgress, building, scenes
from msfp_gen.motions.records import ScaleTo, baseline_corrected, bundled, response_spectrum
from msfp_gen.report import report_html

ROOT = typer.main.get_command(app)
COMMANDS = sorted(ROOT.commands)


def examples(name):
    epilog = ROOT.commands[name].epilog or ""
    return [line.partition("#")[0].strip() for line in epilog.splitlines() if line.strip().startswith("msfp-gen ")]


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help_with_examples(name, capsys):
    assert main([name, "--help"]) == 0
    out = capsys.readouterr().out
    assert f"Usage: msfp-gen {name}" in out and "Example" in out
    assert ROOT.commands[name].help and examples(name)
    assert any(f"msfp-gen {name}" in example for example in examples(name))


@pytest.mark.parametrize("name", COMMANDS)
def test_examples_are_understood(name, capsys):
    """Names and options of every example exist: parsing stops short of running."""
    for example in examples(name):
        words = shlex.split(re.split(r" [|>]", example)[0])[2:]
        assert ROOT.commands[name].make_context(name, words).info_name == name
    assert main([name, "--no-such-option"]) == 2 and "--no-such-option" in capsys.readouterr().err


def completed(words, count, shell="bash"):
    variables = {"_MSFP_GEN_COMPLETE": f"complete_{shell}", "COMP_WORDS": words, "COMP_CWORD": str(count)}
    run = subprocess.run(
        [sys.executable, "-m", "msfp_gen"], env={**os.environ, **variables}, capture_output=True, text=True, check=False
    )
    assert run.stderr == ""
    return run.stdout.split()


def test_a_shell_completes_commands_and_scenes():
    assert "explain" in completed("msfp-gen exp", 1)
    assert completed("msfp-gen run fenz-test", 2) == [f"fenz-test{number}" for number in range(1, 6)]
    assert "--rtol" in completed("msfp-gen run --rt", 2)


def test_completion_can_be_shown(capsys):
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    assert "--install-completion" in out and "--show-completion" in out


def test_scene_files_and_folders_are_offered(tmp_path, monkeypatch):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "a.toml").write_text("", encoding="utf-8")
    (tmp_path / "mine" / "a.txt").write_text("", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert scenes("mi") == [("mine/", "folder")]
    assert scenes("mine/") == [("mine/a.toml", "scene file")]
    assert scenes(f"{tmp_path}/mine/a") == [(f"{tmp_path}/mine/a.toml", "scene file")]
    assert [name for name, _ in scenes("quint")] == ["quintuple-push"]
    assert load_scene(scenes("quint")[0][0]).name == "quintuple-push"


def test_progress_says_how_long_it_still_takes(capsys, monkeypatch):
    now = [0.0]
    monkeypatch.setattr("msfp_gen.cli.console.monotonic", lambda: now[0])
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with ShownProgress("long") as update:
        for now[0], done in ((0.5, 1.0), (4.0, 2.5)):
            update(done, 10.0)
    err = capsys.readouterr().err
    assert "long: 10 %\r" in err and "long: 25 %, 12 s left" in err


def test_progress_of_a_build_says_what_is_done_and_how_long_it_takes(capsys, monkeypatch):
    now = [0.0]
    monkeypatch.setattr("msfp_gen.cli.console.monotonic", lambda: now[0])
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with building() as tell:
        tell("deriving 7_3_3", 0.0)
        now[0] = 1.0
        tell("compiling (0 of 2 files)", 0.25)
        now[0] = 4.0
        tell("compiling (1 of 2 files)", 0.5)
        now[0] = 5.1
    err = capsys.readouterr().err.replace("\r\x1b[K", "\n").splitlines()
    stages = ["deriving 7_3_3: 0 %", "compiling (0 of 2 files): 25 %", "compiling (1 of 2 files): 50 %, 4 s left"]
    assert err[1:4] == stages
    assert err[-1] == "built in 5.1 s; later runs load it from the cache"


def test_nothing_is_said_of_a_model_that_is_there(capsys):
    with building():
        pass
    assert capsys.readouterr().err == ""


@pytest.mark.slow
def test_spectra_scales_and_reports_say_how_far_they_are():
    """What takes seconds is told: every period, every figure, in order to the end."""
    record = bundled("ridgecrest-2019-ci-clc")
    told = []
    response_spectrum(record, [0.5, 1.0], progress=lambda *at: told.append(at))
    assert told == [(1, 2), (2, 2)]
    target = ScaleTo.parse("sds=1 g, sd1=0.6 g, between=1:2")
    told.clear()
    target.factor(baseline_corrected(record, duration=4.0), lambda *at: told.append(at))
    assert told == [(k, 100) for k in range(1, 101)]
    told.clear()
    report_html(loops(), 2, lambda *at: told.append(at))
    assert told == [(k, 5) for k in range(1, 6)]
