"""Where built models are kept, what tells two of them apart, and which of them are believed.

An entry is a folder `<module>-<key>` that appears in one rename, complete, with a `manifest.json`. It is built in
`<entry>.part-<process>` under `<entry>.lock`; a build that is killed leaves only that, which nobody reads and the next
build clears away. Finding a built model needs no lock and imports none of the tools that made it.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from msfp_gen.compiler import EXTENSION_SUFFIX, FLAGS, LANES, find_compiler
from msfp_gen.errors import InputError
from msfp_gen.layout import ModelSpec
from msfp_gen.version import __version__

MANIFEST_NAME = "manifest.json"
PACKAGE = Path(__file__).parent
# Everything written by hand that decides what a built model contains.
ROOMS = (("generator", "*.py"), ("templates", "*.jinja"), ("runtime", "*.[ch]"))
TOOLS = ("sympy", "cython", "jinja2")


@dataclass(frozen=True)
class Manifest:
    """What an entry says about itself, kept as `manifest.json`.

    `files` maps each file name to its sha256; `inputs` is what the key was made of; `stages` are the seconds that each
    stage took when the entry was built.
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
        """The file: JSON that ends with the sha256 of everything else in it."""
        values = asdict(self)
        return json.dumps(values | {"sha256": _sha256(json.dumps(values))}, indent=1) + "\n"

    def write(self, folder: Path) -> None:
        """Write `manifest.json` into `folder`."""
        (folder / MANIFEST_NAME).write_bytes(self.text.encode())

    @classmethod
    def read(cls, folder: Path) -> Manifest:
        """Read it back; ValueError or TypeError if a byte of it was altered, OSError if it cannot be read."""
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
    """Folder of the entries: `MSFP_GEN_CACHE`, else `build/models/` of a checkout, else the user's cache."""
    if named := os.environ.get("MSFP_GEN_CACHE", "").strip():
        return Path(named).expanduser().absolute()
    house = PACKAGE.resolve().parent
    if (house / "pyproject.toml").is_file() and (house / "build").is_dir():
        return house / "build" / "models"
    from platformdirs import user_cache_path

    return user_cache_path("msfp-gen") / "models"


def module_name(spec: ModelSpec, lanes: int = 0) -> str:
    """Name of the extension module, `msfp_<n>_<m>_<p>`, and `_lanes<width>` where it is made for batches."""
    return f"msfp_{spec.layout.name}" + (f"_lanes{lanes}" if lanes else "")


@dataclass(frozen=True)
class Entry:
    """The place of one model in the cache, built or not.

    `inputs` names everything that decides the bytes of the extension (no derived expression is among them), `key` is
    its sha256, and `folder` is where the model lies or will lie.
    """

    spec: ModelSpec
    module: str
    inputs: dict[str, Any]
    key: str
    folder: Path
    lanes: int = 0

    @classmethod
    def of(cls, spec: ModelSpec, lanes: int = 0) -> Entry:
        """The entry of a model, or of the same for batches of so many lanes; costs some milliseconds."""
        compiler = find_compiler()
        inputs = {
            "manifest": 2,
            "spec": spec.key,
            "sources": _digest_rooms(),
            "tools": {"msfp-gen": __version__, **{tool: _version(tool) for tool in TOOLS}},
            "abi": EXTENSION_SUFFIX,
            "compiler": [*compiler.command, compiler.path, compiler.version],
            "flags": {use: list(flags) for use, flags in FLAGS.items()},
        }
        if lanes:
            inputs["lanes"] = [str(lanes), *LANES[lanes]]
        key = hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()
        module = module_name(spec, lanes)
        return cls(spec, module, inputs, key, cache_root() / f"{module}-{key[:20]}", lanes)

    def find(self) -> Manifest | None:
        """The manifest of the built model; None if it is not built or, with a warning, if it is damaged."""
        if not self.folder.is_dir():
            return None
        try:
            manifest = Manifest.read(self.folder)
            sound = manifest.key == self.key and manifest.extension in manifest.files
            # The sources too: `generate_to` hands them out.
            sound = sound and all(digest(self.folder / name) == known for name, known in manifest.files.items())
        except (OSError, ValueError, TypeError):
            sound = False
        # A folder that is gone by now is being replaced by another process.
        if not sound and self.folder.is_dir():
            warnings.warn(f"{self.folder} is damaged and is built again", RuntimeWarning, stacklevel=3)
        if sound:
            with suppress(OSError):  # when it was last used, for `msfp-gen cache --prune`
                os.utime(self.folder / MANIFEST_NAME)
        return manifest if sound else None

    @contextmanager
    def building(self, progress: Callable[[str, float], None]) -> Iterator[Path]:
        """Hold the lock and offer an empty folder to build in, for `publish`; `progress` as of `build_model`.

        After an error the folder stays, with its sources and log, until the next build of the entry.
        """
        from filelock import FileLock, Timeout

        part = self.folder.with_name(f"{self.folder.name}.part-{os.getpid()}")
        with writing(self.folder.parent):
            self.folder.parent.mkdir(parents=True, exist_ok=True)
            lock = FileLock(f"{self.folder}.lock")
            try:
                lock.acquire(timeout=0)
            except Timeout:
                progress(f"waiting for another process that builds {self.module}", 0.0)
                lock.acquire()
        try:
            with writing(self.folder.parent):
                for left in part.parent.glob(f"{self.folder.name}.part-*"):
                    # A compiler that outlived its killed parent may still write there.
                    shutil.rmtree(left, ignore_errors=True)
                part.mkdir()
            yield part
        finally:
            lock.release()

    def publish(self, part: Path) -> None:
        """Make the finished folder the entry, in one rename; a damaged predecessor goes first. Needs the lock."""
        with writing(self.folder.parent):
            if self.folder.is_dir():
                shutil.rmtree(self.folder)
            part.rename(self.folder)


@contextmanager
def writing(folder: Path, field: str = "MSFP_GEN_CACHE") -> Iterator[None]:
    """Turn a refusal of the file system into one line that names the field, the folder and the remedy."""
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


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _digest_rooms() -> str:
    total = hashlib.sha256()
    for room, pattern in ROOMS:
        files = sorted((PACKAGE / room).rglob(pattern))
        if not files:
            raise InputError(f"{PACKAGE / room}: no {pattern} here: install msfp-gen again (pip install msfp-gen)")
        for path in files:
            data = path.read_bytes()
            total.update(f"{room}/{path.relative_to(PACKAGE / room).as_posix()}\0{len(data)}\0".encode())
            total.update(data)
    return total.hexdigest()


def _version(tool: str) -> str:
    try:
        return metadata.version(tool)
    except metadata.PackageNotFoundError:
        return "not installed"
