"""Buildings on bearings: limits, balances of force and energy, and convergence with the step."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.buildings import BASE, BEARING, LOAD, MASS, MOTION, frame, rocking, scene
from support.buildings import storey as one_storey

from msfp_gen import BaseSlab, Building, BuildingBearing, BuildingScene, Effects, Motion, Scene, Solver, Top, simulate
from msfp_gen.buildings.result import BuildingResult


def test_a_slab_on_a_stiff_interface_moves_as_a_supported_mass():
    """One bearing, ever stiffer horizontally and against tilt: forces tend to those of `Top.mass`."""
    mass, vertical, damper = LOAD / BEARING.gravity, 2e7, 3e5
    top = Top.mass(mass, 2.0 * mass, 0.0, vertical_stiffness=vertical, vertical_damping=damper)
    solver = Solver(rtol=1e-7, max_step=1e-3)
    alone = simulate(Scene(BEARING, MOTION, top, Effects(), solver, duration=2.0, output_step=0.01))
    slab = Building.shear(BaseSlab(mass, 3 * (2.0 * mass,)), [])
    errors = []
    for stiffness in (1e8, 1e10):
        interface = Top.node(stiffness, vertical, 10 * stiffness, 1e-4 * stiffness, damper, 1e-3 * stiffness)
        bearings = [BuildingBearing(BEARING, interface)]
        result = simulate(BuildingScene(slab, bearings, MOTION, Solver(rtol=1e-6), 2.0))
        assert result.time == pytest.approx(alone.history.time, abs=1e-12)
        errors.append(np.abs(result.wrench[:, 0, 1, :3] + alone.history.top_force) / LOAD)
    assert errors[1].max(axis=0)[0] < 1e-4 < errors[0].max(axis=0)[0]
    assert np.quantile(errors[1], 0.9, axis=0)[2] < 1e-4  # N varies fast where surfaces start to slide
    assert errors[1].max() < 1e-3


def modal_superposition(building: Building, ratio: float, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Relative displacements and absolute accelerations of the roof on a fixed base, shapes (k, 6)."""
    fixed = building.fixed
    inner = np.ix_(fixed.inner, fixed.inner)
    along = building.rigid_motions[fixed.inner, 0]
    part, w, count = fixed.modes.T @ building.mass[inner] @ along, fixed.frequencies, len(fixed.frequencies)

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        force = -part * MOTION.acceleration(t)[0]
        return np.concatenate([y[count:], force - 2 * ratio * w * y[count:] - w**2 * y[:count]])

    found = solve_ivp(rates, (0, time[-1]), np.zeros(2 * count), "DOP853", time, rtol=1e-8, atol=1e-11, max_step=0.02)
    rows = building.node("floor 3").rows[:, fixed.inner] @ fixed.modes
    accelerations = np.array([rates(t, y)[count:] for t, y in zip(time, found.y.T, strict=True)]) @ rows.T
    accelerations[:, :3] += MOTION.acceleration(time)
    return found.y[:count].T @ rows.T, accelerations


def test_stuck_bearings_are_a_fixed_base():
    """Friction 10: the frame responds as by superposition of its modes on a fixed base, to 1e-3."""
    interface = Top.node(1e10, 1e10, 1e11, 1e6, 1e6, 1e8)
    building = frame(frequency=1.0)
    result = simulate(scene(building, 1e-6, BEARING.replace(friction=10.0), interface=interface))
    displacement, acceleration = modal_superposition(building, 0.05, result.time)
    roof = result.node("floor 3")
    relative = roof[:, 0] - np.hstack([result.ground[:, 0], np.zeros_like(result.ground[:, 0])])
    assert np.abs(relative - displacement).max() < 1e-3 * np.abs(displacement).max()
    assert np.abs(roof[:, 2] - acceleration).max() < 1e-3 * np.abs(acceleration).max()
    assert np.abs(displacement[:, 0]).max() > 0.05 and np.abs(displacement[:, 5]).max() > 1e-4


@cache
def run(rtol: float) -> BuildingResult:
    return simulate(scene(frame(), rtol))


def test_energy_of_the_building_closes_with_the_tolerance():
    errors = []
    for rtol in (1e-3, 1e-4, 1e-5):
        result = run(rtol)
        left = result.kinetic + result.strain + result.damped - result.received
        errors.append(float(np.abs(left).max() / result.kinetic.max()))
    assert errors[0] < 5e-4 and errors[2] < 5e-5
    assert errors[0] > errors[1] > errors[2]


def closure(result: BuildingResult) -> float:
    """Largest error of the energy balance over the largest input, from the columns of the dataset alone."""
    columns = result.dataset
    terms = [columns[f"energy_{name}"].values for name in ("kinetic", "strain", "potential", "damped")]
    for name in ("stored", "dissipated", "interface_dissipated"):
        terms.append((columns[name].values - columns[name].values[0]).sum(axis=1))
    supplied = columns["energy_input"].values
    return float(np.abs(supplied - np.sum(terms, axis=0)).max() / supplied.max())


PLAIN, STIFF = Top.node(1e7, 5e7, 1e6), Top.node(1e8, 2e8, 1e7, 1e6, 2e6, 1e5)
DAMPED = Top.node(1e7, 5e7, 1e6, 1e5, 1e6, 1e4)
SLAB = Building.shear(replace(BASE, mass=MASS), [])
TIMES = np.linspace(0.0, 1.0, 201)
UPWARD = Motion.from_acceleration(TIMES, np.outer(2.0 * np.sin(10 * np.pi * TIMES), [0.0, 0.0, 1.0]))
BUILDINGS = {
    "no dampers": lambda: scene(frame(), interface=PLAIN),
    "stiff interfaces": lambda: scene(frame(), interface=STIFF),
    "vertical motion": lambda: scene(frame(), interface=DAMPED, motion=UPWARD, duration=1.0),
    "default tolerance": lambda: scene(frame(), 1e-3, interface=DAMPED),
    "reduced": lambda: scene(frame().reduced(20.0), interface=DAMPED),
    "soft storeys": lambda: scene(frame(frequency=1.0), interface=DAMPED),
    "eccentric": lambda: scene(frame(eccentricity=(1.0, 0.6)), interface=DAMPED),
    "slab": lambda: scene(SLAB, interface=DAMPED),
    "uplift added": lambda: rocking(None),
    "uplift": lambda: rocking(Effects(uplift=True)),
}


@pytest.mark.parametrize("name", BUILDINGS)
def test_energy_closes_from_the_columns_of_the_output(name: str):
    """Work of the ground: energies of the frame, and of bearings and interfaces; to 0.1 % of the input."""
    assert closure(simulate(BUILDINGS[name]())) < 1e-3


def test_dampers_of_interfaces_lose_by_the_velocity_across_them():
    """A slab in vertical motion on bearings that do not yield: c times the square of its velocity from the ground."""
    result = simulate(scene(SLAB, interface=DAMPED, motion=UPWARD, duration=1.0, output_step=1e-3))
    upper = np.einsum("bn,kn->kb", result.scene.attachments[:, 2], result.velocity)
    power = DAMPED.vertical_damping * (upper - result.support[:, :, 1, 2]) ** 2
    lost = float(np.sum(0.5 * (power[1:] + power[:-1]).sum(axis=1) * np.diff(result.time)))
    assert lost > 100.0
    assert result.interface_dissipated[-1].sum() == pytest.approx(lost, rel=5e-3)


def test_work_of_the_ground_follows_from_its_forces():
    result = run(1e-4)
    assert result.input[-1] > 4000.0
    ground = np.einsum("kbi,ki->k", result.wrench[:, :, 0, :3], result.ground[:, 1])
    work = float(np.sum(0.5 * (ground[1:] + ground[:-1]) * np.diff(result.time)))
    assert result.input[-1] == pytest.approx(work, rel=5e-3)


def test_the_ground_accelerates_all_masses():
    """Forces of the ground: inertia and weight of building and bearings; the latter weigh little."""
    result = run(1e-4)
    light = 4 * sum(body.mass for body in BEARING.bodies)
    motions = result.scene.building.rigid_motions
    inertia = result.acceleration @ result.scene.building.mass @ motions[:, :3]
    inertia[:, 2] += (MASS + light) * BEARING.gravity
    fastest = np.abs(result.acceleration[:, :3]).max() + np.abs(result.ground[:, 2]).max()
    assert np.abs(result.base_reaction - inertia).max() < light * 3 * fastest
    assert np.abs(result.base_reaction[:, 0]).max() > 0.05 * MASS * BEARING.gravity


def test_rocking_of_the_frame_varies_the_axial_forces():
    """Moments of all inertia about the base are those of the axial forces, their tilt and their horizontal forces."""
    result = run(1e-4)
    building = result.scene.building
    moment = result.acceleration @ building.mass @ building.rigid_motions[:, 4]
    places = np.array([each.position for each in result.scene.bearings])
    upper = result.wrench[:, :, 1] - result.wrench[0, :, 1]
    overturning = upper[:, :, 2] @ places[:, 0] - upper[:, :, 4].sum(axis=1)
    assert moment == pytest.approx(overturning, abs=1e-5 * MASS * BEARING.gravity)
    assert np.ptp(result.axial_force, axis=0).min() > 0.4 * LOAD


def test_peaks_converge_with_the_tolerance():
    roofs = [np.abs(run(rtol).node("floor 3")[:, 2, 0]).max() for rtol in (1e-3, 1e-4, 1e-5)]
    slips = [np.abs(run(rtol).bearing_displacement).max() for rtol in (1e-3, 1e-4, 1e-5)]
    assert roofs[1] == pytest.approx(roofs[2], rel=5e-3) and roofs[0] == pytest.approx(roofs[2], rel=1e-2)
    assert slips == pytest.approx(3 * [slips[2]], rel=2e-4)


def shifted(given: BuildingScene, dx: float, dy: float) -> BuildingScene:
    """The same building in axes whose origin is elsewhere."""
    moved = [replace(each, position=(each.position[0] + dx, each.position[1] + dy)) for each in given.bearings]
    storey = replace(one_storey(), mass_centre=(0.3 + dx, 0.1 + dy), stiffness_centre=(dx, dy))
    building = Building.shear(replace(BASE, mass_centre=(dx, dy)), 3 * [storey], 0.05)
    return replace(given, building=building, bearings=moved)


def test_floors_are_the_same_in_shifted_axes():
    """Accelerations, displacements, drifts, spectra: of centres of mass and corners, wherever the origin is."""
    twisting = Motion.harmonic(0.05, 0.6, direction=0.7, cycles=1)
    given = scene(frame(), 1e-3, motion=twisting, duration=1.0)
    one, other = simulate(given), simulate(shifted(given, 40.0, -25.0))
    for name in ("node_acceleration", "node_displacement", "corner_acceleration", "corner_displacement", "drift",
                 "corner_drift", "overturning_moment", "base_torsion"):  # fmt: skip
        values = getattr(one.extremes, name)
        assert getattr(other.extremes, name) == pytest.approx(values, rel=1e-3, abs=1e-4 * values.max()), name
    found, moved = one.floor_spectra([0.1, 0.5, 2.0]), other.floor_spectra([0.1, 0.5, 2.0])
    for name in ("nodes", "corners"):
        values = getattr(found, name)
        assert getattr(moved, name) == pytest.approx(values, rel=1e-3, abs=1e-4 * values.max()), name
    assert (one.extremes.corner_acceleration[1:, 3] > 1.001 * one.extremes.node_acceleration[1:, 3]).all()


def test_floor_spectra_do_not_depend_on_the_rows():
    """Rows at 10 and at 50 ms: the same spectra to a per cent, at centres of mass and corners."""
    few, many = (simulate(scene(frame(), output_step=step)).floor_spectra() for step in (0.05, 0.01))
    for one, other in ((few.nodes, many.nodes), (few.corners, many.corners)):
        assert one[..., [0, 2]] == pytest.approx(other[..., [0, 2]], rel=0.01)


def test_a_reduced_building_moves_as_the_whole():
    whole, part = run(1e-4), simulate(scene(frame().reduced(40.0), 1e-4))
    assert len(part.scene.building.mass) < len(whole.scene.building.mass)
    for name, size in (("bearing_displacement", 2e-4), ("drift", 1e-2), ("storey_force", 1e-2)):
        one, other = getattr(whole, name), getattr(part, name)
        assert np.abs(one - other).max() < size * np.abs(one).max(), name
