"""What cheap models save in a study: `python benchmarks/fidelity.py` (docs/fidelity.md).

A triple pendulum under a mass, with uncertain friction, azimuth and intensity, under synthetic records and the two bundled
ones, to which no number of the models is fitted. Every draw is run once by each model (`table`); estimates are then repeated
with draws from this table, so that the truth is its mean and hundreds of repetitions cost nothing. Seconds are those of
a core that the runs of the table took, and what a study adds to each. `--folder DIR` keeps the tables.
"""

from __future__ import annotations

import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from msfp_gen import load_scene
from msfp_gen.motions.motion import Motion
from msfp_gen.scene.fidelity import Backbone, at_fidelity
from msfp_gen.scene.scene import Scene
from msfp_gen.studies import estimate
from msfp_gen.studies.batch import pool_from, run_to_end
from msfp_gen.studies.definition import example_text, load_study
from msfp_gen.studies.estimation.estimate import Estimate, Question, estimate_table, estimated
from msfp_gen.studies.estimation.source import StudySource

sys.path.append(str(Path(__file__).parent))
from quick import parser, pick

LEVELS = ("exact", "equivalent")
REPETITIONS = pick(400, 2)
COUNTS = pick((400, 600), (40, 40))  # draws of design, and beyond it
MEDIANS = {"design": 0.55, "beyond": 1.0}  # of the scale of motions
SEEDS = {"design": 201, "beyond": 202}
STEP, DURATION = 0.01, pick(30.0, 8.0)
NAMES = ("displacement", "shear", "rim_use", "seconds", "ok")


def noise(rng: np.random.Generator) -> Motion:
    """A record that never was: two horizontal components of noise through the filter of Kanai and Tajimi (1957-60).

    The ground has a frequency of 0.8 to 2.5 Hz and a damping of 0.6, the envelope rises in 4 s and decays after 12 s,
    frequencies below 0.15 Hz are cut off, and the peak is 3 m/s^2.
    """
    times = np.arange(0.0, DURATION + STEP / 2, STEP)
    frequencies = np.fft.rfftfreq(len(times), STEP)
    ground, damping = rng.uniform(0.8, 2.5), 0.6
    ratio = frequencies / ground
    gain = (1 + 2j * damping * ratio) / (1 - ratio**2 + 2j * damping * ratio) * (frequencies / 0.15) ** 2
    gain /= 1 - (frequencies / 0.15) ** 2 + 1.4j * frequencies / 0.15
    envelope = np.minimum(times / 4, 1) * np.exp(-np.maximum(times - 12, 0) / 5)
    parts = [np.fft.irfft(np.fft.rfft(rng.standard_normal(len(times))) * gain, len(times)) * envelope for _ in range(2)]
    parts = [part - np.mean(part) * envelope / np.mean(envelope) for part in parts]
    acceleration = np.stack([*parts, np.zeros(len(times))], axis=1)
    return Motion.from_acceleration(times, 3.0 * acceleration / np.abs(acceleration).max())


def draws(seed: int, count: int, median: float) -> Iterator[Scene]:
    """Random scenes: each third one under a bundled record, turned at random, the others under noise.

    median: of the scale of the motion, which is lognormal with 0.35.
    """
    rng = np.random.default_rng(seed)
    bundled = [load_scene(name) for name in ("ridgecrest-clc", "ridgecrest-ccc")]
    for number in range(count):
        factor, azimuth, scale = (
            np.exp(0.2 * rng.standard_normal()),
            rng.uniform(0, np.pi),
            np.exp(0.35 * rng.standard_normal()),
        )
        base = bundled[number % 2]
        motion = noise(rng) if number % 3 else base.motion.rotated(float(azimuth))
        horizontal = motion.coefficients.copy()
        horizontal[:, 2] = 0.0
        bearing = base.bearing.replace(friction=[factor * surface.friction for surface in base.bearing.surfaces])
        bearing = bearing.replace(reference_pressure=None)
        effects = replace(base.effects, friction="constant")
        solver = replace(base.solver, rtol=1e-3)
        motion = replace(motion, coefficients=float(median * scale) * horizontal)
        yield replace(base, motion=motion, motion_table=None, bearing=bearing, effects=effects, solver=solver)


def row(scene: Scene, level: str) -> list[float]:
    """The quantities of a run, the seconds of a core that it took, and whether it reached its end."""
    begin = time.process_time()
    result = run_to_end(at_fidelity(scene, level))
    summary = result.summary
    capacities = [surface.capacity for surface in scene.bearing.surfaces]
    gaps = summary.get("minimum_gap")  # none of one pendulum in place of the stack: its own displacement counts
    use = summary["peak_displacement"]["radial"] / Backbone.of(scene.bearing).capacity
    if gaps is not None:
        use = 1 - min(gap / capacity for gap, capacity in zip(gaps, capacities, strict=True))
    seconds = time.process_time() - begin
    ended = float(result.status == "ok")
    return [summary["peak_displacement"]["radial"], summary["peak_force"]["radial"], use, seconds, ended]


def table(path: Path, seed: int, count: int, levels: tuple[str, ...], median: float) -> dict[str, np.ndarray]:
    """Rows of every level, shape (scenes, NAMES), computed unless the file has them."""
    if path.is_file():
        with np.load(path) as kept:
            return {level: kept[level] for level in levels}
    rows: dict[str, list[list[float]]] = {level: [] for level in levels}
    for number, scene in enumerate(draws(seed, count, median)):
        for level in levels:
            if not number:
                row(scene, level)  # loads its model
            rows[level].append(row(scene, level))
    arrays = {level: np.array(each) for level, each in rows.items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, **arrays)
    return arrays


class Table:
    """A source of an estimate: draws of rows of a table, with replacement."""

    population = None

    def __init__(self, rows: dict[str, np.ndarray], column: int, seed: int, added: float) -> None:
        self.levels = tuple(rows)
        self._rows, self._column = rows, column
        self._place = np.random.default_rng([seed, 1]).integers(len(rows["exact"]), size=200_000)
        self._costs = {level: float(np.mean(each[:, 3])) + added for level, each in rows.items()}
        self._done = dict.fromkeys(rows, 0)

    def values(self, level: str, count: int) -> tuple[np.ndarray, np.ndarray]:
        """As of `Source`."""
        self._done[level] = max(count, self._done[level])
        rows = self._rows[level][self._place[:count]]
        return rows[:, self._column], rows[:, 4] == 0

    def cost(self, level: str) -> float:
        """As of `Source`."""
        return self._costs[level]

    def spent(self) -> tuple[float, dict[str, int]]:
        """As of `Source`."""
        runs = {level: done for level, done in self._done.items() if done}
        return sum(self._costs[level] * count for level, count in runs.items()), runs


def law(costs: dict[str, float]) -> dict[str, np.ndarray]:
    """Rows of a lognormal quantity with events too rare for a table of runs; the cheap model sees all but a tenth of it.

    costs: seconds of a run by model.
    """
    hidden, other = np.random.default_rng(14).standard_normal((2, pick(400_000, 4000)))
    values = {"exact": np.exp(0.5 * (hidden + 0.1 * other)), "equivalent": 1.1 * np.exp(0.45 * hidden)}
    return {
        level: np.stack([each, each, each, np.full(len(each), costs[level]), np.ones(len(each))], axis=1)
        for level, each in values.items()
    }


def added() -> float:
    """Seconds that a study adds to a run: what its parts state, less what their runs took."""
    example = tomllib.loads(example_text())
    del example["quantities"]
    study = load_study({**example, "keep": ["wall_time"]})
    with tempfile.TemporaryDirectory() as folder, pool_from(1, True) as pool:
        source = StudySource(study, Path(folder), "wall_time", LEVELS, 0, pool)
        seconds, _ = source.values("equivalent", 512)
        return source.cost("equivalent") - float(np.median(seconds))


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
    Case("mean of peak displacement", "design", 0, Question("u", target=0.03)),
    Case("mean of base shear", "design", 1, Question("V", target=0.02)),
    Case("mean of base shear", "design", 1, Question("V", target=0.01)),
    Case("mean of base shear", "within", 1, Question("V", target=0.02)),
    Case("mean of base shear", "within", 1, Question("V", target=0.01)),
    Case("mean of peak displacement", "beyond", 0, Question("u", target=0.03)),
    Case("mean of base shear", "beyond", 1, Question("V", target=0.05)),
    Case("probability of meeting a rim", "beyond", 2, Question("rim", "probability", 1.0, target=0.03)),
    Case("probability of meeting a rim", "design", 2, Question("rim", "probability", 1.0, target=0.005)),
    Case("probability of 4.72", "law", 0, Question("q", "probability", 4.72, target=1e-3)),
)


def line_of(case: Case, rows: dict[str, np.ndarray], scene: float) -> str:
    """The line of a case."""
    truth = case.truth(rows["exact"])
    found = [estimated(Table(rows, case.column, seed, scene), case.question) for seed in range(REPETITIONS)]
    held = np.mean([one.interval[0] <= truth <= one.interval[1] for one in found])
    gain = np.median([one.plain_seconds / one.seconds for one in found])
    exact = int(np.median([one.runs["exact"] for one in found]))
    rho = np.median([one.correlation["equivalent"] for one in found])
    plain = f"{100 * plain_coverage(case, rows['exact'], truth, found):.1f} %"
    word = {"probability": f"{case.question.target:g}"}.get(
        case.question.statistic, f"{100 * case.question.target:g} %"
    )
    return f"| {case.about} | {case.population} | {word} | {rho:.3f} | {exact} | {gain:.1f} | {100 * held:.1f} % | {plain} |"


def plain_coverage(case: Case, rows: np.ndarray, truth: float, found: list[Estimate]) -> float:
    """How often intervals of as many plain runs as the estimates replace hold the truth, by the usual formulas."""
    rng = np.random.default_rng(3)
    values = np.where(rows[:, 4] == 0, np.inf, rows[:, case.column])
    held = []
    for one in found:
        count = max(int(one.plain_seconds / one.costs["exact"]), 8)
        drawn = values[rng.integers(len(values), size=count)]
        if case.question.statistic == "probability":
            drawn = (drawn >= case.question.threshold).astype(float)
        else:
            drawn = rows[rng.integers(len(values), size=count), case.column]
        held.append(abs(drawn.mean() - truth) <= 1.96 * drawn.std(ddof=1) / np.sqrt(count))
    return float(np.mean(held))


def hospital(folder: Path) -> str:
    """The mean of the base shear of the hospital under both records at four scales, with bounds of friction and damping."""
    records = [{"bundled": f"ridgecrest-2019-ci-{name}", "duration": pick(15.0, 4.0)} for name in ("clc", "ccc")]
    damping = {"sets": "building.damping_ratio", "distribution": "uniform", "low": 0.02, "high": 0.08}
    study = {
        "scene": "hospital-clc", "keep": ["peak_force"], "sampling": {"samples": 4},
        "records": {"motions": records, "scales": [0.4, 0.6, 0.8, 1.0]},
        "axes": {"bounds": {"factors": "asce7"}, "damping": damping},
    }  # fmt: skip
    goals = {"target": pick(0.1, 0.3), "pilot": 16, "models": ["equivalent"]}
    found = estimate(study, folder, "peak_force", workers=1, threads=True, **goals)
    return "\n".join(["\nhospital:", estimate_table(found).text, *found.notes])


def main() -> None:
    """Make the tables, repeat the estimates, and print the lines."""
    options = parser(__doc__)
    options.add_argument("--folder", type=Path, help="where the tables of runs are kept")
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.folder or Path(scratch)
        scene = added()
        print("| statistic | population | target | correlation | exact runs | times faster | coverage | of plain |")
        print("|---|---|---|---|---|---|---|---|", flush=True)
        populations = {}
        for name, count in zip(MEDIANS, COUNTS, strict=True):
            populations[name] = table(folder / f"{name}.npz", SEEDS[name], count, LEVELS, MEDIANS[name])
        inside = populations["design"]["exact"][:, 2] < 1  # no rim is met
        populations["within"] = {level: rows[inside] for level, rows in populations["design"].items()}
        populations["law"] = law({level: float(rows[:, 3].mean()) for level, rows in populations["design"].items()})
        for case in CASES:
            print(line_of(case, populations[case.population], scene), flush=True)
        for name, rows in populations.items():
            costs = ", ".join(f"{level} {1e3 * (each[:, 3].mean() + scene):.3g} ms" for level, each in rows.items())
            early = 100 * float((rows["exact"][:, 4] == 0).mean())
            print(f"\n{name}: {costs}; {early:.1f} % of exact runs ended early")
        print(hospital(folder / "hospital"))


if __name__ == "__main__":
    main()
