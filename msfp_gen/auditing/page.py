"""The page of an audit: every finding with its evidence drawn."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from msfp_gen.auditing.checks import CONSISTENT, INCONSISTENT, OPEN, Drawing, Finding
from msfp_gen.common.version import __version__
from msfp_gen.figures.style import COLOURS, INK, LINE, THIN, page, plain
from msfp_gen.report.frames import picture, render, write_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from msfp_gen.auditing import Audit

TERMS = (
    ("consistent", "the data agree with the bearing and with mechanics, within the errors that docs/audit.md states"),
    ("inconsistent", "they do not: the sentence says how far, and where"),
    ("not decidable", "the data do not suffice; the sentence says what would decide"),
    ("sliding", "rows in which both outermost surfaces slide along one straight path"),
    ("radius", "distance of the centres of the outermost spheres, over which the force rises by one axial force"),
)  # fmt: skip


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


def write_audit(audit: Audit, path: str | Path) -> Path:
    """Write the page of an audit; the file appears only when complete, and loads no other file.

    Raises InputError for a path that does not end in .html or cannot be written.
    """
    return write_page(path, lambda: audit_html(audit))


def audit_html(audit: Audit) -> str:
    """The page of an audit as text."""
    order = [INCONSISTENT, CONSISTENT, OPEN]
    groups = [
        (word, [_shown(one) for one in audit.findings if one.verdict == word])
        for word in order
    ]  # fmt: skip
    return render(
        "audit.html.jinja",
        name=f"{audit.name} against {audit.bearing}",
        kind="audit",
        lead=f"A second opinion by msfp-gen {__version__}: {audit.text}.",
        summary=audit.tables[0],
        groups=[(word, found) for word, found in groups if found],
        terms=TERMS,
    )


def _shown(finding: Finding) -> dict[str, Any]:
    """Title, sentence and figure of a finding."""
    figure = plot_finding(finding)
    return {
        "title": finding.title,
        "sentence": f"{finding.sentence[0].upper()}{finding.sentence[1:]}.",
        "figure": None if figure is None else picture(finding.title, figure),
    }
