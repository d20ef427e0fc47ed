"""Checkpoints: files from which a run of the same scene and the same build of the model continues.

A file consists of a magic line, the sha256 of everything after it, one line of JSON, and a snapshot of the run. A new
file replaces the old one by one rename, so that there is a complete file whenever the process is killed.
"""

from __future__ import annotations

import hashlib
import json
import time
import tomllib
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from msfp_gen.common.errors import InputError
from msfp_gen.common.identity import fingerprint
from msfp_gen.common.output import check_folder, clear_leftovers, write_bytes
from msfp_gen.model.compiled import Run
from msfp_gen.model.model import Model
from msfp_gen.scene.scene import Scene
from msfp_gen.simulation.building_run import BuildingRun
from msfp_gen.simulation.rows import RowFile, rows_beside

MAGIC = b"msfp-gen checkpoint 2\n"
EVERY = 60.0  # wall time between two checkpoints [s]
WRITE_INTERVAL = 20  # least time between two checkpoints, over the time to write one: limits the cost of writing
_HEADER = {"build": str, "scene": str, "digest": str, "time": float, "wall": float}
MAX_SEGMENTS = 8  # of a run: each switch adds an effect


def segment_file(path: str | Path, index: int) -> Path:
    """The checkpoint file of segment `index` (from 0). Separate files let a resumed run switch alike."""
    path = Path(path)
    return path.with_name(f"{path.name}.{index + 1}") if index else path


def checkpoint_files(path: str | Path) -> list[Path]:
    """The existing checkpoint files of a run."""
    return [file for file in (segment_file(path, index) for index in range(MAX_SEGMENTS)) if file.is_file()]


def kept_rows(path: str | Path) -> list[Path]:
    """The existing files with the rows of a run that streams them."""
    return [file for index in range(MAX_SEGMENTS) if (file := rows_beside(segment_file(path, index))).is_file()]


def require_no_checkpoint(checkpoint: str | Path) -> None:
    """Raise InputError where a later segment has a checkpoint file: it would conflict in the middle of the run."""
    if existing := [file for file in checkpoint_files(checkpoint) if file != Path(checkpoint)] + kept_rows(checkpoint):
        raise InputError(
            f"checkpoint = {str(checkpoint)!r}: {str(existing[0])!r} exists; resume it, or remove it to start anew"
        )


Resumable = Run | BuildingRun  # of a bearing or of a building: it can be saved and continued


@dataclass(frozen=True)
class Identity:
    """The run to which a checkpoint belongs: cache key of the build, scene as TOML text, and digest of the scene."""

    build: str
    scene: str
    digest: str

    @classmethod
    def of(cls, scene: Scene, model: Model) -> Identity:
        """The identity of a run of `scene` with `model`."""
        from msfp_gen.scene.file.loader import scene_text

        return cls(model.info.key, scene_text(scene), fingerprint(scene))


class Checkpoint:
    """The checkpoint file of one segment of a run.

    path: the file; its folder must exist. identity: scene and build of the run. every: wall time between two of them
    [s]; 0: as often as possible. resume: continue from the state in the file, which otherwise must not exist. Raises
    InputError where the file does not exist, is damaged, or belongs to another scene or build; or would be overwritten.
    """

    def __init__(self, path: str | Path, identity: Identity, every: float = EVERY, resume: bool = False) -> None:
        self.path = Path(path)
        self.wall = 0.0  # wall time of the run in earlier processes [s]
        self._identity, self._every = identity, every
        self._snapshot: bytes | None = None
        self._checksum: object = 0  # of the rows that are streamed
        if not every >= 0:
            raise InputError(f"every = {every}: give the seconds between two checkpoints, 0 or more")
        check_folder(self.path.parent, "checkpoint")
        clear_leftovers(self.path, age=0.0)  # incomplete files of a killed process
        if resume:
            self._load()
        elif self.path.exists():
            raise InputError(
                f"checkpoint = {str(self.path)!r}: this file exists; resume it, or remove it to start anew"
            )
        self._start = time.monotonic()
        self._due = self._start + every

    def restore(self, run: Resumable, rows: RowFile | None = None) -> None:
        """Set a new run, and its rows on disk, to the saved state, if there is one. Raises InputError if damaged."""
        if self._snapshot is not None:
            try:
                run.restore(self._snapshot)
                if rows is not None:
                    rows.restore(run.dropped_rows, self._checksum)
            except ValueError as error:
                raise self._refused(f"damaged ({error})") from None
            if rows is None and run.dropped_rows:
                raise self._refused("made by a run that streams its rows")
            self._snapshot = None

    def save_if_due(self, run: Resumable, rows: RowFile | None = None) -> None:
        """Save the run if enough time has passed since the last checkpoint."""
        if time.monotonic() >= self._due:
            self.save(run, rows)

    def save(self, run: Resumable, rows: RowFile | None = None) -> None:
        """Save the run now. If writing fails, a warning is given and the last checkpoint remains.

        rows: those on disk of a run that streams them.
        """
        start = time.monotonic()
        about = {**vars(self._identity), "time": run.time, "wall": self.wall + start - self._start}
        try:
            if rows is not None:
                rows.sync()
                about["checksum"] = rows.checksum
            write(self.path, about, run.snapshot())
        except (OSError, MemoryError) as error:
            reason = getattr(error, "strerror", None) or error or "no memory"
            warnings.warn(f"checkpoint {self.path} not written ({reason}); the run continues", RuntimeWarning, 2)
        now = time.monotonic()
        self._due = now + max(self._every, WRITE_INTERVAL * (now - start))

    def _load(self) -> None:
        try:
            about, snapshot = read(self.path)
        except OSError as error:
            raise self._refused(f"cannot be read ({error.strerror or error})") from None
        except ValueError:
            raise self._refused("damaged, or no checkpoint of msfp-gen") from None
        if about["digest"] != self._identity.digest:
            raise self._refused(f"made for another scene: {_difference(about['scene'], self._identity.scene)}")
        if about["build"] != self._identity.build:
            raise self._refused("made by another build of the model (another msfp-gen, compiler or flags)")
        self.wall, self._snapshot, self._checksum = about["wall"], snapshot, about.get("checksum", 0)

    def _refused(self, reason: str) -> InputError:
        remedy = "give the checkpoint of this run, or start from the beginning"
        return InputError(f"checkpoint = {str(self.path)!r}: {reason}; {remedy}")


def write(path: Path, about: Mapping[str, Any], snapshot: bytes) -> None:
    """Write a checkpoint file, completely or not at all. about: the header."""
    header = json.dumps(about).encode() + b"\n"
    digest = hashlib.sha256(header)
    digest.update(snapshot)
    write_bytes(path, (MAGIC, digest.hexdigest().encode(), b"\n", header, snapshot))


def read(path: Path) -> tuple[dict[str, Any], bytes]:
    """Header and snapshot of a checkpoint file. Raises ValueError where it is incomplete or altered, and OSError."""
    from msfp_gen.scene.file.loader import toml_table

    with path.open("rb") as file:
        magic, expected = file.readline(len(MAGIC)), file.readline(65).strip()
        rest = file.read() if magic == MAGIC else b""
    if not rest or hashlib.sha256(rest).hexdigest().encode() != expected:
        raise ValueError("damaged")
    header, _, snapshot = rest.partition(b"\n")
    try:
        about = json.loads(header)
    except RecursionError:
        raise ValueError("nested too deeply") from None
    if not isinstance(about, dict) or any(type(about.get(name)) is not kind for name, kind in _HEADER.items()):
        raise ValueError("no header of a checkpoint")
    toml_table(about["scene"])
    if not 0 <= about["wall"] < float("inf"):
        raise ValueError("no wall time")
    return about, snapshot


def _difference(then: str, now: str) -> str:
    """Description of the first entry in which two scenes, given as TOML texts, differ."""
    before, after = (dict(_entries(tomllib.loads(text))) for text in (then, now))
    for name in [*before, *after]:
        if before.get(name) != after.get(name):
            return f"{name} was {_short(before.get(name))}, now it is {_short(after.get(name))}"
    return "the content of a file that it names has changed"


def _entries(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Every value in a nested table with its path, such as `bearing.surfaces[2].radius`."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _entries(item, f"{path}.{key}" if path else key)
    elif isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
        for index, item in enumerate(value):
            yield from _entries(item, f"{path}[{index}]")
    else:
        yield path, value


def _short(value: Any) -> str:
    text = "not given" if value is None else repr(value)
    return text if len(text) <= 40 else text[:37] + "..."
