"""Floor spectra of a building: the accelerations at the ends of all steps come in, peaks of oscillators go out."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.buildings.extremes import corner_points
from msfp_gen.buildings.storey import rigid
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.motions.records.spectrum import displacements

PERIODS = np.geomspace(0.03, 5.0, 120)  # unless others are given [s]
KEPT = np.geomspace(0.03, 5.0, 40)  # of the spectra in the rows of a suite [s]
SAMPLE = 1e-3  # between the samples of an acceleration that is linear in every step [s]


class Steps(NamedTuple):
    """What is recorded at the start of a run and at the end of every step.

    time: shape (s,) [s]. acceleration: of the nodes, shape (s, nodes, 6) [m/s^2, rad/s^2].
    """

    time: Array
    acceleration: Array


class FloorSpectra(NamedTuple):
    """Pseudo-acceleration spectra of the floors of a building, along E1, E2 and E3.

    periods: shape (p,) [s]. damping: ratio to the critical damping [-]. names: of the nodes. nodes: of a floor at its
    centre of mass, shape (nodes, p, 3) [m/s^2]. corners: the largest at the corners of the plan on this floor, of a
    node that is no floor as `nodes`, shape (nodes, p, 3) [m/s^2].
    """

    periods: Array
    damping: float
    names: tuple[str, ...]
    nodes: Array
    corners: Array


def kept_spectra(result: Any) -> dict[str, Any]:
    """The spectra of the floors of a `BuildingResult` as plain data, for the row of a suite.

    periods [s], damping [-], floors: name -> the larger of both horizontal directions, and vertical [m/s^2]; of a rigid
    floor the largest at the corners of the plan.
    """
    found = floor_spectra(result, KEPT, 0.05)
    floors = {
        name: [_short(corners[:, :2].max(axis=1)), _short(corners[:, 2])]
        for name, corners in zip(found.names, found.corners, strict=True)
    }
    return {"periods": _short(found.periods), "damping": found.damping, "floors": floors}


def _short(values: Array) -> list[float]:
    return [float(f"{value:.5g}") for value in values]


def floor_spectra(result: Any, periods: ArrayLike | None, damping: float) -> FloorSpectra:
    """The spectra of a `BuildingResult`; arguments and errors as in `BuildingResult.floor_spectra`."""
    chosen = PERIODS if periods is None else np.asarray(periods, dtype=float)
    if chosen.ndim != 1 or not chosen.size or not np.all((chosen > 0) & np.isfinite(chosen)):
        raise InputError(f"periods = {chosen.tolist()!r:.60}: give a list of positive numbers [s]")
    if not 0 < damping < 1:
        raise InputError(f"damping = {damping!r}: give a ratio above 0 and below 1")
    nodes = result.scene.building.nodes
    time, end = result.steps.time, float(result.steps.time[-1])
    sampled = np.linspace(0.0, end, max(2, round(end / SAMPLE) + 1))
    at_nodes, at_corners = np.zeros((2, len(nodes), len(chosen), 3))
    if not end > 0:  # a run that ended at its start
        return FloorSpectra(chosen, float(damping), tuple(node.name for node in nodes), at_nodes, at_corners)
    for index, node in enumerate(nodes):
        motion = result.steps.acceleration[:, index]
        motion = np.column_stack([np.interp(sampled, time, freedom) for freedom in motion.T])
        points = corner_points(result.scene, node.position) if node.floor else node.position[None]
        arms = np.concatenate([rigid(point - node.position)[:3] for point in points])
        for row, period in enumerate(chosen):
            response = displacements(motion, float(sampled[1]), float(period), damping) * (2 * np.pi / period) ** 2
            at_nodes[index, row] = np.abs(response[:, :3]).max(axis=0)
            at_corners[index, row] = np.abs(response @ arms.T).max(axis=0).reshape(-1, 3).max(axis=0)
    return FloorSpectra(chosen, float(damping), tuple(node.name for node in nodes), at_nodes, at_corners)
