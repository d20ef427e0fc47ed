"""Cost of gradients: `python benchmarks/gradients.py`, one minute. The table of docs/gradients.md.

Plain runs and runs with gradients alternate, and the least processor time of each counts, so that the ratios do not
depend on the load of the machine.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from msfp_gen import Scene, load_scene
from msfp_gen.model.model import build_model
from msfp_gen.scene.parameters import parameters_of
from msfp_gen.simulation.gradient_inputs import start_gradients
from msfp_gen.simulation.simulate import RunSequence

REPEATS = 9
PATHS = [f"bearing.surfaces[*].{name}" for name in ("friction", "radius", "yield_displacement", "capacity")]
SCENES = {"`fenz-test2`": "fenz-test2", "`fenz-test5`": "fenz-test5", "`becker-circle-88`": "becker-circle-88"}


def seconds(scene: Scene, paths: Sequence[str]) -> tuple[float, int]:
    """Processor time of the integration, and its steps."""
    model = build_model(scene.bearing.layout, scene.modelled, gradients=bool(paths))
    run, _ = RunSequence.of(scene).start_segment(model)
    if paths:
        start_gradients(run, scene, model, parameters_of(scene, paths))
    start = time.process_time()
    while run.advance(100_000):
        pass
    return time.process_time() - start, run.counts["steps"]


def damped(name: str, rtol: float) -> Scene:
    """A preset with damped contacts and rows every tenth of a second."""
    scene = load_scene(name)
    bearing, solver = scene.bearing.replace(contact_damping=1e-4), replace(scene.solver, rtol=rtol)
    return replace(scene, bearing=bearing, solver=solver, output_step=scene.end / 200)


def main() -> None:
    """Print the table: cost of one parameter over that of the run."""
    print("| run | steps | 4 parameters | 8 parameters | 16 parameters |\n|---|---|---|---|---|")
    for title, name in SCENES.items():
        for rtol in (1e-4, 1e-6):
            scene, shares, steps = damped(name, rtol), [], 0
            for paths in (PATHS[:1], PATHS[:2], PATHS):
                pairs = [(seconds(scene, ()), seconds(scene, paths)) for _ in range(REPEATS)]
                plain, full = (min(pair[i][0] for pair in pairs) for i in (0, 1))
                shares.append(f"{100 * (full / plain - 1) / len(parameters_of(scene, paths)):.0f} %")
                steps = pairs[0][0][1]
            print(f"| {title}, rtol {rtol:g} | {steps} | {' | '.join(shares)} |", flush=True)


if __name__ == "__main__":
    main()
