"""A race of integrators on the same bearings: `python benchmarks/race.py`, some twenty minutes on one idle core.

Error against seconds of msfp-gen, of SciPy's methods on its equations, and of OpenSees with its own triple pendulum,
each against its own converged solution. Writes the scenes with their motions and references, results and the page of
`benchmarks/isolation/`, so that others can run them. `--only NAME` runs one scene and writes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from os import getloadavg
from pathlib import Path

from drawing import COLOURS, INK, page
from plain import plain_scene
from quick import QUICK, installed, labelled, parser, pick

from msfp_gen import Scene
from msfp_gen.common.output import replacing
from msfp_gen.common.tables import markdown_table, write_columns, write_rows
from msfp_gen.scene.file.loader import scene_text
from msfp_gen.studies.accuracy.methods import METHODS, Method
from msfp_gen.studies.accuracy.series import run_opensees
from msfp_gen.studies.accuracy.study import machine, without_stop
from msfp_gen.studies.accuracy.timed_run import Trial, best_reference, errors

FOLDER = Path(__file__).with_name("isolation")
ENTRANTS = ("implicit", "esdirk4", "Radau", "BDF", "LSODA", "DOP853")
TOLERANCES = pick(tuple(10.0**-k for k in range(1, 9)), (1e-2, 1e-3))
STEPS = pick(tuple(500 * 2**k for k in range(7)), (500, 1000))  # of OpenSees; the finest is its reference
OPENSEES = "OpenSees"
BOUNDS = (1e-1, 1e-2, 1e-3, 1e-4)  # of the table


@dataclass(frozen=True)
class Course:
    """A scene of the race. limit: seconds after which a run is cut off."""

    name: str
    words: str
    duration: float | None = None
    limit: float = pick(30.0, 2.0)

    @property
    def scene(self) -> Scene:
        """The scene, without a stop."""
        scene: Scene = without_stop(plain_scene(self.name))
        return scene if self.duration is None else replace(scene, duration=self.duration)


COURSES = (
    Course("fenz-test2", "a triple pendulum on a test rig, one harmonic cycle to 25 mm, slip that reverses"),
    Course("becker-eight-125", "a triple pendulum on a test rig, a figure of eight in the plane"),
    Course("fenz-test5", "a triple pendulum on a test rig, to the rims of its dishes"),
    Course("ridgecrest-clc", "a mass on a triple pendulum, the first 20 s of a record in three directions", 20.0),
)


@dataclass(frozen=True)
class Result:
    """One run. error: RMS over time of the force, over its peak, against the reference of its equations [-].

    floor: by how much two references differ, likewise [-].
    """

    scene: str
    entrant: str
    setting: float
    seconds: float
    error: float
    floor: float
    steps: int
    status: str


def opensees(limit: int) -> Method:
    """OpenSees in a number of steps."""
    return Method(OPENSEES, OPENSEES, lambda scene, steps, _: run_opensees(scene, steps), stepped=True)


def timed(method: Method, scene: Scene, setting: float, limit: float) -> Trial:
    """A run, the fastest of three where it is short."""
    trials = [method.attempt(scene, setting, limit)]
    while trials[0].finished and trials[0].seconds < 1.0 and len(trials) < pick(3, 1):
        trials.append(method.attempt(scene, setting, limit))
    return min(trials, key=lambda trial: trial.seconds)


def results_of(course: Course, trials: list[Trial], reference: Trial, floor: float) -> list[Result]:
    """Rows of the runs beside the reference."""
    rows = []
    for trial in trials:
        found = errors(trial, reference) if trial.finished else None
        error = float("nan") if found is None else found["force"].rms
        about = trial.rtol, trial.seconds, error, floor, trial.steps, trial.status
        rows.append(Result(course.name, trial.method, *about))
    return rows


def run(course: Course) -> tuple[list[Result], Trial, float]:
    """All runs of a scene, the reference of its equations, and by how much two references differ."""
    scene, trials = course.scene, []
    for name in ENTRANTS:
        for setting in TOLERANCES:
            trials.append(timed(METHODS[name], scene, setting, course.limit))
            print(f"{course.name} {name} {setting:g}: {trials[-1].seconds:.3g} s, {trials[-1].status}", flush=True)
            if not trials[-1].finished:
                break
    reference = best_reference(trials, {name: METHODS[name].family for name in ENTRANTS})
    floor = float("nan") if reference.floor is None else reference.floor["force"].rms
    rows = results_of(course, [trial for trial in trials if trial is not reference.trial], reference.trial, floor)
    if scene.bearing.layout.surfaces == 4 and installed("openseespy.opensees", "OpenSees"):
        others = [timed(opensees(steps), scene, steps, course.limit) for steps in STEPS]
        between = errors(others[-2], others[-1]) if all(trial.finished for trial in others[-2:]) else None
        if between is not None:
            rows += results_of(course, others[:-1], others[-1], between["force"].rms)
    return rows, reference.trial, floor


def write_course(course: Course, reference: Trial) -> None:
    """The scene, its motion and its reference, for programs that do not read it."""
    scene, folder = course.scene, FOLDER / course.name
    folder.mkdir(parents=True, exist_ok=True)
    with replacing(folder / "scene.toml") as part:
        part.write_text(scene_text(scene), encoding="utf-8")
    times = reference.instants
    motion, force = scene.motion.evaluate(times, 0), reference.histories["force"][:, 0]
    columns = {("time", "s"): times} | {(f"u{axis + 1}", "m"): motion[:, axis] for axis in range(3)}
    columns |= {(f"F{axis + 1}", "N"): force[:, axis] for axis in range(2)}
    write_columns(folder / "reference.csv", {key: values.tolist() for key, values in columns.items()})


def within(rows: list[Result], bound: float) -> str:
    """A cell of the table."""
    if not all(10 * row.floor <= bound for row in rows):  # nor where it is not known at all
        return "?"
    return f"{min(times):.2g} s" if (times := [row.seconds for row in rows if row.error <= bound]) else "-"


def table_of(course: Course, rows: list[Result]) -> str:
    """The least seconds within each bound, by entrant; "?" where references are not known to a tenth of it."""
    cells = []
    for name in (*ENTRANTS, OPENSEES):
        own = [row for row in rows if row.entrant == name and row.scene == course.name and row.error == row.error]
        if not own and not any(row.entrant == name and row.scene == course.name for row in rows):
            continue
        cells.append((name, *(within(own, bound) for bound in BOUNDS)))
    return markdown_table(("entrant", *(f"within {bound:g}" for bound in BOUNDS)), cells)


def figure(all_rows: list[Result], path: Path) -> None:
    """Error over seconds, a panel for each scene."""
    with page(10.0, 8.0, path) as drawn:
        panels = drawn.subplots(2, 2, squeeze=False).ravel()
        for course, axes in zip(COURSES, panels, strict=False):
            for colour, name in zip((*COLOURS[: len(ENTRANTS)], INK), (*ENTRANTS, OPENSEES), strict=True):
                own = [row for row in all_rows if row.entrant == name and row.scene == course.name and row.error > 0]
                if own:
                    axes.loglog(
                        [row.seconds for row in own], [row.error for row in own], "o-", color=colour, label=name
                    )
            axes.set(title=course.name, xlabel="seconds", ylabel="RMS error of the force over its peak [-]")
        lines = {text: line for axes in panels for line, text in zip(*axes.get_legend_handles_labels(), strict=True)}
        drawn.legend([lines[name] for name in (*ENTRANTS, OPENSEES) if name in lines],
                     [name for name in (*ENTRANTS, OPENSEES) if name in lines], loc="outside lower center", ncols=7)  # fmt: skip


RULES = """# A race of integrators on isolation bearings

For whoever has an integrator for contact with friction: {count} scenes, each with the bearing, the motion of its base,
and a converged reference, and what others need for them.

![Error against seconds](race.png)

`python benchmarks/race.py` ({day}, {machine}, load {load:.1f}) ran them. {versions}.

## Rules

1. Equal data: `scene.toml` of each folder, in SI units: geometry, friction, masses, rig or mass. PEER Report 2017/07 has the
   equations ([what they are](../../docs/equations.md)). An entrant with other equations, as OpenSees with its
   element of springs in series, is measured against its own solution at its finest step, not against ours: the race is one of
   integrators, and [accuracy](../../docs/accuracy.md) compares models.
2. The answer is the horizontal force on the top at the instants of `reference.csv`, by the entrant's own interpolation. The
   error is its root mean square over time, over the peak of the force.
3. Seconds count the integration on one core, without reading, compiling and writing; the fastest of three where a run
   takes less than one. A run is cut off after {limit:g} s. Tolerances go from 0.1 to 1e-8 in factors of ten, steps of
   methods without error control from 500 in factors of two.
4. The reference is the tightest run of the pair that agrees best among methods of different families. What they differ by is
   stated; a bound below ten times this difference has a question mark, and a dash stands where no run is within the
   bound. The reference of OpenSees is its finest run.

SciPy's methods step in Python and call the compiled equations with their exact Jacobian, so their seconds are what a user
of SciPy waits for. MuJoCo and Drake are not among the entrants. A sphere in a dish is possible there, by signed distances
in MuJoCo and by pressure fields over meshes in Drake, but both make contact and friction soft by parameters that no
bearing states, so that they converge to the motion of another model.

In `becker-eight-125` and `fenz-test5` nothing damps the ringing of the sliders, which the references resolve and runs at
loose tolerances leave out: their error stays the same until it is resolved. The element of OpenSees has
sliders without mass, which do not ring.

"""


def text_of(rows: list[Result], floors: dict[str, float]) -> str:
    """The page of the folder."""
    about = machine()
    found = {name: _version(name) for name in ("msfp-gen", "scipy", "openseespy")}
    versions = ", ".join(f"{name} {number}" for name, number in found.items() if number)
    text = RULES.format(
        count=len(COURSES),
        day=date.today().isoformat(),
        machine=f"{about['processor']}, {about['compiler']}",
        load=getloadavg()[0],
        versions=versions,
        limit=COURSES[0].limit,
    )
    for course in COURSES:
        text += (
            f"## {course.name}\n\n{course.words[0].upper()}{course.words[1:]}. Two references differ by "
            f"{floors[course.name]:.1e}. Least seconds within an error:\n\n{table_of(course, rows)}\n\n"
        )
    return text.rstrip() + "\n"


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def main() -> None:
    """Run all scenes and write the folder."""
    options = parser(__doc__)
    options.add_argument("--only", help="one scene; nothing is written")
    only = options.parse_args().only
    rows: list[Result] = []
    floors = {}
    for course in COURSES:
        if only in (None, course.name):
            found, reference, floors[course.name] = run(course)
            rows += found
            print(table_of(course, found), flush=True)
            if not QUICK and only is None:
                write_course(course, reference)
    if QUICK or only:
        return
    write_rows(FOLDER / "results.csv", [vars(row) for row in rows])
    figure(rows, FOLDER / "race.png")
    with replacing(FOLDER / "README.md") as part:
        part.write_text(labelled(text_of(rows, floors)), encoding="utf-8")


if __name__ == "__main__":
    main()
