"""Values of a building that are hardly meant are refused, or named with the likely unit; published designs are not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support import ROOT

from msfp_gen import InputError, Scene, changed_scene, load_scene, presets
from msfp_gen.buildings.notes import building_doubts, floors
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.scene.effect_selection import scene_doubts

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


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"building.base.mass": 450.0}, "building.base.mass = 450 kg is 0.0017 of the mean of all floors; is it in kg"),
        (
            {"building.storey[1].inertia": [7.1e6, 16e6, 380e3 * 200.0**2]},
            "building.storey[1].inertia: about E3 the radius of gyration is 200 m, the bearings are at most 27",
        ),
        (
            {"building.storey[0].stiffness": [3.6e5, 3.0e5]},
            "building.storey[0].stiffness: under 0.1 g the storey drifts",
        ),
        (
            {"building.storey[2].height": 40.0},
            "building.storey[2].height = 40 m is unusually high; is it in m, not in mm",
        ),
        (
            {"building.interface.vertical_stiffness": 1.7e6},
            "interface.vertical_stiffness = 1.7e+06 N/m: the building settles by 0.911 m at rest; is it in N/m",
        ),
    ],
    ids=["mass", "gyration", "stiffness", "height", "sag"],
)
def test_unlikely_values_are_named_with_the_likely_unit(changes: dict[str, Any], words: str) -> None:
    texts = [text for *_, text in building_doubts(building(changes))]
    assert sum(words in text for text in texts) == 1, texts


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


def test_no_published_design_is_blamed() -> None:
    for name in [
        *presets.names("scene"),
        *presets.names("building"),
        *(str(path) for path in sorted((ROOT / "examples").glob("*.toml"))),
    ]:
        scene = load_scene(name)
        doubts = list(scene_doubts(scene) if isinstance(scene, Scene) else building_doubts(scene))
        assert not doubts, name


def test_a_single_bearing_has_no_plan() -> None:
    scene = building({})
    bearing = replace(scene.bearings[0], position=tuple(scene.mass_centre.tolist()))
    alone = replace(scene, bearings=[bearing])
    assert not [text for *_, text in building_doubts(alone) if "gyration" in text]
