"""What cheap models save in a study, and whether intervals hold: `python benchmarks/fidelity.py` (docs/studies.md).

A triple pendulum under a mass, with uncertain friction, azimuth and intensity, under the two bundled records. Every draw
is run once by each model (`table`); estimates are then repeated with draws from this table, so that the truth is its mean
and hundreds of repetitions cost nothing. Seconds are those of a core that the runs of the table took. Then estimates of
four populations that need no runs. `--folder DIR` keeps the tables.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from msfp_gen import load_scene
from msfp_gen.scene.fidelity import at_fidelity
from msfp_gen.scene.scene import Scene
from msfp_gen.studies.batch import run_to_end
from msfp_gen.studies.estimation.estimate import Question, estimated

sys.path += [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests/unit/studies")]
from quick import parser, pick
from test_estimate import LIMIT, POPULATIONS, Population

REPETITIONS = pick(400, 2)
COUNTS = {"design": pick(200, 34), "beyond": pick(60, 34)}
MEDIANS = {"design": 0.7, "beyond": 1.3}  # of the scale of motions
LEVELS = {"design": ("exact", "equivalent"), "beyond": ("exact", "equivalent", "massless")}
DURATION = pick(None, 8.0)


def draws(count: int, median: float) -> Iterator[Scene]:
    """Random scenes under the bundled records, turned at random.

    median: of the scale of the motion, which is lognormal with 0.35; friction is lognormal with 0.2.
    """
    rng = np.random.default_rng(5)
    bundled = [load_scene(name) for name in ("ridgecrest-clc", "ridgecrest-ccc")]
    for number in range(count):
        base = bundled[number % 2]
        factor, azimuth = np.exp(0.2 * rng.standard_normal()), rng.uniform(0, np.pi)
        motion = base.motion.rotated(float(azimuth))
        motion = replace(motion, coefficients=median * np.exp(0.35 * rng.standard_normal()) * motion.coefficients)
        bearing = base.bearing.replace(friction=[factor * surface.friction for surface in base.bearing.surfaces])
        yield replace(base, motion=motion, motion_table=None, bearing=bearing, duration=DURATION or base.duration)


def row(scene: Scene, level: str) -> list[float]:
    """Displacement, shear, use of rims, the seconds of a core that a run took, and whether it reached its end."""
    begin = time.process_time()
    result = run_to_end(at_fidelity(scene, level))
    summary = result.summary
    used = max(summary.get("capacity_used", [np.nan]))
    seconds = time.process_time() - begin
    return [summary["peak_displacement"]["radial"], summary["peak_force"]["radial"], used, seconds,
            float(result.status == "ok")]  # fmt: skip


def table(path: Path, count: int, levels: tuple[str, ...], median: float) -> dict[str, np.ndarray]:
    """Rows of every level, shape (scenes, 5), as of `row`, computed unless the file has them."""
    if path.is_file():
        with np.load(path) as kept:
            return {level: kept[level] for level in levels}
    rows: dict[str, list[list[float]]] = {level: [] for level in levels}
    for number, scene in enumerate(draws(count, median)):
        for level in levels:
            if not number:
                row(scene, level)  # loads its model
            rows[level].append(row(scene, level))
    arrays = {level: np.array(each) for level, each in rows.items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, **arrays)
    return arrays


class Table:
    """Runs for an estimate (`ModelRuns`): draws of rows of a table, with replacement."""

    population = None

    def __init__(self, rows: dict[str, np.ndarray], column: int, seed: int) -> None:
        self.levels = tuple(rows)
        self._rows, self._column = rows, column
        self._place = np.random.default_rng([seed, 1]).integers(len(rows["exact"]), size=200_000)
        self._costs = {level: float(np.mean(each[:, 3])) for level, each in rows.items()}
        self._done = dict.fromkeys(rows, 0)

    def values(self, level: str, count: int) -> tuple[np.ndarray, np.ndarray]:
        """See `ModelRuns`."""
        self._done[level] = max(count, self._done[level])
        rows = self._rows[level][self._place[:count]]
        columns = (
            [self._column] if level == "exact" or not self._column else [self._column, 0]
        )  # see `quantities_of_model`
        values = np.where(np.isnan(rows[:, columns]), np.inf, rows[:, columns])
        return values[:, 0] if len(columns) == 1 else values, rows[:, 4] == 0

    def cost(self, level: str) -> float:
        """See `ModelRuns`."""
        return self._costs[level]

    def spent(self) -> tuple[float, dict[str, int]]:
        """See `ModelRuns`."""
        runs = {level: done for level, done in self._done.items() if done}
        return sum(self._costs[level] * count for level, count in runs.items()), runs


@dataclass(frozen=True)
class Case:
    """One line of the table: population, column of its rows, and the question."""

    about: str
    population: str
    column: int
    question: Question

    def truth(self, rows: np.ndarray) -> float:
        """The statistic of the whole table."""
        values, threshold = rows[:, self.column], self.question.threshold
        outcomes = np.where(rows[:, 4] == 0, np.inf, values)
        if self.question.statistic == "probability":
            return float(np.mean(np.where(values >= threshold, True, np.isinf(outcomes))))
        return float(values.mean())


CASES = (
    Case("mean of peak displacement", "design", 0, Question("u", target=0.01)),
    Case("mean of base shear", "design", 1, Question("V", target=0.005)),
    Case("probability of meeting a rim", "beyond", 2, Question("rim", "probability", 1.0, target=0.02)),
)


def line_of(case: Case, rows: dict[str, np.ndarray]) -> str:
    """The line of a case."""
    truth = case.truth(rows["exact"])
    found = [estimated(Table(rows, case.column, seed), case.question) for seed in range(REPETITIONS)]
    held = np.mean([one.interval[0] <= truth <= one.interval[1] for one in found])
    gain = np.median([one.plain_seconds / one.seconds for one in found])
    exact = int(np.median([one.runs["exact"] for one in found]))
    runs = {level: np.median([one.runs.get(level, 0) for one in found]) for level in rows if level != "exact"}
    level = max(runs, key=lambda name: runs[name])
    rho = np.median([one.correlation[level] for one in found])
    return (
        f"| {case.about} | {level} | {case.question.target:g} | {rho:.3f} | {exact} | {gain:.1f} | {100 * held:.1f} % |"
    )


def coverage(name: str, statistic: str) -> str:
    """The line of a population that needs no runs."""
    draw = POPULATIONS[name]
    values = draw(np.random.default_rng(0), 4_000_000)[0]
    threshold, target, truth = None, 0.03, float(values.mean())
    if statistic == "probability":
        threshold, target = LIMIT[name], 0.01
        truth = float(np.mean(values >= threshold))
    question = Question("q", statistic, threshold, target=target)
    found = [estimated(Population(draw, seed), question) for seed in range(REPETITIONS)]
    held = np.mean([one.interval[0] <= truth <= one.interval[1] for one in found])
    plain = np.mean(["no cheaper model" in " ".join(one.notes) for one in found])
    gain = np.median([one.plain_seconds / one.seconds for one in found])
    exact = int(np.median([one.runs["exact"] for one in found]))
    return f"| {name} | {statistic} | {target:g} | {exact} | {100 * plain:.0f} % | {gain:.1f} | {100 * held:.1f} % |"


def main() -> None:
    """Make the tables, repeat the estimates, and print the lines."""
    options = parser(__doc__)
    options.add_argument("--folder", type=Path, help="where the tables of runs are kept")
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.folder or Path(scratch)
        populations = {
            name: table(folder / f"{name}.npz", COUNTS[name], LEVELS[name], MEDIANS[name]) for name in MEDIANS
        }
    print("| statistic | cheap model | target | correlation | exact runs | times faster | coverage |")
    print("|---|---|---|---|---|---|---|", flush=True)
    for case in CASES:
        print(line_of(case, populations[case.population]), flush=True)
    for name, rows in populations.items():
        costs = ", ".join(f"{level} {1e3 * each[:, 3].mean():.3g} ms" for level, each in rows.items())
        early = 100 * float((rows["exact"][:, 4] == 0).mean())
        print(f"\n{name}: {costs}; {early:.1f} % of exact runs ended early")
    print("\n| population | statistic | target | exact runs | run plainly | times faster | coverage |")
    print("|---|---|---|---|---|---|---|", flush=True)
    for statistic in ("mean", "probability"):
        for name in POPULATIONS:
            print(coverage(name, statistic), flush=True)


if __name__ == "__main__":
    main()
