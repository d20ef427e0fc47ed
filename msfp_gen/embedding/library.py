"""The C library of `msfp-gen export`: headers, libraries, package files, sources and examples below a prefix."""

from __future__ import annotations

import shutil
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
from msfp_gen.jit.platforms import Platform, find_platform
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
# The same of libraries with a model for two-ports.
PORT_PAGES = {name: f"{SHARE}/examples/{name}" for name in ("two_port.c", "two_port.f90")}


@dataclass(frozen=True)
class Library:
    """A library that was written. models: name -> key of layout and effects. seconds: duration of the export [s]."""

    prefix: Path
    models: dict[str, str]
    files: tuple[str, ...]
    seconds: float


def export_library(
    specs: Sequence[ModelSpec],
    prefix: Path | str,
    progress: Callable[[str, float], None] | None = None,
    target: str | None = None,
) -> Library:
    """Build the models of `specs` and write the C library with all that its users need below `prefix`.

    progress: called with a text and the completed share, 0 to 1. target: the platform, a key of
    `msfp_gen.jit.platforms.TARGETS`; None: that of this machine. Raises InputError: two models of one layout, an
    unknown target, a prefix that is no folder or holds files of the user under these names; CompileError. Nothing is
    written after an error.
    """
    begin, root, platform = perf_counter(), Path(prefix).absolute(), find_platform(target)
    models = {model_name(spec): spec for spec in specs}
    if len(models) < len(specs):
        raise InputError(
            f"layouts = {', '.join(spec.layout.name.replace('_', ' ') for spec in specs)}: give each layout once; "
            "its names in C are those of the layout"
        )
    check_prefix(root)
    folder = Path(tempfile.mkdtemp(prefix="msfp-gen-export-"))
    try:
        built = build_library(list(models.values()), folder, platform, progress or (lambda _, __: None))
        tree = _tree(models, built, platform, target)
    except BaseException as error:
        if not (isinstance(error, CompileError) and error.log):  # else the folder stays, with the log
            shutil.rmtree(folder, ignore_errors=True)
        raise
    shutil.rmtree(folder)
    try:
        install(tree, root)
    except OSError as error:
        raise InputError(f"--prefix = {str(prefix)!r}: {error.strerror or error}; give another folder") from error
    keys = {name: spec.key for name, spec in models.items()}
    return Library(root, keys, tuple(sorted(tree)), perf_counter() - begin)


def _tree(models: dict[str, ModelSpec], built: BuiltLibrary, platform: Platform, target: str | None) -> Tree:
    content = _content(models, platform, target)
    pages = PAGES | (PORT_PAGES if content["port"] else {})
    texts = {path: render(name, content) for name, path in pages.items()}
    texts |= {f"include/{name}": text for name, text in built.public.items()}
    for model, files in built.sources.items():
        texts |= {f"{SHARE}/src/{model}/{name}": text for name, text in files.items()}
    tree: Tree = {path: text.encode() for path, text in texts.items()}
    tree |= {f"lib/{STATIC}": built.static.read_bytes(), platform.shared: built.shared.read_bytes()}
    imports = built.imports.read_bytes() if built.imports is not None else Link(built.shared.name)
    return tree | {platform.linker_name: imports}


def _content(models: dict[str, ModelSpec], platform: Platform, target: str | None) -> dict[str, Any]:
    """What the templates need."""
    from msfp_gen.generator import declarations
    from msfp_gen.generator.header import public_header, word_enums  # it imports SymPy

    modules = [
        {
            "name": name,
            "layout": spec.layout,
            "effects": effects_text(spec),
            "surface": [value.name for value in surface_values(spec)],
            "example": values.example(spec),
            "interface": values.interface(),
        }
        for name, spec in models.items()
    ]
    return {
        "stamp": f"written by msfp-gen {__version__}",
        "version": __version__,
        "abi": ABI_VERSION,
        "models": modules,
        "port": next((module for module, spec in zip(modules, models.values(), strict=True) if _has_ports(spec)), None),
        "body": contract.names(contract.BODY),
        "top": contract.names(contract.TOP),
        "words": word_enums(),
        "types": declarations.fortran(public_header()),
        "errors": CALL_ERRORS,
        "static": STATIC,
        "platform": platform,
        "target": target,
        "flags": " ".join(FLAGS["c"]),
        "values": values,
    }


def _has_ports(spec: ModelSpec) -> bool:
    """Whether the example of a two-port runs with this model: one without uplift, which starts without separations."""
    effects = spec.effects
    spatial = effects.dimension == "spatial" and effects.spin == "locked"
    return spatial and effects.top_rotation and not effects.uplift
