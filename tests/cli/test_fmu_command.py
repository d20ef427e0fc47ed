"""`msfp-gen fmu`: what it refuses before it builds anything."""

from __future__ import annotations

from pathlib import Path

import pytest

from msfp_gen import cli

RIG = """
bearing = "fenz-tfp"
motion = { kind = "ramp", acceleration = 0.002, duration = 1.0 }
"""
STIFF = """
top = { kind = "rig", axial_load = 1e5, stiffness = 1e7, rotational_stiffness = 1e6, vertical_stiffness = 5e7 }
"""
MASS = 'top = { kind = "mass", mass = 11e3, inertia = 5e3, height = 0.5 }\n'


@pytest.mark.parametrize(
    "scene, options, words",
    [
        (STIFF, ["-o", "bearing.zip"], "--output = 'bearing.zip': give a name that ends in .fmu"),
        (STIFF, ["-o", "b.fmu", "--fmi", "4"], "--fmi = 4: give one of 2, 3"),
        (STIFF, ["-o", "b.fmu", "--type", "sd"], "--type = 'sd': give one of cs, me"),
        (STIFF, ["-o", "b.fmu", "--type", "me"], "Model Exchange is of a supported mass"),
        ('top = { kind = "prescribed", force = [0, 0, -1e5] }\n', ["-o", "b.fmu"], "top.kind = 'prescribed'"),
        (STIFF.replace("1e7", "0.0"), ["-o", "b.fmu"], "stiffness"),
        (MASS + 'effects = { dimension = "planar" }\n', ["-o", "b.fmu"], "give 'spatial' and 'locked'"),
        (
            MASS + 'effects = { sliders = "massless" }\n',
            ["-o", "b.fmu", "--type", "me"],
            "give 'inertial' and no uplift",
        ),
        (MASS + 'solver = { method = "dopri5" }\n', ["-o", "b.fmu"], "give 'implicit' or 'esdirk4'"),
        (MASS + 'load = { kind = "constant", force = [1e3, 0.0, 0.0] }\n', ["-o", "b.fmu"], "load: the ends"),
    ],
)
def test_what_it_refuses(
    scene: str,
    options: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(RIG + scene, encoding="utf-8")
    assert cli.main(["fmu", "scene.toml", *options]) == 2
    message = capsys.readouterr().err
    assert words in message and len(message.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]
