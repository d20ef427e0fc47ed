"""Scenes of buildings: weights on the bearings, messages of bad input, failed runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.buildings import BEARING, INTERFACE, LOAD, MOTION, PLACES, frame, scene

from msfp_gen import (
    Auto,
    BaseSlab,
    Building,
    BuildingBearing,
    BuildingScene,
    Effects,
    InputError,
    Motion,
    RunError,
    simulate,
)
from msfp_gen.buildings.result import BuildingResult

STILL = Motion(np.array([0.0, 1.0]), np.zeros((1, 6, 6)))


def test_weights_balance_about_the_centre_of_mass():
    made = scene(frame())
    places = np.array(PLACES)
    assert made.axial_loads.sum() == pytest.approx(4 * LOAD, rel=1e-9)
    # 0.6 of the mass is 0.3 m and 0.1 m from the centre of the bearings.
    assert made.axial_loads @ places / (4 * LOAD) == pytest.approx([0.18, 0.06], rel=1e-9)


def test_three_bearings_carry_what_statics_says():
    """Statically determinate: loads by barycentric coordinates, whatever the springs."""
    places = [(0.0, 0.0), (4.0, 0.0), (0.0, 5.0)]
    bearings = [
        BuildingBearing(BEARING, replace(INTERFACE, vertical_stiffness=(index + 1) * 1e7), place)
        for index, place in enumerate(places)
    ]
    slab = Building.shear(BaseSlab(3e4, (1e5, 1e5, 1e5), (1.0, 2.0)), [])
    loads = BuildingScene(slab, bearings, MOTION).axial_loads
    weight = 3e4 * BEARING.gravity
    assert loads == pytest.approx([weight * (1 - 0.25 - 0.4), weight * 0.25, weight * 0.4], rel=1e-9)


def test_a_building_at_rest_stays_there():
    result = simulate(scene(frame(), motion=STILL, duration=0.5, output_step=0.05))
    assert np.abs(result.displacement).max() < 1e-9
    assert result.axial_force == pytest.approx(np.tile(result.scene.axial_loads, (11, 1)), rel=1e-6)


def test_shapes_of_the_rows():
    made = scene(frame(), duration=0.1, output_step=0.02)
    result = simulate(made)
    count = len(made.building.mass)
    assert result.time == pytest.approx(0.02 * np.arange(6))
    assert result.displacement.shape == result.acceleration.shape == (6, count)
    assert result.wrench.shape == (6, 4, 2, 6) and result.dissipated.shape == (6, 4)
    assert result.drift.shape == result.storey_force.shape == (6, 3, 6)
    assert result.normal_force.shape == result.sliding.shape == (6, 4, 4)
    assert result.node("base").shape == (6, 3, 6) and result.base_reaction.shape == (6, 3)


@pytest.mark.parametrize(("effects", "status"), [(Effects(), "uplift"), (None, "separated")])
def test_a_failed_run_names_the_bearing_and_keeps_its_rows(effects, status):
    """A support that moves away under one bearing alone: in tension, or with uplift until its parts fall off."""
    drop = Motion.from_acceleration([0.0, 0.05, 0.1, 5.0], np.outer([0.0, 0.0, -5.0, -5.0], [0.0, 0.0, 1.0]))
    bearings = [replace(each, effects=effects) for each in scene(frame()).bearings]
    bearings[2] = replace(bearings[2], name="corner", motion=drop)
    made = scene(frame(), bearings=bearings)
    with pytest.raises(RunError, match=r"^bearing 3 \(corner\): stopped at t = 0\.\d+ s of 2 s, surface \d") as caught:
        simulate(made)
    rows = caught.value.result
    assert isinstance(rows, BuildingResult) and caught.value.status == status
    assert 1 <= len(rows.time) == len(rows.wrench) < 200


def test_messages_of_bad_bearings():
    with pytest.raises(InputError, match=r"building_bearing\.position = \(1,\): give 2 finite numbers \[m\]"):
        BuildingBearing(BEARING, INTERFACE, (1,))
    with pytest.raises(InputError, match=r"building_bearing\.interface = 1: give a NodeTop"):
        BuildingBearing(BEARING, 1)
    for effects in (Effects(dimension="planar"), Auto(dimension="planar"), Effects(spin="free")):
        with pytest.raises(InputError, match=r"building_bearing\.effects\.\w+ = '(planar|free)': .* give '"):
            BuildingBearing(BEARING, INTERFACE, effects=effects)
