"""The HTML pages: of a run, with tables, figures, data and scripts in a template, and of a fit.

All numbers of tables come from the result; none depends on the machine.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import singledispatch
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from msfp_gen.common.aliases import Progress
from msfp_gen.common.errors import InputError
from msfp_gen.common.tables import Table
from msfp_gen.common.version import __version__
from msfp_gen.report.frames import ASSETS, FRAMES, asset, picture, render, script_data, view, write_page
from msfp_gen.results.files import COUNTER, PROVENANCE, without
from msfp_gen.results.history import Event
from msfp_gen.results.note import by_importance
from msfp_gen.results.result import AnyResult, Result
from msfp_gen.results.sign import shown_sign
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.explain import explain
from msfp_gen.studies.calibration import Fit, FittedTest
from msfp_gen.studies.calibration.fit_result import correlation_table, fitted_values_table, residual_table
from msfp_gen.studies.calibration.intervals import lag_one

MILLI, KILO = 1e3, 1e-3
MACHINE_KEYS = ("build_seconds",)  # keys of the provenance that depend on the machine
EVENTS = 40  # most events listed; in an earthquake there may be a rim contact in every cycle


DEVICES = {1: "single", 2: "double", 4: "triple", 6: "quintuple"}  # number of sliding surfaces -> pendulum
# Words of the page for a reader who has seen nothing else of msfp-gen.
TERMS = (
    ("friction pendulum bearing", "steel sliders in spherical dishes, between a structure and its foundation. It "
     "slides when the ground moves, friction dissipates energy, and the weight on the curved dishes brings it back."),
    ("surface", "a pair of spherical faces that slide on each other, numbered from the bottom."),
    ("sliding", "distance of a slider from the centre of its dish, along the dish."),
    ("capacity, rim, gap", "the sliding at which the slider meets the raised edge (rim) of its dish; the gap is what "
     "is left until then. A negative gap is the compression of the rim."),
    ("u", "horizontal displacement across the bearing: {words}, less its value at the start."),
    ("F", "force {force}; it has the sign of u in a loop."),
    ("normal force N", "compression through a surface. Where it falls to zero, the surface would open."),
    ("effective stiffness, damping", "of one cycle: force over displacement between its two ends, and the energy of "
     "the loop over 2π times stiffness times displacement squared."),
    ("sliding regime", "a part of the motion in which the same surfaces slide."),
    ("friction mobilised", "share of the full friction force; 100 % while a surface slides, less while it sticks."),
    ("energy balance", "work of the ground and the loads, less all energy stored and dissipated; what remains is the "
     "error of the computation."),
)  # fmt: skip


def terms_shown(terms: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """Terms of a page, with what u and F are in the sign that is shown."""
    sign = shown_sign()
    return [(term, meaning.format(words=sign.words, force=sign.force)) for term, meaning in terms]


@dataclass(frozen=True)
class TitleBlock:
    """What identifies a report in a project: texts; "" leaves an entry out. device: "" for the kind of the bearing.

    code: the edition of the design code, such as "ASCE 7-22". author, checker: names of those who sign.
    """

    project: str = ""
    device: str = ""
    date: str = ""
    revision: str = ""
    code: str = ""
    author: str = ""
    checker: str = ""

    def rows(self, device: str) -> list[tuple[str, str]]:
        """Names and texts of the entries that are given, the device in any case; `device`: its kind."""
        entries = vars(self) | {"device": self.device or device}
        return [("code edition" if name == "code" else name, text) for name, text in entries.items() if text]


def bearing_kind(bearing: Bearing) -> str:
    """The kind of a bearing by its sliding surfaces, with its layout."""
    layout = bearing.layout
    kind = DEVICES.get(layout.surfaces)
    surfaces = f"{layout.surfaces} sliding surface{'s' if layout.surfaces > 1 else ''}"
    return f"{kind} friction pendulum, {surfaces}" if kind else f"friction pendulum of {surfaces}"


def summary_page(result: AnyResult) -> list[Table]:
    """Tables of the run as in `msfp-gen run`, without times of the machine, and of the events of one bearing."""
    first, *others = result.tables()
    rows = [("time simulated", f"{result.summary['duration']:.6g} s"), *(row for row in first.rows if row[0] != "time")]
    return [Table("the run", (), rows), *others, *([_event_table(result.events)] if result.events else [])]


def note_tables(result: AnyResult) -> list[Table]:
    """A table of all notes of the run, the most important first; none without notes."""
    rows = [(f"t = {note.time:.6g} s", note.sentence) for note in by_importance(result.notes)]
    return [Table("notes, the most important first", (), rows)] if rows else []


def characterisation_page(result: AnyResult) -> list[Table]:
    """Tables of the characterisation; none if no bearing moved."""
    try:
        return result.characterise().tables()
    except InputError:
        return []


def provenance_table(result: AnyResult) -> Table:
    """Table of versions, model and method of the run, and the counters of the solver."""
    about = result.dataset.attrs
    provenance = {name: text for name, text in without(PROVENANCE, about).items() if name not in MACHINE_KEYS}
    counters = {name: count for name, count in without(COUNTER, about).items() if name != "wall_time"}
    rows = [(name.replace("_", " "), str(value)) for name, value in {**provenance, **counters}.items()]
    return Table("versions, model and counters of the solver", (), rows)


def outcome(result: AnyResult) -> str:
    """How a run ended, and its verdict, in one or two sentences."""
    verdict, lines = result.verdict, result.verdict.exceeded_text
    if verdict.failure:
        return f"The run failed ({result.status}): {result.message}" + (
            f". Until then exceeded: {lines}" if lines else ""
        )
    if verdict.stopped is not None:
        limits = f"Limits of the device exceeded: {lines}" if lines else f"Until then: {verdict.unexceeded}"
        return f"The run met its stop condition at {verdict.stopped:.4g} s. {limits}."
    return "The run reached its end" + (f". Limits of the device {verdict.text}." if lines else f", {verdict.text}.")


def _event_table(events: Sequence[Event]) -> Table:
    shown, sign = events[:EVENTS], shown_sign()
    more = f", the first {EVENTS} of {len(events)}" if len(events) > EVENTS else ""
    rows = [
        (
            f"{event.time:.4f}",
            event.kind.replace("_", " "),
            str(event.surface or "-"),
            *(f"{sign.factor * value * MILLI:.2f}" for value in event.displacement[:2]),
            *(f"{sign.factor * value * KILO:.3f}" for value in event.top_force[:2]),
        )
        for event in shown
    ]
    columns = ("time [s]", "event", "surface", "u1 [mm]", "u2 [mm]", "F1 [kN]", "F2 [kN]")
    return Table(f"events{more}", columns, rows)


NO_TITLE = TitleBlock()
SCRIPTS = ("three.min.js", "dom.js", "canvas.js", "data.js", "chart.js")  # of every page, before its own
SPEEDS = (0.1, 0.25, 0.5, 1, 2, 5, 10)


class Page(NamedTuple):
    """What the page of a kind of systems has of its own.

    name: of what moves. introduction: the begin of one sentence about it. explanation: of its view. figures: name ->
    title. assets: folder of `stage` and `scripts`, which other scripts may lie beside in this package. stage: template
    of the view. scripts: after the scripts of every page. view: data for the scripts, of about so many instants.
    """

    name: str
    introduction: Callable[[Any], str]
    explanation: str
    terms: tuple[tuple[str, str], ...]
    figures: Mapping[str, str]
    assets: Traversable
    stage: str
    scripts: tuple[str, ...]
    view: Callable[[Any, int], dict[str, Any]]


def _of_bearing(result: Result) -> str:
    layout = result.bearing.layout
    return (
        f"Simulation of a friction pendulum bearing of {layout.n} bodies, with {layout.m} sliding surfaces concave up "
        f"and {layout.p} concave down"
    )


BEARING = Page(
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
    ASSETS,
    "bearing.html.jinja",
    ("section.js", "scene.js", "player.js", "page.js"),
    view,
)


@singledispatch
def page_of(result: Any) -> Page:
    """What the page of a run has of its own."""
    page: Page = result.page
    return page


@page_of.register(Result)
def _page_of_bearing(_: Result) -> Page:
    return BEARING


def write_report(
    result: Any,
    path: str | Path,
    frames: int = FRAMES,
    progress: Progress | None = None,
    title: TitleBlock = NO_TITLE,
) -> Path:
    """Write the HTML report of a run to `path`; the file appears only when complete. Arguments as `report_html`.

    Raises InputError for a bearing of a building, and for a path that does not end in .html or cannot be written.
    """
    return write_page(path, lambda: report_html(result, frames, progress, title))


def report_html(
    result: Any,
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

    page = page_of(result)
    data = page.view(result, frames)
    shown, rows = data["frames"]["time"]["shape"][0], len(result.bearings[0].history.time)
    device = ", ".join(dict.fromkeys(map(bearing_kind, result.scene.every_bearing)))
    return render(
        "page.html.jinja",
        moving=f"The {page.name} in motion",
        stage=Markup(render(asset(page.stage, page.assets), sign=shown_sign(), **data.get("stage", {}))),
        lead=f"{page.introduction(result)}, by msfp-gen {result.provenance.get('msfp_gen', __version__)}.",
        terms=terms_shown(page.terms),
        explanation=f"{page.explanation} Charts and views show {shown} instants of {rows} rows; the summary uses all "
        "rows. Click a chart to move to an instant.",
        figures=list(_pictures(result, page.figures, progress)),
        summary=[*summary_page(result), *note_tables(result)],
        characterisation=characterisation_page(result),
        settings=explain(result.scene),
        provenance=provenance_table(result),
        name=result.scene.name or "unnamed scene",
        kind="report",
        title_block=title.rows(device),
        scene=result.dataset.attrs["scene"],
        outcome=outcome(result),
        verdict=result.verdict.word.replace(" ", "-"),
        speeds=SPEEDS,
        data=script_data(data),
        scripts=[Markup(asset(name, page.assets)) for name in (*SCRIPTS, *page.scripts)],
    )


def _pictures(result: Any, titles: Mapping[str, str], progress: Progress | None) -> Iterator[dict[str, str]]:
    """Every figure of the report, for its template."""
    from msfp_gen.figures import figures_of

    plots = figures_of(result)
    for done, (name, title) in enumerate(titles.items(), start=1):
        drawn = picture(title, plots[name](result, None))
        if progress is not None:
            progress(done, len(titles))
        yield drawn


FIT_TERMS = (
    ("value, start", "the number after the fit, and before it, in the scene that was given."),
    ("95 % interval", "where the true value lies in 95 of 100 such fits, if the model is right. It contains the noise "
     "of the tests, also where it is correlated, and the error of the runs; no error of the model, of the load cell or "
     "of the gauges."),
    ("error of the runs", "of a value, from the errors of the runs at the stated rtol and of their derivatives. By so "
     "much the interval is longer at both ends."),
    ("bounds", "between which the value was sought."),
    ("correlation", "of the errors of two values. Near +1 or −1 the tests determine only one combination of both."),
    ("condition", "of the Jacobian, with columns of unit length: 1 where every value has an effect of its own; above "
     "1e4 a combination of values is not determined."),
    ("residual", "fitted less measured force. In the figures it should be a band about zero without a pattern; where "
     "there is one, the model misses something, which the intervals contain as correlated noise and nothing more."),
    ("deviation", "root mean square of the residuals."),
    ("correlation of consecutive residuals", "near 0 for independent noise; from 0.5 the page has a note."),
    ("weight", "of the residuals of a test: 2 counts as a standard deviation half as large."),
    ("offset", "constant that is added to the force of the run of one test."),
    ("u", "displacement across the bearing: {words}. The axis of a figure states its sign."),
)  # fmt: skip


def write_fit_report(fit: Fit, path: str | Path) -> Path:
    """Write the page of a fit to `path`; the file appears only when complete, and loads no other file.

    Raises InputError for a path that does not end in .html or cannot be written.
    """
    return write_page(path, lambda: fit_html(fit))


def fit_html(fit: Fit) -> str:
    """The page of a fit as text."""
    from msfp_gen.scene.file.loader import scene_text
    from msfp_gen.studies.calibration.fit_result import plot_fit, plot_residuals

    limits = {"What the tests do not tell": fit.unidentified, "Notes": fit.notes}
    return render(
        "fit.html.jinja",
        name=f"{fit.scene.name or 'unnamed scene'}: calibration to tests",
        kind="fit",
        lead=_lead(fit),
        values=_values(fit),
        limits=[(title, lines) for title, lines in limits.items() if lines],
        correlation=correlation_table(fit) if len(fit.estimates) > 1 else None,
        tests=_tests(fit),
        figures=[
            picture("Measured and fitted loops, and residuals over time", plot_fit(fit.tests)),
            picture("Where the residuals lie", plot_residuals(fit.tests)),
        ],
        settings=explain(fit.scene),
        scene=scene_text(fit.scene),
        provenance=_provenance(fit),
        terms=terms_shown(FIT_TERMS),
    )


def _lead(fit: Fit) -> str:
    """What was fitted to what, in one sentence."""
    rows, offsets = (
        sum(len(test.force) for test in fit.tests),
        sum(not np.isfinite(e.bounds[1]) for e in fit.estimates),
    )
    values = _count(len(fit.estimates) - offsets, "value")
    shifts = f" and {_count(offsets, 'offset')} of force" if offsets else ""
    return (
        f"{values} of the scene{shifts} fitted to "
        f"{_count(len(fit.tests), 'laboratory test')} of {_count(rows, 'row')}, by least squares of the force with "
        f"exact derivatives, in {_count(fit.evaluations, 'evaluation')}, by msfp-gen {__version__}."
    )


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _values(fit: Fit) -> Table:
    """The table of estimates with the change from the start and the bounds."""
    table = fitted_values_table(fit)
    rows = [
        (
            *row,
            f"{estimate.run_error:.2g}" if np.isfinite(estimate.run_error) else "not measured",
            f"{100 * (estimate.value / estimate.start - 1):+.1f} %" if estimate.start else "-",
            "{:.4g} to {:.4g}".format(*estimate.bounds) if np.isfinite(estimate.bounds).all() else "none",
        )
        for row, estimate in zip(table.rows, fit.estimates, strict=True)
    ]
    return Table(table.title, (*table.columns, "error of the runs", "change", "bounds"), rows)


def _tests(fit: Fit) -> Table:
    """The table of deviations with what was tested."""
    table = residual_table(fit)
    rows = [
        (
            *row,
            f"{np.abs(test.measured.displacement).max() * MILLI:.4g}",
            f"{np.abs(test.measured.force).max() * KILO:.4g}",
            _load(fit, test),
            f"{test.measured.weight:g}",
            f"{lag_one([test.residual]):.2f}",
        )
        for row, test in zip(table.rows, fit.tests, strict=True)
    ]
    more = ("largest u [mm]", "largest force [kN]", "axial load [kN]", "weight", "correlation of consecutive residuals")
    return Table(table.title, (*table.columns, *more), rows)


def _load(fit: Fit, test: FittedTest) -> str:
    """Axial load of a test, or of the scene [kN]."""
    load = test.measured.axial_load
    return f"{(fit.scene.top.axial_load if load is None else load) * KILO:.5g}"  # type: ignore[attr-defined]


def _provenance(fit: Fit) -> Table:
    """Versions and methods."""
    import scipy

    solver = fit.scene.solver
    rows = [
        ("msfp gen", __version__),
        ("numpy", np.__version__),
        ("scipy", scipy.__version__),
        ("optimiser", 'scipy.optimize.least_squares, method "trf", exact Jacobian'),
        ("intervals", "Laplace with autocorrelated noise of each test, Student's t, and the error of the runs"),
        ("method of the runs", solver.method),
        ("rtol of the runs", f"{solver.rtol:g} in the search, {fit.rtol:g} at its end"),
    ]
    return Table("versions and methods", (), rows)
