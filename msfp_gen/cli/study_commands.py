"""Commands for studies of many runs: study, with the subcommands that run, watch and evaluate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from msfp_gen.cli.console import (
    AsJson,
    Force,
    ShownProgress,
    WorkersOption,
    answer,
    interruptible,
    note,
    note_doubts,
    number,
    numbers,
    say,
)
from msfp_gen.common.errors import InputError
from msfp_gen.common.output import FIGURE_SUFFIXES, check_output
from msfp_gen.common.tables import TABLE_SUFFIXES

if TYPE_CHECKING:
    from msfp_gen.common.tables import Table
    from msfp_gen.studies.definition import Study
    from msfp_gen.studies.run import Outcome

app = typer.Typer()


class _StudyGroup(TyperGroup):
    """A group whose first word is a subcommand, or else the file of a study to run."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        own = {name for parameter in self.params for name in parameter.opts} | {"--help"}
        if args and args[0] not in self.commands and args[0] not in own:
            args = ["run", *args]
        return super().parse_args(ctx, args)


group = typer.Typer(cls=_StudyGroup, no_args_is_help=True)
app.add_typer(
    group,
    name="study",
    help="Run a study of many runs: `msfp-gen study FILE -o DIR`; the same command continues it. Its options: "
    "`msfp-gen study run --help`.",
    epilog="Examples:\n\n\b\n"
    "  msfp-gen study --example > study.toml\n  msfp-gen study study.toml -o out\n"
    "  msfp-gen study status out",
)


Folder = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a study.")]
Measure = Annotated[str, typer.Option(metavar="COLUMN", help="The intensity measure.")]
Demand = Annotated[str, typer.Option(metavar="COLUMN", help="The demand.")]
QuantityColumn = Annotated[str, typer.Option(metavar="COLUMN", help="The quantity.")]
StatisticWord = Annotated[str, typer.Option(metavar="median|mean|max|min", help="Over the runs of one sample.")]
Level = Annotated[float, typer.Option(parser=number, metavar="SHARE", help="Confidence of intervals and bands.")]
Where = Annotated[
    list[str] | None,
    typer.Option(metavar="COLUMN=VALUE", help="Only the runs with this value, such as bounds=upper; may be repeated."),
]
Plot = Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the figure: .png, .svg or .pdf.")]
Output = Annotated[
    Path | None, typer.Option("-o", "--output", metavar="FILE", help="Write the numbers: .csv or .parquet.")
]
Dask = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Run on a Dask cluster: its scheduler, or a scheduler file.")
]


@group.command(
    epilog="Examples:\n\n\b\n  msfp-gen study study.toml -o out --workers 8\n"
    "  msfp-gen study study.toml -o out --shard $SLURM_ARRAY_TASK_ID/16\n"
    "  msfp-gen study study.toml -o out --dask tcp://10.0.0.1:8786\n"
    "  msfp-gen study study.toml -o out --estimate peak_displacement --target 2%"
)
def run(
    source: Annotated[Path | None, typer.Argument(metavar="FILE", help="A study file (TOML).")] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Folder of the study: part-*.parquet.")
    ] = None,
    workers: WorkersOption = None,
    dask: Dask = None,
    shard: Annotated[
        str | None, typer.Option(metavar="I/N", help="Only every N-th chunk, from the I-th; for arrays of jobs.")
    ] = None,
    example: Annotated[bool, typer.Option("--example", help="Print a small study file, to start from.")] = False,
    estimate: Annotated[
        str | None,
        typer.Option(metavar="COLUMN", help="Estimate a statistic of this quantity with few exact runs ([accuracy])."),
    ] = None,
    statistic: Annotated[
        str | None, typer.Option(metavar="mean|probability", help="StatisticWord to estimate.")
    ] = None,
    threshold: Annotated[
        str | None, typer.Option(metavar="VALUE", help="Value to be reached, for a probability.")
    ] = None,
    target: Annotated[
        str | None, typer.Option(metavar="SHARE", help="Half width of the interval over the value, such as 2%.")
    ] = None,
    budget: Annotated[
        str | None, typer.Option(metavar="TIME", help="Core time of the estimate, such as 10min.")
    ] = None,
    plot: Plot = None,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Run what is missing of a study, or estimate a statistic of it. Ctrl-C at any time: the same command continues."""
    from msfp_gen.scene.plausibility import require_meant
    from msfp_gen.studies import run as module
    from msfp_gen.studies.definition import example_text, load_study, study_doubts

    if example:
        say(example_text().rstrip("\n"))
        return
    if source is None:
        raise InputError("study: no FILE is given; `msfp-gen study --example` prints one to start from")
    if output is None:
        raise InputError("--output is missing: give the folder of the study, such as -o out")
    part = (1, 1) if shard is None else module.parsed_shard(shard)
    with ShownProgress("records") as progress:
        definition = load_study(source, progress)
    question = {
        "quantity": estimate, "statistic": statistic, "threshold": threshold, "target": target, "budget": budget,
    }  # fmt: skip
    estimated = "accuracy" in definition.table or any(value is not None for value in question.values())
    if estimated and shard is not None:
        raise InputError("--shard: the runs of an estimate depend on those before; give --workers or --dask")
    if plot is not None and not estimated:
        raise InputError("--plot: it draws an estimate; give --estimate too")
    require_meant(*definition.ends, force=force)
    note_doubts(study_doubts(definition))
    engine: dict[str, Any] = {"workers": workers, "dask": dask, "force": True}  # values have been judged
    if estimated:
        _estimate(definition, output, question | engine, plot, as_json)
        return
    with interruptible(output), ShownProgress(f"{definition.runs} runs") as progress:
        done = module.study(definition, output, shard=part, progress=progress, **engine)
    judged = any(column.name == "limits_exceeded" for column in definition.keep.columns)
    _report(done, output, as_json, judged)


def _estimate(definition: Study, output: Path, options: dict[str, Any], plot: Path | None, as_json: bool) -> None:
    """Estimate a statistic of a study and print it, in ten lines. options: of `estimate`."""
    from msfp_gen.studies.estimation.estimate import estimate, estimate_table, plot_estimate

    _check(plot, None)
    with interruptible(output):
        result = estimate(definition, output, **options)
    answer(result.as_dict(), [estimate_table(result)], as_json)
    for line in result.notes:
        note(line)
    if plot is not None:
        plot_estimate(result, plot)
        note(f"wrote {plot}")


def _report(done: Outcome, output: Path, as_json: bool, judged: bool) -> None:
    """Print how far the study is; `judged`: and how many of its runs exceeded limits of the device."""
    if as_json:
        answer(done._asdict(), [], as_json)
        return
    before = f", {done.before} of them before" if done.before else ""
    say(f"{done.before + done.done} of {done.runs} runs are in {output}{before}; {done.failed} failed")
    if done.failed:
        note("runs that failed are rows with their status and message")
    if judged and done.before + done.done:
        from msfp_gen.studies import read_study

        limits = read_study(output, ["limits_exceeded"])["limits_exceeded"].fillna("")
        if exceeded := int((limits != "").sum()):
            note(f"{exceeded} of the runs exceeded limits of the device: see the column limits_exceeded")


@group.command(epilog="Examples:\n\n\b\n  msfp-gen study status out\n  msfp-gen study status out --json")
def status(folder: Folder, as_json: AsJson = False) -> None:
    """State how far a study has come, how fast it is, and how long it will still take."""
    from msfp_gen.studies.run import status_table, study_status

    progress = study_status(folder)
    answer(progress.as_dict(), [status_table(progress)], as_json)


@group.command(epilog="Examples:\n\n\b\n  msfp-gen study ida out --demand peak_displacement --plot ida.png")
def ida(
    folder: Folder,
    demand: Demand,
    measure: Measure = "scale",
    fractiles: Annotated[
        Any, typer.Option(parser=numbers, metavar="SHARES", help="Shares of the runs.")
    ] = "0.16,0.5,0.84",
    where: Where = None,
    plot: Plot = None,
    output: Output = None,
    as_json: AsJson = False,
) -> None:
    """Draw curves of demand over intensity, one for each record, and their fractiles."""
    from msfp_gen.studies.assessment import ida as module
    from msfp_gen.studies.assessment.rows import chosen_rows, read_study

    _check(plot, output)
    result = module.ida(chosen_rows(read_study(folder), where or ()), measure, demand, fractiles)
    plain = result.fractiles.replace(float("inf"), None).to_dict("records")
    content = {"measure": measure, "demand": demand, "unit": result.unit, "fractiles": plain}
    draw = partial(module.plot_ida, result)
    _finish(content, module.ida_table(result), result.fractiles, draw, (plot, output, as_json))


@group.command(
    epilog="Examples:\n\n\b\n"
    "  msfp-gen study fragility out --demand peak_displacement --thresholds 0.15,0.22 --plot fragility.png\n"
    "  msfp-gen study fragility out --demand peak_sliding_1 --thresholds 0.13 --bootstrap 1000 --by bounds"
)
def fragility(
    folder: Folder,
    demand: Demand,
    thresholds: Annotated[
        Any,
        typer.Option(parser=numbers, metavar="VALUES", help="Damage states: values of the demand."),
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
    """Fit lognormal fragility curves by maximum likelihood, with confidence bands, one for each threshold."""
    from msfp_gen.studies.assessment import fragility as module
    from msfp_gen.studies.assessment.rows import chosen_rows, read_study

    _check(plot, output)
    rows = chosen_rows(read_study(folder), where or ())
    result = module.fragility(
        rows, measure, demand, thresholds, early=early, level=level, bootstrap=bootstrap, cluster=cluster, by=by
    )  # fmt: skip
    table, frame, draw = module.fragility_table(result), module.fragility_frame(result), module.plot_fragility
    _finish(result.as_dict(), table, frame, partial(draw, result), (plot, output, as_json))


@group.command(epilog="Examples:\n\n\b\n  msfp-gen study tornado out --quantity peak_displacement --plot tornado.png")
def tornado(
    folder: Folder,
    quantity: QuantityColumn,
    statistic: StatisticWord = "median",
    plot: Plot = None,
    output: Output = None,
    as_json: AsJson = False,
) -> None:
    """State the change of a quantity with each random axis alone; for `sampling.method = "one-at-a-time"`."""
    from msfp_gen.studies.assessment import sensitivity as module

    _check(plot, output)
    result = module.tornado(folder, quantity, statistic)
    table, rows, draw = module.tornado_table(result), [vars(bar) for bar in result.bars], module.plot_tornado
    _finish(asdict(result), table, rows, partial(draw, result), (plot, output, as_json))


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
    answer(content, [table], as_json)
    if output is not None:
        note(f"wrote {write_frame(pd.DataFrame(rows), output, '--output')}")
    if plot is not None:
        draw(plot)
        note(f"wrote {plot}")
