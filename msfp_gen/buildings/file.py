"""Scenes of buildings from the tables of scene files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

from msfp_gen.buildings.bearing import BuildingBearing
from msfp_gen.buildings.building import Building
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.buildings.storey import BaseSlab, Soil, Storey
from msfp_gen.common.aliases import SceneTable
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Quantity, errors_at
from msfp_gen.common.identity import fingerprint
from msfp_gen.common.inputs import InputCache, digest_of, expecting
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.fidelity import at_fidelity
from msfp_gen.scene.file.loader import (
    NO_PARTS,
    Parts,
    bearing_from_table,
    effects_from_table,
    scene_parts,
)
from msfp_gen.scene.file.motion_tables import Paths, located, motion_from, paths_in, resolved
from msfp_gen.scene.file.schema import (
    EFFECTS,
    LIMITS,
    MOTION,
    SOLVER,
    Key,
    ListOf,
    ParsedValue,
    keys_of,
    required,
    validate,
)
from msfp_gen.scene.file.source import MOTION_PATHS
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.system import Kind
from msfp_gen.scene.top import NodeTop

COMMON = ("interface", "soil", "effects")  # tables of [building] for all bearings that have none of their own


@dataclass(frozen=True)
class FrameTable:
    """The plain keys of the table `[building]`.

    mass, stiffness, damping: files of matrices, as in `Building.from_matrices`, in place of base and storeys.
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


@dataclass(frozen=True)
class GridTable:
    """The table `grid` of a row of `[[building.bearing]]`: a bearing at every crossing of the lines x and y [m]."""

    x: Annotated[tuple[float, ...], Quantity("m", shape=(None,))]
    y: Annotated[tuple[float, ...], Quantity("m", shape=(None,))]


_INTERFACE, _SOIL, _BASE, _STOREY, _NODE = (keys_of(kind) for kind in (NodeTop, Soil, BaseSlab, Storey, NodeTable))


def _any(value: Any, *, text: bool) -> Any:
    """A bearing, which `_bearing_values` reads."""
    return value


def _tables(value: Any, *, text: bool) -> SceneTable:
    """The table `[bearings]`, whose tables are read by name."""
    if not isinstance(value, Mapping):
        raise ValueError("give a table")
    return dict(value)


_COMMON = {"interface": Key(_INTERFACE), "soil": Key(_SOIL), "effects": Key(EFFECTS)}
_SINGLE = {**_COMMON, "motion": Key(MOTION)}
_BEARING = keys_of(BuildingBearing, bearing=required(ParsedValue(_any)), grid=Key(keys_of(GridTable)), **_SINGLE)
_STORED = keys_of(BuildingBearing, bearing=required(ParsedValue(_any)), **_SINGLE)
_BUILDING = keys_of(
    FrameTable,
    base=Key(_BASE),
    storey=Key(ListOf(_STOREY)),
    node=Key(ListOf(_NODE)),
    bearing=required(ListOf(_BEARING)),
    **_COMMON,
)
SCENE = keys_of(
    BuildingScene,
    building=required(_BUILDING),
    bearings=Key(ParsedValue(_tables)),
    motion=required(MOTION),
    solver=Key(SOLVER),
    limits=Key(LIMITS),
)
_buildings: InputCache[Building] = InputCache(256 << 20, lambda building: 3 * building.mass.nbytes)
MATRICES = paths_in(FrameTable)


def building_from_table(
    table: Mapping[str, Any], folder: Path | None = None, parts: Parts = NO_PARTS
) -> BuildingScene | Scene:
    """The scene of a building from a plain table, as in a file; a `Scene` with fidelity = "equivalent".

    folder, parts: as in `scene_from_table`, of all but `building` and `bearings`. Raises InputError.
    """
    parts = scene_parts(SCENE, table, folder, parts)
    frame, named = parts.pop("building"), parts.pop("bearings", {})
    parts["building"] = _building(frame, folder)
    common = {name: frame[name] for name in COMMON if name in frame}
    bearings: dict[str, Bearing] = {}
    rows = enumerate(with_single_bearings(frame)["bearing"])
    parts["bearings"] = [
        _bearing({**common, **row}, f"building.bearing[{index}]", named, folder, bearings) for index, row in rows
    ]
    word = parts.pop("fidelity", "exact")
    scene: BuildingScene | Scene = at_fidelity(BuildingScene(**parts), word)
    return scene


def with_single_bearings(frame: SceneTable) -> SceneTable:
    """The table `[building]` with a row for each bearing of a grid, along x first; rows of no valid grid stay.

    Bearings have the names of the grid, A1, B1, ..., A2, ..., after the `name` of its row. Raises InputError.
    """
    rows = frame.get("bearing")
    if not isinstance(rows, list):
        return frame
    return {**frame, "bearing": [single for index, row in enumerate(rows) for single in _single(row, index)]}


def _single(row: Any, index: int) -> Iterator[Any]:
    """The rows of the bearings of a grid; a row without a valid grid itself."""
    grid: Any = row.get("grid") if isinstance(row, dict) else None
    is_grid = isinstance(grid, dict) and grid.keys() == {"x", "y"} and isinstance(row.get("name", ""), str)
    if not is_grid or not all(isinstance(line, list | tuple) for line in grid.values()):
        yield row
        return
    if not all(grid.values()):
        raise InputError(f"building.bearing[{index}].grid = {grid!r}: give at least one line along each axis")
    if "position" in row:
        raise InputError(f"building.bearing[{index}].position: the grid has all places; leave out one of them")
    common, name = {key: value for key, value in row.items() if key != "grid"}, row.get("name", "")
    for j, y in enumerate(grid["y"], start=1):
        yield from ({**common, "name": f"{name}{_letters(i)}{j}", "position": [x, y]} for i, x in enumerate(grid["x"]))


def _letters(index: int) -> str:
    """The name of a line by its index: A to Z, AA, AB, ..."""
    before, last = divmod(index, 26)
    return (_letters(before - 1) if before else "") + chr(ord("A") + last)


def _building(table: SceneTable, folder: Path | None) -> Building:
    """The building of the table `[building]`; a cache has the last buildings, by their frame or matrices."""
    frame = {name: value for name, value in table.items() if name not in (*COMMON, "bearing")}
    named = [name for name in MATRICES if name in frame]
    frame |= {name: resolved(frame[name], folder, f"building.{name}") for name in named}
    with suppress(OSError):  # a file that cannot be read is an error of its reader
        files = {str(frame[name]): digest_of(Path(frame[name])) for name in named}
        with expecting(files):
            return _buildings.value(fingerprint((frame, files)), lambda: _of_table(frame, named))
    return _of_table(frame, named)


def _of_table(table: SceneTable, files: list[str]) -> Building:
    options: SceneTable = {name: table[name] for name in ("damping_ratio", "rayleigh_frequencies") if name in table}
    frames = [name for name in ("base", "storey") if table.get(name)]
    if files and frames:
        raise InputError(f"building.{frames[0]}: not together with building.{files[0]}; give a frame or its matrices")
    building = _of_matrices(table, options) if files else _of_storeys(table, options)
    return building.reduced(table["highest_frequency"]) if "highest_frequency" in table else building


def _of_storeys(table: SceneTable, options: SceneTable) -> Building:
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


def _of_matrices(table: SceneTable, options: SceneTable) -> Building:
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


def stored_bearing(row: SceneTable, index: int) -> BuildingBearing:
    """A bearing from a complete table of a result file, in SI units. Raises InputError."""
    path = f"bearing[{index}]"
    return _bearing(validate(_STORED, row), path, {}, None, {})


def _bearing(
    row: SceneTable, path: str, named: SceneTable, folder: Path | None, bearings: dict[str, Bearing]
) -> BuildingBearing:
    """A bearing from the table `[[building.bearing]]` at `path`. named, bearings: see `_bearing_values`."""
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


def _bearing_values(source: Any, path: str, named: SceneTable, bearings: dict[str, Bearing]) -> Bearing:
    """The values of a bearing. source: name in `[bearings]` or of a preset, or a table. Raises InputError."""
    # named: the table `[bearings]`. bearings: name -> values that are read already; receives further ones.
    in_file = isinstance(source, str) and source in named
    if isinstance(source, str) and source in bearings:
        return bearings[source]
    place = f"bearings.{source}" if in_file else f"{path}.bearing"
    try:
        bearing = bearing_from_table(named[source] if in_file else source)
    except InputError as error:
        others = isinstance(source, str) and not in_file and named
        names = f"; [bearings] has {', '.join(named)}" if others else ""
        raise InputError(place + str(error).removeprefix("bearing") + names) from None
    if isinstance(source, str):
        bearings[source] = bearing
    return bearing


def _with_files(table: Mapping[str, Any]) -> Iterator[tuple[str, SceneTable, tuple[str, ...]]]:
    """Place, table and keys of the matrices of `[building]`, and of the motions of single bearings."""
    frame = table["building"]
    if not isinstance(frame, dict):
        return
    yield "building", frame, MATRICES
    rows = frame.get("bearing")
    for i, row in enumerate(rows if isinstance(rows, list) else ()):
        if isinstance(row, dict) and isinstance(row.get("motion"), dict):
            yield f"building.bearing[{i}].motion", row["motion"], MOTION_PATHS


def _result() -> Any:
    from msfp_gen.buildings.result import BuildingResult

    return BuildingResult


BUILDING = Kind(
    "building",
    building_from_table,
    _with_files,
    COMMON,
    files(__package__) / "presets",
    _result,
    written_out=with_single_bearings,
    named="bearings",
)
