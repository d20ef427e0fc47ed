"""Commands that show a run: plot, animate, report; explore (a page that runs a bearing in the browser)."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from msfp_gen.cli.console import (
    Force,
    ShownProgress,
    SignOption,
    is_result,
    load_source,
    note,
    note_exceeded,
    number,
    result_of,
    whole_number,
)
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.common.output import FIGURE_SUFFIXES, check_output, make_folder
from msfp_gen.results.sign import DEFAULT, sign_of, using_sign

if TYPE_CHECKING:
    from collections.abc import Collection

    from msfp_gen.results.result import AnyResult
    from msfp_gen.scene.system import System

EVERY = "all"

app = typer.Typer()
SceneOrResult = Annotated[
    str, typer.Argument(metavar="SCENE", help="A scene file, the name of a preset, or a result (.nc).")
]
Azimuth = Annotated[
    float | None,
    typer.Option(
        parser=number,
        metavar="DEGREES",
        help="Azimuth of the section from E1; default: of the displacement. Of a building: of the first elevation.",
    ),
]


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen plot fenz-test5 --figure stages -o stages.png\n"
    "  msfp-gen plot out.nc --figure all -o figures\n"
    "  msfp-gen plot out.nc --figure section --time 90 --friction-circles -o section.svg"
)
def plot(
    source: SceneOrResult,
    figure: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="overview|loops|orbit|sliding|stages|force-path|energy|section|all; of a building "
            "overview|plan|profile|spectra|axial|all.",
        ),
    ] = "overview",
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE|DIR", help="A .png, .svg or .pdf, or a folder for NAME.png.")
    ] = Path(),
    time: Annotated[
        float | None,
        typer.Option(parser=number, metavar="SECONDS", help="Time of section and force-path; default: at the peak."),
    ] = None,
    azimuth: Azimuth = None,
    friction_circles: Annotated[
        bool, typer.Option("--friction-circles", help="Add sphere centres and friction circles to the section.")
    ] = False,
    sign: SignOption = DEFAULT,
    force: Force = False,
) -> None:
    """Draw a run: one figure, or all of them."""
    _check_figure_output(figure, output)
    sign_of(sign, "--sign")
    from msfp_gen.figures import figures_of, plot_force_path, plot_section

    loaded = _load_for_figures(source)
    targets = _targets(figure, output, figures_of(loaded))
    angle = None if azimuth is None else math.radians(azimuth)
    _reject_unused(targets, {"--time": time}, ("section", "force-path"))
    _reject_unused(targets, {"--azimuth": azimuth, "--friction-circles": friction_circles or None}, ("section",))
    make_folder(next(iter(targets.values())).parent, "--output")
    result, failure = result_of(loaded, force)
    if time is not None:
        result.at_times(time)  # refuses a time outside the run before anything is written
    for name, path in targets.items():
        with using_sign(sign):
            if name == "section":
                plot_section(result, path, time=time, azimuth=angle, friction_circles=friction_circles)
            elif name == "force-path":
                plot_force_path(result, path, time=time)
            else:
                figures_of(result)[name](result, path)
        note(f"wrote {path}")
    if failure is not None:
        raise failure


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen animate fenz-test5 -o test5.gif\n"
    "  msfp-gen animate out.nc --start 5 --end 25 --seconds 20 -o slow.mp4\n"
    "  msfp-gen animate hospital-clc --start 5 --end 15 -o hospital.gif"
)
def animate(
    source: SceneOrResult,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="A .gif, or an .mp4 by ffmpeg.")],
    seconds: Annotated[float, typer.Option(parser=number, metavar="SECONDS", help="Length of the movie.")] = 8.0,
    rate: Annotated[int, typer.Option(parser=whole_number, metavar="NUMBER", help="Frames a second.")] = 12,
    start: Annotated[
        float | None, typer.Option(parser=number, metavar="SECONDS", help="First instant of the run that is shown.")
    ] = None,
    end: Annotated[
        float | None, typer.Option(parser=number, metavar="SECONDS", help="Last instant of the run that is shown.")
    ] = None,
    azimuth: Azimuth = None,
    sign: SignOption = DEFAULT,
    force: Force = False,
) -> None:
    """Write a movie of the stack in motion, with its loop and the bars of sliding surfaces.

    Of a building: the frame on its bearings in two elevations, with plan, loops and axial forces.
    """
    from msfp_gen.figures import animate as write_movie
    from msfp_gen.figures import check_movie

    check_movie(output, "--output")
    sign_of(sign, "--sign")
    result, failure = result_of(_load_for_figures(source), force)
    angle = None if azimuth is None else math.radians(azimuth)
    with ShownProgress("frames") as progress, using_sign(sign):
        write_movie(
            result,
            output,
            seconds=seconds,
            frames_per_second=rate,
            start=start,
            end=end,
            azimuth=angle,
            progress=progress,
        )
    note(f"wrote {output}")
    if failure is not None:
        raise failure


def _check_figure_output(figure: str, output: Path) -> None:
    """Raise InputError for a path that cannot be written."""
    if figure != EVERY and output.suffix:
        check_output(output, FIGURE_SUFFIXES, "--output")
    elif output.suffix.lower() in FIGURE_SUFFIXES:
        raise InputError(f"--output = {str(output)!r}: --figure all writes several files; give a folder")


def _targets(figure: str, output: Path, known: Collection[str]) -> dict[str, Path]:
    """Name -> file of each figure, of those that this scene or result has. Raises InputError for an unknown name."""
    if not known:
        raise InputError(f"--figure = {figure!r}: this system has no figures; its rows are in `msfp-gen export`")
    if figure not in (*known, EVERY):
        raise InputError(f"--figure = {figure!r}: give one of {', '.join((*known, EVERY))} here")
    if figure != EVERY and output.suffix:
        return {figure: output}
    return {name: output / f"{name}.png" for name in (known if figure == EVERY else (figure,))}


def _reject_unused(targets: dict[str, Path], options: dict[str, float | None], users: tuple[str, ...]) -> None:
    """Raise InputError for an option that none of the requested figures has."""
    for option, value in options.items():
        if value is not None and not set(users) & set(targets):
            raise InputError(f"{option}: only {' and '.join(users)} have it; give --figure {users[0]} with it")


def _load_for_figures(source: str) -> AnyResult | System:
    """A saved result, or a system with rows for smooth figures."""
    from msfp_gen.figures import with_smooth_rows

    loaded = load_source(source)
    return loaded if is_result(loaded) else with_smooth_rows(loaded)


MOST = 5000  # instants in the interactive view; more would give a file of tens of megabytes


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen run fenz-test5 -o out.nc\n  msfp-gen report out.nc -o report.html\n"
    '  msfp-gen report out.nc --project "Hospital, block B" --date 2026-03-01 --revision 2 --code "ASCE 7-22"\n'
    "  msfp-gen report ridgecrest-clc   # runs it first, and writes ridgecrest-clc.html\n"
    '  msfp-gen report bounds --author "A. Author" --checker "B. Checker"   # of `bound --suite -o bounds`'
)
def report(
    source: Annotated[
        str,
        typer.Argument(metavar="RUN", help="A result (.nc), a scene file or preset, which is run first, or a folder."),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE.html", help="The file to write; default: the name of RUN with .html."
        ),
    ] = None,
    frames: Annotated[
        int | None,
        typer.Option(parser=whole_number, metavar="N", help="Number of instants in the view, about; default 1500."),
    ] = None,
    project: Annotated[str, typer.Option(metavar="TEXT", help="Title block: the project.")] = "",
    device: Annotated[
        str, typer.Option(metavar="TEXT", help="Title block: the bearing; default: its kind.", show_default=False)
    ] = "",
    date: Annotated[str, typer.Option(metavar="TEXT", help="Title block: the date.")] = "",
    revision: Annotated[str, typer.Option(metavar="TEXT", help="Title block: the revision.")] = "",
    code: Annotated[
        str, typer.Option(metavar="TEXT", help="Title block: the edition of the design code, such as ASCE 7-22.")
    ] = "",
    author: Annotated[str, typer.Option(metavar="TEXT", help="Who signs the report of a suite.")] = "",
    checker: Annotated[str, typer.Option(metavar="TEXT", help="Who checks the report of a suite.")] = "",
    leave_out: Annotated[
        list[str] | None,
        typer.Option(metavar="RECORD", help="A record of a suite that is not in its report; may be repeated."),
    ] = None,
    no_runs: Annotated[
        bool, typer.Option("--no-runs", help="Make no run of a suite again: no loops, no vertical motion, no error.")
    ] = False,
    sign: SignOption = DEFAULT,
    force: Force = False,
) -> None:
    """Write a run as one HTML file that needs no network: numbers, settings, figures, the bearing in motion.

    Of the folder of `bound --suite FILE -o DIR` it writes the report of the whole analysis: inputs, bearing,
    superstructure, ground motions, envelopes over records and bounds.
    """
    from msfp_gen.common.output import check_output
    from msfp_gen.report import FRAMES, REPORT_SUFFIXES, TitleBlock, write_analysis, write_report
    from msfp_gen.report.analysis import is_suite_folder

    count = FRAMES if frames is None else frames
    if not 2 <= count <= MOST:
        raise InputError(f"--frames = {count}: give 2 to {MOST}")
    path = check_output(Path(f"{Path(source).stem}.html") if output is None else output, REPORT_SUFFIXES, "--output")
    title = TitleBlock(project, device, date, revision, code, author, checker)
    sign_of(sign, "--sign")
    if is_suite_folder(source):
        with ShownProgress("runs made again") as progress, using_sign(sign):
            write_analysis(source, path, title, leave_out or (), loops=not no_runs, progress=progress)
        note(f"wrote {path}")
        return
    if leave_out or no_runs:
        option = "--leave-out" if leave_out else "--no-runs"
        raise InputError(f"{option}: it is for the report of a suite; give the folder of `bound --suite FILE -o DIR`")
    result, failure = result_of(load_source(source), force)
    with ShownProgress("report") as progress, using_sign(sign):
        write_report(result, path, count, progress, title)
    note(f"wrote {path}")
    note_exceeded({"": result.verdict})
    if failure is not None:
        raise RunError(f"{failure}; the report of what was computed until then is in {path}", status=failure.status)


@app.command(
    epilog="Examples:\n\n\b\n  msfp-gen explore -o explorer.html   # presets\n"
    "  msfp-gen explore scene.toml -o scene.html"
)
def explore(
    scene: Annotated[
        str | None, typer.Argument(metavar="[SCENE]", help="A scene file (.toml) or preset; default: a set of presets.")
    ] = None,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE.html", help="The file to write.", show_default=True)
    ] = Path("explorer.html"),
    sign: SignOption = DEFAULT,
    force: Force = False,
) -> None:
    """Write one HTML file in which sliders change a bearing and its motion, and the response is computed at once."""
    from msfp_gen.common.output import check_output
    from msfp_gen.report import REPORT_SUFFIXES
    from msfp_gen.report.explore import write_explorer
    from msfp_gen.scene.file.source import load_bearing_scene
    from msfp_gen.scene.plausibility import require_meant

    path = check_output(output, REPORT_SUFFIXES, "--output")
    first = None if scene is None else load_bearing_scene(scene)
    if first is not None:
        require_meant(first, force=force)
    sign_of(sign, "--sign")
    with ShownProgress("explorer") as progress, using_sign(sign):
        write_explorer(path, first, progress)
    note(f"wrote {path}")
