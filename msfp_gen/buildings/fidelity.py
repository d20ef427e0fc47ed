"""Cheaper models of a building, made from its scene: `building_at_fidelity` (docs/fidelity.md)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from msfp_gen.buildings.building import Building
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.errors import InputError
from msfp_gen.scene.fidelity import LEVEL, LOOSE, equivalent_pendulum, implicit_solver, labelled
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.top import Top
from msfp_gen.specification.layout import Effects


def building_at_fidelity(scene: BuildingScene, word: str) -> BuildingScene | Scene:
    """The scene at a level of fidelity: "exact" (as it is), "backbone", "loose", "massless", "rigid", or "equivalent".

    The last is the scene of one bearing that carries the whole building. Raises InputError of one line.
    """
    if word in ("exact", "backbone"):
        return labelled(scene, word)
    if word == "equivalent":
        return _equivalent(scene)
    if word == "loose" and scene.solver.rtol >= LOOSE:
        raise InputError(f"fidelity = 'loose': solver.rtol = {scene.solver.rtol:g} already; give less than {LOOSE:g}")
    bearings = scene.bearings if word == "loose" else [
        replace(one, effects=replace(effects, sliders="massless", uplift=False))
        for one, effects in zip(scene.bearings, scene.modelled, strict=True)
    ]  # fmt: skip
    building = rigid_building(scene.building) if word == "rigid" else scene.building
    return replace(scene, building=building, bearings=bearings, solver=implicit_solver(scene.solver), fidelity=word)


def rigid_building(building: Building) -> Building:
    """The building as one rigid body: its coordinates are the six rigid motions; nodes stay, columns do not."""
    motions = building.rigid_motions
    none = np.zeros((6, 6))
    nodes = tuple(replace(node, rows=node.rows @ motions) for node in building.nodes)
    return Building(motions.T @ building.mass @ motions, none, none, nodes)


def load_shares(scene: BuildingScene) -> list[float]:
    """The share of the weight that each bearing carries at rest."""
    shares: list[float] = (scene.axial_loads / scene.axial_loads.sum()).tolist()
    return shares


def _equivalent(scene: BuildingScene) -> Scene:
    bearing = equivalent_pendulum(scene.every_bearing, load_shares(scene))
    mass = float(scene.axial_loads.sum()) / scene.gravity
    springs = [
        float(sum(getattr(one.interface, name) for one in scene.bearings))
        for name in ("vertical_stiffness", "vertical_damping")
    ]
    top = Top.mass(
        mass, inertia=mass, height=0.0, rotational_stiffness=LEVEL * mass * scene.gravity,
        vertical_stiffness=springs[0], vertical_damping=springs[1],
    )  # fmt: skip
    effects = Effects(dimension="spatial", sliders="massless", bouc_wen=scene.modelled[0].bouc_wen)
    return Scene(
        bearing=bearing, motion=scene.motion, top=top, effects=effects, solver=implicit_solver(scene.solver),
        duration=scene.duration, output_step=scene.output_step, name=scene.name, fidelity="equivalent",
    )  # fmt: skip
