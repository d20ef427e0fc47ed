"""Commands of many runs: batch; bench work-precision and model-error, which measure error against cost on a scene."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msfp_gen.cli.console import (
    Force,
    SceneName,
    ShownProgress,
    SignOption,
    WorkersOption,
    answer,
    note,
    note_doubts,
    note_written,
    number,
    numbers,
    say,
    scenes,
    show,
    with_field,
)
from msfp_gen.common.errors import RunError
from msfp_gen.common.output import check_output, make_folder
from msfp_gen.common.tables import TABLE_SUFFIXES
from msfp_gen.results.sign import DEFAULT, sign_of, using_sign

if TYPE_CHECKING:
    from msfp_gen.scene.system import System
    from msfp_gen.studies.accuracy.study import ErrorStudy
    from msfp_gen.studies.sweep import Row, Variation

app = typer.Typer()
LONGEST = 80  # characters of the name of a file, without its number


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen batch fenz-test1 fenz-test2 scene.toml -o runs\n"
    "  msfp-gen batch ridgecrest-clc --vary motion.scale=0.5,0.75,1,1.25,1.5 --table scales.csv\n"
    "  msfp-gen batch scene.toml --suite suite.toml --vary bearing.friction=0.05,0.08 --table suite.csv\n"
    "  msfp-gen batch scene.toml --vary top.axial_load=1e6,2e6 --vary solver.rtol=1e-3,1e-4 --workers 4 -o study"
)
def batch(
    sources: Annotated[
        list[str],
        typer.Argument(metavar="SCENE...", help="Scene files (TOML) or names of presets.", autocompletion=scenes),
    ],
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="FIELD=VALUES", help="Run the scene once for each value of a field; may be repeated."),
    ] = None,
    suite: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Run every scene under each ground motion of a suite (TOML); see `suite`."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Write every run to this folder as it ends, as netCDF-4."),
    ] = None,
    table: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write one row for each run, varied fields included: .csv or .parquet."),
    ] = None,
    workers: WorkersOption = None,
    sign: SignOption = DEFAULT,
    force: Force = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print summaries and varied fields as JSON, and nothing else.")
    ] = False,
) -> None:
    """Simulate many scenes, or one with fields varied, on all cores. Ctrl-C keeps the runs that have ended."""
    from msfp_gen.scene.file.loader import load_suite
    from msfp_gen.scene.plausibility import doubts, require_meant, target_doubts
    from msfp_gen.studies.batch import ENDED
    from msfp_gen.studies.sweep import variations, varied_field

    sign_of(sign, "--sign")
    if table is not None:
        check_output(table, TABLE_SUFFIXES, "--table")
    fields = [varied_field(text) for text in vary or ()]
    with ShownProgress("suite") as progress:
        loaded = None if suite is None else load_suite(suite, progress)
    records, target = ((), None) if loaded is None else (loaded.records, loaded.target)
    chosen = [variation for source in sources for variation in variations(source, fields, records)]
    scenes = [variation.scene for variation in chosen]
    require_meant(*scenes, force=force)
    about = target_doubts(target)
    note_doubts([(scene.name, [*about, *doubts(scene)]) for scene in scenes])
    rows: list[Row] = []
    with _reported(rows, len(chosen), table, as_json), using_sign(sign):
        _run(chosen, workers, output, rows)
    if failed := [row.summary for row in sorted(rows) if row.summary["status"] not in ENDED]:
        first = f"{failed[0]['name']}: {failed[0]['message']}"
        raise RunError(f"{len(failed)} of {len(rows)} runs did not reach their end; the first: {first}")


def _run(chosen: Sequence[Variation], workers: int | None, folder: Path | None, rows: list[Row]) -> None:
    """Run all scenes; each run is written, and its row appended to `rows`, as it ends."""
    from msfp_gen.studies.batch import completed_runs
    from msfp_gen.studies.sweep import row_of

    started = completed_runs([variation.scene for variation in chosen], workers)
    if folder is not None:
        make_folder(folder, "--output")
    with ShownProgress(f"{len(chosen)} scenes") as progress, closing(started) as runs:
        for index, result in runs:
            file = None
            if folder is not None and not isinstance(result, RunError):
                file = folder / _file_name(index + 1, len(chosen), result.scene.name)
            row = row_of(index + 1, chosen[index], result, file)
            if file is not None:
                result.save(file)
            rows.append(row)
            progress(len(rows), len(chosen))
    if folder is not None:
        note(f"wrote {sum(bool(row.file) for row in rows)} runs to {folder}")


@contextmanager
def _reported(rows: list[Row], count: int, table: Path | None, as_json: bool) -> Iterator[None]:
    """Print and write the rows at the end of the block, also where it is interrupted or fails."""
    from msfp_gen.results.quantities import value_at
    from msfp_gen.studies.sweep import sweep_table, write_table

    try:
        yield
    finally:
        if rows and as_json:
            say(json.dumps([row.as_dict() for row in sorted(rows)], indent=2, allow_nan=False))
        elif rows:
            show([sweep_table(rows)])
            if exceeded := sum(bool(value_at(row.summary, "verdict.limits")) for row in rows):
                note(f"{exceeded} of {len(rows)} runs exceeded limits of the device; --table FILE names them")
        if rows and table is not None:
            note(f"wrote {write_table(rows, table, '--table')}")
        if 0 < len(rows) < count:
            note(f"{len(rows)} of {count} runs had ended and are kept")


def _file_name(number: int, count: int, name: str) -> str:
    """The name of a run's file: numbered so that names sort, of characters that no shell needs in quotes."""
    plain = re.sub(r"[^A-Za-z0-9._]+", "-", name)[:LONGEST].strip("-.")
    return f"{number:0{len(str(count))}d}-{plain or 'scene'}.nc"


bench = typer.Typer(
    help="Measure error against cost on a scene: of methods and tolerances, and of simplified models.",
    epilog="Examples:\n\n\b\n  msfp-gen bench work-precision fenz-monotonic -o study\n"
    "  msfp-gen bench model-error fenz-test2 -o study",
)
app.add_typer(bench, name="bench")


Tolerances = Annotated[
    str | None, typer.Option(metavar="LIST", help="Tolerances, such as 1e-2,1e-4, instead of the default list.")
]
TimeLimit = Annotated[float, typer.Option(parser=number, metavar="SECONDS", help="Cut off a run after this wall time.")]
Duration = Annotated[
    float | None, typer.Option(parser=number, metavar="SECONDS", help="End the scene after this simulated time.")
]
OutputFolder = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="DIR", help="Write CSV, JSON, Markdown, SVG and PNG to this folder."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, and nothing else.")]


@bench.command(
    "work-precision",
    epilog="Examples:\n\n\b\n  msfp-gen bench work-precision fenz-monotonic -o study\n"
    "  msfp-gen bench work-precision scene.toml --methods implicit,Radau --tolerances 1e-2,1e-4 --limit 5",
)
def work_precision(
    scene: SceneName,
    methods: Annotated[
        str | None, typer.Option(metavar="LIST", help="Methods, such as implicit,dopri5, instead of all.")
    ] = None,
    tolerances: Tolerances = None,
    limit: TimeLimit = 10.0,
    duration: Duration = None,
    output: OutputFolder = None,
    as_json: AsJson = False,
    force: Force = False,
) -> None:
    """Error against cost of every method and tolerance; a second method confirms the reference."""
    from msfp_gen.studies.accuracy.study import TOLERANCES
    from msfp_gen.studies.accuracy.study import work_precision as work

    settings = TOLERANCES if tolerances is None else numbers(tolerances)
    chosen = methods.split(",") if methods else None
    study = partial(work, methods=chosen, tolerances=settings, limit=limit, say=note)
    _report(scene, duration, output, as_json, force, study)


@bench.command(
    "model-error",
    epilog="Examples:\n\n\b\n  msfp-gen bench model-error fenz-test2 -o study\n"
    "  msfp-gen bench model-error scene.toml --tolerances 1e-2,1e-3,1e-4",
)
def model_error(
    scene: SceneName,
    tolerances: Tolerances = None,
    limit: TimeLimit = 10.0,
    duration: Duration = None,
    output: OutputFolder = None,
    as_json: AsJson = False,
    force: Force = False,
) -> None:
    """Error against cost of simplified models: planar, massless, without rims, linearised, OpenSees."""
    from msfp_gen.studies.accuracy.study import MODEL_TOLERANCES, model_errors

    settings = MODEL_TOLERANCES if tolerances is None else numbers(tolerances)
    study = partial(model_errors, tolerances=settings, limit=limit, say=note)
    _report(scene, duration, output, as_json, force, study)


def _report(
    name: str,
    duration: float | None,
    folder: Path | None,
    as_json: bool,
    force: bool,
    study: Callable[[System], ErrorStudy],
) -> None:
    """Load the scene, run the study, print it and write its files."""
    from msfp_gen.common.output import make_folder
    from msfp_gen.scene.file.source import load_scene
    from msfp_gen.scene.plausibility import require_meant
    from msfp_gen.studies.accuracy.study import as_dict, tables, write

    scene = load_scene(name)
    require_meant(scene, force=force)
    if duration is not None:
        scene = with_field(scene, "duration", lambda _: duration)
    if folder is not None:
        make_folder(folder, "--output")
    result = study(scene)
    answer(as_dict(result), tables(result), as_json)
    note_written(write(result, folder) if folder is not None else ())
