"""`BuildingResult`: what the run of a building gives."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.buildings.bearing_result import BearingResult, bearings_of
from msfp_gen.buildings.data import BuildingData
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.buildings.step import Coupling, State
from msfp_gen.common.arrays import Array
from msfp_gen.results.note import Note

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.buildings.characterise import BuildingCharacterisation


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
    def bearings(self) -> tuple[BearingResult, ...]:
        """The result of every bearing."""
        return bearings_of(self)

    @cached_property
    def notes(self) -> tuple[Note, ...]:
        """Messages of the monitors in order of time; each names its bearing (docs/buildings.md)."""
        from msfp_gen.buildings.notes import notes_of

        return notes_of(self)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Main results in SI units, as values that JSON can hold; `buildings.summary.summarise` lists the keys."""
        from msfp_gen.buildings.summary import summarise

        return summarise(self)

    @cached_property
    def dataset(self) -> xr.Dataset:
        """Rows as an xarray.Dataset, with units, meanings and signs in attributes; built at first use."""
        from msfp_gen.buildings.dataset import to_dataset

        return to_dataset(self)

    def characterise(self) -> BuildingCharacterisation:
        """Effective properties of the isolation system, and what is left of every bearing (docs/buildings.md).

        Raises InputError where the bearings did not move.
        """
        from msfp_gen.buildings.characterise import characterise_building

        return characterise_building(self)

    def to_netcdf(self, path: str | Path) -> Path:
        """Write rows and scene as netCDF-4 file, completely or not at all. Raises InputError as `Result.to_netcdf`."""
        from msfp_gen.buildings.files import write_netcdf

        return write_netcdf(self, path)

    def save(self, path: str | Path) -> Path:
        """Write the format of the suffix: .nc, .parquet, .csv or .mat. Raises InputError as `Result.save`."""
        from msfp_gen.buildings.files import save

        return save(self, path)

    @classmethod
    def from_netcdf(cls, path: str | Path) -> BuildingResult:
        """The result in a file that `to_netcdf` wrote, its scene included. Raises InputError for any other file."""
        from msfp_gen.buildings.reading import read_building

        return read_building(path, cls)


class Rows:
    """Rows of a run that grows."""

    def __init__(self, scene: BuildingScene) -> None:
        self.scene = scene
        self.states: list[State] = []
        self.ground: list[Array] = []
        self.bearings: list[list[tuple[Array, Array, Array, float]]] = [[] for _ in scene.bearings]

    def start(self, coupling: Coupling, state: State) -> None:
        """The row of the state at rest."""
        still = np.zeros((3, 6))
        coupling.responses = [port.trial(0.0, still, still) for port in coupling.ports]
        self.add(coupling, state)

    def add(self, coupling: Coupling, state: State) -> None:
        """The row of a state that the bearings have reached."""
        self.states.append(state)
        self.ground.append(coupling.lower(state.time)[:, :3])
        for rows, each in zip(self.bearings, coupling.responses, strict=True):
            rows.append((each.wrench, each.normal_force, each.sliding, each.dissipated))

    def result(self, coupling: Coupling) -> BuildingResult:
        """The rows until now."""
        columns = [[np.array(column) for column in zip(*rows, strict=True)] for rows in self.bearings]
        wrench, normal, sliding, dissipated = zip(*columns, strict=True)
        return BuildingResult(
            self.scene,
            np.array([each.time for each in self.states]),
            np.array([each.u for each in self.states]),
            np.array([each.v for each in self.states]),
            np.array([each.a for each in self.states]),
            np.array(self.ground),
            np.stack(wrench, axis=1),
            list(normal),
            list(sliding),
            np.stack(dissipated, axis=1),
            {"trials": coupling.trials, "tangents": coupling.tangents},
        )
