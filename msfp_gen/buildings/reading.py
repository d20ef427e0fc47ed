"""Reading of the netCDF-4 files of `BuildingResult.to_netcdf`: every other file is refused with one InputError."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from msfp_gen.buildings.data import BuildingData
from msfp_gen.buildings.dataset import ENERGY, GROUND, SOURCE
from msfp_gen.buildings.files import DIGESTED, PEAKS
from msfp_gen.buildings.peaks import Peaks
from msfp_gen.buildings.peaks import shapes as shapes_of_peaks
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.buildings.text import GROUP, ground_name, scene_from, shapes
from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.results.note import Note
from msfp_gen.results.reading import DIGEST, REMEDY, R, motion_in, result_file, result_in
from msfp_gen.results.stored_group import ArrayDigest, StoredGroup, digest
from msfp_gen.scene.file.loader import toml_table

Arrays = dict[str, Any]
B = TypeVar("B", bound=BuildingData)


def read_building(path: str | Path, kind: type[B]) -> B:
    """The result in a file of `BuildingResult.to_netcdf`, as `kind`. Raises InputError for any other file."""
    with result_file(path) as root:
        return _read(root, kind)


def read_any(path: str | Path, bearing: type[R], building: type[B]) -> R | B:
    """The result in a file, as one of a bearing or of a building. Raises InputError for any other file."""
    with result_file(path) as root:
        source = root.attributes(lambda name: name == "source").get("source")
        return _read(root, building) if source == SOURCE else result_in(root, bearing)


def _read(root: StoredGroup, kind: type[B]) -> B:
    about = root.attributes(lambda name: name in (*DIGESTED, "source", DIGEST, "wall_time"))
    if about.pop("source", None) != SOURCE:
        raise InputError(f"no result of a building; {REMEDY}")
    written, wall_time = about.pop(DIGEST), float(about.pop("wall_time"))
    arrays: Arrays = {}
    scene = _scene(root, about, arrays)
    rows = _rows(root, scene, arrays)
    peaks = _peaks(root.group(PEAKS), scene, arrays) if PEAKS in root else None
    monitored = tuple((int(index), Note(**note)) for index, note in json.loads(str(about.get("monitored", "[]"))))
    if written != digest(about, {name: ArrayDigest.of(values) for name, values in arrays.items()}):
        raise InputError("a value was changed after this file was written; run the scene again")
    counts = {str(name): int(count) for name, count in json.loads(str(about["counts"])).items()}
    provenance = {str(name): str(value) for name, value in json.loads(str(about["provenance"])).items()}
    status, message = str(about["status"]), str(about["message"])
    return kind(
        scene,
        **rows,
        counts=counts,
        monitored=monitored,
        recorded_peaks=peaks,
        status=status,
        message=message,
        provenance=provenance,
        wall_time=wall_time,
    )


def _scene(root: StoredGroup, about: dict[str, Any], arrays: Arrays) -> BuildingScene:
    text, group = str(about["scene"]), root.group(GROUP)
    table = toml_table(text)
    size = group.rows("mass")
    found = {
        name: group.array(name, shape)
        for name, shape in shapes(size, len(table.get("node", [])), len(table.get("column", []))).items()
    }
    arrays |= {f"{GROUP}/{name}": values for name, values in found.items()}
    motions = []
    for index in range(int(table.get("grounds", 1))):
        motion, pieces, _ = motion_in(root, ground_name(index))
        arrays |= pieces
        motions.append(motion)
    return scene_from(text, found, motions)


def _peaks(group: StoredGroup, scene: BuildingScene, arrays: Arrays) -> Peaks:
    found = {name: group.array(name, shape) for name, shape in shapes_of_peaks(scene).items()}
    arrays |= {f"{PEAKS}/{name}": values for name, values in found.items()}
    return Peaks(**found)


def _rows(root: StoredGroup, scene: BuildingScene, arrays: Arrays) -> dict[str, Any]:
    """The rows by the names that `BuildingData` has for them."""
    count, size, bearings = root.length("time"), len(scene.building.mass), len(scene.bearings)
    surfaces = [each.bearing.layout.surfaces for each in scene.bearings]

    def read(name: str, *shape: int) -> Array:
        values: Array = root.array(name, (count, *shape), compressed=name != "time")
        arrays[name] = values
        return values

    found: dict[str, Any] = {"time": read("time")}
    found |= {name: read(f"coordinate_{name}", size) for name in GROUND}
    found["ground"] = np.stack([read(f"ground_{name}", 3) for name in GROUND], axis=1)
    ends = [
        np.concatenate([read(f"{end}_{what}", bearings, 3) for what in ("force", "moment")], axis=-1)
        for end in ("lower", "upper")
    ]
    most = max(surfaces)
    each = [
        [values[:, index, :own] for index, own in enumerate(surfaces)]
        for values in (read("normal_force", bearings, most), read("sliding", bearings, most))
    ]
    found |= {name: read(name, bearings) for name in ("dissipated", "stored")}
    found |= {name: read(f"energy_{name}") for name in ENERGY}
    found["support"] = np.stack([read(f"support_{name}", bearings, 3) for name in GROUND], axis=2)
    found["wrench"] = np.stack(ends, axis=2)
    found["normal_force"], found["sliding"] = each
    _check_finite(arrays, each)
    return found


def _check_finite(arrays: Arrays, surfaces: list[list[Array]]) -> None:
    for name, values in arrays.items():
        if name not in ("normal_force", "sliding") and not np.isfinite(values).all():
            raise ValueError(f"{name} is not finite")
    if not all(np.isfinite(values).all() for columns in surfaces for values in columns):
        raise ValueError("a surface is not finite")
