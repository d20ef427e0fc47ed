"""`BuildingResult`: what the run of a building gives."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.buildings.compiled_run import BuildingRun, unpacked
from msfp_gen.buildings.data import BuildingData
from msfp_gen.buildings.peaks import padded
from msfp_gen.common.arrays import Array
from msfp_gen.coupling.two_port import DISSIPATED
from msfp_gen.specification.contract import WORKS, names

if TYPE_CHECKING:
    from msfp_gen.buildings.characterise import BuildingCharacterisation
    from msfp_gen.results.files import Storage


@dataclass(frozen=True, eq=False, init=False, repr=False)
class BuildingResult(BuildingData):
    """The result of `simulate` of a building; a RunError has one in `.result` if the run failed after its start."""

    def __repr__(self) -> str:
        """The main results in ten lines at most."""
        from msfp_gen.buildings.summary import brief_text

        return brief_text(self)

    def _repr_html_(self) -> str:
        """The main results and the orbit of the bearing that moves most, for a notebook."""
        from msfp_gen.buildings.summary import brief_html

        return brief_html(self)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Main results in SI units, as values that JSON can hold; `buildings.summary.summarise` lists the keys."""
        from msfp_gen.buildings.summary import summarise

        return summarise(self)

    def characterise(self) -> BuildingCharacterisation:
        """Effective properties of the isolation system, and what is left of every bearing (docs/buildings.md).

        Raises InputError where the bearings did not move.
        """
        from msfp_gen.buildings.characterise import characterise_building

        return characterise_building(self)

    @classmethod
    def storage(cls) -> Storage:
        """The functions of `buildings/dataset.py`."""
        from msfp_gen.buildings import dataset

        return dataset


def result_of(run: BuildingRun) -> BuildingResult:
    """The rows of a run until now."""
    rows = unpacked(run)
    count = len(run.members)
    works = [dict(zip(names(WORKS), rows[f"work {i}"].T, strict=True)) for i in range(count)]
    return BuildingResult(
        scene=run.scene,
        time=rows["time"],
        displacement=rows["displacement"],
        velocity=rows["velocity"],
        acceleration=rows["acceleration"],
        ground=rows["ground"][:, 0],
        wrench=np.stack([rows[f"wrench {i}"] for i in range(count)], axis=1),
        normal_force=padded([rows[f"normal {i}"] for i in range(count)], np.nan),
        sliding=padded([rows[f"sliding {i}"] for i in range(count)], np.nan),
        dissipated=np.stack([sum((work[name] for name in DISSIPATED), np.zeros(1)) for work in works], axis=1),
        stored=np.stack([_stored(run, rows, i) + works[i]["friction_stored"] for i in range(count)], axis=1),
        damped=rows["damped"],
        received=rows["received"],
        input=rows["input"],
        support=rows["ground"][:, run.scene.grounds[1]],
        counts=run.run.counts,
        monitored=run.notes,
        recorded_peaks=run.peaks if len(rows["time"]) else None,
    )


def _stored(run: BuildingRun, rows: dict[str, Array], index: int) -> Array:
    """Energy of a bearing and of the springs of its interface, less that in friction, shape (k,) [J]."""
    upper, interface = rows[f"wrench {index}"][:, 1], run.scene.bearings[index].interface
    stiffness = [interface.stiffness, interface.stiffness, interface.vertical_stiffness]
    stiffness += 2 * [interface.rotational_stiffness]
    found: Array = 0.5 * (upper[:, :5] ** 2 / stiffness).sum(axis=1)
    for name in ("kinetic", "potential", "rim_stored", "seat_stored"):
        found = found + rows[f"{name} {index}"]
    return found
