"""The page itself: the template filled with tables, pictures, data and scripts."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable, Iterator
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msfp_gen.output import check_output, write_bytes
from msfp_gen.report.content import characterisation_page, provenance_table, settings_page, summary_page, verdict
from msfp_gen.report.frames import FRAMES, view
from msfp_gen.version import __version__

if TYPE_CHECKING:
    from msfp_gen.result import Result

Progress = Callable[[float, float], None]
REPORT_SUFFIXES = (".html", ".htm")
SCRIPTS = ("three.min.js", "data.js", "chart.js", "section.js", "scene.js", "page.js")
SPEEDS = (0.1, 0.25, 0.5, 1, 2, 5, 10)
FIGURES = {
    "overview": "Loops and sliding",
    "stages": "Which surfaces slide when",
    "force-path": "The path of the force",
    "energy": "Energy",
    "section": "The stack at its largest displacement",
}
RESOLUTION = 110  # dots per inch of the pictures
EXPLANATION = (
    "Bodies are drawn with the radii, heights, rims and capacities of the bearing, to scale and without exaggeration; "
    "the height and thickness of rims are drawn for the eye. The force through a surface acts along one straight line. "
    "Where a surface slides the line touches its friction circle, of radius μR/√(1 + μ²) about the centre of its "
    "sphere; where it sticks the line passes inside. A line outside a circle means that a rim carries a part. Charts "
    "and views show {frames} instants of {rows} rows; the summary is of every row. Click a chart to go there."
)


def write_report(result: Result, path: str | Path, frames: int = FRAMES, progress: Progress | None = None) -> Path:
    """Write `report_html` to `path`, whole or not at all. Raises InputError for a path that cannot be."""
    path = check_output(path, REPORT_SUFFIXES)
    write_bytes(path, [report_html(result, frames, progress).encode()])
    return path


def report_html(result: Result, frames: int = FRAMES, progress: Progress | None = None) -> str:
    """The report of a run as the text of one HTML file that asks for no other.

    frames: at most about so many instants in the interactive view; the tables and figures are of all rows.
    progress: takes figures done and figures in all, which is where the time goes.
    """
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    from msfp_gen.kept_motion import recipe

    data = view(result, frames)
    environment = Environment(autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True)
    explanation = EXPLANATION.format(frames=data["frames"]["time"]["shape"][0], rows=len(result.history.time))
    return environment.from_string(_asset("page.html.jinja")).render(
        name=result.scene.name or "unnamed scene",
        version=__version__,
        lead=_lead(result),
        verdict=verdict(result),
        succeeded=result.succeeded,
        summary=summary_page(result),
        characterisation=characterisation_page(result),
        settings=settings_page(result),
        provenance=provenance_table(result),
        scene=recipe(result.scene),
        figures=list(_pictures(result, progress)),
        speeds=SPEEDS,
        explanation=explanation,
        style=Markup(_asset("page.css")),
        data=Markup(_inert(json.dumps(data, allow_nan=False, separators=(",", ":")))),
        scripts=[Markup(_asset(name)) for name in SCRIPTS],
    )


def _lead(result: Result) -> str:
    layout = result.scene.bearing.layout
    return (
        f"A stack of {layout.n} bodies, {layout.m} surfaces concave up and {layout.p} concave down, computed by "
        f"msfp-gen {result.provenance.get('msfp_gen', __version__)}."
    )


def _pictures(result: Result, progress: Progress | None) -> Iterator[dict[str, Any]]:
    """The figures of a run as PNG."""
    from msfp_gen.figures import FIGURES as DRAWN

    for done, (name, title) in enumerate(FIGURES.items(), start=1):
        picture = BytesIO()
        DRAWN[name](result, None).savefig(picture, format="png", dpi=RESOLUTION)
        if progress is not None:
            progress(done, len(FIGURES))
        yield {"title": title, "png": base64.b64encode(picture.getvalue()).decode("ascii")}


def _inert(text: str) -> str:
    """JSON that no HTML parser takes for the end of a script."""
    return re.sub(r"[<>&]", lambda found: f"\\u{ord(found[0]):04x}", text)


def _asset(name: str) -> str:
    return files(__package__).joinpath("assets", name).read_text(encoding="utf-8")
