"""Commands for assessment: characterise, bound, factors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msfp_gen.cli.console import (
    AsJson,
    Force,
    SceneName,
    ShownProgress,
    SignOption,
    WorkersOption,
    answer,
    build,
    interruptible,
    load_source,
    note,
    note_doubts,
    note_exceeded,
    note_written,
    result_of,
    say,
    show,
)
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.results.sign import DEFAULT, sign_of, using_sign

if TYPE_CHECKING:
    from msfp_gen.studies.calibration import Measurement

app = typer.Typer()


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen characterise fenz-test5\n"
    "  msfp-gen characterise out.nc --json\n  msfp-gen characterise scene.toml -o cycles.csv"
)
def characterise(
    source: Annotated[
        str, typer.Argument(metavar="SCENE", help="A scene file, the name of a preset, or a result (.nc).")
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE.csv", help="Write one row per cycle as CSV.")
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
) -> None:
    """State stiffness, damping, sliding regimes, capacity left, velocity and heat of a run, with envelopes."""
    from msfp_gen.common.output import check_output
    from msfp_gen.results.characterise import CSV_SUFFIXES, write_characterisation

    if output is not None:
        check_output(output, CSV_SUFFIXES, "--output")
    result, failure = result_of(load_source(source), force)
    if failure is not None:
        raise failure
    characterisation = result.characterise()
    answer(characterisation.as_dict(), characterisation.tables(), as_json)
    if output is not None:
        note(f"wrote {write_characterisation(characterisation, output)}")


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen bound fenz-test5\n  msfp-gen bound scene.toml --factors mine.toml -o bounds\n"
    "  msfp-gen bound scene.toml --suite suite.toml -o bounds   # means and envelopes over the records of a suite\n"
    "  msfp-gen bound scene.toml --suite suite.toml -o bounds --leave-out CLC\n"
    "  msfp-gen factors asce7 > mine.toml   # a table to edit"
)
def bound(
    scene: SceneName,
    factors: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|NAME",
            help="A table of factors (TOML), or the name of one; see `factors`. Default: the bounds of the bearing's "
            "data sheet, else asce7.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Write runs, numbers and the figure to this folder."),
    ] = None,
    suite: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Under every motion of a suite (TOML): means, worst values, envelopes."),
    ] = None,
    leave_out: Annotated[
        list[str] | None,
        typer.Option(metavar="RECORD", help="A record of the suite that is not run and in no mean; may be repeated."),
    ] = None,
    workers: WorkersOption = None,
    sign: SignOption = DEFAULT,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Run a scene at lower bound, nominal and upper bound properties, of its data sheet or by factors of a code.

    Under a suite, -o keeps the numbers of each run as it ends: the same command continues where it was interrupted.
    """
    sign_of(sign, "--sign")
    if suite is not None:
        _bound_suite(scene, factors, output, suite, leave_out or (), workers, force, as_json)
        return
    if leave_out or workers is not None:
        raise InputError(f"--{'leave-out' if leave_out else 'workers'}: it is for the runs of a suite; give --suite")
    from msfp_gen.common.output import make_folder
    from msfp_gen.scene.file.source import load_scene
    from msfp_gen.scene.plausibility import doubts, require_meant
    from msfp_gen.studies.bounding import load_factors
    from msfp_gen.studies.bounding import runs as module

    chosen = load_scene(scene)
    table = module.factors_of(chosen) if factors is None else load_factors(factors)
    require_meant(chosen, force=force)  # before anything is written
    cases = module.bounded_scenes(chosen, table)  # refuses a table that does not fit before anything is written
    note_doubts([(name, doubts(case)) for name, case in cases.items()])
    if output is not None:
        make_folder(output, "--output")
    build(chosen)
    with ShownProgress("3 cases") as progress:
        bounds = module.bound(chosen, table, force=force, progress=progress)
    answer(bounds.as_dict(), module.bounding_tables(bounds), as_json)
    if output is not None:
        with using_sign(sign):
            written = [c.result.to_netcdf(output / f"{c.name}.nc") for c in bounds.cases if c.result is not None]
            module.plot_bounds(bounds, output / "bounds.png")
        note_written([*written, module.write_quantities(bounds, output / "bounds.csv"), output / "bounds.png"])
    note_exceeded({case.name: case.result.verdict for case in bounds.cases if case.result is not None})
    if not bounds.succeeded:
        failed = "; ".join(f"{case.name}: {case.failure}" for case in bounds.cases if case.failure)
        raise RunError(f"not all cases could be run; {failed}", status="bound")


@app.command(epilog="Examples:\n\n\b\n  msfp-gen factors\n  msfp-gen factors asce7 > mine.toml")
def factors(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="Print this table as TOML, to edit it.")] = None,
) -> None:
    """List the tables of lambda factors that come with msfp-gen, or print one."""
    from msfp_gen.common.tables import Table
    from msfp_gen.studies.bounding import factor_tables, factor_text

    if name is None:
        show([Table("tables of property-modification factors", (), list(factor_tables().items()))])
    else:
        say(factor_text(name).rstrip("\n"))


def _bound_suite(
    scene: str,
    factors: str | None,
    output: Path | None,
    suite: Path,
    leave_out: Sequence[str],
    workers: int | None,
    force: bool,
    as_json: bool,
) -> None:
    """`bound` under every motion of a suite: numbers and the figure, without the rows in time of the runs."""
    from msfp_gen.common.output import make_folder
    from msfp_gen.common.tables import Table
    from msfp_gen.scene.file.source import load_scene
    from msfp_gen.scene.plausibility import require_meant
    from msfp_gen.studies.bounding import factors_of
    from msfp_gen.studies.bounding import suite as module

    chosen = factors_of(load_scene(scene)).name if factors is None else factors
    with ShownProgress("suite") as progress:
        study = module.suite_study(scene, suite, chosen, progress)
    module.check_left_out(leave_out, study)
    scenes = module.suite_scenes(study, leave_out)
    require_meant(*(scene for _, scene in scenes), force=force)
    note_doubts(module.suite_doubts(study, scenes))
    if output is not None:
        make_folder(output, "--output")
    build(study.scene(1))
    count = len(study.inputs.records) - len(set(leave_out))
    with interruptible(output), ShownProgress(f"{count} record{'s' * (count > 1)} at their bounds") as update:
        bounds = module.bound_suite(  # force: values have been judged
            study, output, leave_out=leave_out, workers=workers, force=True, progress=update
        )
    uplift = [Table("uplift", (), [(line,) for line in module.uplift_words(bounds)])]
    answer(bounds.as_dict(), [*module.suite_bound_tables(bounds), *uplift], as_json)
    if output is not None:
        module.plot_suite_bounds(bounds, output / "suite.png")
        numbers = module.write_statistics(bounds, output / "suite.csv")
        note_written([numbers, module.write_records(bounds, output / "records.csv"), output / "suite.png"])
    if bounds.failures:
        records = dict.fromkeys(record for record, _ in bounds.failures)
        (record, case), message = next(iter(bounds.failures.items()))
        count = len(bounds.failures)
        what = "1 run did not reach its end" if count == 1 else f"{count} runs did not reach their end; the first"
        others = "".join(f" --leave-out {record}" for record in records) if len(records) < len(bounds.records) else ""
        remedy = f"; for numbers of the other records:{others}" if others else ""
        raise RunError(f"{what}: {record}, {case}: {message}{remedy}")


@app.command(
    epilog="Examples:\n\n\b\n"
    '  msfp-gen fit scene.toml test1.csv test2.csv --parameters "bearing.friction[*]" -o fitted --report fit.html\n'
    '  msfp-gen fit scene.toml test.csv --parameters "friction[0],friction[1]=friction[2]" --offset\n'
    '  msfp-gen fit scene.toml test.csv -p "friction[*]" --column "force=Load cell" --bounds "friction[*]=0.01:0.2"'
)
def fit(
    scene: SceneName,
    tests: Annotated[
        list[Path],
        typer.Argument(metavar="TEST.csv...", help="Tests: tables of time, displacement and force, with units."),
    ],
    parameters: Annotated[
        list[str],
        typer.Option("-p", "--parameters", metavar="PATHS", help="What to fit; A=B gives one value to both."),
    ],
    bounds: Annotated[
        list[str] | None,
        typer.Option(metavar="PATH=LOW:HIGH", help="Range of a parameter [SI]; default: a tenth to ten times."),
    ] = None,
    column: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=HEADER", help="Header of time, displacement or force, if it has another name."),
    ] = None,
    axial_load: Annotated[
        str | None, typer.Option(metavar="LIST", help="Axial load of each test [N], instead of the scene's.")
    ] = None,
    weights: Annotated[str | None, typer.Option(metavar="LIST", help="Weight of each test; default 1.")] = None,
    offset: Annotated[bool, typer.Option("--offset", help="Fit an offset of the force of each test too.")] = False,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Write the fitted scene, numbers, residuals and a figure."),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(metavar="FILE.html", help="Write a page with values, limits, loops and residuals; no network."),
    ] = None,
    sign: SignOption = DEFAULT,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Fit friction and other values of a scene to laboratory tests, with 95 % intervals.

    Runs have the solver.rtol of the scene, then smaller ones until their error is small against the intervals.
    """
    from msfp_gen.common.output import check_output, make_folder
    from msfp_gen.report import REPORT_SUFFIXES, write_fit_report
    from msfp_gen.scene.file.source import load_bearing_scene
    from msfp_gen.studies.calibration.fit_result import fit_tables
    from msfp_gen.studies.calibration.fitting import end_fit, start_fit

    sign_of(sign, "--sign")
    if report is not None:
        check_output(report, REPORT_SUFFIXES, "--report")
    chosen = load_bearing_scene(scene)
    read = _measurements(tests, column or (), axial_load, weights)
    paths = [path for text in parameters for path in text.split(",")]
    limits = dict(_limits(text) for text in bounds or ())
    # Bad input is refused before anything is built or written.
    prepared = start_fit(chosen, read, paths, limits, offset, force=force)
    if output is not None:
        make_folder(output, "--output")
    for fitted_scene in prepared.scenes:
        build(fitted_scene, gradients=True)
        build(fitted_scene)  # tighter runs at the end have no derivatives
    line = ShownProgress("fit")
    with line as update:

        def show_evaluation(count: int, share: float, deviation: float) -> None:
            line.name = f"evaluation {count}" + (f", deviation {deviation:.4g} N" if deviation == deviation else "")
            update(share, 1.0)

        prepared.progress = show_evaluation
        result = end_fit(chosen, prepared)
    answer(result.as_dict(), fit_tables(result), as_json)
    with using_sign(sign):
        written = [] if output is None else result.save(output)
        note_written([*written, *([] if report is None else [write_fit_report(result, report)])])


def _measurements(
    paths: Sequence[Path], columns: Sequence[str], loads: str | None, weights: str | None
) -> list[Measurement]:
    """The tests in some files, with the options of the command line."""
    from msfp_gen.studies.calibration import read_measurement

    names = {}
    for text in columns:
        name, equals, header = text.partition("=")
        if not equals or not header.strip():
            raise InputError(f"--column = {text!r}: give the column and its header: force=Load cell [kN]")
        names[name.strip()] = header.strip()
    read = [read_measurement(path, names) for path in paths]
    of_loads: Sequence[float | None] = _numbers("--axial-load", loads, len(read)) or [test.axial_load for test in read]
    of_weights = _numbers("--weights", weights, len(read)) or [test.weight for test in read]
    return [
        replace(test, axial_load=load, weight=weight)
        for test, load, weight in zip(read, of_loads, of_weights, strict=True)
    ]


def _numbers(option: str, text: str | None, count: int) -> list[float] | None:
    """The numbers of a list separated by commas: one for each test."""
    if text is None:
        return None
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != count:
        raise InputError(f"{option} = {text!r}: give {count} numbers separated by commas, one for each test")
    return values


def _limits(text: str) -> tuple[str, tuple[float, float]]:
    """Path and range of an option --bounds."""
    path, _, limits = text.rpartition("=")
    try:
        low, high = (float(part) for part in limits.split(":"))
    except ValueError:
        path, low, high = "", 0.0, 0.0
    if not path.strip():
        raise InputError(f"--bounds = {text!r}: give a parameter and its range: bearing.friction[0]=0.01:0.2")
    return path.strip(), (low, high)
