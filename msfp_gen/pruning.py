"""What lies in the cache of models, and what of it may go. Nothing that msfp-gen did not put there is touched."""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from msfp_gen.cache import MANIFEST_NAME, Entry, Manifest, cache_root
from msfp_gen.errors import CompileError, InputError
from msfp_gen.layout import Layout, ModelSpec

_NAME = re.compile(r"(msfp_\d+_\d+_\d+-[0-9a-f]{20})(\.part-\d+)?")
DAY = 86400.0


@dataclass(frozen=True)
class Stored:
    """One folder of the cache.

    `state`: "current" (this version finds it), "other version", "damaged or old" (its manifest is not believed), or
    "unfinished" (of a build that runs or was killed). `size` in bytes; `used`: when it was last found or made, in
    seconds since 1970.
    """

    folder: Path
    spec: str
    state: str
    size: int
    used: float

    @property
    def days(self) -> float:
        """Days since it was last used."""
        return max(0.0, time.time() - self.used) / DAY


def stored() -> list[Stored]:
    """Every folder of ours in the cache, the last used first; empty where there is no cache yet."""
    root = cache_root()
    if not root.is_dir():
        return []
    now = _inputs_now()
    found = [_stored(path, now) for path in root.iterdir() if _NAME.fullmatch(path.name) and path.is_dir()]
    return sorted((item for item in found if item is not None), key=lambda item: -item.used)


def prune(days: float) -> tuple[list[Stored], list[Stored]]:
    """Remove what was not used for `days` days; what was removed, and what could not be because it is in use.

    Raises
    ------
    InputError
        If `days` is below 0 or no number.

    """
    if not days >= 0:
        raise InputError(f"days = {days}: give a number of days, 0 or more")
    removed: list[Stored] = []
    held: list[Stored] = []
    for item in stored():
        if item.days >= days:
            (removed if _remove(item.folder) else held).append(item)
    _remove_locks()
    return removed, held


def total(items: Iterable[Stored]) -> int:
    """Their size together [bytes]."""
    return sum(item.size for item in items)


def _inputs_now() -> dict[str, object]:
    """What the key of a model of this version is made of, but for the model itself."""
    try:
        return Entry.of(ModelSpec(Layout.dfp())).inputs
    except CompileError:  # without a compiler nothing in the cache is found
        return {}


def _stored(folder: Path, now: dict[str, object]) -> Stored | None:
    """None if the folder goes while we look at it."""
    try:
        size = sum(path.stat().st_size for path in folder.iterdir())
        marker = folder / MANIFEST_NAME
        used = (marker if marker.is_file() else folder).stat().st_mtime
    except OSError:
        return None
    try:
        manifest = Manifest.read(folder)
    except (OSError, ValueError, TypeError):
        manifest = None
    spec = manifest.spec if manifest else "?"
    if ".part-" in folder.name:
        state = "unfinished"
    elif manifest is None:
        state = "damaged or old"
    else:
        state = "current" if now | {"spec": spec} == manifest.inputs else "other version"
    return Stored(folder, spec, state, size, used)


def _remove(folder: Path) -> bool:
    """Remove a folder, out of sight in one rename; False if a build holds its lock or a process its files."""
    with _lock(folder) as mine:
        if not mine:
            return False
        aside = folder
        if ".part-" not in folder.name:
            aside = folder.with_name(f"{folder.name}.part-{os.getpid()}")
            shutil.rmtree(aside, ignore_errors=True)
            with suppress(OSError):  # refused where a system holds files that are in use
                folder.rename(aside)
        shutil.rmtree(aside, ignore_errors=True)
        return not folder.exists()


def _remove_locks() -> None:
    """Remove the locks, empty files, of models that are gone."""
    root = cache_root()
    for path in root.glob("msfp_*.lock") if root.is_dir() else ():
        name = path.name.removesuffix(".lock")
        if _NAME.fullmatch(name) and not any(root.glob(f"{name}*/")):
            with _lock(root / name) as mine, suppress(OSError):
                if mine:
                    path.unlink()


@contextmanager
def _lock(folder: Path) -> Iterator[bool]:
    """Whether the lock of a model, under which it is built, is ours within the block."""
    from filelock import FileLock, Timeout

    lock = FileLock(folder.with_name(f"{folder.name.partition('.part-')[0]}.lock"))
    try:
        lock.acquire(timeout=0)
    except Timeout:
        yield False
        return
    try:
        yield True
    finally:
        lock.release()
