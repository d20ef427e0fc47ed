"""The report of a whole analysis: the suite at bounds in a folder -> a page of numbered sections, tables and figures.

All numbers come from the rows that `msfp-gen bound --suite -o` wrote, and from the inputs named in its folder, except
the runs that `repeated` makes again.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import singledispatch
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.aliases import Progress
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import G, Quantity, ruled_fields
from msfp_gen.common.tables import Table, decimal_text
from msfp_gen.common.version import __version__
from msfp_gen.figures.sheet import plot_sheet
from msfp_gen.figures.style import (
    CASE_COLOURS,
    COLOURS,
    FAINT,
    INK,
    THIN,
    distinct_colours,
    headline,
    page,
    panels,
    plain,
)
from msfp_gen.report.compared import COMPARISONS, OF_SHEETS, compared_table, comparisons_of
from msfp_gen.report.frames import picture, render, write_page
from msfp_gen.report.page import NO_TITLE, TERMS, TitleBlock, bearing_kind, terms_shown
from msfp_gen.report.repeated import (
    Repeated,
    error_words,
    finer_table,
    plot_loops,
    plot_vertical,
    repeat_words,
    repeated,
    vertical_table,
)
from msfp_gen.results.verdict import LIMITS
from msfp_gen.scene.explain import DOUBTFUL, explain
from msfp_gen.scene.file.loader import bearing_from_table, bearing_tables, parsed_sheet
from msfp_gen.scene.plausibility import runs_of_doubts
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.scene_fields import Limits
from msfp_gen.scene.sheet import Sheet
from msfp_gen.studies.bounding import CASES, SuiteBounds, load_suite_bounds
from msfp_gen.studies.bounding.runs import given_friction, shown_as
from msfp_gen.studies.bounding.suite import (
    plot_suite_bounds,
    suite_bound_tables,
    suite_doubts,
    suite_scenes,
    uplift_words,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from msfp_gen.motions.records import ScaleTo
    from msfp_gen.studies.definition import Study

PERIODS = np.geomspace(0.05, 6.0, 60)  # of the spectra [s]
SHOWN_PERIODS = (0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 4.0)  # of the table of floor spectra, about [s]
Captioned = tuple[str, "Figure"]
# Quantities of parts, by section: column without its number.
FLOORS = ("floor_corner_acceleration", "storey_corner_drift_ratio", "storey_shear")
BEARINGS = ("bearing_displacement", "bearing_load_ratio", "bearing_maximum_load_ratio")
UPLIFT = ("bearing_uplift_height", "bearing_uplift_duration")


@dataclass(frozen=True)
class Section:
    """A section of the report: title, paragraphs, tables, and figures with their captions."""

    title: str
    words: Sequence[str] = ()
    tables: Sequence[Table] = ()
    figures: Sequence[Captioned] = ()


@singledispatch
def structure_of(scene: Any, table: Mapping[str, Any]) -> tuple[list[Table], list[Captioned]]:
    """Tables and figures of the superstructure of a system. table: of its file."""
    found: tuple[list[Table], list[Captioned]] = scene.structure(table)
    return found


@structure_of.register(Scene)
def _no_structure(_: Scene, __: Mapping[str, Any]) -> tuple[list[Table], list[Captioned]]:
    return [], []


def write_analysis(
    folder: str | Path,
    path: str | Path,
    title: TitleBlock = NO_TITLE,
    leave_out: Collection[str] = (),
    *,
    loops: bool = True,
    progress: Progress | None = None,
) -> Path:
    """Write the report of a suite at bounds; the file appears only when complete, and loads no other file.

    Args:
        folder: that `bound_suite` wrote.
        path: of the page.
        title: what identifies the report.
        leave_out: names of records that are not part of it.
        loops: whether the runs with the largest displacements are made again, with and without the vertical component
            of the ground, for their loops and their comparison.
        progress: called with the share of these runs that is done, and 1.

    Raises InputError: see `load_suite_bounds`, or a path that does not end in .html or cannot be written.
    """
    return write_page(path, lambda: analysis_html(folder, title, leave_out, loops=loops, progress=progress))


def analysis_html(
    folder: str | Path,
    title: TitleBlock = NO_TITLE,
    leave_out: Collection[str] = (),
    *,
    loops: bool = True,
    progress: Progress | None = None,
) -> str:
    """The report of a suite at bounds as text; arguments and errors as in `write_analysis`."""
    from msfp_gen.studies.assessment.rows import read_study
    from msfp_gen.studies.run import Chunks

    study, bounds = load_suite_bounds(folder, leave_out)
    rows = read_study(folder)
    rows = rows[~rows["record"].isin(list(leave_out))]
    first = len(CASES) * list(study.inputs.records).index(bounds.records[0]) + 1
    scene = replace(study.scene(first + CASES.index("nominal")), name=bounds.name)
    runs = repeated(study, bounds, rows, progress) if loops else []
    found = [*_sections(study, bounds, rows, scene), *_runs_again(study, bounds, runs)]
    found += _last_sections(study, bounds, rows, scene, runs)
    sections = [part for part in found if part.tables or part.figures or part.words]
    exceeded, failed = bool(bounds.exceeded), bool(bounds.failures or bounds.stopped)
    device = ", ".join(dict.fromkeys(map(bearing_kind, scene.every_bearing)))
    return render(
        "analysis.html.jinja",
        name=f"{bounds.name or 'unnamed scene'}: response history analysis at bounds",
        kind="analysis",
        title_block=replace(title, author="", checker="").rows(device),
        signatures=(("author", title.author), ("checker", title.checker)),
        identity=Chunks(study, Path(folder)).identity,
        inputs=_inputs(study, bounds, scene),
        lead=_lead(bounds, rows),
        outcome=_outcome(bounds.ended.size, len(bounds.failures), len(bounds.stopped), len(bounds.exceeded)),
        verdict="failed" if failed else "exceeded" if exceeded else "within",
        sections=list(_numbered(sections)),
        terms=terms_shown(TERMS),
    )


def _numbered(sections: Sequence[Section]) -> Iterator[dict[str, Any]]:
    """Sections for the template, with numbers of tables and figures through the whole report."""
    tables = figures = 0
    for number, section in enumerate(sections, start=1):
        shown_tables = []
        for table in section.tables:
            tables += 1
            shown_tables.append(Table(f"Table {tables}. {table.title}", table.columns, table.rows))
        shown_figures = []
        for caption, figure in section.figures:
            figures += 1
            shown_figures.append(picture(f"Figure {figures}. {caption}", figure))
        yield {
            "number": number,
            "title": section.title,
            "words": section.words,
            "tables": shown_tables,
            "figures": shown_figures,
        }


def doubt_table(study: Study, bounds: SuiteBounds) -> list[Table]:
    """The values of all runs that are hardly meant, with their records; no table without any."""
    found = runs_of_doubts(suite_doubts(study, suite_scenes(study, bounds.left_out)))
    rows = [("all" if len(names) == len(bounds.records) else ", ".join(names), text) for text, names in found.items()]
    return [Table(DOUBTFUL, ("records", "value"), rows)] if rows else []


def _sections(study: Study, bounds: SuiteBounds, rows: Any, scene: Any) -> Iterator[Section]:
    first, *others = suite_bound_tables(bounds)
    figure = plot_suite_bounds(bounds)
    caption = "Main quantities over the bounds, each record in a colour of its own"
    tables = [*doubt_table(study, bounds), first, *others, limit_table(bounds, rows)]
    yield Section("Envelope over records and bounds", (), tables, [(caption, figure)])
    yield _bearing_section(study, scene)
    tables, figures = structure_of(scene, study.table["scene"])
    yield Section("Superstructure", (), tables, figures)
    yield _motion_section(study, bounds)
    yield _part_section(bounds, "Floor accelerations, drifts and storey shears", FLOORS)
    yield _spectra_section(rows)
    yield _part_section(bounds, "Displacements and axial forces of the bearings", BEARINGS, _rest(bounds))
    yield _part_section(bounds, "Uplift", UPLIFT, uplift_words(bounds))


def _runs_again(study: Study, bounds: SuiteBounds, runs: Sequence[Repeated]) -> Iterator[Section]:
    """Loops of the runs with the largest displacements, and what the vertical component does to them."""
    if not runs:
        return
    caption = "Force over displacement in the runs with the largest displacement, every row of the run"
    yield Section("Loops", (repeat_words(runs),), (), [(caption, plot_loops(runs, bounds.name or "unnamed scene"))])
    pairs = [run for run in runs if run.level is not None]
    if pairs:
        words = (
            "The runs of the section before were made once more with the vertical component of the ground at zero. "
            "Nothing isolates the bearings vertically: the axial forces follow the ground and the vertical modes, and "
            "the horizontal force of a friction pendulum follows its axial force. The last row says how much of the "
            "base shear remains beyond this: over the axial forces of the same instant."
        )
        caption = "Base shear, axial force and accelerations with the vertical component and without it"
        figures = [(caption, plot_vertical(pairs))]
        yield Section("Vertical component of the ground", (words,), [vertical_table(study, pairs)], figures)


def _last_sections(
    study: Study, bounds: SuiteBounds, rows: Any, scene: Any, runs: Sequence[Repeated]
) -> Iterator[Section]:
    again = next((run for run in runs if run.finer is not None), None)
    error = [*_energy(rows, *scene.energy_compared), *error_words(scene.solver, again)]
    yield Section("Energy and numerical error", error, [finer_table(study, again)] if again else [])
    words = (
        "These comparisons are of the program, in its tests, and none is of this structure. Each page of the "
        "documentation says what was compared, and how large the differences were."
    )
    comparisons = [*comparisons_of(scene), *COMPARISONS]
    if any("sheet" in table for table in bearing_tables(study.table["scene"]).values()):
        comparisons.append(OF_SHEETS)
    yield Section("Which parts of the program were compared with what", (words,), [compared_table(comparisons)])
    settings = (table for table in explain(scene) if not table.title.endswith(DOUBTFUL))  # of all runs: `doubt_table`
    words = (
        f"The tables are of one run, {bounds.records[0]} at nominal friction. The other runs differ in the record, in "
        "friction, and in the effects that follow from both."
    )
    yield Section("Settings", (words,), [*settings, _files(study)])


def _spectra_section(rows: Any) -> Section:
    """Floor spectra: means by bound, and the envelope of all runs that reached their end."""
    if "floor_spectra" not in rows:
        return Section("Floor spectra")
    known = rows[(rows["status"] == "ok") & rows["floor_spectra"].notna()]
    found = {case: list(map(json.loads, known[known["bounds"] == case]["floor_spectra"])) for case in CASES}
    every = [one for of_case in found.values() for one in of_case]
    if not every:
        return Section("Floor spectra")
    names, periods = list(every[0]["floors"]), np.array(every[0]["periods"])
    values = {
        case: np.array([[run["floors"][name] for name in names] for run in of_case])
        for case, of_case in found.items()
        if of_case
    }  # (runs, floors, 2, periods) [m/s^2]
    envelope = np.concatenate(list(values.values())).max(axis=0)
    at = [int(np.abs(np.log(periods / period)).argmin()) for period in SHOWN_PERIODS]
    table = Table(
        f"envelope of the floor spectra of all {len(every)} runs [g], periods in s",
        ("floor", "direction", *(f"{periods[index]:.3g}" for index in at), "largest", "at"),
        [
            (name if not way else "", ("horizontal", "vertical")[way],
             *(f"{curve[index] / G:.3f}" for index in at), f"{curve.max() / G:.3f}", f"{periods[curve.argmax()]:.3g}")
            for name, curves in reversed(list(zip(names, envelope, strict=True)))
            for way, curve in enumerate(curves)
        ],
    )  # fmt: skip
    damping = 100 * every[0]["damping"]
    words = (
        f"Pseudo-acceleration of oscillators with {damping:g} % damping on each floor: the larger of both horizontal "
        "directions, and vertical, the largest at the corners of the plan.",
    )
    caption = "Floor spectra: mean over the records at each bound, and the envelope of all runs"
    return Section("Floor spectra", words, [table], [(caption, _plot_floor_spectra(names, periods, values, envelope))])


def _plot_floor_spectra(names: Sequence[str], periods: Array, values: Mapping[str, Array], envelope: Array) -> Figure:
    """Floors below each other, the highest first. values: case -> shape (runs, floors, 2, periods) [m/s^2]."""
    with page(9.5, 1.0 + 1.2 * len(names)) as figure:
        headline(figure, "Floor spectra")
        grid = figure.subplots(len(names), 2, squeeze=False, sharex=True, sharey="col")
        for row, index in zip(grid, reversed(range(len(names))), strict=True):
            for way, axes in enumerate(row):
                axes.fill_between(periods, envelope[index, way] / G, color=FAINT, alpha=0.25, label="all runs")
                for case, of_case in values.items():
                    mean = of_case[:, index, way].mean(axis=0) / G
                    axes.plot(periods, mean, color=CASE_COLOURS[case], label=f"mean {case}")
                axes.set_title(f"{plain(names[index])}, {('horizontal', 'vertical')[way]}")
                axes.set(xscale="log", xlim=(periods[0], periods[-1]))
                axes.set_xticks([0.05, 0.1, 0.2, 0.5, 1, 2, 5], ["0.05", "0.1", "0.2", "0.5", "1", "2", "5"])
                axes.minorticks_off()
            row[0].set_ylabel("[g]")
        for axes in grid[-1]:
            axes.set_xlabel("period T [s]")
            axes.set_ylim(bottom=0.0)
        handles, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=4)
    return figure


def _inputs(study: Study, bounds: SuiteBounds, scene: Any) -> Table:
    """The inputs on page one; Settings has all."""
    loads = np.array(scene.loads_at_rest) / 1e6
    each = f", {loads.min():.3g} to {loads.max():.3g} MN on one" if len(loads) > 1 else ""
    factors, (target, _) = study.inputs.factors[study.axes[-1].paths[0]], _target(study)
    scales = [f"{name} × {float(study.inputs.records[name].get('scale', 1.0)):.4g}" for name in bounds.records]
    rows = [
        ("bearings", "; ".join(f"{n} × {kind}" for kind, n in Counter(map(bearing_kind, scene.every_bearing)).items())),
        ("load at rest", f"{loads.sum():.4g} MN{f' on {len(loads)} bearings' if each else ''}{each}"),
        *_frictions(study),
        ("bounds", f"{factors.name}: {factors.description}".rstrip(": ")),
        *((f"factor of {one.property.replace('_', ' ')}", "{:.4g} to {:.4g}".format(*factors.combined(one)))
          for one in factors.factors),
        ("ground motions and their factors", ", ".join(scales)),
        *([("factors bring the mean to", str(target))] if target else []),
        ("limits of the device", f"{'' if scene.limits else 'none given; by default '}{_limits(scene.limits)}"),
        ("tolerance of a step", f"rtol = {scene.solver.rtol:g}, method {scene.solver.method}"),
    ]  # fmt: skip
    return Table("Main inputs; section Settings has all", (), rows)


def _frictions(study: Study) -> Iterator[tuple[str, str]]:
    """Friction of every kind of bearing at each bound, where it was given."""
    cases = {case: study.scene(1 + index).every_bearing for index, case in enumerate(CASES)}
    kinds = list(dict.fromkeys(cases["nominal"]))
    for number, kind in enumerate(kinds, start=1):
        at = " at the pivot" if kind.friction_given_at == "pivot" else ""
        which = f" of type {number}" if len(kinds) > 1 else ""
        for case, bearings in cases.items():
            values = given_friction(bearings[cases["nominal"].index(kind)])
            yield f"friction{at}{which}, from below, {case}", ", ".join(f"{value:.4g}" for value in values)


def _limits(limits: Limits | None) -> str:
    """The limits with a value of their own; the others follow from the bearing."""
    texts = []
    for name, rule, _ in ruled_fields(Limits):
        value = getattr(limits or Limits(), name)
        if isinstance(rule, Quantity) and value is not None:
            unit, scale = shown_as(rule.unit)
            texts.append(f"{name.replace('_', ' ')} {value * scale:.4g} {unit}")
    return "; ".join(texts)


def _lead(bounds: SuiteBounds, rows: Any) -> str:
    left = f", {', '.join(bounds.left_out)} left out" if bounds.left_out else ""
    count = len(bounds.records)
    motions = f"{count} ground motion{'s' * (count > 1)}{left}"
    return (
        f"{motions}, each at lower bound, nominal and upper bound of the bearings by "
        f"{bounds.factors}: {len(rows)} nonlinear response histories, by msfp-gen {__version__}."
    )


def _outcome(runs: int, failed: int, stopped: int, exceeded: int) -> str:
    """How many runs ended early, by failure or by a stop, and how many exceeded a limit."""
    early = failed + stopped
    ended = f"{early} of {runs} runs did not reach their end" if early else f"All {runs} runs reached their end"
    of = f"the {runs - failed} that did not fail" if failed else f"{runs}"  # the others may be beyond limits: the table
    if exceeded:
        limits = f"{exceeded} of {of} exceeded limits of the device"
    else:
        limits = f"none{f' of {of}' if failed else ''} exceeded a limit of the device"
    return f"{ended}; {limits}."


def limit_table(bounds: SuiteBounds, rows: Any) -> Table:
    """The largest share of every limit of the device by bound, with its record, value and place."""
    cases = {case: _reached(rows[rows["bounds"] == case]) for case in CASES}
    names = {key: None for found in cases.values() for key in found}
    words = {limit.key: limit.name for limit in LIMITS}
    shown = []
    for name in names:
        shares = [cases[case].get(name) for case in CASES]
        worst = max((one for one in shares if one is not None), key=lambda one: one["share"])
        cells = ("-" if one is None else f"{100 * one['share']:.3g}\N{NO-BREAK SPACE}%" for one in shares)
        unit, scale = shown_as(worst["unit"]) if worst["unit"] else ("", 1.0)
        values = (f"{worst[key] * scale:.4g}\N{NO-BREAK SPACE}{unit}".rstrip() for key in ("value", "allowed"))
        label = name.replace("_", " ")
        label += f": {words[name]}" if words[name] != label else ""
        shown.append((label, *cells, *values, worst["record"] if worst["share"] else "-"))
    columns = ("limit", *CASES, "largest", "allowed", "record")
    return Table("share of every limit of the device that the worst run reached (docs/results.md)", columns, shown)


def _reached(rows: Any) -> dict[str, dict[str, Any]]:
    """Limit -> the reading with the largest share over some runs, with its share and record."""
    most: dict[str, dict[str, Any]] = {}
    for record, text in zip(rows["record"], rows["limits_reached"], strict=True):
        for reading in json.loads(text) if isinstance(text, str) and text else ():
            value, allowed = reading["value"], reading["allowed"]
            share = value / allowed if allowed > 0 else float("inf") if value > 0 else 0.0
            key = reading["limit"]
            if key not in most or share > most[key]["share"]:
                most[key] = {**reading, "share": share, "record": record}
    return most


def _bearing_section(study: Study, scene: Any) -> Section:
    """The data sheets of the scene; without one the bearing is among the settings."""
    from msfp_gen.design.sheet import SheetReport

    scene_table = study.table["scene"]
    tables: list[Table] = []
    figures: list[Captioned] = []
    for kind, table in bearing_tables(scene_table).items():
        if "sheet" not in table:
            continue
        name = kind or str(scene_table.get("name") or "bearing")
        data: Sheet = parsed_sheet(table)
        report = SheetReport(name, data, bearing_from_table(table))
        tables += report.tables
        caption = f"{name}: section to scale, published backbone; dots: displacements of the effective properties"
        figures.append((caption, plot_sheet(report, table=False)))
    words = () if tables else ("The bearing is given surface by surface: see Settings.",)
    return Section("Bearing", words, tables, figures)


def _target(study: Study) -> tuple[ScaleTo | None, float | None]:
    """To what the records are scaled, None where they have factors of their own, and the least share of it."""
    from msfp_gen.motions.records import ScaleTo

    target = dict(study.table["records"].get("target") or {})
    share = target.pop("least_share", None)
    return ScaleTo(**target) if target else None, share


def _motion_section(study: Study, bounds: SuiteBounds) -> Section:
    from msfp_gen.motions.records.record_tables import suite_tables
    from msfp_gen.motions.records.spectrum import MEASURES, response_spectrum
    from msfp_gen.scene.file.loader import suite_from_table

    records = [
        record
        for record in suite_from_table({"records": study.table["records"]["motions"]}, None).records
        if record.name in bounds.records
    ]
    scale_to, share = _target(study)
    component = scale_to.component if scale_to else "rotd50"
    damping = scale_to.damping if scale_to else 0.05
    spectra = {record.name: response_spectrum(record.motion, PERIODS, damping=damping).psa / G for record in records}
    names, motions = [record.name for record in records], [record.motion for record in records]
    origins = [
        (
            name,
            str(m.metadata.get("channels", "-")),
            str(m.metadata.get("correction", "none")),
            str(m.metadata.get("file", m.metadata.get("name", "")) or "-"),
        )
        for name, m in zip(names, motions, strict=True)
    ]
    columns = ("record", "channels", "correction", "source")
    tables = [*suite_tables(names, motions, None), Table("channels and correction of the records", columns, origins)]
    words = [f"Spectra of {100 * damping:g} % damping. All three components of a record have one factor."]
    if scale_to:
        least = "" if share is None else f"; the mean is nowhere below {100 * share:g} % of it there"
        words.append(f"The factors bring the mean of the records to the target: {scale_to}{least}.")
    column = MEASURES.index(component)
    curve = scale_to.curve(PERIODS) if scale_to else None
    horizontal, vertical = ({name: psa[:, c] for name, psa in spectra.items()} for c in (column, 2))
    between = scale_to.between if scale_to else None
    figure = _plot_spectra(horizontal, curve, component, vertical, between)
    caption = f"Pseudo-acceleration of the scaled motions, {component} and vertical, their means and the target"
    return Section("Ground motions", words, tables, [(caption, figure)])


def _plot_spectra(
    horizontal: Mapping[str, Array],
    target: tuple[Array, Array] | None,
    component: str,
    vertical: Mapping[str, Array],
    between: tuple[float, float] | None,
) -> Figure:
    with page(9.5, 4.6) as figure:
        headline(figure, "Spectra of the scaled ground motions")
        row = panels(figure, f"horizontal, {component}", "vertical")
        colours = distinct_colours(len(horizontal))
        for axes, spectra in zip(row, (horizontal, vertical), strict=True):
            for (name, values), colour in zip(spectra.items(), colours, strict=True):
                axes.plot(PERIODS, values, color=colour, linewidth=THIN, label=plain(name))
            axes.plot(PERIODS, np.mean(list(spectra.values()), axis=0), color=INK, linewidth=2.2, label="mean")
            axes.set(xscale="log", xlabel="period T [s]", ylabel="pseudo-acceleration [g]")
            axes.set_xticks([0.05, 0.1, 0.2, 0.5, 1, 2, 5], ["0.05", "0.1", "0.2", "0.5", "1", "2", "5"])
            axes.minorticks_off()
            axes.set_ylim(bottom=0.0)
        if target is not None:
            row[0].plot(target[0], np.asarray(target[1]) / G, color=COLOURS[1], linestyle="--", linewidth=2.2,
                        label="target")  # fmt: skip
        if between:
            row[0].axvspan(*between, color=FAINT, alpha=0.12, label="compared here")
        handles, labels = row[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside right center")
    return figure


def _part_section(bounds: SuiteBounds, title: str, quantities: Sequence[str], words: Sequence[str] = ()) -> Section:
    """Means and worst values of quantities of parts by bound: a table for each, and one figure."""
    tables, drawn = [], {}
    for quantity in quantities:
        parts = [one for one in bounds.statistics if one.part and one.name.rpartition("_")[0] == quantity]
        if not any(value for one in parts for value in (*one.worst, *one.means) if value):  # nothing lifted off
            continue
        drawn[quantity] = parts
        unit, scale = shown_as(parts[0].unit)
        rows = [
            (
                one.part,
                *("-" if v is None else decimal_text(v * scale) for v in (*one.means, *one.worst)),
                one.governs or "-",
                one.record or "-",
            )
            for one in reversed(parts)
        ]
        columns = ("part", *(f"mean {c}" for c in CASES), *(f"worst {c}" for c in CASES), "governs", "worst record")
        tables.append(Table(f"{_words_of(bounds, parts[0])} [{unit}]", columns, rows))
    if not drawn:
        return Section(title, words)
    caption = "Each part at each bound: mean over the records (lines) and worst record (dots)"
    return Section(title, words, tables, [(caption, _plot_parts(bounds, drawn, title))])


def _plot_parts(bounds: SuiteBounds, drawn: Mapping[str, Sequence[Any]], title: str) -> Figure:
    most = max(map(len, drawn.values()))
    with page(9.5, 2.2 + 0.16 * min(max(most, 8), 40)) as figure:
        headline(figure, title)
        row = panels(figure, *(fill(_words_of(bounds, parts[0]), 26) for parts in drawn.values()))
        for axes, parts in zip(row, drawn.values(), strict=True):
            unit, scale = shown_as(parts[0].unit)
            place = np.arange(len(parts))
            for index, case in enumerate(CASES):
                for values, style in (([p.means[index] for p in parts], "-"), ([p.worst[index] for p in parts], "o")):
                    shown = [np.nan if value is None else value * scale for value in values]
                    label = case if style == "-" else None
                    axes.plot(shown, place, style, color=CASE_COLOURS[case], markersize=4, label=label)
            axes.set_yticks(place, [plain(one.part) for one in parts])
            axes.set_xlabel(f"[{unit}]")
            axes.set_xlim(left=min(0.0, axes.get_xlim()[0]))
            axes.locator_params(axis="x", nbins=4)  # numbers such as 0.0005 have room
        row[-1].legend(loc="upper left", bbox_to_anchor=(1.02, 1))
    return figure


def _words_of(bounds: SuiteBounds, statistic: Any) -> str:
    return bounds.sources[statistic.name].words(statistic.name).removesuffix(f" of {statistic.part}")


def _rest(bounds: SuiteBounds) -> tuple[str, ...]:
    """What is known of the residual displacement, in words."""
    if "residual_displacement" in bounds.undefined:
        return ("No residual displacement is stated: some runs end while the structure still moves.",)
    found = [one for one in bounds.statistics if one.name == "residual_displacement"]
    return tuple(f"Residual displacement: at most {1e3 * one.envelope[1]:.4g} mm{one.under}." for one in found)


def _energy(rows: Any, compared: str, scale: str) -> list[str]:
    """What the energy balances of the runs say, in words. compared, scale: as in `System.energy_compared`."""
    error = rows["closure_error"].dropna().abs()
    if error.empty:
        return []
    worst = rows.loc[error.idxmax()]
    return [
        f"In {len(error)} of {len(rows)} runs {compared}. The difference is an error of the computation: at most "
        f"{100 * error.max():.2g} % of the {scale} energy ({worst['record']}, {worst['bounds']}), "
        f"{100 * error.median():.2g} % in the median run.",
        f"The runs took {int(rows['steps'].min())} to {int(rows['steps'].max())} time steps.",
    ]


def _files(study: Study) -> Table:
    """Every file that was opened, with the digest of its bytes; no folders."""
    rows = [(Path(path).name, digest) for path, digest in study.files.items()]
    return Table("files of the inputs, with their SHA-256", ("file", "SHA-256"), rows or [("none", "-")])


def is_suite_folder(source: str | Path) -> bool:
    """Whether a source of `msfp-gen report` is a folder. Raises InputError for one without a study."""
    from msfp_gen.studies.run import STUDY_FILE

    path = Path(source)
    if path.is_dir() and not (path / STUDY_FILE).is_file():
        raise InputError(
            f"{str(source)!r}: no {STUDY_FILE} here; give the folder of `msfp-gen bound --suite FILE -o DIR`"
        )
    return path.is_dir()
