"""`Result`: the result of a run, with its dataset, summary, characterisation and files."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msfp_gen.results.history import Counters, Event, History
from msfp_gen.results.run_data import RunData

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.analysis.characterise import Characterisation

__all__ = ["Counters", "Event", "History", "Result"]


@dataclass(frozen=True, eq=False, init=False)
class Result(RunData):
    """The result of `simulate`; a RunError has one in `.result` if the run failed after its start.

    status: "ok", "stopped" (the stop condition of the scene was met) or the name of a failure; message: one line of
    text, "" for a run that succeeded. counters: the work of the solver. provenance: versions, model keys and solver
    options with which the result was computed. notes: messages of the monitors, in order of time (docs/effects.md).
    """

    def __repr__(self) -> str:
        """The main results in ten lines at most."""
        from msfp_gen.analysis.brief import brief_text

        return brief_text(self)

    def _repr_html_(self) -> str:
        """The main results and the hysteresis loop, for a notebook."""
        from msfp_gen.analysis.brief import brief_html

        return brief_html(self)

    @cached_property
    def dataset(self) -> xr.Dataset:
        """Rows and events as an xarray.Dataset, with units and meanings in attributes; built at first use."""
        from msfp_gen.results.dataset import to_dataset

        return to_dataset(self)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Main results of the run in SI units, as values that JSON can hold; `summary.summarise` lists the keys."""
        from msfp_gen.analysis.summary import summarise

        return summarise(self)

    @cached_property
    def gradient(self) -> xr.Dataset:
        """Derivatives of the dataset with respect to parameters, first dimension `parameter`; docs/gradients.md.

        Raises InputError where the run computed none.
        """
        from msfp_gen.results.gradient_dataset import to_gradient_dataset

        return to_gradient_dataset(self)

    @cached_property
    def gradient_summary(self) -> dict[str, dict[str, Any]]:
        """Derivatives of the scalars of the summary, by the path of the parameter; docs/gradients.md.

        Raises InputError where the run computed none.
        """
        from msfp_gen.analysis.gradient_summary import summarise_gradients

        return summarise_gradients(self)

    def characterise(self) -> Characterisation:
        """Effective stiffness, damping, sliding regimes, remaining capacity, velocity and heat (docs/characterise.md).

        Raises InputError where the bearing did not move.
        """
        from msfp_gen.analysis.characterise import characterise

        return characterise(self)

    def to_netcdf(self, path: str | Path) -> Path:
        """Write the dataset as netCDF-4 file, completely or not at all; a failed run is written with its status.

        Derivatives with respect to parameters are in its group `gradient`.

        Raises InputError where the suffix is not .nc or the folder does not exist.
        """
        from msfp_gen.results.netcdf import write_netcdf

        return write_netcdf(self, path)

    def to_csv(self, path: str | Path) -> Path:
        """Write a CSV file: `name [unit]` as header, one line per row; then scene, events and provenance as comments.

        Raises InputError where the suffix is not .csv or the folder does not exist.
        """
        from msfp_gen.results.export import write_csv

        return write_csv(self, path)

    def to_parquet(self, path: str | Path) -> Path:
        """Write a Parquet file with units in its metadata.

        Raises InputError as `to_csv` does.
        """
        from msfp_gen.results.export import write_parquet

        return write_parquet(self, path)

    def to_mat(self, path: str | Path) -> Path:
        """Write a MATLAB file of all variables, with structs `units`, `meaning` and `attributes`.

        Raises InputError as `to_csv` does.
        """
        from msfp_gen.results.export import write_mat

        return write_mat(self, path)

    def save(self, path: str | Path) -> Path:
        """Write the format of the suffix: .nc, .parquet, .csv or .mat. Raises InputError as the other writers do."""
        from msfp_gen.results.export import save

        return save(self, path)

    @classmethod
    def from_netcdf(cls, path: str | Path) -> Result:
        """The result in a file that `to_netcdf` wrote, its scene included. Raises InputError for any other file."""
        from msfp_gen.results.reading import read_result

        return read_result(path, cls)
