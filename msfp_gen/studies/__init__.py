"""Studies of several runs: accuracy, bounding, sweeps, calibration, and studies of many runs (docs/studies.md).

A study of many runs: a file becomes axes (`axes`), their values the scenes of the runs (`definition`), a pool runs the
scenes (`batch`), and the kept quantities (`columns`) become the rows of a table (`run`), which `assessment` evaluates.
This module offers the public functions for such studies; `msfp_gen.study` itself is in the package `msfp_gen`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from msfp_gen.studies.assessment.fragility import fragility as fragility
    from msfp_gen.studies.assessment.fragility import plot_fragility as plot_fragility
    from msfp_gen.studies.assessment.ida import ida as ida
    from msfp_gen.studies.assessment.ida import plot_ida as plot_ida
    from msfp_gen.studies.assessment.rows import read_study as read_study
    from msfp_gen.studies.assessment.sensitivity import plot_tornado as plot_tornado
    from msfp_gen.studies.assessment.sensitivity import tornado as tornado
    from msfp_gen.studies.definition import load_study as load_study
    from msfp_gen.studies.estimation.estimate import Estimate as Estimate
    from msfp_gen.studies.estimation.estimate import estimate as estimate
    from msfp_gen.studies.estimation.estimate import plot_estimate as plot_estimate
    from msfp_gen.studies.run import Outcome as Outcome
    from msfp_gen.studies.run import StudyStatus as StudyStatus
    from msfp_gen.studies.run import study_status as study_status

# Public name -> the module that defines it.
_MODULES = {
    "Outcome": "run",
    "Estimate": "estimation.estimate",
    "estimate": "estimation.estimate",
    "plot_estimate": "estimation.estimate",
    "fragility": "assessment.fragility",
    "ida": "assessment.ida",
    "read_study": "assessment.rows",
    "tornado": "assessment.sensitivity",
    "plot_fragility": "assessment.fragility",
    "plot_ida": "assessment.ida",
    "plot_tornado": "assessment.sensitivity",
    "StudyStatus": "run",
    "load_study": "definition",
    "study_status": "run",
}

__all__ = [*_MODULES]


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module 'msfp_gen.studies' has no attribute {name!r}")
    value = getattr(import_module(f"msfp_gen.studies.{_MODULES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
