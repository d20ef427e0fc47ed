"""Paths of parameters: what they stand for, what is refused, and scenes with other values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support import scene_of

from msfp_gen import InputError, Load, Motion, Scene, load_scene
from msfp_gen.scene.parameters import changed_parameters, parameters_of

SCENE = load_scene("fenz-test2")


def paths_of(*texts: str, scene: Scene = SCENE) -> list[str]:
    return [parameter.path for parameter in parameters_of(scene, texts)]


def test_a_star_stands_for_all() -> None:
    found = parameters_of(SCENE, ["bearing.surfaces[*].friction", "bearing.bodies[3].inertia[*]"])
    assert [p.path for p in found[:4]] == [f"bearing.surfaces[{i}].friction" for i in range(4)]
    assert [p.value for p in found[:4]] == [surface.friction for surface in SCENE.bearing.surfaces]
    assert [p.path for p in found[4:]] == ["bearing.bodies[3].inertia[0]", "bearing.bodies[3].inertia[1]"]
    assert [p.unit for p in found] == [""] * 4 + ["kg m^2"] * 2


def test_short_forms_and_other_parts() -> None:
    assert paths_of("bearing.friction[2]", "bearing.mass[0]") == [
        "bearing.surfaces[2].friction",
        "bearing.bodies[0].mass",
    ]
    assert paths_of("bearing.gravity", "top.axial_load", "initial_state.q[1][*]") == [
        "bearing.gravity",
        "top.axial_load",
        *(f"initial_state.q[1][{i}]" for i in range(3)),
    ]
    (scale,) = parameters_of(load_scene("ridgecrest-ccc"), ["motion.scale"])
    (amplitude,) = parameters_of(SCENE, ["motion.amplitude"])
    assert (scale.path, scale.unit) == ("motion.scale", "")
    assert (amplitude.unit, amplitude.value) == ("m", 0.025)


def test_lists_are_checked() -> None:
    with pytest.raises(InputError, match="given twice"):
        parameters_of(SCENE, ["bearing.friction[0]", "bearing.surfaces[*].friction"])
    with pytest.raises(InputError, match="give a list of paths"):
        parameters_of(SCENE, "bearing.gravity")


@pytest.mark.parametrize(
    "path",
    [
        "bearing.surfaces[1].radius", "bearing.bodies[0].inertia[0]", "bearing.base_height", "top.stiffness",
        "motion.scale", "motion.direction", "load.scale", "initial_state.q[0][1]",
    ],
)  # fmt: skip
def test_a_changed_parameter_has_its_value(path: str) -> None:
    scene = scene_of("fenz-test2", load=Load.constant((100.0, 0, 0)))
    (parameter,) = parameters_of(scene, [path])
    value = parameter.value * 1.01 if parameter.value else 1e-3
    changed = changed_parameters(scene, {parameter: value})
    assert changed != scene
    if parameter.part not in ("motion", "load"):
        (again,) = parameters_of(changed, [path])
        assert again.value == pytest.approx(value)


def test_motions_are_scaled_and_turned() -> None:
    scene = replace(SCENE, motion=Motion.harmonic(0.02, 0.5), motion_table=None, duration=None)
    scale, direction = parameters_of(scene, ["motion.scale", "motion.direction"])
    turned = changed_parameters(scene, {scale: 2.0, direction: np.pi / 2}).motion.displacement(1.2)
    assert turned == pytest.approx(2.0 * scene.motion.displacement(1.2)[[1, 0, 2]], abs=1e-12)


def test_values_are_checked() -> None:
    (friction,) = parameters_of(SCENE, ["bearing.surfaces[1].friction"])
    with pytest.raises(InputError, match=r"bearing.surfaces\[1\].friction = -0.1"):
        changed_parameters(SCENE, {friction: -0.1})
