"""Where a run starts whose plates are out of level from the beginning: built level, then turned slowly."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.layout import Auto, Effects
from msfp_gen.motion import Motion
from msfp_gen.piecewise import ORDER, Array
from msfp_gen.prescribed import Load, Rotation
from msfp_gen.scene import InitialState
from msfp_gen.solver import Solver

if TYPE_CHECKING:
    from msfp_gen.scene import Scene

TURNING, RESTING = 10.0, 2.0  # how long the plates turn, and rest before the run [s]


def needs_settling(scene: Scene) -> bool:
    """Whether a plate is turned at the start, and nobody says where the bodies are."""
    turned = np.any(scene.motion.rotation(0.0)[:2])
    held = scene.top_rotation is not None and np.any(scene.top_rotation.evaluate(0.0))
    return scene.initial_state is None and bool(turned or held)


def prelude(scene: Scene) -> Scene:
    """The scene before the scene: plates turn from level to where they are at time zero, under the load of then."""
    psi, theta = (float(x) for x in scene.motion.rotation(0.0)[:2])
    place = np.zeros((1, 6, ORDER))
    place[0, :3, 0] = scene.motion.displacement(0.0)
    motion = Motion(np.array([0.0, TURNING + RESTING]), place).rocking(Rotation.ramp(psi, theta, duration=TURNING))
    rotation = scene.top_rotation
    if rotation is not None:
        rotation = Rotation.ramp(*(float(x) for x in rotation.evaluate(0.0)), duration=TURNING)
    load = None if scene.load is None else Load.constant(*np.split(scene.load.evaluate(0.0), 2))
    return replace(
        scene, motion=motion, motion_table=None, top_rotation=rotation, load=load, duration=None, stop=None,
        output_step=None, effects=_effects(scene), solver=Solver(rtol=min(1e-4, scene.solver.rtol)),
    )  # fmt: skip


def _effects(scene: Scene) -> Auto:
    """The law of friction of the scene; the rest as slow turning asks for."""
    asked = scene.effects
    spin = "locked" if asked.spin == "free" else asked.spin
    rims = asked.rims if isinstance(asked, Effects) else None
    return Auto(
        rims=rims, spin=spin, bouc_wen=asked.bouc_wen, friction=asked.friction, friction_law=asked.friction_law
    )


def at_rest(q: Array, h: Array) -> InitialState:
    """Angles and friction of the end of a prelude, without rates."""
    size = np.maximum(1.0, np.linalg.norm(h, axis=1, keepdims=True))
    return InitialState(q.tolist(), np.zeros_like(q).tolist(), (h / size).tolist())
