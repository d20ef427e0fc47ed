"""Overturning: axial forces of the bearings down to zero, lift-off, and back; against statics and in shaking."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plain import plain_hospital
from support.buildings import BEARING, INTERFACE, LOAD, MASS, PLACES, frame, rocking, scene

from msfp_gen import (
    BaseSlab,
    Building,
    BuildingBearing,
    BuildingScene,
    Effects,
    Motion,
    Top,
    simulate,
)
from msfp_gen.buildings import effects as selection
from msfp_gen.buildings.result import BuildingResult

LIFTING = Effects(uplift=True)


def sunk(depth: float, end: float) -> Motion:
    """A support that sinks slowly and returns [m], [s]."""
    time = np.linspace(0.0, end, 401)
    path = np.zeros((401, 3))
    path[:, 2] = -depth * np.sin(np.pi * time / end) ** 4
    return Motion.from_arrays(time, path)


def test_contacts_that_stay_closed_store_no_more_than_the_spring_that_contains_them():
    def run(effects: Effects) -> BuildingResult:
        given = replace(scene(frame()), duration=0.5)
        return simulate(replace(given, bearings=[replace(mount, effects=effects) for mount in given.bearings]))

    closed, seated = run(Effects()), run(Effects(uplift=True))
    assert not np.nan_to_num(seated.lift).any()
    assert seated.stored == pytest.approx(closed.stored, rel=1e-3)


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
    change = 0.25 * INTERFACE.vertical_stiffness * result.support[early, 2, 0, 2] * warp * warp[2]
    assert result.axial_force[early] - result.axial_force[0] == pytest.approx(change, rel=2e-2)
    # Landed, it carries what it carried.
    assert result.axial_force[-1] == pytest.approx(result.axial_force[0], rel=5e-3)


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


@pytest.mark.slow
def test_uplift_that_opens_on_the_way_is_that_from_the_start(monkeypatch):
    """The compliance of the contacts is taken out of the interfaces: N does not depend on when they open.

    At a tolerance of 1e-3 the height to which light sliders rattle is not resolved: 17 to 82 um, 18 um below 5e-4.
    """
    monkeypatch.setattr(selection, "LEAST_SHARE", -np.inf)
    for seat, force, path in ((None, 3e-3, 3e-5), (1e9, 1.3e-2, 2e-4)):
        bearing = BEARING.replace(seat_stiffness=seat)
        opened, whole = (simulate(rocking(effects, bearing=bearing)) for effects in (None, LIFTING))
        assert [each.model_changes[0].action for each in opened.bearings if each.model_changes] == 2 * ["uplift = True"]
        assert np.abs(opened.axial_force - whole.axial_force).max() < force * LOAD
        assert np.abs(opened.bearing_displacement - whole.bearing_displacement).max() < path
        assert opened.dissipated[-1] == pytest.approx(whole.dissipated[-1], rel=1e-3)
        left = opened.kinetic + opened.strain + opened.damped - opened.received
        assert np.abs(left).max() < 5e-4 * opened.kinetic.max()
        assert opened.axial_force.min() < 1e-6 * LOAD
        finer = (simulate(rocking(effects, 5e-4, bearing)) for effects in (None, LIFTING))
        lifts = [run.extremes.lift.max(axis=1) for run in finer]
        assert np.all(lifts[1][1:3] > 1e-5) and lifts[0] == pytest.approx(lifts[1], abs=path)


def closed(given: BuildingScene) -> tuple[float, float]:
    """Largest difference of N, over that at rest, and of the peak base shear, by uplift where nothing lifts."""
    runs = [
        simulate(replace(given, bearings=[replace(b, effects=Effects(uplift=uplift)) for b in given.bearings]))
        for uplift in (False, True)
    ]
    load = given.axial_loads
    assert runs[0].axial_force.min() > 0.1 * load.min()
    shear = [float(run.extremes.base_reaction[3]) for run in runs]
    return float((np.abs(runs[1].axial_force - runs[0].axial_force) / load).max()), abs(shear[1] / shear[0] - 1.0)


def on_stiff_interfaces(vertical: float, ratio: float, heave: float, frequency: float) -> BuildingScene:
    """Three storeys on interfaces of that vertical stiffness [N/m] and damping ratio, on ground that heaves [m/s^2]."""
    time = np.linspace(0.0, 2.0, 1601)
    start = np.clip(time / 0.5, 0.0, 1.0)
    wave, turn = start**3 * (10 - 15 * start + 6 * start**2), 2 * np.pi * frequency
    path = np.zeros((1601, 3))
    path[:, 0] = 0.03 * wave * np.sin(2 * np.pi * 0.7 * time)
    path[:, 1] = 0.02 * wave * np.sin(2 * np.pi * 0.45 * time)
    path[:, 2] = heave / turn**2 * wave * np.sin(turn * time)
    damping = 2 * ratio * np.sqrt(vertical * 0.25 * MASS)
    interface = Top.node(1e8, vertical, 1e7, damping=1e5, vertical_damping=damping, rotational_damping=1e4)
    return scene(frame(), interface=interface, motion=Motion.from_arrays(time, path), duration=2.0)


@pytest.mark.parametrize(("vertical", "ratio"), [(5e8, 0.05), (2e9, 0.2)])
def test_uplift_is_neutral_where_nothing_lifts(vertical, ratio):
    force, shear = closed(on_stiff_interfaces(vertical, ratio, 0.25, 8.0))
    assert force < 5e-3 and shear < 5e-3


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_uplift_is_neutral_on_any_interface(seed):
    draw = np.random.default_rng(seed)
    vertical, ratio = 10 ** draw.uniform(7.7, 9.7), draw.uniform(0.02, 0.2)
    force, shear = closed(on_stiff_interfaces(vertical, ratio, draw.uniform(0.1, 0.4), draw.uniform(2.0, 10.0)))
    assert force < 5e-3 and shear < 5e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hospital-clc", "hospital-ccc"])
def test_uplift_is_neutral_in_the_hospital(name):
    force, shear = closed(replace(plain_hospital(name), duration=25.0))
    assert force < 0.01 and shear < 5e-3
