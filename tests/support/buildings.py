"""A small eccentric frame on four triple pendulums, for tests."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from msfp_gen import Auto, BaseSlab, Bearing, Building, Effects, Motion, Solver, Storey, Top, presets, simulate
from msfp_gen.buildings.bearing import BuildingBearing
from msfp_gen.buildings.extremes import OF_SURFACES, BuildingExtremes, corner_points
from msfp_gen.buildings.result import BuildingResult
from msfp_gen.buildings.scene import BuildingScene

BEARING = presets.bearing("fenz-tfp").replace(contact_damping=1e-4)
LOAD = 112e3  # on each bearing on average [N]
MASS = 4 * LOAD / BEARING.gravity
INTERFACE = Top.node(1e7, 5e7, 1e6, damping=1e4, vertical_damping=1e5, rotational_damping=1e3)
PLACES = ((3.0, 2.0), (-3.0, 2.0), (-3.0, -2.0), (3.0, -2.0))  # [m]
MOTION = Motion.harmonic(0.05, 0.6, cycles=1)
BASE = BaseSlab(0.4 * MASS, (3 * MASS, 3 * MASS, 6 * MASS))


def stiffness(frequency: float, mass: float) -> float:
    return mass * (2 * np.pi * frequency) ** 2


def storey(frequency: float = 5.0, eccentricity: tuple[float, float] = (0.3, 0.1)) -> Storey:
    """A storey whose mass swings at that frequency on its own columns [Hz], and at 20 Hz vertically."""
    mass = 0.2 * MASS
    vertical = stiffness(20.0, mass)
    return Storey(
        height=3.0,
        mass=mass,
        inertia=(MASS, MASS, 2 * MASS),
        stiffness=stiffness(frequency, mass),
        torsional_stiffness=stiffness(1.4 * frequency, 10 * mass),
        mass_centre=eccentricity,
        vertical_stiffness=vertical,
        rocking_stiffness=9 * vertical,
    )


def frame(**options: object) -> Building:
    """Three storeys."""
    return Building.shear(BASE, 3 * [storey(**options)], 0.05)  # type: ignore[arg-type]


def rocking(effects: Effects | Auto | None, rtol: float = 1e-3, bearing: Bearing = BEARING) -> BuildingScene:
    """A slender frame, whose outer bearings lift off in turn."""
    building = Building.shear(BASE, 3 * [replace(storey(), height=6.0)], 0.05)
    bearings = [BuildingBearing(bearing, INTERFACE, place, effects=effects) for place in PLACES]
    return BuildingScene(building, bearings, Motion.harmonic(0.07, 0.8, cycles=2), Solver(rtol=rtol))


def scene(building: Building, rtol: float = 1e-4, bearing: Bearing = BEARING, **changes: object) -> BuildingScene:
    """The building on four bearings under two seconds of a motion along E1."""
    interface = changes.pop("interface", INTERFACE)
    bearings = [BuildingBearing(bearing, interface, place) for place in PLACES]  # type: ignore[arg-type]
    made = BuildingScene(building, bearings, MOTION, Solver(rtol=rtol), 2.0)
    return replace(made, **changes)  # type: ignore[arg-type]


@cache
def pushed_scene() -> BuildingScene:
    """The frame on four bearings, of which two have names, under a short push along E1 and E2."""
    push = Motion.harmonic(0.05, 0.6, direction=0.4, cycles=1)
    given = scene(frame(), motion=push, duration=0.8, output_step=0.02, name="frame")
    named = zip(given.bearings, ("A", "B", "", ""), strict=True)
    return replace(given, bearings=[replace(each, name=name) for each, name in named])


@cache
def pushed() -> BuildingResult:
    """The run of that scene."""
    return simulate(pushed_scene())


def largest(vectors: np.ndarray) -> np.ndarray:
    """Largest along time by axis and in the horizontal plane: (..., T, 3) to shape (..., 4)."""
    radial = np.hypot(vectors[..., 0], vectors[..., 1]).max(axis=-1)
    return np.concatenate([np.abs(vectors).max(axis=-2), radial[..., None]], axis=-1)


def extremes_of_rows(result: BuildingResult) -> BuildingExtremes:
    """Extremes of the rows alone, by the properties of the result; of contacts the rows know nothing."""
    scene = result.scene
    names = [node.name for node in scene.building.nodes]
    nodes = np.reshape([result.node(name) for name in names], (len(names), len(result.time), 3, 6))
    across = -np.moveaxis(result.bearing_displacement, 1, 0)
    normal = np.nan_to_num(result.normal_force)
    most = {name: np.nan_to_num(getattr(result, name)).max(axis=0) for name in OF_SURFACES}
    force, axial = np.moveaxis(result.wrench[:, :, 1, :3], 1, 0), result.axial_force
    capacities = [one.arrays()["capacity"] for one in scene.every_bearing]
    base = scene.bearings[0].node
    points = {node.name: corner_points(scene, node.position) for node in scene.building.nodes}

    def of_corners(order: int) -> np.ndarray:
        motions = [[node.linked(point)[:3] for point in points[node.name]] for node in scene.building.nodes]
        vectors = np.einsum(
            "ncij,kj->nkci", motions, (result.displacement, result.velocity, result.acceleration)[order]
        )
        vectors = vectors if order else vectors - result.ground[:, 0][:, None]
        return largest(np.moveaxis(vectors, 1, 2)).max(axis=1)

    return BuildingExtremes(
        node_acceleration=largest(nodes[:, :, 2, :3]),
        node_displacement=largest(nodes[:, :, 0, :3] - result.ground[:, 0]),
        corner_acceleration=of_corners(2),
        corner_displacement=of_corners(0),
        drift=largest(np.moveaxis(result.drift[..., :3], 1, 0)),
        corner_drift=largest(np.moveaxis(result.corner_drift, 0, -2)).max(axis=1, initial=0.0),
        storey_shear=largest(np.moveaxis(result.storey_force[..., :3], 1, 0)),
        storey_torsion=np.abs(result.storey_force[..., 5]).max(axis=0),
        base_twist=np.abs(result.node(base)[:, 0, 5]).max(keepdims=True),
        mean_displacement=largest(across.mean(axis=0)),
        overturning_moment=largest(np.pad(result.overturning_moment, ((0, 0), (0, 1)))),
        base_reaction=largest(result.base_reaction),
        base_torsion=np.abs(result.base_torsion).max(keepdims=True),
        energy=np.array([result.kinetic.max(), result.strain.max()]),
        bearing_displacement=largest(across),
        top_force=largest(force),
        axial_force=np.stack([axial.min(axis=0), axial.max(axis=0)], axis=1),
        **most,
        contact_offset=np.zeros_like(most["lift"]),
        rims_met=(result.sliding >= capacities).sum(axis=2).max(axis=0),
        times={},
        normal_force=np.stack([normal.min(axis=0), normal.max(axis=0)], axis=1),
    )
