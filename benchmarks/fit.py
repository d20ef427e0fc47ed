"""How often 95 % intervals of a fit contain the true values, and its time against a fit by finite differences.

Synthetic tests of the triple pendulum of PEER 2017/07 at three amplitudes, with noise of 1 % of the peak and an offset.
Usage: python benchmarks/fit.py [NUMBER OF FITS]; five minutes; prints tables of docs/fit.md.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from quick import parser, pick

from msfp_gen import Measurement, Motion, Scene, fit, load_scene, simulate
from msfp_gen.common.arrays import Array
from msfp_gen.studies.calibration.fitting import search_range, start_fit
from msfp_gen.studies.calibration.residuals import Residuals
from msfp_gen.studies.calibration.search import least_squares
from msfp_gen.studies.calibration.unknowns import changed_scene

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


def clean_tests(scene: Scene) -> list[Measurement]:
    """One cycle at each amplitude, without noise."""
    tests = []
    for amplitude in AMPLITUDES:
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


def coverage(scene: Scene, count: int) -> None:
    """Share of the intervals that contain the true value."""
    tests, hits = clean_tests(scene), []
    truth = [scene.bearing.surfaces[i].friction for i in (0, 1, 3)]
    for seed in range(count):
        made, offsets = noisy(tests, seed)
        factors = np.random.default_rng(1000 + seed).uniform(0.7, 1.4, 3)[[0, 1, 1, 2]]
        begin = scene.bearing.arrays()["friction"] * factors
        found = fit(replace(scene, bearing=scene.bearing.replace(friction=begin.tolist())), made, PATHS, offset=True)
        pairs = zip(found.estimates, [*truth, *offsets], strict=True)
        hits.append([estimate.low <= value <= estimate.high for estimate, value in pairs])
    print("| value | intervals that contain it |\n|---|---|")
    names = ("friction, surface 1", "friction, surfaces 2 and 3", "friction, surface 4")
    for name, share in zip(names, np.mean(hits, axis=0)[:3], strict=True):
        print(f"| {name} | {100 * share:.0f} % |")
    print(f"| offsets of three tests | {100 * np.mean(np.array(hits)[:, 3:]):.0f} % |")
    print(f"| all, in {count} fits | {100 * np.mean(hits):.1f} % |\n")


def bias(scene: Scene) -> None:
    """Errors of values fitted to exact tests, by the tolerance of the runs of the fit."""
    truth = [scene.bearing.surfaces[i].friction for i in (0, 1, 3)]
    exact = clean_tests(replace(scene, solver=replace(scene.solver, rtol=1e-7)))
    begin = (scene.bearing.arrays()["friction"] * [1.3, 0.8, 0.8, 1.2]).tolist()
    start = replace(scene, bearing=scene.bearing.replace(friction=begin))
    print("| `solver.rtol` | error of friction, surface 1 | surfaces 2 and 3 | surface 4 |\n|---|---|---|---|")
    for rtol in pick((1e-4, 1e-5, 1e-6), (1e-4,)):
        found = fit(replace(start, solver=replace(start.solver, rtol=rtol)), exact, PATHS)
        errors = [abs(e.value / value - 1) for e, value in zip(found.estimates, truth, strict=True)]
        print(f"| {rtol:g} | {' | '.join(f'{100 * error:.2g} %' for error in errors)} |")
    print()


class Differences(Residuals):
    """The same residuals, with a Jacobian by finite differences of relative step 0.01 (docs/calibration.md)."""

    central, runs = False, 0

    def _run(self, index: int, values: Array, show: Callable[[float, float], None]) -> tuple[Array, Array]:
        test, slopes = self.tests[index], []

        def force(at: Array) -> Array:
            run = simulate(changed_scene(self.scenes[index], self.unknowns, at), progress=show).history
            self.runs += index == 0
            return np.asarray(np.interp(test.time - test.time[0], run.time, run.top_force[:, 0]))

        middle = force(values)
        for number, value in enumerate(values):
            step = STEP * value * np.eye(len(values))[number]
            ahead = force(values + step)
            slope = (ahead - force(values - step)) / 2 if self.central else ahead - middle
            slopes.append(slope / (STEP * value))
        return middle, np.column_stack(slopes)


def cost(scene: Scene) -> None:
    """CPU time of fits with exact Jacobians, and by finite differences with the same search, in turn.

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
        for seed in range(SEEDS):
            made, best, end = noisy(clean, seed)[0], None, None
            for name, total in totals.items():
                prepared = start_fit(start, made, paths)
                kind = Residuals if name == "exact" else Differences
                tried = kind(prepared.tests, prepared.scenes, prepared.unknowns, False)
                tried.central = name == "central"
                clock = time.process_time()
                x, at = least_squares(tried, *search_range(tried), 100)
                taken = time.process_time() - clock
                best, end = (x, at) if best is None else (best, end)
                deviation = np.sqrt(np.diag(np.linalg.inv(end.jacobian.T @ end.jacobian)) * end.variance)
                total += (tried.count, getattr(tried, "runs", tried.count), taken, (np.abs(x - best) / deviation).max())
        for name, total in totals.items():
            count, runs, taken, gap = total / SEEDS
            ratio = taken * SEEDS / totals["exact"][2]
            apart = "-" if name == "exact" else f"{gap:.1g}"
            print(f"| {len(best)} | {name} | {count:.1f} | {runs:.0f} | {ratio:.1f} | {apart} |", flush=True)
    print()


if __name__ == "__main__":
    options = parser(__doc__)
    options.add_argument("fits", nargs="?", type=int, default=FITS, help="number of fits of the first table")
    number = options.parse_args().fits
    bearing = rig()
    coverage(bearing, number)
    bias(bearing)
    cost(bearing)
