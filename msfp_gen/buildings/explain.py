"""`msfp-gen explain` of a building: its frame, its bearings with the effects of each, motion and solver."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.buildings.plausibility import building_doubts
from msfp_gen.buildings.scene import BuildingScene, remaining_loads, standing_below
from msfp_gen.common.tables import Table, vector
from msfp_gen.scene import explain as tables
from msfp_gen.scene.effect_selection import doubtful_values
from msfp_gen.scene.standing import unsteady

if TYPE_CHECKING:
    from msfp_gen.buildings.load import AnyScene

LISTED = 12  # frequencies of the frame that are listed


def explain(scene: AnyScene) -> list[Table]:
    """Tables that describe a scene, of one bearing or of a building."""
    return explain_building(scene) if isinstance(scene, BuildingScene) else tables.explain(scene)


def explain_building(scene: BuildingScene) -> list[Table]:
    """Tables that describe a building: frame, bearings and their kinds, effects of each, motion, solver."""
    return [
        frame_table(scene),
        bearing_table(scene),
        *_kinds(scene),
        *_interfaces(scene),
        *tables.doubt_tables(_doubts(scene)),
        *map(tables.motion_table, scene.grounds[0]),
        *effect_tables(scene),
        _solver(scene),
    ]


def frame_table(scene: BuildingScene) -> Table:
    """Mass, coordinates, nodes and frequencies of the building."""
    building, shown = scene.building, scene.building.frequencies[:LISTED]
    more = f", ... of {len(building.frequencies)}" if len(building.frequencies) > LISTED else ""
    rows = [
        ("weight", f"{scene.weight * 1e-6:.5g} MN at g = {scene.gravity:g} m/s^2"),
        ("coordinates", str(len(building.mass))),
        ("nodes", ", ".join(f"{node.name} ({vector(node.position)} m)" for node in building.nodes)),
        ("frequencies on fixed attachments", f"{vector(shown)}{more} Hz" if len(shown) else "none: a rigid body"),
    ]
    return Table("building", (), rows)


def bearing_table(scene: BuildingScene) -> Table:
    """The bearings: kind, place, load at rest."""
    kinds = grouped(scene.every_bearing)
    kind_of = {index: str(number) for number, members in enumerate(kinds, start=1) for index in members}
    rows = [
        (
            str(index + 1),
            each.name or "-",
            each.bearing.layout.name,
            kind_of[index],
            each.node,
            *(f"{x:.4g}" for x in scene.places[index]),
            f"{load * 1e-3:.4g}",
        )
        for index, (each, load) in enumerate(zip(scene.bearings, scene.axial_loads, strict=True))
    ]
    columns = ("no.", "name", "layout", "kind", "node", "x [m]", "y [m]", "N at rest [kN]")
    return Table(f"{len(rows)} bearings", columns, rows)


def effect_tables(scene: BuildingScene) -> Iterator[Table]:
    """The effects of each bearing, those with the same ones together; loads that decide are the least of them."""
    remaining = remaining_loads(scene)
    keys = (
        (selection.effects, tuple((reason.effect, reason.chosen) for reason in selection.reasons), one.bearing)
        for selection, one in zip(scene.effect_selections, scene.bearings, strict=True)
    )
    for members in grouped(keys):
        decisive = min(members, key=lambda index: float(remaining[index]))  # keeps the least of its load
        selection = scene.effect_selections[decisive]
        table = tables.effect_table(selection)
        yield Table(f"{_numbers(members, len(scene.bearings))}: {table.title}", (), table.rows)
        yield from tables.friction_tables(selection.effects.law, scene.bearings[members[0]].bearing)


def grouped(keys: Iterable[Hashable]) -> list[list[int]]:
    """Indices of equal keys together, in the order of the first of each."""
    groups: dict[Hashable, list[int]] = {}
    for index, key in enumerate(keys):
        groups.setdefault(key, []).append(index)
    return list(groups.values())


def _kinds(scene: BuildingScene) -> Iterator[Table]:
    for number, members in enumerate(grouped(scene.every_bearing), start=1):
        bearing, where = scene.bearings[members[0]].bearing, _numbers(members, len(scene.bearings))
        doubts = tables.doubt_tables(doubtful_values(bearing))
        for table in (tables.surface_table(bearing), *doubts, tables.body_table(bearing)):
            yield Table(f"kind {number}, {where}: {table.title}", table.columns, table.rows)


def _interfaces(scene: BuildingScene) -> Iterator[Table]:
    for members in grouped(one.interface for one in scene.bearings):
        where = _numbers(members, len(scene.bearings))
        yield tables.top_table(scene.bearings[members[0]].interface, f"interface to the building, {where}")


def _doubts(scene: BuildingScene) -> Iterator[tuple[int, float, str]]:
    """Doubts about the interfaces; those of bearings stand with their kinds."""
    for index, (each, load) in enumerate(zip(scene.bearings, scene.axial_loads, strict=True)):
        given, needed, _ = standing_below(each, load)
        yield from unsteady(f"{scene.label(index)}: interface.rotational_stiffness", given, needed)
    yield from building_doubts(scene)


def _solver(scene: BuildingScene) -> Table:
    solver = scene.solver
    rows = [
        ("method", f"{solver.method}: building and bearings together"),
        ("rtol", f"{solver.rtol:g}, relative error of a step"),
        ("longest step", "resolution of the motion" if solver.max_step is None else f"{solver.max_step:g} s"),
        ("rows", f"every {scene.row_step:g} s"),
        ("ends at", f"{scene.end:.6g} s"),
    ]
    return Table("solver", (), rows)


def _numbers(members: Iterable[int], count: int) -> str:
    """Numbers of bearings in words: ranges together."""
    numbers = np.array(sorted(members)) + 1
    if len(numbers) == count:
        return "all bearings" if count > 1 else "the bearing"
    runs = np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1)
    shown = ", ".join(f"{run[0]}" if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs)
    return f"bearing{'s' if len(numbers) > 1 else ''} {shown}"
