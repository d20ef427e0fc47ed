"""Changes of fields by paths: tables, rows of lists, bearings that presets give."""

from __future__ import annotations

from typing import Any

import pytest

from msfp_gen import InputError, changed_scene, load_scene
from msfp_gen.scene.file.changes import changed_table, keys_of_path, multiplied_table

TABLE: dict[str, Any] = {
    "motion": {"scale": 1.0},
    "bearings": {"corner": {"preset": "fenz-tfp", "gravity": 9.81}, "plain": "becker-tfp"},
    "building": {"bearing": [{"bearing": "corner"}, {"bearing": "plain", "position": [1.0, 2.0]}]},
}


@pytest.mark.parametrize(
    ("path", "value", "where"),
    [
        ("motion.scale", 2.0, lambda t: [t["motion"]["scale"]]),
        ("solver.rtol", 1e-3, lambda t: [t["solver"]["rtol"]]),
        ("building.bearing[1].position[0]", 3.0, lambda t: [t["building"]["bearing"][1]["position"][0]]),
        ("building.bearing[*].name", "x", lambda t: [each["name"] for each in t["building"]["bearing"]]),
        (
            "building.bearing[*].bearing.friction",
            0.05,
            lambda t: [each["bearing"]["friction"] for each in t["building"]["bearing"]],
        ),
        (
            "building.bearing[*].bearing.surfaces[3].friction",
            0.05,
            lambda t: [each["bearing"]["surfaces"][3]["friction"] for each in t["building"]["bearing"]],
        ),
    ],
)
def test_a_path_leads_to_its_fields(path, value, where):
    found = where(changed_table(TABLE, {path: value}))
    assert found and found == len(found) * [value]


def test_the_table_that_is_given_stays():
    changed = changed_table(TABLE, {"building.bearing[0].bearing.friction": 0.05})
    assert (
        TABLE["building"]["bearing"][0]["bearing"] == "corner" and TABLE["bearings"]["corner"].get("friction") is None
    )
    assert changed["building"]["bearing"][0]["bearing"] == {"preset": "fenz-tfp", "gravity": 9.81, "friction": 0.05}
    assert changed["bearings"] == TABLE["bearings"]


def test_a_bearing_of_a_building_keeps_what_it_has_in_common():
    """A change of its uplift alone had taken friction and hysteresis of `[building.effects]` from it."""
    common = {"effects": {"friction": "pvt", "bouc_wen": "plastic"}, "interface": {"stiffness": 1e8, "damping": 1e5}}
    table = {"building": {**TABLE["building"], **common}}
    changes = {"building.bearing[1].effects.uplift": True, "building.bearing[*].interface.damping": 0.0}
    first, second = changed_table(table, changes)["building"]["bearing"]
    assert second["effects"] == {**common["effects"], "uplift": True} and "effects" not in first
    assert first["interface"] == second["interface"] == {"stiffness": 1e8, "damping": 0.0}
    assert table["building"]["interface"]["damping"] == 1e5
    halved = multiplied_table(table, "building.bearing[1].interface.damping", 0.5)["building"]
    assert halved["bearing"][1]["interface"]["damping"] == 5e4 and halved["interface"]["damping"] == 1e5
    plain = {"building": {**TABLE["building"], "effects": "auto"}}
    (_, alone) = changed_table(plain, {"building.bearing[1].effects.uplift": True})["building"]["bearing"]
    assert alone["effects"] == {"uplift": True}


def test_one_surface_of_the_bearing_of_a_preset():
    one = changed_scene("fenz-test2", {"bearing.surfaces[0].friction": 0.05}).bearing
    assert one == load_scene("fenz-test2").bearing.replace(friction=[0.05, 0.017, 0.017, 0.107])


def test_all_bearings_of_a_building():
    changes = {"building.bearing[*].bearing.surfaces[0].friction": "5 %", "building.storey[1].mass": "300 t"}
    scene, plain = changed_scene("hospital-clc", changes), load_scene("hospital-clc")
    assert {each.bearing.surfaces[0].friction for each in scene.bearings} == {0.05}
    assert scene.weight == pytest.approx(plain.weight - 80e3 * scene.gravity)


@pytest.mark.parametrize(
    ("path", "message"),
    [
        (
            "building.bearing[2].name",
            r"building\.bearing\[2\]\.name = 1: there are 2 of them; give an index from 0 to 1",
        ),
        ("motion[0].scale", r"motion\[0\]\.scale = 1: \{'scale': 1\.0\} is no list here, which has no \[0\]"),
        ("motion.scale.more", "scale is 1.0 here, which has no fields to change"),
        ("building.storey[0].mass", "is no list here"),
        ("bearing.surfaces[x].friction", "no path of a field"),
        ("a..b", "no path of a field"),
    ],
)
def test_messages(path, message):
    with pytest.raises(InputError, match=message):
        changed_table(TABLE, {path: 1})


def test_keys():
    assert keys_of_path("a.b-c[0][*].d") == ["a", "b-c", 0, None, "d"]
