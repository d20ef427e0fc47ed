"""`load_scene`: a file, a preset or a table comes in; the scene of one bearing or of a building goes out.

Cheaper models of the scene of a building are made here too (docs/fidelity.md).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from msfp_gen.buildings.building import Building
from msfp_gen.buildings.scene import BuildingBearing, BuildingScene
from msfp_gen.buildings.storey import BaseSlab, Soil, Storey
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Quantity, errors_at
from msfp_gen.common.identity import fingerprint
from msfp_gen.common.inputs import Kept, digest_of, expecting
from msfp_gen.motions.motion import Motion
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.fidelity import LEVEL, LOOSE, at_fidelity, equivalent_pendulum, implicit_solver, labelled
from msfp_gen.scene.file.changes import COMMON, changed_table, keys_of
from msfp_gen.scene.file.loader import (
    bearing_from_table,
    effects_from_table,
    scene_from_table,
    scene_parts,
    scene_table,
)
from msfp_gen.scene.file.motion_tables import KINDS, Paths, located, motion_from, paths_in, resolved, with_spectrum
from msfp_gen.scene.file.schema import EFFECTS, MOTION, PARTS, model_of, rows_of, validate
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.scene_fields import FIDELITIES
from msfp_gen.scene.top import NodeTop, Top
from msfp_gen.specification.layout import Effects

Table = dict[str, Any]


@dataclass(frozen=True)
class FrameTable:
    """The plain keys of the table `[building]`.

    mass, stiffness, damping: files of matrices, as of `Building.from_matrices`, in place of base and storeys.
    damping_ratio, rayleigh_frequencies [Hz]: as in `Building.shear`. highest_frequency: as `frequency` of
    `Building.reduced` [Hz].
    """

    mass: Annotated[str | None, Paths()] = None
    stiffness: Annotated[str | None, Paths()] = None
    damping: Annotated[str | None, Paths()] = None
    damping_ratio: Annotated[float, Quantity("", least=0.0)] = 0.02
    rayleigh_frequencies: Annotated[tuple[float, float] | None, Quantity("Hz", above=0.0, shape=(2,))] = None
    highest_frequency: Annotated[float | None, Quantity("Hz", above=0.0)] = None


@dataclass(frozen=True)
class NodeTable:
    """The table `[[building.node]]`. coordinates: indices of the six coordinates of the node, from 0."""

    name: str
    coordinates: Annotated[tuple[int, ...], Quantity("", least=0, whole=True, shape=(6,))]
    position: Annotated[tuple[float, float, float], Quantity("m", shape=(3,))]


_INTERFACE, _SOIL, _BASE, _STOREY, _NODE = (model_of(kind) for kind in (NodeTop, Soil, BaseSlab, Storey, NodeTable))
_BEARING = model_of(
    BuildingBearing,
    bearing=(Any, ...),
    interface=(_INTERFACE, None),
    soil=(_SOIL, None),
    effects=(EFFECTS, None),
    motion=(MOTION, None),
)
_BUILDING = model_of(
    FrameTable,
    base=(_BASE, None),
    storey=(rows_of(_STOREY), []),
    node=(rows_of(_NODE), []),
    bearing=(rows_of(_BEARING), ...),
    interface=(_INTERFACE, None),
    soil=(_SOIL, None),
    effects=(EFFECTS, None),
)
SCENE = model_of(
    BuildingScene,
    building=(_BUILDING, ...),
    bearings=(dict[str, Any], {}),
    motion=(MOTION, ...),
    solver=(PARTS["solver"], None),
    limits=(PARTS["limits"], None),
)
_buildings: Kept[Building] = Kept(256 << 20, lambda building: 3 * building.mass.nbytes)
MATRICES = paths_in(FrameTable)
FILES = {"motion": paths_in(*KINDS.values()), "building": MATRICES}  # table -> keys that are paths of files


def building_from_table(
    table: Mapping[str, Any], folder: Path | None = None, motion: Motion | None = None
) -> BuildingScene | Scene:
    """The scene of a building from a plain table, as in a file; a `Scene` with fidelity = "equivalent".

    folder, motion: as in `scene_from_table`. Raises InputError.
    """
    parts, _ = scene_parts(SCENE, table, folder, motion)
    frame, named = parts.pop("building"), parts.pop("bearings", {})
    parts["building"] = _building(frame, folder)
    common = {name: frame[name] for name in COMMON if name in frame}
    bearings: dict[str, Bearing] = {}
    rows = enumerate(frame["bearing"])
    parts["bearings"] = [
        _bearing({**common, **row}, f"building.bearing[{index}]", named, folder, bearings) for index, row in rows
    ]
    word = parts.pop("fidelity", "exact")
    return building_at_fidelity(BuildingScene(**parts), word)


def _building(table: Table, folder: Path | None) -> Building:
    """The building of the table `[building]`; a cache has the last buildings, by their frame or matrices."""
    frame = {name: value for name, value in table.items() if name not in (*COMMON, "bearing")}
    named = [name for name in MATRICES if name in frame]
    frame |= {name: resolved(frame[name], folder, f"building.{name}") for name in named}
    with suppress(OSError):  # a file that cannot be read is an error of its reader
        files = {str(frame[name]): digest_of(Path(frame[name])) for name in named}
        with expecting(files):
            return _buildings.value(fingerprint((frame, files)), lambda: _of_table(frame, named))
    return _of_table(frame, named)


def _of_table(table: Table, files: list[str]) -> Building:
    options: Table = {name: table[name] for name in ("damping_ratio", "rayleigh_frequencies") if name in table}
    frames = [name for name in ("base", "storey") if table.get(name)]
    if files and frames:
        raise InputError(f"building.{frames[0]}: not together with building.{files[0]}; give a frame or its matrices")
    building = _of_matrices(table, options) if files else _of_storeys(table, options)
    return building.reduced(table["highest_frequency"]) if "highest_frequency" in table else building


def _of_storeys(table: Table, options: Table) -> Building:
    if "base" not in table:
        raise InputError("building.base is missing: give this table, or mass and stiffness as files of matrices")
    if table.get("node"):
        raise InputError("building.node: a frame of storeys makes its nodes; leave it out")
    with errors_at("base", "building.base"):
        base = BaseSlab(**table["base"])
    storeys = []
    for index, row in enumerate(table.get("storey", [])):
        with errors_at("storey", f"building.storey[{index}]"):
            storeys.append(Storey(**row))
    return Building.shear(base, storeys, **options)


def _of_matrices(table: Table, options: Table) -> Building:
    for name in MATRICES[:2]:
        if name not in table:
            raise InputError(f"building.{name} is missing: give the path of a .mtx or .npz file")
    files = {name: table.get(name) for name in MATRICES}
    nodes: dict[str, Any] = {}
    for index, row in enumerate(table.get("node", [])):
        if row["name"] in nodes:
            raise InputError(f"building.node[{index}].name = {row['name']!r}: a node has it already; give another")
        nodes[row["name"]] = (row["coordinates"], row["position"])
    return Building.from_matrices(**files, nodes=nodes, **options)  # type: ignore[arg-type]


def stored_bearing(row: Table, index: int) -> BuildingBearing:
    """A bearing from a complete table of a result file, in SI units. Raises InputError."""
    path = f"bearing[{index}]"
    return _bearing(validate(_BEARING, row), path, {}, None, {})


def _bearing(row: Table, path: str, named: Table, folder: Path | None, bearings: dict[str, Bearing]) -> BuildingBearing:
    """A bearing from the table `[[building.bearing]]` at `path`. named, bearings: as of `_bearing_values`."""
    values = dict(row)
    if "interface" not in values:
        raise InputError(f"{path}.interface is missing: give this table, or [building.interface] for all bearings")
    values["bearing"] = _bearing_values(values["bearing"], path, named, bearings)
    with errors_at("effects", f"{path}.effects"):
        if "effects" in values:
            values["effects"] = effects_from_table(values["effects"])
    if "motion" in values:
        with errors_at("motion", f"{path}.motion"):
            values["motion"] = motion_from(located(values["motion"], folder))
    with errors_at("top", f"{path}.interface"):
        values["interface"] = NodeTop(**values["interface"])
    with errors_at("soil", f"{path}.soil"):
        if "soil" in values:
            values["interface"] = Soil(**values.pop("soil")).below(values["interface"])
    with errors_at("building_bearing", path):
        return BuildingBearing(**values)


def _bearing_values(source: Any, path: str, named: Table, bearings: dict[str, Bearing]) -> Bearing:
    """The values of a bearing. source: name in `[bearings]` or of a preset, or a table. Raises InputError.

    named: the table `[bearings]`. bearings: name -> values that are read already; receives further ones.
    """
    in_file = isinstance(source, str) and source in named
    if isinstance(source, str) and source in bearings:
        return bearings[source]
    place = f"bearings.{source}" if in_file else f"{path}.bearing"
    try:
        bearing = bearing_from_table(named[source] if in_file else source)
    except InputError as error:
        others = isinstance(source, str) and not in_file and named
        names = f"; those of [bearings] are {', '.join(named)}" if others else ""
        raise InputError(place + str(error).removeprefix("bearing") + names) from None
    if isinstance(source, str):
        bearings[source] = bearing
    return bearing


AnyScene = Scene | BuildingScene


def load_scene(source: str | Path) -> AnyScene:
    """The scene in a TOML file, or the preset of a name. Paths inside a file are relative to the file.

    A file with a table `[building]` gives a `BuildingScene`. Raises InputError of one line that names the file, the
    path of the field, the value and the remedy.
    """
    return changed_scene(source, {})


def load_bearing_scene(source: str | Path) -> Scene:
    """The scene of one bearing in a file or preset. Raises InputError as `load_scene` does, and for a building."""
    scene = load_scene(source)
    if not isinstance(scene, Scene):
        raise InputError(f"scene = {str(source)!r}: this is a building; give a scene of one bearing here")
    return scene


def changed_scene(source: str | Path, changes: Mapping[str, Any]) -> AnyScene:
    """The scene of `load_scene(source)` with some fields changed.

    changes: path of a field, such as `motion.scale`, `bearing.surfaces[0].friction` or
    `building.bearing[*].bearing.friction`, -> value. Raises InputError as `load_scene` does.
    """
    table, path = scene_table(source)
    try:
        return scene_of(changed_table(table, changes), None if path is None else path.parent)
    except InputError as error:
        if path is None:
            raise
        raise InputError(f"{path}: {error}") from None


def scene_of(table: Mapping[str, Any], folder: Path | None = None, **parts: Any) -> AnyScene:
    """The scene of a plain table, as in a file; folder, parts: as in `scene_from_table`. Raises InputError."""
    return (building_from_table if "building" in table else scene_from_table)(table, folder, **parts)


def reduced(scene: AnyScene, word: str) -> AnyScene:
    """The scene at a level of fidelity. Raises InputError: an unknown level, or a level that the scene cannot have."""
    if not isinstance(word, str) or word not in FIDELITIES:
        raise InputError(f"fidelity = {word!r}: give one of {', '.join(map(repr, FIDELITIES))}")
    return at_fidelity(scene, word) if isinstance(scene, Scene) else building_at_fidelity(scene, word)


def building_at_fidelity(scene: BuildingScene, word: str) -> BuildingScene | Scene:
    """The scene at a level of fidelity: "exact" (as it is), "backbone", "loose", "massless", "rigid", or "equivalent".

    "equivalent" gives the scene of one bearing that carries the whole building. Raises InputError of one line.
    """
    if word in ("exact", "backbone"):
        return labelled(scene, word)
    if word == "equivalent":
        return _equivalent(scene)
    if word == "loose" and scene.solver.rtol >= LOOSE:
        raise InputError(f"fidelity = 'loose': solver.rtol = {scene.solver.rtol:g} already; give less than {LOOSE:g}")
    bearings = scene.bearings if word == "loose" else [
        replace(mount, effects=replace(effects, sliders="massless", uplift=False))
        for mount, effects in zip(scene.bearings, scene.modelled, strict=True)
    ]  # fmt: skip
    building = rigid_building(scene.building) if word == "rigid" else scene.building
    return replace(scene, building=building, bearings=bearings, solver=implicit_solver(scene.solver), fidelity=word)


def rigid_building(building: Building) -> Building:
    """The building as one rigid body with its nodes and without columns; its coordinates are the six rigid motions."""
    motions = building.rigid_motions
    zeros = np.zeros((6, 6))
    nodes = tuple(replace(node, rows=node.rows @ motions) for node in building.nodes)
    return Building(motions.T @ building.mass @ motions, zeros, zeros, nodes)


def check_one_ground(scene: BuildingScene, word: str) -> None:
    """Raise InputError where bearings have different motions of the ground. word: fidelity with one motion only."""
    if len(set(scene.grounds[1])) > 1:
        raise InputError(
            f"fidelity = {word!r}: it has one motion of the ground, and bearings have motions of their own; give "
            "another model, such as 'rigid'"
        )


def load_shares(scene: BuildingScene) -> list[float]:
    """The share of the weight that each bearing carries at rest [-]."""
    shares: list[float] = (scene.axial_loads / scene.axial_loads.sum()).tolist()
    return shares


def _equivalent(scene: BuildingScene) -> Scene:
    """The scene of the equivalent pendulum of all bearings, which carries the building as a mass."""
    check_one_ground(scene, "equivalent")
    bearing = equivalent_pendulum(scene.every_bearing, load_shares(scene))
    mass = float(scene.axial_loads.sum()) / scene.gravity
    springs = [
        float(sum(getattr(mount.interface, name) for mount in scene.bearings))
        for name in ("vertical_stiffness", "vertical_damping")
    ]
    top = Top.mass(
        mass, inertia=mass, height=0.0, rotational_stiffness=LEVEL * mass * scene.gravity,
        vertical_stiffness=springs[0], vertical_damping=springs[1],
    )  # fmt: skip
    effects = Effects(dimension="spatial", sliders="massless", bouc_wen=scene.modelled[0].bouc_wen)
    return Scene(
        bearing=bearing, motion=scene.first_ground, top=top, effects=effects, solver=implicit_solver(scene.solver),
        duration=scene.end, output_step=scene.output_step, name=scene.name, limits=scene.limits, fidelity="equivalent",
    )  # fmt: skip


def with_absolute_paths(table: Mapping[str, Any], folder: Path | None) -> dict[str, Any]:
    """The table of a scene with absolute paths of its files; `folder`: as in `scene_from_table`. Raises InputError."""
    absolute = deepcopy(dict(table))
    for place, inner, names in _with_files(absolute):
        for name in names:
            if name in inner and _are_texts(inner[name]):  # the schema refuses other values
                inner[name] = resolved(inner[name], folder, f"{place}.{name}")
        if isinstance(inner.get("scale_to"), dict):
            inner["scale_to"] = with_spectrum(inner["scale_to"], folder, f"{place}.scale_to")
    return absolute


def located_value(path: str, value: Any, folder: Path | None) -> Any:
    """A value of the field `path` with absolute paths of files; folder, errors: as of `with_absolute_paths`."""
    keys = keys_of(path)
    nested: Any = value
    for key in reversed(keys):
        nested = {key: nested} if isinstance(key, str) else [nested]
    nested = with_absolute_paths(nested, folder)
    for key in keys:
        nested = nested[key if isinstance(key, str) else 0]
    return nested


def _are_texts(value: Any) -> bool:
    return isinstance(value, str) or (isinstance(value, list | tuple) and all(isinstance(item, str) for item in value))


def _with_files(table: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any], tuple[str, ...]]]:
    """Path, table and keys of every table that may name files; the motions of single bearings are the last."""
    yield from ((part, table[part], names) for part, names in FILES.items() if isinstance(table.get(part), dict))
    frame = table.get("building")
    rows = frame.get("bearing") if isinstance(frame, dict) else None
    for i, row in enumerate(rows if isinstance(rows, list) else ()):
        if isinstance(row, dict) and isinstance(row.get("motion"), dict):
            yield f"building.bearing[{i}].motion", row["motion"], FILES["motion"]
