"""What every command shares: options, parsers, and the only functions of the package that print."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_type_hints

import typer

if TYPE_CHECKING:
    from msfp_gen.tables import Table


def read_as(kind: Callable[[str], Any], noun: str) -> Callable[[str], Any]:
    """A parser whose error names the value, as those of typer do not."""

    def parse(text: str) -> Any:
        try:
            return kind(text)
        except ValueError:
            raise typer.BadParameter(f"{text!r} is no {noun}; give one") from None

    return parse


def words(owner: type, field: str) -> str:
    """The choices of a field, as help shows them."""
    return "|".join(get_args(get_type_hints(owner)[field]))


whole, number = read_as(int, "whole number"), read_as(float, "number")
Output = Annotated[Path | None, typer.Option("-o", "--output", metavar="FILE.nc", help="Write every row as netCDF-4.")]
SceneName = Annotated[str, typer.Argument(metavar="SCENE", help="A scene file (TOML) or the name of a preset.")]


def say(text: str) -> None:
    """A result, on stdout."""
    typer.echo(text)


def note(text: str) -> None:
    """A line about long work, beside the results, on stderr."""
    typer.echo(text, err=True)


def fail(message: str, code: int) -> int:
    """One line on stderr, whatever the message holds."""
    typer.echo(f"error: {' '.join(message.split())}", err=True)
    return code


def show(tables: Iterable[Table]) -> None:
    """Rich tables on a terminal, aligned text in a pipe."""
    if not sys.stdout.isatty():
        typer.echo("\n\n".join(table.text for table in tables))
        return
    from rich.console import Console

    for table in tables:
        Console().print(table.rich())


class Progress:
    """How far a run is, on one line of a terminal's stderr; silent elsewhere."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._shown = -1

    def __enter__(self) -> Callable[[float, float], None] | None:
        return self._update if sys.stderr.isatty() else None

    def __exit__(self, *_: object) -> None:
        if self._shown >= 0:
            typer.echo("\r\x1b[K", nl=False, err=True)

    def _update(self, time: float, end: float) -> None:
        percent = int(100 * time / end)
        if percent > self._shown:
            self._shown = percent
            typer.echo(f"\r\x1b[K{self._name}: {percent} %", nl=False, err=True)
