"""One evaluation, tangent, Newton iteration and solve for accelerations of built models: `python benchmarks/kernels.py`.

The state is one of a run, in the middle of its strong part; numbers are nanoseconds of CPU time, the best of many.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from msfp_gen import Effects, Scene, load_scene, simulate
from msfp_gen.build import build_model
from msfp_gen.compiler import FLAGS, find_compiler
from msfp_gen.packing import bodies_and_surfaces, load_values, top_values

HERE = Path(__file__).parent
FULL = Effects()


def compiled(folder: Path, main: Path, target: Path) -> Path:
    """A program of `main` and the sources of a built model, with the flags that built it."""
    units = [str(p) for p in folder.glob("*.c") if not p.name.startswith("msfp_")]
    command = [*find_compiler().command, *FLAGS["c"], "-I", str(folder), str(main), *units, "-o", str(target), "-lm"]
    subprocess.run(command, check=True)
    return target


def state_of(scene: Scene, beta: float) -> str:
    """What `kernels.c` reads: the scene half-way through, all surfaces on the move."""
    history = simulate(scene).history
    speed = np.abs(history.slip_velocity).min(axis=1).max(axis=1)
    i = int(np.argmax(speed[: len(speed) // 2]))
    motion, t = scene.motion, float(history.time[i])
    bodies, surfaces = bodies_and_surfaces(scene.bearing, scene.effects)
    anchor = motion.displacement(0.0)[:2]
    values: list[object] = [beta, scene.bearing.gravity, bodies, surfaces, top_values(scene.top, anchor)]
    values += [motion.evaluate(t, order) for order in range(3)] + [load_values(scene.top)]
    values += [history.tilt_angles[i], history.tilt_rates[i], history.tilt_accelerations[i], history.friction_state[i]]
    return " ".join(repr(float(x)) for value in values for x in np.ravel(value))


def timed(scene: Scene, beta: float = 1.5e-3) -> list[float]:
    """Value, tangent, Newton iteration, accelerations [ns]."""
    model = build_model(scene.bearing.layout, scene.effects)
    with tempfile.TemporaryDirectory() as folder:
        program = compiled(model.info.folder, HERE / "c" / "kernels.c", Path(folder) / "kernels")
        done = subprocess.run([program], input=state_of(scene, beta), text=True, capture_output=True, check=True)
    return [float(word) for word in done.stdout.split()]


CASES = {
    "spatial, inertial": FULL,
    "spatial, massless": replace(FULL, sliders="massless"),
    "planar, inertial": replace(FULL, dimension="planar"),
    "planar, massless": replace(FULL, dimension="planar", sliders="massless", rims=False),
}


def main() -> None:
    """Print the table."""
    print("| effects, fenz-test2 | value [ns] | tangent [ns] | Newton iteration [ns] | accelerations [ns] |")
    print("|---|---|---|---|---|")
    for name, effects in CASES.items():
        print(f"| {name} | " + " | ".join(f"{ns:.0f}" for ns in timed(replace(load_scene("fenz-test2"), effects=effects))) + " |", flush=True)


if __name__ == "__main__":
    sys.exit(main())
