"""Buildings in TOML files: the same scene as in Python, and messages that name the field."""

from __future__ import annotations

import re
import tomllib
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
from support import ROOT
from support.buildings import PLACES

from msfp_gen import BaseSlab, Building, Effects, InputError, Storey, Top, load_building, presets
from msfp_gen.buildings.file import building_from_table

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
    scene = load_building(written(tmp_path))
    storey = Storey(3.0, 12e3, (6e4, 6e4, 1.2e5), 9e6, 1.8e8, (0.3, 0.1))
    building = Building.shear(BaseSlab(24e3, (1.4e5, 1.4e5, 2.7e5)), [storey], 0.05)
    for name in ("mass", "damping", "stiffness"):
        assert np.array_equal(getattr(scene.building, name), getattr(building, name))
    corner = presets.bearing("fenz-tfp").replace(contact_damping=1e-4)
    assert [each.bearing for each in scene.bearings] == [*3 * [corner], presets.bearing("fenz-tfp")]
    assert [each.position for each in scene.bearings] == list(PLACES)
    assert scene.bearings[0].interface == Top.node(1e7, 5e7, 1e6) != scene.bearings[2].interface
    assert scene.bearings[1].effects == Effects(uplift=True) and scene.bearings[0].effects is None
    assert (scene.solver.max_step, scene.end, scene.name, scene.label(3)) == (
        0.01,
        1.0,
        "one storey",
        "bearing 4 (last)",
    )


def test_a_reduced_frame(tmp_path: Path):
    text = TEXT.replace('damping_ratio = "5 %"', 'damping_ratio = "5 %"\nhighest_frequency = "5.5 Hz"')
    sizes = [len(load_building(written(tmp_path, each)).building.mass) for each in (TEXT, text)]
    assert sizes == [9, 8]  # without the mode of torsion


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
            r"^building\.bearing\[0\]\.bearing = 'cornre': no preset .* \[bearings\] are corner",
        ),
        ("building.bearing.0.node", "roof", r"bearings\[0\]\.node = 'roof'"),
        ("building.bearing.0.position", [1.0], r"building\.bearing\[0\]\.position = \[1\.0\]: give 2"),
        ("building.bearing.2.interface.stiffness", 0.0, r"building\.bearing\[2\]\.interface\.stiffness = 0\.0"),
        ("bearings.corner.friction", "x", r"bearings\.corner\.friction = 'x'"),
        ("motion.kind", "harmonics", r"motion\.kind = 'harmonics': give one of"),
        ("building.highest_frequency", 0.0, r"building\.highest_frequency = 0\.0: give"),
        ("top", {}, "top: unknown key"),
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
        load_building(tmp_path / "none.toml")
    path = written(tmp_path, TEXT.replace('mass = "24 t"', "mass = 0"))
    with pytest.raises(InputError, match=r"building\.toml: building\.base\.mass = 0: give"):
        load_building(path)


def test_examples_of_the_page(tmp_path: Path):
    page = (ROOT / "docs" / "buildings.md").read_text(encoding="utf-8")
    names: dict = {}
    exec("\n".join(re.findall(r"```python\n(.*?)```", page, re.DOTALL)), names)
    assert names["result"].axial_force.min() > 0 and names["scene"].axial_loads.sum() == pytest.approx(900e3 * 9.8)
    (text,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    others = "".join(f'[[building.bearing]]\nbearing = "corner"\nposition = {place}\n' for place in OTHERS)
    scene = load_building(written(tmp_path, text.replace("# ... further bearings", others)))
    assert scene.axial_loads.sum() == pytest.approx(500e3 * 9.8)


OTHERS = ([6, -4], [-6, 4], [6, 4])  # [m]
