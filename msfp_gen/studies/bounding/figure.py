"""Figure of a bounding analysis: the loops of all cases in one diagram."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.figures import COLOURS, INK, displacement, displacement_label, engineering, force, moving_axes, page
from msfp_gen.figures.style import THIN, headline, subscript
from msfp_gen.results.sign import shown_sign
from msfp_gen.studies.bounding.runs import CASES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from msfp_gen.studies.bounding.runs import Bounds, Case

# In the order of drawing: the nominal loop lies on top. Solid lines, since repeated cycles would fill dashes.
LINE_STYLES: dict[str, dict[str, Any]] = {
    "lower": {"color": COLOURS[0]},
    "upper": {"color": COLOURS[1]},
    "nominal": {"color": INK},
}


def plot_bounds(found: Bounds, path: str | Path | None = None) -> Figure:
    """Top force [kN] over displacement across the bearing [mm] of all cases, along each axis that moves.

    A run that failed is drawn up to its last row. Raises InputError for a path that cannot be written.
    """
    drawn = [case for name in LINE_STYLES for case in found.cases if case.name == name and case.result is not None]
    axes = sorted({axis for case in drawn if case.result for axis in moving_axes(case.result)}) or [0]
    with page(6.4 * len(axes), 5.0, path, "bounds") as figure:
        name = next(case.scene.name for case in found.cases if case.name == "nominal") or "unnamed scene"
        headline(figure, f"{name}: bounds by {found.table.name}")
        for axis, place in zip(axes, figure.subplots(1, len(axes), squeeze=False)[0], strict=True):
            _draw(place, found, drawn, axis)
    return figure


def _draw(axes: Axes, found: Bounds, cases: list[Case], axis: int) -> None:
    forces = [case.result.history.top_force[:, axis] for case in cases if case.result]
    scale = engineering(np.concatenate(forces), "N") if forces else engineering(0.0, "N")
    for case, values in zip(cases, forces, strict=True):
        assert case.result is not None
        u = displacement(case.result.history.displacement[:, axis])
        axes.plot(u, force(values, scale), label=_label(found, case), linewidth=THIN, **LINE_STYLES[case.name])
    sign = subscript(axis + 1)
    axes.set(
        title=f"Force and displacement along E{sign}",
        xlabel=f"displacement across the bearing {displacement_label(axis)}",
        ylabel=f"force {shown_sign().force} F{sign} [{scale.unit}]",
    )
    axes.margins(0.06)
    handles, labels = axes.get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda i: CASES.index(cases[i].name))
    axes.legend([handles[i] for i in order], [labels[i] for i in order], loc="upper left")


def _label(found: Bounds, case: Case) -> str:
    """Name of the case and its factors; one number if all surfaces have the same."""
    parts = []
    for named, factors in found.lambdas.items():
        values = list(dict.fromkeys(f"{value:.3g}" for value in factors[case.name]))
        parts.append(f"{named.replace('_', ' ')} × {' / '.join(values)}")
    return f"{case.name}: {', '.join(parts)}" + (", run failed" if case.failure else "")
