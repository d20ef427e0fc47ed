"""Commands for studies of many runs: study, with its subcommands."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from msfp_gen.cli import study_analyses, study_search
from msfp_gen.cli.console import Progress, note, say, show, whole_number
from msfp_gen.errors import InputError

if TYPE_CHECKING:
    from msfp_gen.studies.study.run import Outcome

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
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, every number in SI, and nothing else.")]
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a study.")]


@group.command(
    epilog="Examples:\n\n\b\n  msfp-gen study study.toml -o out --workers 8\n"
    "  msfp-gen study study.toml -o out --shard $SLURM_ARRAY_TASK_ID/16\n"
    "  msfp-gen study study.toml -o out --dask tcp://10.0.0.1:8786"
)
def run(
    source: Annotated[Path | None, typer.Argument(metavar="FILE", help="A study file (TOML).")] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Folder of the study: part-*.parquet.")
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(parser=whole_number, metavar="NUMBER", help="Runs at the same time; default: one for each core."),
    ] = None,
    threads: Annotated[bool, typer.Option("--threads", help="Threads in place of processes.")] = False,
    dask: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Run on a Dask cluster: its scheduler, or a scheduler file.")
    ] = None,
    mpi: Annotated[
        bool, typer.Option("--mpi", help="Run on MPI processes: mpiexec -n N python -m mpi4py.futures -m msfp_gen ...")
    ] = False,
    shard: Annotated[
        str | None, typer.Option(metavar="I/N", help="Only every N-th chunk, from the I-th; for arrays of jobs.")
    ] = None,
    example: Annotated[bool, typer.Option("--example", help="Print a small study file, to start from.")] = False,
    as_json: AsJson = False,
) -> None:
    """Run what is missing of a study. Ctrl-C at any time: the same command continues."""
    from msfp_gen.studies.study.loader import example_text, load_study
    from msfp_gen.studies.study.run import parsed_shard
    from msfp_gen.studies.study.run import study as run_study

    if example:
        say(example_text().rstrip("\n"))
        return
    if source is None:
        raise InputError("study: no FILE is given; `msfp-gen study --example` prints one to start from")
    if output is None:
        raise InputError("--output is missing: give the folder of the study, such as -o out")
    part = (1, 1) if shard is None else parsed_shard(shard)
    with Progress("records") as progress:
        found = load_study(source, progress)
    try:
        with Progress(f"{found.runs} runs") as progress:
            done = run_study(
                found, output, workers=workers, threads=threads, dask=dask, mpi=mpi, shard=part, progress=progress
            )
    except KeyboardInterrupt:
        note(f"what is done is kept in {output}; the same command continues")
        raise
    _report(done, output, as_json)


def _report(done: Outcome, output: Path, as_json: bool) -> None:
    if as_json:
        say(json.dumps(done._asdict(), indent=2))
        return
    before = f", {done.before} of them before" if done.before else ""
    say(f"{done.before + done.done} of {done.runs} runs are in {output}{before}; {done.failed} failed")
    if done.failed:
        note("runs that failed are rows with their status and message")


@group.command(epilog="Examples:\n\n\b\n  msfp-gen study status out\n  msfp-gen study status out --json")
def status(folder: Folder, as_json: AsJson = False) -> None:
    """How far a study has come, how fast it is, and how long it will still take."""
    from msfp_gen.studies.study.status import status_table, study_status

    found = study_status(folder)
    if as_json:
        say(json.dumps(found.as_dict(), indent=2))
    else:
        show([status_table(found)])


group.add_typer(study_analyses.app)
group.add_typer(study_search.app)
