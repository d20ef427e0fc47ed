"""Build of the C library: the models of one or several layouts in one static and one shared library.

The names of every model have its prefix, so that they link together. Each is compiled for every processor of the
architecture.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from msfp_gen.common.errors import CompileError, InputError
from msfp_gen.common.output import write_text
from msfp_gen.generator.interface import ABI_VERSION, model_name
from msfp_gen.jit.build import runtime_sources
from msfp_gen.jit.cache import objects_folder
from msfp_gen.jit.compiler import (
    FLAGS,
    ZIG_OPTIONS,
    BuildStep,
    Compiler,
    Log,
    compile_once,
    compile_step,
    find_compiler,
    object_file,
    run_parallel,
    words_of_variable,
    zig_program,
)
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
    log.run(BuildStep(STATIC, (*archiver, "rcs", STATIC, *objects)))
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
    files = {**runtime_sources(spec), **generate(spec).files, **others}
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
    """Compile C files in the folder of a log, those that another library has not; returns the object files."""
    flags = (*FLAGS["c"], *FLAGS["user"])

    def run(step: BuildStep) -> None:
        compile_once(step.subject, compiler, flags, log, objects_folder())

    for done in run_parallel([[compile_step(name, compiler, flags)] for name in units], run):
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
        files = {**runtime_sources(spec), **generate(spec).files}
        sources[model_name(spec)] = {name: text for name, text in sorted(files.items()) if name.endswith((".c", ".h"))}
    for model, files in sources.items():
        (folder / model).mkdir()
        for name, text in files.items():
            write_text(folder / model / name, text)
    return sources


def _link_step(compiler: Compiler, options: Sequence[str], objects: Sequence[str], target: str) -> BuildStep:
    return BuildStep(target, (*compiler.command, *options, *objects, "-o", target, *FLAGS["libraries"]))


EXPORTS = "msfp.map"  # what a shared library for Linux shows: one function of each model
WINDOWS_IMPORT = "libmsfp.dll.a"


@dataclass(frozen=True)
class Platform:
    """A platform. Paths are relative to the prefix of the library.

    Attributes:
        shared: the shared library.
        linker_name: what a linker looks for: a link to the shared library, or its import library.
        options: of the compiler as a linker.
        imports: whether `linker_name` is an import library, which the linker writes.
        triple: name of the platform for zig; empty: compiled by the compiler at hand.
        soname: name that programs keep of the shared library.
    """

    shared: str
    linker_name: str
    options: tuple[str, ...]
    imports: bool = False
    triple: str = ""
    soname: str = ""


def _linux(triple: str = "") -> Platform:
    name = f"libmsfp.so.{ABI_VERSION}"
    options = ("-shared", f"-Wl,-soname,{name}", f"-Wl,--version-script={EXPORTS}")
    return Platform(f"lib/{name}", "lib/libmsfp.so", options, triple=triple, soname=name)


def _macos(triple: str = "") -> Platform:
    name = f"libmsfp.{ABI_VERSION}.dylib"
    options = ("-dynamiclib", "-install_name", f"@rpath/{name}")
    return Platform(f"lib/{name}", "lib/libmsfp.dylib", options, triple=triple, soname=f"@rpath/{name}")


def _windows(triple: str) -> Platform:
    options = ("-shared", "-s", f"-Wl,--out-implib,{WINDOWS_IMPORT}")
    return Platform(f"bin/msfp-{ABI_VERSION}.dll", f"lib/{WINDOWS_IMPORT}", options, True, triple)


# What `--target` names.
TARGETS = {
    "windows-x86_64": _windows("x86_64-windows-gnu"),
    "macos-x86_64": _macos("x86_64-macos"),
    "macos-arm64": _macos("aarch64-macos"),
    "linux-x86_64": _linux("x86_64-linux-gnu.2.17"),
    "linux-arm64": _linux("aarch64-linux-gnu.2.17"),
}


def find_platform(target: str | None) -> Platform:
    """The platform that `target` names; None: this machine. Raises InputError for an unknown name."""
    if target is None:
        return _macos() if sys.platform == "darwin" else _linux()
    if target not in TARGETS:
        raise InputError(f"--target = {target!r}: give one of {', '.join(TARGETS)}")
    return TARGETS[target]


def find_tools(platform: Platform) -> tuple[Compiler, tuple[str, ...]]:
    """Compiler and archiver for a platform. Raises CompileError where one is missing."""
    if not platform.triple:
        return find_compiler(), _find_archiver()
    zig = zig_program()
    if zig is None:
        raise CompileError("--target needs ziglang, a compiler for other platforms: pip install ziglang")
    command = (str(zig), *ZIG_OPTIONS, "-target", platform.triple)
    return Compiler(command, str(zig), "zig"), (str(zig), "ar")


def _find_archiver() -> tuple[str, ...]:
    """The archiver that `AR` names, else `ar`, else the one of ziglang. Raises CompileError where there is none."""
    named = words_of_variable("AR")
    command = named or ("ar",)
    if shutil.which(command[0]) is not None:
        return command
    if not named and (zig := zig_program()) is not None:
        return (str(zig), "ar")
    raise CompileError(f"no archiver found (looked for {command[0]}): install binutils or name it with AR=...")
