"""Whether what holds a top plate level is stiff enough to hold it up, and vibrations that ring on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.buildings import BEARING, INTERFACE, LOAD, MASS, MOTION, frame
from support.buildings import scene as building_scene

from msfp_gen import (
    BaseSlab,
    Building,
    BuildingScene,
    Effects,
    InputError,
    Motion,
    Scene,
    Top,
    load_scene,
    presets,
    simulate,
)
from msfp_gen.buildings.notes import building_doubts, value_notes
from msfp_gen.scene.explain import explain
from msfp_gen.scene.plausibility import scene_doubts
from msfp_gen.scene.standing import links, needed_rotational_stiffness, standing_of

PLANAR = Effects(dimension="planar")
SMOOTH = BEARING.replace(friction=1e-4)


def carrying(stiffness: float, height: float = 0.5) -> Scene:
    """A mass on a bearing almost without friction, whose base sways slowly by a millimetre."""
    time = np.linspace(0.0, 3.0, 301)
    path = np.zeros((301, 3))
    path[:, 0] = 1e-3 * np.sin(np.pi * time / 3.0) ** 4
    top = Top.mass(LOAD / BEARING.gravity, 300.0, height, rotational_stiffness=stiffness)
    return Scene(SMOOTH, Motion.from_arrays(time, path), top, PLANAR)


def test_what_a_plate_needs_is_load_times_lever():
    """r_nn of the triple pendulum is 0.486 m above the sphere centre of its highest surface."""
    weight = BEARING.gravity * BEARING.bodies[-1].mass
    lever = BEARING.surfaces[-1].radius + BEARING.bodies[-1].height
    assert links(BEARING)[-1] == pytest.approx(lever) and 0 < weight < 0.01 * LOAD
    assert needed_rotational_stiffness(BEARING, LOAD, 0.0) == pytest.approx(LOAD * lever)
    carried = needed_rotational_stiffness(BEARING, 0.0, 0.0, LOAD / BEARING.gravity, 0.5)
    assert carried == pytest.approx(LOAD * (lever + 0.5))
    held = needed_rotational_stiffness(BEARING, LOAD, 1e12)  # r_nn cannot move: the sliders have to lean as well
    assert held == pytest.approx(LOAD * (lever + lever**2 / links(BEARING)[:-1].sum()), rel=1e-2)
    assert needed_rotational_stiffness(presets.bearing("single-fp"), LOAD, 0.0) < 0.0


def test_a_plate_below_it_turns_over_and_one_above_it_stands(monkeypatch):
    monkeypatch.setattr("msfp_gen.scene.scene.check_standing", lambda *_: None)
    standing = standing_of(carrying(1e7))
    assert standing is not None
    tilts = []
    for share in (0.5, 1.2):
        try:
            history = simulate(carrying(share * standing[2])).history
        except Exception as error:  # whatever it is that ends a fall
            history = error.result.history  # type: ignore[attr-defined]
        tilts.append(np.abs(history.tilt_angles[..., 1].sum(axis=1)).max())
    assert tilts[1] < 5e-3 and tilts[0] > 20 * tilts[1]


@pytest.mark.parametrize("top", [Top.mass(LOAD / 9.8, 300.0, 0.5, 1e5), Top.rig(LOAD, 1e8, 0.0, 2e4)])
def test_a_stiffness_that_holds_no_plate_is_refused(top):
    with pytest.raises(InputError) as error:
        Scene(BEARING, MOTION, top)
    scene = Scene(BEARING, MOTION, replace(top, rotational_stiffness=1e7))
    standing = standing_of(scene)
    assert standing is not None and not list(scene_doubts(scene))
    text = str(error.value)
    assert text.startswith(f"top.rotational_stiffness = {top.rotational_stiffness:g}: while the surfaces slide")
    assert f"give more than {standing[2]:.4g} [N m/rad]" in text and "\n" not in text
    for share, words in ((0.0, "nothing holds the top plate up"), (1.5, "where N is 1.5 times that at rest")):
        doubt = list(scene_doubts(Scene(BEARING, MOTION, replace(top, rotational_stiffness=share * standing[2]))))
        assert len(doubt) == 1 and words in doubt[0][2]


def test_an_interface_that_holds_no_plate_is_refused():
    with pytest.raises(InputError) as error:
        building_scene(frame(), interface=replace(INTERFACE, rotational_stiffness=3e4))
    text = (
        "scene.bearings[0].interface.rotational_stiffness = 30000: while the surfaces slide, the top plate turns over"
    )
    assert str(error.value).startswith(text) and "\n" not in str(error.value)
    scene = building_scene(frame(), interface=replace(INTERFACE, rotational_stiffness=8e4))
    texts = [row[0] for table in explain(scene) for row in table.rows if "turns over" in row[0]]
    assert texts and all("interface.rotational_stiffness = 80000" in text for text in texts)
    assert value_notes(scene.bearings[0], scene.axial_loads[0])[0].text in texts[0]


def test_no_published_scene_is_doubted():
    for name in presets.names("scene"):
        scene = load_scene(name)
        if isinstance(scene, BuildingScene):
            assert not list(building_doubts(scene))
            assert not any(value_notes(b, n) for b, n in zip(scene.bearings, scene.axial_loads, strict=True))
        else:
            assert not [text for _, _, text in scene_doubts(scene) if text.startswith("top.")], name


def test_a_building_that_rings_on_its_interfaces_is_noted_with_the_cure():
    slab = Building.shear(BaseSlab(MASS, (3 * MASS, 3 * MASS, 6 * MASS), (0.4, 0.2)), [])
    interface = replace(INTERFACE, vertical_damping=0.0)
    scene = building_scene(slab, interface=interface, duration=0.05)
    (doubt,) = building_doubts(scene)
    assert doubt[2].startswith("building.interface.vertical_damping = 0: the building vibrates") and doubt[1] == 0.0
    assert any(doubt[2] == row[0] for table in explain(scene) for row in table.rows)
    assert [note.text for note in simulate(scene).notes if note.kind == "value"] == [doubt[2]]
    cure = float(doubt[2].split("give ")[1].split(" ")[0])
    cured = building_scene(slab, interface=replace(interface, vertical_damping=cure))
    modes = cured.vertical_modes
    ratios = (modes.rates / (2 * np.sqrt(np.maximum(modes.squares, 1e-9))))[modes.shares > 0.2]
    assert ratios.min() == pytest.approx(0.02, rel=1e-2) and not list(building_doubts(cured))
    bounce = np.sqrt(4 * interface.vertical_stiffness / MASS) / (2 * np.pi)
    frequencies = np.sqrt(modes.squares[modes.shares > 0.2]) / (2 * np.pi)
    assert frequencies.min() < bounce < frequencies.max()  # eccentric: bounce and rocking are coupled


def test_a_mass_that_rings_on_its_spring_is_noted_with_the_cure():
    top = Top.mass(1e4, 300.0, 0.5, 1e7, vertical_stiffness=4e8)
    (doubt,) = scene_doubts(Scene(BEARING, MOTION, top))
    assert doubt[2].startswith(
        "top.vertical_damping = 0: the mass vibrates on its vertical spring at 31.8 Hz with 0.0%"
    )
    assert "give 8e+04 N s/m for 2%" in doubt[2]
    assert not list(scene_doubts(Scene(BEARING, MOTION, replace(top, vertical_damping=8e4))))
