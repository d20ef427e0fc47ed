"""The command line, `msfp-gen`. The only module that prints; everything heavy is imported when a command needs it."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_type_hints

import typer

from msfp_gen.errors import MsfpError, RunError
from msfp_gen.layout import Effects, Layout, ModelSpec
from msfp_gen.output import DATASET_SUFFIXES, FIGURE_SUFFIXES, check_output
from msfp_gen.solver import Solver
from msfp_gen.version import __version__

if TYPE_CHECKING:
    from msfp_gen.result import Result
    from msfp_gen.scene import Scene
    from msfp_gen.tables import Table

DEMO = ("ridgecrest-clc", "fenz-test5")
FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130
# The base of usage errors (ClickException), in click or in the copy of it that newer typers carry.
USAGE_ERROR: Any = typer.BadParameter.__mro__[2]

app = typer.Typer(
    help="Full nonlinear equations of motion of multi-stage friction pendulum bearings: derived, compiled, integrated.",
    epilog="Examples:\n\n\b\n"
    "  msfp-gen demo -o out\n  msfp-gen run fenz-test2 --plot loops.png\n  msfp-gen generate 7 3 3",
    rich_markup_mode=None,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _read(kind: Callable[[str], Any], noun: str) -> Callable[[str], Any]:
    """A parser whose error names the value, as those of typer do not."""

    def parse(text: str) -> Any:
        try:
            return kind(text)
        except ValueError:
            raise typer.BadParameter(f"{text!r} is no {noun}; give one") from None

    return parse


def _words(owner: type, field: str) -> str:
    """The choices of a field, as help shows them."""
    return "|".join(get_args(get_type_hints(owner)[field]))


_whole, _number = _read(int, "whole number"), _read(float, "number")
Output = Annotated[Path | None, typer.Option("-o", "--output", metavar="FILE.nc", help="Write every row as netCDF-4.")]
SceneName = Annotated[str, typer.Argument(metavar="SCENE", help="A scene file (TOML) or the name of a preset.")]


def main(argv: list[str] | None = None) -> int:
    """Run the command line; returns its exit code: 0 done, 1 the run failed, 2 bad input."""
    arguments = sys.argv[1:] if argv is None else argv
    try:
        code = app(args=arguments or ["--help"], prog_name="msfp-gen", standalone_mode=False) or 0
    except MsfpError as error:
        return _fail(str(error), error.exit_code)
    except OSError as error:  # such as a full disk, or a reader of our output that left
        return _fail(str(error), FAILED)
    except typer.Abort:
        code = INTERRUPTED
    except USAGE_ERROR as error:
        return _fail(f"{error.format_message().rstrip('.')} (see msfp-gen --help)", BAD_INPUT)
    # Typer turns Ctrl-C into this code without a word.
    return _fail("interrupted", code) if code == INTERRUPTED else int(code)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"msfp-gen {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_print_version, help="Print the version and exit.")
    ] = False,
) -> None:
    pass


@app.command(epilog="Example:\n\n\b\n  msfp-gen generate 5 2 2 -o models   # then: import msfp_5_2_2")
def generate(
    n: Annotated[int, typer.Argument(parser=_whole, metavar="N", help="Bodies, base and top plate included.")],
    m: Annotated[int, typer.Argument(parser=_whole, metavar="M", help="Surfaces that are concave up; they lie below.")],
    p: Annotated[
        int, typer.Argument(parser=_whole, metavar="P", help="Surfaces that are concave down; n = m + p + 1.")
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Put sources and module here.")
    ] = None,
    dimension: Annotated[str | None, typer.Option(metavar=_words(Effects, "dimension"))] = None,
    spin: Annotated[str | None, typer.Option(metavar=_words(Effects, "spin"))] = None,
    sliders: Annotated[str | None, typer.Option(metavar=_words(Effects, "sliders"))] = None,
    rims: Annotated[bool | None, typer.Option("--rims/--no-rims", help="Whether sliders meet rims.")] = None,
    bouc_wen: Annotated[str | None, typer.Option(metavar=_words(Effects, "bouc_wen"))] = None,
) -> None:
    """Derive, emit and compile the equations of a layout."""
    given = {"dimension": dimension, "spin": spin, "sliders": sliders, "rims": rims, "bouc_wen": bouc_wen}
    effects: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    spec = ModelSpec(Layout(n, m, p), Effects(**effects))
    from msfp_gen.build import generate_to, prepare
    from msfp_gen.tables import build_table

    info = prepare(spec, _note) if output is None else generate_to(spec, output, _note)
    _show([build_table(info)])


@app.command(
    epilog="Example:\n\n\b\n  msfp-gen run fenz-test2 -o test2.nc --plot test2.png\n  msfp-gen run scene.toml --json"
)
def run(
    scene: SceneName,
    output: Output = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw loops and sliding: .png, .svg or .pdf.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON, and nothing else.")] = False,
    method: Annotated[
        str | None, typer.Option(metavar=_words(Solver, "method"), help="Instead of the scene's.")
    ] = None,
    rtol: Annotated[
        float | None, typer.Option(parser=_number, metavar="NUMBER", help="Relative tolerance, instead of the scene's.")
    ] = None,
    max_step: Annotated[
        float | None, typer.Option(parser=_number, metavar="SECONDS", help="Longest step, instead of the scene's.")
    ] = None,
    duration: Annotated[
        float | None, typer.Option(parser=_number, metavar="SECONDS", help="End after this time.")
    ] = None,
) -> None:
    """Simulate a scene."""
    if output is not None:
        check_output(output, DATASET_SUFFIXES, "--output")
    if plot is not None:
        check_output(plot, FIGURE_SUFFIXES, "--plot")
    from msfp_gen.scenefile import load_scene

    chosen = _changed(load_scene(scene), duration, method=method, rtol=rtol, max_step=max_step)
    for path in _run(chosen, output, plot, as_json):
        _note(f"wrote {path}")


@app.command()
def explain(scene: SceneName) -> None:
    """Say in plain words what a scene computes."""
    from msfp_gen.explain import explain as describe
    from msfp_gen.scenefile import load_scene

    _show(describe(load_scene(scene)))


@app.command()
def presets() -> None:
    """List the scenes and bearings that come with msfp-gen."""
    from msfp_gen import presets as catalogue
    from msfp_gen.tables import Table

    _show(Table(f"preset {kind}s", (), list(catalogue.names(kind).items())) for kind in ("scene", "bearing"))


@app.command()
def doctor() -> None:
    """Check Python, libraries, compiler and cache."""
    from msfp_gen.doctor import diagnose
    from msfp_gen.tables import check_table

    checks = diagnose()
    _show([check_table(checks)])
    if not all(check.ok for check in checks):
        raise typer.Exit(1)


@app.command()
def demo(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Where figures and data go.")] = Path(
        "out"
    ),
) -> None:
    """Run an earthquake and a laboratory test; write figures and data."""
    from msfp_gen.output import make_folder
    from msfp_gen.scenefile import load_scene

    scenes = [load_scene(name) for name in DEMO]
    make_folder(output, "--output")
    for name, scene in zip(DEMO, scenes, strict=True):
        written = _run(scene, output / f"{name}.nc", output / f"{name}.png")
        typer.echo("\n".join(["", *(f"wrote {path}" for path in written), ""]))


def _changed(scene: Scene, duration: float | None, **solver: Any) -> Scene:
    """`scene` with what the options gave."""
    given = {name: value for name, value in solver.items() if value is not None}
    scene = replace(scene, solver=replace(scene.solver, **given)) if given else scene
    return scene if duration is None else replace(scene, duration=duration)


def _run(scene: Scene, output: Path | None, plot: Path | None, as_json: bool = False) -> list[Path]:
    """Simulate, report and save; the paths written. A run that failed is reported and saved too, then raised."""
    result, failure = _simulate(scene)
    saved = []
    if result is not None:
        _report(result, as_json)
        saved = _save(result, output, plot)
    if failure is not None:
        kept = f"; what was computed until then is in {' and '.join(map(str, saved))}" if saved else ""
        raise RunError(f"{failure}{kept}", status=failure.status, result=result) from failure
    return saved


def _simulate(scene: Scene) -> tuple[Result | None, RunError | None]:
    """The result, and why the run failed if it did: what was computed until then is worth keeping."""
    from msfp_gen.build import build_model
    from msfp_gen.result import Result
    from msfp_gen.simulation import simulate

    build_model(scene.bearing.layout, scene.effects, progress=_note)
    with _Progress(scene.name or "run") as progress:
        try:
            return simulate(scene, progress=progress), None
        except RunError as error:
            return error.result if isinstance(error.result, Result) else None, error


def _report(result: Result, as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(result.summary, indent=2, allow_nan=False))
        return
    from msfp_gen.tables import summary_tables

    _show(summary_tables(result))


def _save(result: Result, output: Path | None, plot: Path | None) -> list[Path]:
    """Write what was asked for; the paths written."""
    if output is not None:
        result.to_netcdf(output)
    if plot is not None:
        from msfp_gen.figures import plot_result

        plot_result(result, plot)
    return [path for path in (output, plot) if path is not None]


def _show(tables: Iterable[Table]) -> None:
    """Rich tables on a terminal, aligned text in a pipe."""
    if not sys.stdout.isatty():
        typer.echo("\n\n".join(table.text for table in tables))
        return
    from rich.console import Console

    for table in tables:
        Console().print(table.rich())


class _Progress:
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


def _note(text: str) -> None:
    """A line about long work, beside the results."""
    typer.echo(text, err=True)


def _fail(message: str, code: int) -> int:
    """One line on stderr, whatever the message holds."""
    typer.echo(f"error: {' '.join(message.split())}", err=True)
    return code
