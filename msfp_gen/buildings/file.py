"""Buildings in TOML files: `load_building`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from msfp_gen.buildings.building import Building
from msfp_gen.buildings.scene import BuildingBearing, BuildingScene
from msfp_gen.buildings.storey import BaseSlab, Storey
from msfp_gen.common.fields import Quantity, errors_at
from msfp_gen.errors import InputError
from msfp_gen.motions.motion import Motion
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.file.loader import bearing_from_table, toml_file
from msfp_gen.scene.file.motion_tables import KINDS, is_file, resolved
from msfp_gen.scene.file.schema import MOTION, PARTS, model_of, rows_of, validate
from msfp_gen.scene.friction_selection import select_friction
from msfp_gen.scene.solver import Solver
from msfp_gen.scene.top import NodeTop
from msfp_gen.specification.layout import Effects

Table = dict[str, Any]
_FREQUENCY = Quantity("Hz", above=0.0)


@dataclass(frozen=True)
class FrameTable:
    """The numbers of `[building]`: damping as in `Building.shear`, and the frequency of `Building.reduced` [Hz]."""

    damping_ratio: Annotated[float, Quantity("", least=0.0)] = 0.02
    rayleigh_frequencies: Annotated[tuple[float, float] | None, Quantity("Hz", above=0.0, shape=(2,))] = None
    highest_frequency: Annotated[float | None, _FREQUENCY] = None


_INTERFACE, _BASE, _STOREY, _EFFECTS = (model_of(kind) for kind in (NodeTop, BaseSlab, Storey, Effects))
_BEARING = model_of(BuildingBearing, bearing=(Any, ...), interface=(_INTERFACE, None), effects=(_EFFECTS, None))
_BUILDING = model_of(
    FrameTable,
    base=(_BASE, ...),
    storey=(rows_of(_STOREY), []),
    bearing=(rows_of(_BEARING), ...),
    interface=(_INTERFACE, None),
)
_SCENE = model_of(
    BuildingScene,
    building=(_BUILDING, ...),
    bearings=(dict[str, Any], {}),
    motion=(MOTION, ...),
    solver=(PARTS["solver"], None),
)
_TABLES = {
    "": _SCENE,
    "building": _BUILDING,
    "building.base": _BASE,
    "building.storey": _STOREY,
    "building.bearing": _BEARING,
    "building.interface": _INTERFACE,
    "building.bearing.interface": _INTERFACE,
    "building.bearing.effects": _EFFECTS,
    "solver": PARTS["solver"],
}


def load_building(path: str | Path) -> BuildingScene:
    """The building in a TOML file. Paths inside it are relative to it.

    Raises InputError of one line that names the file, the path of the field, the value and the remedy.
    """
    file = Path(path)
    if not is_file(file):
        raise InputError(f"building = {str(path)!r}: no such file; give the path of a TOML file")
    try:
        return building_from_table(toml_file(file), file.parent)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def building_from_table(table: Mapping[str, Any], folder: Path | None = None) -> BuildingScene:
    """The building of a plain table, as in a file; `folder`: as in `scene_from_table`. Raises InputError."""
    given = validate(_SCENE, table, _TABLES)
    frame, named = given.pop("building"), given.pop("bearings", {})
    parts: Table = {"building": _building(frame), "motion": _motion(given.pop("motion"), folder)}
    if "solver" in given:
        parts["solver"] = Solver(**given.pop("solver"))
    common = frame.get("interface")
    rows = enumerate(frame["bearing"])
    parts["bearings"] = [_bearing(row, f"building.bearing[{index}]", common, named) for index, row in rows]
    return BuildingScene(**given, **parts)


def _building(given: Table) -> Building:
    with errors_at("base", "building.base"):
        base = BaseSlab(**given["base"])
    storeys = []
    for index, row in enumerate(given.get("storey", [])):
        with errors_at("storey", f"building.storey[{index}]"):
            storeys.append(Storey(**row))
    options = {name: given[name] for name in ("damping_ratio", "rayleigh_frequencies") if name in given}
    building = Building.shear(base, storeys, **options)
    return building.reduced(given["highest_frequency"]) if "highest_frequency" in given else building


def _bearing(given: Table, path: str, common: Table | None, named: Table) -> BuildingBearing:
    values = dict(given)
    interface = values.pop("interface", common)
    if interface is None:
        raise InputError(f"{path}.interface is missing: give this table, or [building.interface] for all bearings")
    values["bearing"] = bearing = _values(values["bearing"], path, named)
    if "effects" in values:
        chosen = values["effects"]
        word = select_friction(bearing, chosen.get("friction_law"))
        values["effects"] = Effects(**{"friction": word, **chosen})
    with errors_at("top", f"{path}.interface"), errors_at("building_bearing", path):
        return BuildingBearing(interface=NodeTop(**interface), **values)


def _values(given: Any, path: str, named: Table) -> Bearing:
    """A bearing by its name in `[bearings]`, by that of a preset, or as a table."""
    own = isinstance(given, str) and given in named
    place = f"bearings.{given}" if own else f"{path}.bearing"
    try:
        return bearing_from_table(named[given] if own else given)
    except InputError as error:
        names = f"; those of [bearings] are {', '.join(named)}" if isinstance(given, str) and not own and named else ""
        raise InputError(place + str(error).removeprefix("bearing") + names) from None


def _motion(given: Table, folder: Path | None) -> Motion:
    values = dict(given)
    if "file" in values:
        values["file"] = resolved(values["file"], folder)
    return KINDS[values.pop("kind")](**values).build()
