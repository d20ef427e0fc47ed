"""The superstructure of a report: storeys as given, modes on a fixed base, participating masses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.arrays import Array
from msfp_gen.common.tables import Table
from msfp_gen.figures.style import COLOURS, headline, page, panels, plain, subscript

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LISTED = 12  # modes in the table, at most
DRAWN = 6
STOREY = (
    "height", "mass", "mass_centre", "stiffness", "stiffness_centre", "torsional_stiffness", "vertical_stiffness",
    "rocking_stiffness",
)  # fmt: skip


class Modes(NamedTuple):
    """Modes of the undamped building on fixed attachments, from the lowest.

    frequencies: shape (modes,) [Hz]. participating: mass in rigid motion along E1, E2, E3 over the mass above the
    attachments, shape (modes, 3) [-]. shapes: of the nodes, along E1, E2 and about E3 times half the diagonal of the
    plan, the largest 1, shape (modes, nodes, 3) [-].
    """

    frequencies: Array
    participating: Array
    shapes: Array


def modes_of(scene: BuildingScene) -> Modes:
    """The modes of the building of a scene, which is not reduced to its lowest modes."""
    building = scene.building
    fixed, rigid = building.fixed, building.rigid_motions[:, :3]
    forces = (building.mass @ rigid)[fixed.inner]
    above = np.diag(rigid[fixed.inner].T @ building.mass[np.ix_(fixed.inner, fixed.inner)] @ rigid[fixed.inner])
    above = np.where(above > 0, above, 1.0)  # no mass, and nothing takes part
    motions = np.zeros((len(building.mass), len(fixed.frequencies)))
    motions[fixed.inner] = fixed.modes
    arm = np.linalg.norm(np.ptp(scene.places, axis=0)) / 2
    rows = np.stack([node.rows[[0, 1, 5]] * np.array([[1.0], [1.0], [arm]]) for node in building.nodes])
    shapes = np.moveaxis(rows @ motions, 2, 0)
    at = np.abs(shapes).reshape(len(shapes), -1).argmax(axis=1)
    largest = shapes.reshape(len(shapes), -1)[np.arange(len(shapes)), at]
    largest[largest == 0] = 1.0  # a vertical mode
    return Modes(building.frequencies, (fixed.modes.T @ forces) ** 2 / above, shapes / largest[:, None, None])


def mode_table(modes: Modes) -> Table:
    """Period, frequency and participating mass of the lowest modes, and the sum over all."""
    rows = [
        (str(number), f"{1 / frequency:.4g}", f"{frequency:.4g}", *(f"{100 * share:.2f}" for share in shares))
        for number, (frequency, shares) in enumerate(zip(modes.frequencies, modes.participating, strict=True), 1)
    ]
    total = ("sum of all", "", "", *(f"{100 * share:.2f}" for share in modes.participating.sum(axis=0)))
    masses = (f"mass along E{axis} [%]" for axis in (1, 2, 3))
    title = "modes on a fixed base; participating mass over the mass above it"
    return Table(title, ("mode", "period [s]", "frequency [Hz]", *masses), [*rows[:LISTED], total])


def plot_modes(scene: BuildingScene, modes: Modes, path: str | Path | None = None) -> Figure:
    """Shapes of the lowest modes over the height. path: see `plot_plan`."""
    nodes = scene.building.nodes
    order = np.argsort([node.position[2] for node in nodes])
    heights = [float(nodes[index].position[2]) for index in order]
    count = min(DRAWN, len(modes.frequencies))
    with page(9.5, 3.8, path) as figure:
        headline(figure, f"{scene.name or 'building'}: modes on a fixed base")
        titles = [f"{number}: {1 / modes.frequencies[number - 1]:.3g} s" for number in range(1, count + 1)]
        row = panels(figure, *titles, sharey=True)
        labels = (f"E{subscript(1)}", f"E{subscript(2)}", f"about E{subscript(3)}, at a corner")
        for shape, axes in zip(modes.shapes, row, strict=False):
            for values, colour, label in zip(shape[order].T, COLOURS, labels, strict=False):
                axes.plot(values, heights, marker="o", markersize=3, color=colour, label=label)
            axes.set_xlim(-1.1, 1.1)
        row[0].set(ylabel="height z [m]")
        row[0].set_yticks(heights, [f"{plain(nodes[index].name)}\n{nodes[index].position[2]:g}" for index in order])
        row[-1].legend(loc="upper left", bbox_to_anchor=(1.02, 1))
    return figure


def _unreduced(scene: BuildingScene, table: Mapping[str, Any]) -> BuildingScene:
    """The scene with all modes: a reduced building no longer tells the mass of its base from the mass above."""
    from msfp_gen.buildings.file import building_from_table

    frame = {name: value for name, value in table.get("building", {}).items() if name != "highest_frequency"}
    whole = building_from_table({**table, "building": frame}, parts={"motion": scene.motion})
    return whole if isinstance(whole, BuildingScene) else scene


def storey_table(table: Mapping[str, Any]) -> Table | None:
    """The storeys of a `[building]` table, as given, from the top; None where it has matrices in their place."""
    storeys = table.get("storey")
    if not storeys:
        return None
    levels = [("base", table.get("base", {})), *((str(number), storey) for number, storey in enumerate(storeys, 1))]
    known = [name for name in STOREY if any(name in level for _, level in levels)]
    rows = [(label, *(_cell(level.get(name)) for name in known)) for label, level in reversed(levels)]
    title = "base and storeys as given; SI units where none stands"
    return Table(title, ("level", *(name.replace("_", " ") for name in known)), rows)


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ", ".join(map(_cell, value))
    return value if isinstance(value, str) else f"{value:.4g}"


def structure(scene: BuildingScene, table: Mapping[str, Any]) -> tuple[list[Table], list[tuple[str, Figure]]]:
    """Tables and figures, with their captions, of the superstructure. table: of the scene."""
    storeys, kept = storey_table(table.get("building", {})), len(scene.building.frequencies)
    if not kept:
        return [storeys] if storeys else [], []
    modes = Modes(*(values[:kept] for values in modes_of(_unreduced(scene, table))))
    caption = (
        f"Shapes of the first {min(DRAWN, len(modes.frequencies))} modes on a fixed base, at the centres of mass; "
        "rotation as the motion of a corner of the plan"
    )
    return [*([storeys] if storeys else []), mode_table(modes)], [(caption, plot_modes(scene, modes))]
