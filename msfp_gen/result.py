"""`Result`: the result of a run, with its dataset, summary, characterisation and files."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from msfp_gen.analysis.any_result import AnyResult, Curve, Rows, hysteresis_loop
from msfp_gen.analysis.characterise import Characterisation, characterise
from msfp_gen.analysis.summary import axial_load, rows_of_bearing, summarise, summarise_gradients
from msfp_gen.analysis.tables import summary_tables
from msfp_gen.analysis.verdict import Judged
from msfp_gen.common.tables import Table
from msfp_gen.results import dataset
from msfp_gen.results.history import Counters, Event, History
from msfp_gen.results.run_data import RunData

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.results.files import Storage

__all__ = ["Counters", "Event", "History", "Result"]


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Result(AnyResult, RunData):
    """The result of `simulate`; a RunError has one in `.result` if the run failed after its start.

    status: "ok", "stopped" (the stop condition of the scene was met) or the name of a failure; message: one line of
    text, "" for a run that succeeded. counters: the work of the solver. provenance: versions, model keys and solver
    options with which the result was computed. notes: messages of the monitors, in order of time (docs/effects.md).
    """

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Main results of the run in SI units, as values that JSON can hold; `summary.summarise` lists the keys."""
        return summarise(self) | {"verdict": self.verdict.as_dict}

    def judged(self) -> list[Judged]:
        """The bearing itself."""
        return [
            Judged(0, "", self.scene.bearing, axial_load(self), self.history, self.extremes, self.notes, self.events)
        ]

    def main_results(self) -> Rows:
        """Label and value of the main results."""
        steps, wall_time = self.counters.steps, self.counters.wall_time
        time = f"{self.history.time[-1]:.6g} s in {steps} steps, {wall_time:.3g} s"
        return [("time", time), *rows_of_bearing(self.summary)]

    @property
    def curve(self) -> Curve:
        """The hysteresis loop."""
        return hysteresis_loop(self.history, self.history.top_force)

    def tables(self) -> list[Table]:
        """Tables of peaks and surfaces, and of the transitions of a monotonic run."""
        first, *others = summary_tables(self.summary, self.scene.bearing.surfaces)
        return [first, self.verdict.table, *others]

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

    def characterise(self) -> Characterisation:
        """Effective stiffness, damping, sliding regimes, remaining capacity, velocity and heat (docs/characterise.md).

        Raises InputError where the bearing did not move.
        """
        return characterise(self)

    @classmethod
    def storage(cls) -> Storage:
        """The functions of `results/dataset.py`."""
        return dataset
