"""The C library of `export`: its folder, its example and headers from templates; the README of a generated folder."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from time import perf_counter
from typing import Any

from msfp_gen.common.errors import CompileError, InputError
from msfp_gen.common.output import write_bytes
from msfp_gen.common.version import __version__
from msfp_gen.embedding import fortran, values
from msfp_gen.generator.interface import ABI_VERSION, CALL_ERRORS, effects_text, model_name, surface_values
from msfp_gen.jit.build import ENTRY
from msfp_gen.jit.compiler import FLAGS
from msfp_gen.jit.library import STATIC, BuiltLibrary, Platform, build_library, find_platform
from msfp_gen.specification import contract
from msfp_gen.specification.layout import ModelSpec

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
    `msfp_gen.jit.library.TARGETS`; None: this machine. Raises InputError: two models of one layout, an
    unknown target, a prefix that is no folder or holds files of the user under these names; CompileError. Nothing is
    written after an error.
    """
    begin, root, platform = perf_counter(), Path(prefix).absolute(), find_platform(target)
    models = {model_name(spec): spec for spec in specs}
    if len(models) < len(specs):
        raise InputError(
            f"layouts = {', '.join(spec.layout.name.replace('_', ' ') for spec in specs)}: give each layout once; "
            "the layout gives its names in C"
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
    for model, sources in built.sources.items():
        texts |= {f"{SHARE}/src/{model}/{name}": text for name, text in sources.items()}
    tree: Tree = {path: text.encode() for path, text in texts.items()}
    tree |= {f"lib/{STATIC}": built.static.read_bytes(), platform.shared: built.shared.read_bytes()}
    imports = built.imports.read_bytes() if built.imports is not None else SymbolicLink(built.shared.name)
    return tree | {platform.linker_name: imports}


def _content(models: dict[str, ModelSpec], platform: Platform, target: str | None) -> dict[str, Any]:
    """What the templates need."""
    from msfp_gen.generator import interface
    from msfp_gen.generator.interface import public_header, word_enums  # it imports SymPy

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
        "types": fortran.types(public_header()),
        "interfaces": fortran.interfaces(public_header()),
        "functions": interface.functions(public_header()),
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


def render(name: str, content: dict[str, Any]) -> str:
    """Text of the template `assets/<name>.jinja`; a name that `content` lacks is an error."""
    from jinja2 import Environment, StrictUndefined

    environment = Environment(
        undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True,
        block_start_string="[%", block_end_string="%]", variable_start_string="[[", variable_end_string="]]",
        comment_start_string="[#", comment_end_string="#]",
    )  # fmt: skip
    environment.filters["c"] = _number
    environment.filters["fortran"] = _fortran_number
    environment.filters["fortran_list"] = _fortran_list
    text = files(__package__).joinpath("assets", f"{name}.jinja").read_text(encoding="utf-8")
    return environment.from_string(text).render(content)


def _number(value: float) -> str:
    """A number as C and Fortran read it: with a point or an exponent."""
    text = repr(float(value))
    return text.replace("e+0", "e").replace("e-0", "e-")


def _fortran_number(value: float) -> str:
    """A number of double precision."""
    text = _number(value)
    return text.replace("e", "d") if "e" in text else f"{text}d0"


def _fortran_list(values: Iterable[float]) -> str:
    """An array constructor, eight numbers on a line."""
    texts = [_fortran_number(value) for value in values]
    lines = [", ".join(texts[i : i + 8]) for i in range(0, len(texts), 8)]
    return "[real(c_double) :: " + ", &\n         ".join(lines) + "]"


MANIFEST = "share/msfp/manifest.json"


@dataclass(frozen=True)
class SymbolicLink:
    """A symbolic link to a file in the same folder."""

    to: str


Tree = dict[str, bytes | SymbolicLink]  # path below the prefix -> content


def check_prefix(prefix: Path) -> None:
    """Raise InputError if `prefix` is a file, cannot be written to, or has a damaged manifest."""
    existing = next(path for path in (prefix, *prefix.parents) if path.exists())
    if not existing.is_dir():
        raise InputError(f"--prefix = {str(prefix)!r}: {existing} is a file; give a folder")
    if not os.access(existing, os.W_OK):
        raise InputError(f"--prefix = {str(prefix)!r}: {existing} cannot be written to; give another folder")
    _written(prefix)


def install(tree: Tree, prefix: Path) -> None:
    """Write the files below `prefix`, each in one rename, and delete what only an earlier export wrote.

    Raises InputError, and writes nothing, where a file of the user has the name of one of them.
    """
    written = _written(prefix)
    digests = {name: _digest_of(content) for name, content in tree.items()}
    for name, digest in digests.items():
        if (present := _digest_at(prefix / name)) is not None and present not in (digest, *written.get(name, ())):
            raise InputError(
                f"--prefix = {str(prefix)!r}: {name} is not as msfp-gen wrote it: move it away or give another folder"
            )
    # While files are replaced the old and the new ones are ours, so that an export that was stopped can be repeated.
    names = sorted({*written, *digests})
    _write_manifest(prefix, {name: [*written.get(name, ()), *filter(None, [digests.get(name)])] for name in names})
    for name, content in tree.items():
        _put(prefix / name, content)
    for name in set(written) - set(tree):
        if _digest_at(prefix / name) in written[name]:
            _remove(prefix, name)
    _write_manifest(prefix, {name: [digest] for name, digest in sorted(digests.items())})


def _written(prefix: Path) -> dict[str, list[str]]:
    """Files that msfp-gen wrote below a prefix, with their digests; of none where there is no manifest."""
    path = prefix / MANIFEST
    try:
        files = dict(json.loads(path.read_text(encoding="utf-8"))["files"])
        if all(_inside(name) and isinstance(digests, list) for name, digests in files.items()):
            return files
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        pass
    raise InputError(
        f"--prefix = {str(prefix)!r}: {MANIFEST} is damaged; give another folder, or delete it with its files"
    )


def _inside(name: str) -> bool:
    """Whether a path of a manifest stays below the prefix."""
    path = Path(name)
    return not path.is_absolute() and ".." not in path.parts


def _write_manifest(prefix: Path, files: dict[str, list[str]]) -> None:
    path = prefix / MANIFEST
    path.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(path, [json.dumps({"files": files}, indent=1).encode() + b"\n"])


def _digest_of(content: bytes | SymbolicLink) -> str:
    return f"link to {content.to}" if isinstance(content, SymbolicLink) else hashlib.sha256(content).hexdigest()


def _digest_at(path: Path) -> str | None:
    """Digest of what lies at a path; None where there is nothing."""
    if path.is_symlink():
        return f"link to {path.readlink()}"
    if not path.exists():
        return None
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "no file"


def _put(path: Path, content: bytes | SymbolicLink) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(content, bytes):
        write_bytes(path, [content])
    elif _digest_at(path) != _digest_of(content):
        path.unlink(missing_ok=True)
        path.symlink_to(content.to)


def _remove(prefix: Path, name: str) -> None:
    """Delete a file, and the folders that are then empty."""
    (prefix / name).unlink()
    with suppress(OSError):  # not empty
        for parent in Path(name).parents[:-1]:
            (prefix / parent).rmdir()


README = "README.md"
WRAPPER = ("msfp_module.pyx", ENTRY, "msfp.h")  # of the generated folder, which have a row of their own
STAMP = "written by msfp-gen"  # in the first line: a file without it belongs to the user


def check_guide(folder: Path) -> None:
    """Raise InputError where `folder` has a README.md that msfp-gen did not write."""
    path = folder / README
    if path.exists() and STAMP not in _first_line(path):
        raise InputError(
            f"output folder {folder}: msfp-gen did not write {README}: move it away or name another folder"
        )


def write_guide(spec: ModelSpec, folder: Path, module: str) -> Path:
    """Write README.md into a folder of generated sources; returns its path.

    module: name of the Python module in the folder. Raises InputError as `check_guide`.
    """
    check_guide(folder)
    write_bytes(folder / README, [render("generated.md", _guide_content(spec, folder, module)).encode()])
    return folder / README


def _guide_content(spec: ModelSpec, folder: Path, module: str) -> dict[str, Any]:
    from msfp_gen.generator.derive import derive
    from msfp_gen.generator.drivers import operations

    return {
        "stamp": f"{STAMP} {__version__} for {spec.key}",
        "spec": spec,
        "effects": effects_text(spec),
        "module": module,
        "derived": sorted({path.name for path in (folder / "derived").glob("*")} - {f"{module}.h"}),
        "runtime": sorted(path.name for path in (folder / "runtime").glob("*") if path.name not in WRAPPER),
        "operations": operations(derive(spec)),
        "example": values.example(spec),
        "planar": spec.effects.dimension == "planar",
        "body": contract.BODY,
        "surface": surface_values(spec),
        "top": contract.TOP,
        "row": contract.row(spec.effects),
        "works": contract.WORKS,
        "kinds": contract.EVENT_KINDS,
        "statuses": [status for status in contract.STATUSES if status.compiled],
    }


def _first_line(path: Path) -> str:
    with path.open(encoding="utf-8", errors="replace") as file:
        return file.readline()
