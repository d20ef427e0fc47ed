"""Build of a compiled model: taken from the wheel or the cache, else derived, lowered, emitted, compiled and stored.

| stage | module | input -> output |
|---|---|---|
| derive, lower, emit | `msfp_gen.generator` | ModelSpec -> sources |
| compile | `msfp_gen.jit.compiler` | sources, runtime's C -> extension; objects, kept for other models |
| store | `msfp_gen.jit.cache` | folder -> entry with a manifest |
| load | `msfp_gen.jit.build` | extension -> imported module |

Drivers of two-ports, such as the run of a building, are built, cached and loaded in the same way. They include `msfp.h`
and know models by their tables of functions alone, so one build serves all models.

A wheel brings models compiled, so that common layouts need no compiler; `tools/prebuilt_wheel.py` makes it.
`msfp_gen/prebuilt/` has one folder for each model and level of the processor, and one for each driver of two-ports,
with a manifest and an extension that uses only the limited API of Python, so that one file serves all versions. A
checkout has none, nor has a pure wheel.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import os
import re
import shutil
import threading
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache as remember
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from types import ModuleType
from typing import Any

from msfp_gen.common.aliases import BuildProgress
from msfp_gen.common.errors import CompileError, InputError
from msfp_gen.common.tables import Table
from msfp_gen.jit import cache
from msfp_gen.jit.compiler import (
    CFLAGS,
    COMPILER,
    EXTENSION_SUFFIX,
    LOG_NAME,
    compile_extension,
    words_of_variable,
    x86_64_level,
)
from msfp_gen.specification.layout import Effects, Layout, ModelSpec

ENTRY = "msfp_entry.c"
_INCLUDE = re.compile(r'(?:#include|cdef extern from) "([\w.]+)"')
GENERATION_SHARE = 0.13  # of the build time, for the progress display; compilation takes the rest
PREBUILT_SUFFIX = ".abi3.so"  # of the models that a wheel brings
PREBUILT_LEVELS = (3, 1)
"""Levels of x86-64 that a wheel has models for: every processor, and those with AVX2."""
PREBUILT_LAYOUTS = (Layout(2, 1, 0), Layout.dfp(), Layout.tfp())


@dataclass(frozen=True)
class BuildInfo:
    """Location and build times of a compiled model.

    Attributes:
        path: the extension.
        folder: folder of the extension, its sources, manifest and `build.log`.
        module: name of the extension module.
        spec: name of the model, `ModelSpec.key`.
        cached: whether the model was there before the call, in the cache or in the wheel.
        stages: stage -> its time when the model was built, now or earlier [s].
        seconds: duration of this call [s].
        statements, operations: numbers of statements and of arithmetic operations of the emitted kernels.
        key: hash of all inputs that determine the numbers that the model gives: the cache key less the processor.
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


def prepare(spec: ModelSpec, progress: BuildProgress | None = None, portable: bool = False) -> BuildInfo:
    """Build the model unless the wheel or the cache holds it; the extension is not imported.

    Args:
        spec: layout and effects.
        progress: called with a text and the completed share of the build, 0 to 1.
        portable: compile for every processor, not only for the one of this machine.

    Raises:
        CompileError: no C compiler was found, or it rejected a file.
        InputError: the cache folder cannot be written to.
    """
    begin = perf_counter()
    if not portable and (prebuilt := find_prebuilt(spec)) is not None:
        folder, ready = prebuilt
        return _info(spec, ready, folder, prebuilt_key(ready), True, perf_counter() - begin)
    entry = cache.Entry.of(spec, portable)
    notify = progress or cache.no_progress
    manifest, built = entry.find_or_build(lambda part: _build(spec, entry, part, notify), notify)
    return _info(spec, manifest, entry.folder, entry.identity, not built, perf_counter() - begin)


def load(spec: ModelSpec, progress: BuildProgress | None = None) -> tuple[ModuleType, BuildInfo]:
    """Import the compiled module of a model, after building it if necessary; arguments and errors as in `prepare`."""
    begin = perf_counter()
    info = prepare(spec, progress)
    extension = load_extension(info.path, info.module)
    return extension, replace(info, seconds=perf_counter() - begin)


def generate_to(spec: ModelSpec, folder: Path | str, progress: BuildProgress | None = None) -> BuildInfo:
    """Write the sources and the compiled module of a model into `folder`, for a plain `import msfp_5_2_2`.

    The module runs on every processor of this architecture. Its sources are in two folders, `derived` and `runtime`:
    what was derived for this layout, and what is the same for every model.

    Each file is replaced in one rename, the manifest first and
    the extension last. Files that msfp-gen did not write are never changed.

    Raises
    ------
    InputError
        If the folder holds files but no manifest of this tool, another layout, or a file of the same name that is not
        in its manifest.

    """
    target = Path(folder).absolute()
    replaceable = replaceable_files(target, cache.module_name(spec))
    info = prepare(spec, progress, portable=True)
    manifest = cache.Manifest.read(info.folder)
    moved = replace(manifest, files={place_of(name): digest for name, digest in manifest.files.items()})
    copy_module({place_of(name): info.folder / name for name in manifest.files}, moved, target, replaceable)
    return replace(info, path=target / manifest.extension, folder=target)


def place_of(name: str) -> str:
    """Path in a folder of the user of a file of a model: derived code and what all models share lie apart."""
    if not name.endswith(SUFFIXES):
        return name
    shared = name in {path.name for path in _runtime()} or name in (ENTRY, "msfp.h") or name.endswith(".pyx")
    return f"{'runtime' if shared else 'derived'}/{name}"


def copy_module(files: Mapping[str, Path], manifest: cache.Manifest, target: Path, replaceable: set[str]) -> None:
    """Copy the files of a module into `target`, the manifest first and the extension last; see `generate_to`.

    files: path in `target` -> source. replaceable: files there that may be replaced.
    """
    names = [*sorted(set(files) - {manifest.extension}), manifest.extension]
    if foreign := [name for name in names if name not in replaceable and (target / name).exists()]:
        raise InputError(
            f"output folder {target}: msfp-gen did not write {foreign[0]}: move it away or name another folder"
        )
    with cache.write_errors(target, "output folder"), TemporaryDirectory() as part:
        target.mkdir(parents=True, exist_ok=True)
        manifest.write(Path(part))
        _replace(Path(part) / cache.MANIFEST_NAME, target / cache.MANIFEST_NAME)
        for name in names:
            (target / name).parent.mkdir(exist_ok=True)
            _replace(files[name], target / name)


def load_extension(path: Path, module: str) -> ModuleType:
    """Import the extension at `path` as `module`, without a change of `sys.path`. Raises CompileError."""
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


def runtime_sources(spec: ModelSpec) -> dict[str, str]:
    """Hand-written C files that are compiled with a model: file name, without its folder -> text.

    Names are unique across the folders, so that generated sources lie in one folder.
    """
    effects = spec.effects
    needed = {  # a file, or all of a folder
        "gradients": spec.gradients,
        "port": effects.permits_moving_ends,
        "port.h": True,
        "two_port.c": effects.permits_moving_ends,
        "dopri5.c": effects.permits_dopri5,
        "memory.c": effects.law is not None and effects.law.memory is not None,
        "contact_unilateral.c": effects.uplift,
    }
    files = (path for path in _runtime() if needed.get(path.name, needed.get(path.parent.name, True)))
    return {path.name: path.read_text(encoding="utf-8") for path in files}


def _runtime() -> list[Path]:
    """All hand-written C files."""
    return sorted((cache.PACKAGE / "runtime").rglob("*.[ch]"))


def entry_source(module: str) -> str:
    """C code between the wrapper, which is the same for every model, and the model of an extension.

    It gives the initialisation of the wrapper the name under which Python imports the extension.
    """
    return f"""\
/* {ENTRY}: the model of the extension {module}, and the name under which Python imports it. */
#include "msfp_symbols.h"

#if defined(_WIN32)
#define VISIBLE __declspec(dllexport)
#else
#define VISIBLE __attribute__((visibility("default")))
#endif

const struct msfp_api *MSFP_MODEL(void);
const struct msfp_api *msfp_model_of_extension(void);
const struct msfp_api *msfp_model_of_extension(void) {{ return MSFP_MODEL(); }}

void *PyInit_msfp_module(void);
VISIBLE void *PyInit_{module}(void);
void *PyInit_{module}(void) {{ return PyInit_msfp_module(); }}
"""


def kept_wrapper(files: Mapping[str, str], inputs: Mapping[str, Any]) -> Path:
    """Where the cache keeps the object of a wrapper, `objects/wrapper-<key>.o`.

    files: of the generator; inputs: of the entry that is built. The key covers all that the object is made from: the
    wrapper with the headers that it includes, and the tools.
    """
    wrapper = next(name for name in files if name.endswith(".pyx"))
    texts = {name: files[name] for name in _included(wrapper, files)}
    tools = {name: inputs[name] for name in ("compiler", "abi")} | {"cython": inputs["tools"]["cython"]}
    key = cache.digest_files({**texts, "": json.dumps([tools, inputs["flags"]["wrapper"]])})
    return cache.objects_folder() / f"wrapper-{key[:20]}.o"


def _included(name: str, files: Mapping[str, str]) -> set[str]:
    """The name of a file, and the names of the others that it includes."""
    names = {name}
    for header in _INCLUDE.findall(files[name]):
        if header in files:
            names |= _included(header, files)
    return names


def _info(spec: ModelSpec, manifest: cache.Manifest, folder: Path, key: str, cached: bool, seconds: float) -> BuildInfo:
    return BuildInfo(
        path=folder / manifest.extension,
        folder=folder,
        module=manifest.module,
        spec=spec.key,
        cached=cached,
        stages=manifest.stages,
        seconds=seconds,
        statements=manifest.statements,
        operations=manifest.operations,
        key=key,
    )


def _build(spec: ModelSpec, entry: cache.Entry, folder: Path, notify: BuildProgress) -> cache.Manifest:
    """Derive, lower, emit and compile a model into `folder`, and write its manifest."""
    from msfp_gen.generator import generate

    notify(f"deriving and emitting {spec.key}", 0.0)
    generated = generate(spec)
    sources = {**runtime_sources(spec), **generated.files, ENTRY: entry_source(entry.module)}
    begin = perf_counter()
    extension = compile_extension(
        sources,
        entry.module,
        folder,
        lambda done, count: notify(
            f"compiling {entry.module} ({done} of {count} files)",
            GENERATION_SHARE + (1 - GENERATION_SHARE) * done / count,
        ),
        entry.inputs["processor"],
        kept=kept_wrapper(generated.files, entry.inputs),
        shared=cache.objects_folder(),
    )
    manifest = cache.Manifest(
        module=entry.module,
        spec=spec.key,
        key=entry.key,
        inputs=entry.inputs,
        extension=extension.name,
        files={path.name: cache.digest(path) for path in sorted(folder.iterdir())},
        statements=generated.statements,
        operations=generated.operations,
        stages={**generated.stages, "compile": perf_counter() - begin},
    )
    manifest.write(folder)
    return manifest


def replaceable_files(target: Path, module: str) -> set[str]:
    """Names of the files in `target` that msfp-gen wrote and may replace.

    Raises InputError if `target` is a file, holds files without a manifest, or holds another model.
    """
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
    """Copy a file; at any time `target` is the complete old or the complete new file."""
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    shutil.copyfile(source, part)
    part.replace(target)


def build_table(info: BuildInfo) -> Table:
    """Build times, size and location of a compiled model."""
    stages = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in info.stages.items())
    origin = "found in the cache" if info.cached else "built now"
    return Table(
        info.spec,
        (),
        [
            ("stages", stages),
            ("this call", f"{info.seconds:.2f} s, {origin}"),
            ("kernels", f"{info.statements} statements, {info.operations} operations"),
            ("module", info.module),
            ("folder", str(info.folder)),
            ("extension", info.path.name),
        ],
    )


LIBRARIES = ("-pthread",)
SUFFIXES = (".c", ".h", ".pyx")


_loading = threading.Lock()  # a module of Cython can be imported once: of two threads the second waits


def load_driver(package: str) -> tuple[ModuleType, str]:
    """The module of the `.pyx` and the C files in `<package>/compiled`, and the hash of all that determines it.

    Raises CompileError: no C compiler was found, or it rejected a file; InputError: the cache cannot be written to.
    """
    with _loading:
        return _driver(package)


@remember
def _driver(package: str) -> tuple[ModuleType, str]:
    module, files = _named(package)
    if (ready := find_prebuilt_driver(module, files)) is not None:
        folder, manifest = ready
        return load_extension(folder / manifest.extension, module), prebuilt_key(manifest)
    entry = build_driver(package)
    return load_extension(entry.folder / f"{module}{EXTENSION_SUFFIX}", module), entry.key


def build_driver(package: str) -> cache.Entry:
    """The module of a package in the cache, built unless it is there; errors as in `load_driver`."""
    module, files = _named(package)
    entry = cache.Entry.of_files(module, files)
    entry.find_or_build(lambda part: _build_driver(entry, files, part))
    return entry


def _named(package: str) -> tuple[str, dict[str, str]]:
    """Name of the module of a package, and its files."""
    files = sources(resources.files(package) / "compiled")
    return next(Path(name).stem for name in files if name.endswith(".pyx")), files


def sources(folder: Traversable) -> dict[str, str]:
    """The sources in a folder: file name -> text."""
    paths = sorted(folder.iterdir(), key=lambda file: file.name)
    return {file.name: file.read_text(encoding="utf-8") for file in paths if file.name.endswith(SUFFIXES)}


def headers() -> dict[str, str]:
    """The headers that a driver includes: file name -> text."""
    from msfp_gen.generator.interface import public_header

    runtime = resources.files("msfp_gen") / "runtime"
    own = {name: (runtime / name).read_text(encoding="utf-8") for name in ("msfp_math.h", "msfp_hash.h", "msfp_time.h")}
    return {"msfp.h": public_header(), **own}


def _build_driver(entry: cache.Entry, files: dict[str, str], folder: Path) -> cache.Manifest:
    begin = perf_counter()
    extension = compile_extension({**files, **headers()}, entry.module, folder, libraries=LIBRARIES)
    manifest = cache.Manifest(
        module=entry.module,
        spec=entry.module,
        key=entry.key,
        inputs=entry.inputs,
        extension=extension.name,
        files={path.name: cache.digest(path) for path in sorted(folder.iterdir())},
        statements=0,
        operations=0,
        stages={"compile": perf_counter() - begin},
    )
    manifest.write(folder)
    return manifest


def prebuilt_specs() -> list[ModelSpec]:
    """The models of a wheel: single, double and triple pendulum, planar and spatial, sliders and rims as selected; and
    those that a building moves at both ends, without and with uplift. The triple one also with the friction of
    earthquakes, as the presets have it.
    """
    alone = [
        ModelSpec(layout, Effects(dimension=dimension, sliders=sliders, rims=rims))
        for layout in PREBUILT_LAYOUTS
        for dimension in ("spatial", "planar")
        for sliders in ("inertial", "massless")
        for rims in (True, False)
    ]
    below = [Effects(top_rotation=True, uplift=uplift) for uplift in (False, True)]
    shaken = [*(Effects(rims=rims) for rims in (True, False)), *below]
    heated = [ModelSpec(Layout.tfp(), replace(effects, friction="pvt", bouc_wen="plastic")) for effects in shaken]
    return [*alone, *(ModelSpec(layout, effects) for layout in PREBUILT_LAYOUTS for effects in below), *heated]


def prebuilt_folder() -> Path:
    """Folder of the models that came with the package; it need not exist."""
    return cache.PACKAGE / "prebuilt"


def find_prebuilt(spec: ModelSpec) -> tuple[Path, cache.Manifest] | None:
    """Folder and manifest of a model that came with the package and runs on this processor; None if there is none.

    None too where the user names a compiler or its flags (CC, MSFP_GEN_CFLAGS). A damaged one raises a warning.
    """
    return _find(cache.module_name(spec), spec.key)


def find_prebuilt_driver(module: str, files: Mapping[str, str]) -> tuple[Path, cache.Manifest] | None:
    """As `find_prebuilt`, for a module that drives models. files: name -> text."""
    return _find(module, cache.digest_files(files))


def add_prebuilt(level: int, built: Path, root: Path) -> Path:
    """Copy what is in the folder `built`, compiled for a level of the processor, to `root`; returns its folder.

    The manifest states neither the times of the build nor where its compiler lay, so that two builds are the same.
    """
    manifest = cache.Manifest.read(built)
    data = (built / manifest.extension).read_bytes()
    folder = root / _folder_name(manifest.module, _content(manifest), level)
    folder.mkdir(parents=True)
    extension = f"{manifest.module}{PREBUILT_SUFFIX}"
    (folder / extension).write_bytes(data)
    files = {extension: hashlib.sha256(data).hexdigest()}
    compiler = [Path(word).name if Path(word).is_absolute() else word for word in manifest.inputs["compiler"]]
    inputs = {**manifest.inputs, "compiler": compiler}
    replace(manifest, inputs=inputs, key=folder.name, extension=extension, files=files, stages={}).write(folder)
    return folder


def prebuilt_key(manifest: cache.Manifest) -> str:
    """Hash of what determines its numbers: one for all levels of the processor, since all give the same."""
    return hashlib.sha256(f"prebuilt\0{manifest.inputs['sources']}\0{_content(manifest)}".encode()).hexdigest()


def _content(manifest: cache.Manifest) -> str:
    """`ModelSpec.key` of a model, the digest of the files of any other module."""
    return str(manifest.inputs.get("spec") or manifest.inputs["files"])


def _find(module: str, content: str) -> tuple[Path, cache.Manifest] | None:
    root = prebuilt_folder()
    if not root.is_dir() or words_of_variable(COMPILER) or words_of_variable(CFLAGS):
        return None
    reached = x86_64_level() or 1
    for level in (level for level in PREBUILT_LEVELS if level <= reached):
        folder = root / _folder_name(module, content, level)
        if not folder.is_dir():
            continue
        try:
            manifest = cache.Manifest.read(folder)
            if cache.digest(folder / manifest.extension) == manifest.files[manifest.extension]:
                return folder, manifest
        except (OSError, ValueError, TypeError, KeyError):
            pass
        warnings.warn(f"{folder} is damaged and not used; install msfp-gen again", RuntimeWarning, stacklevel=3)
    return None


def _folder_name(module: str, content: str, level: int) -> str:
    """A name that only a module of these sources and this content has."""
    key = hashlib.sha256(f"{cache.digest_sources()}\0{content}".encode()).hexdigest()
    return f"{module}-{key[:20]}-v{level}"
