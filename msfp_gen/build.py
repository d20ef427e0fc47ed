"""From a layout to a model in memory: find it in the cache, else derive, lower, emit, compile and keep it.

| stage | by | takes -> gives |
|---|---|---|
| derive, lower, emit | `msfp_gen.generator` | ModelSpec -> sources |
| compile | `msfp_gen.compiler` | sources and the runtime's C -> extension |
| keep | `msfp_gen.cache` | folder -> entry with a manifest |
| load | here | extension -> Model |
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from types import ModuleType

from msfp_gen import cache
from msfp_gen.compiler import FLAGS, LANES, LOG_NAME, compile_extension
from msfp_gen.errors import CompileError, InputError
from msfp_gen.layout import Effects, Layout, ModelSpec
from msfp_gen.model import Model

Progress = Callable[[str, float], None]
GENERATED = 0.13  # share of a build that deriving, lowering and emitting takes; the rest is the compiler

_models: dict[tuple[ModelSpec, int], Model] = {}
_models_lock = threading.Lock()


@dataclass(frozen=True)
class BuildInfo:
    """Where a built model lies and what it cost.

    `path` is the extension, `folder` holds it with its sources, manifest and `build.log`. `cached` says that it was
    there already. `stages` are the seconds of derive, lower, emit and compile when it was built, now or earlier;
    `seconds` is the time that this call took. `statements` and `operations` count the emitted kernels.
    `key` is the cache key: everything that decides what the model computes.
    """

    path: Path
    folder: Path
    module: str
    spec: str
    cached: bool
    stages: dict[str, float]
    seconds: float
    statements: int
    operations: int
    key: str = ""


def build_model(
    layout: Layout, effects: Effects | None = None, *, lanes: int = 0, progress: Progress | None = None
) -> Model:
    """The compiled model of a layout: derived, emitted and compiled once, then imported from the cache.

    Parameters
    ----------
    layout, effects
        What determines the equations; `effects=None` means `Effects()`.
    lanes
        How many runs a batch takes side by side: 8, 4 or 2 (`batch.lanes_here`); 0: a model for one run at a time.
    progress
        Called with what is being done and how much of the build is done, 0 to 1; None: silent.

    Raises
    ------
    CompileError
        If there is no C compiler or it refuses the emitted sources.
    InputError
        If the cache cannot be written.

    """
    spec = ModelSpec(layout, Effects() if effects is None else effects)
    with _models_lock:
        if (spec, lanes) not in _models:
            _models[spec, lanes] = _load_model(spec, lanes, progress)
        return _models[spec, lanes]


def prepare(spec: ModelSpec, progress: Progress | None = None, lanes: int = 0) -> BuildInfo:
    """Make sure that the cache holds the model, and say where; imports nothing of it."""
    begin = perf_counter()
    entry = cache.Entry.of(spec, lanes)
    manifest, built = entry.find(), False
    if manifest is None:
        say = progress or _silent
        with entry.building(say) as part:
            # Another process may have built it while this one waited for the lock.
            manifest = entry.find()
            if manifest is None:
                manifest, built = _make(entry, part, say), True
                entry.publish(part)
    return BuildInfo(
        path=entry.folder / manifest.extension, folder=entry.folder, module=entry.module, spec=spec.key,
        cached=not built, stages=manifest.stages, seconds=perf_counter() - begin,
        statements=manifest.statements, operations=manifest.operations, key=entry.key,
    )  # fmt: skip


def generate_to(spec: ModelSpec, folder: Path | str, progress: Progress | None = None) -> BuildInfo:
    """Put the sources and the compiled module of a model into `folder`, for a plain `import msfp_5_2_2`.

    Each file is replaced in one rename, the manifest first and the extension last. Files of others are never touched.

    Raises
    ------
    InputError
        If the folder holds files but no manifest of this tool, another layout, or a file of the same name that is not
        in its manifest.

    """
    target = Path(folder).absolute()
    names = _claim(target, cache.module_name(spec))
    info = prepare(spec, progress)
    manifest = cache.Manifest.read(info.folder)
    files = [cache.MANIFEST_NAME, *sorted(set(manifest.files) - {manifest.extension}), manifest.extension]
    if foreign := [name for name in files if name not in names and (target / name).exists()]:
        raise InputError(f"output folder {target}: {foreign[0]} is not ours: move it away or name another folder")
    with cache.writing(target, "output folder"):
        target.mkdir(parents=True, exist_ok=True)
        for name in files:
            _replace(info.folder / name, target / name)
    return replace(info, path=target / manifest.extension, folder=target)


def load_extension(path: Path, module: str) -> ModuleType:
    """Import the extension at `path` under its name, without touching `sys.path`."""
    spec = importlib.util.spec_from_file_location(module, path)
    if spec is None or spec.loader is None:
        raise CompileError(f"{path} is not an extension that this Python can import")
    try:
        extension = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(extension)
    except ImportError as error:
        reason = str(error).partition("\n")[0]
        raise CompileError(f"{path.name} does not load: {reason} (log: {path.parent / LOG_NAME})") from error
    return extension


def runtime_sources(lanes: int = 0) -> dict[str, str]:
    """The hand-written C that is compiled with every model, or with one for batches: file name -> text."""
    folder = cache.PACKAGE / "runtime"
    files = sorted(folder.rglob("*.[ch]") if lanes else folder.glob("*.[ch]"))
    return {path.name: path.read_text(encoding="utf-8") for path in files}


def _make(entry: cache.Entry, folder: Path, say: Progress) -> cache.Manifest:
    """Derive, lower, emit and compile into `folder`, and sign it with a manifest."""
    from msfp_gen.generator import generate

    say(f"deriving and emitting {entry.spec.key}", 0.0)
    lanes = entry.lanes
    generated = generate(entry.spec, entry.module, batch=True) if lanes else generate(entry.spec, entry.module)
    sources = {**runtime_sources(lanes), **generated.files}
    width = f"-DMSFP_WIDTH={lanes}"
    extra = dict.fromkeys(sources, (width, *FLAGS["lanes"], *LANES[lanes])) if lanes else {}
    begin = perf_counter()
    extension = compile_extension(
        sources, entry.module, folder, lambda done, count: say(f"compiling {entry.module} ({done} of {count} files)",
                                                               GENERATED + (1 - GENERATED) * done / count),
        extra,
    )  # fmt: skip
    manifest = cache.Manifest(
        module=entry.module, spec=entry.spec.key, key=entry.key, inputs=entry.inputs, extension=extension.name,
        files={path.name: cache.digest(path) for path in sorted(folder.iterdir())},
        statements=generated.statements, operations=generated.operations,
        stages={**generated.stages, "compile": perf_counter() - begin},
    )  # fmt: skip
    manifest.write(folder)
    return manifest


def _load_model(spec: ModelSpec, lanes: int, progress: Progress | None) -> Model:
    begin = perf_counter()
    info = prepare(spec, progress, lanes)
    extension = load_extension(info.path, info.module)
    return Model(spec, extension, replace(info, seconds=perf_counter() - begin))


def _claim(target: Path, module: str) -> set[str]:
    """The names in `target` that we may replace; InputError if the folder is not ours to write."""
    if target.exists() and not target.is_dir():
        raise InputError(f"output folder {target}: this is a file: name a folder")
    if not target.exists() or not any(target.iterdir()):
        return set()
    try:
        manifest = cache.Manifest.read(target)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"output folder {target}: it holds files that msfp-gen did not write: name a new or an empty folder"
        ) from error
    if manifest.module != module:
        raise InputError(f"output folder {target}: it holds {manifest.module}: name another folder for {module}")
    return {cache.MANIFEST_NAME, *manifest.files}


def _replace(source: Path, target: Path) -> None:
    """Copy a file so that `target` is the old file or the new one, never a part."""
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    shutil.copyfile(source, part)
    part.replace(target)


def _silent(_: str, __: float) -> None:
    """Progress that nobody asked for."""
