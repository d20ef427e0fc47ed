"""Scenes side by side against one after the other, on one core: `python benchmarks/batch.py` (docs/performance.md).

Every scene is another one: records scaled otherwise, cyclic tests with other amplitudes. The time is that of the loops
in C alone, for `simulate` and for the batch, in CPU seconds; both take the same scenes, in turn, and the best of some
rounds counts. The ratio comes last. Answers are compared at even times: the largest difference of horizontal force over the
largest force.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from msfp_gen import InputError, Scene, build_model, simulate, simulate_batch
from msfp_gen.lanes import chosen_width
from msfp_gen.model import Model
from msfp_gen.scenefile import changed_scene
from msfp_gen.simulation import Course

ROUNDS = 5
STUDIES = {
    "ridgecrest-clc": ("motion.scale", np.linspace(0.3, 1.1, 64)),
    "fenz-test2": ("motion.amplitude", np.linspace(0.015, 0.035, 64)),
    "becker-eight-125": ("top.axial_load", np.linspace(0.9e5, 1.3e5, 64)),
}


def scenes_of(name: str, count: int) -> list[Scene]:
    """Versions of a preset."""
    field, values = STUDIES[name]
    return [changed_scene(name, {field: float(value)}) for value in values[:count]]


def serial(scenes: Sequence[Scene], model: Model) -> float:
    """CPU seconds of the loop in C, one scene after the other; rows are read, as a result reads them."""
    seconds = 0.0
    for scene in scenes:
        run, _ = Course.of(scene).begin(model)
        begin = time.process_time()
        while run.advance(4000):
            pass
        seconds += time.process_time() - begin
        model.unpack(run.rows)
    return seconds


def together(scenes: Sequence[Scene], model: Model) -> float:
    """The same side by side."""
    seconds, runs = 0.0, {}
    batch, waiting, free = model.extension.Batch(), list(scenes), list(range(2 * model.extension.WIDTH))
    while waiting or runs:
        while free and waiting:
            slot = free.pop()
            runs[slot] = Course.of(waiting.pop()).begin(model)[0]
            batch.put(slot, runs[slot])
        begin = time.process_time()
        ended = batch.advance()
        seconds += time.process_time() - begin
        for slot in ended:
            run = runs.pop(slot)
            model.unpack(run.rows)
            batch.reuse(run)
            free.append(slot)
    return seconds


def apart(scenes: Sequence[Scene], width: int) -> list[float]:
    """Largest difference of horizontal force over the largest, of every scene."""
    even = [replace(scene, output_step=scene.end / 1000) for scene in scenes]
    found = []
    for scene, result in zip(even, simulate_batch(even, lanes=width), strict=True):
        force = simulate(scene).history.top_force[:, :2]
        off = np.linalg.norm(force - result.history.top_force[:, :2], axis=1).max()
        found.append(float(off / np.linalg.norm(force, axis=1).max()))
    return found


def main() -> None:
    """Print a row for every study."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lanes", type=int, help="runs side by side; not given: what this processor has")
    parser.add_argument("--scenes", type=int, default=64, help="scenes of each study")
    given = parser.parse_args()
    width = chosen_width(given.lanes)
    if not width:
        raise InputError("no lanes here: a batch would run one scene at a time")
    print(f"{given.scenes} scenes each, {width} lanes, one core\n")
    print("| study | one at a time [ms a scene] | in lanes [ms a scene] | forces apart, median | most | ratio |")
    print("|---|---|---|---|---|---|")
    for name in STUDIES:
        scenes = scenes_of(name, given.scenes)
        layout, effects = scenes[0].bearing.layout, scenes[0].modelled
        one, many = build_model(layout, effects), build_model(layout, effects, lanes=width)
        best = [np.inf, np.inf]
        for _ in range(ROUNDS):
            for i, (run, model) in enumerate(((serial, one), (together, many))):
                best[i] = min(best[i], run(scenes, model) / len(scenes))
        off = apart(scenes, width)
        print(f"| {name} | {best[0] * 1e3:.2f} | {best[1] * 1e3:.2f} | {np.median(off):.0e} | {max(off):.0e} "
              f"| {best[0] / best[1]:.2f} |", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
