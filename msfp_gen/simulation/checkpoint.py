"""Checkpoints: one file from which a run of the same scene and the same builds of its models continues.

A file consists of a magic line, the sha256 of everything after it, one line of JSON with the identity of the run, and a
snapshot of each segment, with its rows. A new file replaces the old one by one rename, so that there is a complete file
whenever the process is killed.
"""

from __future__ import annotations

import hashlib
import json
import time
import tomllib
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

from msfp_gen.common.errors import InputError
from msfp_gen.common.identity import fingerprint
from msfp_gen.common.output import check_folder, clear_leftovers, write_bytes
from msfp_gen.scene.system import System

MAGIC = b"msfp-gen checkpoint 3\n"
EVERY = 60.0  # wall time between two checkpoints [s]
WRITE_INTERVAL = 20  # least time between two checkpoints, over the time to write one: limits the cost of writing


class Resumable(Protocol):
    """A run that can be saved and continued."""

    @property
    def time(self) -> float:
        """Time reached [s]."""

    def snapshot(self) -> bytes:
        """State with all rows."""

    def restore(self, snapshot: bytes) -> None:
        """Continue from a snapshot. Raises ValueError."""


@dataclass(frozen=True)
class Identity:
    """The run to which a checkpoint belongs: scene as TOML text, and digest of the scene."""

    scene: str
    digest: str

    @classmethod
    def of(cls, scene: System) -> Identity:
        """The identity of a run of `scene`."""
        from msfp_gen.scene.file.loader import scene_text

        return cls(scene_text(scene), fingerprint(scene))


@dataclass(frozen=True)
class Saved:
    """A segment in a checkpoint. build: key of its model; time: reached [s]; wall: wall time until then [s]."""

    build: str
    time: float
    wall: float
    snapshot: bytes


class Checkpoint:
    """The checkpoint file of a run.

    path: the file; its folder must exist. identity: of the run. every: wall time between two of them [s]; 0: as often
    as possible. resume: continue from the state in the file, which otherwise must not exist. Raises InputError where
    the file does not exist, is damaged, or belongs to another scene; or would be overwritten.
    """

    def __init__(self, path: str | Path, identity: Identity, every: float = EVERY, resume: bool = False) -> None:
        self.path = Path(path)
        self.wall = 0.0  # wall time of the present segment in earlier processes [s]
        self._identity, self._every = identity, every
        self._earlier: list[Saved] = []  # segments before the present one
        self._build = ""
        if not every >= 0:
            raise InputError(f"every = {every}: give the seconds between two checkpoints, 0 or more")
        check_folder(self.path.parent, "checkpoint")
        clear_leftovers(self.path, age=0.0)  # incomplete files of a killed process
        if not resume and self.path.exists():
            raise InputError(
                f"checkpoint = {str(self.path)!r}: this file exists; resume it, or remove it to start anew"
            )
        self._loaded = self._load() if resume else []  # segments that are still to be restored
        self._start = time.monotonic()
        self._due = self._start + every

    def begin(self, run: Resumable, build: str) -> None:
        """Begin the next segment: set its new run to the saved state, if there is one. Raises InputError.

        build: key of its model.
        """
        self._build, self.wall, self._start = build, 0.0, time.monotonic()
        if not self._loaded:
            return
        saved = self._loaded.pop(0)
        if saved.build != build:
            raise self._refused("made by another build of the model (another msfp-gen, compiler or flags)")
        try:
            run.restore(saved.snapshot)
        except ValueError as error:
            raise self._refused(f"damaged ({error})") from None
        self.wall = saved.wall

    def end(self, run: Resumable) -> None:
        """Keep the present segment, which has ended and is followed by another one."""
        self._earlier.append(self._saved(run))

    def save_if_due(self, run: Resumable) -> None:
        """Save the run if enough time has passed since the last checkpoint."""
        if time.monotonic() >= self._due:
            self.save(run)

    def save(self, run: Resumable) -> None:
        """Save the run now. If writing fails, a warning is given and the last checkpoint remains."""
        if self._loaded:  # a segment that had ended: the file has it, and those after it
            return
        start = time.monotonic()
        try:
            write_checkpoint(self.path, self._identity, [*self._earlier, self._saved(run)])
        except (OSError, MemoryError) as error:
            reason = (error.strerror if isinstance(error, OSError) else "") or str(error) or "no memory"
            warnings.warn(f"checkpoint {self.path} not written ({reason}); the run continues", RuntimeWarning, 2)
        now = time.monotonic()
        self._due = now + max(self._every, WRITE_INTERVAL * (now - start))

    def _saved(self, run: Resumable) -> Saved:
        return Saved(self._build, run.time, self.wall + time.monotonic() - self._start, run.snapshot())

    def _load(self) -> list[Saved]:
        try:
            identity, segments = read_checkpoint(self.path)
        except OSError as error:
            raise self._refused(f"cannot be read ({error.strerror or error})") from None
        except ValueError:
            raise self._refused("damaged, or no checkpoint of msfp-gen") from None
        if identity.digest != self._identity.digest:
            raise self._refused(f"made for another scene: {_difference(identity.scene, self._identity.scene)}")
        return segments

    def _refused(self, reason: str) -> InputError:
        remedy = "give the checkpoint of this run, or start from the beginning"
        return InputError(f"checkpoint = {str(self.path)!r}: {reason}; {remedy}")


def write_checkpoint(path: Path, identity: Identity, segments: list[Saved]) -> None:
    """Write a checkpoint file, completely or not at all."""
    about = [[each.build, each.time, each.wall, len(each.snapshot)] for each in segments]
    header = json.dumps(asdict(identity) | {"segments": about}).encode() + b"\n"
    parts = [header, *(each.snapshot for each in segments)]
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    write_bytes(path, (MAGIC, digest.hexdigest().encode(), b"\n", *parts))


def read_checkpoint(path: Path) -> tuple[Identity, list[Saved]]:
    """Identity and segments in a checkpoint file. Raises ValueError where it is incomplete or altered, and OSError."""
    from msfp_gen.scene.file.loader import toml_table

    with path.open("rb") as file:
        magic, expected = file.readline(len(MAGIC)), file.readline(65).strip()
        rest = file.read() if magic == MAGIC else b""
    if not rest or hashlib.sha256(rest).hexdigest().encode() != expected:
        raise ValueError("damaged")
    header, _, content = rest.partition(b"\n")
    try:
        about = json.loads(header)
        identity = Identity(about["scene"], about["digest"])
        toml_table(identity.scene)
        segments, start = [], 0
        for build, reached, wall, size in about["segments"]:
            segments.append(Saved(str(build), float(reached), float(wall), content[start : start + int(size)]))
            start += int(size)
    except (ArithmeticError, AttributeError, KeyError, TypeError, RecursionError) as error:
        raise ValueError(f"no header of a checkpoint ({error})") from None
    if not segments or start != len(content) or not all(0 <= each.wall < float("inf") for each in segments):
        raise ValueError("no segments of a checkpoint")
    return identity, segments


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
