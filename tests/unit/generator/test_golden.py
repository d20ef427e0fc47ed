"""The emitted headers of two models, byte by byte as in tests/golden: a change of them is seen, and is made on purpose.

After an intended change of the generator or the templates: `pytest tests/unit/generator/test_golden.py --update`, then
read the difference in git. SymPy orders terms differently from one minor version to the next, so the files hold for
one of them, which `tests/golden/sympy-version` names; with another the comparison is skipped.
"""

from __future__ import annotations

import difflib
from itertools import islice

import pytest
import sympy
from support import ROOT

from msfp_gen import Effects, Layout
from msfp_gen.generator import generate
from msfp_gen.specification.layout import ModelSpec

GOLDEN = ROOT / "tests" / "golden"
SYMPY = GOLDEN / "sympy-version"
MODELS = {
    "single-planar": ModelSpec(Layout(2, 1, 0), Effects(dimension="planar")),
    "triple-spatial-velocity": ModelSpec(Layout(5, 2, 2), Effects(friction="velocity")),
}
FILES = ("msfp_kernels.h", "msfp_model.h")
INTERFACE = "msfp.h"  # the same for every model
SHOWN = 60  # lines of a difference


def minor(version: str) -> list[str]:
    return version.strip().split(".")[:2]


def difference(old: str, new: str) -> str:
    """What changed, as `diff -u` shows it; empty if nothing did."""
    lines = difflib.unified_diff(old.splitlines(), new.splitlines(), "golden", "generated", "", "", 1, "")
    return "\n".join(islice(lines, SHOWN))


@pytest.mark.parametrize("name", MODELS)
def test_emitted_headers_are_the_golden_ones(name: str, update: bool) -> None:
    files = generate(MODELS[name]).files
    folder = GOLDEN / name
    if update:
        folder.mkdir(parents=True, exist_ok=True)
        for file in FILES:
            (folder / file).write_bytes(files[file].encode())
        SYMPY.write_text(f"{sympy.__version__}\n", encoding="utf-8")
        return
    known = SYMPY.read_text(encoding="utf-8")
    if minor(known) != minor(sympy.__version__):
        pytest.skip(f"golden files are of SymPy {known.strip()}, this is {sympy.__version__}")
    for file in FILES:
        golden = (folder / file).read_bytes()
        assert golden == files[file].encode(), (
            f"{folder.relative_to(ROOT) / file} is not what the generator emits now. If this change is intended, run "
            f"pytest {__file__.removeprefix(f'{ROOT}/')} --update and read the difference in git.\n"
            f"{difference(golden.decode(), files[file])}"
        )


def test_a_change_of_the_public_header_raises_its_version(update: bool) -> None:
    """A program that was compiled with an earlier header must see that the table of functions is another."""
    path, text = GOLDEN / INTERFACE, generate(MODELS["single-planar"]).files[INTERFACE]
    if update:
        path.write_bytes(text.encode())
        return
    golden = path.read_text(encoding="utf-8")
    assert golden == text, (
        "msfp.h changed: if a compiled program notices, raise ABI_VERSION in generator/interface.py and the Fortran "
        f"module with it; then run pytest with --update\n{difference(golden, text)}"
    )
