"""The scenes that the tables of `docs/` measure: `plain_scene`, `plain_hospital`."""

from __future__ import annotations

from dataclasses import replace

from msfp_gen import BuildingScene, Effects, Scene, load_scene, presets


def plain_scene(name: str) -> Scene:
    """A preset; of an earthquake its record under a rigid mass, with constant friction and the Bouc-Wen law of the report.

    Tables of speed and accuracy compare laws and methods, and other programs have no heat.
    """
    scene = load_scene(name)
    if not name.startswith("ridgecrest"):
        return scene
    rigid = replace(scene.top, vertical_stiffness=None, vertical_damping=0.0)
    return replace(scene, bearing=presets.bearing("prototype-tfp"), top=rigid, effects=Effects())


def plain_hospital(name: str) -> BuildingScene:
    """A preset of the hospital, with constant friction and the Bouc-Wen law of the report."""
    scene = load_scene(name)
    assert isinstance(scene, BuildingScene)
    bearing = presets.bearing("building-tfp")
    return replace(scene, bearings=[replace(each, bearing=bearing, effects=None) for each in scene.bearings])
