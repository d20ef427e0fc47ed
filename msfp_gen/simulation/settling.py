"""Initial state of a scene whose plates are tilted at the start: a bearing in level position is tilted slowly."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.piecewise import ORDER
from msfp_gen.motions.prescribed import Load, Rotation
from msfp_gen.scene.scene_fields import InitialState
from msfp_gen.scene.solver import Solver
from msfp_gen.specification.layout import Auto

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene

TILTING, RESTING = 10.0, 2.0  # duration of the tilting of the plates, and of the rest after it [s]


def needs_settling(scene: Scene) -> bool:
    """Whether base or support of the top are tilted at the start, and no initial state is given."""
    base = np.any(scene.motion.rotation(0.0)[:2])
    support = scene.top_rotation is not None and np.any(scene.top_rotation.evaluate(0.0))
    return scene.initial_state is None and bool(base or support)


def settling_scene(scene: Scene) -> Scene:
    """The run before a run: the plates are tilted from level to their rotation at time zero, under the load at zero."""
    psi, theta = (float(x) for x in scene.motion.rotation(0.0)[:2])
    position = np.zeros((1, 6, ORDER))
    position[0, :3, 0] = scene.motion.displacement(0.0)
    motion = Motion(np.array([0.0, TILTING + RESTING]), position).rocking(Rotation.ramp(psi, theta, duration=TILTING))
    rotation = scene.top_rotation
    if rotation is not None:
        rotation = Rotation.ramp(*(float(x) for x in rotation.evaluate(0.0)), duration=TILTING)
    load = None if scene.load is None else Load.constant(*np.split(scene.load.evaluate(0.0), 2))
    return replace(
        scene,
        motion=motion,
        motion_table=None,
        top_rotation=rotation,
        load=load,
        duration=None,
        stop=None,
        output_step=None,
        effects=_effects(scene),
        solver=Solver(rtol=min(1e-4, scene.solver.rtol)),
    )


def _effects(scene: Scene) -> Auto:
    """Rims and friction law as given in the scene; the other effects are selected for the slow tilting."""
    given = scene.effects
    spin = "locked" if given.spin == "free" else given.spin
    return Auto(
        rims=given.rims,
        spin=spin,
        bouc_wen=given.bouc_wen,
        friction=given.friction,
        friction_law=given.friction_law,
    )


def state_at_rest(q: Array, h: Array) -> InitialState:
    """Initial state with angles q, shape (n-1, 3) [rad], friction state h, shape (n-1, 2), and zero rates."""
    norm = np.maximum(1.0, np.linalg.norm(h, axis=1, keepdims=True))
    return InitialState(q.tolist(), np.zeros_like(q).tolist(), (h / norm).tolist())
