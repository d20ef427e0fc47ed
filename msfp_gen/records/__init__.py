"""Recorded ground motions: read, correct, cut; two real ones come with the package."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import as_file, files
from os import PathLike
from pathlib import Path

from msfp_gen.errors import InputError
from msfp_gen.records import at2, table, v1
from msfp_gen.records.at2 import read_at2
from msfp_gen.records.correction import Corrected, baseline_corrected, strong_window
from msfp_gen.records.record import Record
from msfp_gen.records.table import Table, read_table
from msfp_gen.records.text import Lines, read_lines

__all__ = [
    "BUNDLED",
    "Corrected",
    "Record",
    "Table",
    "baseline_corrected",
    "bundled",
    "read_at2",
    "read_record",
    "read_table",
    "strong_window",
]

_READERS: tuple[tuple[Callable[[Lines], bool], Callable[[Lines], Record]], ...] = (
    (v1.understands, v1.read),
    (at2.understands, at2.read),
    (table.understands, table.read),
)
BUNDLED = ("ridgecrest-2019-ci-ccc", "ridgecrest-2019-ci-clc")


def read_record(path: str | PathLike[str]) -> Record:
    """The record in a file, whose format is found from its content; gzip is unpacked.

    Known: COSMOS/CSMIP V1, PEER .AT2 (one component; `read_at2` joins three) and CSV with units in its header.
    Raises InputError naming file, line and reason for anything else, and for damaged data.
    """
    lines = read_lines(Path(path))
    for understands, read in _READERS:
        if understands(lines):
            return read(lines)
    lines.fail(0, "unknown format; give COSMOS/CSMIP V1, PEER .AT2, or CSV with a header like: time [s], a1 [m/s^2]")


def bundled(name: str) -> Record:
    """A record that comes with the package, one of `BUNDLED`: see the notice of origin beside the files."""
    if name not in BUNDLED:
        raise InputError(f"record: {name!r} does not come with the package; choose from {', '.join(BUNDLED)}")
    with as_file(files("msfp_gen.presets") / "records" / f"{name}.v1.gz") as path:
        return read_record(path)
