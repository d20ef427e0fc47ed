"""The movie of a building: its frame on the bearings in two elevations, the plan, the loops and the axial forces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.buildings.figures import MovingFrame, draw_axial_history, legend_above, magnification, plan_of, title_of
from msfp_gen.buildings.result import BuildingResult
from msfp_gen.common.arrays import Array
from msfp_gen.figures.movie import TALLEST, WIDE, Film, MovieLayout, even
from msfp_gen.figures.section import STEEL, direction_of
from msfp_gen.figures.style import BOLD, COLOURS, FAINT, HAIR, INK, LINE, THIN, displacement, headline, subscript
from msfp_gen.results.sign import shown_sign

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


BELOW_FRAME = 3.2  # height of plan, loops and axial forces [inch]
AROUND_FRAME = 1.4  # height of title, legend and labels of the elevations [inch]
ROOM = 0.03  # around the frame in an elevation, over its width
PLATE = 0.022  # half width of a bearing in an elevation, over the width of the frame
STILL = 0.01  # largest displacement along an axis that is not drawn as a loop, over the other
STATES = {"carries load": STEEL[0], "rim contact": COLOURS[1], "lifted off": "white"}  # of a bearing -> colour


def building_film(result: BuildingResult, times: Array, azimuth: float | None) -> Film:
    """The movie of a building at these times [s], its first elevation along `azimuth` [rad]; None: along E1."""
    frames = result.at_times(times)
    peak = max(float(one.history.horizontal.max()) for one in result.bearings)
    moving = MovingFrame(frames, magnification(result.scene.places, peak))
    first = 0.0 if azimuth is None else azimuth
    views = [Elevation(moving, azimuth_of_view) for azimuth_of_view in (first, first + np.pi / 2)]
    high, wide = views[0].high - views[0].low, sum(view.right - view.left for view in views)
    tall = even(min(TALLEST, (WIDE - 1.2) * high / wide) + AROUND_FRAME + BELOW_FRAME)

    def layout(figure: Figure) -> MovieLayout:
        ((above,), (below,)) = figure.subfigures(2, 1, squeeze=False, height_ratios=(tall - BELOW_FRAME, BELOW_FRAME))
        headline(above, f"{title_of(result)}: displacements from the ground, {moving.factor:g} times as large")
        row = above.subplots(1, 2, sharey=True, width_ratios=[view.right - view.left for view in views])
        plan, loops, forces = below.subplots(1, 3, width_ratios=(1, 1, 1.25))
        moves = [view.draw(axes, frames.time, axes is row[0]) for view, axes in zip(views, row, strict=True)]
        style = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "ncols": len(STATES), "borderaxespad": 0.0}
        row[1].legend(handles=_state_entries(), **style).set_in_layout(False)  # it is wider than the elevation
        moves += [_draw_plan(plan, result, moving), _draw_loops(loops, result, frames.time)]
        moves.append(_draw_forces(forces, result, frames.time))

        def update(row: int) -> None:
            for move, _ in moves:
                move(row)

        return update, [artist for _, artists in moves for artist in artists]

    return Film(tall, len(times), layout)


class Elevation:
    """The frame seen along a horizontal direction; attributes are the limits of the drawing [m]."""

    def __init__(self, frame: MovingFrame, azimuth: float) -> None:
        self.frame, self.azimuth = frame, azimuth
        view = np.array([[np.cos(azimuth), np.sin(azimuth), 0.0], [0.0, 0.0, 1.0]])
        plates = bool(frame.scene.building.columns)
        self.floors = frame.floors @ view.T if plates else None
        self.nodes = frame.nodes @ view.T
        self.members = frame.members @ view.T
        self.lowers, self.uppers = frame.lowers @ view.T, frame.uppers @ view.T
        shown = [self.nodes, self.members, self.lowers, self.uppers, *([] if self.floors is None else [self.floors])]
        x = np.concatenate([points[..., 0].ravel() for points in shown])
        z = np.concatenate([points[..., 1].ravel() for points in shown])
        self.plate = PLATE * float(np.ptp(x))
        room = ROOM * float(np.ptp(x)) + self.plate
        self.left, self.right = float(x.min()) - room, float(x.max()) + room
        self.low, self.high = float(z.min()) - 0.5 * frame.depth, float(z.max()) + room

    def draw(self, axes: Axes, time: Array, timed: bool) -> MovieLayout:
        """Draw it; returns a function that moves it to a frame, and what it changes. timed: state the time [s]."""
        ground = float(self.frame.upper_ends[:, 2].min()) - self.frame.depth
        axes.axhline(ground, color=FAINT, linewidth=THIN, zorder=0)
        members = axes.plot([], [], color=INK, linewidth=THIN, zorder=2)[0]
        style: dict[str, Any] = {"facecolor": STEEL[1], "edgecolor": INK, "linewidth": LINE, "joinstyle": "round"}
        corners = [] if self.floors is None else self.floors[0].copy()
        floors = [axes.fill(*floor.T, zorder=3, **style)[0] for floor in corners]
        nodes = axes.plot([], [], "o", markersize=4, color=INK, zorder=4)[0] if self.floors is None else None
        feet = axes.plot([], [], color=INK, linewidth=BOLD, solid_capstyle="butt", zorder=3)[0]
        heads = axes.plot([], [], color=INK, linewidth=BOLD, solid_capstyle="butt", zorder=3)[0]
        x, z = self.lowers[0].T
        sliders = axes.scatter(x, z, s=34, edgecolors=INK, linewidths=HAIR, zorder=4)
        axes.set(xlim=(self.left, self.right), ylim=(self.low, self.high), ylabel="height z [m]")
        axes.set_xlabel(f"{direction_of(self.azimuth)} [m]")
        axes.set_aspect("equal", adjustable="box")
        axes.grid(visible=False)
        axes.label_outer()
        title = axes.set_title(" ")
        colours = np.array(list(STATES.values()))
        states = np.where(self.frame.lifted, 2, np.where(self.frame.on_rim, 1, 0))

        def move(row: int) -> None:
            members.set_data(*_joined(self.members[row]))
            for polygon, corners in zip(floors, [] if self.floors is None else self.floors[row], strict=True):
                polygon.set_xy(corners)
            if nodes is not None:
                nodes.set_data(*self.nodes[row].T)
            feet.set_data(*self._plates(self.lowers[row]))
            heads.set_data(*self._plates(self.uppers[row] - [0.0, 0.2 * self.frame.depth]))  # below the slab
            sliders.set_offsets((self.lowers[row] + self.uppers[row]) / 2)
            sliders.set_facecolor(colours[states[row]].tolist())
            title.set_text(f"t = {time[row]:.2f} s" if timed else "")

        return move, [members, *floors, *([] if nodes is None else [nodes]), feet, heads, sliders, title]

    def _plates(self, places: Array) -> tuple[Array, Array]:
        """Horizontal plates of the bearings, as lines."""
        half = np.array([self.plate, 0.0])
        return _joined(np.stack([places - half, places + half], axis=1))


def _joined(ends: Array) -> tuple[Array, Array]:
    """Coordinates of separate lines for one artist; ends: shape (lines, 2, 2)."""
    gaps = np.full((len(ends), 1, 2), np.nan)
    x, y = np.concatenate([ends, gaps], axis=1).reshape(-1, 2).T
    return x, y


def _state_entries() -> list[Any]:
    from matplotlib.lines import Line2D

    style: dict[str, Any] = {"marker": "o", "markersize": 5, "linestyle": "none", "markeredgecolor": INK}
    return [Line2D([], [], label=f"bearing {name}", markerfacecolor=colour, **style) for name, colour in STATES.items()]


def _draw_plan(axes: Axes, result: BuildingResult, frame: MovingFrame) -> MovieLayout:
    """Paths of the upper ends of the bearings in plan, with the slab above them."""
    whole = MovingFrame(result, frame.factor)
    for index in range(whole.uppers.shape[1]):
        axes.plot(*whole.uppers[:, index, :2].T, color=FAINT, linewidth=HAIR)
    (x0, y0), (x1, y1) = plan_of(result.scene)
    axes.plot([x0, x1, x1, x0, x0], [y0, y0, y1, y1, y0], color=FAINT, linewidth=HAIR, linestyle="--")
    (slab,) = axes.fill(*frame.floors[0, 0, :, :2].T, facecolor="none", edgecolor=INK, linewidth=THIN)
    (dots,) = axes.plot([], [], "o", markersize=4.5, color=COLOURS[0])
    reach = np.concatenate([frame.floors[:, 0, :, :2].reshape(-1, 2), whole.uppers[..., :2].reshape(-1, 2)])
    room = ROOM * np.ptp(reach[:, 0])
    (left, low), (right, high) = reach.min(axis=0) - room, reach.max(axis=0) + room
    axes.set(xlim=(left, right), ylim=(low, high), xlabel="E₁ [m]", ylabel="E₂ [m]")
    axes.set_title("Plan: paths of the upper ends")
    axes.set_aspect("equal", adjustable="box")

    def move(row: int) -> None:
        slab.set_xy(frame.floors[row, 0, :, :2])
        dots.set_data(*frame.uppers[row, :, :2].T)

    return move, [slab, dots]


def _draw_loops(axes: Axes, result: BuildingResult, time: Array) -> MovieLayout:
    """Base shear over the mean displacement of the bearings, along both axes."""
    dots = []
    reach = [float(np.ptp(_mean_loop(result, axis)[0])) for axis in range(2)]
    moving = [axis for axis in range(2) if reach[axis] >= STILL * max(reach)]
    for axis in moving:
        u, shear = _mean_loop(result, axis)
        axes.plot(u, shear, color=COLOURS[axis], linewidth=HAIR, alpha=0.6, label=f"E{subscript(axis + 1)}")
        dots += axes.plot([], [], "o", markersize=6, color=COLOURS[axis], markeredgecolor="white", zorder=6)
    axes.set(
        title="Isolation system",
        xlabel=f"mean u = {shown_sign().difference} [mm]",
        ylabel="base shear / weight [-]",
    )
    legend_above(axes, 2)
    places = [[np.interp(time, result.time, path) for path in _mean_loop(result, axis)] for axis in moving]

    def move(row: int) -> None:
        for dot, (u, shear) in zip(dots, places, strict=True):
            dot.set_data([u[row]], [shear[row]])

    return move, dots


def _mean_loop(result: BuildingResult, axis: int) -> tuple[Array, Array]:
    """Mean displacement [mm] and base shear over the weight along an axis, in the sign of the figures."""
    mean = np.mean([one.history.displacement[:, axis] for one in result.bearings], axis=0)
    shear = sum(one.history.top_force[:, axis] for one in result.bearings) / result.scene.weight
    return displacement(mean), shown_sign().factor * np.asarray(shear)


def _draw_forces(axes: Axes, result: BuildingResult, time: Array) -> MovieLayout:
    """Axial forces of the bearings over time, and the instant of the frame."""
    draw_axial_history(axes, result)
    axes.set_xlim(time[0], time[-1])
    cursor = axes.axvline(time[0], color=INK, linewidth=THIN)

    def move(row: int) -> None:
        cursor.set_xdata([time[row]] * 2)

    return move, [cursor]
