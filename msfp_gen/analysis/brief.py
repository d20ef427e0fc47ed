"""A run in a few lines of text, and as HTML with a small hysteresis loop for a notebook."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.analysis.summary import summarise

if TYPE_CHECKING:
    from msfp_gen.common.arrays import Array
    from msfp_gen.results.run_data import RunData

MAX_NOTES = 2  # printed; the others are counted
MAX_POINTS = 600  # of the loop
WIDTH, HEIGHT, MARGIN = 320, 200, 8  # of the loop [px]


def brief_rows(result: RunData) -> list[tuple[str, str]]:
    """Label and value of the main results, eight rows at most."""
    summary, history = summarise(result), result.history
    displacement, force = summary["peak_displacement"]["radial"], summary["peak_top_force"]["radial"]
    ratio = "" if summary["peak_force_ratio"] is None else f" ({summary['peak_force_ratio']:.3f} of the axial load)"
    extremes = result.extremes
    rows = [
        ("time", f"{history.time[-1]:.6g} s in {summary['counters']['steps']} steps, {summary['wall_time']:.3g} s"),
        ("peak displacement", f"{1e3 * displacement:.4g} mm"),
        ("peak force", f"{1e-3 * force:.4g} kN{ratio}"),
        ("peak sliding", ", ".join(f"{1e3 * s:.4g}" for s in extremes.sliding) + " mm, bottom first"),
        ("normal force", f"{1e-3 * extremes.least_normal.min():.4g} to {1e-3 * extremes.most_normal.max():.4g} kN"),
    ]
    return with_status(result, rows)


def with_status(result: Any, rows: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """Label and value of the main results of a run, of one bearing or of a building, after its status, with notes."""
    status = result.status + (f": {result.message}" if result.message else "")
    notes = [note.line for note in result.notes]
    more = f"; {len(notes) - MAX_NOTES} more in .notes" if len(notes) > MAX_NOTES else ""
    return [("status", status), *rows, *([("notes", "; ".join(notes[:MAX_NOTES]) + more)] if notes else [])]


def brief_text(result: RunData) -> str:
    """The main results, ten lines at most."""
    return text_of(f"Result of {result.scene.name or 'an unnamed scene'}", brief_rows(result))


def text_of(title: str, rows: list[tuple[str, str]]) -> str:
    """A title and rows of label and value, one line each."""
    return "\n".join([title, *(f"  {label:<18}{_one_line(value)}" for label, value in rows)])


def brief_html(result: RunData) -> str:
    """The main results as a table, beside the horizontal force over the displacement."""
    force = result.history.top_force[:, :2] @ result.history.direction
    return html_of(result.scene.name, brief_rows(result), result.history.path[0], force, "force over displacement")


def html_of(name: str, rows: list[tuple[str, str]], x: Array, y: Array, caption: str) -> str:
    """Rows of label and value as a table, beside a curve of points x, y, each of shape (k,)."""
    cells = "".join(f"<tr><th>{escape(k)}</th><td>{escape(_one_line(v))}</td></tr>" for k, v in rows)
    return (
        f"<div><b>{escape(name or 'unnamed scene')}</b><div style='display:flex;gap:1em'><table>{cells}</table>"
        f"<figure style='margin:0'>{_curve(x, y)}<figcaption>{escape(caption)}</figcaption></figure></div></div>"
    )


def _curve(x: Array, y: Array) -> str:
    """A curve as SVG."""
    rows = np.unique(np.linspace(0, len(x) - 1, min(MAX_POINTS, len(x))).astype(int))
    x, y = _scaled(x[rows], WIDTH), HEIGHT - _scaled(y[rows], HEIGHT)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return (
        f'<svg width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="loop">'
        f'<polyline points="{points}" fill="none" stroke="currentColor" stroke-width="1"/></svg>'
    )


def _scaled(values: Array, size: float) -> Array:
    """Values mapped to a margin inside 0 ... `size`."""
    low, spread = float(values.min()), float(np.ptp(values)) or 1.0
    scaled: Array = MARGIN + (values - low) / spread * (size - 2 * MARGIN)
    return scaled


def _one_line(text: str) -> str:
    return " ".join(text.split())
