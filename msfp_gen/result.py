"""The result of a run: its rows, its events, and the views people ask for (dataset, summary, file)."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.history import Array, Counters, Event, History

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.characterise import Characterisation
    from msfp_gen.notes import Note
    from msfp_gen.scene import Scene

__all__ = ["Counters", "Event", "History", "Result"]


@dataclass(frozen=True, eq=False)
class Result:
    """What `simulate` gives, and what a RunError carries of a run that failed.

    status: "ok", "stopped" (the scene's stop was met) or the name of a failure; message: one line in words.
    provenance: versions and keys that say how the numbers came about. notes: where something that a model left out
    began to matter, and what followed (docs/effects.md).
    """

    scene: Scene
    history: History
    events: tuple[Event, ...] = ()
    counters: Counters = field(default_factory=Counters)
    status: str = "ok"
    message: str = ""
    provenance: dict[str, str] = field(default_factory=dict)
    notes: tuple[Note, ...] = ()

    @property
    def succeeded(self) -> bool:
        """Whether the run reached its end or the stop it was asked for."""
        return self.status in ("ok", "stopped")

    @property
    def friction_coefficient(self) -> Array:
        """Coefficient mu of every surface, ndarray, shape (T, n-1): by its law, or the constant one of the bearing."""
        recorded = self.history.friction_coefficient
        if recorded is not None:
            return recorded
        return np.broadcast_to(self.scene.bearing.arrays()["friction"], self.history.normal_force.shape)

    @cached_property
    def dataset(self) -> xr.Dataset:
        """Every row and event as an xarray.Dataset, units and meaning in the attributes; built when first asked for."""
        from msfp_gen.dataset import to_dataset

        return to_dataset(self)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """The run in a few numbers, plain and JSON-able, SI units; `summary.summarise` names the keys."""
        from msfp_gen.summary import summarise

        return summarise(self)

    def characterise(self) -> Characterisation:
        """Effective stiffness, damping, stages, capacity left, velocity and heat: see docs/characterise.md.

        Raises InputError where the bearing did not move.
        """
        from msfp_gen.characterise import characterise

        return characterise(self)

    def to_netcdf(self, path: str | Path) -> Path:
        """Write the dataset as netCDF-4, whole or not at all; a run that failed is saved with its status.

        Raises InputError where the suffix is not .nc or the folder does not exist.
        """
        from msfp_gen.dataset import write_netcdf

        return write_netcdf(self, path)

    def to_csv(self, path: str | Path) -> Path:
        """Write a header of `name [unit]` and one row an instant, with scene and origin in comments.

        This and the writers below raise InputError for another suffix or a folder that does not exist.
        """
        from msfp_gen.export import write_csv

        return write_csv(self, path)

    def to_parquet(self, path: str | Path) -> Path:
        """Write flat columns as Parquet, units in their metadata; InputError names the remedy without pyarrow."""
        from msfp_gen.export import write_parquet

        return write_parquet(self, path)

    def to_mat(self, path: str | Path) -> Path:
        """Write every variable for MATLAB, with structs `units`, `meaning` and `attributes`."""
        from msfp_gen.export import write_mat

        return write_mat(self, path)

    def save(self, path: str | Path) -> Path:
        """Write the format that the suffix names: .nc, .parquet, .csv or .mat."""
        from msfp_gen.export import save

        return save(self, path)

    @classmethod
    def from_netcdf(cls, path: str | Path) -> Result:
        """What `to_netcdf` wrote, its scene included. Raises InputError where `path` holds no result."""
        from msfp_gen.dataset import read_result

        return read_result(path)
