"""Figures of a building on bearings: plan with orbits, profiles, floor spectra, axial forces; its frame in motion."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from msfp_gen.buildings.result import BuildingResult
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.arrays import Array
from msfp_gen.common.fields import G
from msfp_gen.figures.style import (
    COLOURS,
    FAINT,
    HAIR,
    INK,
    LINE,
    MILLI,
    SMALL,
    THIN,
    headline,
    page,
    panels,
    plain,
    subscript,
)
from msfp_gen.motions.records.spectrum import response_spectrum
from msfp_gen.results.sign import shown_sign

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


ORBIT = 0.42  # radius of the largest orbit in the plan, over the least distance of two bearings
ROUND = (1, 2, 5)  # magnifications are these times a power of ten
LABELLED = 24  # bearings of a plan that are labelled, at most
AXES = range(3)
ROOM_ABOVE = 0.2  # for a legend above curves, over their height


def plot_plan(result: BuildingResult, path: str | Path | None = None) -> Figure:
    """Plan with the orbit of every bearing, magnified, its peak, and the centre of mass."""
    with page(8.6, 7.0, path) as figure:
        headline(figure, title_of(result))
        draw_plan(figure.subplots(), result)
    return figure


def plot_profile(result: BuildingResult, path: str | Path | None = None) -> Figure:
    """Peaks over the height: floor accelerations, drifts of the storeys, storey shears over the weight."""
    with page(11.5, 4.8, path) as figure:
        headline(figure, title_of(result))
        draw_profile(panels(figure, *PROFILES, sharey=True), result)
    return figure


def plot_floor_spectra(result: BuildingResult, path: str | Path | None = None) -> Figure:
    """Response spectra of the accelerations of all floors and of the ground, 5 % damping, along E1, E2 and E3.

    The spectra of a rigid floor are at its centre of mass; dotted lines are the largest at the corners of the plan.
    """
    found = result.floor_spectra()
    spectra = {"ground": response_spectrum(result.scene.motion, found.periods, damping=found.damping).psa[:, :3]}
    spectra |= dict(zip(found.names, found.nodes, strict=True))
    corners = dict(zip(found.names, found.corners, strict=True)) if has_floors(result) else {}
    with page(11.5, 4.6, path) as figure:
        dotted = ", at centres of mass; dotted: largest at the corners of the plan" if corners else " at nodes"
        headline(figure, f"{title_of(result)}: floor spectra, {100 * found.damping:g} % damping{dotted}")
        row = panels(figure, *(f"along E{subscript(axis + 1)}" for axis in AXES))
        for axis, axes in zip(AXES, row, strict=True):
            for index, (name, values) in enumerate(spectra.items()):
                style: dict[str, Any] = (
                    {"color": FAINT, "linestyle": "--"}
                    if name == "ground"
                    else {"color": COLOURS[(index - 1) % len(COLOURS)]}
                )
                axes.plot(found.periods, values[:, axis] / G, label=plain(name), **style)
                if name in corners:
                    axes.plot(found.periods, corners[name][:, axis] / G, **style, linestyle=":", linewidth=THIN)
            axes.set(
                xscale="log", xlabel="period T [s]", ylabel=f"pseudo-acceleration along E{subscript(axis + 1)} [g]"
            )
            axes.set_xlim(found.periods[0], found.periods[-1])
            axes.set_ylim(bottom=0.0)
            axes.set_xticks([0.05, 0.1, 0.2, 0.5, 1, 2, 5], ["0.05", "0.1", "0.2", "0.5", "1", "2", "5"])
            axes.minorticks_off()
        row[-1].legend(loc="upper left", bbox_to_anchor=(1.01, 1))
    return figure


def plot_axial_forces(result: BuildingResult, path: str | Path | None = None) -> Figure:
    """Axial force of every bearing: over time, relative to the axial force at rest, and the range of each."""
    with page(11.5, max(4.6, 1.5 + 0.22 * len(result.scene.bearings)), path) as figure:
        headline(figure, title_of(result))
        left, right = figure.subplots(1, 2, width_ratios=(1.6, 1))
        draw_axial_history(left, result)
        draw_axial_ranges(right, result)
    return figure


def plot_building(result: BuildingResult, path: str | Path | None = None) -> Figure:
    """Overview: plan with orbits, profiles over the height, range of the axial force of every bearing."""
    with page(13.0, 8.6, path) as figure:
        headline(figure, _overview_title(result))
        (above,), (below,) = figure.subfigures(2, 1, squeeze=False, height_ratios=(1.35, 1))
        left, right = above.subplots(1, 2, width_ratios=(1.35, 1))
        draw_plan(left, result)
        draw_axial_ranges(right, result)
        draw_profile(panels(below, *PROFILES, sharey=True), result)
    return figure


def draw_plan(axes: Axes, result: BuildingResult) -> None:
    """Bearings at their places with their orbits, magnified, and the centre of mass at rest."""
    scene, bearings = result.scene, result.bearings
    peaks = [float(one.extremes.displacement[3]) for one in bearings]
    peak = max(peaks)
    factor = magnification(scene.places, peak)
    for one, own, place in zip(bearings, peaks, scene.places, strict=True):
        u = shown_sign().factor * factor * one.history.displacement[:, :2]
        axes.plot(*(place + u).T, color=COLOURS[0], linewidth=HAIR)
        axes.plot(*place, marker="s", markersize=3.5, color=INK, linestyle="none")
        if len(bearings) <= LABELLED:
            name, below = scene.bearings[one.number - 1].name or str(one.number), place - [0.0, factor * peak]
            axes.update_datalim([below])
            axes.annotate(
                f"{plain(name)}: {MILLI * own:.0f} mm",
                below,
                textcoords="offset points",
                xytext=(0, -3),
                ha="center",
                va="top",
                fontsize=SMALL,
                color=INK,
            )
    axes.plot(*scene.mass_centre, marker="+", markersize=10, color=COLOURS[1], linestyle="none", label="centre of mass")
    axes.set(
        title=f"Orbits of the bearings, u = {shown_sign().difference}, {factor:g} times as large as the plan",
        xlabel="E₁ [m]",
        ylabel="E₂ [m]",
    )
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    axes.legend(loc="upper right", bbox_to_anchor=(1.0, -0.06), borderaxespad=0.0)


PROFILES = ("Peak floor acceleration", "Peak storey drift", "Peak storey shear over the weight")


def draw_profile(row: list[Axes], result: BuildingResult) -> None:
    """Three panels over the height: accelerations of floors, drift ratios and shears of storeys, along E1 and E2.

    Accelerations are at the centres of mass, drifts at the stiffness centres; dotted: largest at the corners.
    """
    floors, storeys = result.floors, result.storeys
    heights, corners = [floor["height"] for floor in floors], has_floors(result)
    ground = np.abs(result.ground[:, 2]).max(axis=0)
    for axis in AXES:
        key, colour = f"E{axis + 1}", COLOURS[axis]
        peaks = [floor["peak_acceleration"][key] / G for floor in floors]
        row[0].plot(peaks, heights, marker="o", markersize=4, color=colour, label=f"E{subscript(axis + 1)}")
        if corners:
            peaks = [floor["peak_corner_acceleration"][key] / G for floor in floors]
            row[0].plot(peaks, heights, color=colour, linestyle=":")
        row[0].plot(ground[axis] / G, heights[0], marker="x", color=colour, linestyle="none")
        if axis < 2 and storeys:
            drifts = [100 * storey["peak_drift"][key] / storey["height"] for storey in storeys]
            shears = [storey["peak_shear"][key] / result.scene.weight for storey in storeys]
            base = result.summary["peak_force"][key] / result.scene.weight
            at_corners = [100 * storey["peak_corner_drift"][key] / storey["height"] for storey in storeys]
            for axes, values, line in ((row[1], drifts, "-"), (row[1], at_corners, ":"), (row[2], shears, "-")):
                axes.stairs(
                    values,
                    heights[: len(values) + 1],
                    orientation="horizontal",
                    color=colour,
                    linewidth=LINE,
                    linestyle=line,
                )
            row[2].plot(base, heights[0], marker="x", color=colour, linestyle="none")
    row[0].plot([], [], marker="x", color=FAINT, linestyle="none", label="ground")
    for axes in row[: 2 if storeys else 1] if corners else ():
        axes.plot([], [], color=FAINT, linestyle=":", label="corners of the plan")
    row[2].plot([], [], marker="x", color=FAINT, linestyle="none", label="below the bearings")
    where = "at centres of mass" if corners else "at nodes"
    row[0].set(xlabel=f"acceleration {where} [g]", ylabel="height z [m]")
    row[1].set_xlabel("drift at stiffness centres over height [%]")
    row[2].set_xlabel("shear V / W [-]")
    for axes in row if storeys else row[::2]:
        axes.legend(loc="best")
    for axes in row:
        axes.set_xlim(left=0.0)
        axes.set_yticks(heights, [f"{floor['name']}\n{floor['height']:g}" for floor in floors])


def has_floors(result: BuildingResult) -> bool:
    """Whether nodes are centres of mass of rigid floors, which have corners."""
    return any(node.floor for node in result.scene.building.nodes)


def draw_axial_history(axes: Axes, result: BuildingResult) -> None:
    """Axial force over that at rest over time, the bearings with the least and the largest value highlighted."""
    ratio = result.axial_force / result.scene.axial_loads
    chosen = dict.fromkeys((int(ratio.min(axis=0).argmin()), int(ratio.max(axis=0).argmax())))
    for index in range(ratio.shape[1]):
        if index not in chosen:
            axes.plot(result.time, ratio[:, index], color=FAINT, linewidth=0.4, alpha=0.5)
    for colour, index in zip(COLOURS, chosen, strict=False):
        label = result.scene.label(index)
        axes.plot(result.time, ratio[:, index], color=colour, linewidth=HAIR, label=plain(label))
    axes.axhline(0.0, color=INK, linewidth=THIN)
    axes.set(title="Axial force over that at rest", xlabel="time t [s]", ylabel="N / N at rest [-]")
    axes.margins(x=0.01)
    legend_above(axes, 2)


def legend_above(axes: Axes, columns: int) -> None:
    """A legend in room above the curves, which fill their panel."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + ROOM_ABOVE * (high - low))
    axes.legend(loc="upper right", ncols=columns)


def draw_axial_ranges(axes: Axes, result: BuildingResult) -> None:
    """Least, greatest and resting axial force of every bearing [kN]."""
    scene = result.scene
    number = np.arange(len(scene.bearings))
    low, high = 1e-3 * result.extremes.axial_force.T
    axes.barh(number, high - low, left=low, height=0.55, color=COLOURS[5], label="range")
    axes.plot(1e-3 * scene.axial_loads, number, marker="|", markersize=9, color=INK, linestyle="none", label="at rest")
    names = [plain(mount.name or str(index + 1)) for index, mount in enumerate(scene.bearings)]
    shown = number[:: max(1, len(number) // 40)]
    axes.set_yticks(shown, [names[index] for index in shown])
    axes.invert_yaxis()
    axes.axvline(0.0, color=INK, linewidth=THIN)
    axes.set(title="Axial force of every bearing", xlabel="N [kN]", ylabel="bearing")
    axes.set_xlim(left=min(0.0, float(low.min())))
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.1), ncols=2, borderaxespad=0.0)


def title_of(result: BuildingResult) -> str:
    """Name of the run; of a failed one with the time that it reached."""
    name = result.scene.name or "unnamed building"
    return name if result.succeeded else f"{name}, run failed ({result.status}) at t = {result.time[-1]:.4g} s"


def _overview_title(result: BuildingResult) -> str:
    peak, shear = result.summary["peak_displacement"]["radial"], result.summary["peak_force_ratio"]
    return f"{title_of(result)}, bearings move {MILLI * peak:.4g} mm, base shear {shear:.3f} of the weight"


def magnification(places: Array, peak: float) -> float:
    """Factor on orbits in the plan: the largest fits between neighbours; a round number."""
    gaps = np.linalg.norm(places[:, None] - places[None], axis=-1)
    apart = float(gaps[gaps > 1e-9].min(initial=np.inf)) if len(places) > 1 else 1.0
    wanted = ORBIT * (apart if np.isfinite(apart) else 1.0) / peak if peak > 0 else 1.0
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(power * max(number for number in ROUND if number * power <= wanted * (1 + 1e-9)))


EDGE = 0.06  # of a floor beyond the outermost bearings, over the size of the plan
DEPTH = 0.05  # height of a bearing in a drawing over the size of the building
NOTHING = 0.01  # of the load at rest: what is left is the mass of plates and sliders


def plan_of(scene: BuildingScene) -> tuple[Array, Array]:
    """Corners of the floors, shape (2,) each [m]: the outermost bearings and an edge."""
    low, high = scene.places.min(axis=0), scene.places.max(axis=0)
    edge = max(EDGE * float(np.linalg.norm(high - low)), 1.0)
    return low - edge, high + edge


def height_of(scene: BuildingScene) -> float:
    """Height of the highest node [m]."""
    return max(float(node.position[2]) for node in scene.building.nodes)


def size_of(scene: BuildingScene) -> float:
    """Diagonal of plan and height [m]."""
    low, high = plan_of(scene)
    return float(np.hypot(np.linalg.norm(high - low), height_of(scene)))


def level_of(scene: BuildingScene, index: int) -> float:
    """Height of the upper end of a bearing [m]."""
    return float(scene.building.node(scene.bearings[index].node).position[2])


class MovingFrame:
    """Places of the parts of a building relative to the ground of its scene, at the k times of a result.

    Displacements are `factor` times as large as the frame; rotations are small, so both follow the same line.
    """

    def __init__(self, result: BuildingResult, factor: float) -> None:
        self.result, self.factor = result, factor
        scene = self.scene = result.scene
        self.depth = DEPTH * size_of(scene)
        self.upper_ends = np.array([[*place, level_of(scene, i)] for i, place in enumerate(scene.places)])  # at rest

    def points(self, node: int, at: Array) -> Array:
        """Points that move with a node, shape (k, p, 3) [m]; at: where they are at rest, shape (p, 3) [m]."""
        position = self.scene.building.nodes[node]
        motion = self.result.node(position.name)[:, 0]
        turned = np.cross(motion[:, None, 3:], at - position.position)
        points: Array = at + self.factor * (motion[:, None, :3] - self.result.ground[:, None, 0] + turned)
        return points

    @cached_property
    def floors(self) -> Array:
        """Corners of the floors, shape (k, nodes, 4, 3) [m]."""
        (x0, y0), (x1, y1) = plan_of(self.scene)
        plan = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
        heights = [float(node.position[2]) for node in self.scene.building.nodes]
        corners = [self.points(i, np.column_stack([plan, np.full(4, z)])) for i, z in enumerate(heights)]
        return np.stack(corners, axis=1)

    @cached_property
    def nodes(self) -> Array:
        """The nodes, shape (k, nodes, 3) [m]."""
        positions = [self.points(i, node.position[None]) for i, node in enumerate(self.scene.building.nodes)]
        return np.concatenate(positions, axis=1)

    @cached_property
    def members(self) -> Array:
        """Both ends of the columns of a shear frame, above every bearing; of any other building the rigid links from
        its nodes to the bearings: shape (k, members, 2, 3) [m].
        """
        building = self.scene.building
        if not building.columns:
            names = [node.name for node in building.nodes]
            links = [names.index(bearing.node) for bearing in self.scene.bearings]
            return np.stack([self.nodes[:, links], self.uppers], axis=2)
        ends = []
        for index in range(len(building.columns)):
            heights = [float(building.nodes[k].position[2]) for k in (index, index + 1)]
            at = [np.column_stack([self.scene.places, np.full(len(self.scene.places), z)]) for z in heights]
            ends.append(np.stack([self.points(index, at[0]), self.points(index + 1, at[1])], axis=2))
        return np.concatenate(ends, axis=1)

    @cached_property
    def lowers(self) -> Array:
        """Lower ends of the bearings, shape (k, bearings, 3) [m]; they move where they have a ground of their own."""
        below = self.upper_ends - [0.0, 0.0, self.depth]
        positions: Array = below + self.factor * (self.result.support[:, :, 0] - self.result.ground[:, None, 0])
        return positions

    @cached_property
    def uppers(self) -> Array:
        """Upper ends of the bearings, shape (k, bearings, 3) [m]."""
        rows = self.scene.attachments[:, :3]
        moved = np.einsum("bin,kn->kbi", rows, self.result.displacement) - self.result.ground[:, None, 0]
        positions: Array = self.upper_ends + self.factor * moved
        return positions

    @cached_property
    def on_rim(self) -> NDArray[np.bool_]:
        """Whether a slider of each bearing touches its rim, shape (k, bearings)."""
        return np.stack([(bearing.history.gap <= 0).any(axis=1) for bearing in self.result.bearings], axis=1)

    @cached_property
    def lifted(self) -> NDArray[np.bool_]:
        """Whether each bearing carries less than `NOTHING` of its load at rest, shape (k, bearings)."""
        lifted: NDArray[np.bool_] = self.result.axial_force < NOTHING * self.scene.axial_loads
        return lifted


# Figures of the run of a building, by their names on the command line.
FIGURES: dict[str, Callable[[BuildingResult, str | Path | None], Figure]] = {
    "overview": plot_building,
    "plan": plot_plan,
    "profile": plot_profile,
    "spectra": plot_floor_spectra,
    "axial": plot_axial_forces,
}
