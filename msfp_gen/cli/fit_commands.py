"""Command for calibration to tests: fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msfp_gen.cli.console import AsJson, Progress, SceneName, answer, note_written
from msfp_gen.cli.inputs import build
from msfp_gen.errors import InputError

if TYPE_CHECKING:
    from msfp_gen.studies.calibration import Measurement

app = typer.Typer()


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
    as_json: AsJson = False,
) -> None:
    """Fit friction and other values of a scene to laboratory tests, with 95 % intervals.

    Runs have the solver.rtol of the scene, then smaller ones until their error is small against the intervals.
    """
    from msfp_gen.buildings.load import load_bearing_scene
    from msfp_gen.common.output import check_output, make_folder
    from msfp_gen.report import REPORT_SUFFIXES, write_fit_report
    from msfp_gen.studies.calibration.fit_result import fit_tables
    from msfp_gen.studies.calibration.fitting import end_fit, start_fit

    if report is not None:
        check_output(report, REPORT_SUFFIXES, "--report")
    chosen = load_bearing_scene(scene)
    read = _measurements(tests, column or (), axial_load, weights)
    paths = [path for text in parameters for path in text.split(",")]
    limits = dict(_limits(text) for text in bounds or ())
    prepared = start_fit(chosen, read, paths, limits, offset)  # refuses bad input before anything is built or written
    if output is not None:
        make_folder(output, "--output")
    for fitted_scene in prepared.scenes:
        build(fitted_scene, gradients=True)
        build(fitted_scene)  # tighter runs at the end have no derivatives
    line = Progress("fit")
    with line as update:

        def show_evaluation(count: int, share: float, deviation: float) -> None:
            assert update is not None
            line.name = f"evaluation {count}" + (f", deviation {deviation:.4g} N" if deviation == deviation else "")
            update(share, 1.0)

        prepared.progress = None if update is None else show_evaluation
        result = end_fit(chosen, prepared)
    answer(result.as_dict(), fit_tables(result), as_json)
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
    options = {
        "axial_load": _numbers("--axial-load", loads, len(read)),
        "weight": _numbers("--weights", weights, len(read)),
    }
    for name, values in options.items():
        if values is not None:
            read = [replace(test, **{name: value}) for test, value in zip(read, values, strict=True)]  # type: ignore[arg-type]
    return read


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
