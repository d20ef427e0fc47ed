"""Values of a bearing, a motion or a building that are hardly meant are refused or named; published designs are not."""

from __future__ import annotations

import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import ROOT

from msfp_gen import (
    Bearing,
    InputError,
    Measurement,
    Motion,
    Scene,
    bound,
    changed_scene,
    fit,
    load_scene,
    presets,
    simulate,
    study,
)
from msfp_gen.buildings.notes import building_doubts, floors, notes_of, value_notes
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.cli import main
from msfp_gen.common.fields import to_si
from msfp_gen.scene.file.loader import scene_from_table, scene_text
from msfp_gen.scene.plausibility import (
    doubtful_values,
    doubts,
    refusals,
    require_meant,
    scene_doubts,
    target_doubts,
)
from msfp_gen.studies.bounding import load_factors
from msfp_gen.studies.estimation.estimate import estimate

HOSPITAL = "hospital-clc"


def building(changes: dict[str, Any]) -> BuildingScene:
    scene = changed_scene(HOSPITAL, changes)
    assert isinstance(scene, BuildingScene)
    return scene


def test_floors_are_those_that_were_given() -> None:
    """Also after the reduction to modes below 30 Hz: it keeps rigid motions."""
    made = floors(building({}).building)
    assert [floor.mass for floor in made] == pytest.approx([450e3, 380e3, 380e3, 330e3])
    assert [floor.gyration for floor in made] == pytest.approx(
        np.sqrt([27.4e6 / 450e3, *2 * [23.1e6 / 380e3], 20.1e6 / 330e3])
    )
    np.testing.assert_allclose([floor.centre for floor in made], [(0, 0), *3 * [(1.1, 0.75)]], atol=1e-9)


def doubts_of(scene: Any) -> list[str]:
    """The texts of all doubts, each once."""
    if isinstance(scene, Scene):
        return [text for *_, text in scene_doubts(scene)]
    of_bearings = [
        note.text
        for mount, load in zip(scene.bearings, scene.axial_loads, strict=True)
        for note in value_notes(mount, load)
    ]
    return list(dict.fromkeys([*(text for *_, text in building_doubts(scene)), *of_bearings]))


TEST, RECORD = "fenz-test2", "ridgecrest-clc"
MISTAKES: list[tuple[str, dict[str, Any], str, bool]] = [
    # scene, changes, words of the note, whether it is refused
    (TEST, {"top.axial_load": 112.0}, "the load at rest of 202.6 N is 0.0992 MPa on the smallest face", True),
    (TEST, {"top.axial_load": 112e6, "top.rotational_stiffness": 1e9}, "is 5.48e+04 MPa on the smallest face", True),
    (TEST, {"top.axial_load": 1120.0}, "is 0.593 MPa on the smallest face", False),
    (TEST, {"limits": {"displacement": 760}}, "limits.displacement = 760 m is 4.39e+03 times the capacity", True),
    (TEST, {"limits": {"displacement": 0.5}}, "limits.displacement = 0.5 m is 2.89 times the capacity", False),
    (TEST, {"limits": {"axial_load": 300}}, "limits.axial_load = 300 N is 0.00268 times the load", True),
    (TEST, {"limits": {"rim_force": 37.0}}, "limits.rim_force = 37 N is 0.00033 times the load", True),
    (TEST, {"limits": {"rim_force": 2e3}}, "limits.rim_force = 2000 N is 0.0178 times the load", False),
    (TEST, {"limits": {"rim_compression": 9.0}}, "limits.rim_compression = 9 m is 52 times the capacity", True),
    (TEST, {"limits": {"rim_compression": 0.1}}, "limits.rim_compression = 0.1 m is 0.578 times the", False),
    (TEST, {"limits": {"uplift_height": 10.0}}, "limits.uplift_height = 10 m is more than bearings open", True),
    (TEST, {"limits": {"uplift_height": 0.3}}, "limits.uplift_height = 0.3 m is more than bearings open", False),
    (TEST, {"bearing.gravity": 386.0}, "bearing.gravity = 386 m/s^2 is far from 9.81", False),
    (TEST, {"bearing.gravity": 9810.0}, "bearing.gravity = 9810 m/s^2 is far from 9.81", True),
    (TEST, {"top.stiffness": 2e5}, "top.stiffness = 200000 N/m is 0.84 times the stiffness of the bearing", False),
    (TEST, {"top.stiffness": 1e5}, "top.stiffness = 100000 N/m is 0.42 times the stiffness of the bearing", True),
    (TEST, {"bearing.bodies[1].mass": 20000.0}, "carries 1.12e+05 N, 0.57 of the weight of its own bodies", True),
    (TEST, {"bearing.bodies[1].mass": 8000.0}, "carries 1.12e+05 N, 1.4 of the weight of its own bodies", False),
    (TEST, {"bearing.bodies[1].height": 0.9}, "bearing.bodies[1].height = 0.9 m is 12 of the radius", True),
    (TEST, {"bearing.base_height": 0.4}, "bearing.base_height = 0.4 m is 0.85 of the radius", False),
    (TEST, {"bearing.bodies[3].height": 0.4}, "bearing.bodies[3].height = 0.4 m is 0.85 of the radius", False),
    (
        TEST,
        {"bearing.bodies[1].rim_radius": 0.05},
        "bodies[1].rim_radius = 0.05 m: at the capacity of surface 2",
        False,
    ),
    (TEST, {"bearing.surfaces[1].radius": 0.6}, "surfaces[1].radius = 0.6 m exceeds the radius of the surface", False),
    (TEST, {"bearing.surfaces[1].radius": 76.0}, "surfaces[1].radius = 76 m exceeds the radius of the surface", True),
    (TEST, {"bearing.surfaces[2].radius": 0.6}, "surfaces[2].radius = 0.6 m exceeds the radius of the surface", False),
    (TEST, {"bearing.surfaces[0].rim_stiffness": 1e4}, "surfaces[0].rim_stiffness = 10000 N/m stops no slider", True),
    (TEST, {"bearing.surfaces[0].rim_stiffness": 5e5}, "surfaces[0].rim_stiffness = 500000 N/m stops no", False),
    (TEST, {"bearing.surfaces[0].yield_displacement": 0.5}, "surfaces[0].yield_displacement = 0.5 m is more", True),
    (TEST, {"bearing.surfaces[0].yield_displacement": 0.02}, "surfaces[0].yield_displacement = 0.02 m is more", False),
    (TEST, {"bearing.surfaces[0].capacity": 6.5e-5}, "surfaces[0].capacity = 6.5e-05 m tilts the slider by", True),
    (TEST, {"bearing.surfaces[0].capacity": 6.5e-4}, "surfaces[0].capacity = 0.00065 m tilts the slider by", False),
    (TEST, {"bearing.base_height": 51.0}, "bearing.base_height = 51 m is 1.1e+02 of the radius", True),
    (TEST, {"bearing.surfaces[0].friction": 6.0}, "surfaces[0].friction = 6 is unusually high", False),
    (RECORD, {"motion.scale": 8.0}, "motion: the peak acceleration of 40", False),
    (RECORD, {"motion.scale": 8.0}, "motion.scale = 8 changes the record by more than is usual", False),
    (RECORD, {"motion.scale": 0.02}, "is 0.0103 g; are the unit of the record and motion.scale right?", False),
    (RECORD, {"motion.scale": 0.001}, "is 0.000517 g; are the unit of the record", True),
    (
        RECORD,
        {"motion.scale_to": {"sds": 0.5, "sd1": 0.3, "between": [0.5, 3.0]}},
        "'1.5 g' is a text with its unit",
        False,
    ),
    (
        HOSPITAL,
        {"building.base.mass": 450.0},
        "building.base.mass = 450 kg is 0.0017 of the mean of all floors",
        True,
    ),
    (
        HOSPITAL,
        {"building.storey[1].inertia": [7.1e6, 16e6, 380e3 * 200.0**2]},
        "building.storey[1].inertia: about E3 the radius of gyration is 200 m, the bearings are at most 27",
        False,
    ),
    (
        HOSPITAL,
        {"building.base.inertia": [8.4, 19.0, 27.4]},
        "building.base.inertia: about E3 the radius of gyration is 0.0078 m, the bearings are at most 27",
        True,
    ),
    (HOSPITAL, {"building.storey[0].stiffness": [3.6e5, 3.0e5]}, "under 0.1 g the storey drifts", True),
    (
        HOSPITAL,
        {"building.storey[2].height": 40.0},
        "storey[2].height = 40 m is unusually high; is it in m",
        False,
    ),
    (
        HOSPITAL,
        {"building.interface.vertical_stiffness": 1.7e6},
        "interface.vertical_stiffness = 1.7e+06 N/m: the building settles by 0.911 m at rest; is it in N/m",
        True,
    ),
    (
        HOSPITAL,
        {"building.damping_ratio": 0.5},
        "building.damping_ratio: the first mode on a fixed base has 0.5",
        False,
    ),
    (HOSPITAL, {"building.storey[2].height": 400.0}, "storey[2].height = 400 m is unusually high", True),
    (
        HOSPITAL,
        {"building.base.inertia": [8.4e12, 19.0e12, 27.4e12]},
        "building.base.inertia: about E3 the radius of gyration is 7.8e+03 m",
        True,
    ),
    (HOSPITAL, {"limits": {"rim_force": 420.0}}, "limits.rim_force = 420 N is 0.000", True),
    (
        HOSPITAL,
        {"building.storey[0].torsional_stiffness": 1e5},
        "the lowest frequency on a fixed base is 0",
        True,
    ),
    (
        HOSPITAL,
        {"building.base.inertia": [8.4e12, 19.0e12, 27.4e12]},  # in kg mm^2
        "on the vertical springs of its interfaces it rocks or heaves at 0.0",
        False,
    ),
    (HOSPITAL, {"limits": {"displacement": 760}}, "limits.displacement = 760 m is 1.1e+03 times the capacity", True),
]


@pytest.mark.parametrize(("name", "changes", "words", "refused"), MISTAKES, ids=lambda value: str(value)[:60])
def test_values_that_are_hardly_meant_are_named(name: str, changes: dict[str, Any], words: str, refused: bool) -> None:
    scene = changed_scene(name, changes)
    assert sum(words in text for text in doubts_of(scene)) == 1, doubts_of(scene)
    assert any(words in text for text in refusals(scene)) == refused


def test_a_grid_in_millimetres_is_refused() -> None:
    scene = load_scene(HOSPITAL)
    moved = [replace(mount, position=tuple(1e3 * x for x in mount.position or ())) for mount in scene.bearings]
    words = "building.bearing: two bearings are 2.704e+04 m apart; are their positions in m?"
    wide = replace(scene, bearings=tuple(moved))
    assert words in doubts_of(wide) and words in refusals(wide)


def test_a_bearing_with_ground_of_its_own_is_named_once() -> None:
    """Two bearings on one loud record and one on a louder: a line for peak and factor; the ground of the others."""
    scene, loud, louder = building({}), *(building({"motion.scale": scale}).motion for scale in (8.0, 9.0))
    grounds = [None, loud, loud, louder, *[None] * (len(scene.bearings) - 4)]
    own = replace(scene, bearings=[replace(b, motion=m) for b, m in zip(scene.bearings, grounds, strict=True)])
    found = [text for text in doubts(own) if "motion" in text]
    for text, word in zip(found, ("motion: the peak acceleration", "motion.scale = 8"), strict=True):
        assert text.startswith(f"{scene.label(1)}: {word}") and text.endswith("; the same holds for 2 other bearings")
    tables = [row for table in own.explain() for row in table.rows if "motion" in row[0] and row[0] in found]
    assert len(tables) == 2
    assert [text.partition(" = ")[0] for text in doubts(replace(own, motion=loud)) if text.startswith("motion.")] == [
        "motion.scale"
    ]
    every = replace(own, bearings=[replace(b, motion=scene.motion) for b in scene.bearings], motion=loud)
    assert not doubts(every)  # no bearing stands on the ground of the scene
    small = building({"motion.scale": 1e-3}).motion
    refused = refusals(replace(scene, bearings=[replace(b, motion=small) for b in scene.bearings]))
    assert len(refused) == 1 and refused[0].startswith(f"{scene.label(0)}: motion: the peak acceleration")


@pytest.mark.parametrize(
    ("name", "m", "p"),
    [
        (TEST, 3, 1), (TEST, 1, 3), ("quintuple-push", 4, 2), ("quintuple-push", 2, 4),
        ("double-articulated-push", 2, 1), ("single-articulated-push", 2, 0), ("single-articulated-push", 0, 2),
    ],
)  # fmt: skip
def test_m_and_p_against_the_order_of_the_surfaces_are_named(name: str, m: int, p: int) -> None:
    """By a doubt, or by an error, about the sliders, which then lie in other dishes."""
    table = tomllib.loads(scene_text(load_scene(name)))
    table["bearing"]["layout"].update(m=m, p=p)
    try:
        texts = doubts(scene_from_table(table))
    except InputError as error:
        texts = [str(error)]
    assert any("rim_radius" in text for text in texts), texts


def test_more_than_critical_damping_is_refused() -> None:
    """A file cannot give it as a ratio, but a building of matrices may have it."""
    scene = building({})
    damped = replace(scene, building=replace(scene.building, damping=30 * scene.building.damping))
    assert any("the first mode on a fixed base has 1.5 of critical damping" in text for text in refusals(damped))


def test_rims_that_no_run_models_are_not_judged() -> None:
    soft = {"bearings.isolator.rim_stiffness": 1e4}
    texts = {rims: refusals(building({**soft, "building.effects.rims": rims})) for rims in (True, False)}
    assert any("rim_stiffness = 10000 N/m stops no slider" in text for text in texts[True])
    assert not any("stops no slider" in text for text in texts[False])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"building.storey[0].height": 4000.0},
            r"building.storey\[0\].height = 4000 m: no storey is as high; is it in mm",
        ),
        (
            {"building.bearing[5].position": [-11.25, -7.5]},
            r"scene.bearings\[5\].position = \(-11.25, -7.5\): scene.bearings\[0\] is there too; give places apart",
        ),
        ({"building.bearing[5].name": "A1"}, r"scene.bearings\[5\].name = 'A1': scene.bearings\[0\] has it;"),
        (
            {"building.base.mass_centre": [90.0, 0.0]},
            r"in tension at rest .* the centre of mass of the building at \(27.*\) m is outside the bearings",
        ),
    ],
    ids=["height", "place", "name", "centre"],
)
def test_what_cannot_be_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        building(changes)


def scene_files(folder: Path) -> list[Path]:
    """The scenes below a folder; studies and suites are none."""
    tables = {path: tomllib.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.rglob("*.toml"))}
    return [path for path, table in tables.items() if {"bearing", "building"} & table.keys() and "motion" in table]


def test_no_published_design_is_blamed() -> None:
    for name in [
        *presets.names("scene"),
        *presets.names("building"),
        *map(str, scene_files(ROOT / "examples")),
    ]:
        scene = load_scene(name)
        assert not doubts_of(scene) and not refusals(scene), name
    for name in presets.names("bearing"):
        assert not list(doubtful_values(presets.bearing(name))), name


@pytest.mark.parametrize("dish", [0.6, 1.2, 1.6])
def test_the_joint_of_a_single_pendulum_is_not_blamed(dish: float) -> None:
    """No sheet states it: its capacity is a usual one, and more than its dish permits."""
    bearing = Bearing.from_sheet(
        device="single", radius=[2.2], height=[0.08], friction=[0.06], slider_diameter=[0.3], dish_diameter=[dish],
        axial_load=2e6,
    )  # fmt: skip
    assert not list(doubtful_values(bearing, 2e6))
    tilts = [surface.capacity / surface.radius for surface in bearing.surfaces]
    assert tilts[1] >= 1.2 * tilts[0]


def test_the_times_of_a_record_are_in_seconds(tmp_path: Any) -> None:
    path = tmp_path / "micro.csv"
    rows = [f"{5e-6 * i:.7g},{np.sin(2e-3 * np.pi * i):.6g}" for i in range(3001)]
    path.write_text("\n".join(["time [s],a1 [m/s^2]", *rows]))
    found = changed_scene("ridgecrest-clc", {"motion": {"kind": "record", "file": str(path), "correct": False}})
    assert any("the samples are 5e-06 s apart" in text for text in refusals(found))


@pytest.mark.parametrize(
    ("head", "scale", "words", "refused"),
    [
        ("time [s],a1 [g]", 0.1, "", False),
        (
            "time [s],a1 [g]",
            4.0,
            "acceleration of 39.2 m/s^2 is 4 g; is the unit of its samples right?",
            False,
        ),
        ("time [s],a1 [mm/s^2]", 0.1, "is 1.02e-05 g; is the unit of its samples right?", True),
        ("time [ms],a1 [g]", 0.1, "the samples are 5e-06 s apart", True),
        ("time [s],u1 [m]", 1e-5, "", False),
    ],
)
def test_a_file_of_accelerations_is_judged_as_a_record(
    head: str, scale: float, words: str, refused: bool, tmp_path: Any
) -> None:
    """By peak and step, whose remedy names no field of records; a file of displacements is not judged."""
    path, times = tmp_path / "motion.csv", np.arange(2001) * 0.005
    rows = [f"{t:.4f},{scale * np.sin(2 * np.pi * t):.6g}" for t in times]
    path.write_text("\n".join([head, *rows]))
    scene = changed_scene(TEST, {"motion": {"kind": "arrays", "file": str(path)}})
    found = [text for text in doubts_of(scene) if text.startswith("motion")]
    assert len(found) == bool(words) and all(words in text and "motion.scale" not in text for text in found)
    assert [text for text in refusals(scene) if text.startswith("motion")] == found * refused


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ({"sds": 1.5, "sd1": 0.9, "between": [0.5, 3.0]}, "scale_to.sds = 1.5 m/s^2 is 0.153 g; give the unit"),
        ({"sa": 0.6, "period": 1.0}, "scale_to.sa = 0.6 m/s^2 is 0.0612 g;"),
        ({"pga": 0.4}, "scale_to.pga = 0.4 m/s^2 is 0.0408 g;"),
        ({"ag": 0.25, "ground": "B", "between": [0.5, 3.0]}, "scale_to.ag = 0.25 m/s^2 is 0.0255 g;"),
        ({"sds": "0.15 g", "sd1": "0.09 g", "between": [0.5, 3.0]}, ""),
        ({"sa": "0.1 g", "period": 1.0}, ""),
        ({"pga": 4.0}, ""),
        ({"ag": 2.5, "ground": "B", "between": [0.5, 3.0]}, ""),
    ],
    ids=str,
)
def test_a_target_without_its_unit_is_named(target: dict[str, Any], words: str) -> None:
    """Of a scene of one bearing, of a building, and of a suite; also after a scene was written and read."""
    table = {"motion.scale_to": target, "motion.duration": 8.0}
    scenes = [changed_scene(name, table) for name in (RECORD, HOSPITAL)]
    scenes.append(scene_from_table(tomllib.loads(scene_text(scenes[0]))))
    for scene in scenes:
        found = [text for text in doubts(scene) if "scale_to" in text]
        assert len(found) == bool(words) and all(f"motion.{words}" in text for text in found)
    values = {name: to_si(value, "m/s^2") if isinstance(value, str) else value for name, value in target.items()
              if name != "ground"}  # fmt: skip
    assert [words in text for text in target_doubts(values)] == [True] * bool(words)


def test_what_is_refused_runs_if_it_is_told_to(tmp_path: Any, capsys: Any) -> None:
    path, out = tmp_path / "scene.toml", tmp_path / "out.nc"
    path.write_text(scene_text(changed_scene("fenz-test2", {"limits": {"displacement": 760.0}, "duration": 1.0})))
    assert main(["run", str(path), "-o", str(out)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "limits.displacement = 760 m" in error and "--force" in error and not out.exists()
    axis = '{multiplies = "bearing.friction", values = [1.0]}'
    (tmp_path / "study.toml").write_text(f'scene = "scene.toml"\nkeep = ["peak_force"]\naxes.f = {axis}\n')
    rows = [f"{0.05 * i:.2f},{0.02 * np.sin(0.05 * i):.6f},{1e4 * np.sin(0.05 * i):.3f}" for i in range(40)]
    (tmp_path / "test.csv").write_text("\n".join(["time [s],displacement [m],force [N]", *rows]))
    of_study = ["study", str(tmp_path / "study.toml"), "-o", str(tmp_path / "study")]
    of_fit = ["fit", str(path), str(tmp_path / "test.csv"), "-p", "bearing.surfaces[*].friction"]
    picture, page = ["-o", str(tmp_path / "a.png")], ["-o", str(tmp_path / "a.html")]
    running = [
        ["batch", str(path)], ["bound", str(path)], ["characterise", str(path)], ["plot", str(path), *picture],
        ["animate", str(path), "-o", str(tmp_path / "a.gif")], ["report", str(path), *page], of_study, of_fit,
        ["export", str(path), "-o", str(tmp_path / "a.csv")], ["explore", str(path), *page],
        ["explain", str(path), "--effects"], ["bench", "model-error", str(path)],
        ["bench", "work-precision", str(path)],
    ]  # fmt: skip
    for command in running:
        assert main(command) == 2 and "limits.displacement = 760 m" in capsys.readouterr().err, command
        words = ["study", "run"] if command is of_study else command[: 1 + (command[0] == "bench")]
        assert main([*words, "--help"]) == 0
        assert "--force" in capsys.readouterr().out, command
    assert {file.name for file in tmp_path.iterdir()} == {"scene.toml", "study.toml", "test.csv"}
    assert main(["export", str(path), "--force", "-o", str(tmp_path / "a.csv")]) == 0
    assert main(["characterise", str(path), "--force", "--json"]) == 0
    capsys.readouterr()
    assert main(["run", str(path), "--force", "-o", str(out)]) == 0 and out.is_file()
    assert "limits.displacement = 760 m" in capsys.readouterr().err


def test_functions_of_python_refuse_what_commands_refuse(tmp_path: Any) -> None:
    """Before anything is run or written; simulate names it in the notes of its result."""
    scene = changed_scene("fenz-test2", {"limits": {"displacement": 760.0}, "duration": 0.5})
    path = tmp_path / "scene.toml"
    path.write_text(scene_text(scene))
    axes = {"f": {"sets": "limits.displacement", "values": [0.2, 760.0]}}
    table = {"scene": str(path), "keep": ["peak_force"], "axes": axes}
    time = np.arange(0.0, 2.0, 0.05)
    measured = Measurement("test", time, 0.02 * np.sin(time), 1e4 * np.sin(time))
    calls = [
        lambda: bound(scene, load_factors("asce7")),
        lambda: fit(scene, [measured], ["bearing.surfaces[*].friction"]),
        lambda: study(table, tmp_path / "out"),
        lambda: estimate(table, tmp_path / "out", "peak_force", target=0.1),
    ]
    for call in calls:
        with pytest.raises(InputError, match=r"limits.displacement = 760 m is .* force=True"):
            call()
    assert not (tmp_path / "out").exists()
    require_meant(scene, force=True)
    with ThreadPoolExecutor(1) as executor:
        assert study(table, tmp_path / "out", executor=executor, force=True).failed == 0


def test_forces_beyond_the_load_are_named() -> None:
    """A bearing pushed far into its rims: the decisive note, in the print of the result; not where they just touch."""
    scene = changed_scene("fenz-test5", {})
    for amplitude, named in ((0.14, False), (0.18, True)):
        motion = Motion.harmonic(amplitude, frequency=0.1, cycles=1)
        result = simulate(replace(scene, motion=motion, output_step=1.7))  # its rows miss the peak
        (row,) = [note for note in result.notes if "times the load at rest" in note.text] or [None]
        assert (row is not None) == named == (result.summary["peak_force_ratio"] > 1)
        if row is not None:
            assert row.kind == "value" and "does a rim carry it" in str(result)
            assert row.value == pytest.approx(result.summary["peak_force"]["radial"], rel=1e-6)
            assert row.time == result.summary["times"]["peak_force"]["radial"]
            assert np.hypot(*result.history.top_force[:, :2].T).max() < 0.9 * row.value


def test_a_base_shear_beyond_the_weight_is_named() -> None:
    scene = building({})
    texts = {
        share: [note.text for note in notes_of(scene, (), 0.0, 0.0, (share * scene.weight, 2.0))]
        for share in (0.9, 1.1)
    }
    assert not any("the base shear" in text for text in texts[0.9])
    assert any(f"the base shear reaches {1.1 * scene.weight:.4g} N, 1.1 times the weight" in t for t in texts[1.1])


def test_a_single_bearing_has_no_plan() -> None:
    scene = building({})
    bearing = replace(scene.bearings[0], position=tuple(scene.mass_centre.tolist()))
    alone = replace(scene, bearings=[bearing])
    assert not [text for *_, text in building_doubts(alone) if "gyration" in text]
