"""README.md, Makefile and example.c of a folder that `msfp-gen generate -o` writes.

All tables come from the contract between Python and C, so they hold for the model in the folder.
"""

from __future__ import annotations

from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msfp_gen.common.output import write_bytes
from msfp_gen.embedding import values
from msfp_gen.errors import InputError
from msfp_gen.jit.compiler import FLAGS
from msfp_gen.specification import contract, rows
from msfp_gen.specification.friction_laws import NUMBERS
from msfp_gen.version import __version__

if TYPE_CHECKING:
    from msfp_gen.specification.layout import ModelSpec

GUIDE = ("README.md", "Makefile", "example.c")
STAMP = "written by msfp-gen"  # in the first line of each: a file without it belongs to the user
# Headers of the runtime that only its own sources include.
PRIVATE = ("equations.h", "steppers.h", "run.h", "port.h")
PUBLIC = ("msfp_model.h", "msfp_kernels.h", "msfp_runtime.h")
PYTHON_ONLY = ("msfp_module.c", "example.c")  # C files that are no part of the library
HIDDEN = "-fvisibility=hidden"  # for the Python module; a library for C shows its functions


def check_guide(folder: Path) -> None:
    """Raise InputError where `folder` has a file of the same name as one of the guide that msfp-gen did not write."""
    for name in GUIDE:
        path = folder / name
        if path.exists() and STAMP not in _first_line(path):
            raise InputError(
                f"output folder {folder}: msfp-gen did not write {name}: move it away or name another folder"
            )


def write_guide(spec: ModelSpec, folder: Path, module: str) -> list[Path]:
    """Write README.md, Makefile and example.c into a folder of generated sources; returns their paths.

    module: name of the Python module in the folder. Raises InputError as `check_guide`.
    """
    from jinja2 import Environment, StrictUndefined

    check_guide(folder)
    # `[[ ]]` and `[% %]` leave the braces of C and of Make alone.
    environment = Environment(
        undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True,
        block_start_string="[%", block_end_string="%]", variable_start_string="[[", variable_end_string="]]",
        comment_start_string="[#", comment_end_string="#]",
    )  # fmt: skip
    environment.filters["c"] = _number
    content = _content(spec, folder, module)
    written = []
    for name in GUIDE:
        text = files(__package__).joinpath("assets", f"{name}.jinja").read_text(encoding="utf-8")
        write_bytes(folder / name, [environment.from_string(text).render(content).encode()])
        written.append(folder / name)
    return written


def _content(spec: ModelSpec, folder: Path, module: str) -> dict[str, Any]:
    sources = sorted(path.name for path in folder.glob("*.c") if path.name not in PYTHON_ONLY)
    return {
        "stamp": f"{STAMP} {__version__} for {spec.key}",
        "spec": spec,
        "module": module,
        "sources": sources,
        "public": PUBLIC,
        "private": PRIVATE,
        "flags": " ".join(flag for flag in FLAGS["c"] if flag != HIDDEN),
        "body": contract.BODY,
        "surface": _surface_values(spec),
        "top": contract.TOP,
        "row": rows.row(spec.effects),
        "works": contract.WORKS,
        "kinds": contract.EVENT_KINDS,
        "counters": contract.COUNTERS,
        "methods": contract.METHODS,
        "monitors": contract.MONITORS,
        "statuses": [replace(s, failure=_in_c(s.failure)) for s in contract.STATUSES if s.compiled],
        "example": values.example(spec),
        "values": values,
    }


def _surface_values(spec: ModelSpec) -> list[contract.Value]:
    """The values of a surface, those of its friction law included, in order."""
    known = {value.name: value for value in (*contract.SURFACE, *contract.SURFACE_UPLIFT)}
    laws = {name: contract.Value(name, unit, meaning) for name, (unit, meaning) in NUMBERS.items()}
    return [(known | laws)[name] for name in contract.surface_values(spec.effects)]


def _in_c(text: str) -> str:
    """A remedy in the words of the folder: without pages that are not there, `options` in place of `solver`."""
    return text.replace(" (docs/model.md)", "").replace("solver.", "options.")


def _number(value: float) -> str:
    """A number as C reads it: with a point or an exponent."""
    text = repr(float(value))
    return text.replace("e+0", "e").replace("e-0", "e-")


def _first_line(path: Path) -> str:
    with path.open(encoding="utf-8", errors="replace") as file:
        return file.readline()
