"""Figures of runs and records in one style (docs/figures.md). Each function returns a figure and can write its file.

A path that cannot be written raises InputError, before anything is drawn.

matplotlib is imported when the first figure is drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import singledispatch
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msfp_gen.figures.bearing import (
    plot_energy,
    plot_force_path,
    plot_loops,
    plot_orbit,
    plot_result,
    plot_sliding,
    plot_stages,
)
from msfp_gen.figures.charts import plot_correction, plot_response_spectrum, plot_work_precision
from msfp_gen.figures.movie import MOVIE_SUFFIXES, animate, check_movie
from msfp_gen.figures.section import plot_section
from msfp_gen.figures.sheet import plot_sheet
from msfp_gen.results.result import AnyResult, Result
from msfp_gen.results.sign import using_sign
from msfp_gen.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure


__all__ = [
    "FIGURES",
    "MOVIE_SUFFIXES",
    "animate",
    "check_movie",
    "figures_of",
    "plot_correction",
    "plot_energy",
    "plot_force_path",
    "plot_loops",
    "plot_orbit",
    "plot_response_spectrum",
    "plot_result",
    "plot_section",
    "plot_sheet",
    "plot_sliding",
    "plot_stages",
    "plot_work_precision",
    "using_sign",
    "with_smooth_rows",
]

# Figures of one run, by their names on the command line: of the rows that any bearing has, and of one alone.
FIGURES_BELOW: dict[str, Callable[[Result, str | Path | None], Figure]] = {
    "overview": plot_result,
    "loops": plot_loops,
    "orbit": plot_orbit,
    "sliding": plot_sliding,
}
FIGURES = FIGURES_BELOW | {
    "stages": plot_stages,
    "force-path": plot_force_path,
    "energy": plot_energy,
    "section": plot_section,
}
ROWS = 4000  # rows of a run made for figures: the steps of the solver may be too long for smooth curves


@singledispatch
def figures_of(loaded: Any) -> Mapping[str, Callable[[Any, str | Path | None], Figure]]:
    """Functions that draw the figures of a system or a result, by their names on the command line."""
    figures: Mapping[str, Callable[[Any, str | Path | None], Figure]] = loaded.figures
    return figures


@figures_of.register(AnyResult)
def _figures_of_system(result: AnyResult) -> Mapping[str, Callable[[Any, str | Path | None], Figure]]:
    return figures_of(result.scene)


@figures_of.register(Result)
def _figures_of_result(result: Result) -> Mapping[str, Callable[[Any, str | Path | None], Figure]]:
    return FIGURES if result.is_alone else FIGURES_BELOW


@figures_of.register(Scene)
def _figures_of_scene(_: Scene) -> Mapping[str, Callable[[Any, str | Path | None], Figure]]:
    return FIGURES


def with_smooth_rows(scene: Any) -> Any:
    """The system with ROWS rows, no further apart than the samples of a record, unless it has its own output step.

    A system whose steps end at its rows stays as it is.
    """
    if not scene.rows_between_steps or scene.output_step is not None:
        return scene
    return replace(scene, output_step=min(scene.end / ROWS, scene.motion.max_step or scene.end))
