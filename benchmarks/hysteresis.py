"""Hysteresis laws and contact damping: prints the tables of docs/friction.md.

`python benchmarks/hysteresis.py`: about two minutes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from plain import plain_scene
from quick import parser, pick

from msfp_gen import (
    Bearing,
    Body,
    Effects,
    InitialState,
    Layout,
    Motion,
    Result,
    Scene,
    Solver,
    Surface,
    Top,
    simulate,
)

LAWS = ("report", "isotropic", "plastic")
TIMES = (0.0, 1e-5, 1e-4, 1e-3)
ALL_SCENES = {
    "fenz-test2": "cycles",
    "fenz-test5": "cycles, both rims",
    "becker-circle-50": "a circle",
    "ridgecrest-clc": "an earthquake",
}
SCENES = pick(ALL_SCENES, {"fenz-test2": "cycles"})


def scene_of(name: str, law: str, T: float) -> Scene:
    """A preset scene with a hysteresis law and a damping time [s]."""
    scene = plain_scene(name)
    bearing, effects = scene.bearing.replace(contact_damping=T), replace(scene.effects, bouc_wen=law)
    return replace(scene, bearing=bearing, effects=effects, output_step=0.005)


def run_of(scene: Scene, rtol: float, method: str = "implicit") -> Result:
    """A run at a tolerance."""
    return simulate(replace(scene, solver=replace(scene.solver, rtol=rtol, method=method)))


def horizontal(result: Result) -> np.ndarray:
    """Horizontal force on the top, ndarray, shape (T, 2), [N]."""
    return result.history.top_force[:, :2]


def distance(one: Result, other: Result) -> float:
    """RMS of the difference of two forces over the largest of the second."""
    a, b = horizontal(one), horizontal(other)
    return float(np.sqrt(np.mean(np.sum((a - b) ** 2, axis=1))) / np.linalg.norm(b, axis=1).max())


def convergence() -> Iterator[str]:
    """What a tighter tolerance gains, and what it costs."""
    yield "| scene | law | T [ms] | rtol 1e-3 | 1e-4 | 1e-5 | steps at 1e-4 | steps of the reference |"
    yield "|---|---|---|---|---|---|---|---|"
    for name in SCENES:
        for law in LAWS if name == "becker-circle-50" else ("report", "plastic"):
            for T in TIMES:
                scene = scene_of(name, law, T)
                tight = run_of(scene, 1e-6, "esdirk4")
                runs = [run_of(scene, rtol) for rtol in (1e-3, 1e-4, 1e-5)]
                errors = " | ".join(f"{100 * distance(run, tight):.3f} %" for run in runs)
                steps = f"{runs[1].counters.steps:,} | {tight.counters.steps:,}"
                yield f"| {name} | {law} | {1e3 * T:g} | {errors} | {steps} |"


def differences() -> Iterator[str]:
    """What law and damping change, against the law of PEER 2017/07 without damping, all at 1e-5."""
    yield "| scene | law | T [ms] | force, RMS | peak force | peak displacement | displacement at the end |"
    yield "|---|---|---|---|---|---|---|"
    for name, kind in SCENES.items():
        base = run_of(scene_of(name, "report", 1e-5), 1e-5)
        peak, most = np.linalg.norm(horizontal(base), axis=1).max(), across(base).max()
        yield f"| {name}: {kind} | report | 0.01 | - | {peak / 1e3:.2f} kN | {1e3 * most:.2f} mm | {1e3 * across(base)[-1]:.2f} mm |"
        for law in LAWS:
            for T in TIMES[2:]:
                run = run_of(scene_of(name, law, T), 1e-5)
                force = np.linalg.norm(horizontal(run), axis=1).max()
                change = [f"{100 * (force / peak - 1):+.2f} %", f"{100 * (across(run).max() / most - 1):+.2f} %"]
                end = f"{1e3 * across(run)[-1]:.2f} mm"
                yield f"| | {law} | {1e3 * T:g} | {100 * distance(run, base):.2f} % | {' | '.join(change)} | {end} |"


def across(result: Result) -> np.ndarray:
    """Horizontal displacement across the bearing, ndarray, shape (T,), [m]."""
    return np.linalg.norm(result.history.displacement[:, :2], axis=1)


def creep() -> Iterator[str]:
    """A single pendulum at rest 80 mm off its centre, shaken with 0.02 g at 1 Hz for a minute."""
    yield "| law | yield displacement [mm] | offset after a minute [mm] |\n|---|---|---|"
    radius, height, friction = 2.2, 0.1, 0.06
    angle = float(np.arcsin(0.08 / radius))
    held = float(np.tan(angle) / friction * (radius - height) / radius)
    state = InitialState(q=((0.0, angle, 0.0),), v=((0.0, 0.0, 0.0),), h=((held, 0.0),))
    motion = Motion.harmonic(0.02 * 9.81 / (2 * np.pi) ** 2, 1.0, cycles=pick(50, 2), lead_in=10.0)
    for law in LAWS:
        for d_y in (5e-4, 1e-4):
            surface = Surface(radius, 0.5, friction, d_y, contact_damping=1e-4)
            bearing = Bearing(Layout(2, 1, 0), height, [surface], [Body(0.1, 0.05, 200.0, (1.0, 2.0))])
            effects, top = Effects(bouc_wen=law, rims=False), Top.mass(1e5, 1.0, 0.0)
            result = simulate(Scene(bearing, motion, top, effects=effects, solver=Solver(), initial_state=state))
            yield f"| {law} | {1e3 * d_y:g} | {1e3 * result.history.sliding[-1, 0]:.2f} |"


def main() -> None:
    """Print the tables."""
    parser(__doc__).parse_args()
    for table in (creep, convergence, differences):
        for line in table():
            print(line, flush=True)
        print()


if __name__ == "__main__":
    main()
