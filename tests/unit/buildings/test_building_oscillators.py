"""A building as its attachments and oscillators on them: the same matrices, the same run, few factorisations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.buildings import BASE, frame, scene, storey

from msfp_gen import BaseSlab, Building, BuildingBearing, BuildingScene, Motion, Solver, Top, presets, simulate


def flexible_slab(side: int = 3, spring: float = 2e8, **damping: object) -> Building:
    """A grid of points on springs, each with a lighter one above it: n = 12 side^2, a node for each lower point."""
    count = side**2
    places = [(4.0 * (i - (side - 1) / 2), 4.0 * (j - (side - 1) / 2)) for i in range(side) for j in range(side)]
    mass, stiffness = np.zeros(12 * count), np.zeros((12 * count, 12 * count))

    def connect(one: int, other: int, arm: np.ndarray, springs: np.ndarray) -> None:
        """Springs at the second point, which rigid arms connect to the first."""
        x, y, z = arm
        rows = np.zeros((6, 12 * count))
        rows[:, 6 * other : 6 * other + 6] = np.eye(6)
        rows[:, 6 * one : 6 * one + 6] = -np.eye(6)
        rows[:3, 6 * one + 3 : 6 * one + 6] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
        stiffness[:] += rows.T * springs @ rows

    for i, (x, y) in enumerate(places):
        mass[6 * i : 6 * i + 6] = 5e3 * np.array([1, 1, 1, 2, 2, 2])
        mass[6 * (count + i) : 6 * (count + i) + 6] = 2e4 * np.array([1, 1, 1, 1, 1, 1])
        connect(i, count + i, np.array([0.0, 0.0, 3.0]), np.array([1, 1, 40, 80, 80, 40]) * 2e7)
        for j, (u, v) in enumerate(places[:i]):
            if np.hypot(u - x, v - y) < 4.1:
                connect(i, j, np.array([u - x, v - y, 0.0]), np.array([1, 1, 1, 4, 4, 4]) * spring)
    nodes = {f"p{i}": (list(range(6 * i, 6 * i + 6)), [*place, 0.0]) for i, place in enumerate(places)}
    return Building.from_matrices(np.diag(mass), None, stiffness, nodes=nodes, **damping)  # type: ignore[arg-type]


def on_bearings(building: Building, duration: float = 0.5) -> BuildingScene:
    bearing = presets.bearing("prototype-tfp").replace(contact_damping=1e-4)
    interface = Top.node(1e8, 2e8, 1e7, 1e5, 4e5, 1e4)
    bearings = [BuildingBearing(bearing, interface, node=node.name) for node in building.nodes]
    return BuildingScene(building, bearings, Motion.harmonic(0.05, 1.0, cycles=1), Solver(), duration)


BUILDINGS = {
    "shear frame": frame(),
    "Rayleigh": Building.shear(BASE, [storey()], 0.03, rayleigh_frequencies=(1.0, 10.0)),
    "slab alone": Building.shear(BaseSlab(1e4, (1e4, 1e4, 2e4)), []),
    "matrices": flexible_slab(damping_ratio=0.03),
    "matrices, reduced": flexible_slab(rayleigh_frequencies=(1.0, 8.0)).reduced(6.0),
}


@pytest.mark.parametrize("building", BUILDINGS.values(), ids=BUILDINGS)
def test_oscillators_are_the_building_in_other_coordinates(building):
    """Energies and dissipation from the definition of the oscillators, against the matrices of the building."""
    same = building.oscillators
    rng, attachments = np.random.default_rng(1), len(same.mass)
    z = rng.normal(size=(len(same.basis.T), 20))
    u = same.basis @ z
    held, own = z[:attachments], z[attachments:]
    strain = own - same.shares.T @ held

    def twice(matrix: np.ndarray, x: np.ndarray) -> np.ndarray:
        return np.einsum("ik,ij,jk->k", x, matrix, x)

    kinetic = twice(same.mass, held) + (own**2).sum(axis=0)
    for found, matrix in (
        (kinetic, building.mass),
        (twice(same.damping, held) + same.dampers @ strain**2, building.damping),
        (twice(same.stiffness, held) + same.springs @ strain**2, building.stiffness),
    ):
        np.testing.assert_allclose(found, twice(matrix, u), rtol=1e-9, atol=1e-12 * kinetic.max())
    assert attachments == len(building.boundary) and len(same.basis.T) == len(building.mass)
    np.testing.assert_array_equal(u[list(building.boundary)], held)


def test_damping_that_couples_modes_leaves_no_oscillators_and_the_same_run():
    """A hair of such damping takes the other way: one set of equations for all coordinates."""
    building = frame()
    row = np.zeros(len(building.mass))
    row[6], row[12] = 1.0, -1.0  # a damper between two floors
    coupled = replace(building, damping=building.damping + 1e-8 * np.outer(row, row) * building.damping[6, 6])
    assert coupled.oscillators.springs.size == 0 and building.oscillators.springs.size == len(building.mass) - 6
    assert coupled.oscillators.basis.shape == building.mass.shape
    results = [simulate(scene(each, duration=0.8)) for each in (building, coupled)]
    for name in ("displacement", "acceleration", "damped"):
        one, other = (getattr(result, name) for result in results)
        assert np.abs(one - other).max() < 1e-8 * np.abs(one).max(), name


def test_a_flexible_slab_takes_few_factorisations():
    """Steps of one length differ by the rounding of times alone and share their factors, also after an interruption."""
    result = simulate(on_bearings(flexible_slab()))
    steps = result.counters["steps"] + result.counters["rejected_steps"]
    assert result.status == "ok" and steps > 100
    assert result.counters["step_lengths"] < 0.3 * steps  # two thirds, where the rounding of times counts
    assert result.counters["tangents"] < 0.1 * steps
