"""Tables: of text, as aligned plain text or formatted for a terminal; and of columns of values, as CSV or Parquet."""

from __future__ import annotations

import csv
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from io import BytesIO, StringIO
from math import floor, log10
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msfp_gen.common.output import check_output, write_bytes

if TYPE_CHECKING:
    from rich.table import Table as RichTable

TABLE_SUFFIXES = (".csv", ".parquet")
LabelledValues = list[tuple[str, str]]  # label and value


class Printed(ABC):
    """What `print` and a notebook show of an object that has a title and a few rows."""

    @abstractmethod
    def printed_rows(self) -> tuple[str, LabelledValues]:
        """Title, and label and value of each row."""

    def __repr__(self) -> str:
        """Title and rows as text, one line each."""
        title, rows = self.printed_rows()
        width = max(8, *(len(label) for label, _ in rows)) + 1
        return "\n".join([title, *(f"  {label:<{width}}{' '.join(value.split())}" for label, value in rows)])

    def _repr_html_(self) -> str:
        """Title, rows and what stands beside them, for a notebook."""
        title, rows = self.printed_rows()
        cells = "".join(f"<tr><th>{escape(label)}</th><td>{escape(value)}</td></tr>" for label, value in rows)
        below = f"<div style='display:flex;gap:1em'><table>{cells}</table>{self.printed_beside()}</div>"
        return f"<div><b>{escape(title)}</b>{below}</div>"

    def printed_beside(self) -> str:
        """HTML beside the rows in a notebook."""
        return ""


@dataclass(frozen=True)
class Table:
    """A table of formatted text.

    Attributes:
        title: heading.
        columns: names of the columns; empty for a table of names and values.
        rows: one sequence of texts per row.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]

    @property
    def text(self) -> str:
        """Title and rows as aligned plain text: first column left-aligned; under column names, the others right."""
        lines = [row for row in (self.columns, *self.rows) if row]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        body = ["  " + "  ".join(self._cell(row, i, widths[i]) for i in range(len(row))).rstrip() for row in lines]
        return "\n".join([self.title, *body])

    def _cell(self, row: Sequence[str], column: int, width: int) -> str:
        return row[column].rjust(width) if self.columns and column else row[column].ljust(width)

    @property
    def markdown(self) -> str:
        """The rows below the names of the columns, as Markdown; without the title."""
        return markdown_table(self.columns, self.rows) + "\n"

    def rich(self) -> RichTable:
        """The table for a terminal, drawn by the library rich."""
        from rich import box
        from rich.table import Table as RichTable
        from rich.text import Text

        width = len(self.rows[0]) if self.rows else len(self.columns)
        table = RichTable(
            title=Text(self.title, style="bold"),
            title_justify="left",
            box=box.SIMPLE_HEAD,
            show_header=bool(self.columns),
        )
        for index in range(width):
            right = bool(self.columns) and index > 0
            table.add_column(Text(self.columns[index]) if self.columns else "", justify="right" if right else "left")
        for row in self.rows:
            table.add_row(*map(Text, row))
        return table


def markdown_row(cells: Iterable[str]) -> str:
    """One line of a table in Markdown."""
    return f"| {' | '.join(cells)} |"


def markdown_table(columns: Sequence[str], rows: Iterable[Iterable[str]]) -> str:
    """A table in Markdown, without a line break at its end."""
    return "\n".join(map(markdown_row, (columns, ["---"] * len(columns), *rows)))


def yes(value: object) -> str:
    """`yes` for a true value, a dash for a false one."""
    return "yes" if value else "-"


def decimal_text(value: float) -> str:
    """A number with four significant digits and at most four decimals, without exponent."""
    if value == 0:
        return "0"
    if abs(value) < 5e-5:
        return "< 0.0001" if value > 0 else "> -0.0001"
    return f"{value:.{min(max(3 - floor(log10(abs(value))), 0), 4)}f}"


def vector_text(values: Iterable[float], scale: float = 1.0) -> str:
    """Components of a vector, each times `scale`, with four significant digits and separated by commas."""
    return ", ".join(f"{value * scale:.4g}" for value in values)


def write_columns(path: str | Path, columns: Mapping[tuple[str, str], Sequence[Any]], name: str = "output") -> Path:
    """Write a table of columns as CSV or Parquet, by the suffix; completely or not at all.

    columns: (name, unit) -> values, None where there is none. Names carry units in CSV (`peak_displacement [m]`); in
    Parquet units are metadata of the columns. name: of the option in messages. Raises InputError for an invalid path.
    """
    target = check_output(path, TABLE_SUFFIXES, name)
    content = _csv(columns) if target.suffix.lower() == ".csv" else parquet_bytes(columns)
    write_bytes(target, [content])
    return target


def write_rows(path: str | Path, rows: Sequence[Mapping[str, Any]]) -> Path:
    """Write rows of names and values as `write_columns` does, without units; a row may lack values."""
    names = dict.fromkeys(key for row in rows for key in row)
    return write_columns(path, {(key, ""): [row.get(key) for row in rows] for key in names})


def _csv(columns: Mapping[tuple[str, str], Sequence[Any]]) -> bytes:
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([f"{name} [{unit}]" if unit else name for name, unit in columns])
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue().encode()


def parquet_bytes(
    columns: Mapping[tuple[str, str], Any],
    types: Mapping[str, str] | None = None,
    about: Mapping[str, str] | None = None,
    meanings: Mapping[str, str] | None = None,
) -> bytes:
    """The content of a Parquet file, with checksums of its pages.

    columns: see `write_columns`. types: name -> type in the words of Arrow; None: from the values. about: metadata of
    the file. meanings: name -> text, as metadata "long_name" of the column.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    arrays = [
        pa.array(_one_type(values)) if types is None else pa.array(values, types[name])
        for (name, _), values in columns.items()
    ]
    fields = [
        pa.field(name, array.type, metadata={"units": unit} | ({"long_name": meanings[name]} if meanings else {}))
        for (name, unit), array in zip(columns, arrays, strict=True)
    ]
    content = BytesIO()
    pq.write_table(pa.table(arrays, schema=pa.schema(fields, metadata=about)), content, write_page_checksum=True)
    return content.getvalue()


def _one_type(values: Sequence[Any]) -> list[Any]:
    """Values of one type for a column: numbers stay numbers; where texts occur, all are texts."""
    kinds = {type(value) for value in values if value is not None}
    if kinds == {int, float}:
        return [None if value is None else float(value) for value in values]
    return list(values) if len(kinds) <= 1 else [None if value is None else str(value) for value in values]
