"""Build of the C library: the models of one or several layouts in one static and one shared library.

The names of every model have its prefix, so that they link together. Each is compiled for every processor of the
architecture.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from msfp_gen.common.output import write_text
from msfp_gen.generator.interface import model_name
from msfp_gen.jit.build import runtime_sources
from msfp_gen.jit.compiler import (
    FLAGS,
    Compiler,
    Log,
    Step,
    compile_step,
    find_compiler,
    object_file,
    run_parallel,
)
from msfp_gen.jit.platforms import EXPORTS, Platform, find_tools
from msfp_gen.specification.layout import ModelSpec

GENERATION_SHARE = 0.3  # of the build time, for the progress display; compilation takes the rest
STATIC = "libmsfp.a"


@dataclass(frozen=True)
class BuiltLibrary:
    """Files of a library, in the folder where it was built.

    static, shared: the two libraries. imports: the import library of the shared one, where the platform has such.
    public: name -> text of the headers that programs include. sources: name of a model -> its C files and headers:
    name -> text.
    """

    static: Path
    shared: Path
    imports: Path | None
    public: dict[str, str]
    sources: dict[str, dict[str, str]]


def build_library(
    specs: Sequence[ModelSpec], folder: Path, platform: Platform, progress: Callable[[str, float], None]
) -> BuiltLibrary:
    """Derive, emit, compile and link the models of `specs`, of different layouts, in an empty folder.

    progress: called with a text and the completed share of the build, 0 to 1. Raises CompileError: no compiler or
    archiver was found, or one of them failed; the folder then holds the sources and the log.
    """
    compiler, archiver = find_tools(platform)
    sources = _write_sources(specs, folder, progress)
    units = [f"{model}/{name}" for model, files in sources.items() for name in files if name.endswith(".c")]
    log = Log(folder)
    objects = _compile(units, ", ".join(sources), compiler, log, progress)
    log.run(Step(STATIC, (*archiver, "rcs", STATIC, *objects)))
    # Versions of a function for several processors stay visible in spite of -fvisibility=hidden.
    write_text(folder / EXPORTS, f"{{ global: {'; '.join(sources)}; local: *; }};\n")
    shared = Path(platform.shared).name
    log.run(_link_step(compiler, platform.options, objects, shared))
    public = {name: files[name] for model, files in sources.items() for name in ("msfp.h", f"{model}.h")}
    imports = folder / Path(platform.linker_name).name if platform.imports else None
    return BuiltLibrary(folder / STATIC, folder / shared, imports, public, sources)


def build_shared(
    spec: ModelSpec,
    others: Mapping[str, str],
    exported: str,
    name: str,
    folder: Path,
    progress: Callable[[str, float], None],
) -> dict[str, str]:
    """Build the model of `spec` and other C files as the shared library `name` in an empty folder.

    others: file name -> text. exported: names that the library shows, as a pattern of the linker. Returns all files
    that were compiled, name -> text; errors and `progress` as `build_library`.
    """
    from msfp_gen.generator import generate

    compiler = find_compiler()
    progress(f"deriving and emitting {spec.key}", 0.0)
    files = {**runtime_sources(), **generate(spec).files, **others}
    files = {file: text for file, text in sorted(files.items()) if file.endswith((".c", ".h"))}
    for file, text in files.items():
        write_text(folder / file, text)
    log = Log(folder)
    objects = _compile([file for file in files if file.endswith(".c")], model_name(spec), compiler, log, progress)
    write_text(folder / EXPORTS, f"{{ global: {exported}; local: *; }};\n")
    # A missing symbol fails the build, and not the program that loads the library.
    linux = ("-shared", f"-Wl,--version-script={EXPORTS}", "-Wl,-z,defs")
    options = ("-dynamiclib",) if sys.platform == "darwin" else linux
    log.run(_link_step(compiler, options, objects, name))
    return files


def _compile(
    units: Sequence[str], what: str, compiler: Compiler, log: Log, progress: Callable[[str, float], None]
) -> list[str]:
    """Compile C files in the folder of a log; returns the object files."""
    flags = (*FLAGS["c"], *FLAGS["user"])
    for done in run_parallel([[compile_step(name, compiler, flags)] for name in units], log.run):
        share = GENERATION_SHARE + (1 - GENERATION_SHARE) * done / len(units)
        progress(f"compiling {what} ({done} of {len(units)} files)", share)
    return [object_file(name) for name in units]


def _write_sources(
    specs: Sequence[ModelSpec], folder: Path, progress: Callable[[str, float], None]
) -> dict[str, dict[str, str]]:
    """Write the C files and headers of each model into a folder of its own; returns their texts."""
    from msfp_gen.generator import generate

    sources: dict[str, dict[str, str]] = {}
    for i, spec in enumerate(specs):
        progress(f"deriving and emitting {spec.key}", GENERATION_SHARE * i / len(specs))
        files = {**runtime_sources(), **generate(spec).files}
        sources[model_name(spec)] = {name: text for name, text in sorted(files.items()) if name.endswith((".c", ".h"))}
    for model, files in sources.items():
        (folder / model).mkdir()
        for name, text in files.items():
            write_text(folder / model / name, text)
    return sources


def _link_step(compiler: Compiler, options: Sequence[str], objects: Sequence[str], target: str) -> Step:
    return Step(target, (*compiler.command, *options, *objects, "-o", target, *FLAGS["libraries"]))
