"""The command about a run on paper: report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msfp_gen.cli.console import Progress, note, whole
from msfp_gen.errors import InputError, RunError

if TYPE_CHECKING:
    from msfp_gen.result import Result

app = typer.Typer()


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen run fenz-test5 -o out.nc\n  msfp-gen report out.nc -o report.html\n"
    "  msfp-gen report ridgecrest-clc   # runs it first, and writes ridgecrest-clc.html"
)
def report(
    source: Annotated[
        str, typer.Argument(metavar="RUN", help="A result (.nc); or a scene file or preset, which is run first.")
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE.html", help="Where to; default: the name of RUN.")
    ] = None,
    frames: Annotated[
        int | None, typer.Option(parser=whole, metavar="N", help="About so many instants in the view; default 1500.")
    ] = None,
) -> None:
    """Write a run as one HTML file: numbers, settings, figures and the bearing in motion; it needs no network."""
    from msfp_gen.output import check_output
    from msfp_gen.report import FRAMES, REPORT_SUFFIXES, write_report

    count = FRAMES if frames is None else frames
    if not 2 <= count <= MOST:
        raise InputError(f"--frames = {count}: give 2 to {MOST}")
    path = check_output(Path(f"{Path(source).stem}.html") if output is None else output, REPORT_SUFFIXES, "--output")
    result, failure = _result(source)
    if result is None:
        assert failure is not None
        raise failure
    write_report(result, path, count)
    note(f"wrote {path}")
    if failure is not None:
        raise RunError(f"{failure}; the report of what was computed until then is in {path}", status=failure.status)


MOST = 5000  # instants; more would make a page of tens of megabytes


def _result(source: str) -> tuple[Result | None, RunError | None]:
    """A saved result, or the run of a scene; a run that failed is worth a report too."""
    from msfp_gen.result import Result

    if source.lower().endswith(".nc"):
        return Result.from_netcdf(source), None
    from msfp_gen.build import build_model
    from msfp_gen.scenefile import load_scene
    from msfp_gen.simulation import simulate

    scene = load_scene(source)
    build_model(scene.bearing.layout, scene.modelled, progress=note)
    with Progress(scene.name or "run") as progress:
        try:
            return simulate(scene, progress=progress), None
        except RunError as error:
            return error.result if isinstance(error.result, Result) else None, error
