"""A scene in several versions: fields that take several values, and every combination of them."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msfp_gen.errors import InputError
from msfp_gen.scenefile import changed_scene

if TYPE_CHECKING:
    from msfp_gen.scene import Scene

MOST = 100_000
"""Scenes of one study: more is a slip of the pen."""


def varied_field(text: str) -> tuple[str, list[Any]]:
    """`motion.scale=0.5,1,2` as the path of a field and its values, written as in TOML. Raises InputError."""
    path, equals, values = text.partition("=")
    path = path.strip()
    if not equals or not path or not all(path.split(".")):
        raise InputError(f"--vary = {text!r}: give a field of the scene and its values: motion.scale=0.5,1,2")
    try:
        found = tomllib.loads(f"values = [{values}]")["values"]
    except (ValueError, RecursionError):
        raise InputError(
            f"--vary = {text!r}: the values are no TOML; numbers need no quotes, words do: top.kind='rig','mass'"
        ) from None
    if not found:
        raise InputError(f"--vary = {text!r}: there are no values; give some: motion.scale=0.5,1,2")
    return path, found


def varied_scenes(source: str | Path, fields: Sequence[tuple[str, list[Any]]]) -> list[Scene]:
    """A scene file or preset in every combination of values, the last field fastest; names say which.

    Raises InputError: a field is given twice, is none of a scene, or takes no such value.
    """
    paths = [path for path, _ in fields]
    if twice := [path for path in paths if paths.count(path) > 1]:
        raise InputError(f"--vary {twice[0]}: given twice; give all its values at once")
    combinations = list(product(*(values for _, values in fields)))
    if len(combinations) > MOST:
        raise InputError(f"--vary: {len(combinations)} combinations; give fewer than {MOST}")
    return [_named(changed_scene(source, dict(zip(paths, values, strict=True))), source, paths, values)
            for values in combinations]  # fmt: skip


def _named(scene: Scene, source: str | Path, paths: Sequence[str], values: Sequence[Any]) -> Scene:
    said = ", ".join(f"{path} = {value}" for path, value in zip(paths, values, strict=True))
    name = scene.name or Path(source).stem
    return replace(scene, name=f"{name}, {said}" if said else name)
