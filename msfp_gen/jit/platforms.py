"""Platforms for which a C library is built: names of its files, options of the linker, and the compiler.

For another platform than that of this machine the compiler of the package ziglang is used, which has the headers and
libraries of each.
"""

from __future__ import annotations

import shutil
import sys
from dataclasses import dataclass

from msfp_gen.errors import CompileError, InputError
from msfp_gen.generator.interface import ABI_VERSION
from msfp_gen.jit.compiler import ZIG_OPTIONS, Compiler, find_compiler, words, zig_program

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
    """The platform that `target` names; None: that of this machine. Raises InputError for an unknown name."""
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
        raise CompileError("--target needs ziglang, a compiler for other platforms: pip install 'msfp-gen[compiler]'")
    command = (str(zig), *ZIG_OPTIONS, "-target", platform.triple)
    return Compiler(command, str(zig), "zig"), (str(zig), "ar")


def _find_archiver() -> tuple[str, ...]:
    """The archiver that `AR` names, else `ar`, else that of ziglang. Raises CompileError where there is none."""
    named = words("AR")
    command = named or ("ar",)
    if shutil.which(command[0]) is not None:
        return command
    if not named and (zig := zig_program()) is not None:
        return (str(zig), "ar")
    raise CompileError(f"no archiver found (looked for {command[0]}): install binutils or name it with AR=...")
