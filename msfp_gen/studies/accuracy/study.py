"""Error against cost on one scene, of methods at several tolerances and of simplified models.

A scene comes in; all errors are measured against one confirmed reference; tables, CSV, JSON, Markdown and a figure go
out, with the machine on which the times were measured.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import isfinite, nan
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from msfp_gen.common.aliases import Say
from msfp_gen.common.errors import CompileError, InputError
from msfp_gen.common.output import make_folder, write_bytes
from msfp_gen.common.tables import Table, write_rows
from msfp_gen.common.version import __version__
from msfp_gen.scene.system import System
from msfp_gen.simulation.simulate import simulate
from msfp_gen.studies.accuracy.methods import METHODS, VARIANTS, Method, methods_named
from msfp_gen.studies.accuracy.timed_run import (
    CUT_OFF,
    REFUSED,
    Errors,
    Reference,
    Trial,
    best_reference,
    errors,
)

TOLERANCES = tuple(10.0**-k for k in range(2, 10))
MODEL_TOLERANCES = TOLERANCES[:6]
STEPS = (250, 1000, 4000)  # numbers of steps of models without error control
CONFIRMING = ("Radau", (1e-4, 1e-5))  # method and tolerances that confirm the reference: the most robust of SciPy
LIMIT = 10.0  # wall time of a run [s]
CONFIRMING_LIMIT = 6.0  # time limit of a rerun that may confirm the reference, over the limit of other runs
CONFIRMING_RUNS = 2  # number of such reruns, at most
TIGHTEST = 1e-11  # least tolerance of a reference run
WRONG = 30.0  # RMS error over tolerance above which a success is wrong
NEVER_WRONG, ALWAYS_WRONG = 1e-3, 0.1  # RMS error below which a success is never wrong, above which it always is
FAMILIES = {name: method.family for name, method in METHODS.items()}
KINDS = {"max": "maximum", "rms": "RMS"}  # of errors in tables and figures


@dataclass(frozen=True, eq=False)
class Point:
    """One run of a study.

    Attributes:
        series: name of the method or model.
        trial: the run.
        errors: against the reference; None for the reference itself and for a run that did not finish.
        wrong: whether the run reported success with a wrong result (`is_wrong`).
    """

    series: str
    trial: Trial
    errors: Errors | None
    wrong: bool

    @property
    def known_errors(self) -> dict[str, float | None]:
        """Name of an error, as in `Errors.as_dict` -> error [-]; None where it is not defined."""
        known = {} if self.errors is None else self.errors.as_dict()
        return {name: value if isfinite(value) else None for name, value in known.items()}


@dataclass(frozen=True, eq=False)
class ErrorStudy:
    """A study of one scene.

    Attributes:
        scene: as it was run.
        kind: "work-precision" or "model-error".
        points: the runs.
        reference: the run that errors are measured against.
        notes: on settings that were not run, and on the reference, as text.
    """

    scene: System
    kind: str
    points: tuple[Point, ...]
    reference: Reference
    notes: tuple[str, ...]

    def of(self, series: str) -> list[Point]:
        """The points of one series, loosest tolerance first."""
        return [point for point in self.points if point.series == series]

    @property
    def shown(self) -> dict[str, str]:
        """The errors of tables and figures: name -> words. Of more than two quantities the RMS errors alone."""
        quantities = list(self.reference.trial.histories)
        kinds = KINDS if len(quantities) <= 2 else {"rms": KINDS["rms"]}
        return {f"{name}_{kind}": f"{_words(name)}, {text}" for name in quantities for kind, text in kinds.items()}

    @property
    def series(self) -> list[str]:
        """Names of all series, in the order of the points."""
        return list(dict.fromkeys(point.series for point in self.points))


def work_precision(
    scene: System,
    *,
    methods: Sequence[str] | None = None,
    tolerances: Sequence[float] = TOLERANCES,
    limit: float = LIMIT,
    say: Say = lambda line: None,
) -> ErrorStudy:
    """Run `scene` by every method at every tolerance and measure the error of each run.

    Args:
        scene: of a bearing, a building, or any other system.
        methods: names in `METHODS`; None: all.
        tolerances: relative tolerances [-].
        limit: wall time of one run [s]. A longer run is cut off; after two runs of a method in a row that were cut off,
            its tighter tolerances are not tried.
        say: called with one line of text after each run.

    Raises:
        InputError: an invalid tolerance, limit or method, or a bearing that does not move.
        RunError: no run finished.
    """
    compared = methods_named(None if methods is None else list(methods))
    check_settings(tolerances, limit)
    scene, trials, notes = without_stop(scene), [], []
    for method in compared:
        runs, own_notes = run_tolerances(method, scene, sorted(tolerances, reverse=True), limit, say)
        trials += runs
        notes += own_notes
    trials = with_reruns(trials, confirming_reruns(scene, trials, limit, say))
    reference = best_reference([*trials, *tighter_runs(scene, trials, limit, say)], FAMILIES)
    points = tuple(point_of(trial.method, trial, reference) for trial in trials)
    return ErrorStudy(scene, "work-precision", points, reference, (*notes, *reference_notes(reference)))


def model_errors(
    scene: System,
    *,
    tolerances: Sequence[float] = MODEL_TOLERANCES,
    limit: float = LIMIT,
    say: Say = lambda line: None,
) -> ErrorStudy:
    """Error against cost of the given scene and of simplified models, against a reference run of the given scene.

    The error of a simplified model falls with its tolerance down to the error of the simplification. Arguments and
    errors: see `work_precision`.
    """
    check_settings(tolerances, limit)
    scene = without_stop(scene)
    full, _ = run_tolerances(METHODS["implicit"], scene, sorted(tolerances, reverse=True), limit, say)
    name, confirming = CONFIRMING
    others, _ = run_tolerances(METHODS[name], scene, confirming, limit, say)
    extra = [*others, *tighter_runs(scene, full, limit, say), *confirming_reruns(scene, others, limit, say)]
    reference = best_reference([*full, *extra], FAMILIES)
    points, notes = [point_of("as it stands", trial, reference) for trial in full], reference_notes(reference)
    for variant in VARIANTS:
        trials, own_notes = _variant_trials(variant, scene, tolerances, limit, say)
        # The error of a simplified model may exceed its tolerance, which is no wrong success.
        points += [replace(point_of(variant.name, trial, reference), wrong=False) for trial in trials]
        notes += own_notes
    return ErrorStudy(scene, "model-error", tuple(points), reference, tuple(notes))


def _variant_trials(
    variant: Method, scene: System, tolerances: Sequence[float], limit: float, say: Say
) -> tuple[list[Trial], list[str]]:
    """The runs of one simplified model, and notes on settings that were not run."""
    trials: list[Trial] = []
    for setting in _step_counts(scene) if variant.stepped else sorted(tolerances, reverse=True):
        trial = variant.attempt(scene, setting, limit)
        if trial.status == REFUSED:
            return [], [f"{variant.name}: left out; {trial.message}"]
        trials.append(trial)
        say(trial_line(trial))
        if trial.status == CUT_OFF:
            return trials, [f"{variant.name}: cut off, so tighter than {setting:g} was not tried"]
    return trials, []


def _step_counts(scene: System) -> list[int]:
    """Numbers of steps: STEPS; for a long record one, two and four steps in each of its sampling intervals."""
    least = 1 if scene.motion.max_step is None else int(np.ceil(scene.end / scene.motion.max_step))
    return [least, 2 * least, 4 * least] if least > STEPS[1] else list(STEPS)


def check_settings(tolerances: Sequence[float], limit: float) -> None:
    """Raise InputError for a tolerance or a limit out of range."""
    for rtol in tolerances:
        if not 1e-12 <= rtol < 1:
            raise InputError(f"tolerances = {rtol:g}: give numbers from 1e-12 to below 1, such as 1e-2,1e-4")
    if not tolerances:
        raise InputError("tolerances: none given; give some such as 1e-2,1e-4")
    if not 0 < limit < float("inf"):
        raise InputError(f"limit = {limit:g}: give seconds above zero")


def without_stop(system: Any) -> Any:
    """The system with effects that no run changes, and with its duration in place of a stop, which SciPy lacks."""
    scene = system.with_compared_effects()
    return scene if scene.stop is None else replace(scene, stop=None, duration=float(simulate(scene).time[-1]))


def run_tolerances(
    method: Method, scene: System, tolerances: Sequence[float], limit: float, say: Say
) -> tuple[list[Trial], list[str]]:
    """Run one method at `tolerances`, loosest first; returns the runs, and notes on tolerances that were not run."""
    trials: list[Trial] = []
    for count, rtol in enumerate(tolerances):
        trial = method.attempt(scene, rtol, limit)
        trials.append(trial)
        say(trial_line(trial))
        if trial.status == REFUSED:
            return [], [f"{method.name} cannot run this scene: {trial.message}"]
        if len(trials) > 1 and all(t.status == CUT_OFF for t in trials[-2:]) and count + 1 < len(tolerances):
            return trials, [f"{method.name}: cut off twice, so tighter than {rtol:g} was not tried"]
    return trials, []


def trial_line(trial: Trial) -> str:
    """One line of text about a run: method, setting, outcome and time."""
    outcome = trial.status if trial.finished else f"{trial.status} at t = {trial.reached:.4g} of {trial.end:.4g} s"
    return f"{trial.method} at {trial.setting}: {outcome}, {trial.seconds:.3g} s"


def tighter_runs(scene: System, trials: Sequence[Trial], limit: float, say: Say) -> list[Trial]:
    """Runs for a reference: the default method below its tightest finished tolerance, until a run does not finish."""
    finished = [trial.rtol for trial in trials if trial.method == "implicit" and trial.finished]
    rtol, tighter = min(finished, default=1e-2) / 10, []
    while rtol > TIGHTEST:
        trial = METHODS["implicit"].attempt(scene, rtol, limit)
        say(f"reference: {trial_line(trial)}")
        if not trial.finished:
            break
        tighter.append(trial)
        rtol /= 10
    return tighter


def confirming_reruns(scene: System, trials: Sequence[Trial], limit: float, say: Say) -> list[Trial]:
    """Repeat runs that were cut off with a longer limit, as candidates for the reference.

    Of each method the tightest run that can finish within the longer limit counts; the CONFIRMING_RUNS fastest of these
    runs are repeated.
    """
    longer = CONFIRMING_LIMIT * limit
    possible = [trial for trial in trials if trial.status == CUT_OFF and 1.3 * trial.expected_seconds < longer]
    tightest = {trial.method: trial for trial in sorted(possible, key=lambda trial: -trial.rtol)}
    reruns = []
    for trial in sorted(tightest.values(), key=lambda t: t.expected_seconds)[:CONFIRMING_RUNS]:
        reruns.append(METHODS[trial.method].attempt(scene, trial.rtol, longer))
        say(f"reference: {trial_line(reruns[-1])}")
    return reruns


def with_reruns(trials: Sequence[Trial], reruns: Sequence[Trial]) -> list[Trial]:
    """`trials`, with a repeated run in place of the run that was cut off."""
    repeated = {(trial.method, trial.rtol): trial for trial in reruns}
    return [repeated.get((trial.method, trial.rtol), trial) for trial in trials]


def point_of(series: str, trial: Trial, reference: Reference) -> Point:
    """A run as a point of a series; the reference and a run that did not finish have no errors."""
    differences = errors(trial, reference.trial) if trial.finished and trial is not reference.trial else None
    return Point(series, trial, differences, differences is not None and is_wrong(trial, differences, reference))


def is_wrong(trial: Trial, differences: Errors, reference: Reference) -> bool:
    """Whether a run reported success with an RMS error far above its tolerance and above the floor of the reference."""
    if reference.floor is None:
        return False
    floor = 3 * reference.floor.worst_rms
    return trial.finished and differences.worst_rms > max(min(WRONG * trial.rtol, ALWAYS_WRONG), NEVER_WRONG, floor)


def reference_notes(reference: Reference) -> list[str]:
    """Notes on how well the reference is confirmed."""
    if reference.second is None or reference.floor is None:
        return ["only one run reached the end: nothing confirms the reference"]
    if not reference.independent:
        return ["only one family of methods reached the end: the reference is confirmed by its own family alone"]
    if reference.floor.worst_rms > 1e-2:
        return [f"the two references differ by {reference.floor.worst_rms:.1%} RMS: errors below that are not known"]
    return []


COLUMNS = ("method", "rtol", "status", "seconds", "expected_seconds", "newton", "evaluations", "steps", "reached")
HEADS = ("", "tolerance", "outcome", "seconds", "Newton iterations")


def machine() -> dict[str, str]:
    """Name -> text of processor, cores, system, compiler, versions, and commit of a checkout, as far as known."""
    from msfp_gen.jit.compiler import FLAGS, find_compiler

    try:
        flags = " ".join(flag for flag in (*FLAGS["c"], *FLAGS["user"]) if flag[1:2] in "Om")
        compiler = f"{find_compiler().version}, {flags}"
    except CompileError:
        compiler = "none found"
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        processor = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")
    except OSError:
        processor = platform.processor()
    root, commit = Path(__file__).resolve().parents[3], ""
    if (root / ".git").exists():  # a checkout that contains the package
        command = ["git", "-C", str(root), "rev-parse", "--short", "HEAD"]
        with suppress(OSError, subprocess.CalledProcessError):
            commit = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    about = {
        "processor": processor,
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.machine()}",
        "compiler": compiler,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "msfp_gen": __version__,
        "commit": commit,
    }
    return {name: value for name, value in about.items() if value}


def rows(study: ErrorStudy) -> list[dict[str, Any]]:
    """One dict of plain values for each point; None where a value is undefined."""
    return [
        {
            "series": point.series,
            **{name: getattr(point.trial, name) for name in COLUMNS},
            **point.known_errors,
            "wrong": point.wrong,
            "message": point.trial.message,
        }
        for point in study.points
    ]


def as_dict(study: ErrorStudy) -> dict[str, Any]:
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


def tables(study: ErrorStudy) -> list[Table]:
    """The study as tables for the console."""
    notes = [("reference", reference_text(study)), *(("note", note) for note in study.notes)]
    return [_points(study), Table("reference of the errors, and notes", (), notes)]


def _points(study: ErrorStudy) -> Table:
    cells = []
    for point in study.points:
        trial, known = point.trial, point.known_errors
        expected = f"{trial.seconds:.3g}" if trial.status != CUT_OFF else f"(about {trial.expected_seconds:.2g})"
        errors_shown = ["-" if (error := known.get(name)) is None else f"{error:.1e}" for name in study.shown]
        outcome = "WRONG SUCCESS" if point.wrong else trial.status
        cells.append((point.series, trial.setting, outcome, expected, str(trial.newton), *errors_shown))
    return Table(f"{study.kind} of {study.scene.name or 'unnamed scene'}", (*HEADS, *study.shown.values()), cells)


def reference_text(study: ErrorStudy) -> str:
    """The reference and its confirming run in one line."""
    first, second, floor = study.reference.trial, study.reference.second, study.reference.floor
    text = f"{first.method} at {first.rtol:g}"
    if second is None or floor is None:
        return f"{text}, not confirmed by a second run"
    parts = [f"{one.rms:.1e} RMS and {one.max:.1e} at most in {_words(name)}" for name, one in floor.parts.items()]
    return f"{text}, confirmed by {second.method} at {second.rtol:g}: they differ by {', '.join(parts)}"


def markdown(study: ErrorStudy) -> str:
    """The table, the reference and the notes as Markdown."""
    notes = "".join(f"\n{note}.\n" for note in study.notes)
    return f"{_points(study).markdown}\nReference: {reference_text(study)}.\n{notes}"


def figure_table(study: ErrorStudy) -> dict[str, dict[str, list[float]]]:
    """Series -> column -> values, as `plot_work_precision` draws them; without series that could not run."""
    table: dict[str, dict[str, list[float]]] = {}
    for series in study.series:
        points = [p for p in study.of(series) if p.trial.status != REFUSED]
        if not points:
            continue
        columns = {"seconds": [p.trial.expected_seconds for p in points]}
        shares = [max(p.trial.reached / p.trial.end, 1e-9) if p.trial.status == CUT_OFF else 1.0 for p in points]
        if any(p.trial.newton for p in points):
            columns["newton"] = [p.trial.newton / share for p, share in zip(points, shares, strict=True)]
        known = [{} if p.errors is None else p.errors.as_dict() for p in points]
        for name in study.shown:
            columns[name] = [errors.get(name, nan) for errors in known]
        columns["cut"] = [float(p.trial.status == CUT_OFF) for p in points]
        columns["failed"] = [float(not p.trial.finished and p.trial.status != CUT_OFF) for p in points]
        columns["wrong"] = [float(p.wrong) for p in points]
        table[series] = columns
    return table


def draw(study: ErrorStudy, path: str | Path) -> None:
    """Draw the study to `path`: .png, .svg or .pdf."""
    from msfp_gen.figures import plot_work_precision

    floor, second = study.reference.floor, study.reference.second
    floors = {} if floor is None or second is None else {f"references differ ({second.method})": floor.as_dict()}
    title = f"{study.kind.capitalize()}: {study.scene.name or 'unnamed scene'}"
    plot_work_precision(figure_table(study), path, errors=study.shown, floors=floors, title=title)


def default_point(study: ErrorStudy) -> Point | None:
    """The run of the scene's own method and tolerance; None where it is not in the study, or did not finish."""
    solver = study.scene.solver
    own = "as it stands" if study.kind == "model-error" else solver.method
    points = [one for one in study.of(own) if one.trial.rtol == solver.rtol and one.errors is not None]
    return points[0] if points else None


def summary_line(study: ErrorStudy) -> str:
    """What the scene's own tolerance gives and takes, in one sentence."""
    point, name = default_point(study), study.scene.name or "the scene"
    if point is None or point.errors is None:
        return f"{study.kind.capitalize()} of {name}"
    error, time = _share(point.errors.worst_rms), _time(point.trial.seconds)
    return f"{name}: {error} in {time} at its tolerance {point.trial.rtol:g}"


def cost_table(study: ErrorStudy) -> Table:
    """Error against seconds of every run that ended, in four columns; the title says to what the errors are known."""
    floor = study.reference.floor
    known = "errors are not confirmed" if floor is None else f"errors are known to {_share(floor.worst_rms)}"
    cells = [
        (one.series, one.trial.setting, _share(one.errors.worst_rms), _time(one.trial.seconds))
        for one in study.points
        if one.errors is not None
    ]
    return Table(
        f"what accuracy costs: {summary_line(study)}; {known}",
        ("", "tolerance", f"error of {_quantities(study)}, RMS", "time"),
        cells,
    )


def draw_summary(study: ErrorStudy, path: str | Path) -> None:
    """Draw error against seconds in one panel, with the scene's own tolerance marked: .png, .svg or .pdf."""
    from msfp_gen.figures import plot_work_precision

    table = {}
    for series, columns in figure_table(study).items():
        worst = [nan if one.errors is None else one.errors.worst_rms for one in study.of(series)]
        table[series] = {name: columns[name] for name in ("seconds", "failed", "cut", "wrong")} | {"error": worst}
    point = default_point(study)
    marks = {} if point is None or point.errors is None else {
        f"tolerance {point.trial.rtol:g}": {"seconds": point.trial.seconds, "error": point.errors.worst_rms}
    }  # fmt: skip
    plot_work_precision(
        table,
        path,
        errors={"error": fill(f"error of {_quantities(study)}, RMS", 48)},
        marks=marks,
        title=summary_line(study),
    )


def _words(quantity: str) -> str:
    return quantity.replace("_", " ")


def _quantities(study: ErrorStudy) -> str:
    *first, last = map(_words, study.reference.trial.histories)
    return f"{', '.join(first)} and {last}" if first else last


def _share(error: float) -> str:
    return f"{100 * error:.2g} %"


def _time(seconds: float) -> str:
    return f"{seconds:.2f} s" if seconds >= 0.1 else f"{1e3 * seconds:.2g} ms"


def write(study: ErrorStudy, folder: Path) -> list[Path]:
    """Write CSV, JSON, Markdown and the figures as SVG and PNG to `folder`; returns the paths.

    The summary has one panel, error against seconds; the other figure has one for each kind of error and of cost.

    Raises InputError if the folder cannot be made or written to.
    """
    make_folder(folder, "--output")
    paths = {suffix: folder / f"{study.kind}.{suffix}" for suffix in ("csv", "json", "md", "svg", "png")}
    write_rows(paths["csv"], rows(study))
    write_bytes(paths["json"], [json.dumps(as_dict(study), indent=2, allow_nan=False).encode()])
    write_bytes(paths["md"], [markdown(study).encode()])
    summary = folder / f"{study.kind}-summary.png"
    draw_summary(study, summary)
    draw(study, paths["svg"])
    draw(study, paths["png"])
    return [summary, *paths.values()]
