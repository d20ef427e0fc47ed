"""Recorded ground motions: reading, correction, scaling and response spectra; two records come with the package."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files
from os import PathLike
from pathlib import Path

from msfp_gen.common.errors import InputError
from msfp_gen.motions.checks import positive
from msfp_gen.motions.records import cosmos, csmip, csv_table, headerless, knet, peer
from msfp_gen.motions.records.correction import Corrected, baseline_corrected, strong_window, uncorrected
from msfp_gen.motions.records.csv_table import RecordTable, read_table, write_csv
from msfp_gen.motions.records.peer import read_peer
from msfp_gen.motions.records.record import Channel, Record, assemble_record
from msfp_gen.motions.records.scaling import ScaledSuite, ScaleTo, asce7_spectrum, prepared, scaled_suite
from msfp_gen.motions.records.spectrum import Spectrum, response_spectrum
from msfp_gen.motions.records.text import Lines, lines_of, read_lines

__all__ = [
    "BUNDLED",
    "Corrected",
    "Record",
    "RecordTable",
    "ScaleTo",
    "ScaledSuite",
    "Spectrum",
    "asce7_spectrum",
    "baseline_corrected",
    "bundled",
    "prepared",
    "read_peer",
    "read_record",
    "read_table",
    "response_spectrum",
    "scaled_suite",
    "strong_window",
    "uncorrected",
    "write_csv",
]


@dataclass(frozen=True)
class _Format:
    """A file format of channels."""

    # name: name of the format.
    # matches: whether a file has this format.
    # read: reads the channels of a file.
    # notes: notes for every record of this format.

    name: str
    matches: Callable[[Lines], bool]
    read: Callable[[Lines], list[Channel]]
    notes: tuple[str, ...] = ()


_FORMATS = (
    _Format(csmip.FORMAT, csmip.matches, csmip.read),
    _Format(cosmos.FORMAT, cosmos.matches, cosmos.read),
    _Format(knet.FORMAT, knet.matches, knet.read, (knet.NOTE,)),
    _Format(peer.FORMAT, peer.matches, peer.read),
)
BUNDLED = ("ridgecrest-2019-ci-ccc", "ridgecrest-2019-ci-clc")


def read_record(
    path: str | PathLike[str], *more: str | PathLike[str], unit: str | None = None, time_step: float | None = None
) -> Record:
    """Read a record from one file, or from several files of one recording.

    The format is recognised from the content: CSMIP and COSMOS V1 and V2, PEER .AT2, .VT2 and .DT2, K-NET and KiK-net,
    and CSV with units in its header (docs/motion.md). Files compressed by gzip are decompressed. The components are
    assigned to E1, E2, E3 by their azimuths, in a right-handed frame; where a file has none, by the order of the files.

    Args:
        path: of the file.
        *more: of further files of the recording.
        unit: of the numbers in files without a header.
        time_step: between the rows of files without a header and without a column of times [s].

    Raises:
        InputError: the format is unknown, the data are damaged, or the files are not of one recording. The message
            names file, line and reason. Or unit or time_step is given for files that state them.
    """
    if time_step is not None:
        positive("time_step", time_step)
    return _record_of([read_lines(Path(p)) for p in (path, *more)], unit, time_step)


def _record_of(parts: list[Lines], unit: str | None = None, time_step: float | None = None) -> Record:
    """The record in the lines of one file, or of several."""
    if all(map(headerless.matches, parts)) and _known(parts[0]) is None:
        return headerless.read(parts, unit, time_step)
    if len(parts) == 1 and csv_table.matches(parts[0]):
        _stated("CSV", parts[0], unit, time_step)
        return csv_table.read(parts[0])
    formats = [_format_of(lines) for lines in parts]
    for lines, kind in zip(parts, formats, strict=True):
        if kind is not formats[0]:
            raise InputError(
                f"{lines.path.name}: {kind.name}, but {parts[0].path.name} is {formats[0].name}; give one recording"
            )
    _stated(formats[0].name, parts[0], unit, time_step)
    channels = [channel for lines in parts for channel in formats[0].read(lines)]
    return assemble_record(channels, formats[0].name, formats[0].notes)


def _stated(kind: str, lines: Lines, unit: str | None, time_step: float | None) -> None:
    """Raise InputError where options are given for a file whose header has them."""
    for name, value in (("unit", unit), ("time_step", time_step)):
        if value is not None:
            raise InputError(f"{name} = {value!r}: {lines.path.name} is {kind}, whose header states it; leave it out")


def _known(lines: Lines) -> _Format | None:
    """Format of a file with a header; None where it has none that is known."""
    return next((file_format for file_format in _FORMATS if file_format.matches(lines)), None)


def _format_of(lines: Lines) -> _Format:
    """Format of a file. Raises InputError if it is unknown."""
    if (known := _known(lines)) is not None:
        return known
    names = ", ".join(file_format.name for file_format in _FORMATS)
    lines.fail(0, f"unknown format; give {names}, or one CSV with a header like: time [s], a1 [m/s^2]")


def bundled(name: str) -> Record:
    """A record of the package, one of `BUNDLED`. Its origin is stated in the README beside the files.

    Raises InputError for another name.
    """
    if name not in BUNDLED:
        raise InputError(f"bundled = {name!r}: no such record comes with the package; choose from {', '.join(BUNDLED)}")
    file = files(__package__) / "files" / f"{name}.v1.gz"
    return _record_of([lines_of(Path(file.name), file.read_bytes())])  # part of the package, and no input file
