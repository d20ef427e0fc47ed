"""How many runs a vector of this processor holds, and which models can go in lanes."""

from __future__ import annotations

import os
import platform
import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from msfp_gen.compiler import LANES, find_compiler
from msfp_gen.errors import InputError

if TYPE_CHECKING:
    from msfp_gen.layout import Effects

VARIABLE = "MSFP_GEN_LANES"
WORTH_IT = 4
"""Lanes from which a batch gains: two side by side take longer than one after the other (docs/performance.md)."""
# What a processor must say of itself for each width, as Linux names it: x86-64-v4, x86-64-v3, any.
NEEDED = {
    8: {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"},
    4: {"avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe"},
    2: set[str](),
}


@cache
def processor() -> frozenset[str]:
    """What the processor can do, in the words of Linux; empty where that cannot be read."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return frozenset()
    found = (line.partition(":")[2] for line in text.splitlines() if line.startswith("flags"))
    return frozenset(next(found, "").split())


def widths_here() -> tuple[int, ...]:
    """Runs side by side that this machine can hold, the most first; none where there are no lanes at all.

    Lanes need Linux on x86-64 (runs change stacks by its calling convention) and gcc (for its vectors).
    """
    if not sys.platform.startswith("linux") or platform.machine() not in ("x86_64", "AMD64"):
        return ()
    if "clang" in find_compiler().version.lower():
        return ()
    flags = processor()
    return tuple(width for width in LANES if NEEDED[width] <= flags and (width == 2 or NEEDED[4] <= flags))


def chosen_width(asked: int | None) -> int:
    """Lanes to use: as asked, else as `MSFP_GEN_LANES` says, else as wide as the processor has; 0: one at a time.

    Raises InputError for a width that there is not, or not here.
    """
    name, value = "lanes", asked
    if asked is None and (text := os.environ.get(VARIABLE, "").strip()):
        name, value = VARIABLE, int(text) if text.isdecimal() else -1
    here = widths_here()
    if value is None:
        return here[0] if here and here[0] >= WORTH_IT else 0
    if isinstance(value, bool) or not isinstance(value, int) or value not in (0, *LANES):
        given = os.environ[VARIABLE] if name == VARIABLE else value
        raise InputError(f"{name} = {given!r}: give 8, 4 or 2 runs side by side, or 0 for one at a time")
    if value and value not in here:
        found = ", ".join(map(str, here)) or "no lanes"
        raise InputError(f"{name} = {value}: this machine has {found}; give one of these, or 0 for one at a time")
    return value


def too_few(width: int) -> int:
    """As many runs as this go faster one at a time: most lanes would be empty (batch.h has the same)."""
    return width // 4 + 1


def alone_because(effects: Effects, method: str) -> str:
    """Why a model with these effects runs one at a time; empty where it goes in lanes."""
    if effects.uplift:
        return "bodies may part"
    if effects.law is not None:
        return "friction follows a law"
    return "dopri5 evaluates other equations" if method == "dopri5" else ""
