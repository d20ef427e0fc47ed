"""The page of an audit or a shadow: every finding with its evidence drawn."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from msfp_gen.auditing.case import CONSISTENT, INCONSISTENT, NONE, OPEN, SHOWN, Drawing, Finding
from msfp_gen.common.arrays import Array
from msfp_gen.common.tables import Table
from msfp_gen.common.version import __version__
from msfp_gen.figures.style import COLOURS, INK, LINE, THIN, page, plain
from msfp_gen.report.frames import picture, render, write_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from msfp_gen.auditing import Audit
    from msfp_gen.auditing.shadow import Shadow

TERMS = (
    ("consistent", "the data agree with the bearing and with mechanics, within the errors that docs/audit.md states"),
    ("inconsistent", "they do not: the sentence says how far, and where"),
    ("not decidable", "the data do not suffice; the sentence says what would decide"),
    ("sliding", "rows in which both outermost surfaces slide along one straight path"),
    ("radius", "distance of the centres of the outermost spheres, over which the force rises by one axial force"),
)  # fmt: skip
SHADOW_TERMS = (
    ("record", "the time histories of the other program, with signs and units put right"),
    ("model", "the full model of the bearing, whose plates move as recorded, under the recorded axial force"),
    ("difference", "record less model, at the rows of the record"),
    ("with, without", "RMS difference of the forces from the model with an effect and without it"),
    ("lift-off", "a second run in which surfaces part, under the mass that the axial force at rest carries"),
)  # fmt: skip
SHOWN_UNITS = {"m": (1e3, "mm"), "N": (1e-3, "kN"), "m/s": (1e3, "mm/s")}


def plot_finding(finding: Finding, path: str | Path | None = None) -> Figure | None:
    """Draw the evidence of a finding; None where it has none. path: of a file to write; None: none.

    Raises InputError for a path that cannot be written.
    """
    if finding.drawing is None:
        return None
    with page(8.0, 3.2, path) as figure:
        axes: Any = figure.subplots()
        axes.set_title(plain(finding.title))
        _draw(axes, finding.drawing)
    return figure


def _draw(axes: Any, drawing: Drawing) -> None:
    """Curves, and a ring at the place that the finding names."""
    labels = set[str]()
    for number, (label, x, y) in enumerate(drawing.curves):
        stated = number > 0
        style: dict[str, Any] = {"color": INK if stated else COLOURS[0], "linewidth": THIN if stated else LINE}
        if stated:
            style |= (
                {"linestyle": (0, (5, 3))}
                if not drawing.points or len(x) < 3
                else {"marker": ".", "linestyle": "none", "markersize": 2}
            )
        elif drawing.points:
            style |= {"marker": ".", "linestyle": "none", "markersize": 3}
        axes.plot(x, y, label=None if label in labels else plain(label), **style)
        labels.add(label)
    if drawing.place is not None:
        axes.plot(*drawing.place, marker="o", markersize=9, markerfacecolor="none", color=COLOURS[1], linestyle="none")
    axes.set(xlabel=drawing.x, ylabel=drawing.y)
    if len(labels) > 1:
        axes.legend()


class Opinion(NamedTuple):
    """What a page shows.

    title, kind: its head. lead: one paragraph. heading, tables: the tables. groups: a heading with findings, each with
    its sentence and its evidence. terms: words with their meaning.
    """

    title: str
    kind: str
    lead: str
    heading: str
    tables: Sequence[Table]
    groups: Sequence[tuple[str, Sequence[Finding]]]
    terms: Sequence[tuple[str, str]]


def write_opinion(opinion: Opinion, path: str | Path) -> Path:
    """Write the page of an audit or a shadow; the file appears only when complete, and loads no other file.

    Raises InputError for a path that does not end in .html or cannot be written.
    """
    return write_page(path, lambda: opinion_html(opinion))


def opinion_html(opinion: Opinion) -> str:
    """The page as text."""
    groups = [(word, [_shown(one) for one in findings]) for word, findings in opinion.groups if findings]
    return render(
        "opinion.html.jinja",
        name=opinion.title,
        kind=opinion.kind,
        lead=f"A second opinion by msfp-gen {__version__}: {opinion.lead}",
        heading=opinion.heading,
        tables=opinion.tables,
        groups=groups,
        terms=opinion.terms,
    )


def audit_opinion(audit: Audit) -> Opinion:
    """Verdicts, and findings by verdict."""
    groups = [
        (word, [one for one in audit.findings if one.verdict == word]) for word in (INCONSISTENT, CONSISTENT, OPEN)
    ]
    groups.append(("friction coefficient that the data imply", list(audit.figures)))
    title = f"{audit.name} against {audit.bearing}"
    return Opinion(title, "audit", f"{audit.text}.", "Verdicts", audit.tables[:-1], groups, TERMS)


def shadow_opinion(shadow: Shadow) -> Opinion:
    """Loops of both, histories of their differences, lift-off, and the effects that the element does not have."""
    groups = [
        ("loops", _loops(shadow)),
        ("differences over time", _differences(shadow)),
        ("lift-off", _lift_off(shadow)),
    ]
    lead = (
        f"the recorded motion and axial force drive the full model of the bearing. {shadow.text[0].upper()}"
        f"{shadow.text[1:]}. The error of {100 * shadow.error:.1g} % is the change of the force of the model by "
        "a tenth of the tolerance, and by every second row of the record; what differs by less tells nothing."
    )
    title = f"{shadow.data.name} beside {shadow.stated.name}"
    return Opinion(title, "shadow", lead, "Differences and effects", shadow.tables, groups, SHADOW_TERMS)


def _loops(shadow: Shadow) -> list[Finding]:
    """The force of both over the displacement, along every axis with a force."""
    found, data = [], shadow.data
    for axis in range(2):
        force, own = data.force[:, axis], shadow.force[:, axis]
        if not force.any():
            continue
        u = 1e3 * data.displacement[:, axis]
        curves = [(name, u, values / 1e3) for name, values in (("recorded", force), ("model", own))]
        areas = [float(np.trapezoid(values, data.displacement[:, axis])) / 1e3 for values in (force, own)]
        sentence = f"the loops enclose {areas[0]:.4g} kJ in the record, {areas[1]:.4g} kJ in the model"
        drawing = Drawing([_every(*curve) for curve in curves], "displacement [mm]", "force [kN]")
        found.append(Finding(f"loop_{axis + 1}", f"loops along E{axis + 1}", NONE, sentence, drawing=drawing))
    return found


def _differences(shadow: Shadow) -> list[Finding]:
    """The recorded histories less the computed ones, with a ring at the largest difference."""
    found, time = [], shadow.data.time
    for one, (recorded, own) in zip(shadow.differences, shadow.histories.values(), strict=True):
        scale, unit = SHOWN_UNITS.get(one.unit, (1.0, one.unit))
        apart = scale * np.reshape(recorded - own, (len(time), -1))
        row = int(np.searchsorted(time, one.time))
        parts = [axis for axis in range(apart.shape[1]) if apart[:, axis].any() or apart.shape[1] == 1]
        names = [f"along E{axis + 1}" if apart.shape[1] > 1 else one.title for axis in parts]
        curves = [_every(name, time, apart[:, axis]) for name, axis in zip(names, parts, strict=True)]
        largest = max((apart[row, axis] for axis in parts), key=abs, default=0.0)
        drawing = Drawing(curves, "time [s]", f"record - model [{unit}]", (one.time, float(largest)))
        sentence = (
            f"{scale * one.rms:.3g} {unit} RMS, at most {scale * one.largest:.3g} {unit} at {one.time:.4g} s, of a "
            f"recorded largest of {scale * one.size:.4g} {unit}"
        )
        found.append(Finding(one.quantity, one.title, NONE, sentence, drawing=drawing))
    return found


def _lift_off(shadow: Shadow) -> list[Finding]:
    """The clearance of every surface that opens in the run in which surfaces part."""
    if shadow.opened is None:
        return []
    rows, found = shadow.opened.history, [Finding("lift-off", "when surfaces part", NONE, shadow.lift_off)]
    for surface, lift in enumerate(rows.lift.T, start=1):
        if lift.any():
            curve = _every("clearance", shadow.data.time[0] + rows.time, 1e3 * lift)
            drawing = Drawing([curve], "time [s]", "clearance [mm]")
            sentence = f"it opens by up to {1e3 * lift.max():.3g} mm"
            found.append(Finding(f"lift_{surface}", f"clearance of surface {surface}", NONE, sentence, drawing=drawing))
    return found


def _every(label: str, x: Array, y: Array) -> tuple[str, Array, Array]:
    """A curve of at most about `SHOWN` points."""
    step = max(1, len(x) // SHOWN)
    return label, x[::step], y[::step]


def _shown(finding: Finding) -> dict[str, Any]:
    """Title, sentence and figure of a finding."""
    figure = plot_finding(finding)
    return {
        "title": finding.title,
        "sentence": f"{finding.sentence[0].upper()}{finding.sentence[1:]}.",
        "figure": None if figure is None else picture(finding.title, figure),
    }
