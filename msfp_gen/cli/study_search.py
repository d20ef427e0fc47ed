"""Subcommand of `study` that searches designs: pareto."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from msfp_gen.cli.console import Progress, note, say, show, whole_number
from msfp_gen.cli.study_analyses import AsJson, Plot, Statistic
from msfp_gen.common.output import FIGURE_SUFFIXES, check_output
from msfp_gen.errors import InputError

app = typer.Typer()


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen study pareto study.toml -o search --minimise peak_displacement "
    "--minimise peak_force_ratio\n"
    "  msfp-gen study pareto study.toml -o search --minimise peak_force_ratio --maximise effective_damping "
    "--at-most peak_sliding_1=0.12 --plot front.png"
)
def pareto(
    source: Annotated[Path, typer.Argument(metavar="FILE", help="A study file (TOML); random axes are the variables.")],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="Folder of the search: designs.parquet, and all runs.")
    ],
    minimise: Annotated[list[str] | None, typer.Option(metavar="COLUMN", help="An objective; may be repeated.")] = None,
    maximise: Annotated[list[str] | None, typer.Option(metavar="COLUMN", help="An objective; may be repeated.")] = None,
    at_most: Annotated[
        list[str] | None, typer.Option(metavar="COLUMN=VALUE", help="A limit of feasible designs; may be repeated.")
    ] = None,
    population: Annotated[int, typer.Option(metavar="NUMBER", help="Designs of a generation.")] = 32,
    generations: Annotated[int, typer.Option(metavar="NUMBER", help="Generations, the first included.")] = 20,
    seed: Annotated[int, typer.Option(metavar="NUMBER", help="Of the search.")] = 0,
    statistic: Statistic = "max",
    workers: Annotated[
        int | None,
        typer.Option(parser=whole_number, metavar="NUMBER", help="Runs at the same time; default: one for each core."),
    ] = None,
    threads: Annotated[bool, typer.Option("--threads", help="Threads in place of processes.")] = False,
    dask: Annotated[str | None, typer.Option(metavar="ADDRESS", help="Run on a Dask cluster.")] = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """Search the random axes of a study for the Pareto front of its quantities, by NSGA-II of pymoo."""
    from msfp_gen.studies.assessment.figures import plot_pareto
    from msfp_gen.studies.assessment.pareto import DESIGNS, Goals, front_table
    from msfp_gen.studies.assessment.pareto import pareto as search

    if plot is not None:
        check_output(plot, FIGURE_SUFFIXES, "--plot")
    goals = Goals(tuple(minimise or ()), tuple(maximise or ()), dict(map(_limit, at_most or ())), statistic)
    with Progress(f"{generations} generations") as progress:
        found = search(
            source, output, goals, population=population, generations=generations, seed=seed, progress=progress,
            workers=workers, threads=threads, dask=dask,
        )  # fmt: skip
    if as_json:
        say(json.dumps(found.designs[found.designs.front].to_dict("records"), indent=2, allow_nan=False))
    else:
        show([front_table(found)])
    note(f"wrote {output / DESIGNS}")
    if plot is not None:
        plot_pareto(found, plot)
        note(f"wrote {plot}")


def _limit(text: str) -> tuple[str, float]:
    """Column and value of COLUMN=VALUE. Raises InputError."""
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise InputError(f"--at-most = {text!r}: give a column and a number, such as peak_sliding_1=0.12") from None
