"""How often 95 % intervals of a fit contain the true values, and its time against a fit by finite differences.

Synthetic tests of the triple pendulum of PEER 2017/07 at three amplitudes, with noise of 1 % of the peak and an offset.
Usage: python benchmarks/fit.py [NUMBER OF FITS]; three minutes; prints the tables of docs/fit.md.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from msfp_gen import Measurement, Motion, Scene, fit, load_scene, simulate
from msfp_gen.studies.calibration.fitting import start_fit
from msfp_gen.studies.calibration.search import TOLERANCE
from msfp_gen.studies.calibration.unknowns import changed_scene

AMPLITUDES = (0.02, 0.06, 0.12)  # [m]
ROWS, NOISE, OFFSET = 200, 0.01, 0.01  # noise and deviation of the offsets over the peak of all tests
PATHS = ("friction[0]", "friction[1]=friction[2]", "friction[3]")
FITS = 100


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
    for rtol in (1e-4, 1e-5, 1e-6):
        found = fit(replace(start, solver=replace(start.solver, rtol=rtol)), exact, PATHS)
        errors = [abs(e.value / value - 1) for e, value in zip(found.estimates, truth, strict=True)]
        print(f"| {rtol:g} | {' | '.join(f'{100 * error:.2g} %' for error in errors)} |")
    print()


def cost(scene: Scene) -> None:
    """Time of one fit with exact Jacobians, and by finite differences (docs/calibration.md), in one run."""
    made, _ = noisy(clean_tests(scene), 0)
    begin = (scene.bearing.arrays()["friction"] * [1.3, 0.8, 0.8, 1.2]).tolist()
    start = replace(scene, bearing=scene.bearing.replace(friction=begin))
    clock = time.perf_counter()
    exact = fit(start, made, PATHS)
    ours, prepared, runs = time.perf_counter() - clock, start_fit(start, made, PATHS), 0

    def residuals(x: np.ndarray) -> np.ndarray:
        nonlocal runs
        runs += 1
        rows = []
        for test, each in zip(prepared.tests, prepared.scenes, strict=True):
            run = simulate(changed_scene(each, prepared.unknowns, x * prepared.scale)).history
            rows.append((np.interp(test.time, run.time, run.top_force[:, 0]) - test.force) / prepared.largest)
        return np.concatenate(rows)

    bounds = tuple(np.array([getattr(u, side) / u.start for u in prepared.unknowns]) for side in ("low", "high"))
    clock = time.perf_counter()
    other = least_squares(
        residuals, np.ones(3), "3-point", bounds, ftol=TOLERANCE, xtol=TOLERANCE, gtol=None, diff_step=0.01
    )
    theirs = time.perf_counter() - clock
    gap = max(abs(e.value / value - 1) for e, value in zip(exact.estimates, other.x * prepared.scale, strict=True))
    print("| fit of three values to three tests | runs of each test | time |\n|---|---|---|")
    print(f"| exact Jacobian | {exact.evaluations} | 1 |")
    print(f"| central differences, step 0.01 | {runs} | {theirs / ours:.1f} |")
    print(f"\nLargest difference of the values: {100 * gap:.2g} %")


if __name__ == "__main__":
    bearing = rig()
    coverage(bearing, int(sys.argv[1]) if len(sys.argv) > 1 else FITS)
    bias(bearing)
    cost(bearing)
