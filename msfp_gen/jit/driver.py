"""Compiled code that drives two-ports of models, such as the run of a building: built, cached and loaded as models are.

It includes `msfp.h` and knows models by their tables of functions alone, so one build serves all of them.
"""

from __future__ import annotations

from functools import cache as remember
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from time import perf_counter
from types import ModuleType

from msfp_gen.jit import cache
from msfp_gen.jit.build import load_extension
from msfp_gen.jit.compiler import EXTENSION_SUFFIX, compile_extension
from msfp_gen.jit.prebuilt import find_prebuilt_driver, prebuilt_key

LIBRARIES = ("-pthread",)
SUFFIXES = (".c", ".h", ".pyx")


@remember
def load_driver(package: str) -> tuple[ModuleType, str]:
    """The module of the `.pyx` and the C files in `<package>/compiled`, and the hash of all that determines it.

    Raises CompileError: no C compiler was found, or it rejected a file; InputError: the cache cannot be written to.
    """
    module, files = _named(package)
    if (ready := find_prebuilt_driver(module, files)) is not None:
        folder, manifest = ready
        return load_extension(folder / manifest.extension, module), prebuilt_key(manifest)
    entry = build_driver(package)
    return load_extension(entry.folder / f"{module}{EXTENSION_SUFFIX}", module), entry.key


def build_driver(package: str) -> cache.Entry:
    """The module of a package in the cache, built unless it is there; errors as of `load_driver`."""
    module, files = _named(package)
    entry = cache.Entry.of_files(module, files)
    entry.find_or_build(lambda part: _build(entry, files, part))
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
    from msfp_gen.generator.header import public_header

    runtime = resources.files("msfp_gen") / "runtime"
    own = {name: (runtime / name).read_text(encoding="utf-8") for name in ("msfp_math.h", "msfp_hash.h", "msfp_time.h")}
    return {"msfp.h": public_header(), **own}


def _build(entry: cache.Entry, files: dict[str, str], folder: Path) -> cache.Manifest:
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
