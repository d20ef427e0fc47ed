"""Output of a study of accuracy: tables, CSV, JSON, Markdown, a figure, and the machine that the times are of."""

from __future__ import annotations

import json
import os
import platform
import subprocess
from dataclasses import fields
from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.output import make_folder, write_bytes
from msfp_gen.common.tables import Table, write_rows
from msfp_gen.errors import CompileError
from msfp_gen.studies.accuracy.timed_run import CUT_OFF, ERRORS, REFUSED, Errors
from msfp_gen.version import __version__

if TYPE_CHECKING:
    from msfp_gen.studies.accuracy.study import Point, Study

NAMES = tuple(field.name for field in fields(Errors))
HEADS = (
    "",
    "tolerance",
    "outcome",
    "seconds",
    "Newton iterations",
    "force max",
    "force RMS",
    "sliding max",
    "sliding RMS",
)


def machine() -> dict[str, str]:
    """Name -> text: processor, cores, system, compiler, versions, commit of a checkout; without unknown ones."""
    about = {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.machine()}",
        "compiler": _compiler(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "msfp_gen": __version__,
        "commit": _commit(),
    }
    return {name: value for name, value in about.items() if value}


def _compiler() -> str:
    from msfp_gen.jit.compiler import FLAGS, find_compiler

    try:
        return f"{find_compiler().version}, {' '.join(f for f in (*FLAGS['c'], *FLAGS['user']) if f[1:2] in 'Om')}"
    except CompileError:
        return "none found"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")


def _commit() -> str:
    """Commit of the git checkout that contains the package; empty if there is none."""
    root = Path(__file__).resolve().parents[3]
    if not (root / ".git").exists():
        return ""
    try:
        run = subprocess.run(
            ["git", "-C", str(root), "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return ""
    return run.stdout.strip()


def rows(study: Study) -> list[dict[str, Any]]:
    """One dict of plain values per point; None where a value is not defined."""
    return [_row(point) for point in study.points]


def _row(point: Point) -> dict[str, Any]:
    trial = point.trial
    known = {} if point.errors is None else point.errors.as_dict()
    return {
        "series": point.series,
        "method": trial.method,
        "rtol": trial.rtol,
        "status": trial.status,
        "seconds": trial.seconds,
        "expected_seconds": trial.expected_seconds,
        "newton": trial.newton,
        "evaluations": trial.evaluations,
        "steps": trial.steps,
        "reached": trial.reached,
        **{name: known[name] if isfinite(known.get(name, nan)) else None for name in NAMES},
        "wrong": point.wrong,
        "message": trial.message,
    }


def as_dict(study: Study) -> dict[str, Any]:
    """The study as plain data, ready for JSON."""
    reference = study.reference
    second, floor = reference.second, reference.floor
    return {
        "scene": study.scene.name,
        "kind": study.kind,
        "end": study.scene.end,
        "reference": {"method": reference.trial.method, "rtol": reference.trial.rtol},
        "confirmed_by": None if second is None else {"method": second.method, "rtol": second.rtol},
        "floor": None if floor is None else floor.as_dict(),
        "points": rows(study),
        "notes": list(study.notes),
        "machine": machine(),
    }


def tables(study: Study) -> list[Table]:
    """The study as tables for the console."""
    notes = [("reference", reference_text(study)), *(("note", note) for note in study.notes)]
    return [_points(study), Table("reference of the errors, and notes", (), notes)]


def _points(study: Study) -> Table:
    title = f"{study.kind} of {study.scene.name or 'unnamed scene'}"
    return Table(title, HEADS, [_cells(point) for point in study.points])


def _cells(point: Point) -> tuple[str, ...]:
    trial = point.trial
    expected = f"{trial.seconds:.3g}" if trial.status != CUT_OFF else f"(about {trial.expected_seconds:.2g})"
    known = {} if point.errors is None else point.errors.as_dict()
    shown = [f"{known[name]:.1e}" if isfinite(known.get(name, nan)) else "-" for name in ERRORS]
    outcome = "WRONG SUCCESS" if point.wrong else trial.status
    return point.series, trial.setting, outcome, expected, str(trial.newton), *shown


def reference_text(study: Study) -> str:
    """The reference and its confirming run in one line."""
    first, second, floor = study.reference.trial, study.reference.second, study.reference.floor
    text = f"{first.method} at {first.rtol:g}"
    if second is None or floor is None:
        return f"{text}, not confirmed by a second run"
    return (
        f"{text}, confirmed by {second.method} at {second.rtol:g}: they differ by {floor.force_rms:.1e} RMS and "
        f"{floor.force_max:.1e} at most in force, {floor.sliding_rms:.1e} and {floor.sliding_max:.1e} in sliding"
    )


def markdown(study: Study) -> str:
    """The table, the reference and the notes as Markdown."""
    notes = "".join(f"\n{note}.\n" for note in study.notes)
    return f"{_points(study).markdown}\nReference: {reference_text(study)}.\n{notes}"


def figure_table(study: Study) -> dict[str, dict[str, list[float]]]:
    """The table that `plot_work_precision` draws: series -> column -> values; without series that could not run."""
    out: dict[str, dict[str, list[float]]] = {}
    for series in study.series:
        points = [p for p in study.of(series) if p.trial.status != REFUSED]
        if points:
            out[series] = _columns(points)
    return out


def _columns(points: list[Point]) -> dict[str, list[float]]:
    columns: dict[str, list[float]] = {"seconds": [p.trial.expected_seconds for p in points]}
    share = [max(p.trial.reached / p.trial.end, 1e-9) if p.trial.status == CUT_OFF else 1.0 for p in points]
    if any(p.trial.newton for p in points):
        columns["newton"] = [p.trial.newton / part for p, part in zip(points, share, strict=True)]
    for name in ERRORS:
        columns[name] = [float("nan") if p.errors is None else getattr(p.errors, name) for p in points]
    columns["cut"] = [float(p.trial.status == CUT_OFF) for p in points]
    columns["failed"] = [float(not p.trial.finished and p.trial.status != CUT_OFF) for p in points]
    columns["wrong"] = [float(p.wrong) for p in points]
    return columns


def draw(study: Study, path: str | Path) -> None:
    """Draw the study to `path`: .png, .svg or .pdf."""
    from msfp_gen.figures import plot_work_precision

    floor, second = study.reference.floor, study.reference.second
    floors = {} if floor is None or second is None else {f"references differ ({second.method})": floor.as_dict()}
    title = f"{study.kind.capitalize()}: {study.scene.name or 'unnamed scene'}"
    plot_work_precision(figure_table(study), path, errors=ERRORS, floors=floors, title=title)


def write(study: Study, folder: Path) -> list[Path]:
    """Write CSV, JSON, Markdown and the figure as SVG and PNG to `folder`; returns the paths.

    Raises InputError if the folder cannot be made or written to.
    """
    make_folder(folder, "--output")
    base = folder / study.kind
    written = [write_csv(study, base.with_suffix(".csv"))]
    for suffix, text in ((".json", json.dumps(as_dict(study), indent=2, allow_nan=False)), (".md", markdown(study))):
        write_bytes(base.with_suffix(suffix), [text.encode()])
        written.append(base.with_suffix(suffix))
    for suffix in (".svg", ".png"):
        draw(study, base.with_suffix(suffix))
        written.append(base.with_suffix(suffix))
    return written


def write_csv(study: Study, path: Path) -> Path:
    """Write the rows as CSV; the file appears only when complete."""
    return write_rows(path, rows(study))
