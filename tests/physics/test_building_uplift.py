"""Overturning: axial forces of the bearings down to zero, lift-off, and back; against statics and in shaking."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.buildings import BEARING, INTERFACE, LOAD, PLACES, rocking

from msfp_gen import BaseSlab, Building, BuildingBearing, BuildingScene, Effects, Motion, simulate
from msfp_gen.buildings import effects as selection
from msfp_gen.buildings.result import BuildingResult

LIFTING = Effects(uplift=True)


def sunk(depth: float, end: float) -> Motion:
    """A support that sinks slowly and returns [m], [s]."""
    time = np.linspace(0.0, end, 401)
    path = np.zeros((401, 3))
    path[:, 2] = -depth * np.sin(np.pi * time / end) ** 4
    return Motion.from_arrays(time, path)


def test_a_bearing_whose_support_sinks_lifts_off_and_lands():
    """Statics: as the support sinks, the bearing loses load in proportion; then three bearings carry everything."""
    mass, centre, end, depth = 3e4, np.array([0.8, 0.4]), 20.0, 8e-3
    bearings = [BuildingBearing(BEARING, INTERFACE, place, effects=LIFTING) for place in PLACES]
    bearings[2] = replace(bearings[2], motion=sunk(depth, end))
    slab = Building.shear(BaseSlab(mass, (1e5, 1e5, 1e5), tuple(centre)), [])
    still = Motion.from_arrays(np.linspace(0.0, end, 11), np.zeros((11, 3)))
    result = simulate(BuildingScene(slab, bearings, still))
    places, weight = np.array(PLACES), mass * BEARING.gravity
    low = int(np.argmin(result.support[:, 2, 0, 2]))
    # On three bearings: the loads that balance the weight at its centre.
    three = [0, 1, 3]
    balance = np.vstack([np.ones(3), places[three].T])
    carried = np.linalg.solve(balance, weight * np.array([1.0, *centre]))
    assert carried.min() > 0.05 * weight
    assert result.axial_force[low, three] == pytest.approx(carried, abs=2e-3 * weight)
    assert abs(result.axial_force[low, 2]) < 2e-3 * weight
    # On four springs of one stiffness, each carries k times its compression; the fourth mode is the warping.
    warp = np.array([1.0, -1.0, 1.0, -1.0])
    early = int(np.argmax(result.support[:, 2, 0, 2] < -0.1 * depth))
    contact = stiffness_of(INTERFACE.vertical_stiffness, result)
    change = 0.25 * contact * result.support[early, 2, 0, 2] * warp * warp[2]
    assert result.axial_force[early] - result.axial_force[0] == pytest.approx(change, rel=2e-2)
    # Landed, it carries what it carried.
    assert result.axial_force[-1] == pytest.approx(result.axial_force[0], rel=5e-3)


def stiffness_of(interface: float, result: BuildingResult) -> float:
    """Of the interface and the unilateral contacts of a bearing in series [N/m]."""
    surfaces = result.scene.bearings[0].bearing.surfaces
    return 1.0 / (1.0 / interface + sum(1.0 / surface.seat_stiffness for surface in surfaces))


def test_a_slender_frame_lifts_off_and_lands():
    coarse, fine = (simulate(rocking(LIFTING, rtol)) for rtol in (1e-3, 1e-4))
    assert np.all((fine.axial_force < 1e-3 * LOAD).sum(axis=0)[[1, 2]] > 10)
    assert fine.axial_force.max() > 2.0 * LOAD and fine.axial_force[-1, [1, 2]].min() > 1.5 * LOAD
    for result in (coarse, fine):
        left = result.kinetic + result.strain + result.damped - result.received
        assert np.abs(left).max() < 5e-4 * result.kinetic.max()
    assert coarse.axial_force.max() == pytest.approx(fine.axial_force.max(), rel=2e-3)
    displacements = [np.abs(each.bearing_displacement).max(axis=(0, 1)) for each in (coarse, fine)]
    assert np.abs(displacements[0] - displacements[1]).max() < 5e-4 * displacements[1].max()
    assert displacements[0][0] == pytest.approx(displacements[1][0], rel=2e-4)


def test_moments_of_the_axial_forces_are_those_of_the_frame():
    """Also while bearings hang in the air: their moments about the base and the inertia of all floors."""
    result = simulate(rocking(LIFTING, 1e-4))
    building = result.scene.building
    moment = result.acceleration @ building.mass @ building.rigid_motions[:, 4]
    places = np.array(PLACES)
    upper = result.wrench[:, :, 1] - result.wrench[0, :, 1]
    overturning = upper[:, :, 2] @ places[:, 0] - upper[:, :, 4].sum(axis=1)
    assert moment == pytest.approx(overturning, abs=1e-5 * 4 * LOAD)


def test_uplift_that_opens_on_the_way_is_that_from_the_start(monkeypatch):
    """Contacts that open compressed by the present load differ by the settlement N/k from those of a whole run."""
    monkeypatch.setattr(selection, "LEAST_SHARE", -np.inf)
    for seat, force, path in ((5e9, 0.1, 5e-4), (5e10, 0.01, 6e-5)):
        bearing = BEARING.replace(seat_stiffness=seat)
        opened, whole = (simulate(rocking(effects, bearing=bearing)) for effects in (None, LIFTING))
        assert [each.model_changes[0].action for each in opened.bearings if each.model_changes] == 2 * ["uplift = True"]
        assert np.abs(opened.axial_force - whole.axial_force).max() < force * LOAD
        assert np.abs(opened.bearing_displacement - whole.bearing_displacement).max() < path
        assert opened.dissipated[-1] == pytest.approx(whole.dissipated[-1], rel=2e-3)
        left = opened.kinetic + opened.strain + opened.damped - opened.received
        assert np.abs(left).max() < 5e-4 * opened.kinetic.max()
    assert opened.axial_force.min() < 1e-6 * LOAD
