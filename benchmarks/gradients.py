"""Cost of gradients: `python benchmarks/gradients.py`, half a minute. The tables of docs/gradients.md.

Plain runs and runs with gradients alternate, and the least processor time of each counts, so that the ratios do not
depend on the load of the machine. With `--instructions` callgrind counts instead, with vectors of AVX2. With
`--energies` the energies that are integrals over the run are differentiated too.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace

from instructions import AVX2, instructions
from quick import parser, pick

from msfp_gen import Scene, load_scene
from msfp_gen.generator.lower import GRADIENT_COLUMNS
from msfp_gen.model.model import build_model
from msfp_gen.scene.parameters import parameters_of
from msfp_gen.simulation.bearing_run import BearingRun
from msfp_gen.simulation.gradients import start_gradients

REPEATS = pick(9, 1)
FIELDS = ("friction", "radius", "yield_displacement", "capacity")
PATHS = [f"bearing.surfaces[{j}].{name}" for name in FIELDS for j in range(4)]
COUNTS = pick((1, 4, 8, 16), (1, 4))
SCENES = {"`fenz-test2`": "fenz-test2", "`fenz-test5`": "fenz-test5", "`becker-circle-88`": "becker-circle-88"}


def seconds(scene: Scene, paths: Sequence[str], energies: bool = False) -> tuple[float, dict[str, int]]:
    """Processor time of the integration, and its counters. energies: differentiate the integrals over the run too."""
    model = build_model(scene.bearing.layout, scene.modelled, gradients=bool(paths))
    run, _ = BearingRun.of(scene).start_segment(model)
    if paths:
        start_gradients(run, scene, model, parameters_of(scene, paths), energies=energies)
    start = time.process_time()
    while run.advance(100_000):
        pass
    return time.process_time() - start, dict(run.counts)


def damped(name: str, rtol: float) -> Scene:
    """A preset with damped contacts and rows every tenth of a second."""
    scene = load_scene(name)
    bearing, solver = scene.bearing.replace(contact_damping=1e-4), replace(scene.solver, rtol=rtol)
    return replace(scene, bearing=bearing, solver=solver, output_step=scene.end / 200)


def shares_of_time(scene: Scene, energies: bool) -> tuple[list[float], dict[str, int]]:
    """Cost of gradients over that of the run, for each number of parameters; and the counters of the run."""
    shares: list[float] = []
    counts: dict[str, int] = {}
    for count in COUNTS:
        pairs = [(seconds(scene, ()), seconds(scene, PATHS[:count], energies)) for _ in range(REPEATS)]
        plain, full = (min(pair[i][0] for pair in pairs) for i in (0, 1))
        shares.append(full / plain - 1)
        counts = pairs[0][0][1]
    return shares, counts


def counted(name: str, rtol: float, count: int, energies: bool) -> int:
    """Instructions of the integration with the first `count` parameters, in millions."""
    scene, paths = f"gradients.damped({name!r}, {rtol})", f"gradients.PATHS[:{count}]"
    text = f"import gradients; gradients.seconds({scene}, {paths}, {energies and count > 0})"
    command = [sys.executable, "-c", text]
    subprocess.run(command, check=True)  # builds the model
    return instructions(command, "msfp_5_2_2_run_advance")


def main() -> None:
    """Print the table: fixed cost, cost of a group, and cost of one parameter over that of the run."""
    options = parser(__doc__)
    options.add_argument("--instructions", action="store_true", help="instructions by callgrind in place of times")
    options.add_argument("--energies", action="store_true", help="with the energies that are integrals over the run")
    given = options.parse_args()
    counting, energies = given.instructions, given.energies
    if counting:
        if not shutil.which("valgrind"):
            raise SystemExit("valgrind is not installed")
        os.environ["MSFP_GEN_CFLAGS"] = AVX2
        os.environ["PYTHONPATH"] = os.pathsep.join(sys.path)
    columns = " | ".join(f"{count}" for count in COUNTS)
    work = "instructions" if counting else "steps | evaluations a step | tangents a step"
    head = f"| run | {work} | fixed | a group | {columns} |"
    print(f"{head}\n{'|---' * (head.count('|') - 1)}|")
    for title, name in pick(list(SCENES.items()), list(SCENES.items())[:1]):
        for rtol in (1e-4,) if counting else (1e-4, 1e-6):
            if counting:
                plain, *full = (counted(name, rtol, count, energies) for count in (0, *COUNTS))
                shares, done = [each / plain - 1 for each in full], f"{plain / 1e6:.0f} million"
            else:
                shares, counts = shares_of_time(damped(name, rtol), energies)
                rates = [counts[key] / counts["steps"] for key in ("evaluations", "factorisations")]
                done = f"{counts['steps']} | {rates[0]:.1f} | {rates[1]:.1f}"
            one = (shares[-1] - shares[-2]) / (COUNTS[-1] - COUNTS[-2])  # parameter of a full group
            each = [share / count for share, count in zip(shares, COUNTS, strict=True)]
            parts = [shares[-2] - COUNTS[-2] * one, GRADIENT_COLUMNS * one, *each]
            print(f"| {title}, rtol {rtol:g} | {done} | {' | '.join(f'{100 * p:.0f} %' for p in parts)} |", flush=True)


if __name__ == "__main__":
    main()
