"""Work and precision with and without contact damping, side by side: a table and a figure of docs/accuracy.md.

Both implicit methods run every scene of that page as given and with a contact damping of 0.1 ms, the default of a
surface, and SciPy's Radau, which shares no formula with them, confirms the references. The cost is in Newton iterations,
which do not depend on the machine: `python benchmarks/damped.py [FOLDER]`. FOLDER: where figures/accuracy-damping.png is
written; default: docs.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from accuracy import CASES, TOLERANCES, Case, percent, say
from drawing import COLOURS, FAINT, drawn
from quick import docs_folder, parser, pick

from msfp_gen import Scene
from msfp_gen.common.tables import markdown_table
from msfp_gen.studies.accuracy import work_precision
from msfp_gen.studies.accuracy.methods import METHODS
from msfp_gen.studies.accuracy.study import ErrorStudy, Point
from msfp_gen.studies.accuracy.timed_run import errors

DAMPING = 1e-4  # [s]
MARKERS = {"implicit": "o", "esdirk4": "s"}
LIMIT = 4.0  # over that of the scene, so that references are tight
CONFIRMING, PATIENCE = 1e-5, pick(300.0, 5.0)  # tolerance of Radau, and wall time after which it is cut off [s]
DEFAULT, TARGET = 1e-3, 1e-3  # tolerance of a run without settings; largest RMS error of the last columns


def studied(case: Case, damping: float) -> ErrorStudy:
    """Both methods on a scene with this contact damping [s]."""
    scene: Scene = replace(case.loaded, bearing=case.loaded.bearing.replace(contact_damping=damping))
    study = work_precision(scene, methods=list(MARKERS), tolerances=TOLERANCES, limit=LIMIT * case.limit)
    say(f"{case.scene}, T = {damping:g} s")
    return study


def confirmed(study: ErrorStudy) -> str:
    """RMS difference of Radau from the reference; "cut off" where it takes too long."""
    trial = METHODS["Radau"].attempt(study.scene, CONFIRMING, PATIENCE)
    found = errors(trial, study.reference.trial) if trial.finished else None
    return percent(found.worst_rms) if found is not None else f"cut off at {100 * trial.reached / trial.end:.0f} %"


def row(case: Case, damping: float, study: ErrorStudy) -> tuple[str, ...]:
    """The line of a study: how well the reference is known, the default tolerance, and the cheapest run in the target."""
    floor = study.reference.floor
    assert floor is not None
    default = next(point for point in study.of("implicit") if point.trial.rtol == DEFAULT)
    within = [point for point in study.of("implicit") if _error(point) <= TARGET]
    fastest = min(within, key=lambda point: point.trial.newton, default=None)
    cost = "-" if fastest is None else f"{fastest.trial.newton} at {fastest.trial.rtol:g}"
    return (
        case.scene,
        f"{1e3 * damping:g}",
        percent(floor.worst_rms),
        confirmed(study),
        f"{percent(_error(default))}, {default.trial.newton}",
        cost,
    )


def _error(point: Point) -> float:
    return float("inf") if point.errors is None else point.errors.worst_rms


def draw(pairs: list[tuple[Case, ErrorStudy, ErrorStudy]], path: Path) -> None:
    """Error over cost of both methods, without damping in grey and with it in colour; a panel for each scene."""
    columns = (len(pairs) + 1) // 2
    with drawn(path, 13.0, 6.5) as figure:
        panels = figure.subplots(2, columns, sharey=True, squeeze=False)
        for panel, (case, undamped, damped) in zip(panels.flat, pairs, strict=False):
            for study, name, shade in ((undamped, "undamped", FAINT), (damped, "T = 0.1 ms", None)):
                for colour, (method, marker) in zip(COLOURS, MARKERS.items(), strict=False):
                    points = [p for p in study.of(method) if p.errors is not None]
                    x, y = zip(*((p.trial.newton, 100 * _error(p)) for p in points), strict=True)
                    panel.loglog(x, y, f"{marker}-", color=shade or colour, label=f"{method}, {name}", markersize=4)
            panel.set_title(case.scene)
            panel.set_xlabel("Newton iterations of a run")
        for panel in panels[:, 0]:
            panel.set_ylabel("larger RMS error [%]")
        panels.flat[0].legend(fontsize="small")


def main(words: list[str]) -> None:
    """Print the table and draw the figure."""
    options = parser(__doc__)
    options.add_argument("folder", nargs="?", type=Path, default=docs_folder())
    folder = options.parse_args(words).folder
    pairs = [(case, studied(case, 0.0), studied(case, DAMPING)) for case in CASES]
    lines = [row(case, d, s) for case, *both in pairs for d, s in zip((0.0, DAMPING), both, strict=True)]
    head = (
        "scene",
        "T [ms]",
        "implicit and esdirk4",
        "Radau",
        "error and iterations at 1e-3",
        "iterations within 0.1 %",
    )
    print(markdown_table(head, lines))
    draw(pairs, folder / "figures" / "accuracy-damping.png")


if __name__ == "__main__":
    main(sys.argv[1:])
