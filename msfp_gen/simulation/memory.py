"""Memory of runs: what their rows need, what there is, and the refusal of runs that cannot fit.

All rows of a run lie in memory until its result is written. Rows at even times are counted before a run, and the least
number of steps where a longest step is given; rows are watched while a run goes on.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path

from msfp_gen.common.errors import InputError
from msfp_gen.results.history import ENERGY, LABELS, STACK, row_fields
from msfp_gen.scene.system import System

VARIABLE = "MSFP_GEN_MEMORY"  # environment variable: memory that this process may use [GB]
COPIES = 4  # of all rows at the end of a run, at most: in C, as arrays, joined over segments, and for a file
SMALL = 2**26  # rows that need no look at the memory [bytes]
GB = 1e9
_PROC, _CGROUP = Path("/proc"), Path("/sys/fs/cgroup")


def require_memory(systems: Sequence[System]) -> None:
    """Raise InputError where the rows of all runs, which are kept until the end, do not fit into memory.

    Rows of one bearing alone are counted; other systems have few rows. Scenes without `output_step` count with their
    longest step, which gives the least number of rows; without that they are not counted, since their steps are not
    known before.
    """
    counted = [system for system in systems if system.longest_row_step[0] < math.inf]
    needed = sum(map(_needed, counted))
    _of_variable()  # a wrong one is refused, however few rows there are
    if needed <= SMALL or needed <= (room := available()):
        return
    worst = max(counted, key=_needed)
    step, field = worst.longest_row_step
    enough = 1.05 * step * (needed / max(room, SMALL))  # more than the rounding of the message
    runs = f"{len(systems)} runs" if len(systems) > 1 else f"{worst.end / step:.1e} rows"
    remedy = f"give {'' if field == 'output_step' else 'an output_step of '}at least {enough:.2g} [s]"
    raise InputError(
        f"{field} = {step:g}: {runs} need {needed / GB:.3g} GB of memory and {max(room, 0.0) / GB:.3g} GB are "
        f"available; {remedy}, or a shorter duration"
    )


def outgrown(rows: int, surfaces: int) -> bool:
    """Whether a run with so many recorded rows must end, so that memory is left to make its result."""
    size = rows * row_size(surfaces)
    return size > SMALL and (COPIES - 1) * size > available()


@cache
def row_size(surfaces: int) -> int:
    """Size of one row of a result [bytes]."""
    sizes = dict.fromkeys(STACK, surfaces) | {name: len(labels) for name, labels in LABELS.items()}
    numbers = sum(math.prod(sizes[dim] for dim in rows.dims) for rows in row_fields().values()) + len(ENERGY)
    return 8 * numbers


def available() -> float:
    """Memory that this process can still take [bytes]; infinite where the system does not say.

    The least of what the machine has free, what the limits of its control group and of the process leave, and what
    MSFP_GEN_MEMORY leaves. Raises InputError where that variable is no positive number.
    """
    return min(_of_machine(), _of_group(), _of_process(), _of_variable())


def _needed(system: System) -> float:
    """Memory for the rows of a system that are known before [bytes]."""
    size = sum(row_size(bearing.layout.surfaces) for bearing in system.every_bearing)
    return COPIES * (1 + system.end / system.longest_row_step[0]) * size


def _of_machine() -> float:
    for line in _text(_PROC / "meminfo").splitlines():
        if line.startswith("MemAvailable:"):
            return 1024.0 * float(line.split()[1])
    with suppress(AttributeError, ValueError, OSError):  # another operating system: all of its memory
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    return math.inf


def _of_group() -> float:
    """Memory that the limit of a container leaves [bytes], by control groups 2 or 1; cached files count as free."""
    for folder, limit, usage, cached in (
        (_CGROUP, "memory.max", "memory.current", "inactive_file"),
        (_CGROUP / "memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
    ):
        with suppress(ValueError):  # no such file, or "max"
            free = float(_text(folder / limit)) - float(_text(folder / usage))
            files = dict(line.split() for line in _text(folder / "memory.stat").splitlines())
            return free + float(files.get(cached, 0.0))
    return math.inf


def _of_process() -> float:
    try:
        from resource import RLIM_INFINITY, RLIMIT_AS, getrlimit
    except ImportError:  # not on this system
        return math.inf
    limit = getrlimit(RLIMIT_AS)[0]
    return math.inf if limit == RLIM_INFINITY else limit - _own_size(0)


def _of_variable() -> float:
    """Memory that MSFP_GEN_MEMORY leaves [bytes]; infinite without it. Raises InputError where it is no number."""
    text = os.environ.get(VARIABLE, "").strip()
    if not text:
        return math.inf
    try:
        limit = float(text)
    except ValueError:
        limit = -1.0
    if not limit > 0:
        raise InputError(f"{VARIABLE} = {text!r}: give the memory that a process may use, a positive number [GB]")
    return limit * GB - _own_size(1)


def _own_size(field: int) -> float:
    """Size of this process [bytes]. field: 0 for its addresses, 1 for the memory that it occupies."""
    sizes = _text(_PROC / "self" / "statm").split()
    return float(sizes[field]) * os.sysconf("SC_PAGE_SIZE") if sizes else 0.0


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="ascii")
    except OSError:
        return ""
