"""Shared by all commands: options, parsers, and the functions that print."""

from __future__ import annotations

import inspect
import json
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import wraps
from pathlib import Path
from time import monotonic
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_type_hints

import typer

from msfp_gen.common.errors import RunError, printable
from msfp_gen.common.fields import Choice, Rule, ruled_fields
from msfp_gen.results.sign import SIGNS
from msfp_gen.scene.system import require_field
from msfp_gen.specification.layout import Effects

if TYPE_CHECKING:
    from msfp_gen.common.tables import Table
    from msfp_gen.results.result import AnyResult
    from msfp_gen.results.verdict import Verdict
    from msfp_gen.scene.system import System


def parser_of(kind: Callable[[str], Any], noun: str) -> Callable[[str], Any]:
    """A parser of option values whose error message names the value, which typer's own parsers do not."""

    def parse(text: str) -> Any:
        try:
            return kind(text)
        except ValueError:
            raise typer.BadParameter(f"{text!r} is not a {noun}; give one") from None

    return parse


def choices_of(owner: type, field: str) -> str:
    """The choices of a field of a dataclass, as the help text shows them."""
    return "|".join(get_args(get_type_hints(owner)[field]))


def with_effects(command: Callable[..., None]) -> Callable[..., None]:
    """Add an option for every effect to a command, which receives them as `effects`."""
    options = {name: _option(name, rule) for name, rule, _ in ruled_fields(Effects)}

    @wraps(command)
    def called(**arguments: Any) -> None:
        chosen = {name: value for name in options if (value := arguments.pop(name)) is not None}
        command(**arguments, effects=Effects(**chosen))

    signature = inspect.signature(command, eval_str=True)
    others = [parameter for name, parameter in signature.parameters.items() if name != "effects"]
    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=option)
        for name, option in options.items()
    ]
    called.__annotations__ = {parameter.name: parameter.annotation for parameter in (*others, *added)}
    setattr(called, "__signature__", signature.replace(parameters=[*others, *added]))  # noqa: B010
    return called


def _option(name: str, rule: Rule) -> Any:
    """The option of one effect: a switch for an effect that is on or off, else a word or a formula."""
    flag = name.replace("_", "-")
    if not isinstance(rule, Choice):
        text = "Formula of the friction coefficient with --friction custom, such as mu * (1 - c1 * exp(-c2 * v))."
        return Annotated[str | None, typer.Option(f"--{flag}", metavar="FORMULA", help=text)]
    text = "; ".join(f"{word}: {meaning}" for word, meaning in rule.meanings.items())
    if True in rule.words:
        text = f"{rule.meanings[True]}. Off: {rule.meanings[False]}."
        return Annotated[bool | None, typer.Option(f"--{flag}/--no-{flag}", help=text[0].upper() + text[1:])]
    return Annotated[str | None, typer.Option(f"--{flag}", metavar="|".join(rule.words), help=f"{text}.")]


whole_number, number = parser_of(int, "whole number"), parser_of(float, "number")
numbers = parser_of(lambda text: tuple(map(float, text.split(","))), "list of numbers")
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, every number in SI, and nothing else.")]
WorkersOption = Annotated[
    int | None,
    typer.Option(parser=whole_number, metavar="NUMBER", help="Runs at the same time; default: one for each core."),
]
Output = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="FILE", help="Write every row: .nc (netCDF-4), .csv, .parquet or .mat."),
]


SignOption = Annotated[
    str,
    typer.Option(
        metavar="|".join(SIGNS),
        help="Sign of the displacement across the bearing and of its force in files and figures.",
    ),
]


def scenes(incomplete: str) -> list[tuple[str, str]]:
    """Completions of a scene for the shell, with descriptions: presets, scene files and folders."""
    from msfp_gen.scene.file.catalogue import scene_descriptions

    presets = [(name, line) for name, line in scene_descriptions().items() if name.startswith(incomplete)]
    folder, _, start = incomplete.rpartition("/")
    files = sorted(Path(folder or ("/" if incomplete.startswith("/") else ".")).glob(f"{start}*"))
    paths = [path for path in files if path.is_dir() or path.suffix == ".toml"]
    return presets + [(f"{path}/", "folder") if path.is_dir() else (str(path), "scene file") for path in paths]


SceneName = Annotated[
    str,
    typer.Argument(metavar="SCENE", help="A scene file (TOML) or the name of a preset.", autocompletion=scenes),
]


def say(text: str) -> None:
    """Print a result on standard output."""
    typer.echo(printable(text))


def note(text: str) -> None:
    """Print a line that is not part of the results on standard error."""
    typer.echo(printable(text), err=True)


def note_exceeded(verdicts: Mapping[str, Verdict]) -> None:
    """A line for every run that exceeded limits of the device. verdicts: by names of runs, "" for the only one."""
    for name, verdict in verdicts.items():
        if verdict.exceeded:
            note(f"{name}{': ' if name else ''}limits of the device {verdict.text}")


def note_doubts(runs: Sequence[tuple[str, Sequence[str]]]) -> None:
    """One line for all runs with a doubt of one kind. runs: names with the texts of the doubts of each run."""
    from msfp_gen.scene.plausibility import doubt_lines

    for line in doubt_lines(runs):
        note(line)


def fail(message: str, code: int) -> int:
    """Print an error message as one line on standard error; returns `code`."""
    typer.echo(printable(f"error: {' '.join(message.split())}"), err=True)
    return code


def show(tables: Iterable[Table]) -> None:
    """Print tables: with rich on a terminal, as aligned text otherwise."""
    if not sys.stdout.isatty():
        say("\n\n".join(table.text for table in tables))
        return
    from rich.console import Console

    for table in tables:
        rows = [[printable(cell) for cell in row] for row in table.rows]
        Console().print(replace(table, title=printable(table.title), rows=rows).rich())


def answer(content: Any, tables: Iterable[Table], as_json: bool) -> None:
    """Print a result: its content as JSON, every number in SI, or its tables."""
    if as_json:
        say(json.dumps(content, indent=2, allow_nan=False))
    else:
        show(tables)


def note_written(paths: Iterable[Path]) -> None:
    """Name the files that were written."""
    for path in paths:
        note(f"wrote {path}")


@contextmanager
def interruptible(output: Path | None) -> Iterator[None]:
    """Say where the runs of a study are if the block is interrupted. output: its folder; None: nowhere."""
    try:
        yield
    except KeyboardInterrupt:
        where = "nothing is kept without --output" if output is None else f"what is done is kept in {output}"
        note(where + ("" if output is None else "; the same command continues"))
        raise


class ShownProgress:
    """Progress in per cent, which never falls, and after a second the time left.

    On a terminal it is one line; elsewhere there is a line every `EVERY` seconds. terminal: which of the two.
    """

    def __init__(self, name: str) -> None:
        self.name = printable(name)
        self._shown = ("", -1)
        self._whole = 0.0  # expected time of the whole [s]; 0: not known yet
        self._begin = monotonic()
        self._over = threading.Event()
        self.terminal = sys.stderr.isatty()

    def __enter__(self) -> Callable[[float, float], None]:
        if not self.terminal:
            threading.Thread(target=self._report, daemon=True).start()
        return self._update

    def __exit__(self, *_: object) -> None:
        self._over.set()
        if self.terminal and self._shown[1] >= 0:
            typer.echo("\r\x1b[K", nl=False, err=True)

    def _update(self, time: float, end: float) -> None:
        name, before = self._shown
        percent = max(int(100 * time / end), before if name == self.name else 0)
        if (self.name, percent) != self._shown:
            self._shown = self.name, percent
            elapsed = monotonic() - self._begin
            self._whole = elapsed * end / time if elapsed > 1 and time > 0 else 0.0
            if self.terminal:
                typer.echo(f"\r\x1b[K{self._line}", nl=False, err=True)

    @property
    def _line(self) -> str:
        left = self._whole - (monotonic() - self._begin)
        return f"{self.name}: {self._shown[1]} %" + (f", {left:.0f} s left" if left >= 0.5 else "")

    def _report(self) -> None:
        while not self._over.wait(EVERY):
            if self._shown[1] >= 0:
                note(self._line)


@contextmanager
def building(kept: bool = True) -> Iterator[Callable[[str, float], None]]:
    """Progress of a build: the current task and per cent done; without a terminal one line per task.

    kept: whether the cache keeps what is built.
    """
    task, line, begin = "", ShownProgress(""), monotonic()

    def report(doing: str, share: float) -> None:
        nonlocal task
        line.name = printable(doing)
        update(share, 1.0)
        if not line.terminal and doing.partition(" ")[0] != task:
            note(doing)
        task = doing.partition(" ")[0]

    with line as update:
        yield report
    if task == "compiling":
        note(f"built in {monotonic() - begin:.1f} s{'; later runs load it from the cache' if kept else ''}")


def load_source(source: str) -> AnyResult | System:
    """Load a saved result (.nc), or the scene of a file or preset, of one bearing or of a building."""
    if source.lower().endswith(".nc"):
        from msfp_gen.results.result import load_result

        result: AnyResult = load_result(source)
        return result
    from msfp_gen.scene.file.source import load_scene

    scene: System = load_scene(source)
    return scene


def is_result(loaded: object) -> bool:
    """Whether this is a result, not a scene."""
    from msfp_gen.results.result import AnyResult

    return isinstance(loaded, AnyResult)


def build(scene: System, gradients: bool = False) -> None:
    """Build the models of a scene, with progress, unless they are in the cache. gradients: ones that have them."""
    from msfp_gen.model.model import build_model

    with building() as progress:
        for spec in scene.specs:
            build_model(spec.layout, spec.effects, gradients, progress=progress)


Force = Annotated[bool, typer.Option("--force", help="Run also with values that no unit can make right.")]


def with_field(scene: Any, name: str, change: Callable[[Any], Any]) -> Any:
    """A scene with a field changed by options. change: of its value. Raises InputError where there is no such field."""
    require_field(scene, name, "leave out the options that change it")
    return replace(scene, **{name: change(getattr(scene, name))})


def run_scene(scene: Any, force: bool = False, **options: Any) -> tuple[Any, RunError | None]:
    """Run a scene; its result (of a failed run as far as it was computed), and the error of a failed run.

    force: see `plausibility.require_meant`.
    """
    from msfp_gen.scene.plausibility import require_meant
    from msfp_gen.simulation.memory import require_memory
    from msfp_gen.simulation.simulate import simulate

    require_meant(scene, force=force)
    require_memory([scene])
    build(scene)
    with ShownProgress(scene.name or "run") as progress:
        try:
            return simulate(scene, progress=progress, **options), None
        except RunError as error:
            return error.result if is_result(error.result) else None, error


def result_of(loaded: AnyResult | System, force: bool = False) -> tuple[Any, RunError | None]:
    """A loaded result, or the run of a loaded scene, and the error of a failed run.

    force: see `run_scene`. Raises RunError if nothing was computed.
    """
    if is_result(loaded):
        return loaded, None
    result, failure = run_scene(loaded, force)
    if result is None:
        assert failure is not None
        raise failure
    return result, failure


# SIGHUP does not exist on all platforms. Python itself handles SIGINT.
_SIGNALS = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
EVERY = 10.0  # time between two lines of progress where there is no terminal [s]
REPEAT = 0.05  # time after which an interrupt that was lost is repeated [s]


@contextmanager
def signals_as_interrupts() -> Iterator[list[int]]:
    """Within the block these signals raise KeyboardInterrupt; the list contains the numbers received.

    Python ignores a KeyboardInterrupt in a callback, such as one of a weak reference; it is repeated.
    """
    received: list[int] = []

    def interrupt(number: int, _: FrameType | None) -> None:
        received.append(number)
        raise KeyboardInterrupt

    def repeat(ignored: Any) -> None:
        if not issubclass(ignored.exc_type, KeyboardInterrupt):
            before(ignored)
            return
        number = received[-1] if received else signal.SIGINT
        again = threading.Timer(REPEAT, signal.pthread_kill, (threading.main_thread().ident, number))
        again.daemon = True
        again.start()

    before, sys.unraisablehook = sys.unraisablehook, repeat
    # A handler that was set before stays: nohup, for example, ignores SIGHUP.
    handled = [number for number in _SIGNALS if signal.getsignal(number) is signal.SIG_DFL]
    try:
        for number in handled:
            signal.signal(number, interrupt)
    except ValueError:  # only the main thread may set handlers
        handled = []
    try:
        yield received
    finally:
        sys.unraisablehook = before
        for number in handled:
            signal.signal(number, signal.SIG_DFL)
