"""Commands that write HTML pages: report (of a run), explore (a page that runs a bearing in the browser)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msfp_gen.cli.console import Progress, note, note_exceeded, whole_number
from msfp_gen.cli.inputs import load_source, result_of
from msfp_gen.errors import InputError, RunError

app = typer.Typer()
MOST = 5000  # instants in the interactive view; more would give a file of tens of megabytes


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen run fenz-test5 -o out.nc\n  msfp-gen report out.nc -o report.html\n"
    '  msfp-gen report out.nc --project "Hospital, block B" --date 2026-03-01 --revision 2 --code "ASCE 7-22"\n'
    "  msfp-gen report ridgecrest-clc   # runs it first, and writes ridgecrest-clc.html"
)
def report(
    source: Annotated[
        str, typer.Argument(metavar="RUN", help="A result (.nc); or a scene file or preset, which is run first.")
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE.html", help="The file to write; default: the name of RUN with .html."
        ),
    ] = None,
    frames: Annotated[
        int | None,
        typer.Option(parser=whole_number, metavar="N", help="Number of instants in the view, about; default 1500."),
    ] = None,
    project: Annotated[str, typer.Option(metavar="TEXT", help="Title block: the project.")] = "",
    device: Annotated[
        str, typer.Option(metavar="TEXT", help="Title block: the bearing; default: its kind.", show_default=False)
    ] = "",
    date: Annotated[str, typer.Option(metavar="TEXT", help="Title block: the date.")] = "",
    revision: Annotated[str, typer.Option(metavar="TEXT", help="Title block: the revision.")] = "",
    code: Annotated[
        str, typer.Option(metavar="TEXT", help="Title block: the edition of the design code, such as ASCE 7-22.")
    ] = "",
) -> None:
    """Write a run as one HTML file that needs no network: numbers, settings, figures, the bearing in motion."""
    from msfp_gen.common.output import check_output
    from msfp_gen.report import FRAMES, REPORT_SUFFIXES, TitleBlock, write_report

    count = FRAMES if frames is None else frames
    if not 2 <= count <= MOST:
        raise InputError(f"--frames = {count}: give 2 to {MOST}")
    path = check_output(Path(f"{Path(source).stem}.html") if output is None else output, REPORT_SUFFIXES, "--output")
    result, failure = result_of(load_source(source))
    with Progress("report") as progress:
        write_report(result, path, count, progress, TitleBlock(project, device, date, revision, code))
    note(f"wrote {path}")
    note_exceeded({"": result.verdict})
    if failure is not None:
        raise RunError(f"{failure}; the report of what was computed until then is in {path}", status=failure.status)


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen explore -o explorer.html   # presets\n"
    "  msfp-gen explore scene.toml -o scene.html"
)
def explore(
    scene: Annotated[
        str | None, typer.Argument(metavar="[SCENE]", help="A scene file (.toml) or preset; default: a set of presets.")
    ] = None,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE.html", help="The file to write.", show_default=True)
    ] = Path("explorer.html"),
) -> None:
    """Write one HTML file in which sliders change a bearing and its motion, and the response is computed at once."""
    from msfp_gen.buildings.load import load_bearing_scene
    from msfp_gen.common.output import check_output
    from msfp_gen.explorer import write_explorer
    from msfp_gen.explorer.page import SUFFIXES

    path = check_output(output, SUFFIXES, "--output")
    first = None if scene is None else load_bearing_scene(scene)
    with Progress("explorer") as progress:
        write_explorer(path, first, progress)
    note(f"wrote {path}")
