"""What each law of friction costs: `python benchmarks/friction_cost.py` prints the table of docs/friction.md.

Every run is repeated and its least processor time counts. `pvt, neutral` has numbers that leave the coefficient alone: the
same motion as `constant`, with all the states and formulas of the law.
"""

from __future__ import annotations

from dataclasses import replace
from time import thread_time
from typing import Any

from msfp_gen import Scene, load_scene, simulate
from msfp_gen.result import Result

SCENES = ("fenz-test2", "fenz-test5", "becker-eight-125", "ridgecrest-clc")
REPEATS = 12
NEUTRAL = {"pressure_ratio": 1.0, "velocity_drop": 0.0, "temperature_ratio": 1.0}
FORMULA = "mu * (1 - c1 * exp(-c2 * v))"


def lawful(scene: Scene, word: str, text: str | None = None, **values: Any) -> Scene:
    """The scene with another law of friction."""
    effects = replace(scene.effects, friction=word, friction_law=text)
    return replace(scene, effects=effects, bearing=scene.bearing.replace(**values))


def variants(scene: Scene) -> dict[str, Scene]:
    """The scene under each law."""
    slow = [surface.friction / 2 for surface in scene.bearing.surfaces]
    return {
        "constant": scene,
        "pvt, neutral": lawful(scene, "pvt", reference_pressure=15e6, **NEUTRAL),
        "velocity": lawful(scene, "velocity", friction_slow=slow, velocity_rate=100.0),
        "custom, the same": lawful(scene, "custom", FORMULA, c1=0.5, c2=100.0),
        "pvt": lawful(scene, "pvt", reference_pressure=15e6),
    }


def timed(scene: Scene) -> tuple[float, Result]:
    """Processor time of one run [s], which other programs disturb less than the clock on the wall; the run."""
    start = thread_time()
    run = simulate(scene)
    return thread_time() - start, run


def main() -> None:
    """Print the table. The laws take turns, so that whatever else the machine does meets all of them."""
    print("| scene | law | run [ms] | over constant | steps | Newton iterations | per iteration |\n|" + "---|" * 7)
    for name in SCENES:
        scenes = variants(load_scene(name))
        turns = [{law: timed(scene) for law, scene in scenes.items()} for _ in range(REPEATS)]
        fastest = {law: min(turn[law][0] for turn in turns) for law in scenes}
        counts = {law: turns[0][law][1].counters for law in scenes}
        each = {law: fastest[law] / counts[law].newton_iterations for law in scenes}
        for law, count in counts.items():
            print(f"| `{name}` | {law} | {fastest[law] * 1e3:.1f} | {fastest[law] / fastest['constant']:.2f} | "
                  f"{count.steps} | {count.newton_iterations} | {each[law] / each['constant']:.2f} |")  # fmt: skip


if __name__ == "__main__":
    main()
