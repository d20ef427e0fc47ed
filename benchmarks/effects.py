"""Cost of effects, and error of leaving them out: `python benchmarks/effects.py` prints the tables of docs/effects.md.

- The first table changes one effect of the full model at a time, on one scene.
- The second compares runs with all effects (with uplift only where bodies separate) with runs with selected effects:
  the time of both with rows at the solver's own steps, and the largest and the RMS difference of the top force over its
  peak, in rows at even times.
- The third compares full and selected effects at equal error.
- At the end the cost of a row at an even time, and the ratio of the full to the smallest model.

Runs are repeated in turns and the fastest counts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np
from plain import plain_scene
from quick import parser, pick

from msfp_gen import Auto, Effects, Load, Motion, Scene, Top, presets, simulate
from msfp_gen.generator import generate
from msfp_gen.results.result import Result
from msfp_gen.specification.friction_laws import HEAT_KERNEL
from msfp_gen.specification.layout import ModelSpec

SCENE, REPEATS = "fenz-test2", pick(15, 1)
FULL = Effects()
ALL = Effects(uplift=True)
SMALL = Effects(dimension="planar", sliders="massless")
VARIANTS: dict[str, Effects] = {
    "spatial, inertial, rims": FULL,
    "planar": Effects(dimension="planar"),
    "massless sliders": Effects(sliders="massless"),
    "no rims": Effects(rims=False),
    "isotropic friction": Effects(bouc_wen="isotropic"),
    "spin over a patch": Effects(spin="patch"),
    "free spin": Effects(spin="free"),
    "uplift": ALL,
    "friction of velocity": Effects(friction="velocity"),
    "friction of pressure and velocity": Effects(friction="pv"),
    "friction of pressure, velocity, temperature": Effects(friction="pvt"),
    "planar, massless, no rims": Effects(dimension="planar", sliders="massless", rims=False),
}


def with_effects(scene: Scene, effects: Effects) -> Scene:
    """The scene with other effects, and with the parameters that a friction law needs."""
    surfaces = scene.bearing.surfaces
    numbers = {
        "velocity": {"friction_slow": [surface.friction / 2 for surface in surfaces], "velocity_rate": 100.0},
        "pv": {"reference_pressure": 15e6},
        "pvt": {"reference_pressure": 15e6},
    }.get(effects.friction, {})
    return replace(scene, effects=effects, bearing=scene.bearing.replace(**numbers))


def fastest(scenes: list[Scene], repeats: int = REPEATS) -> list[Result]:
    """The fastest of several runs of each scene; the scenes are run in turns."""
    best: list[Result | None] = [None] * len(scenes)
    for _ in range(repeats):
        for index, scene in enumerate(scenes):
            result, known = simulate(scene), best[index]
            if known is None or result.counters.wall_time < known.counters.wall_time:
                best[index] = result
    return [result for result in best if result is not None]


def costs() -> None:
    """Print the cost of one effect at a time."""
    scene = plain_scene(SCENE)
    results = fastest([with_effects(scene, effects) for effects in VARIANTS.values()])
    first = results[0].counters
    print(f"Over `{SCENE}`, {first.wall_time * 1e3:.2f} ms, {first.steps} steps.\n")
    print("| model | unknowns | friction, heat | operations | steps | run | iteration |\n|" + "---|" * 7)
    for (name, effects), result in zip(VARIANTS.items(), results, strict=True):
        unknowns, states = sizes(scene, effects)
        counters = result.counters
        each = counters.wall_time / counters.newton_iterations * first.newton_iterations / first.wall_time
        operations = generate(ModelSpec(scene.bearing.layout, effects)).operations
        print(
            f"| {name} | {unknowns} | {states} | {operations} | {counters.steps} | "
            f"{counters.wall_time / first.wall_time:.2f} | {each:.2f} |"
        )


def sizes(scene: Scene, effects: Effects) -> tuple[int, int]:
    """Unknowns of a step, and local states of friction and heat, of all surfaces."""
    surfaces, planar = scene.bearing.layout.surfaces, effects.dimension == "planar"
    angles = 1 if planar else 2 if effects.spin == "locked" else 3
    separation = (2 if planar else 3) if effects.uplift else 0
    law = effects.law
    heat = len(HEAT_KERNEL) if law is not None and law.depends_on_temperature else 0
    local = (1 if planar else 2) + (law is not None) + heat
    return surfaces * (angles + separation), surfaces * local


def pairs() -> Iterator[tuple[str, Scene, Scene]]:
    """Name, scene with all effects, scene with selected effects."""
    for name in ("fenz-test1", "fenz-test2", "fenz-test3", "fenz-test4", "fenz-test5"):
        scene = replace(plain_scene(name), output_step=0.02)
        yield name, replace(scene, effects=FULL), replace(scene, effects=Auto())
    orbit = replace(plain_scene("becker-circle-50"), output_step=0.02)
    yield "becker-circle-50", replace(orbit, effects=FULL), replace(orbit, effects=Auto())
    strong = replace(plain_scene("ridgecrest-clc"), output_step=0.02)
    for share in (0.3, 1.0):
        record = replace(strong.motion, coefficients=share * strong.motion.coefficients)
        scene = replace(strong, motion=record, motion_table=None)
        yield f"ridgecrest-clc, {share:.0%}", replace(scene, effects=FULL), replace(scene, effects=Auto())
    yield "jerk that lifts a mass", *_lifted()


def _lifted() -> tuple[Scene, Scene]:
    weight = 11e3 * 9.80665
    load = Load.from_arrays([0, 1, 1.05, 1.15, 1.2, 4], np.outer([0, 0, 1, 1, 0, 0], [0.0, 0.0, 1.5 * weight]))
    top = Top.mass(11e3, 4e3, 0.3, rotational_stiffness=1e7, rotational_damping=1e4)
    still = Motion(np.array([0.0, 4.0]), np.zeros((1, 6, 6)))
    scene = Scene(presets.bearing("double-fp"), still, top, load=load, output_step=0.005, duration=1.5, effects=Auto())
    return replace(scene, effects=ALL), scene


def differences(one: Result, other: Result) -> tuple[float, float]:
    """Largest and RMS difference of the top force, over its peak."""
    difference = np.linalg.norm(one.history.top_force - other.history.top_force, axis=1)
    peak = np.linalg.norm(other.history.top_force[:, :2], axis=1).max() or np.abs(other.history.top_force).max()
    return float(difference.max() / peak), float(np.sqrt(np.mean(difference**2)) / peak)


def selection_table() -> None:
    """Print the comparison of all effects with selected effects."""
    print("\n| scene | modelled | everything [ms] | chosen [ms] | ratio | largest | RMS |\n|" + "---|" * 7)
    for name, everything, chosen in islice(pairs(), pick(None, 2)):
        largest, rms = differences(simulate(chosen), simulate(everything))
        full, fewer = fastest([replace(scene, output_step=None) for scene in (everything, chosen)], min(5, REPEATS))
        models = ", then ".join(_short(key) for key in fewer.provenance["model"].split(", then "))
        times = [result.counters.wall_time for result in (full, fewer)]
        print(
            f"| {name} | {models} | {times[0] * 1e3:.1f} | {times[1] * 1e3:.2f} | {times[0] / times[1]:.1f} | "
            f"{largest:.1%} | {rms:.2%} |",
            flush=True,
        )


def _short(key: str) -> str:
    words = key.split("-")
    return " ".join([*words[1:2], words[3], *(word for word in ("norims", "uplift") if word in words)])


def at_an_error(everything: Scene, chosen: Scene) -> None:
    """Print the cost of both at equal error: at the loosest tolerance with that error from their own converged run."""
    print("\n| largest error of force | everything | chosen | ratio |\n|" + "---|" * 4)
    tables = [list(errors(scene)) for scene in (everything, chosen)]
    for most in (1e-3, 5e-4, 1e-4, 5e-5):
        picks = [next((run for run in table if run[1] <= most), None) for table in tables]
        found = [pick for pick in picks if pick is not None]
        if len(found) == 2:
            words = [f"{time * 1e3:.2f} ms ({rtol:.0e}: {error:.1e})" for rtol, error, time in found]
            print(f"| {most:.0e} | {words[0]} | {words[1]} | {found[0][2] / found[1][2]:.1f} |")


def errors(scene: Scene) -> Iterator[tuple[float, float, float]]:
    """Tolerance, largest error of the force over its peak in rows at even times, and wall time without such rows [s]."""
    rows = replace(scene, output_step=0.02)
    limit = simulate(replace(rows, solver=replace(scene.solver, method="esdirk4", rtol=1e-7)))
    for rtol in pick((1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6), (1e-2, 1e-4)):
        solver = replace(scene.solver, rtol=rtol)
        largest, _ = differences(simulate(replace(rows, solver=solver)), limit)
        (timed,) = fastest([replace(scene, solver=solver)])
        yield rtol, largest, timed.counters.wall_time


def cost_of_a_row(scene: Scene) -> float:
    """Wall time of one row at an even time [s], from runs with many of them."""
    count = pick(20_000, 200)
    few, many = (replace(scene, output_step=scene.end / rows) for rows in (count / 2, count))
    times = [result.counters.wall_time for result in fastest([few, many], min(5, REPEATS))]
    return (times[1] - times[0]) / (count / 2)


def main() -> None:
    """Print the tables, and the ratio of the full to the smallest model."""
    parser(__doc__).parse_args()
    costs()
    selection_table()
    pair = [replace(plain_scene(SCENE), effects=effects) for effects in (FULL, SMALL)]
    at_an_error(*pair)
    each = [f"{1e6 * cost_of_a_row(scene):.2f} us" for scene in pair]
    print(f"\nA row at an even time: {each[0]} with all effects, {each[1]} with selected effects")
    scene = plain_scene(SCENE)
    full, small = fastest([replace(scene, effects=FULL), replace(scene, effects=Auto())])
    ratio = full.counters.wall_time / small.counters.wall_time
    print(f"\n{SCENE}: spatial and inertial over selected effects, {_short(small.provenance['model'])}: {ratio:.1f}")


if __name__ == "__main__":
    main()
