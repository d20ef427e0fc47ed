"""What every command shares: options, parsers, and the only functions of the package that print."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import wraps
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_type_hints

import typer

from msfp_gen.errors import printable
from msfp_gen.fields import Choice, Rule, ruled_fields
from msfp_gen.layout import Effects

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


def with_effects(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command an option for every effect; it is called with those that were given, as `effects`."""
    options = {name: _option(name, rule) for name, rule, _ in ruled_fields(Effects)}

    @wraps(command)
    def called(**given: Any) -> None:
        chosen = {name: value for name in options if (value := given.pop(name)) is not None}
        command(**given, effects=Effects(**chosen))

    signature = inspect.signature(command, eval_str=True)
    kept = [parameter for name, parameter in signature.parameters.items() if name != "effects"]
    added = [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=option)
             for name, option in options.items()]  # fmt: skip
    called.__annotations__ = {parameter.name: parameter.annotation for parameter in (*kept, *added)}
    setattr(called, "__signature__", signature.replace(parameters=[*kept, *added]))  # noqa: B010
    return called


def _option(name: str, rule: Rule) -> Any:
    """A switch for an effect that is on or off, else an option of a word or a text; the help says what they mean."""
    flag = name.replace("_", "-")
    if not isinstance(rule, Choice):
        text = "Of custom friction: mu * (1 - c1 * exp(-c2 * v))."
        return Annotated[str | None, typer.Option(f"--{flag}", metavar="FORMULA", help=text)]
    said = "; ".join(f"{word}: {meaning}" for word, meaning in rule.meanings.items())
    if True in rule.words:
        said = f"{rule.meanings[True]}. Off: {rule.meanings[False]}."
        return Annotated[bool | None, typer.Option(f"--{flag}/--no-{flag}", help=said[0].upper() + said[1:])]
    return Annotated[str | None, typer.Option(f"--{flag}", metavar="|".join(rule.words), help=f"{said}.")]


whole, number = read_as(int, "whole number"), read_as(float, "number")
Output = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="FILE", help="Write every row: .nc (netCDF-4), .csv, .parquet or .mat."),
]


def scenes(incomplete: str) -> list[tuple[str, str]]:
    """What a shell may complete a scene to: presets with what they are, scene files and the folders on the way."""
    from msfp_gen.catalogue import descriptions

    presets = [(name, line) for name, line in descriptions("scene").items() if name.startswith(incomplete)]
    folder, _, start = incomplete.rpartition("/")
    files = sorted(Path(folder or ("/" if incomplete.startswith("/") else ".")).glob(f"{start}*"))
    found = [path for path in files if path.is_dir() or path.suffix == ".toml"]
    return presets + [(f"{path}/", "folder") if path.is_dir() else (str(path), "scene file") for path in found]


SceneName = Annotated[
    str,
    typer.Argument(metavar="SCENE", help="A scene file (TOML) or the name of a preset.", autocompletion=scenes),
]


def say(text: str) -> None:
    """A result, on stdout."""
    typer.echo(printable(text))


def note(text: str) -> None:
    """A line about long work, beside the results, on stderr."""
    typer.echo(printable(text), err=True)


def fail(message: str, code: int) -> int:
    """One line on stderr, whatever the message holds."""
    typer.echo(printable(f"error: {' '.join(message.split())}"), err=True)
    return code


def show(tables: Iterable[Table]) -> None:
    """Rich tables on a terminal, aligned text in a pipe."""
    if not sys.stdout.isatty():
        say("\n\n".join(table.text for table in tables))
        return
    from rich.console import Console

    for table in tables:
        rows = [[printable(cell) for cell in row] for row in table.rows]
        Console().print(replace(table, title=printable(table.title), rows=rows).rich())


class Progress:
    """How far long work is, and after a second how long it still takes, on one line of a terminal; silent elsewhere."""

    def __init__(self, name: str) -> None:
        self.name = printable(name)
        self._shown = ("", -1)
        self._begin = monotonic()

    def __enter__(self) -> Callable[[float, float], None] | None:
        return self._update if sys.stderr.isatty() else None

    def __exit__(self, *_: object) -> None:
        if self._shown[1] >= 0:
            typer.echo("\r\x1b[K", nl=False, err=True)

    def _update(self, time: float, end: float) -> None:
        percent = int(100 * time / end)
        if (self.name, percent) != self._shown:
            self._shown = self.name, percent
            elapsed = monotonic() - self._begin
            left = f", {elapsed * (end / time - 1):.0f} s left" if elapsed > 1 and time > 0 else ""
            typer.echo(f"\r\x1b[K{self.name}: {percent} %{left}", nl=False, err=True)


@contextmanager
def building() -> Iterator[Callable[[str, float], None]]:
    """Progress of a build: what is being done, and how far it is; a line as each stage begins without a terminal."""
    stage, line, begin = "", Progress(""), monotonic()

    def tell(doing: str, share: float) -> None:
        nonlocal stage
        if update is not None:
            line.name = printable(doing)
            update(share, 1.0)
        elif doing.partition(" ")[0] != stage:
            note(doing)
        stage = doing.partition(" ")[0]

    with line as update:
        yield tell
    if stage == "compiling":
        note(f"built in {monotonic() - begin:.1f} s; from now on it comes from the cache")
