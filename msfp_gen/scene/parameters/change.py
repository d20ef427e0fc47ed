"""A scene with other values of some of its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.fields import errors_at
from msfp_gen.scene.parameters.parameter import Parameter
from msfp_gen.scene.parts import InitialState

if TYPE_CHECKING:
    from msfp_gen.motions.motion import Motion
    from msfp_gen.scene.scene import Scene


def changed_parameters(scene: Scene, values: Mapping[Parameter, float]) -> Scene:
    """`scene` with other values of parameters, which must be those of `parameters_of(scene, ...)`.

    Raises InputError where a field does not accept its value.
    """
    for parameter, value in values.items():
        scene = _changed(scene, parameter, float(value))
    return scene


def _changed(scene: Scene, parameter: Parameter, value: float) -> Scene:
    part, name = parameter.part, parameter.field
    if part == "motion":
        motion = scaled_motion(scene.motion, value / parameter.value) if name != "direction" else None
        motion = scene.motion.rotated(value - parameter.value) if motion is None else motion
        return replace(scene, motion=motion, motion_table=None)
    if part == "load":
        assert scene.load is not None
        return replace(scene, load=replace(scene.load, coefficients=value / parameter.value * scene.load.coefficients))
    if part == "initial_state":
        return replace(scene, initial_state=_state(scene, name, parameter.index, value))
    if part == "top":
        return replace(scene, top=_with(scene.top, name, parameter.index, value))
    if part == "bearing":
        return replace(scene, bearing=scene.bearing.replace(**{name: value}))
    rows = list(getattr(scene.bearing, part))
    row = parameter.index[0]
    with errors_at("surface" if part == "surfaces" else "body", f"bearing.{part}[{row}]"):
        rows[row] = _with(rows[row], name, parameter.index[1:], value)
    changes: dict[str, Any] = {part: rows}
    return replace(scene, bearing=replace(scene.bearing, **changes))


def scaled_motion(motion: Motion, factor: float) -> Motion:
    """A motion with its displacements multiplied by a factor; rotations of the base are unchanged."""
    coefficients = motion.coefficients.copy()
    coefficients[:, :3] *= factor
    return replace(motion, coefficients=coefficients)


def _with(owner: Any, name: str, component: tuple[int, ...], value: float) -> Any:
    """A copy of a surface, body or top with one number changed."""
    if not component:
        return replace(owner, **{name: value})
    numbers = list(getattr(owner, name))
    numbers[component[0]] = value
    return replace(owner, **{name: tuple(numbers)})


def _state(scene: Scene, name: str, index: tuple[int, ...], value: float) -> InitialState:
    """The initial state with one number changed; centred and at rest where the scene gives none."""
    count, state = scene.bearing.layout.surfaces, scene.initial_state
    arrays: dict[str, Any] = {
        key: np.zeros((count, size)) if state is None else np.array(getattr(state, key), dtype=float)
        for key, size in (("q", 3), ("v", 3), ("h", 2))
    }
    arrays[name][index] = value
    return InitialState(arrays["q"].tolist(), arrays["v"].tolist(), arrays["h"].tolist())
