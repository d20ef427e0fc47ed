"""Commands of design without runs: sheet (what follows from a data sheet), equivalent (displacement by a spectrum)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from msfp_gen.cli.console import answer, is_result, load_source, note
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Quantity

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
    '  msfp-gen equivalent scene.toml --spectrum design.csv --torsion "7.3 m,0.73 m,14.6 m,14.6 m" --history run.nc'
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
        Path | None, typer.Option(metavar="RESULT.nc", help="A run, whose peaks are compared with the procedure.")
    ] = None,
    bearing: OfBuilding = None,
    as_json: AsJson = False,
) -> None:
    """Equivalent lateral procedure: displacement and base shear from a spectrum, at each bound of friction."""
    from msfp_gen.design import equivalent as procedure
    from msfp_gen.design.sheet import SheetReport
    from msfp_gen.motions.records.scaling import read_spectrum
    from msfp_gen.scene.file.loader import load_sheet

    pairs, (factor, rule) = read_spectrum(spectrum), procedure.damping_of(damping)
    arms = None if torsion is None else _lengths(torsion)
    report = SheetReport(*load_sheet(file, bearing))
    gravity = report.bearing.gravity
    found = {case: procedure.equivalent(b, pairs, factor, gravity) for case, b in report.backbones.items()}
    peaks = None if history is None else _peaks(history)
    load = report.sheet.axial_load
    answer(
        procedure.as_dict(found, load, arms, peaks),
        procedure.tables(report.name, found, load, rule, arms, peaks),
        as_json,
    )


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


def _peaks(path: Path) -> tuple[float, float]:
    """Largest mean displacement of the bearings of a run [m], and largest sum of their forces over the load at rest."""
    # Raises InputError for a file that is no result, or loads that change.
    import numpy as np

    result: Any = load_source(str(path))
    if not is_result(result):
        raise InputError(f"--history = {str(path)!r}: give a saved result (.nc)")
    bearings = result.bearings
    loads: list[Any] = [bearing.axial_load for bearing in bearings]
    if None in loads:
        raise InputError(f"--history = {str(path)!r}: its axial load changes; give a run with a load at rest")
    u = np.mean([bearing.history.displacement for bearing in bearings], axis=0)
    force = np.sum([bearing.history.top_force for bearing in bearings], axis=0)
    return float(np.hypot(*u[:, :2].T).max()), float(np.hypot(*force[:, :2].T).max() / sum(loads))
