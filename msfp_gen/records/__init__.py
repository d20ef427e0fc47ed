"""Recorded ground motions: read, correct, scale, look at; two real ones come with the package."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import as_file, files
from os import PathLike
from pathlib import Path

from msfp_gen.errors import InputError
from msfp_gen.records import cosmos, csmip, knet, peer, table
from msfp_gen.records.channel import Channel, assembled
from msfp_gen.records.correction import Corrected, baseline_corrected, strong_window, uncorrected
from msfp_gen.records.peer import read_peer
from msfp_gen.records.record import Record
from msfp_gen.records.scaling import ScaleTo, asce7_spectrum, prepared
from msfp_gen.records.spectrum import Spectrum, response_spectrum
from msfp_gen.records.table import Table, read_table, write_csv
from msfp_gen.records.text import Lines, read_lines

__all__ = [
    "BUNDLED",
    "Corrected",
    "Record",
    "ScaleTo",
    "Spectrum",
    "Table",
    "asce7_spectrum",
    "baseline_corrected",
    "bundled",
    "prepared",
    "read_peer",
    "read_record",
    "read_table",
    "response_spectrum",
    "strong_window",
    "uncorrected",
    "write_csv",
]


@dataclass(frozen=True)
class _Form:
    """A file format of channels: its name, how to know it, how to read a file, what to say about every record."""

    name: str
    understands: Callable[[Lines], bool]
    read: Callable[[Lines], list[Channel]]
    notes: tuple[str, ...] = ()


_FORMS = (
    _Form(csmip.FORM, csmip.understands, csmip.read),
    _Form(cosmos.FORM, cosmos.understands, cosmos.read),
    _Form(knet.FORM, knet.understands, knet.read, (knet.NOTE,)),
    _Form(peer.FORM, peer.understands, peer.read),
)
BUNDLED = ("ridgecrest-2019-ci-ccc", "ridgecrest-2019-ci-clc")


def read_record(path: str | PathLike[str], *more: str | PathLike[str]) -> Record:
    """The record in a file, or in several of one recording; the format is found from the content, gzip is unpacked.

    Known: CSMIP and COSMOS V1 and V2, PEER .AT2, .VT2 and .DT2, K-NET and KiK-net, and CSV with units in its header
    (docs/data.md). Components find their place by their azimuths, in a right-handed frame; where a file has none, by
    the order of the files. Raises InputError naming file, line and reason for anything else, and for damaged data.
    """
    parts = [read_lines(Path(p)) for p in (path, *more)]
    if not more and table.understands(parts[0]):
        return table.read(parts[0])
    forms = [_form(lines) for lines in parts]
    for lines, form in zip(parts, forms, strict=True):
        if form is not forms[0]:
            raise InputError(
                f"{lines.path.name}: {form.name}, but {parts[0].path.name} is {forms[0].name}; give one recording"
            )
    channels = [channel for lines in parts for channel in forms[0].read(lines)]
    return assembled(channels, forms[0].name, forms[0].notes)


def _form(lines: Lines) -> _Form:
    for form in _FORMS:
        if form.understands(lines):
            return form
    names = ", ".join(form.name for form in _FORMS)
    lines.fail(0, f"unknown format; give {names}, or one CSV with a header like: time [s], a1 [m/s^2]")


def bundled(name: str) -> Record:
    """A record that comes with the package, one of `BUNDLED`: see the notice of origin beside the files."""
    if name not in BUNDLED:
        raise InputError(f"record: {name!r} does not come with the package; choose from {', '.join(BUNDLED)}")
    with as_file(files("msfp_gen.presets") / "records" / f"{name}.v1.gz") as path:
        return read_record(path)
