"""Buildings in TOML files: the same scene as in Python, and messages that name the field."""

from __future__ import annotations

import re
import tomllib
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
from scipy.io import mmwrite
from support import ROOT
from support.buildings import PLACES

from msfp_gen import (
    Auto,
    BaseSlab,
    Building,
    BuildingScene,
    Effects,
    InputError,
    Scene,
    Soil,
    Storey,
    Top,
    changed_scene,
    load_scene,
    presets,
)
from msfp_gen.buildings.file import building_from_table, with_single_bearings
from msfp_gen.scene.file.source import load_bearing_scene, with_absolute_paths
from msfp_gen.studies import load_study

TEXT = """
name = "one storey"
duration = 1.0

[building]
damping_ratio = "5 %"

[building.base]
mass = "24 t"
inertia = [1.4e5, 1.4e5, 2.7e5]

[[building.storey]]
height = "3 m"
mass = "12 t"
inertia = [6e4, 6e4, 1.2e5]
stiffness = "9 kN/mm"
torsional_stiffness = 1.8e8
mass_centre = ["0.3 m", "10 cm"]

[building.interface]
stiffness = 1e7
vertical_stiffness = 5e7
rotational_stiffness = 1e6

[bearings.corner]
preset = "fenz-tfp"
contact_damping = 1e-4

[[building.bearing]]
bearing = "corner"
position = ["3 m", "2 m"]

[[building.bearing]]
bearing = "corner"
position = ["-3 m", "2 m"]
effects = {uplift = true}

[[building.bearing]]
bearing = "corner"
position = ["-3 m", "-2 m"]
interface = {stiffness = 2e7, vertical_stiffness = 5e7, rotational_stiffness = 1e6}

[[building.bearing]]
bearing = "fenz-tfp"
position = ["3 m", "-2 m"]
name = "last"

[motion]
kind = "harmonic"
amplitude = "50 mm"
frequency = 0.6

[solver]
max_step = "10 ms"
"""


def written(folder: Path, text: str = TEXT) -> Path:
    path = folder / "building.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_gives_the_scene_of_python(tmp_path: Path):
    scene = load_scene(written(tmp_path))
    storey = Storey(3.0, 12e3, (6e4, 6e4, 1.2e5), 9e6, 1.8e8, (0.3, 0.1))
    building = Building.shear(BaseSlab(24e3, (1.4e5, 1.4e5, 2.7e5)), [storey], 0.05)
    for name in ("mass", "damping", "stiffness"):
        assert np.array_equal(getattr(scene.building, name), getattr(building, name))
    corner = presets.bearing("fenz-tfp").replace(contact_damping=1e-4)
    assert [each.bearing for each in scene.bearings] == [*3 * [corner], presets.bearing("fenz-tfp")]
    assert [each.position for each in scene.bearings] == list(PLACES)
    assert scene.bearings[0].interface == Top.node(1e7, 5e7, 1e6) != scene.bearings[2].interface
    assert scene.bearings[1].effects == Auto(uplift=True) and scene.bearings[0].effects is None
    assert scene.modelled == (Effects(), Effects(uplift=True), Effects(), Effects())
    assert (scene.solver.max_step, scene.end, scene.name, scene.label(3)) == (
        0.01,
        1.0,
        "one storey",
        "bearing 4 (last)",
    )


def test_a_reduced_frame(tmp_path: Path):
    text = TEXT.replace('damping_ratio = "5 %"', 'damping_ratio = "5 %"\nhighest_frequency = "5.5 Hz"')
    sizes = [len(load_scene(written(tmp_path, each)).building.mass) for each in (TEXT, text)]
    assert sizes == [9, 8]  # without the mode of torsion


MATRICES = """
mass = "mass.mtx"
stiffness = "frame.npz"
damping_ratio = "5 %"

[[building.node]]
name = "base"
coordinates = [0, 1, 2, 3, 4, 5]
position = [0, 0, 0]
"""


def with_matrices(folder: Path) -> str:
    """The same building by the files of its matrices."""
    building = load_scene(written(folder)).building
    mmwrite(folder / "mass.mtx", building.mass, precision=17)
    np.savez(folder / "frame.npz", stiffness=building.stiffness)
    start, end = TEXT.index('damping_ratio = "5 %"'), TEXT.index("[building.interface]")
    return TEXT[:start] + MATRICES + TEXT[end:]


def test_matrices_from_files(tmp_path: Path):
    frame = load_scene(written(tmp_path))
    scene = load_scene(written(tmp_path, with_matrices(tmp_path)))
    for name in ("mass", "stiffness", "damping"):
        wanted = getattr(frame.building, name)
        assert np.abs(getattr(scene.building, name) - wanted).max() < 1e-12 * np.abs(wanted).max()
    assert scene.axial_loads == pytest.approx(frame.axial_loads, rel=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('stiffness = "frame.npz"', "", r"building\.stiffness is missing: give the path of a \.mtx or \.npz file"),
        ('"mass.mtx"', '"none.mtx"', r"building\.mass = '.*none\.mtx': cannot be read .*check the file"),
        ('"mass.mtx"', '"../mass.mtx"', r"building\.mass = '\.\./mass\.mtx': outside the folder of the scene file"),
        ("[0, 1, 2, 3, 4, 5]", "[0, 1, 2, 3, 4]", r"building\.node\[0\]\.coordinates = .*: give 6 whole numbers"),
        ("[0, 1, 2, 3, 4, 5]", "[0, 1, 2, 3, 4, 99]", r"building\.nodes\['base'\]: .* outside of 0"),
        ("[[building.node]]", "[building.base]\nmass = 1\ninertia = [1, 1, 1]\n\n[[building.node]]", "not together"),
    ],
)
def test_messages_of_matrices(tmp_path: Path, old, new, message):
    text = with_matrices(tmp_path)
    assert old in text
    with pytest.raises(InputError, match=rf"building\.toml: .*{message}"):
        load_scene(written(tmp_path, text.replace(old, new)))


def test_common_effects_and_those_of_one_bearing():
    given = table()
    given["building"]["effects"] = {"rims": False}
    scene = building_from_table(given)
    assert [each.rims for each in scene.modelled] == [False, True, False, False]
    given["building"]["effects"] = {"dimension": "planar"}
    del given["building"]["bearing"][1]["effects"]
    with pytest.raises(InputError, match="planar"):
        building_from_table(given)


def test_one_opener_for_scenes_and_buildings():
    assert isinstance(load_scene("hospital-ccc"), BuildingScene) and isinstance(load_scene("fenz-test1"), Scene)
    with pytest.raises(InputError, match=r"hospital-ccc.*give a scene of one bearing"):
        load_bearing_scene("hospital-ccc")
    with pytest.raises(InputError, match="did you mean 'hospital-c"):
        load_scene("hospital-cc")


def test_soil_below_bearings_is_in_series_with_their_interfaces():
    given = table()
    given["building"]["soil"] = {"stiffness": 4e7, "vertical_stiffness": "200 kN/mm", "damping": 4e4}
    given["building"]["bearing"][2]["soil"] = {"stiffness": 2e7, "vertical_stiffness": 5e7}
    scene = building_from_table(given)
    assert scene.bearings[0].interface == Top.node(8e6, 4e7, 1e6, damping=4e4 * 0.2**2)
    assert scene.bearings[2].interface == Top.node(1e7, 2.5e7, 1e6)
    own = Soil(4e7, 2e8, 4e4, 4e5)
    # Where damping over stiffness is the same of both, dampers in series have that ratio too.
    both = own.below(Top.node(1e7, 5e7, 1e6, damping=1e4, vertical_damping=1e5, rotational_damping=3.0))
    wanted = Top.node(8e6, 4e7, 1e6, damping=8e3, vertical_damping=8e4, rotational_damping=3.0)
    assert list(vars(both).values()) == pytest.approx(list(vars(wanted).values()), rel=1e-14)


def table() -> dict:
    return deepcopy(tomllib.loads(TEXT))


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("building.base.mass", -1, r"building\.base\.mass = -1: give a finite number above 0"),
        ("building.storey.0.mass", "12 m", r"building\.storey\[0\]\.mass = '12 m': .* unit of \[kg\]"),
        ("building.storey.0.vertical_stiffness", 1.0, r"^building\.storey\[0\]\.vertical_stiffness = 1\.0: columns"),
        ("building.storey.0.heigth", 3.0, r"building\.storey\[0\]\.heigth: unknown key.*height"),
        ("building.dampign_ratio", 3.0, r"building\.dampign_ratio: unknown key.*damping_ratio"),
        ("building.damping_ratio", 2.0, r"building\.damping_ratio = 2\.0: give"),
        (
            "building.bearing.0.bearing",
            "cornre",
            r"^building\.bearing\[0\]\.bearing = 'cornre': no preset .* \[bearings\] has corner",
        ),
        ("building.bearing.0.node", "roof", r"bearings\[0\]\.node = 'roof'"),
        ("building.bearing.0.position", [1.0], r"building\.bearing\[0\]\.position = \[1\.0\]: give 2"),
        ("building.bearing.2.interface.stiffness", 0.0, r"building\.bearing\[2\]\.interface\.stiffness = 0\.0"),
        ("bearings.corner.friction", "x", r"bearings\.corner\.friction = 'x'"),
        ("motion.kind", "harmonics", r"motion\.kind = 'harmonics': give one of"),
        ("building.highest_frequency", 0.0, r"building\.highest_frequency = 0\.0: give"),
        ("top", {}, "top: unknown key"),
        (
            "building.soil",
            {"stiffness": 1e8, "vertical_stiffness": 1e8, "rotational_stiffness": 1e9},
            r"building\.bearing\[0\]\.soil\.rotational_stiffness = 1e\+09: the lower plate .* leave it out",
        ),
        (
            "building.bearing.1.soil",
            {"stiffness": 1e8, "vertical_stiffness": 1e8, "mass": "20 t"},
            r"building\.bearing\[1\]\.soil\.mass = 20000: a foundation .* has no inertia; leave it out",
        ),
        ("building.soil", {"stiffness": 1e8}, r"building\.soil\.vertical_stiffness"),
        *(
            (f"{table}motion", motion, "^" + re.escape(f"{table.replace('.0', '[0]')}motion.{words}"))
            for table in ("", "building.bearing.0.")
            for motion, words in (
                ({"kind": "harmonic", "amplitde": 0.1}, "amplitde: unknown key; did you mean 'amplitude'?"),
                ({"kind": "harmonic"}, "amplitude is missing: give a finite number above 0 [m]"),
                ({"kind": "ramp", "rotation": {"kind": "ramp", "angel": 1.0}}, "rotation.angel: unknown key"),
            )
        ),
    ],
)
def test_messages_name_the_field(path, value, message):
    given = table()
    *parents, last = path.split(".")
    inner = given
    for name in parents:
        inner = inner[int(name) if name.isdigit() else name]
    inner[last] = value
    with pytest.raises(InputError, match=message):
        building_from_table(given)


def test_a_missing_interface_is_named():
    given = table()
    del given["building"]["interface"]
    with pytest.raises(InputError, match=r"building\.bearing\[0\]\.interface is missing: .*\[building\.interface\]"):
        building_from_table(given)


def test_messages_of_files_name_them(tmp_path: Path):
    with pytest.raises(InputError, match="no such file"):
        load_scene(tmp_path / "none.toml")
    path = written(tmp_path, TEXT.replace('mass = "24 t"', "mass = 0"))
    with pytest.raises(InputError, match=r"building\.toml: building\.base\.mass = 0: give"):
        load_scene(path)


def test_examples_of_the_page(tmp_path: Path):
    page = (ROOT / "docs" / "buildings.md").read_text(encoding="utf-8")
    names: dict = {}
    exec("\n".join(re.findall(r"```python\n(.*?)```", page, re.DOTALL)), names)
    assert names["result"].axial_force.min() > 0 and names["scene"].axial_loads.sum() == pytest.approx(900e3 * 9.8)
    (text,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    scene = load_scene(written(tmp_path, text))
    assert len(scene.bearings) == 4 and scene.axial_loads.sum() == pytest.approx(500e3 * 9.8)


GRID = """
[[building.bearing]]
bearing = "corner"
grid = { x = [-3.0, "0 m", "3000 mm"], y = ["-2 m", 2.0] }
"""
HEAD, TAIL = TEXT[: TEXT.index("[[building.bearing]]")], TEXT[TEXT.index("[motion]") :]


def test_a_grid_is_a_bearing_at_every_crossing(tmp_path: Path):
    found = load_scene(written(tmp_path, HEAD + GRID + TAIL))
    assert [(each.name, each.position) for each in found.bearings] == [
        *zip(("A1", "B1", "C1"), ((-3, -2), (0, -2), (3, -2)), strict=True),
        *zip(("A2", "B2", "C2"), ((-3, 2), (0, 2), (3, 2)), strict=True),
    ]
    assert len({each.bearing for each in found.bearings}) == 1
    assert found.bearings[0].interface == Top.node(1e7, 5e7, 1e6)


def test_lines_of_a_grid_go_on_after_z_and_names_begin_with_that_of_the_row(tmp_path: Path):
    """Seventy bearings in one table."""
    row = {"bearing": "fenz-tfp", "name": "N-", "grid": {"x": [7.5 * i for i in range(35)], "y": [-3.0, 3.0]}}
    rows = with_single_bearings({"bearing": [row]})["bearing"]
    assert len(rows) == 70
    assert [rows[index]["name"] for index in (25, 26, 69)] == ["N-Z1", "N-AA1", "N-AI2"]
    assert rows[69]["position"] == [255.0, 3.0] and "grid" not in rows[0]


def test_paths_lead_to_single_bearings_of_a_grid(tmp_path: Path):
    path = written(tmp_path, HEAD + GRID + TAIL)
    changed = changed_scene(path, {"building.bearing[4].name": "mid", "building.bearing[*].interface.stiffness": 2e7})
    assert [each.name for each in changed.bearings] == ["A1", "B1", "C1", "A2", "mid", "C2"]
    assert {each.interface.stiffness for each in changed.bearings} == {2e7}
    assert changed_scene("hospital-clc", {"building.bearing[5].name": "x"}).bearings[5].position == (-3.75, 0.0)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ({"grid": {"x": [0.0]}}, r"building\.bearing\[0\]\.grid\.y is missing"),
        ({"grid": {"x": [0.0], "y": []}}, r"building\.bearing\[0\]\.grid = .*: give at least one line along each axis"),
        ({"grid": {"x": ["3 kg"], "y": [0.0]}}, r"building\.bearing\[0\]\.grid\.x = \['3 kg'\]: .* unit of \[m\]"),
        ({"grid": {"x": [0.0], "y": [0.0]}, "position": [0, 0]}, r"bearing\[0\]\.position: the grid has all places"),
        ({"grid": {"x": [0.0, 0.0], "y": [0.0]}}, r"scene.bearings\[1\]\.position = .*: scene.bearings\[0\] is there"),
        ({"grid": 3}, r"building\.bearing\[0\]\.grid = 3: give a table"),
    ],
)
def test_grids_that_are_none_are_named(row, message):
    given = table()
    given["building"]["bearing"] = [{"bearing": "fenz-tfp", **row}]
    with pytest.raises(InputError, match=message):
        building_from_table(given)


def test_files_of_a_table_are_found_wherever_they_are_named(tmp_path: Path):
    """A study names them all, and resolves them before its workers start elsewhere."""
    for name in ("ground.csv", "corner.csv", "M.mtx", "K.mtx"):
        (tmp_path / name).write_text("", encoding="utf-8")
    rows = [{"motion": {"kind": "file", "file": "corner.csv"}}, {}]
    given = {"motion": {"file": "ground.csv"}, "building": {"mass": "M.mtx", "stiffness": "K.mtx", "bearing": rows}}
    found = with_absolute_paths(given, tmp_path)
    assert found["motion"]["file"] == str(tmp_path / "ground.csv")
    assert [found["building"][name] for name in ("mass", "stiffness")] == [str(tmp_path / f"{x}.mtx") for x in "MK"]
    assert found["building"]["bearing"][0]["motion"]["file"] == str(tmp_path / "corner.csv")
    assert rows[0]["motion"]["file"] == "corner.csv"  # the table itself stays


def test_the_spacing_of_a_grid_is_an_axis_of_a_study(tmp_path: Path):
    """Positions of all its bearings are multiplied, along both axes or along one."""
    path = written(tmp_path, HEAD + GRID + TAIL)
    before = np.array([each.position for each in load_scene(path).bearings])
    for field, factors in (("position", (1.2, 1.2)), ("position[0]", (1.2, 1.0))):
        axis = {"multiplies": f"building.bearing[*].{field}", "values": [1.0, 1.2]}
        study = load_study({"scene": str(path), "keep": ["peak_displacement"], "axes": {"spacing": axis}})
        first, second = (np.array([each.position for each in study.scene(run).bearings]) for run in (1, 2))
        np.testing.assert_array_equal(first, before)
        np.testing.assert_allclose(second, before * factors, rtol=1e-12)
