"""What `msfp-gen explain` says of the scene of a building: tables of frame, bearings, effects and motions."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator

import numpy as np

from msfp_gen.buildings.bearing import standing_below
from msfp_gen.buildings.effects import remaining_loads
from msfp_gen.buildings.notes import building_doubts, ground_doubts, shared
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.tables import Table, vector_text
from msfp_gen.results.note import Note
from msfp_gen.scene.explain import (
    body_table,
    doubt_tables,
    effect_table,
    friction_tables,
    limit_tables,
    motion_table,
    solver_table,
    surface_table,
    top_table,
)
from msfp_gen.scene.plausibility import doubtful_values
from msfp_gen.scene.standing import unsteady

LISTED = 12  # frequencies of the building in its table, at most


def explain(scene: BuildingScene) -> list[Table]:
    """Tables that describe the scene of a building."""
    return [
        frame_table(scene),
        bearings_table(scene),
        *_kinds(scene),
        *_interfaces(scene),
        *doubt_tables(_doubts(scene)),
        *map(motion_table, scene.grounds[0]),
        *effect_tables(scene),
        *limit_tables(scene.limits),
        solver_table(scene, "building and bearings together", scene.row_step),
    ]


def frame_table(scene: BuildingScene) -> Table:
    """Weight, degrees of freedom, diaphragms, other nodes and frequencies of the building."""
    building, listed = scene.building, scene.building.frequencies[:LISTED]
    more = f", the first {LISTED} of {len(building.frequencies)}" if len(building.frequencies) > LISTED else ""
    listed_nodes: dict[str, list[str]] = {"diaphragms": [], "nodes": []}
    for node in building.nodes:
        listed_nodes["diaphragms" if node.floor else "nodes"].append(f"{node.name} ({vector_text(node.position)} m)")
    rows = [
        ("weight", f"{scene.weight * 1e-6:.5g} MN at g = {scene.gravity:g} m/s^2"),
        ("degrees of freedom", str(len(building.mass))),
        *((name, ", ".join(places)) for name, places in listed_nodes.items() if places),
        ("frequencies on a fixed base", f"{vector_text(listed)} Hz{more}" if len(listed) else "none: a rigid body"),
    ]
    return Table("building", (), rows)


def bearings_table(scene: BuildingScene) -> Table:
    """Kind, position and load at rest of every bearing."""
    kinds = grouped(scene.every_bearing)
    kind_of = {index: str(number) for number, members in enumerate(kinds, start=1) for index in members}
    rows = [
        (
            str(index + 1),
            mount.name or "-",
            mount.bearing.layout.name,
            kind_of[index],
            mount.node,
            *(f"{x:.4g}" for x in scene.places[index]),
            f"{load * 1e-3:.4g}",
        )
        for index, (mount, load) in enumerate(zip(scene.bearings, scene.axial_loads, strict=True))
    ]
    carries = "diaphragm" if all(scene.building.node(mount.node).floor for mount in scene.bearings) else "node"
    columns = ("no.", "name", "layout", "type", carries, "x [m]", "y [m]", "N at rest [kN]")
    return Table(f"{len(rows)} bearings", columns, rows)


def effect_tables(scene: BuildingScene) -> Iterator[Table]:
    """The effects of the bearings; bearings of one kind with equal effects have one table.

    The reasons are of the bearing that keeps the least share of its load at rest.
    """
    remaining = remaining_loads(scene)
    keys = (
        (selection.effects, tuple((reason.effect, reason.chosen) for reason in selection.reasons), mount.bearing)
        for selection, mount in zip(scene.effect_selections, scene.bearings, strict=True)
    )
    for members in grouped(keys):
        decisive = min(members, key=lambda index: float(remaining[index]))
        selection = scene.effect_selections[decisive]
        table = effect_table(selection)
        yield Table(f"{_numbers(members, len(scene.bearings))}: {table.title}", (), table.rows)
        yield from friction_tables(selection.effects.law, scene.bearings[members[0]].bearing)


def grouped(keys: Iterable[Hashable]) -> list[list[int]]:
    """Groups of indices of equal keys, in the order of the first index of each group."""
    groups: dict[Hashable, list[int]] = {}
    for index, key in enumerate(keys):
        groups.setdefault(key, []).append(index)
    return list(groups.values())


def _kinds(scene: BuildingScene) -> Iterator[Table]:
    """Surfaces, doubtful values and bodies of every kind of bearing."""
    for number, members in enumerate(grouped(scene.every_bearing), start=1):
        bearing, where = scene.bearings[members[0]].bearing, _numbers(members, len(scene.bearings))
        doubts = doubt_tables(doubtful_values(bearing, float(max(scene.axial_loads[index] for index in members))))
        for table in (surface_table(bearing), *doubts, body_table(bearing)):
            yield Table(f"isolator type {number}, {where}: {table.title}", table.columns, table.rows)


def _interfaces(scene: BuildingScene) -> Iterator[Table]:
    """The different interfaces, each with the numbers of its bearings."""
    for members in grouped(mount.interface for mount in scene.bearings):
        where = _numbers(members, len(scene.bearings))
        yield top_table(scene.bearings[members[0]].interface, f"joint to the building, {where}")


def _doubts(scene: BuildingScene) -> Iterator[tuple[int, float, str]]:
    """Doubts about interfaces, the ground and the building; `_kinds` has the doubts about bearings."""
    notes = shared(
        Note(0.0, "value", *doubt, bearing=number)
        for number, (mount, load) in enumerate(zip(scene.bearings, scene.axial_loads, strict=True), start=1)
        for doubt in (
            *unsteady("interface.rotational_stiffness", *standing_below(mount, load)[:2]),
            *ground_doubts(mount),
        )
    )
    yield from ((0, note.value, f"{scene.label(note.bearing - 1)}: {note.text}") for note in notes)
    yield from building_doubts(scene)


def _numbers(members: Iterable[int], count: int) -> str:
    """Numbers of bearings as text, with ranges. members: indices from 0. count: of all bearings."""
    numbers = np.array(sorted(members)) + 1
    if len(numbers) == count:
        return "all bearings" if count > 1 else "the bearing"
    runs = np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1)
    ranges = ", ".join(f"{run[0]}" if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs)
    return f"bearing{'s' if len(numbers) > 1 else ''} {ranges}"
