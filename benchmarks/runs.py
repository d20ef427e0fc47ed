"""Compare whole runs with other methods and programs: `python benchmarks/runs.py`, one table of docs/performance.md.

Effects are fixed: spatial, spin locked, sliders with inertia, rims. Times are CPU seconds of one core, the best of several
runs. Errors are relative to reference runs that are not timed; the difference of two references shows their accuracy. The
explicit reference of the record takes minutes: `--all` computes it.
"""

from __future__ import annotations

import time
from dataclasses import replace
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from plain import plain_scene
from quick import installed, parser, pick

from msfp_gen import Effects, Scene, simulate
from msfp_gen.results.result import Result
from msfp_gen.studies.accuracy.series import run_opensees

Array = NDArray[np.float64]
FULL = Effects()
REPEATS = pick(7, 1)


def fixed(name: str, effects: Effects = FULL) -> Scene:
    """A preset scene with given effects."""
    scene = replace(plain_scene(name), effects=effects)
    return pick(scene, replace(scene, duration=0.05 * scene.end))


def solved(scene: Scene, method: str, rtol: float, step: float | None = None) -> Result:
    """A run with one method and tolerance; `step` [s] between rows."""
    return simulate(replace(scene, solver=replace(scene.solver, method=method, rtol=rtol), output_step=step))


def cpu(scene: Scene, method: str, rtol: float, repeats: int = REPEATS) -> float:
    """CPU time of the integration with rows at the solver's own steps [s], the fastest of several runs."""
    return min(solved(scene, method, rtol).counters.wall_time for _ in range(repeats))


def difference(a: Array, b: Array) -> tuple[float, float]:
    """RMS and largest difference of two forces (T, 3) relative to the peak of the second."""
    rows = min(len(a), len(b))
    distance = np.linalg.norm(a[:rows] - b[:rows], axis=1)
    peak = np.linalg.norm(b[:rows], axis=1).max()
    return float(np.sqrt(np.mean(distance**2)) / peak), float(distance.max() / peak)


def cheapest(
    scene: Scene,
    method: str,
    tolerances: tuple[float, ...],
    limit: float,
    reference: Array,
    step: float,
    kind: int,
    columns: slice,
) -> tuple[float, float, Result]:
    """The loosest tolerance whose force is within `limit` of the reference, that error, and the run.

    kind: 0 for the RMS error, 1 for the largest. columns: components of the force that are compared.
    """
    for rtol in tolerances:
        run = solved(scene, method, rtol, step)
        error = difference(run.history.top_force[:, columns], reference[:, columns])[kind]
        if error < limit:
            return rtol, error, run
    raise SystemExit(f"{method} meets {limit} at none of {tolerances}")


def row(what: str, ours: str, theirs: str, ratio: str) -> None:
    """Print one row of the table."""
    print(f"| {what} | {ours} | {theirs} | {ratio} |", flush=True)


def against_dopri5() -> None:
    """fenz-test2: the method of PEER 2017/07, dopri5 with Newton on all unknowns."""
    scene, step, along = fixed("fenz-test2"), 0.05, slice(0, 1)
    reference = solved(scene, "implicit", 1e-7, step).history.top_force
    rtol, error, _ = cheapest(scene, "implicit", (1e-3, 3e-4, 1e-4, 3e-5, 1e-5), 1e-3, reference, step, 1, along)
    theirs, their_error, run = cheapest(
        scene, "dopri5", (1e-2, 1e-3, 1e-4, 1e-5, 1e-6), 1e-3, reference, step, 1, along
    )
    check = difference(run.history.top_force[:, along], reference[:, along])[1]
    ours, seconds = cpu(scene, "implicit", rtol), run.counters.wall_time
    row(
        "`fenz-test2`, largest force error under 1e-3 of the peak: the method of PEER 2017/07",
        f"{1e3 * ours:.2f} ms at {rtol:g}, error {error:.1e}",
        f"`dopri5` {seconds:.1f} s at {theirs:g}, {run.counters.steps:,} steps, error {their_error:.1e}; "
        f"the references differ by {check:.1e}",
        f"{seconds / ours:,.0f} times faster",
    )


def against_opensees() -> None:
    """becker-eight-125: TripleFrictionPendulum of OpenSees; errors are relative to a tight run of each program.

    At 1e-6 that of msfp-gen filters the ringing of its sliders, which OpenSees does not have.
    """
    scene = fixed("becker-eight-125")
    flat = slice(0, 2)
    step = scene.end / 2000
    reference = solved(scene, "implicit", 1e-6, step).history.top_force
    rtol, error, _ = cheapest(scene, "implicit", (1e-2, 3e-3, 1e-3, 3e-4, 1e-4), 2e-3, reference, step, 0, flat)
    ours = cpu(scene, "implicit", rtol)
    what = (
        "`becker-eight-125`, RMS force error under 2e-3 of the peak, each against its own run without ringing: OpenSees"
    )
    text = f"{1e3 * ours:.2f} ms at {rtol:g}, error {error:.1e}"
    if not installed("openseespy.opensees", what):
        return
    limit = run_opensees(scene, pick(64_000, 16_000)).histories["force"][:, 0]
    for steps in (500, 1000, 1500, 2000, 3000, 4000, 8000, 16_000):
        begin = time.process_time()
        force = run_opensees(scene, steps).histories["force"][:, 0]
        seconds = time.process_time() - begin
        theirs = difference(force, limit)[0]
        if theirs < 2e-3:
            seconds = min([seconds, *(opensees_seconds(scene, steps) for _ in range(REPEATS // 2))])
            other = f"`TripleFrictionPendulum` {1e3 * seconds:.1f} ms in {steps} steps, error {theirs:.1e}"
            row(what, text, other, f"{seconds / ours:.0f} times faster")
            return
    row(what, text, "not within 2e-3 in 16,000 steps", "-")


def opensees_seconds(scene: Scene, steps: int) -> float:
    """CPU time of one run by OpenSees [s]."""
    begin = time.process_time()
    run_opensees(scene, steps)
    return time.process_time() - begin


def against_real_time(explicit: bool) -> None:
    """ridgecrest-clc: real time. References are without the undamped ringing of sliders and, with `explicit`, with it."""
    scene, step = fixed("ridgecrest-clc"), 0.005
    filtered = solved(
        fixed("ridgecrest-clc", replace(FULL, sliders="massless")), "implicit", 1e-5, step
    ).history.top_force
    rtol, error, run = cheapest(scene, "implicit", (3e-2, 1e-2, 3e-3, 1e-3, 3e-4), 5e-3, filtered, step, 0, slice(0, 3))
    ours, text = cpu(scene, "implicit", rtol), ""
    if explicit:
        ringing = solved(scene, "dopri5", 1e-6, step).history.top_force
        text = f"; {difference(run.history.top_force, ringing)[0]:.1e} against `dopri5`, which resolves the ringing"
    row(
        "`ridgecrest-clc`, RMS force error under 5e-3 of the peak: real time",
        f"{1e3 * ours:.1f} ms at {rtol:g}, error {error:.1e} against the model without ringing{text}",
        f"{scene.end:.0f} s",
        f"{scene.end / ours:,.0f} times faster",
    )


def planar() -> None:
    """fenz-test2: time saved by a planar model without inertia of the sliders."""
    small = replace(FULL, dimension="planar", sliders="massless", rims=False)
    full, light = (cpu(fixed("fenz-test2", effects), "implicit", 1e-4, 2 * REPEATS + 1) for effects in (FULL, small))
    row(
        "`fenz-test2` at 1e-4: planar without masses, and spatial with them",
        f"{1e3 * light:.2f} ms",
        f"{1e3 * full:.2f} ms",
        f"{full / light:.1f} times faster",
    )


def main() -> None:
    """Print one row per comparison."""
    options = parser(__doc__)
    options.add_argument("--all", action="store_true", help="with the explicit reference of the record, some minutes")
    chosen = options.parse_args()
    print("| what is compared | msfp-gen | the other | ratio |\n|---|---|---|---|")
    with patch("time.perf_counter", time.process_time):  # runs then measure CPU time
        against_real_time(chosen.all)
        planar()
        against_opensees()
        against_dopri5()


if __name__ == "__main__":
    main()
