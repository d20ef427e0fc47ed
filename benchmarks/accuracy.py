"""Measure every figure, table and number of docs/accuracy.md: `python benchmarks/accuracy.py [DIR]`.

It takes about six minutes on two idle cores. With openseespy installed, the OpenSees element is included. DIR is the
folder to write to; default: the docs of this checkout. `--only NAME,...` measures these scenes only and does not write
the page. `--share 0.2` multiplies every time limit and the duration of the slowest run, for a quick check.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, replace
from datetime import date
from os import getloadavg
from pathlib import Path

from plain import plain_scene
from quick import docs_folder, labelled, parser, pick

from msfp_gen import RunError, Scene
from msfp_gen.common.output import replacing
from msfp_gen.common.tables import markdown_table, write_rows
from msfp_gen.studies.accuracy import model_errors, simulate_within, work_precision
from msfp_gen.studies.accuracy.study import ErrorStudy, Point, draw, machine, reference_text, without_stop
from msfp_gen.studies.accuracy.study import rows as rows_of
from msfp_gen.studies.accuracy.timed_run import errors, run_native

HERE = Path(__file__).resolve().parent
TARGETS_OF_TABLES = (1e-3, 3e-3, 1e-2, 3e-2, 1e-1)  # bounds of the larger RMS error
KNOWN = 10.0  # the first bound that is at least so many times the floor is used
TOLERANCES = tuple(10.0**-k for k in range(2, 9))
MODEL_TOLERANCES = tuple(10.0**-k for k in range(2, 6))


@dataclass(frozen=True)
class Case:
    """A scene of the page.

    Attributes:
        title: heading.
        scene: name of the preset.
        duration: simulated time [s]; None: that of the scene.
        limit: wall time of one run [s].
        models: whether simplified models are compared too.
    """

    title: str
    scene: str
    duration: float | None = None
    limit: float = 1.2
    models: bool = False

    @property
    def loaded(self) -> Scene:
        scene = without_stop(plain_scene(self.scene))
        return scene if self.duration is None else replace(scene, duration=self.duration)


ALL_CASES = (
    Case("Test 1: 1.2 mm, sliding regime I", "fenz-test1"),
    Case("Test 2: 25 mm, sliding regime II", "fenz-test2", models=True),
    Case("Test 3: 75 mm, sliding regime III", "fenz-test3"),
    Case("Test 4: 115 mm, sliding regime IV", "fenz-test4"),
    Case("Test 5: 140 mm, sliding regime V, rims", "fenz-test5", limit=2.0, models=True),
    Case("A circle of 50 mm", "becker-circle-50", models=True),
    Case(
        "A real record: 14 s of Ridgecrest 2019, three components, a supported mass", "ridgecrest-clc", 14.0, 3.0, True
    ),
    Case("A rim impact: the push of figure 4.1 at up to 0.17 m/s", "fenz-monotonic", limit=3.0, models=True),
)
CASES = pick(ALL_CASES, ALL_CASES[1:2])
PEER_METHOD = Case("The method of PEER 2017/07", "fenz-test2", 4.0, 15.0)
PEER_METHOD_TOLERANCES = (0.3, 0.1, 0.03, 1e-2, 1e-3, 1e-4)
# Scene, duration [s], tolerance at which the ringing is resolved.
RINGING = pick(
    (("fenz-test5", None, 1e-7), ("ridgecrest-clc", 14.0, 1e-7), ("fenz-monotonic", None, 1e-9)),
    (("fenz-test2", None, 1e-5),),
)
ESTIMATED = pick(
    ("fenz-test2", "fenz-test5", "becker-circle-50", "unusual-tfp", "double-push", "fenz-monotonic"), ("fenz-test2",)
)
TARGETS = pick((0.02, 0.005, 0.001), (0.02,))


def say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def seconds(value: float) -> str:
    return f"{1e3 * value:.2g} ms" if value < 0.1 else f"{value:.2g} s" if value < 100 else f"{value:.0f} s"


def percent(value: float) -> str:
    return f"{100 * value:.2g} %"


def target(study: ErrorStudy) -> float:
    """The RMS error at which the methods of a scene are compared: which the reference is known to a tenth of."""
    floor = study.reference.floor
    return next((t for t in TARGETS_OF_TABLES if floor is None or KNOWN * floor.worst_rms < t), TARGETS_OF_TABLES[-1])


def times(ratio: float) -> str:
    return f"{ratio:.2g}" if ratio < 100 else f"{ratio:.0f}"


def cheapest(study: ErrorStudy, series: str) -> Point | None:
    """The fastest run of a method whose RMS errors are at most the target of its scene; None if there is none."""
    within = [p for p in study.of(series) if p.errors is not None and p.errors.worst_rms <= target(study)]
    return min(within, key=lambda p: p.trial.seconds, default=None)


def method_table(study: ErrorStudy) -> str:
    """For every method the cost of meeting the target, or why it does not meet it."""
    base = cheapest(study, "implicit")
    rows = []
    for series in study.series:
        point = cheapest(study, series)
        if point is not None and base is not None:
            ratio = point.trial.seconds / base.trial.seconds
            rows.append(
                (
                    f"`{series}`",
                    f"{point.trial.rtol:g}",
                    seconds(point.trial.seconds),
                    times(ratio),
                    str(point.trial.newton),
                )
            )
        else:
            rows.append((f"`{series}`", "-", why_not(study.of(series)), "-", "-"))
    return markdown_table(("method", "tolerance", "time", "over the default", "Newton iterations"), rows)


def why_not(points: list[Point]) -> str:
    """Why a method meets the target at no tolerance."""
    wrong = [f"{p.trial.rtol:g}" for p in points if p.wrong]
    if wrong:
        return f"success reported and wrong at {', '.join(wrong)}"
    cut = [p.trial.expected_seconds for p in points if p.trial.status == "cut off"]
    if cut:
        return f"cut off; the whole would take about {seconds(min(cut))}"
    best = min((p.errors.worst_rms for p in points if p.errors is not None), default=None)
    return "failed" if best is None else f"no better than {percent(best)}"


def model_table(study: ErrorStudy) -> str:
    """For every model its error at the tightest tolerance, and its cost at 1e-4 over that of the full model."""
    at = {p.series: p for p in study.points if p.trial.rtol == 1e-4}
    rows = []
    for series in study.series:
        finished = [p for p in study.of(series) if p.errors is not None]
        if not finished:
            rows.append((series, "-", "-", "-", study.of(series)[-1].trial.message))
            continue
        last = finished[-1].errors
        assert last is not None
        sliding = "-" if last["sliding"].rms != last["sliding"].rms else percent(last["sliding"].rms)
        cost = at.get(series, finished[0]).trial.seconds / at["as it stands"].trial.seconds
        rows.append((series, percent(last["force"].rms), percent(last["force"].peak), sliding, f"{cost:.2g}"))
    return markdown_table(("model", "force RMS", "peak force", "sliding RMS", "time over the full one"), rows)


def measured(case: Case, folder: Path, kind: str) -> tuple[str, ErrorStudy]:
    """Run one study and write its figure and its data; the section of the page, and the study."""
    begin = time.perf_counter()
    study = (
        work_precision(case.loaded, tolerances=TOLERANCES, limit=case.limit)
        if kind == "work-precision"
        else model_errors(case.loaded, tolerances=MODEL_TOLERANCES, limit=case.limit)
    )
    stem = f"accuracy-{'models-' if kind == 'model-error' else ''}{case.scene}"
    draw(study, folder / "figures" / f"{stem}.png")
    write_rows(folder / "figures" / f"{stem}.csv", rows_of(study))
    say(f"{kind} of {case.scene}: {time.perf_counter() - begin:.0f} s")
    table = method_table(study) if kind == "work-precision" else model_table(study)
    notes = " ".join(f"{note[0].upper()}{note[1:]}." for note in study.notes if "not tried" not in note)
    at = f"Within {percent(target(study))}:\n\n" if kind == "work-precision" else ""
    return (
        f"### {case.title}\n\n![{kind} of {case.scene}](figures/{stem}.png)\n\n{at}{table}\n\n"
        f"Reference: {reference_text(study)}. {notes}".rstrip()
        + "\n"
    ), study


def peer_method_section(share: float) -> dict[str, str]:
    """The method of PEER 2017/07 and the default at several tolerances, complete runs: the values of the template."""
    scene = replace(PEER_METHOD.loaded, duration=share * (PEER_METHOD.duration or 0.0))
    study = work_precision(
        scene, methods=["implicit", "dopri5"], tolerances=PEER_METHOD_TOLERANCES, limit=PEER_METHOD.limit, say=say
    )
    rows = []
    for point in study.points:
        trial, found = point.trial, point.errors
        shown = ("-", "-") if found is None else (percent(found["force"].max), percent(found.worst_rms))
        outcome = "success, **wrong**" if point.wrong else "success" if trial.finished else "cut off"
        rows.append(
            (
                f"`{trial.method}`",
                f"{trial.rtol:g}",
                str(trial.steps),
                str(trial.newton),
                seconds(trial.expected_seconds),
                *shown,
                outcome,
            )
        )
    finished = [p for p in study.of("dopri5") if p.trial.finished]
    wrong = [p.trial.rtol for p in finished if p.wrong]
    rate = max((p.trial.steps / p.trial.reached for p in finished), default=0.0)
    head = ("method", "tolerance", "steps", "Newton iterations", "time", "force, worst instant", "worst RMS", "outcome")
    return {
        "report_window": f"{scene.end:.2g}",
        "report_table": markdown_table(head, rows),
        "report_steps": f"{rate:.0f}",
        "report_wrong": f"{min(wrong):g} and looser" if wrong else "none of these tolerances",
        "report_reference": reference_text(study),
    }


def ringing_table(share: float) -> str:
    """Runs that filter the ringing, compared with one that resolves it, over the time which that one reached."""
    rows = []
    for name, duration, tight in RINGING:
        scene = Case("", name, duration).loaded
        resolved = run_native("implicit", scene, tight, 100.0 * share)
        say(f"ringing of {name}: {resolved.status}, {resolved.seconds:.0f} s")
        for rtol in (1e-3, 1e-4, 1e-5):
            run = run_native("implicit", scene, rtol, 60.0)
            found = errors(run, resolved)
            assert found is not None
            rows.append(
                (
                    name,
                    f"{rtol:g}",
                    seconds(run.seconds),
                    f"{tight:g}",
                    seconds(resolved.expected_seconds),
                    percent(found["force"].rms),
                    percent(found["force"].max),
                    percent(found["force"].peak),
                    percent(found["sliding"].rms),
                )
            )
    return markdown_table(
        (
            "scene",
            "tolerance",
            "time",
            "reference",
            "time of the reference",
            "force RMS",
            "worst instant",
            "peak force",
            "sliding RMS",
        ),
        rows,
    )


def estimate_table() -> str:
    """The error that `--error` estimated, and the true error, by scene and requested error."""
    rows = []
    for name in ESTIMATED:
        scene = without_stop(plain_scene(name))
        truth = run_native("esdirk4", scene, 1e-9, 600.0, 0)
        for target in TARGETS:
            try:
                found = simulate_within(scene, target)
            except RunError as error:
                rows.append((name, percent(target), "-", "-", "-", str(error).split(";")[0]))
                continue
            difference = errors(run_native("implicit", scene, found.chosen.rtol, 60.0, 0), truth)
            assert difference is not None and truth.finished
            rows.append(
                (
                    name,
                    percent(target),
                    f"{found.chosen.rtol:g}",
                    "not known" if found.estimate is None else percent(found.estimate),
                    percent(difference.largest),
                    seconds(found.chosen.seconds),
                )
            )
    return markdown_table(("scene", "requested", "tolerance chosen", "estimated", "true", "time of the run"), rows)


def overview(studies: list[tuple[Case, ErrorStudy]]) -> str:
    """One line per scene: the time of the default method and of the fastest other one."""
    rows = []
    for case, study in studies:
        base = cheapest(study, "implicit")
        others = {s: p for s in study.series if s not in ("implicit", "esdirk4") and (p := cheapest(study, s))}
        best = min(others, key=lambda s: others[s].trial.seconds, default=None)
        explicit = [p.trial.expected_seconds for p in study.of("dopri5")]
        rows.append(
            (
                case.scene,
                percent(target(study)),
                "-" if base is None else f"{seconds(base.trial.seconds)} at {base.trial.rtol:g}",
                "none in the limit" if best is None else f"`{best}`, {seconds(others[best].trial.seconds)}",
                seconds(min(explicit)) if explicit else "-",
            )
        )
    return markdown_table(
        ("scene", "within", "default", "best of SciPy and `dopri5`", "`dopri5`, whole run, expected"), rows
    )


def page(folder: Path, cases: list[Case], share: float) -> None:
    """Measure everything and fill the template of the page."""
    begin = time.perf_counter()
    studies, methods = [], []
    for case in cases:
        text, study = measured(case, folder, "work-precision")
        methods.append(text)
        studies.append((case, study))
    models = [measured(case, folder, "model-error")[0] for case in cases if case.models]
    filled = {
        "machine": "; ".join(f"{name} {value}" for name, value in machine().items()),
        "overview": overview(studies),
        "methods": "\n".join(methods),
        "models": "\n".join(models),
        "ringing": ringing_table(share),
        "promises": estimate_table(),
        **peer_method_section(share),
    }
    filled["share"], filled["load"], filled["date"] = f"{share:g}", f"{getloadavg()[2]:.1f}", f"{date.today()}"
    filled["minutes"] = f"{(time.perf_counter() - begin) / 60:.1f}"
    text = (HERE / "accuracy.md.in").read_text(encoding="utf-8")
    for name, value in filled.items():
        text = text.replace(f"{{{{{name}}}}}", value)
    with replacing(folder / "accuracy.md") as temporary:
        temporary.write_text(labelled(text), encoding="utf-8")


def main(words: list[str]) -> None:
    options = parser(__doc__)
    options.add_argument("folder", nargs="?", type=Path, default=docs_folder())
    options.add_argument("--only", type=lambda text: text.split(","))
    options.add_argument("--share", type=float, default=pick(1.0, 0.1))
    given = options.parse_args(words)
    (given.folder / "figures").mkdir(parents=True, exist_ok=True)
    cases = [replace(case, limit=given.share * case.limit) for case in CASES]
    if given.only is None:
        page(given.folder, cases, given.share)
        return
    for case in (case for case in cases if case.scene in given.only):
        for kind in ("work-precision", "model-error")[: 1 + case.models]:
            print(measured(case, given.folder, kind)[0])


if __name__ == "__main__":
    main(sys.argv[1:])
