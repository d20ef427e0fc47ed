"""The scenes in examples/: they load, they run, and the bearings in them are those of the presets."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from support import ROOT, thinned

from msfp_gen import BuildingScene, load_scene, presets, simulate

EXAMPLES = ROOT / "examples"
BEARINGS = {
    "single": "single-articulated-fp",
    "double": "double-fp",
    "triple": "fenz-tfp",
    "quintuple": "quintuple-fp",
    "heating": "single-articulated-fp",
}


def test_one_example_for_each_kind():
    assert {path.stem for path in EXAMPLES.glob("*.toml")} == set(BEARINGS)


@pytest.mark.parametrize("name", BEARINGS)
def test_bearing_is_the_preset(name):
    found, expected = load_scene(EXAMPLES / f"{name}.toml").bearing, presets.bearing(BEARINGS[name])
    assert found.layout == expected.layout
    for key, values in expected.arrays().items():
        np.testing.assert_allclose(found.arrays()[key], values, rtol=1e-12, err_msg=key)


@pytest.mark.parametrize("name", thinned(BEARINGS, lambda name: name in ("single", "double")))
def test_example_runs_as_its_name_says(name):
    scene = load_scene(EXAMPLES / f"{name}.toml")
    assert scene.name == name
    result = simulate(scene)
    amplitude = float(str(scene.motion.metadata["amplitude"]))
    assert result.succeeded
    assert result.summary["peak_displacement"]["radial"] == pytest.approx(amplitude, rel=0.01)
    assert result.summary["energy"]["closure_error"] < 5e-3
    assert result.summary["rims_met"] == ([1, 6] if name == "quintuple" else [])


@pytest.mark.parametrize("name", BEARINGS)
def test_command_in_the_header_is_right(name):
    text = (EXAMPLES / f"{name}.toml").read_text(encoding="utf-8")
    assert f"#     msfp-gen run examples/{name}.toml --plot {name}.png\n" in text


@pytest.mark.slow
def test_the_example_of_a_building_stays_within_the_limits_of_its_bearings() -> None:
    path = EXAMPLES / "building" / "building.toml"
    scene = load_scene(path)
    assert isinstance(scene, BuildingScene)
    result = simulate(replace(scene, duration=12.0))
    assert result.succeeded and not result.notes and not result.verdict.exceeded
    assert f"#     msfp-gen run {path.relative_to(ROOT)} --plot building.png\n" in path.read_text(encoding="utf-8")


def output_of(name: str) -> str:
    """What an example with a library prints."""
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    environment = {**os.environ, "MPLBACKEND": "agg", "PYTHONPATH": path}
    command = [sys.executable, str(EXAMPLES / "libraries" / f"{name}.py")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_indices_by_salib() -> None:
    """Test 1 is a cycle of constant friction: the peak force is friction times load, and a little by the radii."""
    pytest.importorskip("SALib")
    found = dict(re.findall(r"^(\w+) +first order -?[\d.]+, total ([\d.]+)$", output_of("sobol"), re.MULTILINE))
    friction, radius, load = (float(found[name]) for name in ("friction", "radius", "load"))
    assert friction > load > 3 * radius and 0.9 < friction + radius + load < 1.3


def test_front_by_pymoo() -> None:
    """No design of the front is worse than another in both objectives."""
    pytest.importorskip("pymoo")
    rows = re.findall(r": +([\d.]+) mm, +([\d.]+) kN$", output_of("pareto"), re.MULTILINE)
    displacement, force = np.array(rows, dtype=float).T
    assert len(rows) > 3 and np.all(np.diff(displacement) >= 0) and np.all(np.diff(force) <= 0)
    assert force[0] > 1.2 * force[-1]
