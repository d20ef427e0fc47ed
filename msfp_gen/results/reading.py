"""What a netCDF-4 file of `Result.to_netcdf` has of a run of one bearing; see `results/files.py`."""

from __future__ import annotations

import json
from dataclasses import MISSING, fields
from hashlib import sha256
from typing import Any

import numpy as np

from msfp_gen.errors import InputError
from msfp_gen.results import stored_gradient
from msfp_gen.results.extremes import Extremes
from msfp_gen.results.files import COUNTER, REMEDY, WORDS, Arrays, motion_in, notes_in, without
from msfp_gen.results.gradient import SERIES, Gradients
from msfp_gen.results.history import ENERGY, LABELS, STACK, Counters, Event, History, quantities
from msfp_gen.results.stored_group import Attribute, StoredGroup
from msfp_gen.scene.scene import Scene
from msfp_gen.specification.contract import EVENT_KINDS, names


def edition() -> str:
    """A digest of the names that a file of this version has: of rows, energies, counters and labels."""
    rows = [rows.names or (field,) for field, rows in quantities().items()]
    table = [*rows, ENERGY, *LABELS.items(), [field.name for field in fields(Counters)], WORDS]
    return sha256(json.dumps([list(each) for each in table]).encode()).hexdigest()[:12]


def fields_in(root: StoredGroup, about: dict[str, Attribute], arrays: Arrays) -> dict[str, Any]:
    """Scene, rows, events, counters, notes, extremes and derivatives, as `ResultFiles.fields_in`."""
    scene = _scene(root, about, arrays)
    surfaces = scene.bearing.layout.surfaces
    history = _history(root, surfaces, arrays)
    events = _events(root, surfaces, arrays)
    return {
        "scene": scene,
        "history": history,
        "events": events,
        "gradients": _gradients(root, history, len(events), about, arrays),
        "counters": Counters(**without(COUNTER, about)),  # type: ignore[arg-type]
        "notes": notes_in(about),
        "recorded_extremes": _extremes(json.loads(str(about["extremes"])), surfaces) if "extremes" in about else None,
    }


def _gradients(
    root: StoredGroup, history: History, events: int, about: dict[str, Attribute], arrays: Arrays
) -> Gradients | None:
    """The derivatives with respect to parameters, where the file has some."""
    if stored_gradient.GROUP not in root:
        return None
    found, read = stored_gradient.from_group(root, len(history.time), history.surfaces, events)
    needed = {field for field, _ in SERIES.values() if getattr(history, field) is not None}
    if missing := sorted(needed - found.rows.keys()):
        raise ValueError(f"the gradient has no {missing[0]}")
    for name, value in read.items():
        place: dict[str, Any] = arrays if isinstance(value, np.ndarray) else about
        place[f"{stored_gradient.GROUP}/{name}"] = value
    return found


def _scene(root: StoredGroup, about: dict[str, Attribute], arrays: Arrays) -> Scene:
    """The scene of the file; its motion is in the scene, or as polynomials in a group of the file."""
    from msfp_gen.scene.file.loader import scene_from_table, toml_table
    from msfp_gen.scene.file.stored_motion import PIECES, RECIPE

    table, motion = toml_table(str(about["scene"])), None
    if about["motion"] == PIECES:
        motion, pieces, motion_about = motion_in(root)
        arrays |= pieces
        about |= motion_about
    elif about["motion"] != RECIPE:
        raise ValueError(f"motion = {about['motion']!r} is unknown")
    elif isinstance(table.get("motion"), dict) and table["motion"].get("file") is not None:
        raise InputError(f"motion.file = {table['motion']['file']!r}: a result opens no other file; {REMEDY}")
    return scene_from_table(table, motion=motion)


def _history(root: StoredGroup, surfaces: int, arrays: Arrays) -> History:
    """The rows; the time, which is stored as it is, gives their number."""
    count = root.length("time")
    sizes = dict.fromkeys(STACK, surfaces) | {name: len(labels) for name, labels in LABELS.items()}
    optional = {field.name for field in fields(History) if field.default is not MISSING}
    found: Arrays = {}
    for field, rows in quantities().items():
        parts = rows.names or (field,)
        if field in optional and not any(name in root for name in parts):
            continue  # a quantity of an effect that the run did not model
        dims = rows.dims[:-1] if len(parts) > 1 else rows.dims
        shape = (count, *(sizes[dim] for dim in dims))
        columns = [root.array(name, shape, compressed=name != "time") for name in parts]
        arrays |= dict(zip(parts, columns, strict=True))
        found[field] = columns[0] if len(columns) == 1 else np.stack(columns, axis=-1)
    energy = {name: root.array(f"energy_{name}", (count,)) for name in ENERGY}
    arrays |= {f"energy_{name}": values for name, values in energy.items()}
    return History(**found, energy=energy)


def _events(root: StoredGroup, surfaces: int, arrays: Arrays) -> tuple[Event, ...]:
    count = root.length("event_time")
    columns = {
        "time": root.array("event_time", (count,)),
        "surface": root.array("event_surface", (count,), np.int64),
        "kind": np.array(root.texts("event_kind", count, names(EVENT_KINDS)), dtype=object),
        "displacement": root.array("event_displacement", (count, 3)),
        "top_force": root.array("event_top_force", (count, 3)),
    }
    arrays |= {f"event_{name}": values for name, values in columns.items()}
    numbers = [columns[name] for name in ("time", "displacement", "top_force")]
    surface = columns["surface"]
    if not all(np.isfinite(values).all() for values in numbers) or np.any((surface < 0) | (surface > surfaces)):
        raise ValueError("an event is not finite, or of no surface")
    rows = zip(*columns.values(), strict=True)
    return tuple(Event(float(t), int(s), kind, u, force) for t, s, kind, u, force in rows)


def _extremes(given: dict[str, list[float]], surfaces: int) -> Extremes:
    """Extremes of all steps; the numbers are finite."""
    found = Extremes.of_table(given)
    for name, values in found.table.items():
        shape = np.shape(values)
        if shape != ((4,) if name in ("displacement", "top_force") else (surfaces,)) or not np.isfinite(values).all():
            raise ValueError(f"extremes: {name} is no list of finite numbers of the right length")
    return found
