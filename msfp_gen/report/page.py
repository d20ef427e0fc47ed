"""The HTML report: fills the template with tables, figures, data and scripts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msfp_gen.buildings.explain import explain
from msfp_gen.buildings.result import BuildingResult
from msfp_gen.common.output import check_output, write_bytes
from msfp_gen.report.content import (
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
from msfp_gen.report.frames import FRAMES, view
from msfp_gen.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from msfp_gen.result import Result

NO_TITLE = TitleBlock()
Progress = Callable[[float, float], None]
REPORT_SUFFIXES = (".html", ".htm")
SCRIPTS = (
    "three.min.js", "dom.js", "canvas.js", "data.js", "chart.js", "section.js", "scene.js", "player.js", "page.js",
)  # fmt: skip
SPEEDS = (0.1, 0.25, 0.5, 1, 2, 5, 10)
FIGURES = {
    "overview": "Loops and sliding",
    "stages": "Sliding regimes over time",
    "force-path": "Path of the force",
    "energy": "Energy balance",
    "section": "Section at the largest displacement",
}
EXPLANATION = (
    "Bodies are drawn to scale with the radii, heights and capacities of the bearing; the height and thickness of rims "
    "are chosen for the drawing, as they are not part of the data. The force through a surface acts along a straight "
    "line. Where a surface slides, the line is tangent to its friction circle, of radius μR/√(1 + μ²) about its sphere "
    "centre; where it sticks, the line crosses the circle. Where the line is outside the circle, a rim carries a part "
    "of the force. Charts and views show {frames} instants of {rows} rows; the summary uses all rows. Click a chart to "
    "move to an instant."
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

    if isinstance(result, BuildingResult):
        content = _of_building(result, frames, progress)
    else:
        content = _of_bearing(result, frames, progress)
    scripts, data = content.pop("scripts"), content.pop("data")
    device = ", ".join(dict.fromkeys(map(kind_of, result.scene.every_bearing)))
    return render(
        "page.html.jinja",
        **content,
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
        scripts=[Markup(asset(name)) for name in scripts],
    )


def _of_bearing(result: Result, frames: int, progress: Progress | None) -> dict[str, Any]:
    """What the page of one bearing shows."""
    from markupsafe import Markup

    from msfp_gen.figures import FIGURES as PLOTS

    data = view(result, frames)
    return {
        "moving": "The bearing in motion",
        "stage": Markup(render("bearing.html.jinja")),
        "lead": _introduction(result),
        "terms": TERMS,
        "explanation": EXPLANATION.format(frames=data["frames"]["time"]["shape"][0], rows=len(result.history.time)),
        "figures": list(_pictures(result, FIGURES, PLOTS, progress)),
        "data": data,
        "scripts": SCRIPTS,
    }


def _of_building(result: BuildingResult, frames: int, progress: Progress | None) -> dict[str, Any]:
    """What the page of a building shows."""
    from markupsafe import Markup

    from msfp_gen.figures import BUILDING_FIGURES
    from msfp_gen.report import building

    data = building.building_view(result, frames)
    stage = render("building.html.jinja", scales=building.SCALES, chosen=data["scale"])
    return {
        "moving": "The building in motion",
        "stage": Markup(stage),
        "lead": building.introduction(result),
        "terms": building.TERMS,
        "explanation": building.explanation(data["frames"]["time"]["shape"][0], len(result.time)),
        "figures": list(_pictures(result, building.FIGURES, BUILDING_FIGURES, progress)),
        "data": data,
        "scripts": building.SCRIPTS,
    }


def _introduction(result: Result) -> str:
    """One sentence about the bearing and the program."""
    layout = result.scene.bearing.layout
    return (
        f"Simulation of a friction pendulum bearing of {layout.n} bodies, with {layout.m} sliding surfaces concave up "
        f"and {layout.p} concave down, by msfp-gen {result.provenance.get('msfp_gen', __version__)}."
    )


def _pictures(
    result: Any, titles: Mapping[str, str], plots: Mapping[str, Callable[..., Figure]], progress: Progress | None
) -> Iterator[dict[str, str]]:
    """Every figure of the report, for its template."""
    for done, (name, title) in enumerate(titles.items(), start=1):
        drawn = picture(title, plots[name](result, None))
        if progress is not None:
            progress(done, len(titles))
        yield drawn
