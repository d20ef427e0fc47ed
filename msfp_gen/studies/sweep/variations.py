"""Parameter sweeps: a scene in every combination of the given values of some fields."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from msfp_gen.buildings.load import AnyScene, changed_scene
from msfp_gen.errors import InputError
from msfp_gen.scene.file.changes import keys_of
from msfp_gen.scene.scene import Scene

if TYPE_CHECKING:
    from msfp_gen.scene.file.suite import SuiteRecord

MAX_SCENES = 100_000  # of one sweep; more are taken to be a typing error


class Variation(NamedTuple):
    """A scene of a sweep: the file or preset that it comes from, and the varied fields by their paths."""

    source: str
    varied: Mapping[str, Any]
    scene: AnyScene


def varied_field(text: str) -> tuple[str, list[Any]]:
    """Path and values of a field from a text such as `motion.scale=0.5,1,2`; values as in TOML. Raises InputError."""
    path, equals, values = text.partition("=")
    path = path.strip()
    try:
        keys = keys_of(path) if equals else []
    except InputError:
        keys = []
    if not keys:
        raise InputError(f"--vary = {text!r}: give a field of the scene and its values: motion.scale=0.5,1,2")
    try:
        found = tomllib.loads(f"values = [{values}]")["values"]
    except (ValueError, RecursionError):
        raise InputError(
            f"--vary = {text!r}: the values are no TOML; texts need quotes, numbers do not: top.kind='rig','mass'"
        ) from None
    if not found:
        raise InputError(f"--vary = {text!r}: there are no values; give some: motion.scale=0.5,1,2")
    return path, found


def variations(
    source: str | Path, fields: Sequence[tuple[str, list[Any]]], records: Sequence[SuiteRecord] = ()
) -> list[Variation]:
    """The scenes of all combinations of values, the last field varying fastest; their names state the values.

    source: scene file or preset. fields: path and values of each. records: of a suite, in place of the motion of the
    scene; they vary slowest, as the field "record". Raises InputError: a field is given twice, does not exist, or does
    not accept a value.
    """
    paths = [path for path, _ in fields]
    if records and (motion := [path for path in paths if path.partition(".")[0] == "motion"]):
        raise InputError(f"--vary {motion[0]}: --suite gives the motion; change its records there")
    if repeated := [path for path in paths if paths.count(path) > 1]:
        raise InputError(f"--vary {repeated[0]}: given twice; give all its values at once")
    combinations = list(product(*(values for _, values in fields)))
    if len(combinations) * max(len(records), 1) > MAX_SCENES:
        each = " for each record" if records else ""
        raise InputError(f"--vary: {len(combinations)} combinations{each}; give at most {MAX_SCENES} in all")
    return [
        _variation(source, dict(zip(paths, values, strict=True)), record)
        for record in records or (None,)
        for values in combinations
    ]


def _variation(source: str | Path, varied: dict[str, Any], record: SuiteRecord | None) -> Variation:
    scene = changed_scene(source, varied)
    if record is not None:
        scene = record.of(scene) if isinstance(scene, Scene) else replace(scene, motion=record.motion)
        varied = {"record": record.name, **varied}
    values_text = ", ".join(f"{path} = {value}" for path, value in varied.items())
    name = scene.name or Path(source).stem
    return Variation(str(source), varied, replace(scene, name=f"{name}, {values_text}" if values_text else name))
