"""Bounds, batches, sweeps and studies of a building: as of one bearing."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from msfp_gen import Auto, BuildingScene, Effects, InputError, bound, changed_scene, simulate, study
from msfp_gen.buildings import run as run_of_building
from msfp_gen.buildings.result import BuildingResult
from msfp_gen.cli import main
from msfp_gen.results.result import load_result
from msfp_gen.studies.bounding import bounded_scenes, load_factors
from msfp_gen.studies.bounding.runs import bounded_scene, bounding_tables, plot_bounds, write_quantities
from msfp_gen.studies.definition import load_study
from msfp_gen.studies.sweep import variations

TEXT = """
name = "slab"
duration = 0.24
output_step = "20 ms"

[building.base]
mass = "45 t"
inertia = [1.4e5, 1.4e5, 2.7e5]

[building.interface]
stiffness = 1e7
vertical_stiffness = 5e7
rotational_stiffness = 1e6

[bearings.corner]
preset = "fenz-tfp"
contact_damping = 1e-4

[[building.bearing]]
bearing = "corner"
position = [3, 2]

[[building.bearing]]
bearing = "corner"
position = [-3, 2]

[[building.bearing]]
bearing = "corner"
position = [0, -2]

[motion]
kind = "ramp"
acceleration = 2.0
duration = 0.3

"""
FRICTION = "building.bearing[*].bearing.surfaces[0].friction"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "slab.toml"
    file.write_text(TEXT, encoding="utf-8")
    return file


@cache
def alone(folder: Path, friction: float) -> BuildingResult:
    return simulate(changed_scene(folder / "slab.toml", {FRICTION: friction}))


def test_bounds_multiply_the_properties_of_every_bearing(path: Path, tmp_path: Path):
    scene = changed_scene(path, {})
    assert isinstance(scene, BuildingScene)
    found = bound(scene, load_factors("asce7"))
    assert found.succeeded and [case.name for case in found.cases] == ["lower", "nominal", "upper"]
    factors = found.lambdas["friction"]
    for case in found.cases:
        for one, given in zip(case.scene.bearings, scene.bearings, strict=True):
            wanted = [s.friction * f for s, f in zip(given.bearing.surfaces, factors[case.name], strict=True)]
            assert [surface.friction for surface in one.bearing.surfaces] == pytest.approx(wanted)
    shears = [case.result.summary["peak_force"]["radial"] for case in found.cases]
    assert shears[0] < shears[1] < shears[2] and found.quantities()["peak_force"]["upper"] == shears[2]
    assert found.governing()["peak_force"] == "upper"
    assert json.dumps(found.as_dict(), allow_nan=False) and all(table.text for table in bounding_tables(found))
    plot_bounds(found, tmp_path / "bounds.png")
    rows = list(csv.reader(write_quantities(found, tmp_path / "bounds.csv").read_text(encoding="utf-8").splitlines()))
    assert [row[0] for row in rows if "floor" in row[0]] == ["peak_floor_acceleration [m/s^2]"]
    words = [row[0] for table in bounding_tables(found) for row in table.rows]
    assert "peak base shear [kN]" in words and not any(word.startswith("peak force") for word in words)
    assert found.bearing == scene.bearings[0].bearing


def test_bearings_of_bounds_may_take_uplift_in_on_the_way():
    """All cases begin with it where any case needs it; the others keep their monitors, as in a run of its own."""
    scene = changed_scene("hospital-ccc", {"motion.scale": 1.5})
    cases = bounded_scenes(scene, load_factors("asce7"))
    alone = [[e.uplift for e in bounded_scene(scene, load_factors("asce7"), case).modelled] for case in cases]
    wanted = [any(lifts) for lifts in zip(*alone, strict=True)]
    assert any(wanted) and not all(wanted)
    for case in cases.values():
        assert [effects.uplift for effects in case.modelled] == wanted
        asked = [isinstance(one.effects, Auto) and one.effects.uplift is not False for one in case.bearings]
        assert all(asked) and {effects.friction for effects in case.modelled} == {"pvt"}
    given = replace(scene, bearings=[replace(one, effects=Effects()) for one in scene.bearings])
    assert all(case.modelled == given.modelled for case in bounded_scenes(given, load_factors("asce7")).values())


@pytest.mark.slow
def test_a_sweep_of_the_command_line(path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    table, folder = tmp_path / "sweep.csv", tmp_path / "runs"
    arguments = ["--vary", f"{FRICTION}=0.02,0.06", "--table", str(table), "-o", str(folder), "--workers", "1"]
    assert main(["batch", str(path), *arguments]) == 0
    assert "F [kN]" in capsys.readouterr().out and len(list(folder.iterdir())) == 2
    rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))
    assert [row[FRICTION] for row in rows] == ["0.02", "0.06"]
    peak = alone(path.parent, 0.06).summary["peak_force"]["radial"]
    assert float(rows[1]["peak_force [N]"]) == peak > float(rows[0]["peak_force [N]"])
    assert {"floor_acceleration_1 [m/s^2]", "bearing_displacement_3 [m]"} <= set(rows[0])
    assert not any(name.startswith("peak_sliding") for name in rows[0])
    assert main(["batch", str(path), "--vary", "building.bearing[7].name='x'"]) == 2
    assert "there are 3 of them" in capsys.readouterr().err


STUDY = """
name = "friction of a slab"
scene = "slab.toml"
keep = ["peak_force", "bearing_displacement"]

[quantities]
ratio = "peak_force / 441000"
slab = "peak(node_acceleration_base_u1) / 9.81"
corner = "last(axial_force_2) - least(axial_force_2)"
left = "least( sliding_3_4 ) + most(bearing_displacement_3_E1)"

[axes.mu]
multiplies = "building.bearing[*].bearing.friction"
surfaces = [1, 4]
values = [0.8, 1.2]

[axes.soft]
sets = "building.interface.vertical_stiffness"
values = ["50 MN/m"]

[axes.second]
sets = "building.bearing[1].bearing.surfaces[1].friction"
values = [0.02]
"""


def test_a_study_takes_a_building(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    parquet = pytest.importorskip("pyarrow.parquet")
    file = tmp_path / "study.toml"
    file.write_text(STUDY, encoding="utf-8")
    found = load_study(file)
    scene = found.scene(2)
    assert isinstance(scene, BuildingScene) and found.runs == 2
    assert [s.friction for s in scene.bearings[0].bearing.surfaces] == pytest.approx([0.036, 0.017, 0.017, 0.1284])
    assert scene.bearings[1].bearing.surfaces[1].friction == 0.02
    assert scene.bearings[2].interface.vertical_stiffness == 5e7
    monkeypatch.setattr("msfp_gen.buildings.run.BEARINGS_OF_A_THREAD", 1)
    real, threads = run_of_building._threads, []
    monkeypatch.setattr(run_of_building, "_threads", lambda *given: threads.append(real(*given)) or threads[-1])
    outcome = study(file, tmp_path / "runs", workers=1)
    assert threads == [1, 1], "workers of a study may be anywhere, so that a run takes one core"
    assert outcome.runs == outcome.done == 2 and outcome.failed == 0
    rows = parquet.read_table(next((tmp_path / "runs").glob("part-*.parquet"))).to_pydict()
    run = simulate(scene)
    wanted = run.summary
    assert rows["peak_force"][1] == wanted["peak_force"]["radial"] > rows["peak_force"][0]
    assert rows["bearing_displacement_3"][1] == wanted["bearings"][2]["peak_displacement"]["radial"]
    assert rows["slab"][1] == np.abs(run.node("base")[:, 2, 0]).max() / 9.81
    assert rows["corner"][1] == run.axial_force[-1, 1] - run.axial_force[:, 1].min() > 0
    assert rows["left"][1] == run.sliding[:, 2, 3].min() + run.bearings[2].history.displacement[:, 0].max() > 0
    assert rows["ratio"][1] == pytest.approx(rows["peak_force"][1] / 441000)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("bearing[*]", "bearing[5]", r"axes\.mu.*there are 3 of them; give an index from 0 to 2"),
        ("surfaces = [1, 4]", "surfaces = [7]", "this bearing has surfaces 1 to 4"),
        ('"peak_force",', '"peak_sliding",', "'peak_sliding' is no quantity"),
        ("peak_force / 441000", "peak(displacement_E1)", "'displacement_E1' is no column of a history"),
        ("node_acceleration_base_u1", "node_acceleration_base_u7", "did you mean 'node_acceleration_base_u"),
        ("sliding_3_4", "sliding_4_4", "'sliding_4_4' is no column of a history"),
        ('"building.interface.vertical_stiffness"', '"building.interfaces.stiffness"', "interfaces: unknown key"),
    ],
)
def test_messages_of_studies(path: Path, tmp_path: Path, old, new, message):
    assert old in STUDY
    file = tmp_path / "study.toml"
    file.write_text(STUDY.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_study(file)


OWN = '[building.bearing.motion]\nkind = "ramp"\nacceleration = 1.0\nduration = 0.3\n'
SUITE = '[[records]]\nname = "ccc"\nbundled = "ridgecrest-2019-ci-ccc"\n'
RECORDS = '[records]\nmotions = [{ name = "ccc", bundled = "ridgecrest-2019-ci-ccc" }]\nscales = [1.0, 2.0]\n'


@pytest.mark.parametrize("bearings", [1, 3])
@pytest.mark.parametrize("command", ["batch", "bound", "study"])
def test_records_are_refused_below_bearings_with_motions_of_their_own(path, tmp_path, command, bearings, capsys):
    """Records and scales change the motion of the scene, which such a bearing does not have."""
    suite, definition = tmp_path / "suite.toml", tmp_path / "study.toml"
    path.write_text(_own(bearings))
    suite.write_text(SUITE)
    definition.write_text(f'scene = "slab.toml"\n{RECORDS}')
    given = [str(definition), "-o", str(tmp_path / "out")] if command == "study" else [str(path), "--suite", str(suite)]
    assert main([command, *given]) == 2
    words = " ".join(capsys.readouterr().err.split())
    assert "building.bearing[0].motion: this bearing has a motion of its own, and records" in words
    assert not (tmp_path / "out").exists()


def test_a_motion_that_no_bearing_has_is_no_axis(path: Path):
    fields = [("motion.acceleration", [1.0, 2.0])]
    path.write_text(_own(2))
    assert len(variations(path, fields)) == 2  # the third bearing moves with the scene
    path.write_text(_own(3))
    with pytest.raises(InputError, match=r"building\.bearing\[0\]\.motion: .*no bearing is left on the motion of the "):
        variations(path, fields)


def _own(bearings: int) -> str:
    """The scene with motions of their own below so many bearings."""
    head, *rows = TEXT.split("[[building.bearing]]")
    *rows, last = rows
    last, motion = last.split("[motion]")
    rows = [row + OWN * (index < bearings) for index, row in enumerate([*rows, last])]
    return "[[building.bearing]]".join([head, *rows]) + "\n[motion]" + motion


def test_commands_take_a_building(path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    out = tmp_path / "out.nc"
    assert main(["run", str(path), "-o", str(out), "--plot", str(tmp_path / "plot.png"), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["peak_force"] == load_result(out).summary["peak_force"]
    assert main(["explain", str(path)]) == 0 and "all bearings: effects selected" in capsys.readouterr().out
    assert main(["characterise", str(out)]) == 0 and "isolation system of slab" in capsys.readouterr().out
    assert main(["plot", str(out), "--figure", "plan", "-o", str(tmp_path / "plan.svg")]) == 0
    assert main(["animate", str(out), "-o", str(tmp_path / "m.gif"), "--seconds", "0.5", "--rate", "4"]) == 0
    assert (tmp_path / "m.gif").read_bytes().startswith(b"GIF8")
    assert main(["export", str(out), "-o", str(tmp_path / "n.csv"), "--columns", "axial_force"]) == 0
    assert "axial_force_3 [N]" in (tmp_path / "n.csv").read_text(encoding="utf-8")
    assert main(["run", str(path)]) == 0 and "peaks of bearings" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["animate", "-o", "x.gif", "--end", "9"], "time = 9 s: the run holds 0 to 0.24 s"),
        (["fit", "test.csv", "--parameters", "bearing.friction"], "give a scene of one bearing here"),
        (["plot", "--figure", "loops"], "--figure = 'loops': give one of overview, plan"),
    ],
)
def test_what_a_building_has_not_is_said_in_one_line(path, arguments, words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command, *options = arguments
    assert main([command, str(path), *options]) == 2
    err = capsys.readouterr().err
    assert words in err and err.count("\n") == 1
    assert sorted(each.name for each in tmp_path.iterdir()) == ["slab.toml"]
