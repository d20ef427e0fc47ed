"""Lines and numbers of a text file; errors name file, line and reason."""

from __future__ import annotations

import gzip
import io
import re
import zlib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NoReturn

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.inputs import read_input

_WORD = re.compile(r"\S+")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_DECIMALS = re.compile(r"[^.]*(?:\.(\d*))?(?:[eE][+-]?(\d+))?")
_FIXED = 10  # numbers of one form, one of them with a zero at its end, show that all are written with fixed decimals
_MOST = 0.95  # share of numbers with more digits than the last one, above which it may be cut
_UNEVEN = 1e-3  # permitted deviation of printed times from even spacing, as a share of the time step
_MAX_VALUE = 1e100  # larger numbers are rejected, so that conversions of units cannot overflow
_MAX_BYTES = 256 << 20  # of text, after decompression
_GZIP = b"\x1f\x8b"
_DOS_END = b"\x1a"  # end-of-file character that fills the last block of files from CP/M and DOS


class Lines:
    """The lines of one file; `fail` raises an InputError with file and line."""

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self.lines = text.splitlines()
        self.ended = text.endswith(("\n", "\r"))  # the last line is whole

    def __len__(self) -> int:
        return len(self.lines)

    def __getitem__(self, index: int) -> str:
        """The line at `index`, counted from zero. Raises InputError if the file ends before."""
        if index >= len(self.lines):
            self.fail(len(self.lines) - 1, "the file ends here, truncated; fetch it again")
        return self.lines[index]

    def fail(self, index: int, reason: str) -> NoReturn:
        """Raise InputError for the line at `index`, counted from zero; the message counts from one."""
        raise InputError(f"{self.path.name}, line {index + 1}: {reason}")

    def number(self, index: int, field: str) -> float:
        """`field`, a part of the line at `index`, as a float. Raises InputError unless it is a finite number."""
        text = field.strip()
        value = float(text) if _NUMBER.fullmatch(text) else np.nan
        if not abs(value) < _MAX_VALUE:
            self.fail(index, f"{text[:24]!r} is not a finite number; repair or cut the data")
        return value

    def numbers(self, index: int, fields: list[str]) -> list[float]:
        """`number` for several fields of the line at `index`."""
        return [self.number(index, field) for field in fields]

    def positive(self, index: int, name: str, field: str) -> float:
        """`field` as a float. Raises InputError that begins with `name` unless it is a positive finite number."""
        value = self.number(index, field)
        if value <= 0:
            self.fail(index, f"{name} is {field.strip()}; it must be positive")
        return value

    def check_end(self, index: int, numbers: list[str]) -> tuple[str, ...]:
        """Notes where the file may end inside its last number, which is the last of `numbers`, on the line at `index`.

        numbers: of one column, or all of the file, as they are written. A line break ends a number. Raises InputError
        where the last number lacks decimals or digits of the exponent that all others have.
        """
        if self.ended or index < len(self.lines) - 1:
            return ()
        *others, last = (text.strip() for text in numbers)
        forms, (decimals, exponent) = {_form(text) for text in others}, _form(last)
        if len(others) >= _FIXED and len(forms) == 1 and any(_has_final_zero(text) for text in others):
            every = forms.pop()
            if decimals < every[0] or exponent < every[1]:
                self.fail(
                    index,
                    f"the file ends inside the number {last[:24]!r}, all others have {every[0]} decimals; "
                    "fetch it again",
                )
        digits = sum(map(str.isdigit, last))
        longer = sum(sum(map(str.isdigit, text)) > digits for text in others)
        if longer <= _MOST * len(others):
            return ()
        return (f"the file ends without a line break after {last[:24]!r}, which is shorter than most: it may be cut",)

    def check_columns(self, top: int) -> None:
        """Raise InputError where the file ends inside a number: all lines from `top` on have columns of fixed width.

        Where they have not, nothing is checked.
        """
        ends = [[word.end() for word in _WORD.finditer(line)] for line in self.lines[top:] if line.strip()]
        if self.ended or len(ends) < 3 or any(row != ends[0] for row in ends[:-1]):
            return
        if ends[-1] != ends[0][: len(ends[-1])]:
            self.fail(
                len(self.lines) - 1, "the file ends inside a number, before the end of its column; fetch it again"
            )

    def block(self, top: int, points: int, layout: tuple[int, int]) -> tuple[Array, int]:
        """Numbers in columns of fixed width.

        The columns are cut by their width, not split at blanks, since a number may fill its column.

        Args:
            top: index of the first line.
            points: number of numbers.
            layout: columns in a line and characters in a column, as in a Fortran format.

        Returns:
            ndarray, shape (points,), [unit of the file], and the index of the line after them.
        """
        per_line, width = layout
        if not (points and per_line and width):
            self.fail(top - 1, f"{points} points in {per_line} columns of width {width}; nothing to read")
        values: list[float] = []
        index = top
        while len(values) < points:
            row = self[index].rstrip()
            expected = min(per_line, points - len(values))
            if len(row) != expected * width:
                self.fail(index, f"{expected} columns of width {width} expected after {len(values)} of {points} points")
            values += self.numbers(index, [row[i : i + width] for i in range(0, len(row), width)])
            index += 1
        return column(values), index


def _form(text: str) -> tuple[int, int]:
    """Number of decimals, and of digits of the exponent, of a written number."""
    match = _DECIMALS.match(text)
    decimals, exponent = match.groups() if match else ("", "")
    return len(decimals or ""), len(exponent or "")


def _has_final_zero(text: str) -> bool:
    """Whether the decimals of a written number end with a zero, as with a fixed count."""
    match = _DECIMALS.match(text)
    return bool(match and (match[1] or "").endswith("0"))


def read_lines(path: Path) -> Lines:
    """The lines of a text file in UTF-8 or Latin-1, decompressed if it is a gzip file.

    Raises InputError if the file cannot be read, is empty, binary, damaged or too long.
    """
    try:
        if path.exists() and not path.is_file():
            raise InputError(f"{path.name}: no file but a folder, pipe or device; give the path of a record")
        content = read_input(path, _MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = (error.strerror if isinstance(error, OSError) else "") or error
        raise InputError(f"{path.name}: cannot be read ({reason}); check the path") from None
    return lines_of(path, content)


def lines_of(path: Path, content: bytes) -> Lines:
    """The lines of the bytes of a file; `path` names it in messages. Raises InputError as `read_lines`."""
    if content.startswith(_GZIP) and len(content) <= _MAX_BYTES:
        try:
            with gzip.open(io.BytesIO(content)) as compressed:
                content = compressed.read(_MAX_BYTES + 1)
        except (OSError, EOFError, zlib.error):
            raise InputError(f"{path.name}: damaged gzip data; fetch it again") from None
    if len(content) > _MAX_BYTES:
        raise InputError(
            f"{path.name}: more than {_MAX_BYTES >> 20} MiB of text; no record is that long, give another file"
        )
    content = content.rstrip(_DOS_END)
    if not content.strip():
        raise InputError(f"{path.name}: the file is empty; give a record")
    if b"\0" in content:
        raise InputError(f"{path.name}: a binary file; give a text file of a known format (docs/motion.md)")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    return Lines(path, text)


def even_step(lines: Lines, time: Array, places: Sequence[int]) -> float:
    """The step of a column of times, shape (k,) [s]. places: index of the line of each.

    Raises InputError for fewer than 4 times, and at the line where they are not evenly spaced.
    """
    steps = np.diff(time)
    if len(steps) < 3:
        raise InputError(f"{lines.path.name}: {len(steps) + 1} times, fewer than 4; give a longer record")
    step = float((time[-1] - time[0]) / len(steps))
    if not np.all(np.abs(time - (time[0] + step * np.arange(len(time)))) <= _UNEVEN * step):
        usual = float(np.median(steps))
        row = int(np.argmax(np.abs(steps - usual))) + 1
        lines.fail(
            places[row],
            f"times are not evenly spaced: from {time[row - 1]:.6g} to {time[row]:.6g} s, where "
            f"other steps are of {usual:.4g} s; fill the gap, resample, or use Motion.from_csv",
        )
    return step


def search(pattern: re.Pattern[str], head: Iterable[str]) -> re.Match[str] | None:
    """The first match of a pattern in lines of a header."""
    return next((match for line in head if (match := pattern.search(line))), None)


def word(pattern: re.Pattern[str], head: Iterable[str]) -> str:
    """The first group of this match; empty where there is none."""
    match = search(pattern, head)
    return match[1] if match else ""


def column(values: list[float]) -> Array:
    """Numbers as an ndarray, shape (k,), [unit of `values`]."""
    return np.array(values, dtype=np.float64)
