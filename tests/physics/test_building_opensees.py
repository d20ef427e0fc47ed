"""Buildings on bearings against OpenSees: with served bearings, and with its own triple pendulum.

Skipped where OpenSeesPy cannot be imported: `pip install -e .[opensees]`.
"""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from support import ROOT, Array
from support.buildings import BASE, BEARING, INTERFACE, PLACES, storey
from support.generic_client import serving
from support.peers import opensees_runs

from msfp_gen import (
    BaseSlab,
    Bearing,
    Body,
    Building,
    BuildingBearing,
    BuildingScene,
    Effects,
    Layout,
    Motion,
    Solver,
    Surface,
    Top,
    TwoPort,
    load_scene,
    simulate,
)
from msfp_gen.studies.accuracy.series import Series

pytestmark = pytest.mark.skipif(not opensees_runs(), reason="OpenSeesPy cannot be imported")
SAMPLE = 0.01  # of the record [s]
DAMPING_TIME = 5e-4  # of the storeys, damping over stiffness [s]


def client(**arguments: Any) -> dict[str, Any]:
    """The answer of a frame in OpenSees, in a process of its own."""
    command = [sys.executable, str(ROOT / "tests" / "support" / "opensees_buildings.py")]
    run = subprocess.run(command, input=json.dumps(arguments), capture_output=True, text=True, timeout=1500)
    assert run.returncode == 0, run.stderr
    answer: dict[str, Any] = json.loads(run.stdout.splitlines()[-1])
    assert answer["status"] == 0, run.stderr
    return answer


def record(begin: float, duration: float, axes: tuple[int, int, int] = (1, 1, 1)) -> tuple[Array, Motion]:
    """Accelerations of a recorded motion from rest, shape (times, 3) [m/s^2], and the motion."""
    times = np.arange(round(duration / SAMPLE) + 1) * SAMPLE
    found = load_scene("ridgecrest-clc").motion.acceleration(begin + times) * axes
    found *= np.minimum(1.0, times / 0.2)[:, None]
    return found, Motion.from_acceleration(times, found)


def extrapolated(coarse: float, fine: float) -> float:
    """The limit of values at two steps, one half of the other, of a method of order two."""
    return fine + (fine - coarse) / 3


@pytest.mark.slow
def test_a_frame_of_served_bearings_tends_to_the_own_run():
    """Three storeys, four bearings, eccentric: peaks of roof, bearings, axial forces to 0.5 % as the step shrinks."""
    own = storey(frequency=2.0)
    made = Building.shear(BASE, 3 * [own], 0.0)
    building = Building(made.mass, DAMPING_TIME * made.stiffness, made.stiffness, made.nodes, made.columns)
    floors: list[dict[str, Any]] = [
        {"mass": BASE.mass, "inertia": BASE.inertia, "mass_centre": BASE.mass_centre, "level": 0.0}
    ]
    for level in (3.0, 6.0, 9.0):
        springs = {"springs": list(own.springs), "stiffness_centre": own.stiffness_centre, "damping_time": DAMPING_TIME}
        floors.append(
            {"mass": own.mass, "inertia": own.inertia, "mass_centre": own.mass_centre, "level": level, **springs}
        )
    ground, motion = record(6.0, 2.0)
    bearings = [BuildingBearing(BEARING, INTERFACE, place, effects=Effects()) for place in PLACES]
    scene = BuildingScene(building, bearings, motion, Solver(rtol=1e-5))
    result = simulate(scene)
    roof = building.node("floor 3").linked([*own.mass_centre, 9.0])[:2]
    expected = peaks(result.acceleration @ roof.T, result.bearing_displacement, result.axial_force)
    found = []
    for step in (0.005, 0.0025):
        ports = [TwoPort(BEARING, INTERFACE, float(load), Effects(), scene.solver) for load in scene.axial_loads]
        with serving(*ports) as served:
            given = zip(PLACES, scene.axial_loads, served.ports, strict=True)
            answer = client(
                floors_given=floors,
                bearings_given=[{"position": p, "load": float(load), "port": port} for p, load, port in given],
                ground=ground.T.tolist(),
                ground_step=SAMPLE,
                step=step,
                count=round(2.0 / step),
                every=round(SAMPLE / step),
                tolerance=1.0,
            )
        roofs = np.array(answer["acceleration"])[:, :2] + ground[1:, :2]
        found.append(peaks(roofs, np.array(answer["displacement"]), np.array(answer["compression"])))
    limits = [extrapolated(*pair) for pair in zip(*found, strict=True)]
    assert expected[1] > 0.02 and expected[2] > 1.5 * scene.axial_loads.max()
    assert limits == pytest.approx(expected, rel=5e-3)


def peaks(roof: Array, displacement: Array, compression: Array) -> list[float]:
    """Largest acceleration of the roof, displacement of a bearing and axial force, all horizontally or vertically."""
    return [
        float(np.linalg.norm(roof, axis=1).max()),
        float(np.linalg.norm(displacement[:, :, :2], axis=2).max()),
        float(compression.max()),
    ]


# Dao's example with radii times four and a third of the friction: tilts below 0.06 rad, as the element assumes. With
# its yield displacement of 1 mm the element dissipates less than a stack of surfaces of 1 mm; both tend to one limit.
RADII, FRICTIONS, CAPACITIES, WEIGHT, YIELD = (0.36, 1.25, 1.25), (0.004, 0.0173, 0.0467), (0.1, 0.2, 0.2), 1000.0, 3e-5


def shallow(scale: float = 4.0, room: float = 1.0) -> tuple[Bearing, dict[str, Any]]:
    """The bearing, and what the element of OpenSees takes; see test_opensees_client.py for its frictions.

    scale: of the radii. room: of the capacities.
    """
    lengths, capacities = (tuple(factor * x for x in of) for factor, of in ((scale, RADII), (room, CAPACITIES)))
    inner, lower, upper = zip(lengths, capacities, FRICTIONS, strict=True)
    surfaces = [
        Surface(r, c, mu, YIELD * share, rim_stiffness=1e6, contact_damping=1e-4)
        for (r, c, mu), share in ((lower, 1.0), (inner, 0.5), (inner, 0.5), (upper, 1.0))
    ]
    light = [Body(height=2e-3, centroid=1e-3, mass=0.01, inertia=(1e-6, 1e-6), rim_radius=0.05) for _ in range(4)]
    bearing = Bearing(Layout.tfp(), 2e-3, surfaces, light, gravity=9.81)
    links = {link.surface: link for link in Series(bearing, rims=True).links}
    radii = [links[k].effective for k in (1, 0, 3)]
    begins = FRICTIONS[0] * lengths[0]
    outer = [(mu * r - begins) / (r - lengths[0]) for mu, r in zip(FRICTIONS[1:], lengths[1:], strict=True)]
    native = {"lengths": radii, "frictions": [FRICTIONS[0], *outer], "capacities": capacities, "weight": WEIGHT}
    return bearing, {**native, "load": WEIGHT, "yield_displacement": YIELD, "vertical_stiffness": 1e6}


@pytest.mark.parametrize(("axes", "whole"), [((0, 1, 0), 1.5e-2), ((1, 1, 0), 5e-2)], ids=["one", "two directions"])
def test_a_slab_on_shallow_bearings_moves_as_on_those_of_opensees(axes, whole):
    """Four bearings: peak displacement to 1 %; the whole path, less well where frictions turn (docs/buildings.md)."""
    path, expected = on_shallow_bearings(*shallow(), axes)
    largest = np.linalg.norm(expected, axis=1).max()
    assert largest > 0.2
    assert np.linalg.norm(path, axis=1).max() == pytest.approx(largest, rel=1e-2)
    assert np.abs(path - expected).max() < whole * largest


def test_rims_of_inner_sliders_come_late_in_the_element_of_opensees():
    """Radii times 16: inner sliders meet their rims first, which the element lets slide on (docs/buildings.md)."""
    narrow, wide = (on_shallow_bearings(*shallow(16.0, room), (0, 1, 0)) for room in (1.0, 10.0))
    largest = np.abs(wide[1]).max()
    assert np.abs(narrow[1] - wide[1]).max() < 1e-6 * largest
    assert np.abs(wide[0] - wide[1]).max() < 1.5e-2 * largest
    assert np.abs(narrow[0] - narrow[1]).max() > 0.2 * largest


def on_shallow_bearings(bearing: Bearing, native: dict[str, Any], axes: tuple[int, int, int]) -> tuple[Array, Array]:
    """Paths of a bearing below a slab on four, of the own run and of OpenSees, shapes (k, 2) [m]."""
    ground, motion = record(0.0, 20.0, axes)
    mass = 4 * WEIGHT / 9.81
    slab, places = BaseSlab(mass, (10 * mass,) * 3), [(3.0, 3.0), (-3.0, 3.0), (-3.0, -3.0), (3.0, -3.0)]
    interface = Top.node(1e7, native["vertical_stiffness"], 1e6, 1e3, 2e2, 1e2)
    bearings = [BuildingBearing(bearing, interface, p, effects=Effects(bouc_wen="plastic")) for p in places]
    result = simulate(BuildingScene(Building.shear(slab, []), bearings, motion))
    answer = client(
        floors_given=[{"mass": mass, "inertia": slab.inertia, "mass_centre": (0.0, 0.0), "level": 0.0}],
        bearings_given=[{"position": p, **native} for p in places],
        ground=ground.T.tolist(),
        ground_step=SAMPLE,
        step=SAMPLE / 2,
        count=round(2 * 20.0 / SAMPLE),
        every=2,
        tolerance=1e-5 * WEIGHT,
    )
    return result.bearing_displacement[1:, 0, :2], np.array(answer["displacement"])[:, 0, :2]
