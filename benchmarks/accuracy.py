"""What accuracy costs: every figure, table and number of docs/accuracy.md. `python benchmarks/accuracy.py [DIR]`.

Some six minutes on two quiet cores; with openseespy installed its element is drawn too. Takes the folder to write
into; without one, the docs of this checkout. `--only NAME,...` measures those scenes alone and leaves the page;
`--share 0.2` takes so much of every limit and of the slowest run, for a look while the machine is busy.
"""

from __future__ import annotations

import sys
import time
from argparse import ArgumentParser
from dataclasses import dataclass, replace
from os import getloadavg
from pathlib import Path

from msfp_gen import RunError, Scene, load_scene
from msfp_gen.accuracy import model_errors, output, simulate_within, work_precision
from msfp_gen.accuracy.machine import machine
from msfp_gen.accuracy.measure import errors
from msfp_gen.accuracy.study import Point, Study, without_stop
from msfp_gen.accuracy.trial import run_native
from msfp_gen.accuracy.within import worst
from msfp_gen.output import replacing

HERE = Path(__file__).resolve().parent
TARGETS_OF_TABLES = (1e-3, 3e-3, 1e-2, 3e-2)  # of the larger RMS error; the first above the floor is compared at
TOLERANCES = tuple(10.0**-k for k in range(2, 9))
MODEL_TOLERANCES = tuple(10.0**-k for k in range(2, 6))


@dataclass(frozen=True)
class Case:
    """A scene of the page: its title, the part of it that is run [s], the limit of a run [s]; models: compared too."""

    title: str
    scene: str
    duration: float | None = None
    limit: float = 1.2
    models: bool = False

    @property
    def loaded(self) -> Scene:
        scene = without_stop(load_scene(self.scene))
        return scene if self.duration is None else replace(scene, duration=self.duration)


CASES = (
    Case("Test 1 of the report: 1.2 mm, stage I", "fenz-test1"),
    Case("Test 2: 25 mm, stage II", "fenz-test2", models=True),
    Case("Test 3: 75 mm, stage III", "fenz-test3"),
    Case("Test 4: 115 mm, stage IV", "fenz-test4"),
    Case("Test 5: 140 mm, stage V, rims", "fenz-test5", limit=2.0, models=True),
    Case("A circle of 50 mm", "becker-circle-50", models=True),
    Case("A real record: 14 s of Ridgecrest 2019, three components, a supported mass", "ridgecrest-clc", 14.0, 3.0, True),
    Case("A rim impact: the push of figure 4.1 at up to 0.17 m/s", "fenz-monotonic", limit=3.0, models=True),
)
REPORT = Case("The report's method", "fenz-test2", 4.0, 15.0)
REPORT_TOLERANCES = (0.3, 0.1, 0.03, 1e-2, 1e-3, 1e-4)
RINGING = (("fenz-test5", None, 1e-7), ("ridgecrest-clc", 14.0, 1e-7), ("fenz-monotonic", None, 1e-9))
PROMISES = ("fenz-test2", "fenz-test5", "becker-circle-50", "unusual-tfp", "double-push", "fenz-monotonic")
TARGETS = (0.02, 0.005, 0.001)


def say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def grid(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """A Markdown table."""
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (head, ("---",) * len(head), *rows))


def seconds(value: float) -> str:
    return f"{1e3 * value:.2g} ms" if value < 0.1 else f"{value:.2g} s" if value < 100 else f"{value:.0f} s"


def percent(value: float) -> str:
    return f"{100 * value:.2g} %"


def target(study: Study) -> float:
    """What the methods of a scene are compared at: no less than is known of the reference."""
    floor = study.reference.floor
    return next((t for t in TARGETS_OF_TABLES if floor is None or floor.worst_rms < t), TARGETS_OF_TABLES[-1])


def times(ratio: float) -> str:
    return f"{ratio:.2g}" if ratio < 100 else f"{ratio:.0f}"


def reaching(study: Study, series: str) -> Point | None:
    """The cheapest point of a method whose RMS errors are at most the target of its scene."""
    good = [p for p in study.of(series) if p.errors is not None and p.errors.worst_rms <= target(study)]
    return min(good, key=lambda p: p.trial.seconds, default=None)


def method_table(study: Study) -> str:
    """For every method what it takes to be within the target, or what became of it."""
    base = reaching(study, "implicit")
    rows = []
    for series in study.series:
        point = reaching(study, series)
        if point is not None and base is not None:
            ratio = point.trial.seconds / base.trial.seconds
            rows.append((f"`{series}`", f"{point.trial.rtol:g}", seconds(point.trial.seconds), times(ratio),
                         str(point.trial.newton)))  # fmt: skip
        else:
            rows.append((f"`{series}`", "-", fate(study.of(series)), "-", "-"))
    return grid(("method", "tolerance", "time", "over the default", "Newton iterations"), rows)


def fate(points: list[Point]) -> str:
    """What became of a method that no tolerance brought to the target."""
    wrong = [f"{p.trial.rtol:g}" for p in points if p.wrong]
    if wrong:
        return f"success reported and wrong at {', '.join(wrong)}"
    cut = [p.trial.expected_seconds for p in points if p.trial.status == "cut off"]
    if cut:
        return f"cut off; the whole would take about {seconds(min(cut))}"
    ended = [p for p in points if p.errors is not None]
    best = min((p.errors.worst_rms for p in ended if p.errors is not None), default=None)
    return "failed" if best is None else f"no better than {percent(best)}"


def model_table(study: Study) -> str:
    """For every model its error where its tolerance no longer matters, and its cost at 1e-4 over the full one."""
    at = {p.series: p for p in study.points if p.trial.rtol == 1e-4}
    rows = []
    for series in study.series:
        ended = [p for p in study.of(series) if p.errors is not None]
        if not ended:
            rows.append((series, "-", "-", "-", study.of(series)[-1].trial.message))
            continue
        last = ended[-1].errors
        assert last is not None
        sliding = "-" if last.sliding_rms != last.sliding_rms else percent(last.sliding_rms)
        cost = at.get(series, ended[0]).trial.seconds / at["as it stands"].trial.seconds
        rows.append((series, percent(last.force_rms), percent(last.force_peak), sliding, f"{cost:.2g}"))
    return grid(("model", "force RMS", "peak force", "sliding RMS", "time over the full one"), rows)


def measured(case: Case, folder: Path, kind: str) -> tuple[str, Study]:
    """One study with its figure and its data; the section for the page."""
    begin = time.perf_counter()
    study = (
        work_precision(case.loaded, tolerances=TOLERANCES, limit=case.limit)
        if kind == "work-precision"
        else model_errors(case.loaded, tolerances=MODEL_TOLERANCES, limit=case.limit)
    )
    stem = f"accuracy-{'models-' if kind == 'model-error' else ''}{case.scene}"
    output.draw(study, folder / "figures" / f"{stem}.png")
    output.write_csv(study, folder / "figures" / f"{stem}.csv")
    say(f"{kind} of {case.scene}: {time.perf_counter() - begin:.0f} s")
    table = method_table(study) if kind == "work-precision" else model_table(study)
    notes = " ".join(f"{note[0].upper()}{note[1:]}." for note in study.notes if "not tried" not in note)
    at = f"Within {percent(target(study))}:\n\n" if kind == "work-precision" else ""
    return (f"### {case.title}\n\n![{kind} of {case.scene}](figures/{stem}.png)\n\n{at}{table}\n\n"
            f"Reference: {output.reference_text(study)}. {notes}".rstrip() + "\n"), study  # fmt: skip


def report_section(share: float) -> dict[str, str]:
    """The report's method over tolerances, complete runs, beside the default."""
    scene = replace(REPORT.loaded, duration=share * (REPORT.duration or 0.0))
    study = work_precision(scene, methods=["implicit", "dopri5"], tolerances=REPORT_TOLERANCES,
                           limit=REPORT.limit, say=say)  # fmt: skip
    rows = []
    for point in study.points:
        trial, found = point.trial, point.errors
        told = ("-", "-") if found is None else (percent(found.force_max), percent(found.worst_rms))
        outcome = "success, **wrong**" if point.wrong else "success" if trial.finished else "cut off"
        rows.append((f"`{trial.method}`", f"{trial.rtol:g}", str(trial.steps), str(trial.newton),
                     seconds(trial.expected_seconds), *told, outcome))  # fmt: skip
    ended = [p for p in study.of("dopri5") if p.trial.finished]
    wrong = [p.trial.rtol for p in ended if p.wrong]
    rate = max((p.trial.steps / p.trial.reached for p in ended), default=0.0)
    head = ("method", "tolerance", "steps", "Newton iterations", "time", "force, worst instant", "worst RMS", "outcome")
    return {
        "report_window": f"{scene.end:.2g}",
        "report_table": grid(head, rows),
        "report_steps": f"{rate:.0f}",
        "report_wrong": f"{min(wrong):g} and looser" if wrong else "none of these tolerances",
        "report_reference": output.reference_text(study),
    }


def ringing_table(share: float) -> str:
    """Filtered runs against one that resolves the ringing as far as it was taken."""
    rows = []
    for name, duration, tight in RINGING:
        scene = Case("", name, duration).loaded
        sharp = run_native("implicit", scene, tight, 100.0 * share)
        say(f"ringing of {name}: {sharp.status}, {sharp.seconds:.0f} s")
        for rtol in (1e-3, 1e-4, 1e-5):
            run = run_native("implicit", scene, rtol, 60.0)
            found = errors(run, sharp)
            assert found is not None
            rows.append((name, f"{rtol:g}", seconds(run.seconds), f"{tight:g}", seconds(sharp.expected_seconds),
                         percent(found.force_rms), percent(found.force_max), percent(found.force_peak),
                         percent(found.sliding_rms)))  # fmt: skip
    return grid(("scene", "tolerance", "time", "against", "its time", "force RMS", "worst instant", "peak force",
                 "sliding RMS"), rows)  # fmt: skip


def promise_table() -> str:
    """What `--error` promised, and what the error then was."""
    rows = []
    for name in PROMISES:
        scene = without_stop(load_scene(name))
        truth = run_native("implicit", scene, 1e-8 if name in ("double-push", "fenz-test2") else 1e-6, 60.0, 0)
        for target in TARGETS:
            try:
                found = simulate_within(scene, target, budget=30.0)
            except RunError as error:
                rows.append((name, percent(target), "-", "-", "-", str(error).split(";")[0]))
                continue
            judged = errors(run_native("implicit", scene, found.chosen.rtol, 60.0, 0), truth)
            assert judged is not None and found.chosen.estimate is not None
            rows.append((name, percent(target), f"{found.chosen.rtol:g}", percent(found.chosen.estimate),
                         percent(worst(judged)), seconds(found.chosen.seconds)))  # fmt: skip
    return grid(("scene", "asked for", "tolerance chosen", "estimated", "true", "time of the run"), rows)


def overview(studies: list[tuple[Case, Study]]) -> str:
    """One line a scene: what the default and the best of the others take."""
    rows = []
    for case, study in studies:
        base = reaching(study, "implicit")
        others = {s: p for s in study.series if s not in ("implicit", "esdirk4") and (p := reaching(study, s))}
        best = min(others, key=lambda s: others[s].trial.seconds, default=None)
        report = [p.trial.expected_seconds for p in study.of("dopri5")]
        rows.append((
            case.scene,
            percent(target(study)),
            "-" if base is None else f"{seconds(base.trial.seconds)} at {base.trial.rtol:g}",
            "none in the limit" if best is None else f"`{best}`, {seconds(others[best].trial.seconds)}",
            seconds(min(report)) if report else "-",
        ))  # fmt: skip
    return grid(("scene", "within", "default", "best of SciPy and the report", "the report's method, whole run, expected"), rows)


def page(folder: Path, cases: list[Case], share: float) -> None:
    """Measure everything and fill the page."""
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
        "promises": promise_table(),
        **report_section(share),
    }
    filled["share"], filled["load"] = f"{share:g}", f"{getloadavg()[2]:.1f}"
    filled["minutes"] = f"{(time.perf_counter() - begin) / 60:.1f}"
    text = (HERE / "accuracy.md.in").read_text(encoding="utf-8")
    for name, value in filled.items():
        text = text.replace(f"{{{{{name}}}}}", value)
    with replacing(folder / "accuracy.md") as temporary:
        temporary.write_text(text, encoding="utf-8")


def main(words: list[str]) -> None:
    options = ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    options.add_argument("folder", nargs="?", type=Path, default=HERE.parent / "docs")
    options.add_argument("--only", type=lambda text: text.split(","))
    options.add_argument("--share", type=float, default=1.0)
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
