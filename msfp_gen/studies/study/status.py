"""How far a study has come: read from the parts in its folder, while it runs and afterwards, on any machine."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from msfp_gen.common.tables import Table
from msfp_gen.studies.study.chunks import parts_in, readable_parts, study_table

RECENT = 50  # newest parts from which the rate is measured
IDLE = 10  # times the mean interval between parts, after which a study counts as not running


@dataclass(frozen=True)
class Status:
    """How far a study has come.

    Attributes:
        name: of the study.
        runs, done, failed: numbers of runs: all, in parts, and of these not ended with `ok` or `stopped`.
        parts, chunks: numbers of parts that are written, and of all.
        rate: runs per second over the newest parts [1/s]; None with fewer than two parts, or where they are of one
            moment.
        running: whether parts still appear at that rate.
        seconds_left: time left at that rate [s]; None where it is not known.
    """

    name: str
    runs: int
    done: int
    failed: int
    parts: int
    chunks: int
    rate: float | None
    running: bool
    seconds_left: float | None

    def as_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON."""
        return asdict(self)


def study_status(folder: str | Path) -> Status:
    """How far the study in a folder has come. Raises InputError where there is none."""
    folder = Path(folder)
    table = study_table(folder)
    runs, chunk = table["about"]["runs"], table["about"]["chunk"]
    parts = parts_in(folder)
    written = {name: min(chunk, runs - number * chunk) for name, number in parts.items()}
    done = sum(written.values())
    rate, running = _rate(folder, written)
    return Status(
        name=str(table.get("name", "")),
        runs=runs,
        done=done,
        failed=sum(failures(folder / name) for name in parts),
        parts=len(parts),
        chunks=-(-runs // chunk),
        rate=rate,
        running=running and done < runs,
        seconds_left=None if rate is None else (runs - done) / rate,
    )


def _rate(folder: Path, written: dict[str, int]) -> tuple[float | None, bool]:
    """Runs per second over the newest parts, and whether the newest one is recent."""
    times = sorted(((folder / name).stat().st_mtime, count) for name, count in written.items())
    times = _without_pauses(times[-RECENT - 1 :])
    if len(times) < 2 or not (span := times[-1][0] - times[0][0]):
        return None, False
    between = span / (len(times) - 1)
    return sum(count for _, count in times[1:]) / span, time.time() - times[-1][0] < max(IDLE * between, IDLE)


def _without_pauses(times: list[tuple[float, int]]) -> list[tuple[float, int]]:
    """The parts since the last pause, such as that between two calls of a study."""
    gaps = [after - before for (before, _), (after, _) in pairwise(times)]
    if not gaps:
        return times
    longest = IDLE * max(float(np.median(gaps)), 1.0)
    return times[max((index + 1 for index, gap in enumerate(gaps) if gap > longest), default=0) :]


def failures(part: Path) -> int:
    """The number of failed runs of a part. Raises InputError where it is damaged."""
    import pyarrow.parquet as pq

    with readable_parts(part):
        return int((pq.read_schema(part).metadata or {})[b"failed"])


def status_table(found: Status) -> Table:
    """The status for a terminal."""
    rows = [
        ("runs", f"{found.done} of {found.runs} done ({100 * found.done / found.runs:.1f} %)"),
        ("failed", f"{found.failed}; see the columns status and message" if found.failed else "0"),
        ("parts", f"{found.parts} of {found.chunks}"),
    ]
    if found.rate is not None:
        rows.append(("rate", f"{found.rate:.3g} runs per second"))
    if found.done == found.runs:
        rows.append(("state", "complete"))
    elif found.running and found.seconds_left is not None:
        rows.append(("state", f"running, {found.seconds_left:.0f} s left"))
    else:
        rows.append(("state", "not running; the same command continues it"))
    return Table(found.name or "study", (), rows)
