"""Reading of the netCDF-4 files of `Result.to_netcdf`: every other file is refused with one InputError.

A file may be damaged, or made by another person. It is data: its scene names no file, its motion lies in it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import MISSING, fields
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from msfp_gen.errors import InputError
from msfp_gen.motions.motion import Motion
from msfp_gen.results import stored_gradient
from msfp_gen.results.extremes import Extremes
from msfp_gen.results.gradient import SERIES, Gradients
from msfp_gen.results.history import ENERGY, LABELS, STACK, Counters, Event, History, quantities
from msfp_gen.results.note import Note
from msfp_gen.results.run_data import RunData
from msfp_gen.results.stored_group import ArrayDigest, Attribute, StoredGroup, digest, stored_groups
from msfp_gen.scene.scene import Scene
from msfp_gen.specification.contract import EVENT_KINDS, names

COUNTER, PROVENANCE = "counter_", "provenance_"  # prefixes of the attributes with counters and provenance
DIGEST = "digest"  # attribute: of all values that are read
EDITION = "edition"  # attribute: of the names in a file; that of another version of msfp-gen differs if these do
WORDS = ("scene", "motion", "status", "message", "notes")  # attributes that are texts
# What h5py, json, tomllib and NumPy raise for content that they cannot read.
DAMAGE = (ArithmeticError, AttributeError, LookupError, OSError, RuntimeError, TypeError, ValueError)
REMEDY = "give a file that `run -o` wrote"
R = TypeVar("R", bound=RunData)
Arrays = dict[str, Any]


def read_result(path: str | Path, kind: type[R]) -> R:
    """The result in a file of `Result.to_netcdf`, as an instance of `kind`. Raises InputError for any other file."""
    with result_file(path) as root:
        return result_in(root, kind)


@contextmanager
def result_file(path: str | Path) -> Iterator[StoredGroup]:
    """The root of the file of a result. Whatever is wrong with the file raises InputError with its path."""
    path = Path(path)
    try:
        if not path.is_file():
            raise InputError("no such file; give the name of a result")
        with stored_groups(path) as root:
            yield root
    except InputError as error:
        raise InputError(f"path = {str(path)!r}: {error}") from None
    except DAMAGE as error:
        raise InputError(f"path = {str(path)!r}: no netCDF-4 file that can be read ({error}); {REMEDY}") from error
    except MemoryError:
        raise InputError(f"path = {str(path)!r}: this result does not fit into memory; free some") from None


def result_in(root: StoredGroup, kind: type[R]) -> R:
    """The result of one bearing in a file. Raises InputError, or what `DAMAGE` lists, for any other content."""
    about = root.attributes(lambda name: name in ("source", DIGEST, EDITION) or _is_read(name))
    try:
        return _read(root, dict(about), kind)
    except (InputError, *DAMAGE) as error:
        if about.get("source") == "msfp-gen" and about.get(EDITION) != edition():
            raise InputError(
                "another version of msfp-gen wrote this result, which this one cannot read; run its scene again "
                "(attribute scene)"
            ) from error
        raise


def edition() -> str:
    """A digest of the names that a file of this version has: of rows, energies, counters and labels."""
    rows = [rows.names or (field,) for field, rows in quantities().items()]
    table = [*rows, ENERGY, *LABELS.items(), [field.name for field in fields(Counters)], WORDS]
    return sha256(json.dumps([list(each) for each in table]).encode()).hexdigest()[:12]


def digest_of(attributes: dict[str, Attribute], arrays: Arrays) -> str:
    """The digest of a file with these attributes and arrays; those that are not read do not matter.

    arrays: ndarrays, or the `ArrayDigest` of those that came in blocks.
    """
    read = {name: value for name, value in attributes.items() if _is_read(name)}
    known = {name: v if isinstance(v, ArrayDigest) else ArrayDigest.of(v) for name, v in arrays.items()}
    return digest(read, known)


def _read(root: StoredGroup, about: dict[str, Attribute], kind: type[R]) -> R:
    about.pop(EDITION, None)
    if about.pop("source", None) != "msfp-gen":
        raise InputError(f"no result of msfp-gen; {REMEDY}")
    if not all(isinstance(about.get(name), str) for name in WORDS):
        raise ValueError(f"an attribute of {', '.join(WORDS)} is no text")
    written, arrays = about.pop(DIGEST, None), dict[str, Any]()
    scene = _scene(root, about, arrays)
    history = _history(root, scene.bearing.layout.surfaces, arrays)
    events = _events(root, scene.bearing.layout.surfaces, arrays)
    gradients = _gradients(root, history, len(events), about, arrays)
    if not str(about["status"]).isidentifier():
        raise ValueError(f"status = {about['status']!r} is no word")
    if written is not None and written != digest_of(about, arrays):  # files of earlier versions have none
        raise InputError("a value was changed after this file was written; run the scene again")
    return kind(
        scene,
        history,
        events,
        _counters(_without(COUNTER, about)),
        str(about["status"]),
        str(about["message"]),
        {name: str(value) for name, value in _without(PROVENANCE, about).items()},
        tuple(map(_note, json.loads(str(about["notes"])))),
        _extremes(json.loads(str(about["extremes"])), scene.bearing.layout.surfaces) if "extremes" in about else None,
        gradients,
    )


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


def _is_read(name: str) -> bool:
    return name in (*WORDS, "extremes") or name.startswith((COUNTER, PROVENANCE, "motion/", "gradient/"))


def _without(prefix: str, attributes: dict[str, Attribute]) -> dict[str, Attribute]:
    """The attributes with a prefix, by their names without it."""
    return {name.removeprefix(prefix): value for name, value in attributes.items() if name.startswith(prefix)}


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


def motion_in(root: StoredGroup, name: str = "motion") -> tuple[Motion, Arrays, dict[str, Attribute]]:
    """The motion that a group of a file has as polynomials, its arrays and attributes by their paths in the file."""
    from msfp_gen.scene.file.stored_motion import from_pieces

    group = root.group(name)
    count = group.length("knots")
    shapes = {"knots": (count,), "coefficients": (max(0, count - 1), 6, 6), "jumps": (group.length("jumps"),)}
    pieces = {key: group.array(key, shape, compressed=key != "knots") for key, shape in shapes.items()}
    about = group.attributes(lambda each: each in ("name", "metadata", "max_step"))
    motion = from_pieces(pieces, about)
    arrays, named = ({f"{name}/{key}": value for key, value in each.items()} for each in (pieces, about))
    return motion, arrays, named


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


def _counters(given: dict[str, Attribute]) -> Counters:
    for name, value in given.items():
        if not isinstance(value, float if name == "wall_time" else int) or not 0 <= value < math.inf:
            raise ValueError(f"attribute {COUNTER}{name} is no count")
    return Counters(**given)  # type: ignore[arg-type]


def _extremes(given: dict[str, list[float]], surfaces: int) -> Extremes:
    """Extremes of all steps; the numbers are finite."""
    found = Extremes.of_table(given)
    for name, values in found.table.items():
        shape = np.shape(values)
        if shape != ((4,) if name in ("displacement", "top_force") else (surfaces,)) or not np.isfinite(values).all():
            raise ValueError(f"extremes: {name} is no list of finite numbers of the right length")
    return found


def _note(given: dict[str, Any]) -> Note:
    """A note; the numbers in it are finite."""
    note = Note(**given)
    texts, numbers = (note.kind, note.text, note.action), (note.time, note.value)
    valid = all(isinstance(text, str) for text in texts) and type(note.surface) is int
    if not valid or not all(type(x) in (int, float) and math.isfinite(x) for x in numbers):
        raise ValueError("a note is damaged")
    return note
