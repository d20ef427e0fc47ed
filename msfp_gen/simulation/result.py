"""`Result`: the result of a run, with its dataset, summary, characterisation and files."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from msfp_gen.analysis.any_result import OneBearing, Rows
from msfp_gen.analysis.summary import summarise, summarise_gradients, time_row, work_rows
from msfp_gen.results import dataset
from msfp_gen.results.history import Counters, Event, History
from msfp_gen.results.run_data import RunData

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.results.files import Storage

__all__ = ["Counters", "Event", "History", "Result"]


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Result(OneBearing, RunData):
    """The result of `simulate`; a RunError has one in `.result` if the run failed after its start.

    status: "ok", "stopped" (the stop condition of the scene was met) or the name of a failure; message: one line of
    text, "" for a run that succeeded. counters: the work of the solver. provenance: versions, model keys and solver
    options with which the result was computed. notes: messages of the monitors, in order of time (docs/effects.md).
    """

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Main results of the run in SI units, as values that JSON can hold; `summary.summarise` lists the keys."""
        return summarise(self) | {"verdict": self.verdict.as_dict}

    def main_results(self) -> Rows:
        """Label and value of the main results."""
        return [time_row(self.summary), *super().main_results()]

    def work_rows(self) -> Rows:
        """Label and value of its energy and of the work of the solver."""
        return work_rows(self.summary)

    @cached_property
    def gradient(self) -> xr.Dataset:
        """Derivatives of the dataset with respect to parameters, first dimension `parameter`; docs/gradients.md.

        Raises InputError where the run computed none.
        """
        return dataset.to_gradient_dataset(self)

    @cached_property
    def gradient_summary(self) -> dict[str, dict[str, Any]]:
        """Derivatives of the scalars of the summary, by the path of the parameter; docs/gradients.md.

        Raises InputError where the run computed none.
        """
        return summarise_gradients(self)

    @classmethod
    def storage(cls) -> Storage:
        """The functions of `results/dataset.py`."""
        return dataset
