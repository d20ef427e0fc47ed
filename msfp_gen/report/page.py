"""The HTML report: fills the template with tables, figures, data and scripts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from msfp_gen.buildings.explain import explain
from msfp_gen.buildings.result import BuildingResult
from msfp_gen.common.output import check_output, write_bytes
from msfp_gen.report.content import (
    BUILDING_TERMS,
    TERMS,
    TitleBlock,
    asset,
    characterisation_page,
    kind_of,
    note_tables,
    outcome,
    picture,
    provenance_table,
    render,
    script_data,
    summary_page,
)
from msfp_gen.report.frames import FRAMES, SCALES, building_view, view
from msfp_gen.version import __version__

if TYPE_CHECKING:
    from msfp_gen.result import Result

NO_TITLE = TitleBlock()
Progress = Callable[[float, float], None]
REPORT_SUFFIXES = (".html", ".htm")
SCRIPTS = ("three.min.js", "dom.js", "canvas.js", "data.js", "chart.js")  # of every page, before its own
SPEEDS = (0.1, 0.25, 0.5, 1, 2, 5, 10)


class Kind(NamedTuple):
    """What differs between the pages of a bearing and of a building.

    name: of what moves, and of its template. introduction: the begin of one sentence about it. explanation: of its
    view. figures: name -> title. scripts: after those of every page. view: data for the scripts, of about so many
    instants.
    """

    name: str
    introduction: Callable[[Any], str]
    explanation: str
    terms: tuple[tuple[str, str], ...]
    figures: Mapping[str, str]
    scripts: tuple[str, ...]
    view: Callable[[Any, int], dict[str, Any]]


def _of_bearing(result: Result) -> str:
    layout = result.scene.bearing.layout
    return (
        f"Simulation of a friction pendulum bearing of {layout.n} bodies, with {layout.m} sliding surfaces concave up "
        f"and {layout.p} concave down"
    )


def _of_building(result: BuildingResult) -> str:
    scene = result.scene
    storeys = f"{len(scene.building.columns)} storeys" if scene.building.columns else "a structure"
    return (
        f"Simulation of {storeys} on {len(scene.bearings)} friction pendulum bearings, weight "
        f"{1e-6 * scene.weight:.4g} MN"
    )


BEARING = Kind(
    "bearing",
    _of_bearing,
    "Bodies are drawn to scale with the radii, heights and capacities of the bearing; the height and thickness of rims "
    "are chosen for the drawing, as they are not part of the data. The force through a surface acts along a straight "
    "line. Where a surface slides, the line is tangent to its friction circle, of radius μR/√(1 + μ²) about its sphere "
    "centre; where it sticks, the line crosses the circle. Where the line is outside the circle, a rim carries a part "
    "of the force.",
    TERMS,
    {
        "overview": "Loops and sliding",
        "stages": "Sliding regimes over time",
        "force-path": "Path of the force",
        "energy": "Energy balance",
        "section": "Section at the largest displacement",
    },
    ("section.js", "scene.js", "player.js", "page.js"),
    view,
)
BUILDING = Kind(
    "building",
    _of_building,
    "The frame moves relative to the ground unless the box is cleared; displacements are drawn larger than the frame "
    "by the chosen factor.",
    BUILDING_TERMS,
    {
        "plan": "Plan with the orbits of all bearings",
        "profile": "Peaks over the height",
        "spectra": "Floor spectra",
        "axial": "Axial force of every bearing",
    },
    ("frame.js", "player.js", "building.js"),
    building_view,
)


def write_report(
    result: Result | BuildingResult,
    path: str | Path,
    frames: int = FRAMES,
    progress: Progress | None = None,
    title: TitleBlock = NO_TITLE,
) -> Path:
    """Write the HTML report of a run to `path`; the file appears only when complete. Arguments as `report_html`.

    Raises InputError for a path that does not end in .html or cannot be written.
    """
    path = check_output(path, REPORT_SUFFIXES)
    write_bytes(path, [report_html(result, frames, progress, title).encode()])
    return path


def report_html(
    result: Result | BuildingResult,
    frames: int = FRAMES,
    progress: Progress | None = None,
    title: TitleBlock = NO_TITLE,
) -> str:
    """The HTML report of a run as text; the file loads no other file.

    Args:
        result: the run, of one bearing or of a building.
        frames: number of instants in the interactive view, about. Tables and figures use all rows.
        progress: called with the number of finished figures and of all figures.
        title: project, device, date, revision and code edition.
    """
    from markupsafe import Markup

    kind = BUILDING if isinstance(result, BuildingResult) else BEARING
    data = kind.view(result, frames)
    shown, rows = data["frames"]["time"]["shape"][0], len(result.bearings[0].history.time)
    device = ", ".join(dict.fromkeys(map(kind_of, result.scene.every_bearing)))
    return render(
        "page.html.jinja",
        moving=f"The {kind.name} in motion",
        stage=Markup(render(f"{kind.name}.html.jinja", scales=SCALES, chosen=data.get("scale"))),
        lead=f"{kind.introduction(result)}, by msfp-gen {result.provenance.get('msfp_gen', __version__)}.",
        terms=kind.terms,
        explanation=f"{kind.explanation} Charts and views show {shown} instants of {rows} rows; the summary uses all "
        "rows. Click a chart to move to an instant.",
        figures=list(_pictures(result, kind.figures, progress)),
        summary=[*summary_page(result), *note_tables(result)],
        characterisation=characterisation_page(result),
        settings=explain(result.scene),
        provenance=provenance_table(result),
        name=result.scene.name or "unnamed scene",
        kind="report",
        title_block=title.rows(device),
        scene=result.dataset.attrs["scene"],
        outcome=outcome(result),
        good=result.verdict.ok,
        speeds=SPEEDS,
        data=script_data(data),
        scripts=[Markup(asset(name)) for name in (*SCRIPTS, *kind.scripts)],
    )


def _pictures(result: Any, titles: Mapping[str, str], progress: Progress | None) -> Iterator[dict[str, str]]:
    """Every figure of the report, for its template."""
    from msfp_gen.figures import BUILDING_FIGURES, FIGURES

    plots: Mapping[str, Any] = BUILDING_FIGURES if isinstance(result, BuildingResult) else FIGURES
    for done, (name, title) in enumerate(titles.items(), start=1):
        drawn = picture(title, plots[name](result, None))
        if progress is not None:
            progress(done, len(titles))
        yield drawn
