"""Vertical section of the deformed stack, to scale, with the line of force."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.figures.style import (
    BOLD,
    FAINT,
    HAIR,
    INK,
    LINE,
    MILLI,
    SMALL,
    THIN,
    colour,
    displacement,
    headline,
    label_of,
    page,
    subscript,
)
from msfp_gen.results.geometry import StackSection, sections
from msfp_gen.results.geometry import friction_circles as circle_radii
from msfp_gen.results.result import Result
from msfp_gen.results.sign import shown_sign
from msfp_gen.results.sliding import rims_in_contact, sliding_surfaces

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


STEEL = ("#AEB6C0", "#DCE1E7")  # colours of the plates and of the sliders
WIDTH = 7.4  # of the section in the figure [inch]
OVERHANG = 0.12  # length of the line of force beyond the stack, over the height of the stack
STATES = {  # (slides, rim contact) -> text
    (False, False): "sticks",
    (True, False): "slides",
    (False, True): "sticks, rim contact",
    (True, True): "slides, rim contact",
}


def plot_section(
    result: Result,
    path: str | Path | None = None,
    *,
    time: float | None = None,
    azimuth: float | None = None,
    friction_circles: bool = False,
) -> Figure:
    """Vertical section of the stack at one instant, to scale.

    It shows the bodies, their sliding faces in colour (thick while the surface slides), contact points and the line of
    force; on request the sphere centres with their friction circles, to which the line of force is tangent where a
    surface slides (docs/model.md).

    Args:
        result: the run.
        path: file to write, .png, .svg or .pdf; None: none.
        time: instant [s]; None: of the largest displacement.
        azimuth: direction of the plane from E1 [rad]; None: along the displacement at that instant.
        friction_circles: whether to draw sphere centres and friction circles.

    Raises:
        InputError: a time outside the run, a bearing of a building, or a path that cannot be written.
    """
    then = result.at_times(peak_time(result) if time is None else time)
    (section,) = sections(then, azimuth)
    (left, right), (low, high) = limits([section])
    tall = 7.6 if friction_circles else 1.3 + WIDTH * (high - low) / (right - left)
    with page(5.6 if friction_circles else WIDTH + 1.2, tall, path) as figure:
        headline(figure, label_of(result))
        axes = figure.subplots()
        SectionDrawing(axes, then, section)
        if friction_circles:
            draw_circles(axes, section, circle_radii(then)[0])
        figure.legend(loc="outside lower center", ncols=2 if friction_circles else 3)
    return figure


def peak_time(result: Result) -> float:
    """Time of the largest horizontal displacement [s]."""
    return float(result.history.time[result.history.peak_row])


class SectionDrawing:
    """Bodies, sliding faces, contact points and line of force of a row of `then` [mm]; `update` moves them to another.

    Attributes:
        bodies, faces, line, contacts: artists of bodies, sliding faces, line of force and contact points.
        title: title of the axes, with time and displacement.
    """

    def __init__(self, axes: Axes, then: Result, section: StackSection, row: int = 0) -> None:
        history, last = then.alone.history, len(section.bodies) - 1
        self.history = history
        self.slides, self.on_rim = sliding_surfaces(history), rims_in_contact(history)
        self.apart = history.separated
        self.bodies: list[Any] = []
        for body, polygon in enumerate(section.bodies):
            steel = STEEL[0 < body < last]
            self.bodies += axes.fill(*(polygon * MILLI).T, facecolor=steel, edgecolor=INK, linewidth=HAIR)
        style: dict[str, Any] = {"solid_capstyle": "butt", "zorder": 3}
        self.faces = [axes.plot([], [], color=colour(i + 1), **style)[0] for i in reversed(range(history.surfaces))]
        self.faces.reverse()
        (self.line,) = axes.plot([], [], color=INK, linewidth=LINE, linestyle=(0, (6, 2)), zorder=4)
        self.line.set_label("line of force")
        style = {"color": "white", "markeredgewidth": LINE, "zorder": 5}
        self.contacts = [
            axes.plot([], [], "o", markersize=5, markeredgecolor=colour(i + 1), **style)[0]
            for i in range(history.surfaces)
        ]
        axes.set(
            xlabel=f"{direction_of(section.azimuth)}, from the centre of the base [mm]",
            ylabel="height above the base [mm]",
        )
        self.title = axes.set_title(" ")
        axes.set_aspect("equal", adjustable="box")
        axes.grid(visible=False)
        self.update(section, row)

    @property
    def artists(self) -> list[Any]:
        """Everything that moves, in the order of drawing."""
        return [*self.bodies, *self.faces, self.line, *self.contacts, self.title]

    @property
    def entries(self) -> list[Any]:
        """The entries of a legend: surfaces from the top, then the line of force."""
        return [*self.faces[::-1], self.line]

    def update(self, section: StackSection, row: int) -> None:
        """Move everything to one row; `section` is the section at this row."""
        history, apart = self.history, self.apart[row]
        for artist, polygon in zip(self.bodies, section.bodies, strict=True):
            artist.set_xy(polygon * MILLI)
        for index, face in enumerate(self.faces):
            state = bool(self.slides[row, index]), bool(self.on_rim[row, index])
            text = f"separated by {history.lift[row, index] * MILLI:.2f} mm" if apart[index] else STATES[state]
            face.set(data=(section.faces[index] * MILLI).T, linewidth=BOLD if state[0] else LINE)
            face.set_label(f"surface {index + 1} {text}")
        self.line.set_data(*_force_line(section))
        for index, (artist, (x, z)) in enumerate(zip(self.contacts, section.contacts * MILLI, strict=True)):
            artist.set_data([x], [z])
            artist.set_visible(not apart[index])
        along = history.displacement[row] @ [np.cos(section.azimuth), np.sin(section.azimuth), 0.0]
        u = f"u = {shown_sign().difference} = {displacement(along):.1f} mm"
        self.title.set_text(f"t = {history.time[row]:.3f} s, {u}")


def _force_line(section: StackSection) -> tuple[Array, Array]:
    """Line of force of every surface up to halfway to its neighbours, and beyond base and top [mm]."""
    heights = np.concatenate([polygon[:, 1] for polygon in section.bodies])
    low, high = float(heights.min()), float(heights.max())
    beyond = OVERHANG * (high - low)
    levels = section.contacts[:, 1]
    edges = np.concatenate([[low - beyond], (levels[1:] + levels[:-1]) / 2, [high + beyond]])
    ends = []
    for (x, z), (along, up), below, above in zip(section.points, section.forces, edges, edges[1:], strict=False):
        if up > 0:
            ends += [(x + (level - z) * along / up, level) for level in (below, above)]
    points = np.array(ends).reshape(-1, 2) * MILLI
    return points[:, 0], points[:, 1]


def draw_circles(axes: Axes, section: StackSection, radii: Array) -> None:
    """Draw sphere centres and friction circles, and the lines of force extended up to them."""
    from matplotlib.patches import Circle

    for index, (centre, radius) in enumerate(zip(section.centres, radii, strict=True)):
        (x, z), (along, up) = section.points[index], section.forces[index]
        axes.add_patch(
            Circle(tuple(centre * MILLI), radius * MILLI, fill=False, edgecolor=colour(index + 1), linewidth=LINE)
        )
        axes.plot(*(centre * MILLI), marker="+", color=colour(index + 1), markersize=6, linestyle="none")
        if up > 0:
            ends = np.array([(x + (level - z) * along / up, level) for level in (0.0, 1.15 * (centre[1] or z))])
            axes.plot(*(ends * MILLI).T, color=FAINT, linewidth=THIN, linestyle=(0, (6, 2)), zorder=1)
        axes.annotate(
            f"c{subscript(index + 1)}",
            np.add(centre, (radius, 0.0)) * MILLI,
            xytext=(6, 0),
            va="center",
            textcoords="offset points",
            fontsize=SMALL,
            color=colour(index + 1),
        )


def limits(drawn_sections: list[StackSection]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Horizontal and vertical limits [mm] that contain the stack and its line of force in all sections."""
    points = np.concatenate([polygon for section in drawn_sections for polygon in section.bodies]) * MILLI
    (left, low), (right, high) = points.min(axis=0), points.max(axis=0)
    room = OVERHANG * (high - low)
    return (left - room, right + room), (low - 1.2 * room, high + 1.2 * room)


def direction_of(azimuth: float) -> str:
    """Name of the horizontal direction at `azimuth` [rad]."""
    named = {0.0: "along E₁", 90.0: "along E₂"}
    degrees = round(float(np.degrees(azimuth)), 1)
    return named.get(degrees, f"along {degrees:g}° from E₁")
