"""Scenes side by side against one after the other, on one core: `python benchmarks/batch.py` (docs/performance.md).

Every scene is another one: records scaled otherwise, cyclic tests with other amplitudes. The time is that of the loops
in C alone, for `simulate` and for the batch, in CPU seconds; both take the same scenes, in turn, and the best of some
rounds counts. The ratio comes last. Answers are compared where both have a row: the largest difference of horizontal force
over the largest force.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from msfp_gen import InputError, Scene, build_model
from msfp_gen.lanes import chosen_width
from msfp_gen.model import Model
from msfp_gen.scenefile import changed_scene
from msfp_gen.simulation import Course

ROUNDS = 5
STUDIES = {
    "ridgecrest-clc": ("motion.scale", np.linspace(0.3, 1.1, 64)),
    "fenz-test2": ("motion.amplitude", np.linspace(0.015, 0.035, 64)),
    "becker-eight-125": ("solver.rtol", np.geomspace(3e-4, 1e-4, 64)),
}


def scenes_of(name: str, count: int) -> list[Scene]:
    """Versions of a preset."""
    field, values = STUDIES[name]
    return [changed_scene(name, {field: float(value)}) for value in values[:count]]


def serial(scenes: Sequence[Scene], model: Model) -> tuple[float, list[Any]]:
    """CPU seconds of the loop in C, one scene after the other, and the rows."""
    seconds, rows = 0.0, []
    for scene in scenes:
        run, _ = Course.of(scene).begin(model)
        begin = time.process_time()
        while run.advance(4000):
            pass
        seconds += time.process_time() - begin
        rows.append(model.unpack(run.rows))
    return seconds, rows


def together(scenes: Sequence[Scene], model: Model) -> tuple[float, list[Any]]:
    """The same side by side."""
    seconds, rows = 0.0, [None] * len(scenes)
    batch, waiting, runs = model.extension.Batch(), list(enumerate(scenes))[::-1], {}
    free = list(range(2 * model.extension.WIDTH))
    while waiting or runs:
        while free and waiting:
            slot, (place, scene) = free.pop(), waiting.pop()
            runs[slot] = place, Course.of(scene).begin(model)[0]
            batch.put(slot, runs[slot][1])
        begin = time.process_time()
        ended = batch.advance()
        seconds += time.process_time() - begin
        for slot in ended:
            place, run = runs.pop(slot)
            rows[place] = model.unpack(run.rows)
            batch.reuse(run)
            free.append(slot)
    return seconds, rows


def apart(one: Any, other: Any) -> float:
    """Largest difference of the horizontal force at the times of `one`, over the largest force."""
    force = [np.interp(one["time"], other["time"], other["top_force"][:, axis]) for axis in range(2)]
    largest = np.linalg.norm(one["top_force"][:, :2], axis=1).max()
    return float(np.linalg.norm(one["top_force"][:, :2] - np.column_stack(force), axis=1).max() / largest)


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
        best, rows = [np.inf, np.inf], [[], []]
        for _ in range(ROUNDS):
            for i, (run, model) in enumerate(((serial, one), (together, many))):
                seconds, rows[i] = run(scenes, model)
                best[i] = min(best[i], seconds / len(scenes))
        off = [apart(a, b) for a, b in zip(*rows, strict=True)]
        print(f"| {name} | {best[0] * 1e3:.2f} | {best[1] * 1e3:.2f} | {np.median(off):.0e} | {max(off):.0e} "
              f"| {best[0] / best[1]:.2f} |", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
