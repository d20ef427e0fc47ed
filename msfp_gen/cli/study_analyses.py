"""Subcommands of `study` that evaluate one: ida, fragility, tornado, sobol."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from msfp_gen.cli.console import note, number, parser_of, say, show
from msfp_gen.common.output import FIGURE_SUFFIXES, check_output
from msfp_gen.common.tables import TABLE_SUFFIXES

if TYPE_CHECKING:
    from msfp_gen.common.tables import Table

app = typer.Typer()


def _numbers(text: str) -> tuple[float, ...]:
    return tuple(float(each) for each in text.split(","))


Folder = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a study.")]
Measure = Annotated[str, typer.Option(metavar="COLUMN", help="The intensity measure.")]
Demand = Annotated[str, typer.Option(metavar="COLUMN", help="The demand.")]
Quantity = Annotated[str, typer.Option(metavar="COLUMN", help="The quantity.")]
Statistic = Annotated[str, typer.Option(metavar="median|mean|max|min", help="Over the runs of one sample.")]
Level = Annotated[float, typer.Option(parser=number, metavar="SHARE", help="Confidence of intervals and bands.")]
Where = Annotated[
    list[str] | None,
    typer.Option(metavar="COLUMN=VALUE", help="Only the runs with this value, such as bounds=upper; may be repeated."),
]
Plot = Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the figure: .png, .svg or .pdf.")]
Output = Annotated[
    Path | None, typer.Option("-o", "--output", metavar="FILE", help="Write the numbers: .csv or .parquet.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, every number in SI, and nothing else.")]


@app.command(epilog="Examples:\n\n\b\n  msfp-gen study ida out --demand peak_displacement --plot ida.png")
def ida(
    folder: Folder,
    demand: Demand,
    measure: Measure = "scale",
    fractiles: Annotated[
        Any, typer.Option(parser=parser_of(_numbers, "list of shares"), metavar="SHARES", help="Shares of the runs.")
    ] = "0.16,0.5,0.84",
    where: Where = None,
    plot: Plot = None,
    output: Output = None,
    as_json: AsJson = False,
) -> None:
    """Curves of demand over intensity, one for each record, and their fractiles."""
    from msfp_gen.studies.assessment.figures import plot_ida
    from msfp_gen.studies.assessment.ida import ida as analyse
    from msfp_gen.studies.assessment.ida import ida_table
    from msfp_gen.studies.assessment.rows import chosen_rows, read_study

    _check(plot, output)
    found = analyse(chosen_rows(read_study(folder), where or ()), measure, demand, fractiles)
    plain = found.fractiles.replace(float("inf"), None).to_dict("records")
    content = {"measure": measure, "demand": demand, "unit": found.unit, "fractiles": plain}
    _finish(content, ida_table(found), found.fractiles, partial(plot_ida, found), (plot, output, as_json))


@app.command(
    epilog="Examples:\n\n\b\n"
    "  msfp-gen study fragility out --demand peak_displacement --thresholds 0.15,0.22 --plot fragility.png\n"
    "  msfp-gen study fragility out --demand peak_sliding_1 --thresholds 0.13 --bootstrap 1000 --by bounds"
)
def fragility(
    folder: Folder,
    demand: Demand,
    thresholds: Annotated[
        Any,
        typer.Option(
            parser=parser_of(_numbers, "list of numbers"), metavar="VALUES", help="Damage states: values of the demand."
        ),
    ],
    measure: Measure = "scale",
    early: Annotated[
        str,
        typer.Option(metavar="leave-out|exceed|refuse", help="Runs that ended early below a threshold."),
    ] = "leave-out",
    level: Level = 0.95,
    bootstrap: Annotated[
        int,
        typer.Option(metavar="NUMBER", help="Bands from so many bootstrap samples of whole clusters; 0: likelihood."),
    ] = 0,
    cluster: Annotated[str, typer.Option(metavar="COLUMN", help="What the bootstrap draws as a whole.")] = "record",
    by: Annotated[
        str | None, typer.Option(metavar="COLUMN", help="Curves for each value of a column, such as bounds.")
    ] = None,
    where: Where = None,
    plot: Plot = None,
    output: Output = None,
    as_json: AsJson = False,
) -> None:
    """Lognormal fragility curves by maximum likelihood, with confidence bands, one for each threshold."""
    from msfp_gen.studies.assessment.figures import plot_fragility
    from msfp_gen.studies.assessment.fragility import fragility as analyse
    from msfp_gen.studies.assessment.fragility import fragility_frame, fragility_table
    from msfp_gen.studies.assessment.rows import chosen_rows, read_study

    _check(plot, output)
    rows = chosen_rows(read_study(folder), where or ())
    found = analyse(
        rows, measure, demand, thresholds, early=early, level=level, bootstrap=bootstrap, cluster=cluster, by=by
    )  # fmt: skip
    table, frame = fragility_table(found), fragility_frame(found)
    _finish(found.as_dict(), table, frame, partial(plot_fragility, found), (plot, output, as_json))


@app.command(epilog="Examples:\n\n\b\n  msfp-gen study tornado out --quantity peak_displacement --plot tornado.png")
def tornado(
    folder: Folder,
    quantity: Quantity,
    statistic: Statistic = "median",
    plot: Plot = None,
    output: Output = None,
    as_json: AsJson = False,
) -> None:
    """The change of a quantity with each random axis alone; for `sampling.method = "one-at-a-time"`."""
    from msfp_gen.studies.assessment.figures import plot_tornado
    from msfp_gen.studies.assessment.sensitivity import tornado as analyse
    from msfp_gen.studies.assessment.sensitivity import tornado_table

    _check(plot, output)
    found = analyse(folder, quantity, statistic)
    rows = [vars(bar) for bar in found.bars]
    _finish(asdict(found), tornado_table(found), rows, partial(plot_tornado, found), (plot, output, as_json))


@app.command(epilog="Examples:\n\n\b\n  msfp-gen study sobol out --quantity peak_displacement --plot sobol.png")
def sobol(
    folder: Folder,
    quantity: Quantity,
    statistic: Statistic = "median",
    level: Level = 0.95,
    plot: Plot = None,
    output: Output = None,
    as_json: AsJson = False,
) -> None:
    """First-order and total Sobol' indices of a quantity; for `sampling.method = "sobol-indices"`, with SALib."""
    from msfp_gen.studies.assessment.figures import plot_sobol
    from msfp_gen.studies.assessment.sensitivity import sobol as analyse
    from msfp_gen.studies.assessment.sensitivity import sobol_table

    _check(plot, output)
    found = analyse(folder, quantity, statistic, level)
    columns = ("axes", "first", "first_interval", "total", "total_interval")
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*(getattr(found, c) for c in columns), strict=True)]
    _finish(asdict(found), sobol_table(found), rows, partial(plot_sobol, found), (plot, output, as_json))


def _check(plot: Path | None, output: Path | None) -> None:
    """Refuse paths that cannot be written before anything is read."""
    if plot is not None:
        check_output(plot, FIGURE_SUFFIXES, "--plot")
    if output is not None:
        check_output(output, TABLE_SUFFIXES, "--output")


def _finish(
    content: dict[str, Any],
    table: Table,
    rows: Any,
    draw: Callable[[Path], Any],
    options: tuple[Path | None, Path | None, bool],
) -> None:
    """Print an evaluation, write its rows and draw its figure. options: --plot, --output and --json."""
    import pandas as pd

    from msfp_gen.studies.assessment.rows import write_frame

    plot, output, as_json = options
    if as_json:
        say(json.dumps(content, indent=2, allow_nan=False))
    else:
        show([table])
    if output is not None:
        note(f"wrote {write_frame(pd.DataFrame(rows), output, '--output')}")
    if plot is not None:
        draw(plot)
        note(f"wrote {plot}")
