"""Commands on results of any program: audit (checks), shadow (the full model under the recorded motion)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msfp_gen.cli.console import AsJson, Output, answer, note, scenes
from msfp_gen.common.output import check_output

app = typer.Typer()

ResultFile = Annotated[
    Path, typer.Argument(metavar="RESULT", help="Time histories: a table of text (.csv, .txt, .out), or a result .nc.")
]
BearingSource = Annotated[
    str,
    typer.Option(metavar="FILE|PRESET", help="The bearing: a scene, a preset, or a data sheet.", autocompletion=scenes),
]
MapFile = Annotated[
    Path | None,
    typer.Option("--map", metavar="FILE.toml", help="Names and units of the columns; default: a CSV of msfp-gen."),
]
PageFile = Annotated[Path | None, typer.Option(metavar="FILE.html", help="Write a page with the evidence drawn.")]


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen audit results.csv --bearing bearing.toml --map map.toml\n"
    "  msfp-gen audit run.nc --bearing scene.toml --page audit.html"
)
def audit(
    result: ResultFile,
    bearing: BearingSource,
    map_: MapFile = None,
    page: PageFile = None,
    as_json: AsJson = False,
) -> None:
    """Check time histories of a bearing, by any program, against mechanics and its data; exit code 1: inconsistent."""
    from msfp_gen.auditing import audit as run_audit
    from msfp_gen.report.frames import REPORT_SUFFIXES

    if page is not None:
        check_output(page, REPORT_SUFFIXES, "--page")
    found = run_audit(result, bearing, map_)
    answer(found.as_dict, found.tables, as_json)
    if page is not None:
        found.page(page)
        note(f"wrote {page}")
    if found.inconsistent:
        raise typer.Exit(1)


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen shadow results.csv --bearing bearing.toml --map map.toml\n"
    "  msfp-gen shadow run.nc --bearing scene.toml --page shadow.html -o model.nc"
)
def shadow(
    result: ResultFile,
    bearing: BearingSource,
    map_: MapFile = None,
    page: PageFile = None,
    output: Output = None,
    as_json: AsJson = False,
) -> None:
    """Drive the full model by a recorded motion and axial force; name effects that the other element lacks."""
    from msfp_gen.auditing.shadow import shadow as run_shadow
    from msfp_gen.report.frames import REPORT_SUFFIXES
    from msfp_gen.results.files import check_result_path, save

    if page is not None:
        check_output(page, REPORT_SUFFIXES, "--page")
    if output is not None:
        check_result_path(output, "--output")
    found = run_shadow(result, bearing, map_)
    answer(found.as_dict, found.tables, as_json)
    if page is not None:
        found.page(page)
        note(f"wrote {page}")
    if output is not None:
        save(found.result, output)
        note(f"wrote {output}")
