"""Studies that take several runs: accuracy, bounding, sweeps, and studies of many runs (docs/studies.md).

The functions for studies of many runs, but `msfp_gen.study` itself, are here.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from msfp_gen.studies.assessment.figures import (
        plot_fragility,
        plot_ida,
        plot_pareto,
        plot_sobol,
        plot_tornado,
    )
    from msfp_gen.studies.assessment.fragility import fragility
    from msfp_gen.studies.assessment.ida import ida
    from msfp_gen.studies.assessment.pareto import Goals, pareto
    from msfp_gen.studies.assessment.rows import read_study
    from msfp_gen.studies.assessment.sensitivity import sobol, tornado
    from msfp_gen.studies.study.chunks import Status, study_status
    from msfp_gen.studies.study.loader import load_study
    from msfp_gen.studies.study.run import Outcome

# Public name -> the module that defines it.
_MODULES = {
    "Outcome": "study.run",
    "Goals": "assessment.pareto",
    "fragility": "assessment.fragility",
    "ida": "assessment.ida",
    "read_study": "assessment.rows",
    "sobol": "assessment.sensitivity",
    "tornado": "assessment.sensitivity",
    "plot_fragility": "assessment.figures",
    "plot_ida": "assessment.figures",
    "pareto": "assessment.pareto",
    "plot_pareto": "assessment.figures",
    "plot_sobol": "assessment.figures",
    "plot_tornado": "assessment.figures",
    "Status": "study.chunks",
    "load_study": "study.loader",
    "study_status": "study.chunks",
}

__all__ = [
    "Goals",
    "Outcome",
    "Status",
    "fragility",
    "ida",
    "load_study",
    "pareto",
    "plot_fragility",
    "plot_ida",
    "plot_pareto",
    "plot_sobol",
    "plot_tornado",
    "read_study",
    "sobol",
    "study_status",
    "tornado",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module 'msfp_gen.studies' has no attribute {name!r}")
    value = getattr(import_module(f"msfp_gen.studies.{_MODULES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
