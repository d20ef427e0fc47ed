"""Work and precision with and without contact damping, side by side: a table and a figure of docs/accuracy.md.

Both implicit methods run every scene of that page as given and with a contact damping of 0.1 ms, the default of a
surface: `python benchmarks/damped.py [FOLDER]`. FOLDER: where figures/accuracy-damping.png is written; default: docs.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from accuracy import CASES, TOLERANCES, Case, markdown_table, percent, say, seconds
from drawing import COLOURS, FAINT, drawn

from msfp_gen import Scene
from msfp_gen.studies.accuracy import work_precision
from msfp_gen.studies.accuracy.study import Point, Study

DAMPING = 1e-4  # [s]
METHODS = {"implicit": "o", "esdirk4": "s"}
LIMIT = 4.0  # over that of the scene, so that references are tight
DEFAULT, TARGET = 1e-3, 1e-3  # tolerance of a run without settings; largest RMS error of the last columns


def studied(case: Case, damping: float) -> Study:
    """Both methods on a scene with this contact damping [s]."""
    scene: Scene = replace(case.loaded, bearing=case.loaded.bearing.replace(contact_damping=damping))
    study = work_precision(scene, methods=list(METHODS), tolerances=TOLERANCES, limit=LIMIT * case.limit)
    say(f"{case.scene}, T = {damping:g} s")
    return study


def row(case: Case, damping: float, study: Study) -> tuple[str, ...]:
    """The line of a study: how well the reference is known, the default tolerance, and the cheapest run in the target."""
    floor = study.reference.floor if study.reference.independent else None
    default = next(point for point in study.of("implicit") if point.trial.rtol == DEFAULT)
    within = [point for point in study.of("implicit") if _error(point) <= TARGET]
    fastest = min(within, key=lambda point: point.trial.seconds, default=None)
    cost = "-" if fastest is None else f"{seconds(fastest.trial.seconds)} at {fastest.trial.rtol:g}"
    return (
        case.scene,
        f"{1e3 * damping:g}",
        "not confirmed" if floor is None else percent(floor.worst_rms),
        "-" if floor is None else percent(floor.force_max),
        f"{percent(_error(default))}, {seconds(default.trial.seconds)}",
        cost,
    )


def _error(point: Point) -> float:
    return float("inf") if point.errors is None else point.errors.worst_rms


def draw(pairs: list[tuple[Case, Study, Study]], path: Path) -> None:
    """Error over time of both methods, without damping in grey and with it in colour; a panel for each scene."""
    columns = (len(pairs) + 1) // 2
    with drawn(path, 13.0, 6.5) as figure:
        panels = figure.subplots(2, columns, sharey=True, squeeze=False)
        for panel, (case, undamped, damped) in zip(panels.flat, pairs, strict=False):
            for study, name, shade in ((undamped, "undamped", FAINT), (damped, "T = 0.1 ms", None)):
                for colour, (method, marker) in zip(COLOURS, METHODS.items(), strict=False):
                    points = [p for p in study.of(method) if p.errors is not None]
                    x, y = zip(*((1e3 * p.trial.seconds, 100 * _error(p)) for p in points), strict=True)
                    panel.loglog(x, y, f"{marker}-", color=shade or colour, label=f"{method}, {name}", markersize=4)
            panel.set_title(case.scene)
            panel.set_xlabel("time of a run [ms]")
        for panel in panels[:, 0]:
            panel.set_ylabel("larger RMS error [%]")
        panels.flat[0].legend(fontsize="small")


def main(words: list[str]) -> None:
    """Print the table and draw the figure."""
    folder = Path(words[0]) if words else Path(__file__).resolve().parent.parent / "docs"
    pairs = [(case, studied(case, 0.0), studied(case, DAMPING)) for case in CASES]
    lines = [row(case, d, s) for case, *both in pairs for d, s in zip((0.0, DAMPING), both, strict=True)]
    head = ("scene", "T [ms]", "reference known to", "worst instant", "error and time at 1e-3", "within 0.1 %")
    print(markdown_table(head, lines))
    draw(pairs, folder / "figures" / "accuracy-damping.png")


if __name__ == "__main__":
    main(sys.argv[1:])
