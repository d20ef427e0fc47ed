"""What a worker needs to make the scene of a run: the base scene as a table, and what the axes change in it.

Only this module knows what the base of a study is; parts, pools and evaluations know rows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from msfp_gen.buildings.load import AnyScene, scene_of
from msfp_gen.errors import InputError
from msfp_gen.scene.file.changes import changed_table, keys_of, multiplied_table
from msfp_gen.scene.file.motion_tables import RecordMotion
from msfp_gen.scene.scene import Scene
from msfp_gen.studies.bounding import bounded_scene
from msfp_gen.studies.bounding.factors import FactorTable
from msfp_gen.studies.study.axes import Axis

Table = dict[str, Any]
INTENSITY = "intensity"  # column of the intensity measure of [records]


@dataclass(frozen=True)
class Recipe:
    """How the scenes of a study are made; small, so that it travels to workers.

    Attributes:
        scene: table of the base scene; paths in it are absolute.
        axes: in the order of the columns.
        records: name -> `[motion]` table, without its key `kind`.
        factors: name in the study file -> table of lambda factors.
        intensities: name of a record -> its intensity measure at scale 1 [m/s^2]; empty where none is asked for.
    """

    scene: Table
    axes: tuple[Axis, ...]
    records: dict[str, Table]
    factors: dict[str, FactorTable]
    intensities: dict[str, float]

    def intensity(self, at: Mapping[str, Any]) -> dict[str, float]:
        """The intensity measure of a run under its name [m/s^2]; empty where none is asked for. at: axis -> value."""
        if not self.intensities:
            return {}
        return {INTENSITY: self.intensities[at["record"]] * at.get("scale", 1.0)}


def motion_of(record: Table) -> Table:
    """The `[motion]` table of a scene, of a record."""
    return {"kind": RecordMotion.kind, **record}


class SceneFactory:
    """Makes the scenes of a study: each is what the reader of scene files makes of the table of the run.

    A motion that no axis changes is resolved once; what is made of other motions and of the frame of a building is kept
    by the reader.
    """

    def __init__(self, recipe: Recipe) -> None:
        self.recipe = recipe
        self.base = scene_of(recipe.scene)
        self._setting = sorted(  # a table before its fields
            (len(keys_of(path)), index, path)
            for index, axis in enumerate(recipe.axes)
            for path in axis.paths
            if axis.change == "sets"
        )
        changed = {path.partition(".")[0] for axis in recipe.axes for path in axis.paths}
        self._given: Table = {}
        if not recipe.records and "motion" not in changed:
            self._given["motion"] = self.base.motion
            if isinstance(self.base, Scene):
                self._given["motion_table"] = self.base.motion_table
        self._table = {key: value for key, value in recipe.scene.items() if key not in self._given}

    def scene(self, values: Sequence[Any]) -> AnyScene:
        """The scene of one value for each axis, in their order. Raises InputError."""
        axes, table = self.recipe.axes, self._table
        for _, index, path in self._setting:
            table = changed_table(table, {path: values[index]}, axes[index].surfaces)
        chosen = list(zip(axes, values, strict=True))
        for axis, value in chosen:
            if axis.change == "record":
                scale = next((each for axis, each in chosen if axis.change == "scale"), 1.0)
                table = {**table, "motion": motion_of(self._scaled(value, scale))}
            for path in axis.paths if axis.change == "multiplies" else ():
                table = multiplied_table(table, path, value, axis.surfaces)
        scene = scene_of(table, **self._given)
        for axis, value in chosen:
            if axis.change == "factors":
                scene = bounded_scene(scene, self.recipe.factors[axis.paths[0]], value)
        return scene

    def _scaled(self, name: str, factor: float) -> Table:
        """The `[motion]` table of a record times a factor."""
        table = self.recipe.records[name]
        if not factor > 0:
            raise InputError(f"scale = {factor:g}: give a number above 0")
        if factor == 1.0:
            return table
        whole = float(RecordMotion(**table).build().metadata["scale"]) * factor
        return {**{key: value for key, value in table.items() if key not in ("scale", "scale_to")}, "scale": whole}
