"""Cache of compiled models: location, keys, and verification of its entries.

An entry is a folder `<module>-<key>` with a `manifest.json`. It is built in `<entry>.part-<process>` under the lock
`<entry>.lock` and renamed when it is complete. A build that is killed leaves only the `.part` folder, which is never
read; the next build deletes it. Finding an entry needs no lock and imports neither SymPy nor Cython.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from msfp_gen.common.errors import CompileError, InputError
from msfp_gen.common.version import __version__
from msfp_gen.jit.compiler import EXTENSION_SUFFIX, FLAGS, find_compiler, processor_flags
from msfp_gen.specification.layout import Layout, ModelSpec

MANIFEST_NAME = "manifest.json"
PACKAGE = Path(__file__).parents[1]
# (folder, pattern) of all sources that determine the content of a compiled model.
SOURCES = (
    ("common", "fields.py"),
    ("specification", "*.py"),
    ("generator", "*.py"),
    ("templates", "*.jinja"),
    ("runtime", "*.[ch]"),
)
TOOLS = ("sympy", "cython", "jinja2")


@dataclass(frozen=True)
class Manifest:
    """Description of an entry, stored as its `manifest.json`.

    Attributes:
        module: name of the extension module.
        spec: name of the model, `ModelSpec.key`.
        key: cache key, the sha256 of `inputs`.
        inputs: all inputs that determine the compiled model.
        extension: file name of the extension.
        files: file name -> its sha256.
        statements, operations: numbers of statements and of arithmetic operations of the emitted kernels.
        stages: stage of the build -> its time [s].
    """

    module: str
    spec: str
    key: str
    inputs: dict[str, Any]
    extension: str
    files: dict[str, str]
    statements: int
    operations: int
    stages: dict[str, float]

    @property
    def text(self) -> str:
        """Content of `manifest.json`: JSON whose last item is the sha256 of the others."""
        values = asdict(self)
        return json.dumps(values | {"sha256": _sha256(json.dumps(values))}, indent=1) + "\n"

    def write(self, folder: Path) -> None:
        """Write `manifest.json` into `folder`."""
        (folder / MANIFEST_NAME).write_bytes(self.text.encode())

    @classmethod
    def read(cls, folder: Path) -> Manifest:
        """Read and verify `manifest.json` of `folder`.

        Raises:
            OSError: the file cannot be read.
            ValueError, TypeError: the content is no manifest, or was changed.
        """
        content = (folder / MANIFEST_NAME).read_bytes()
        try:
            values = dict(json.loads(content))
        except RecursionError:
            raise ValueError("the manifest is nested too deeply") from None
        manifest = cls(**{name: value for name, value in values.items() if name != "sha256"})
        if manifest.text.encode() != content:
            raise ValueError("the manifest is not as it was written")
        return manifest


def cache_root() -> Path:
    """Folder of the cache: `MSFP_GEN_CACHE`, else `build/models/` of a checkout, else the user's cache folder."""
    if named := os.environ.get("MSFP_GEN_CACHE", "").strip():
        return Path(named).expanduser().absolute()
    checkout = PACKAGE.resolve().parent
    if (checkout / "pyproject.toml").is_file() and (checkout / "build").is_dir():
        return checkout / "build" / "models"
    from platformdirs import user_cache_path

    return user_cache_path("msfp-gen") / "models"


def objects_folder() -> Path:
    """Folder of the objects that models share: of C files by their preprocessed text, and of the wrapper."""
    return cache_root() / "objects"


def module_name(spec: ModelSpec) -> str:
    """Name of the extension module, `msfp_<n>_<m>_<p>`."""
    return f"msfp_{spec.layout.name}"


@dataclass(frozen=True)
class Entry:
    """Location of one compiled module in the cache, whether it is built or not.

    Attributes:
        module: name of the extension module.
        inputs: all inputs that determine the extension: model, sources, versions of tools, compiler, flags. No derived
            expression is among them, so that an entry is found without deriving the equations.
        key: sha256 of `inputs`.
        identity: sha256 of `inputs` less the processor. Models of one identity give the same numbers.
        folder: folder of the entry.
    """

    module: str
    inputs: dict[str, Any]
    key: str
    identity: str
    folder: Path

    @classmethod
    def of(cls, spec: ModelSpec, portable: bool = False) -> Entry:
        """The entry of a model; reading the sources and asking the compiler for its version takes milliseconds.

        Args:
            spec: layout and effects.
            portable: compiled for every processor, not only for the one of this machine.
        """
        return cls._of(module_name(spec), {"spec": spec.key, "sources": digest_sources()}, portable)

    @classmethod
    def of_files(cls, module: str, files: Mapping[str, str]) -> Entry:
        """The entry of a module of given sources beside the header of the models: file name -> text."""
        return cls._of(module, {"files": digest_files(files), "sources": digest_sources()}, portable=True)

    @classmethod
    def _of(cls, module: str, own: dict[str, Any], portable: bool) -> Entry:
        inputs: dict[str, Any] = {
            "manifest": 3,
            **own,
            "tools": {"msfp-gen": __version__, **{tool: tool_version(tool) for tool in TOOLS}},
            "abi": EXTENSION_SUFFIX,
            "flags": {use: list(flags) for use, flags in FLAGS.items()},
        }
        inputs["compiler"] = _compiler(module, inputs)
        identity = _sha256(json.dumps(inputs, sort_keys=True))
        inputs["processor"] = [] if portable else list(processor_flags(FLAGS["user"]))
        key = _sha256(json.dumps(inputs, sort_keys=True))
        return cls(module, inputs, key, identity, cache_root() / f"{module}-{key[:20]}")

    def find(self) -> Manifest | None:
        """Manifest of the compiled model; None if it is not built or is damaged. A damaged one raises a warning."""
        if not self.folder.is_dir():
            return None
        try:
            manifest = Manifest.read(self.folder)
            intact = manifest.key == self.key and manifest.extension in manifest.files
            # The sources are verified too, since `generate_to` copies them.
            intact = intact and all(digest(self.folder / name) == known for name, known in manifest.files.items())
        except (OSError, ValueError, TypeError):
            intact = False
        # If the folder has disappeared by now, another process is replacing it.
        if not intact and self.folder.is_dir():
            warnings.warn(f"{self.folder} is damaged and is built again", RuntimeWarning, stacklevel=3)
        if intact:
            with suppress(OSError):  # records the time of last use for `msfp-gen cache --prune`
                os.utime(self.folder / MANIFEST_NAME)
        return manifest if intact else None

    def find_or_build(
        self, build: Callable[[Path], Manifest], progress: Callable[[str, float], None] | None = None
    ) -> tuple[Manifest, bool]:
        """The manifest of the entry, and whether it was built now.

        build: writes a complete entry into an empty folder. progress: see `building`.
        """
        if (manifest := self.find()) is not None:
            return manifest, False
        with self.building(progress or no_progress) as part:
            if (manifest := self.find()) is not None:  # another process has built it while this one waited for the lock
                return manifest, False
            manifest_of_part = build(part)
            self.publish(part)
        return manifest_of_part, True

    @contextmanager
    def building(self, progress: Callable[[str, float], None]) -> Iterator[Path]:
        """Hold the lock of the entry and provide an empty folder to build in, for `publish`.

        After an error of a compiler the folder with its log is kept until the next build; after a full disk nothing is.

        Args:
            progress: called with a text and the completed share of the build while another process holds the lock.
        """
        from filelock import FileLock, Timeout

        part = self.folder.with_name(f"{self.folder.name}.part-{os.getpid()}")
        with write_errors(self.folder.parent):
            self.folder.parent.mkdir(parents=True, exist_ok=True)
            lock = FileLock(f"{self.folder}.lock")
            try:
                lock.acquire(timeout=0)
            except Timeout:
                progress(f"waiting for another process that builds {self.module}", 0.0)
                lock.acquire()
        try:
            with write_errors(self.folder.parent):
                for abandoned in part.parent.glob(f"{self.folder.name}.part-*"):
                    # Errors are ignored: the compiler of a killed build may still be writing there.
                    shutil.rmtree(abandoned, ignore_errors=True)
                part.mkdir()
                try:
                    yield part
                except OSError:  # a full disk: what was written tells nothing
                    shutil.rmtree(part, ignore_errors=True)
                    raise
        finally:
            with suppress(OSError):  # only an empty folder goes: another process has built the model meanwhile
                part.rmdir()
            lock.release()

    def publish(self, part: Path) -> None:
        """Rename the finished folder to the entry, after deleting a damaged predecessor. The lock must be held."""
        with write_errors(self.folder.parent):
            if self.folder.is_dir():
                shutil.rmtree(self.folder)
            part.rename(self.folder)


def no_progress(_: str, __: float) -> None:
    """Progress callback that does nothing."""


@contextmanager
def write_errors(folder: Path, field: str = "MSFP_GEN_CACHE") -> Iterator[None]:
    """Convert an OSError of the block to an InputError that names `field`, `folder` and the remedy."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or error
        raise InputError(
            f"{field}: cannot write {folder} ({reason}): name a folder that you can write, with space left"
        ) from error


def digest(path: Path) -> str:
    """The sha256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def digest_files(files: Mapping[str, str]) -> str:
    """The sha256 of file names and texts."""
    return _sha256(json.dumps(dict(sorted(files.items()))))


def tool_version(tool: str) -> str:
    """Version of an installed package; "not installed" where it is missing."""
    try:
        return metadata.version(tool)
    except metadata.PackageNotFoundError:
        return "not installed"


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def digest_sources() -> str:
    """The sha256 of names and contents of all files of `SOURCES`. Raises InputError if a folder has none."""
    total = hashlib.sha256()
    for folder, pattern in SOURCES:
        files = sorted((PACKAGE / folder).rglob(pattern))
        if not files:
            raise InputError(
                f"{PACKAGE / folder}: no {pattern} here: install msfp-gen again (pip install . in its checkout)"
            )
        for path in files:
            data = path.read_bytes()
            total.update(f"{folder}/{path.relative_to(PACKAGE / folder).as_posix()}\0{len(data)}\0".encode())
            total.update(data)
    return total.hexdigest()


def _compiler(module: str, inputs: dict[str, Any]) -> list[str]:
    """Command, path and version of the compiler. Without one, those with which a model of these inputs was built."""
    # Raises CompileError where there is neither.
    try:
        compiler = find_compiler()
    except CompileError:
        for folder in sorted(cache_root().glob(f"{module}-*[0-9a-f]")):
            with suppress(OSError, ValueError, TypeError):
                manifest_inputs = Manifest.read(folder).inputs
                if all(manifest_inputs.get(name) == value for name, value in inputs.items()):
                    return list(manifest_inputs["compiler"])
        raise
    return [*compiler.command, compiler.path, compiler.version]


# Models, those for batches in vector lanes of earlier versions, and unfinished ones.
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
    _remove_objects(days)
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
    """Delete a folder. Returns False if a build holds its lock or another process has its files open."""
    # The folder is renamed before it is deleted, so that no process finds an incomplete entry.
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


def _remove_objects(days: float) -> None:
    """Delete the objects that were not used for `days` days."""
    root = objects_folder()
    for path in root.iterdir() if root.is_dir() else ():
        with suppress(OSError):
            if path.stat().st_mtime <= time.time() - days * DAY:
                path.unlink()
    with suppress(OSError):  # only an empty folder goes
        root.rmdir()


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
