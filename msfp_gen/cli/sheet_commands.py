"""Commands of design without runs: sheet, what follows from the data sheet of a bearing."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msfp_gen.cli.console import answer, note
from msfp_gen.common.errors import InputError

app = typer.Typer()

SheetFile = Annotated[
    Path, typer.Argument(metavar="FILE", help="A scene file (TOML), or one with [bearing] sheet alone.")
]


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen sheet scene.toml\n"
    '  msfp-gen sheet scene.toml --displacement "300 mm" --displacement "450 mm" -o sheet.png'
)
def sheet(
    file: SheetFile,
    displacement: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LENGTH", help="Where effective properties are wanted; default: quarters of the capacity."
        ),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Draw it: a .png, .svg or .pdf.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, and nothing else.")] = False,
) -> None:
    """State what follows from the data sheet of a bearing: geometry, masses, backbone, effective properties."""
    from msfp_gen.common.fields import Quantity
    from msfp_gen.common.output import FIGURE_SUFFIXES, check_output
    from msfp_gen.scene.file.loader import load_sheet
    from msfp_gen.scene.sheet_tables import SheetReport

    if output is not None:
        check_output(output, FIGURE_SUFFIXES, "--output")
    wanted = []
    for text in displacement or ():
        try:
            wanted.append(Quantity("m", above=0.0).parse(text, text=True))
        except ValueError as error:
            raise InputError(f"--displacement = {text!r}: {error}") from None
    name, data, bearing = load_sheet(file)
    report = SheetReport(name, data, bearing, wanted)
    answer(report.as_dict(), report.tables, as_json)
    if output is not None:
        from msfp_gen.figures import plot_sheet

        plot_sheet(report, output)
        note(f"wrote {output}")
