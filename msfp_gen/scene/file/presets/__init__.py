"""Presets by name: bearings and scenes, TOML files in this folder, and presets of other kinds of systems."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msfp_gen.scene.file import catalogue

if TYPE_CHECKING:
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.scene import Scene


def names(kind: str | None = None) -> dict[str, str]:
    """Name -> one line of description, of the presets of a `kind` ("bearing", "scene", "building"), or of all."""
    kinds = catalogue.words_of_presets() if kind is None else (kind,)
    return {name: line for word in kinds for name, line in catalogue.descriptions(word).items()}


def bearing(name: str) -> Bearing:
    """The bearing `name`, such as "fenz-tfp". Raises InputError for an unknown name."""
    from msfp_gen.scene.file.loader import bearing_from_table

    return bearing_from_table({"preset": name})


def scene(name: str) -> Scene:
    """The scene of one bearing `name`, such as "fenz-test2"; `load_scene` also opens buildings.

    Raises InputError for an unknown name.
    """
    from msfp_gen.scene.file.loader import scene_from_table

    return scene_from_table(catalogue.preset_scene_table(name))
