"""Command that writes the rows of a run in another format: export."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msfp_gen.cli.console import SignOption, note
from msfp_gen.cli.inputs import load_source, result_of
from msfp_gen.common.output import check_output
from msfp_gen.results.sign import DEFAULT, sign_of

app = typer.Typer()


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen export out.nc -o out.csv\n"
    "  msfp-gen export out.nc -o loop.csv --columns displacement_E1,top_force_E1,sliding\n"
    "  msfp-gen export fenz-test2 -o loop.parquet --columns displacement,top_force"
)
def export(
    source: Annotated[
        str, typer.Argument(metavar="RUN", help="A result (.nc); or a scene file or preset, which is run first.")
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="The file to write: .csv or .parquet.")
    ],
    columns: Annotated[
        str | None,
        typer.Option(metavar="NAMES", help="Columns after time, separated by commas: names or whole variables."),
    ] = None,
    sign: SignOption = DEFAULT,
) -> None:
    """Write the rows of a run as CSV or Parquet, with chosen columns."""
    from msfp_gen.results.export import TABLE_WRITERS, export_columns, require_pyarrow

    require_pyarrow(check_output(output, TABLE_WRITERS, "--output"), "--output", ".csv")
    names = None if columns is None else [name.strip() for name in columns.split(",")]
    sign_of(sign, "--sign")
    result, failure = result_of(load_source(source))
    note(f"wrote {export_columns(result, output, names, sign)}")
    if failure is not None:
        raise failure
