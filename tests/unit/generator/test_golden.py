"""The emitted public header, as in tests/golden: a change of what programs in C compile against is made on purpose.

After an intended change: `pytest tests/unit/generator/test_golden.py --update`, then read the difference in git.
"""

from __future__ import annotations

import difflib
from itertools import islice

from support import ROOT

from msfp_gen import Effects, Layout
from msfp_gen.generator import generate
from msfp_gen.specification.layout import ModelSpec

HEADER = ROOT / "tests" / "golden" / "msfp.h"  # the same for every model
SHOWN = 60  # lines of a difference


def test_a_change_of_the_public_header_raises_its_version(update: bool) -> None:
    """A program that was compiled with an earlier header must see that the table of functions is another."""
    text = generate(ModelSpec(Layout(2, 1, 0), Effects(dimension="planar"))).files["msfp.h"]
    if update:
        HEADER.write_bytes(text.encode())
        return
    golden = HEADER.read_text(encoding="utf-8")
    lines = difflib.unified_diff(golden.splitlines(), text.splitlines(), "golden", "generated", "", "", 1, "")
    assert golden == text, (
        "msfp.h changed: if a compiled program notices, raise ABI_VERSION in generator/interface.py and the Fortran "
        "module with it; then run pytest with --update\n" + "\n".join(islice(lines, SHOWN))
    )
