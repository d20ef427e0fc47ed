"""What each law of friction costs: `python benchmarks/friction_cost.py` prints the table of docs/friction.md.

Every run is repeated and its fastest wall time counts. `pvt, neutral` has numbers that leave the coefficient alone: the
same motion as `constant`, with all the states and formulas of the law.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from msfp_gen import Scene, load_scene, simulate

SCENES = ("fenz-test2", "fenz-test5", "becker-eight-125", "ridgecrest-clc")
REPEATS = 5
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


def main() -> None:
    """Print the table."""
    print("| scene | law | run [ms] | over constant | steps | Newton iterations | per iteration |\n|" + "---|" * 7)
    for name in SCENES:
        first: tuple[float, float] | None = None
        for law, scene in variants(load_scene(name)).items():
            runs = [simulate(scene).counters for _ in range(REPEATS)]
            best = min(runs, key=lambda count: count.wall_time)
            each = best.wall_time / best.newton_iterations
            first = first or (best.wall_time, each)
            print(f"| {name} | {law} | {best.wall_time * 1e3:.1f} | {best.wall_time / first[0]:.2f} | {best.steps} | "
                  f"{best.newton_iterations} | {each / first[1]:.2f} |")  # fmt: skip


if __name__ == "__main__":
    main()
