"""Commands of design without runs: sheet (what follows from a data sheet), equivalent (displacement by a spectrum)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from msfp_gen.cli.console import answer, is_result, load_source, note
from msfp_gen.common.errors import InputError, prefixed
from msfp_gen.common.fields import Quantity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from msfp_gen.scene.bearing import Bearing

app = typer.Typer()

SheetFile = Annotated[
    Path, typer.Argument(metavar="FILE", help="A scene file (TOML), or one with [bearing] sheet alone.")
]

OfBuilding = Annotated[
    str | None,
    typer.Option("--bearing", metavar="NAME", help="Which of [bearings], where a building has several sheets."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON, and nothing else.")]


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
    bearing: OfBuilding = None,
    as_json: AsJson = False,
) -> None:
    """State what follows from the data sheet of a bearing: geometry, masses, backbone, effective properties."""
    from msfp_gen.common.output import FIGURE_SUFFIXES, check_output
    from msfp_gen.design.sheet import SheetReport
    from msfp_gen.scene.file.loader import load_sheet

    if output is not None:
        check_output(output, FIGURE_SUFFIXES, "--output")
    wanted = []
    for text in displacement or ():
        try:
            wanted.append(Quantity("m", above=0.0).parse(text, text=True))
        except ValueError as error:
            raise InputError(f"--displacement = {text!r}: {error}") from None
    report = SheetReport(*load_sheet(file, bearing), wanted)
    answer(report.as_dict(), report.tables, as_json)
    if output is not None:
        from msfp_gen.figures import plot_sheet

        plot_sheet(report, output)
        note(f"wrote {output}")


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen equivalent scene.toml --spectrum design.csv --damping asce7\n"
    "  msfp-gen equivalent scene.toml --spectrum design.csv --damping 0.05:1,0.1:1.2,0.2:1.5,0.3:1.7\n"
    '  msfp-gen equivalent scene.toml --spectrum design.csv --torsion "7.3 m,0.73 m,14.6 m,14.6 m"\n'
    "  msfp-gen equivalent scene.toml --spectrum design.csv --history bounds   # of `bound --suite -o bounds`"
)
def equivalent(
    file: SheetFile,
    spectrum: Annotated[
        Path, typer.Option(metavar="FILE.csv", help="Spectrum of 5 % damping: columns period [s], Sa [g].")
    ],
    damping: Annotated[
        str, typer.Option(metavar="NAME|PAIRS", help="Factors of damping: asce7, aashto, en1998, or RATIO:FACTOR,...")
    ] = "asce7",
    torsion: Annotated[
        str | None,
        typer.Option(
            metavar="Y,E,B,D[,P_T]", help="Total displacement: arm, eccentricity, plan [m]; ratio of periods."
        ),
    ] = None,
    history: Annotated[
        Path | None,
        typer.Option(
            metavar="RESULT.nc|DIR",
            help="A run, or the folder of `bound --suite -o DIR`, whose peaks are compared with the procedure.",
        ),
    ] = None,
    leave_out: Annotated[
        list[str] | None,
        typer.Option(metavar="RECORD", help="A record of the suite of --history that is in no mean; may be repeated."),
    ] = None,
    bearing: OfBuilding = None,
    as_json: AsJson = False,
) -> None:
    """Equivalent lateral procedure: displacement and base shear from a spectrum, at each bound of friction."""
    from msfp_gen.design import equivalent as procedure
    from msfp_gen.design.sheet import CASES, SheetReport
    from msfp_gen.motions.records.scaling import read_spectrum
    from msfp_gen.scene.file.loader import load_sheet

    pairs, (factor, rule) = read_spectrum(spectrum), procedure.damping_of(damping)
    arms = None if torsion is None else _lengths(torsion)
    report = SheetReport(*load_sheet(file, bearing))
    gravity = report.bearing.gravity
    found = {case: procedure.equivalent(b, pairs, factor, gravity) for case, b in report.backbones.items()}
    if leave_out and not (history and history.is_dir()):
        raise InputError("--leave-out: it is for the records of a suite; give its folder to --history")
    peaks, words = ({}, "") if history is None else _peaks(history, leave_out or (), list(found))
    bearings, weight = _on_bearings(file, report.bearing)
    given = procedure.Given(
        load=report.sheet.axial_load,
        gravity=gravity,
        friction={case: getattr(report.sheet, name) for case, name in CASES.items()},
        spectrum=f"{spectrum.name}, {len(pairs)} rows from {pairs[0][0]:g} to {pairs[-1][0]:g} s, linear in logarithms",
        damping=rule,
        bearings=bearings,
        weight=weight,
        arms=arms,
        peaks=peaks,
        history=words,
    )
    answer(procedure.as_dict(found, given), procedure.tables(report.name, found, given), as_json)


def _lengths(text: str) -> tuple[float, ...]:
    """y, e, b, d [m] and P_T of the total displacement. Raises InputError."""
    words = text.split(",")
    if len(words) not in (4, 5):
        raise InputError(f"--torsion = {text!r}: give y,e,b,d [m] or y,e,b,d,P_T")
    values = []
    for word, unit in zip(words, ("m", "m", "m", "m", ""), strict=False):
        try:
            plain = not word.strip().replace(".", "", 1).isdigit()
            values.append(Quantity(unit, least=0.0).parse(word.strip() if plain else float(word), text=True))
        except ValueError as error:
            raise InputError(f"--torsion = {text!r}: {word.strip()!r}: {error}") from None
    return tuple(values)


def _on_bearings(file: Path, bearing: Bearing) -> tuple[str, float | None]:
    """The bearings of a building in words, and their load at rest if all are this one [N]; "", None without one."""
    from msfp_gen.scene.file.loader import toml_file
    from msfp_gen.scene.file.source import kind_of, scene_of

    with prefixed(f"{file}: "):
        table = toml_file(file)
        kind = kind_of(table)
        if kind is None:
            return "", None
        # Loads at rest need no ground motion, and a project may have no records yet.
        unused = {"kind": "ramp", "acceleration": 1.0, "duration": 1.0}
        tables = {key: table[key] for key in (kind.key, kind.named) if key in table}
        scene = scene_of({**tables, "motion": unused}, file.parent)
    weight, count = sum(scene.loads_at_rest), len(scene.every_bearing)
    equal = sum(each == bearing for each in scene.every_bearing)
    if equal < count:
        return f"{equal} of {count} are of this sheet, so that no base shear of the building follows", None
    return f"{count}, all of this sheet; weight on them {weight / 1e6:.4g} MN", weight


def _peaks(path: Path, leave_out: Sequence[str], cases: Sequence[str]) -> tuple[dict[str, tuple[float, float]], str]:
    """Case -> largest displacement of a bearing [m] and base shear over weight, of a run or suite; and their words."""
    from msfp_gen.report.analysis import is_suite_folder

    if is_suite_folder(path):
        return _means(path, leave_out, cases)
    result: Any = load_source(str(path))
    if not is_result(result):
        raise InputError(f"--history = {str(path)!r}: give a saved result (.nc), or the folder of `bound --suite`")
    if not result.succeeded:
        raise InputError(f"--history = {str(path)!r}: its run failed ({result.status}); give one that reached its end")
    shear = result.entry("peak_force_ratio")
    if shear is None:
        raise InputError(f"--history = {str(path)!r}: its axial load changes; give a run with a load at rest")
    peaks = (result.entry("peak_displacement")["radial"], shear)
    return dict.fromkeys(cases, peaks), f"{path.name}, one run, compared at every friction"


def _means(folder: Path, leave_out: Sequence[str], cases: Sequence[str]) -> tuple[dict[str, tuple[float, float]], str]:
    """The peaks of a suite at bounds: means over its records at each bound. Raises InputError for other bounds."""
    from msfp_gen.studies.bounding import SHEET, suite_peaks

    bounds, means = suite_peaks(folder, leave_out)
    if len(cases) > 1 and bounds.factors != SHEET.name:
        raise InputError(
            f"--history = {str(folder)!r}: its bounds are by {bounds.factors}, not by the sheet; give the folder of "
            "`bound --suite` without --factors"
        )
    count = len(bounds.records)
    parts = [f"{folder.name}: mean of {count} record{'s' * (count > 1)} at each bound"]
    parts += [f"{case} {text}" for case, text in bounds.incomplete.items() if case in cases]
    parts += [f"left out: {', '.join(bounds.left_out)}"] if bounds.left_out else []
    return means, "; ".join(parts)
