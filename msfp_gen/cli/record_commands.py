"""Commands for ground motions: record, suite."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msfp_gen.cli.console import ShownProgress, note, note_doubts, note_written, number, show
from msfp_gen.common.errors import InputError, prefixed
from msfp_gen.common.output import FIGURE_SUFFIXES, check_output

if TYPE_CHECKING:
    from msfp_gen.motions.records import Corrected, Record, ScaleTo

app = typer.Typer()


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen record RSN6_180.AT2 RSN6_270.AT2 RSN6_UP.AT2\n"
    "  msfp-gen record x.txt y.txt z.txt --unit cm/s2 --time-step 0.005\n"
    "  msfp-gen record station.v2 --as-is --duration 40\n"
    "  msfp-gen record station.v2 --components E1,E3 --rotated-by 30 -o turned.csv\n"
    "  msfp-gen record ridgecrest-2019-ci-clc --duration 60 --plot correction.png --spectrum spectrum.csv\n"
    '  msfp-gen record quake.v1 --scale-to "sa=0.6 g, period=2.5 s" -o scaled.csv\n'
    '  msfp-gen record quake.v1 --scale-to "sds=1 g, sd1=0.6 g, between=0.5:4, component=rotd50" --spectrum fit.png'
)
def record(
    files: Annotated[
        list[str],
        typer.Argument(metavar="FILE...", help="A record, one file per component, or the name of a bundled one."),
    ],
    unit: Annotated[
        str | None,
        typer.Option(metavar="UNIT", help="Unit of the numbers in files without a header: g, cm/s2, m/s, ..."),
    ] = None,
    time_step: Annotated[
        float | None,
        typer.Option(
            parser=number, metavar="SECONDS", help="Time between rows, where files have no header and no times."
        ),
    ] = None,
    components: Annotated[
        str | None, typer.Option(metavar="E1,E2,E3", help="Components to keep; the others are zero.")
    ] = None,
    rotated_by: Annotated[
        float | None,
        typer.Option(parser=number, metavar="DEGREES", help="Rotate the horizontal components from E1 towards E2."),
    ] = None,
    correct: Annotated[
        bool, typer.Option("--correct", help="Correct the baseline; implied by any option below.")
    ] = False,
    as_is: Annotated[
        bool, typer.Option("--as-is", help="Integrate without correction: for records corrected by their agency.")
    ] = False,
    start: Annotated[
        float | None,
        typer.Option(
            parser=number, metavar="SECONDS", help="Start of the time window.", show_default="strongest window"
        ),
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(parser=number, metavar="SECONDS", help="Length of the time window.", show_default="all"),
    ] = None,
    corner: Annotated[
        float | None, typer.Option(parser=number, metavar="HZ", help="Corner of the high-pass filter; default 0.05.")
    ] = None,
    scale_to: Annotated[
        str | None, typer.Option(metavar="TARGET", help="Scale to a peak, a spectral ordinate, or a spectrum.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the record before and after correction.")
    ] = None,
    spectrum: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the response spectrum: .csv, or a figure.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE.csv", help="Write the accelerations with units.")
    ] = None,
) -> None:
    """Read a ground motion; correct, scale and draw it; print its peaks and its spectrum."""
    for path, name, suffixes in (
        (plot, "--plot", FIGURE_SUFFIXES),
        (spectrum, "--spectrum", (".csv", *FIGURE_SUFFIXES)),
        (output, "--output", (".csv",)),
    ):
        if path is not None:
            check_output(path, suffixes, name)
    if as_is and (correct or corner is not None):
        raise InputError("--as-is: excludes correction; leave out --correct and --corner")
    from msfp_gen.motions.records import Corrected, ScaleTo
    from msfp_gen.motions.records.record_tables import record_tables
    from msfp_gen.scene.plausibility import target_doubts

    target = None if scale_to is None else ScaleTo.parse(scale_to)
    raw = _turned(_read(files, unit, time_step), components, rotated_by)
    process = correct or as_is or plot is not None or any(v is not None for v in (start, duration, corner, target))
    corrected, factor = _prepared(raw, target, start, duration, not as_is, corner) if process else (None, 1.0)
    motion = raw if corrected is None else corrected if target is None else corrected.scaled(factor)
    show(record_tables(raw, motion))
    note_doubts([("", target_doubts(None if target is None else vars(target)))])
    if plot is not None and isinstance(motion, Corrected):
        from msfp_gen.figures import plot_correction

        plot_correction(raw, motion, plot)
    if spectrum is not None:
        _write_spectrum(raw, motion, target, spectrum)
    if output is not None:
        _write_record(raw, motion, output)
    note_written(filter(None, (plot, spectrum, output)))


@app.command(epilog="Example:\n\n\b\n  msfp-gen suite suite.toml --spectrum suite.png")
def suite(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A list of records (TOML): docs/motion.md, Suites.")],
    spectrum: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the spectra, their mean and the target: .png, .svg, .pdf.")
    ] = None,
) -> None:
    """Read a suite of ground motions; scale its mean spectrum to a target; print the factors."""
    if spectrum is not None:
        check_output(spectrum, FIGURE_SUFFIXES, "--spectrum")
    from msfp_gen.motions.records.record_tables import suite_tables
    from msfp_gen.scene.file.loader import load_suite
    from msfp_gen.scene.plausibility import motion_doubts, target_doubts

    with ShownProgress("spectra") as progress:
        loaded = load_suite(file, progress)
    if spectrum is not None and (loaded.scaled is None or len(loaded.scaled.period) == 1):
        raise InputError(f"--spectrum: {file} has no [scale_to] with sds, sd1 and between; give one")
    names, motions = [record.name for record in loaded.records], [record.motion for record in loaded.records]
    show(suite_tables(names, motions, loaded.scaled))
    about = target_doubts(loaded.target)
    note_doubts([(name, [*about, *motion_doubts(motion)]) for name, motion in zip(names, motions, strict=True)])
    if spectrum is not None and loaded.scaled is not None:
        from msfp_gen.figures import plot_response_spectrum

        scaled = loaded.scaled
        curves, target = dict(zip(names, scaled.spectra, strict=True)), (scaled.period, scaled.target)
        title = f"Mean spectrum of {file.name}"
        plot_response_spectrum(scaled.period, curves, spectrum, target=target, mean=scaled.mean, title=title)
        note(f"wrote {spectrum}")


def _read(files: list[str], unit: str | None, time_step: float | None) -> Record:
    from msfp_gen.motions.records import BUNDLED, bundled, read_record

    if len(files) == 1 and files[0] in BUNDLED and unit is None and time_step is None:
        return bundled(files[0])
    return read_record(*files, unit=unit, time_step=time_step)


def _turned(raw: Record, components: str | None, degrees: float | None) -> Record:
    """The record with the chosen components, rotated."""
    if components is not None:
        with prefixed("--"):
            raw = raw.with_components([name.strip() for name in components.split(",")])
    return raw if degrees is None else raw.rotated(math.radians(degrees))


def _prepared(
    raw: Record,
    target: ScaleTo | None,
    start: float | None,
    duration: float | None,
    correct: bool,
    corner: float | None,
) -> tuple[Corrected, float]:
    """The corrected record and its scale factor."""
    from msfp_gen.motions.records import prepared

    with ShownProgress("scale") as progress:
        return prepared(raw, 1.0, target, start, duration, correct, 0.05 if corner is None else corner, 1.0, progress)


def _write_record(raw: Record, motion: Record | Corrected, path: Path) -> None:
    from msfp_gen.motions.records import Corrected, write_csv

    write_csv(motion.as_record(raw) if isinstance(motion, Corrected) else motion, path)


def _write_spectrum(raw: Record, motion: Record | Corrected, target: ScaleTo | None, path: Path) -> None:
    from msfp_gen.motions.records import response_spectrum
    from msfp_gen.motions.records.spectrum import MEASURES

    with ShownProgress("spectrum") as progress:
        spectrum = response_spectrum(motion, progress=progress)
    if path.suffix.lower() == ".csv":
        spectrum.to_csv(path)
        return
    from msfp_gen.figures import plot_response_spectrum

    curves = dict(zip(MEASURES, spectrum.psa.T, strict=True))
    if not raw.acceleration[:, 2].any():
        del curves["E3"]
    design = None if target is None else target.curve(spectrum.period)
    plot_response_spectrum(
        spectrum.period, curves, path, target=design, damping=spectrum.damping, title=raw.name or "Response spectrum"
    )
