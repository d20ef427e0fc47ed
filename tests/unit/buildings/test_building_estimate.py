"""The estimate of the least axial load, by which uplift is selected, against closed forms and runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from msfp_gen import BaseSlab, Building, BuildingBearing, BuildingScene, Motion, Top, load_scene, presets, simulate
from msfp_gen.buildings.effects import remaining_loads

BEARING = presets.bearing("fenz-tfp")


def shaken_vertically(frequency: float, ratio: float, amplitude: float = 0.2, driven: float = 2.0) -> BuildingScene:
    """A slab on one vertical spring, under a vertical sine that starts from rest."""
    mass = 20e3
    k = mass * (2 * np.pi * frequency) ** 2
    c = 2 * ratio * mass * 2 * np.pi * frequency
    slab = Building.shear(BaseSlab(mass, (1e4, 1e4, 1e4)), [])
    time = np.linspace(0, 8, 4001)
    wave = (
        amplitude
        / (2 * np.pi * driven) ** 2
        * np.sin(2 * np.pi * driven * time)
        * np.sin(np.pi / 2 * np.clip(time / 5, 0, 1)) ** 2
    )
    motion = Motion.from_arrays(time, np.outer(wave, [0, 0, 1]))
    return BuildingScene(slab, [BuildingBearing(BEARING, Top.node(1e8, k, 1e7, vertical_damping=c))], motion)


@pytest.mark.parametrize("driven", [2.0, 4.5])
def test_a_mass_on_a_spring_amplifies_the_ground(driven):
    """Below resonance by the factor of the textbooks; one bearing is not unloaded by overturning."""
    scene = shaken_vertically(5.0, 0.1, driven=driven)
    r, z = driven / 5.0, 0.1
    factor = np.sqrt((1 + (2 * z * r) ** 2) / ((1 - r**2) ** 2 + (2 * z * r) ** 2))
    expected = 1 - factor * 0.2 / scene.gravity
    assert remaining_loads(scene)[0] == pytest.approx(expected, abs=2e-3)


def test_overturning_unloads_the_outer_bearings():
    """A rigid slab, its mass at a height of h: the change of N is V h/b for a pair at a distance of b."""
    scene = load_scene("hospital-ccc")
    assert isinstance(scene, BuildingScene)
    still = replace(scene, motion=Motion(np.array([0.0, 60.0]), np.zeros((1, 6, 6))))
    left = remaining_loads(still) * scene.axial_loads - scene.axial_loads
    mass, motions = scene.building.mass, scene.building.rigid_motions
    moment = 0.08 * scene.gravity * abs((motions.T @ mass @ motions)[0, 4])
    x, y = scene.places.T
    wanted = np.hypot(moment * x / (x @ x), moment * y / (y @ y))
    assert -left == pytest.approx(wanted, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "estimate", "run"), [("hospital-ccc", 0.24, 0.31), ("hospital-clc", 0.13, 0.30)])
def test_the_estimate_is_below_what_runs_have(name, estimate, run):
    """The numbers of docs/buildings.md."""
    scene = load_scene(name)
    assert isinstance(scene, BuildingScene)
    assert remaining_loads(scene).min() == pytest.approx(estimate, abs=0.005)
    assert simulate(scene).summary["minimum_load_ratio"] == pytest.approx(run, abs=0.008)
