"""`msfp-gen audit` prints findings, writes a page, and ends with 1 where something is inconsistent."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from support import ROOT
from support.audits import run_of, shaken

from msfp_gen.auditing.histories import QUANTITIES
from msfp_gen.cli import main
from msfp_gen.scene.file.loader import scene_text

PAGE = (ROOT / "docs" / "audit.md").read_text(encoding="utf-8")


@pytest.fixture
def files(tmp_path):
    """A table of a shaken mass with a map, and its scene; the force of half the bearings."""
    data, scene = run_of(), shaken()
    names = [name for name in data.columns if not name.startswith("position")]
    table = np.column_stack([data.columns[name] for name in names])
    table[:, [names.index("force_1"), names.index("axial")]] *= 0.5e-3
    np.savetxt(tmp_path / "out.csv", table, delimiter=",", header=",".join(names), comments="", fmt="%.9g")
    units = {name: QUANTITIES[name][0] for name in names} | {"axial": "kN", "force_1": "kN"}
    columns = [f'{name} = "{name} [{unit}]"' for name, unit in units.items()]
    (tmp_path / "map.toml").write_text("\n".join(['mass = "204081.6 kg"', "[columns]", *columns]))
    (tmp_path / "scene.toml").write_text(scene_text(scene))
    return tmp_path


def test_what_is_inconsistent_is_printed_and_drawn(files, capsys):
    arguments = [
        "audit",
        str(files / "out.csv"),
        "--bearing",
        str(files / "scene.toml"),
        "--map",
        str(files / "map.toml"),
    ]
    assert main([*arguments, "--page", str(files / "audit.html")]) == 1
    printed = " ".join(capsys.readouterr().out.split())
    assert "inconsistent: weight; " in printed and "half of the bearings" in printed
    page = (files / "audit.html").read_text(encoding="utf-8")
    assert page.count("data:image/webp") >= 5 and "half of the bearings" in page
    assert main([*arguments, "--json"]) == 1
    found = {one["check"]: one for one in json.loads(capsys.readouterr().out)["findings"]}
    assert found["weight"]["verdict"] == "inconsistent" and found["weight"]["value"] == pytest.approx(0.5, rel=0.01)
    assert found["mass"]["verdict"] == "not decidable"


def test_a_preset_is_audited_against_itself(tmp_path, capsys):
    assert main(["run", "fenz-test3", "-o", str(tmp_path / "run.nc")]) == 0
    capsys.readouterr()
    assert main(["audit", str(tmp_path / "run.nc"), "--bearing", "fenz-test3"]) == 0
    assert "nothing inconsistent" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["out.csv", "--bearing", "no-such"], "no such file"),
        (["missing.csv", "--bearing", "fenz-test3", "--map", "map.toml"], "missing.csv"),
        (["out.csv", "--bearing", "hospital-ccc", "--map", "map.toml"], "not one bearing alone"),
        (["out.csv", "--bearing", "fenz-test3", "--map", "map.toml", "--page", "x.pdf"], "--page"),
    ],
)
def test_bad_input_is_one_line(files, capsys, monkeypatch, arguments, words):
    monkeypatch.chdir(files)
    assert main(["audit", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and words in error and error.count("\n") == 1


def test_the_page_lists_columns_and_checks():
    from msfp_gen.auditing.checks import CHECKS

    rows = set(re.findall(r"^\| `(\w+)`", PAGE, re.MULTILINE))
    assert set(CHECKS) <= rows
    listed = set(re.findall(r"`(\w+)`", "\n".join(re.findall(r"^\|.*", PAGE, re.MULTILINE))))
    surfaces = {f"{name}_{i}" for name in ("sliding", "slip_speed", "temperature") for i in range(2, 10)}
    between = {f"{name}_2" for name in ("acceleration", "position", "base_acceleration", "lower", "upper")}
    assert set(QUANTITIES) - listed <= surfaces | between


def test_the_example_of_the_page_prints_what_it_says(capsys):
    code = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)[0]
    exec(code, {})
    said = re.search(r"It prints `(.*?)`", PAGE)
    assert said and capsys.readouterr().out.strip() == said[1]


def test_a_shadow_is_printed_and_written(files, capsys):
    """The force of half the bearings: the axial force is half too, so the model follows it."""
    places = [str(files / "out.csv"), "--bearing", str(files / "scene.toml"), "--map", str(files / "map.toml")]
    assert main(["shadow", *places, "-o", str(files / "model.nc"), "--json", "--page", str(files / "shadow.html")]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["difference"] < 0.01 and found["missing"] == []
    assert found["model"]["status"] == "ok" and (files / "model.nc").exists()
    page = (files / "shadow.html").read_text(encoding="utf-8")
    assert page.count("data:image/webp") == 2 + len(found["differences"]) - 1  # a loop along E1, and every difference
    assert f"+- {100 * found['error']:.1g} %" in page and "differs by less tells nothing" in page
    for effect in found["left_out"]:
        assert effect in page
    assert main(["shadow", *places, "--page", str(files / "shadow.pdf")]) == 2
    assert "--page" in capsys.readouterr().err
