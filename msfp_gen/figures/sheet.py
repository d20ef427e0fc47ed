"""A data sheet drawn: the section of its bearing at rest, to scale, with its backbone and effective properties."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.design.sheet import SheetReport
from msfp_gen.figures.section import STEEL
from msfp_gen.figures.style import CASE_COLOURS, HAIR, INK, LINE, MILLI, SMALL, colour, headline, page
from msfp_gen.results.geometry import outline, slider_face

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def plot_sheet(report: SheetReport, path: str | Path | None = None, *, table: bool = True) -> Figure:
    """Section of the bearing at rest to scale, published backbone at each friction, and table of effective properties.

    path: file to write, .png, .svg or .pdf; None: none. table: whether the properties are listed. Raises InputError for
    a path that cannot be written.
    """
    effective = report.tables[-1]
    listed = 0.6 + 0.19 * len(effective.rows) if table else 0.0
    with page(8.6, 7.4 + listed if table else 6.0, path) as figure:
        headline(figure, f"{report.name}: {report.sheet.device} pendulum, {report.sheet.axial_load / 1e3:.4g} kN")
        section, backbone, *below = figure.subplots(2 + table, 1, height_ratios=[3.2, 3.6, listed][: 2 + table])
        _draw_section(section, report)
        _draw_backbone(backbone, report)
        if not table:
            return figure
        (cells_at,) = below
        cells_at.axis("off")
        cells = [list(row) for row in effective.rows]
        drawn = cells_at.table(cells, colLabels=list(effective.columns), loc="upper center", edges="horizontal")
        drawn.auto_set_font_size(False)
        drawn.set_fontsize(SMALL)
        for cell in drawn.get_celld().values():
            cell.set_linewidth(HAIR)
    return figure


def _draw_section(axes: Axes, report: SheetReport) -> None:
    bearing = report.bearing
    heights, last = bearing.arrays()["height"], bearing.layout.n - 1
    bottoms = np.concatenate([[0.0], np.cumsum(heights)[:-1]])
    for body, bottom in enumerate(bottoms):
        radius, level = (outline(bearing, body) * MILLI).T
        polygon = np.concatenate([np.stack([radius, level], 1), np.stack([-radius, level], 1)[::-1]])
        polygon[:, 1] += bottom * MILLI
        axes.fill(*polygon.T, facecolor=STEEL[0 < body < last], edgecolor=INK, linewidth=HAIR)
    for surface in range(report.sheet.surfaces):
        radius, level = (slider_face(bearing, surface) * MILLI).T
        level = level + bottoms[bearing.slider(surface)] * MILLI
        style: dict[str, Any] = {"color": colour(surface + 1), "linewidth": LINE}
        axes.plot(np.r_[-radius[::-1], radius], np.r_[level[::-1], level], **style, label=f"surface {surface + 1}")
    axes.set(title="section at rest", xlabel="from the axis [mm]", ylabel="height [mm]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(visible=False)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=report.sheet.surfaces, fontsize=SMALL)


def _draw_backbone(axes: Axes, report: SheetReport) -> None:
    for case, backbone in report.backbones.items():
        u, force = backbone.points
        load = report.sheet.axial_load / 1e3
        axes.plot(np.r_[0.0, u] * MILLI, np.r_[0.0, force] * load, color=CASE_COLOURS[case], label=case)
        found = report.effective[case]
        places = [at.displacement * MILLI for at in found], [at.force * load for at in found]
        axes.plot(*places, "o", color=CASE_COLOURS[case], markersize=4)
    axes.set(title="published backbone", xlabel="displacement [mm]", ylabel="force [kN]")
    axes.set_ylim(bottom=0)
    axes.legend(loc="upper left")
