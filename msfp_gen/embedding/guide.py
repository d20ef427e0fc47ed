"""README.md of a folder that `msfp-gen generate -o` writes.

All tables come from the contract between Python and C, so they hold for the model in the folder.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from msfp_gen.common.output import write_bytes
from msfp_gen.embedding.rendering import render
from msfp_gen.errors import InputError
from msfp_gen.generator.interface import effects_text, surface_values
from msfp_gen.jit.build import ENTRY
from msfp_gen.specification import contract, rows
from msfp_gen.version import __version__

if TYPE_CHECKING:
    from msfp_gen.specification.layout import ModelSpec

README = "README.md"
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
    write_bytes(folder / README, [render("generated.md", _content(spec, folder, module)).encode()])
    return folder / README


def _content(spec: ModelSpec, folder: Path, module: str) -> dict[str, Any]:
    return {
        "stamp": f"{STAMP} {__version__} for {spec.key}",
        "spec": spec,
        "effects": effects_text(spec),
        "module": module,
        "sources": sorted(path.name for path in folder.glob("*.c") if path.name != ENTRY),
        "private": sorted({path.name for path in folder.glob("*.h")} - {"msfp.h", f"{module}.h"}),
        "body": contract.BODY,
        "surface": surface_values(spec),
        "top": contract.TOP,
        "row": rows.row(spec.effects),
        "works": contract.WORKS,
        "kinds": contract.EVENT_KINDS,
        "statuses": [status for status in contract.STATUSES if status.compiled],
    }


def _first_line(path: Path) -> str:
    with path.open(encoding="utf-8", errors="replace") as file:
        return file.readline()
