"""Tables of text, independent of their output: aligned plain text for pipes and logs, or a formatted terminal table."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table as RichTable


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


def yes(value: object) -> str:
    """`yes` for a true value, a dash for a false one."""
    return "yes" if value else "-"


def vector(values: Iterable[float], scale: float = 1.0) -> str:
    """Components of a vector, each times `scale`, with four significant digits and separated by commas."""
    return ", ".join(f"{value * scale:.4g}" for value in values)
