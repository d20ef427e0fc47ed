"""How far a study has come: read from the parts in its folder, while it runs and afterwards, on any machine."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from msfp_gen.common.tables import Table
from msfp_gen.studies.study.chunks import STUDY_FILE, parts_in, readable_parts, study_table

IDLE = 3  # times the longest interval between parts, after which a study counts as not running
LEAST_IDLE = 10.0  # that time at least [s]


@dataclass(frozen=True)
class Status:
    """How far a study has come.

    Attributes:
        name: of the study.
        runs, done, failed: numbers of runs: all, in parts, and of these not ended with `ok` or `stopped`.
        parts, chunks: numbers of parts that are written, and of all.
        rate: runs per second since the study was last started, on all its workers [1/s]; None before the first part.
        running: whether parts still appear.
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
    """Runs per second since the study was last started, and whether parts still appear.

    Workers end their chunks in bunches, so that the time between two parts says nothing: the rate counts from the
    start, which is the time of `study.toml`.
    """
    begin = (folder / STUDY_FILE).stat().st_mtime
    stamps = ((folder / name).stat().st_mtime for name in written)
    times = sorted((stamp, count) for stamp, count in zip(stamps, written.values(), strict=True) if stamp > begin)
    if not times:
        return None, False
    ends = [begin, *(stamp for stamp, _ in times)]
    longest = max(after - before for before, after in pairwise(ends))
    rate = sum(count for _, count in times) / (ends[-1] - begin)
    return rate, time.time() - ends[-1] < max(IDLE * longest, LEAST_IDLE)


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
    elif found.rate is None and found.parts < found.chunks:
        rows.append(("state", "no part since it was started; the same command continues it if it stopped"))
    else:
        rows.append(("state", "not running; the same command continues it"))
    return Table(found.name or "study", (), rows)
