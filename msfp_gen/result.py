"""`Result`: the result of a run, with its dataset, summary, characterisation and files."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from msfp_gen.results.history import Counters, Event, History
from msfp_gen.results.run_data import RunData

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.analysis.characterise import Characterisation
    from msfp_gen.results.files import Storage

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
    def summary(self) -> dict[str, Any]:
        """Main results of the run in SI units, as values that JSON can hold; `summary.summarise` lists the keys."""
        from msfp_gen.analysis.summary import summarise

        return summarise(self)

    @cached_property
    def gradient(self) -> xr.Dataset:
        """Derivatives of the dataset with respect to parameters, first dimension `parameter`; docs/gradients.md.

        Raises InputError where the run computed none.
        """
        from msfp_gen.results.dataset import to_gradient_dataset

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

    @classmethod
    def storage(cls) -> Storage:
        """The functions of `results/dataset.py`."""
        from msfp_gen.results import dataset

        return dataset
