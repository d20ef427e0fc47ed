"""Initial state of a scene whose plates are tilted at the start: a bearing in level position is tilted slowly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.piecewise import ORDER
from msfp_gen.motions.prescribed import Load, Rotation
from msfp_gen.scene.scene_fields import InitialState
from msfp_gen.scene.solver import Solver
from msfp_gen.specification.friction_laws import SPIN
from msfp_gen.specification.layout import Auto

if TYPE_CHECKING:
    from msfp_gen.results.gradient import Gradients
    from msfp_gen.results.history import History
    from msfp_gen.scene.parameters import Parameter
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
    effects = scene.effects
    spin = effects.spin if SPIN[effects.spin].moment else "locked"
    return Auto(
        rims=effects.rims,
        spin=spin,
        bouc_wen=effects.bouc_wen,
        friction=effects.friction,
        friction_law=effects.friction_law,
    )


@dataclass(frozen=True, eq=False)
class StartSlopes:
    """Derivatives of the state after settling with respect to k parameters.

    q: of the angles, shape (k, n-1, 3) [rad per unit of the parameter]. h: of the friction state, shape
    (k, n-1, 2) [per unit of the parameter].
    """

    q: Array
    h: Array


def moves_settling(parameter: Parameter, settling: Scene) -> bool:
    """Whether the state after settling may depend on a parameter.

    Not on how the base moves afterwards, nor on contacts that the slow tilting does not model.
    """
    if parameter.field.startswith("seat_"):
        return settling.effect_selection.effects.uplift
    return parameter.part != "motion"


def start_slopes(history: History, gradients: Gradients | None, parameters: Sequence[Parameter]) -> StartSlopes:
    """The derivatives of the state in which settling ended, of those parameters for which it has them."""
    surfaces = history.tilt_angles.shape[1]
    slopes = StartSlopes(np.zeros((len(parameters), surfaces, 3)), np.zeros((len(parameters), surfaces, 2)))
    if gradients is None:
        return slopes
    known = {parameter.path for parameter in gradients.parameters}
    moving = [parameter.path in known for parameter in parameters]
    slopes.q[moving] = gradients.arrays["tilt_angles"][:, -1]
    h, dh = history.friction_state[-1], gradients.arrays["friction_state"][:, -1]
    size = np.linalg.norm(h, axis=1, keepdims=True)
    along = (h * dh).sum(axis=2, keepdims=True) / np.maximum(1.0, size**2)
    # `state_at_rest` limits the size of h to 1.
    slopes.h[moving] = np.where(size > 1.0, (dh - h * along) / np.maximum(1.0, size), dh)
    return slopes


def state_at_rest(q: Array, h: Array) -> InitialState:
    """Initial state with angles q, shape (n-1, 3) [rad], friction state h, shape (n-1, 2), and zero rates."""
    norm = np.maximum(1.0, np.linalg.norm(h, axis=1, keepdims=True))
    return InitialState(q.tolist(), np.zeros_like(q).tolist(), (h / norm).tolist())
