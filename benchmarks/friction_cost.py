"""Cost of each friction law: `python benchmarks/friction_cost.py` prints the table of docs/friction.md.

Every run is repeated and its least processor time counts. `pvt, neutral` has parameters with which the coefficient is
constant: it has the motion of `constant`, with all states and formulas of the law.
"""

from __future__ import annotations

from dataclasses import replace
from time import thread_time
from typing import Any

from plain import plain_scene
from quick import parser, pick

from msfp_gen import Scene, simulate
from msfp_gen.results.result import Result

SCENES = pick(("fenz-test2", "fenz-test5", "becker-eight-125", "ridgecrest-clc"), ("fenz-test2",))
REPEATS = pick(12, 1)
NEUTRAL = {"pressure_ratio": 1.0, "velocity_drop": 0.0, "temperature_ratio": 1.0}
FORMULA = "mu * (1 - c1 * exp(-c2 * v))"


def with_law(scene: Scene, name: str, formula: str | None = None, **values: Any) -> Scene:
    """The scene with another friction law; `values` are its parameters."""
    effects = replace(scene.effects, friction=name, friction_law=formula)
    return replace(scene, effects=effects, bearing=scene.bearing.replace(**values))


def variants(scene: Scene) -> dict[str, Scene]:
    """Name of the law -> the scene with it."""
    slow = [surface.friction / 2 for surface in scene.bearing.surfaces]
    return {
        "constant": scene,
        "pvt, neutral": with_law(scene, "pvt", reference_pressure=15e6, **NEUTRAL),
        "velocity": with_law(scene, "velocity", friction_slow=slow, velocity_rate=100.0),
        "custom, the same": with_law(scene, "custom", FORMULA, c1=0.5, c2=100.0),
        "pvt": with_law(scene, "pvt", reference_pressure=15e6),
    }


def timed(scene: Scene) -> tuple[float, Result]:
    """Processor time of one run [s], which depends less on other programs than wall time, and the run."""
    start = thread_time()
    run = simulate(scene)
    return thread_time() - start, run


def main() -> None:
    """Print the table. The laws are run in turns, so that other load on the machine affects all of them."""
    parser(__doc__).parse_args()
    print("| scene | law | run [ms] | over constant | steps | Newton iterations | per iteration |\n|" + "---|" * 7)
    for name in SCENES:
        scenes = variants(plain_scene(name))
        turns = [{law: timed(scene) for law, scene in scenes.items()} for _ in range(REPEATS)]
        fastest = {law: min(turn[law][0] for turn in turns) for law in scenes}
        counts = {law: turns[0][law][1].counters for law in scenes}
        each = {law: fastest[law] / counts[law].newton_iterations for law in scenes}
        for law, count in counts.items():
            print(
                f"| `{name}` | {law} | {fastest[law] * 1e3:.1f} | {fastest[law] / fastest['constant']:.2f} | "
                f"{count.steps} | {count.newton_iterations} | {each[law] / each['constant']:.2f} |"
            )


if __name__ == "__main__":
    main()
