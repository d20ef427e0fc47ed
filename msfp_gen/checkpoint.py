"""Checkpoints: a run on disk between two steps, for the same scene and the same build to go on with.

A file is a magic line, the sha256 of all that follows it, one line of JSON, and the bytes of the run. It replaces its
predecessor in one rename, so that a kill at any moment leaves the old one or the new one.
"""

from __future__ import annotations

import hashlib
import json
import time
import tomllib
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.errors import InputError
from msfp_gen.output import check_folder, clear_leftovers, write_bytes

if TYPE_CHECKING:
    from msfp_gen.model import Model
    from msfp_gen.scene import Scene

MAGIC = b"msfp-gen checkpoint 1\n"
EVERY = 60.0  # seconds between two checkpoints
SHARE = 20  # writing takes at most one part in this many of the time


SEGMENTS = 8  # a run takes in each effect at most once


def segment_file(path: str | Path, index: int) -> Path:
    """Where segment `index` (from 0) of a run is kept: each in its own, so that a resumed run switches where it did."""
    path = Path(path)
    return path.with_name(f"{path.name}.{index + 1}") if index else path


def kept_files(path: str | Path) -> list[Path]:
    """The files of a run that are there."""
    return [file for file in (segment_file(path, index) for index in range(SEGMENTS)) if file.is_file()]


@dataclass(frozen=True)
class Identity:
    """What a checkpoint belongs to: the cache key of the build, the scene in words, and the digest of its numbers."""

    build: str
    scene: str
    digest: str

    @classmethod
    def of(cls, scene: Scene, model: Model) -> Identity:
        """The identity of a run of `scene` with `model`."""
        from msfp_gen.scenefile import scene_text

        return cls(model.info.key, scene_text(scene), fingerprint(scene))


class Checkpoint:
    """The file in which a run is kept while it goes on.

    Parameters
    ----------
    path
        The file; its folder must exist.
    identity
        What the run belongs to.
    every
        Seconds of wall time between two savings; 0: whenever the run lets go.
    resume
        Go on with what the file holds. Without it the file must not exist.

    Raises
    ------
    InputError
        No such file, a damaged one, one of another scene or build; one that would be overwritten.

    """

    def __init__(self, path: str | Path, identity: Identity, every: float = EVERY, resume: bool = False) -> None:
        self.path = Path(path)
        self.wall = 0.0  # seconds that the run took before this process
        self._identity, self._every = identity, every
        self._saved: tuple[bytes, ...] | None = None
        if not every >= 0:
            raise InputError(f"every = {every}: give the seconds between two checkpoints, 0 or more")
        check_folder(self.path.parent, "checkpoint")
        clear_leftovers(self.path, age=0.0)  # one run, one file: what is half written is of a killed one
        if resume:
            self._load()
        elif self.path.exists():
            raise InputError(
                f"checkpoint = {str(self.path)!r}: this file exists; resume it, or remove it to start anew"
            )
        self._begin = time.monotonic()
        self._due = self._begin + every

    def restore(self, run: Any) -> None:
        """Put a run that has just started where the saved one was, if there is one."""
        if self._saved is not None:
            try:
                run.restore(*self._saved)
            except ValueError as error:
                raise self._refused(f"damaged ({error})") from None
            self._saved = None

    def offer(self, run: Any) -> None:
        """Save the run if it is time to."""
        if time.monotonic() >= self._due:
            self.save(run)

    def save(self, run: Any) -> None:
        """Save the run now. A disk that refuses is a warning: the run goes on, and the last checkpoint stands."""
        begin = time.monotonic()
        about = {**vars(self._identity), "time": run.time, "wall": self.wall + begin - self._begin}
        try:
            write(self.path, about, run.save())
        except OSError as error:
            reason = error.strerror or error
            warnings.warn(f"checkpoint {self.path} not written ({reason}); the run goes on", RuntimeWarning, 2)
        now = time.monotonic()
        self._due = now + max(self._every, SHARE * (now - begin))

    def _load(self) -> None:
        try:
            about, parts = read(self.path)
        except OSError as error:
            raise self._refused(f"cannot be read ({error.strerror or error})") from None
        except (ValueError, KeyError, TypeError):
            raise self._refused("damaged, or no checkpoint of msfp-gen") from None
        if about["digest"] != self._identity.digest:
            raise self._refused(f"made for another scene: {_difference(about['scene'], self._identity.scene)}")
        if about["build"] != self._identity.build:
            raise self._refused("made by another build of the model (another msfp-gen, compiler or flags)")
        self.wall, self._saved = float(about["wall"]), tuple(parts)

    def _refused(self, reason: str) -> InputError:
        remedy = "give the checkpoint of this run, or start from the beginning"
        return InputError(f"checkpoint = {str(self.path)!r}: {reason}; {remedy}")


def write(path: Path, about: Mapping[str, Any], parts: Sequence[bytes]) -> None:
    """Write a checkpoint, whole or not at all."""
    header = json.dumps({**about, "sizes": [len(part) for part in parts]}).encode() + b"\n"
    digest = hashlib.sha256()
    for part in (header, *parts):
        digest.update(part)
    write_bytes(path, (MAGIC, digest.hexdigest().encode(), b"\n", header, *parts))


def read(path: Path) -> tuple[dict[str, Any], list[bytes]]:
    """Header and parts of a checkpoint; ValueError where anything of it is missing or altered, OSError."""
    with path.open("rb") as file:
        magic, expected = file.readline(len(MAGIC)), file.readline(65).strip()
        rest = file.read() if magic == MAGIC else b""
    if not rest or hashlib.sha256(rest).hexdigest().encode() != expected:
        raise ValueError("damaged")
    header, _, data = rest.partition(b"\n")
    about = json.loads(header)
    ends = np.cumsum([0, *about["sizes"]])
    return about, [data[first:last] for first, last in pairwise(ends)]


def fingerprint(value: object) -> str:
    """The sha256 of every number and word in a scene; of a motion the numbers themselves, wherever they came from."""
    digest = hashlib.sha256()
    for item in _leaves(value):
        digest.update(b"%d:" % len(item) + item)
    return digest.hexdigest()


def _leaves(value: Any) -> Iterator[bytes]:
    if isinstance(value, np.ndarray):
        yield f"{value.dtype}{value.shape}".encode()
        yield (value + 0 if value.dtype.kind == "f" else value).tobytes()  # -0.0 equals 0.0
    elif is_dataclass(value) and not isinstance(value, type):
        yield type(value).__name__.encode()
        for field in fields(value):
            if field.compare:
                yield field.name.encode()
                yield from _leaves(getattr(value, field.name))
    elif isinstance(value, Mapping):
        yield from _leaves(sorted(value.items()))
    elif isinstance(value, list | tuple):
        yield b"%d" % len(value)
        for item in value:
            yield from _leaves(item)
    else:
        yield repr(value).encode()


def _difference(then: str, now: str) -> str:
    """The first entry in which two scenes differ, in words."""
    before, after = (dict(_entries(tomllib.loads(text))) for text in (then, now))
    for name in [*before, *after]:
        if before.get(name) != after.get(name):
            return f"{name} was {_short(before.get(name))}, now it is {_short(after.get(name))}"
    return "the data of a file that it names were others"


def _entries(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Every value below a table with its path, `bearing.surfaces[2].radius`."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _entries(item, f"{path}.{key}" if path else key)
    elif _is_rows(value):
        for index, item in enumerate(value):
            yield from _entries(item, f"{path}[{index}]")
    else:
        yield path, value


def _is_rows(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(item, dict) for item in value)


def _short(value: Any) -> str:
    text = "not given" if value is None else repr(value)
    return text if len(text) <= 40 else text[:37] + "..."
