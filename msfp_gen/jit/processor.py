"""The processor of this machine, as far as the C code of models depends on it.

A model in the cache is compiled for the vectors of one processor, and the level of that processor is part of its key:
machines that share a cache do not use each other's models unless they can. `msfp-gen generate -o` compiles for all.
"""

from __future__ import annotations

import platform
from collections.abc import Sequence
from pathlib import Path

CPUINFO = Path("/proc/cpuinfo")
# Level of x86-64 -> the flags that Linux reports for what it adds to the level below (x86-64 psABI, table 3.1).
LEVELS = {
    2: "cx16 lahf_lm popcnt pni sse4_1 sse4_2 ssse3",
    3: "abm avx avx2 bmi1 bmi2 f16c fma movbe xsave",
    4: "avx512bw avx512cd avx512dq avx512f avx512vl",
}


def x86_64_level() -> int | None:
    """Level of this processor, 1 to 4; None if it is not an x86-64 or does not say."""
    if platform.machine() != "x86_64":
        return None
    try:
        lines = CPUINFO.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return None
    flags = next((set(line.partition(":")[2].split()) for line in lines if line.startswith("flags")), None)
    if flags is None:
        return None
    reached = 1
    for level, needed in LEVELS.items():
        if not flags.issuperset(needed.split()):
            break
        reached = level
    return reached


def processor_flags(user: Sequence[str] = ()) -> tuple[str, ...]:
    """Flags with which C code is compiled for this processor alone.

    None where the processor is not known, or where `user`, the user's own flags, select one, as -march=native does.
    """
    level = x86_64_level()
    if level is None or any(flag.startswith("-m") for flag in user):
        return ()
    return (f"-DMSFP_X86_64_LEVEL={level}",)
