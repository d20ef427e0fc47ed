"""docs/studies.md and the example: its study file is valid, its commands run and print what the page shows."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from support import ROOT

from msfp_gen.cli import main
from msfp_gen.studies import load_study
from msfp_gen.studies.axes import METHODS

PAGE = (ROOT / "docs" / "studies.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)
EXAMPLE = ROOT / "examples" / "fragility" / "study.toml"


def test_the_study_file_of_the_page_is_valid(tmp_path: Path) -> None:
    text = next(block for language, block in BLOCKS if language == "toml" and "[sampling]" in block)
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    scene = (ROOT / "examples" / "triple.toml").read_text(encoding="utf-8")
    (tmp_path / "scene.toml").write_text(
        re.sub(r"\[motion\].*?(?=^\[)", "", scene, flags=re.M | re.S), encoding="utf-8"
    )
    suite = '[[records]]\nbundled = "ridgecrest-2019-ci-ccc"\nduration = 30.0\n'
    (tmp_path / "suite.toml").write_text(suite, encoding="utf-8")
    study = load_study(tmp_path / "study.toml")
    assert study.shape == (1, 5, 3, 100) and study.chunk == 64


def test_every_sampling_is_on_the_page() -> None:
    assert all(f"| `{method}` |" in PAGE for method in METHODS)


def test_the_example_is_the_study_of_the_page() -> None:
    text, study = EXAMPLE.read_text(encoding="utf-8"), load_study(EXAMPLE)
    assert study.runs == 144 and "144 runs" in PAGE
    shown = next(block for language, block in BLOCKS if language == "toml" and "asce7-quality" in block)
    for line in shown.splitlines():
        assert "..." in line or line in text, line
    assert "#     msfp-gen study examples/fragility/study.toml -o out\n" in text


@pytest.mark.slow
def test_commands_of_the_page_print_what_it_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    part = PAGE.partition("## From a study file to a figure")[2].partition("\n## ")[0]
    whole = [re.sub(r"\\\n\s*", " ", text) for language, text in BLOCKS if not language and text in part]
    plain = [text.splitlines() for text in whole]
    commands = [line for block in plain for line in block if line.startswith("msfp-gen ")]
    assert len(commands) == 3
    for command in commands:
        words: list[Any] = shlex.split(command.replace("examples/", f"{ROOT}/examples/"))
        assert main(words[1:]) == 0
    printed, (table,) = capsys.readouterr().out, [block for block in plain if block[0].startswith("fragility by")]
    for line in table:
        assert line in printed
    assert {path.name for path in tmp_path.glob("*.png")} == {"ida.png", "fragility.png"}
