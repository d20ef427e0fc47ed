"""Lines and numbers of a text file, with errors that name file, line and reason."""

from __future__ import annotations

import gzip
import re
import zlib
from pathlib import Path
from typing import NoReturn

import numpy as np

from msfp_gen.errors import InputError
from msfp_gen.piecewise import Array

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_LARGEST = 1e100  # of what a record holds in any unit; conversions must not overflow
_MOST = 256 << 20  # bytes of text, unpacked
_GZIP = b"\x1f\x8b"
_DOS_END = b"\x1a"  # fills the last block of files from old systems


class Lines:
    """The lines of one file; `fail` raises an InputError that says where."""

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self.lines = text.splitlines()

    def __len__(self) -> int:
        return len(self.lines)

    def __getitem__(self, index: int) -> str:
        """The line at `index`, counted from zero; a file that ends too early fails."""
        if index >= len(self.lines):
            self.fail(len(self.lines) - 1, "the file ends here, truncated; fetch it again")
        return self.lines[index]

    def fail(self, index: int, reason: str) -> NoReturn:
        """Raise InputError for the line at `index` (counted from zero; people count from one)."""
        raise InputError(f"{self.path.name}, line {index + 1}: {reason}")

    def number(self, index: int, field: str) -> float:
        """`field`, text of the line at `index`, as a finite number."""
        text = field.strip()
        value = float(text) if _NUMBER.fullmatch(text) else np.nan
        if not abs(value) < _LARGEST:
            self.fail(index, f"{text[:24]!r} is not a finite number; repair or cut the data")
        return value

    def numbers(self, index: int, fields: list[str]) -> list[float]:
        """Several fields of one line as finite numbers."""
        return [self.number(index, field) for field in fields]

    def positive(self, index: int, what: str, field: str) -> float:
        """`field` as a number above zero."""
        value = self.number(index, field)
        if value <= 0:
            self.fail(index, f"{what} is {field.strip()}; it must be positive")
        return value

    def block(self, top: int, points: int, layout: tuple[int, int]) -> tuple[Array, int]:
        """`points` numbers from the line at `top` on, and the index of the line after them.

        `layout` is (columns a line, characters a column), as in a Fortran format: neighbours may touch, so columns
        are cut, not split at blanks.
        """
        per_line, width = layout
        if not (points and per_line and width):
            self.fail(top - 1, f"{points} points in {per_line} columns of width {width}; nothing to read")
        values: list[float] = []
        index = top
        while len(values) < points:
            row = self[index].rstrip()
            want = min(per_line, points - len(values))
            if len(row) != want * width:
                self.fail(index, f"{want} columns of width {width} expected after {len(values)} of {points} points")
            values += self.numbers(index, [row[i : i + width] for i in range(0, len(row), width)])
            index += 1
        return column(values), index


def read_lines(path: Path) -> Lines:
    """The lines of a text file, unpacked if it is gzip, in UTF-8 or Latin-1."""
    try:
        if path.exists() and not path.is_file():
            raise InputError(f"{path.name}: no file but a folder, pipe or device; give the path of a record")
        with path.open("rb") as file:
            content = file.read(_MOST + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path.name}: cannot be read ({reason}); check the path") from None
    if content.startswith(_GZIP) and len(content) <= _MOST:
        try:
            with gzip.open(path) as packed:
                content = packed.read(_MOST + 1)
        except (OSError, EOFError, zlib.error):
            raise InputError(f"{path.name}: damaged gzip data; fetch it again") from None
    if len(content) > _MOST:
        raise InputError(f"{path.name}: more than {_MOST >> 20} MiB of text; no record is that long, give another file")
    content = content.rstrip(_DOS_END)
    if not content.strip():
        raise InputError(f"{path.name}: the file is empty; give a record")
    if b"\0" in content:
        raise InputError(f"{path.name}: a binary file; give a text file of a known format (docs/data.md)")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    return Lines(path, text)


def column(values: list[float]) -> Array:
    """Numbers as an array."""
    return np.array(values, dtype=np.float64)
