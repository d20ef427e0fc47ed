"""Soil below the bearings of a building: the run with both in series is that on supports that follow the soil."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import lsim
from support import Array
from support.buildings import INTERFACE, frame, scene

from msfp_gen import Effects, Motion, Soil, simulate
from msfp_gen.buildings.result import BuildingResult

SOIL = Soil(2e7, 1e8, damping=2e4, vertical_damping=2e5)
SPRINGS = (
    (SOIL.stiffness, SOIL.damping),
    (SOIL.stiffness, SOIL.damping),
    (SOIL.vertical_stiffness, SOIL.vertical_damping),
)


def sunk(result: BuildingResult, index: int) -> Array:
    """Deformation of the soil below a bearing under the force on its lower end, from rest, shape (k, 3) [m]."""
    force = result.wrench[:, index, 0, :3] - result.wrench[0, index, 0, :3]
    found = [
        lsim(([[-k / c]], [[1 / c]], [[1.0]], [[0.0]]), -column, result.time)[1]
        for column, (k, c) in zip(force.T, SPRINGS, strict=True)
    ]
    return np.column_stack(found)


def test_supports_that_follow_the_soil_give_the_same_run():
    """Forces below the bearings of the run with soil, on springs of the soil, are the motions of supports."""
    rigid = scene(frame(), duration=1.5, output_step=2.5e-3)
    rigid = replace(rigid, bearings=[replace(each, effects=Effects()) for each in rigid.bearings])
    soft = replace(rigid, bearings=[replace(each, interface=SOIL.below(INTERFACE)) for each in rigid.bearings])
    whole = simulate(soft)
    motions = [Motion.from_arrays(whole.time, whole.ground[:, 0] + sunk(whole, i)) for i in range(4)]
    bearings = [replace(each, motion=motion) for each, motion in zip(rigid.bearings, motions, strict=True)]
    parts, stiff = simulate(replace(rigid, bearings=bearings)), simulate(rigid)
    weight = rigid.axial_loads.mean()
    differences = [
        (
            np.abs(other.node("floor 3")[:, 0, :3] - whole.node("floor 3")[:, 0, :3]).max(),
            np.abs(other.axial_force - whole.axial_force).max() / weight,
        )
        for other in (parts, stiff)
    ]
    assert differences[0][0] < 3e-5 and differences[0][1] < 3e-3
    assert differences[1][0] > 1e-3 and differences[1][1] > 3e-2
