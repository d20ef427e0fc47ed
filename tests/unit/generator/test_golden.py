"""Five emitted kernels, byte by byte as in tests/golden: a change of what is emitted is seen, and is made on purpose.

After an intended change of the generator or the templates: `pytest tests/unit/generator/test_golden.py --update`, then
read the difference in git. SymPy orders terms differently from one minor version to the next, so the kernels hold for
one of them, which `tests/golden/sympy-version` names; with another the comparison is skipped.
"""

from __future__ import annotations

import difflib
import re
from functools import cache
from itertools import islice

import pytest
import sympy
from support import ROOT

from msfp_gen import Effects, Layout
from msfp_gen.generator import generate
from msfp_gen.specification.layout import ModelSpec

GOLDEN = ROOT / "tests" / "golden"
SYMPY = GOLDEN / "sympy-version"
PLANAR = ModelSpec(Layout(2, 1, 0), Effects(dimension="planar"))
SPATIAL = ModelSpec(Layout(5, 2, 2), Effects(friction="velocity"))
KERNELS = {  # one of each kind
    "msfp_angular_balance": SPATIAL,  # values
    "msfp_surface_local_by_variables": SPATIAL,  # derivatives by the variables of a step
    "msfp_contact_lanes": SPATIAL,  # all surfaces at once, with a friction law
    "msfp_contact_jacobian": PLANAR,  # the same with the matrix of derivatives
    "msfp_forward": PLANAR,  # what a vertical plane leaves of the kinematics
}
INTERFACE = "msfp.h"  # the same for every model
SHOWN = 60  # lines of a difference


@cache
def emitted(spec: ModelSpec, file: str) -> str:
    return generate(spec).files[file]


def kernel(name: str) -> str:
    """A kernel with the lines that belong to it above."""
    text = emitted(KERNELS[name], "msfp_schedule.h" if name.endswith("_by_variables") else "msfp_kernels.h")
    match = re.search(rf"(?:^[^}}\n][^\n]*\n)*^static inline void {name}\(.*?^}}\n", text, re.MULTILINE | re.DOTALL)
    assert match is not None
    return match[0]


def difference(old: str, new: str) -> str:
    """What changed, as `diff -u` shows it; empty if nothing did."""
    lines = difflib.unified_diff(old.splitlines(), new.splitlines(), "golden", "generated", "", "", 1, "")
    return "\n".join(islice(lines, SHOWN))


@pytest.mark.parametrize("name", KERNELS)
def test_emitted_kernels_are_the_golden_ones(name: str, update: bool) -> None:
    path, text = GOLDEN / f"{name}.h", kernel(name)
    if update:
        path.write_bytes(text.encode())
        SYMPY.write_text(f"{sympy.__version__}\n", encoding="utf-8")
        return
    golden_version = SYMPY.read_text(encoding="utf-8").strip()
    if golden_version.split(".")[:2] != sympy.__version__.split(".")[:2]:
        pytest.skip(f"golden kernels are of SymPy {golden_version}, this is {sympy.__version__}")
    golden = path.read_bytes()
    assert golden == text.encode(), (
        f"{path.relative_to(ROOT)} is not what the generator emits now. If this change is intended, run "
        f"pytest {__file__.removeprefix(f'{ROOT}/')} --update and read the difference in git.\n"
        f"{difference(golden.decode(), text)}"
    )


def test_a_change_of_the_public_header_raises_its_version(update: bool) -> None:
    """A program that was compiled with an earlier header must see that the table of functions is another."""
    path, text = GOLDEN / INTERFACE, emitted(PLANAR, INTERFACE)
    if update:
        path.write_bytes(text.encode())
        return
    golden = path.read_text(encoding="utf-8")
    assert golden == text, (
        "msfp.h changed: if a compiled program notices, raise ABI_VERSION in generator/interface.py and the Fortran "
        f"module with it; then run pytest with --update\n{difference(golden, text)}"
    )
