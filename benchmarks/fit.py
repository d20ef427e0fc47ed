"""How often 95 % intervals of a fit contain the true values, and its time against a fit by finite differences.

Synthetic tests of a triple and a double pendulum at three amplitudes. Those of the first table are random, by runs at
a tight tolerance; the others are of the triple pendulum of PEER 2017/07, with noise of 1 % of the peak.
Usage: python benchmarks/fit.py [NUMBER OF FITS]; half an hour for 100, a minute for 1; prints tables of docs/properties.md.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from quick import parser, pick
from scipy.stats import t

from msfp_gen import Measurement, Motion, Scene, fit, load_scene, simulate
from msfp_gen.common.arrays import Array
from msfp_gen.studies.calibration.fitting import least_squares, search_range, solve, start_fit
from msfp_gen.studies.calibration.residuals import Residuals, scene_at, unknowns_of

AMPLITUDES = (0.02, 0.06, 0.12)  # [m]
ROWS, NOISE, OFFSET = 200, 0.01, 0.01  # noise and deviation of the offsets over the peak of all tests
PATHS = ("friction[0]", "friction[1]=friction[2]", "friction[3]")
FITS = pick(100, 2)
SEEDS = pick(3, 1)  # sets of tests of the table of times
STEP = 0.01  # relative, of finite differences
SETS = (
    PATHS[:1],
    PATHS,
    (*PATHS, "radius[0]", "radius[1]=radius[2]", "radius[3]"),
    (*PATHS, "radius[0]", "radius[1]=radius[2]", "radius[3]",
     "capacity[0]", "yield_displacement[0]=yield_displacement[3]"),
)  # fmt: skip


def rig() -> Scene:
    """The triple pendulum with damped contacts."""
    scene = load_scene("fenz-test2")
    return replace(scene, bearing=scene.bearing.replace(contact_damping=1e-4))


def clean_tests(scene: Scene, amplitudes: Sequence[float] = AMPLITUDES) -> list[Measurement]:
    """One cycle at each amplitude, without noise."""
    tests = []
    for amplitude in amplitudes:
        motion = Motion.harmonic(amplitude, 0.1, cycles=1.0)
        step = motion.duration / (ROWS - 1)
        run = simulate(replace(scene, motion=motion, motion_table=None, duration=None, output_step=step)).history
        at = np.linspace(0, motion.duration, ROWS)
        force = np.interp(at, run.time, run.top_force[:, 0])
        tests.append(Measurement(f"{1e3 * amplitude:g} mm", at, motion.evaluate(at)[:, 0], force))
    return tests


def noisy(tests: list[Measurement], seed: int) -> tuple[list[Measurement], list[float]]:
    """The tests with noise and offsets, and the offsets [N]."""
    peak, rng = max(float(np.abs(test.force).max()) for test in tests), np.random.default_rng(seed)
    offsets = (OFFSET * peak * rng.standard_normal(len(tests))).tolist()
    made = [
        replace(test, force=test.force + offset + NOISE * peak * rng.standard_normal(ROWS))
        for test, offset in zip(tests, offsets, strict=True)
    ]
    return made, offsets


def double() -> Scene:
    """A double pendulum with damped contacts on its rig."""
    scene = load_scene("double-push")
    return replace(scene, bearing=scene.bearing.replace(contact_damping=1e-4), stop=None)


# Scene, unknowns, and sets from each of which one amplitude is drawn [m].
DEVICES: dict[str, tuple[Scene, tuple[str, ...], tuple[tuple[float, ...], ...]]] = {
    "triple": (rig(), PATHS, ((0.02, 0.03), (0.05, 0.06, 0.08), (0.10, 0.12, 0.14))),
    "double": (double(), ("friction[0]=friction[1]", "radius[0]=radius[1]"), ((0.05, 0.1), (0.15, 0.2), (0.25, 0.3))),
}
CORRELATION = 0.57  # of consecutive values of the correlated noise
TRUTH_RTOL = 1e-9  # of the runs that make the tests
LEVELS = (0.002, 0.01)  # standard deviation of the noise over the peak of each test


def noise(correlation: float, rng: np.random.Generator) -> Array:
    """Unit noise of one test, an autoregression of order one in its stationary state."""
    values = rng.standard_normal(ROWS)
    for i in range(1, ROWS):
        values[i] = correlation * values[i - 1] + np.sqrt(1 - correlation**2) * values[i]
    return values


def changed(scene: Scene, paths: Sequence[str], factors: Array) -> Scene:
    """The scene with the values at some paths times factors."""
    unknowns = unknowns_of(scene, paths)
    return scene_at(scene, unknowns, np.array([u.start for u in unknowns]) * factors)


def coverage(count: int) -> None:
    """Share of the intervals that contain the true value, over random bearings, amplitudes, starts and noise.

    The search alone has the intervals of independent noise, of runs at the tolerance of the scene.
    """
    print("| bearing | noise [% of the peak] | correlation | all intervals | of the worst value | of the search alone | "
          "CPU time over that of the search | wider by the runs |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|")
    for name, (scene, paths, amplitudes) in DEVICES.items():
        rows: dict[tuple[float, float], list[Covered]] = {}
        for seed in range(count):
            rng = np.random.default_rng(seed)
            true = changed(scene, paths, rng.uniform(0.8, 1.25, len(paths)))
            exact = replace(true, solver=replace(scene.solver, rtol=TRUTH_RTOL))
            clean = clean_tests(exact, [float(rng.choice(each)) for each in amplitudes])
            start = changed(true, paths, rng.uniform(0.75, 1.33, len(paths)))
            peaks = [float(np.abs(test.force).max()) for test in clean]
            offsets = [OFFSET * peak * rng.standard_normal() for peak in peaks]
            truth = np.array([*(u.start for u in unknowns_of(true, paths)), *offsets])
            for case in itertools.product(LEVELS, (0.0, CORRELATION)):
                errors = [o + case[0] * p * noise(case[1], rng) for p, o in zip(peaks, offsets, strict=True)]
                tests = [replace(test, force=test.force + error) for test, error in zip(clean, errors, strict=True)]
                rows.setdefault(case, []).append(covered(start, tests, paths, truth))
        for (level, correlation), found in rows.items():
            hits = np.array([each.hits for each in found])
            alone = np.mean([each.alone for each in found])
            ratio = sum(each.whole for each in found) / sum(each.search for each in found)
            print(f"| {name} | {100 * level:g} | {correlation:g} | {100 * np.nanmean(hits):.1f} % | "
                  f"{100 * np.nanmean(hits, axis=0).min():.0f} % | {100 * alone:.0f} % | {ratio:.1f} | "
                  f"{100 * np.mean([each.wider for each in found]):.2g} % |", flush=True)  # fmt: skip
    print()


class Covered(NamedTuple):
    """Of one fit: which intervals contain the true value, NaN without an interval; the same of the search alone.

    whole, search: CPU times. wider: by the error of the runs, the mean of all intervals.
    """

    hits: Array
    alone: Array
    whole: float
    search: float
    wider: float


def covered(start: Scene, tests: list[Measurement], paths: Sequence[str], truth: Array) -> Covered:
    """A fit, and its search alone."""
    prepared, clock = start_fit(start, tests, paths, offset=True), time.process_time()
    x, end = least_squares(prepared, *search_range(prepared), 100)
    search, clock = time.process_time() - clock, time.process_time()
    found = fit(start, tests, paths, offset=True).estimates
    whole = time.process_time() - clock
    low, high, error = np.array([(e.low, e.high, e.run_error) for e in found]).T
    hits = np.where(np.isfinite(high), (low <= truth) & (truth <= high), np.nan)
    deviation = np.sqrt(np.diag(np.linalg.inv(end.jacobian.T @ end.jacobian)) * end.variance)
    alone = np.abs(x - truth / prepared.scale) <= t.ppf(0.975, len(end.residuals) - len(x)) * deviation
    return Covered(hits, alone, whole, search, float(np.mean(error / ((high - low) / 2 - error))))


def bias(scene: Scene) -> None:
    """Errors of values fitted to exact tests, which have no noise, and half widths of their intervals."""
    truth = [scene.bearing.surfaces[i].friction for i in (0, 1, 3)]
    exact = clean_tests(replace(scene, solver=replace(scene.solver, rtol=TRUTH_RTOL)))
    begin = (scene.bearing.arrays()["friction"] * [1.3, 0.8, 0.8, 1.2]).tolist()
    start = replace(scene, bearing=scene.bearing.replace(friction=begin))
    print("| `solver.rtol` | rtol of the last runs | friction, surface 1 | surfaces 2 and 3 | surface 4 |")
    print("|---|---|---|---|---|")
    for rtol in pick((1e-4, 1e-5, 1e-6), (1e-4,)):
        found = fit(replace(start, solver=replace(start.solver, rtol=rtol)), exact, PATHS)
        errors = [100 * abs(e.value / value - 1) for e, value in zip(found.estimates, truth, strict=True)]
        halves = [50 * (e.high - e.low) / e.value for e in found.estimates]
        cells = [f"{error:.2g} of {half:.2g} %" for error, half in zip(errors, halves, strict=True)]
        print(f"| {rtol:g} | {found.rtol:g} | {' | '.join(cells)} |")
    print()


class Differences(Residuals):
    """The same residuals, with a Jacobian by finite differences of relative step 0.01 (docs/properties.md)."""

    central, runs = False, 0

    def _run(
        self, index: int, values: Array, slopes: bool, show: Callable[[float, float], None]
    ) -> tuple[Array, Array]:
        test, columns = self.tests[index], []

        def force(at: Array) -> Array:
            run = simulate(scene_at(self.scenes[index], self.unknowns, at), progress=show).history
            self.runs += index == 0
            return np.asarray(np.interp(test.time - test.time[0], run.time, run.top_force[:, 0]))

        middle = force(values)
        if not slopes:
            return middle, np.zeros((len(middle), 0))
        for number, value in enumerate(values):
            step = STEP * value * np.eye(len(values))[number]
            ahead = force(values + step)
            slope = (ahead - force(values - step)) / 2 if self.central else ahead - middle
            columns.append(slope / (STEP * value))
        return middle, np.column_stack(columns)


def cost(scene: Scene, seeds: int) -> None:
    """CPU time of fits with exact Jacobians, and by finite differences with the same treatment, in turn.

    Means of three sets of tests, which differ in their noise. The differences are those of the values at the end.
    """
    clean = clean_tests(scene)
    begin = (scene.bearing.arrays()["friction"] * [1.3, 0.8, 0.8, 1.2]).tolist()
    start = replace(scene, bearing=scene.bearing.replace(friction=begin))
    print(
        "| values | Jacobian | evaluations | runs of each test | CPU time | largest difference of a value [standard errors] |"
    )
    print("|---|---|---|---|---|---|")
    for paths in pick(SETS, SETS[:1]):
        totals = {name: np.zeros(4) for name in ("exact", "forward", "central")}
        for seed in range(seeds):
            made, best = noisy(clean, seed)[0], None
            for name, total in totals.items():
                prepared = start_fit(start, made, paths)
                kind = Residuals if name == "exact" else Differences
                tried = kind(prepared.tests, prepared.scenes, prepared.unknowns, False)
                tried.central = name == "central"
                clock = time.process_time()
                found = solve(tried, *search_range(tried), 100)
                taken = time.process_time() - clock
                best = found if best is None else best
                gap = (np.abs(found.x - best.x) / best.spread.deviation).max()
                total += (tried.count, getattr(tried, "runs", tried.count), taken, gap)
        for name, total in totals.items():
            count, runs, taken, gap = total / seeds
            ratio = taken * seeds / totals["exact"][2]
            apart = "-" if name == "exact" else f"{gap:.1g}"
            print(f"| {len(paths)} | {name} | {count:.1f} | {runs:.0f} | {ratio:.1f} | {apart} |", flush=True)
    print()


if __name__ == "__main__":
    options = parser(__doc__)
    options.add_argument("fits", nargs="?", type=int, default=FITS, help="number of fits of each row of coverage")
    number, bearing = options.parse_args().fits, rig()
    coverage(number)
    bias(bearing)
    cost(bearing, min(SEEDS, number))
