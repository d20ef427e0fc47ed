"""The C library of `msfp-gen export`: headers, libraries, package files, sources and examples below a prefix."""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

from msfp_gen.embedding import values
from msfp_gen.embedding.rendering import render
from msfp_gen.embedding.tree import Link, Tree, check_prefix, install
from msfp_gen.errors import CompileError, InputError
from msfp_gen.generator.interface import ABI_VERSION, CALL_ERRORS, effects_text, model_name, surface_values
from msfp_gen.jit.compiler import FLAGS
from msfp_gen.jit.library import STATIC, BuiltLibrary, build_library
from msfp_gen.specification import contract
from msfp_gen.specification.layout import ModelSpec
from msfp_gen.version import __version__

SHARE = "share/msfp"
# Template -> path below the prefix.
PAGES = {
    "msfp.pc": "lib/pkgconfig/msfp.pc",
    "msfp-config.cmake": "lib/cmake/msfp/msfp-config.cmake",
    "msfp-config-version.cmake": "lib/cmake/msfp/msfp-config-version.cmake",
    "library.md": f"{SHARE}/README.md",
    "msfp.f90": f"{SHARE}/msfp.f90",
    "example.c": f"{SHARE}/examples/example.c",
    "example.f90": f"{SHARE}/examples/example.f90",
    "Makefile": f"{SHARE}/examples/Makefile",
    "CMakeLists.txt": f"{SHARE}/examples/CMakeLists.txt",
}


@dataclass(frozen=True)
class Library:
    """A library that was written. models: name -> key of layout and effects. seconds: duration of the export [s]."""

    prefix: Path
    models: dict[str, str]
    files: tuple[str, ...]
    seconds: float


def export_library(
    specs: Sequence[ModelSpec], prefix: Path | str, progress: Callable[[str, float], None] | None = None
) -> Library:
    """Build the models of `specs` and write the C library with all that its users need below `prefix`.

    progress: called with a text and the completed share, 0 to 1. Raises InputError: two models of one layout, a prefix
    that is no folder or holds files of the user under these names; CompileError. Nothing is written after an error.
    """
    begin, target = perf_counter(), Path(prefix).absolute()
    models = {model_name(spec): spec for spec in specs}
    if len(models) < len(specs):
        raise InputError(
            f"layouts = {', '.join(spec.layout.name.replace('_', ' ') for spec in specs)}: give each layout once; "
            "its names in C are those of the layout"
        )
    check_prefix(target)
    folder = Path(tempfile.mkdtemp(prefix="msfp-gen-export-"))
    try:
        built = build_library(list(models.values()), folder, progress or (lambda _, __: None))
        tree = _tree(models, built)
    except BaseException as error:
        if not (isinstance(error, CompileError) and error.log):  # else the folder stays, with the log
            shutil.rmtree(folder, ignore_errors=True)
        raise
    shutil.rmtree(folder)
    try:
        install(tree, target)
    except OSError as error:
        raise InputError(f"--prefix = {str(prefix)!r}: {error.strerror or error}; give another folder") from error
    keys = {name: spec.key for name, spec in models.items()}
    return Library(target, keys, tuple(sorted(tree)), perf_counter() - begin)


def _tree(models: dict[str, ModelSpec], built: BuiltLibrary) -> Tree:
    content = _content(models, built)
    texts = {path: render(name, content) for name, path in PAGES.items()}
    texts |= {f"include/{name}": text for name, text in built.public.items()}
    for model, files in built.sources.items():
        texts |= {f"{SHARE}/src/{model}/{name}": text for name, text in files.items()}
    tree: Tree = {path: text.encode() for path, text in texts.items()}
    libraries = {f"lib/{STATIC}": built.static, f"lib/{built.shared.name}": built.shared}
    tree |= {path: file.read_bytes() for path, file in libraries.items()}
    return tree | {f"lib/{built.linker_name}": Link(built.shared.name)}


def _content(models: dict[str, ModelSpec], built: BuiltLibrary) -> dict[str, Any]:
    """What the templates need."""
    from msfp_gen.generator.header import word_enums  # it imports SymPy

    return {
        "stamp": f"written by msfp-gen {__version__}",
        "version": __version__,
        "abi": ABI_VERSION,
        "models": [
            {
                "name": name,
                "layout": spec.layout,
                "effects": effects_text(spec),
                "surface": [value.name for value in surface_values(spec)],
                "example": values.example(spec),
            }
            for name, spec in models.items()
        ],
        "body": contract.names(contract.BODY),
        "top": contract.names(contract.TOP),
        "words": word_enums(),
        "errors": CALL_ERRORS,
        "static": STATIC,
        "shared": built.shared.name,
        "linker_name": built.linker_name,
        "soname_flag": "@rpath/" if sys.platform == "darwin" else "",
        "flags": " ".join(FLAGS["c"]),
        "values": values,
    }
