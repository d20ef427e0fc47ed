"""Cheaper models of the scene of a building (docs/studies.md)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from msfp_gen.buildings.building import Building
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.errors import InputError
from msfp_gen.scene.fidelity import (
    LEVEL,
    LOOSE,
    constant_friction,
    equivalent_pendulum,
    implicit_solver,
    lively_end,
    peak_speed,
    without_inertia,
)
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.scene_fields import Limits
from msfp_gen.scene.top import Top
from msfp_gen.specification.layout import Auto, Effects


def at_fidelity(scene: BuildingScene, word: str) -> BuildingScene | Scene:
    """The scene at a level of fidelity: "loose", "massless", "rigid", or "equivalent".

    "equivalent" gives the scene of one bearing that carries the whole building. Raises InputError of one line.
    """
    if word == "equivalent":
        return _equivalent(scene)
    if word == "loose" and scene.solver.rtol >= LOOSE:
        raise InputError(f"fidelity = 'loose': solver.rtol = {scene.solver.rtol:g} already; give less than {LOOSE:g}")
    bearings = scene.bearings if word == "loose" else [
        replace(mount, effects=without_inertia(mount.effects or Auto())) for mount in scene.bearings
    ]  # fmt: skip
    building = rigid_building(scene.building) if word == "rigid" else scene.building
    return replace(scene, building=building, bearings=bearings, solver=implicit_solver(scene.solver), fidelity=word)


def rigid_building(building: Building) -> Building:
    """The building as one rigid body with its nodes and without columns; its coordinates are the six rigid motions."""
    motions = building.rigid_motions
    zeros = np.zeros((6, 6))
    nodes = tuple(replace(node, rows=node.rows @ motions) for node in building.nodes)
    return Building(motions.T @ building.mass @ motions, zeros, zeros, nodes)


def _equivalent(scene: BuildingScene) -> Scene:
    """The scene of the equivalent pendulum of all bearings, which carries the building as a mass."""
    if len(set(scene.grounds[1])) > 1:
        raise InputError(
            "fidelity = 'equivalent': it has one motion of the ground, and bearings have motions of their own; give "
            "another model, such as 'rigid'"
        )
    speed, stacks = peak_speed(scene.first_ground, scene.end), []
    for mount, load in zip(scene.bearings, scene.axial_loads.tolist(), strict=True):
        stacks.append(constant_friction(mount.bearing, mount.law, load, speed))
    bearing = equivalent_pendulum(stacks, (scene.axial_loads / scene.axial_loads.sum()).tolist())
    mass = float(scene.axial_loads.sum()) / scene.gravity
    springs = [
        float(sum(getattr(mount.interface, name) for mount in scene.bearings))
        for name in ("vertical_stiffness", "vertical_damping")
    ]
    top = Top.mass(
        mass, inertia=mass, height=0.0, rotational_stiffness=LEVEL * mass * scene.gravity,
        vertical_stiffness=springs[0], vertical_damping=springs[1],
    )  # fmt: skip
    effects = Effects(dimension="spatial", sliders="massless", bouc_wen=scene.modelled[0].bouc_wen)
    limits = (
        None if scene.limits is None else Limits(displacement=scene.limits.displacement)
    )  # no other is of all bearings
    return Scene(
        bearing=bearing, motion=scene.first_ground, top=top, effects=effects, solver=implicit_solver(scene.solver),
        duration=lively_end(scene.first_ground, scene.end), output_step=scene.output_step, name=scene.name,
        limits=limits, fidelity="equivalent",
    )  # fmt: skip
