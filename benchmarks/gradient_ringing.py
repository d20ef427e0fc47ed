"""Gradients after rim contacts by tolerance and contact damping: `python benchmarks/gradient_ringing.py`, a minute.

The triple pendulum of PEER 2017/07 under one cycle of 120 mm, sampled at 200 times. A table of docs/gradients.md; with
`--small`, two minutes, the derivative of a tilt while sliders ring, beside differences of runs with short steps.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from quick import parser, pick

from msfp_gen import Motion, Scene, load_scene, simulate

TOLERANCES = pick((1e-4, 1e-5, 1e-6, 1e-7, 1e-8), (1e-4,))
DAMPING = pick((1e-4, 1e-3), (1e-4,))  # contact damping [s]
FRICTION = (0.039, 0.0136, 0.0136, 0.107)
PARAMETER = "bearing.surfaces[0].friction"
WINDOWS = ((7.0, 7.4), (7.85, 8.1))  # [s]: after the second contact, and after the reversal that follows


def sampled(damping: float) -> Scene:
    """The scene with a contact damping [s]."""
    cycle = Motion.harmonic(0.12, 0.1, cycles=1.0)
    time = np.linspace(0.0, cycle.duration, 200)
    scene = load_scene("fenz-test2")
    bearing = scene.bearing.replace(contact_damping=damping, friction=list(FRICTION))
    motion = Motion.from_arrays(time, cycle.evaluate(time)[:, :3])
    return replace(scene, bearing=bearing, motion=motion, motion_table=None, stop=None, duration=8.2, output_step=1e-3)


def means(damping: float, rtol: float) -> list[float]:
    """Mean derivative of the force with respect to the friction of surface 1 in each window [kN]."""
    scene = sampled(damping)
    scene = replace(scene, solver=replace(scene.solver, rtol=rtol))
    result = simulate(scene, gradients=[PARAMETER], gradient_errors=False)
    at, force = result.history.time, result.gradient.top_force.values[0, :, 0]
    return [1e-3 * float(force[(at > first) & (at < last)].mean()) for first, last in WINDOWS]


def small_changes() -> None:
    """Print the derivative of the tilt of body 3 at 6.799 s [rad], and differences by the relative change."""
    scene = sampled(DAMPING[0])
    solver = replace(scene.solver, rtol=1e-10, method="esdirk4", max_step=1.5e-5)
    scene, row = replace(scene, solver=solver, duration=6.8), 6799
    result = simulate(scene, gradients=[PARAMETER], gradient_errors=False)
    print(f"gradient: {result.gradient.tilt.values[0, row, 2, 1]:.3f}", flush=True)
    for change in (1e-6, 1e-5):
        tilts = []
        for sign in (1, -1):
            first = FRICTION[0] * (1 + sign * change)
            bearing = scene.bearing.replace(friction=[first, *FRICTION[1:]])
            tilts.append(simulate(replace(scene, bearing=bearing)).dataset.tilt.values[row, 2, 1])
        print(f"change of {change:g}: {(tilts[0] - tilts[1]) / (2 * change * FRICTION[0]):.3f}", flush=True)


def main() -> None:
    """Print one row per tolerance, or the derivatives while sliders ring."""
    options = parser(__doc__)
    options.add_argument("--small", action="store_true", help="derivatives beside differences of tiny changes")
    if options.parse_args().small:
        small_changes()
        return
    for rtol in TOLERANCES:
        cells = [f"{value:.1f}" for damping in DAMPING for value in means(damping, rtol)]
        print(f"| {rtol:g} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
