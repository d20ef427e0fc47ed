"""Listing and pruning of the cache of compiled models. Files that msfp-gen did not create are never changed."""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from msfp_gen.errors import CompileError, InputError
from msfp_gen.jit.cache import MANIFEST_NAME, Entry, Manifest, cache_root
from msfp_gen.specification.layout import Layout, ModelSpec

# Models, those for batches in vector lanes of earlier versions, and unfinished ones.
_WRAPPER = re.compile(r"wrapper-[0-9a-f]{20}\.o")
_NAME = re.compile(r"(msfp_\d+_\d+_\d+(?:_lanes\d+)?-[0-9a-f]{20})(\.part-\d+)?")
DAY = 86400.0


@dataclass(frozen=True)
class CachedModel:
    """One folder of the cache.

    Attributes:
        folder: the folder.
        spec: name of the model, `ModelSpec.key`; "?" where the manifest cannot be read.
        state: "current" (of this version, for whatever processor), "other version", "damaged or old" (without a valid
            manifest), or "unfinished" (of a build that is running or was killed).
        size: total size of its files [bytes].
        used: time of last use or of the build [s since 1970].
    """

    folder: Path
    spec: str
    state: str
    size: int
    used: float

    @property
    def days(self) -> float:
        """Time since the last use [days]."""
        return max(0.0, time.time() - self.used) / DAY


def cached_models() -> list[CachedModel]:
    """All models in the cache, the last used first; empty if the cache folder does not exist."""
    root = cache_root()
    if not root.is_dir():
        return []
    inputs = _current_inputs()
    models = [_cached_model(path, inputs) for path in root.iterdir() if _NAME.fullmatch(path.name) and path.is_dir()]
    return sorted((item for item in models if item is not None), key=lambda item: -item.used)


def prune(days: float) -> tuple[list[CachedModel], list[CachedModel]]:
    """Delete the models that were not used for `days` days.

    Returns
    -------
    tuple of lists
        The deleted models, and those that could not be deleted because they are in use.

    Raises
    ------
    InputError
        If `days` is negative or not a number.

    """
    if not days >= 0:
        raise InputError(f"days = {days}: give a number of days, 0 or more")
    _remove_wrappers(days)
    removed: list[CachedModel] = []
    in_use: list[CachedModel] = []
    for item in cached_models():
        if item.days >= days:
            (removed if _remove(item.folder) else in_use).append(item)
    _remove_locks()
    return removed, in_use


def total(items: Iterable[CachedModel]) -> int:
    """Total size of some models [bytes]."""
    return sum(item.size for item in items)


def _current_inputs() -> dict[str, object]:
    """Inputs of the cache key in this version; all but "spec" and "processor" are the same for every model."""
    try:
        return Entry.of(ModelSpec(Layout.dfp())).inputs
    except CompileError:  # without a compiler no entry of the cache is usable
        return {}


def _cached_model(folder: Path, inputs: dict[str, object]) -> CachedModel | None:
    """Description of one folder of the cache; None if another process deletes it meanwhile."""
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
        own = {name: manifest.inputs.get(name) for name in ("spec", "processor")}
        state = "current" if inputs | own == manifest.inputs else "other version"
    return CachedModel(folder, spec, state, size, used)


def _remove(folder: Path) -> bool:
    """Delete a folder. Returns False if a build holds its lock or another process has its files open.

    The folder is renamed before it is deleted, so that no process finds an incomplete entry.
    """
    with _lock(folder) as acquired:
        if not acquired:
            return False
        renamed = folder
        if ".part-" not in folder.name:
            renamed = folder.with_name(f"{folder.name}.part-{os.getpid()}")
            shutil.rmtree(renamed, ignore_errors=True)
            with suppress(OSError):  # some systems do not rename a folder with open files
                folder.rename(renamed)
        shutil.rmtree(renamed, ignore_errors=True)
        return not (folder.exists() or renamed.exists())


def _remove_wrappers(days: float) -> None:
    """Delete the objects of wrappers that were not used for `days` days."""
    root = cache_root()
    for path in root.iterdir() if root.is_dir() else ():
        with suppress(OSError):
            if _WRAPPER.fullmatch(path.name) and path.stat().st_mtime <= time.time() - days * 86400.0:
                path.unlink()


def _remove_locks() -> None:
    """Delete the lock files of models that no longer exist."""
    root = cache_root()
    for path in root.glob("msfp_*.lock") if root.is_dir() else ():
        name = path.name.removesuffix(".lock")
        if _NAME.fullmatch(name) and not any(root.glob(f"{name}*/")):
            with _lock(root / name) as acquired, suppress(OSError):
                if acquired:
                    path.unlink()


@contextmanager
def _lock(folder: Path) -> Iterator[bool]:
    """Try to acquire the build lock of a model for the block; yields whether that succeeded."""
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
