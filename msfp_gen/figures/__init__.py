"""Figures of runs and records in one style (docs/figures.md). Each function returns a figure and can write its file.

A path that cannot be written raises InputError, before anything is drawn.

matplotlib is imported when the first figure is drawn.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from msfp_gen.buildings.result import BuildingResult
from msfp_gen.figures.bearing import (
    plot_energy,
    plot_force_path,
    plot_loops,
    plot_orbit,
    plot_result,
    plot_sliding,
    plot_stages,
)
from msfp_gen.figures.building import (
    plot_axial_forces,
    plot_building,
    plot_floor_spectra,
    plot_plan,
    plot_profile,
)
from msfp_gen.figures.charts import plot_correction, plot_response_spectrum, plot_work_precision
from msfp_gen.figures.movie import MOVIE_SUFFIXES, animate, check_movie
from msfp_gen.figures.section import plot_section
from msfp_gen.results.run_data import RunData
from msfp_gen.results.sign import using_sign

if TYPE_CHECKING:
    from matplotlib.figure import Figure


__all__ = [
    "BUILDING_FIGURES",
    "FIGURES",
    "MOVIE_SUFFIXES",
    "animate",
    "check_movie",
    "plot_axial_forces",
    "plot_building",
    "plot_correction",
    "plot_energy",
    "plot_floor_spectra",
    "plot_force_path",
    "plot_loops",
    "plot_orbit",
    "plot_plan",
    "plot_profile",
    "plot_response_spectrum",
    "plot_result",
    "plot_section",
    "plot_sliding",
    "plot_stages",
    "plot_work_precision",
    "using_sign",
]

# Figures of one run, by their names on the command line.
FIGURES: dict[str, Callable[[RunData, str | Path | None], Figure]] = {
    "overview": plot_result,
    "loops": plot_loops,
    "orbit": plot_orbit,
    "sliding": plot_sliding,
    "stages": plot_stages,
    "force-path": plot_force_path,
    "energy": plot_energy,
    "section": plot_section,
}

# Figures of the run of a building, likewise.
BUILDING_FIGURES: dict[str, Callable[[BuildingResult, str | Path | None], Figure]] = {
    "overview": plot_building,
    "plan": plot_plan,
    "profile": plot_profile,
    "spectra": plot_floor_spectra,
    "axial": plot_axial_forces,
}
