"""Scenes side by side against one after the other, on one core: `python benchmarks/batch.py` (docs/performance.md).

Every scene is another one: records scaled otherwise, cyclic tests with other amplitudes. The time is that of the loops
in C alone, in CPU seconds; all take the same scenes, in turn, and the best of some rounds counts. Three ways: with one
number an instruction (`simulate` compiled without vectors but for its factorisation), `simulate` as it is, whose vectors
hold the surfaces of one bearing, and side by side in lanes. The ratios come last. Answers are compared at even times: the
largest difference of horizontal force over the largest force. `--alike`: the same scene every time, so that runs keep step.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
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


def scenes_of(name: str, count: int, alike: bool = False) -> list[Scene]:
    """Versions of a preset; or the one in the middle, again and again."""
    field, values = STUDIES[name]
    chosen = [values[len(values) // 2]] * count if alike else values[:count]
    return [changed_scene(name, {field: float(value)}) for value in chosen]


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


class Scalar:
    """`serial` in a process of its own, where models are compiled without vectors: one number an instruction."""

    def __init__(self, *arguments: str) -> None:
        flags = f"{os.environ.get('MSFP_GEN_CFLAGS', '')} -fno-tree-vectorize"
        self.process = subprocess.Popen([sys.executable, __file__, *arguments, "--serial"], text=True, bufsize=1,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        env={**os.environ, "MSFP_GEN_CFLAGS": flags})  # fmt: skip

    def seconds(self) -> float:
        """CPU seconds of one round."""
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.write("go\n")
        return float(self.process.stdout.readline())


def answer(scenes: Sequence[Scene], model: Model) -> None:
    """The other end of `Scalar`: a round for every line."""
    for _ in sys.stdin:
        print(serial(scenes, model), flush=True)


def main() -> None:
    """Print a row for every study."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lanes", type=int, help="runs side by side; not given: what this processor has")
    parser.add_argument("--scenes", type=int, default=64, help="scenes of each study")
    parser.add_argument("--alike", action="store_true", help="the same scene every time")
    parser.add_argument("--study", choices=STUDIES, help="this one only")
    parser.add_argument("--serial", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.serial:
        scenes = scenes_of(given.study, given.scenes, given.alike)
        return answer(scenes, build_model(scenes[0].bearing.layout, scenes[0].modelled))
    width = chosen_width(given.lanes)
    if not width:
        raise InputError("no lanes here: a batch would run one scene at a time")
    print(f"{given.scenes} scenes each, {width} lanes, one core; milliseconds a scene\n")
    print("| study | one lane | simulate | batch | forces apart, median | most | batch over simulate | over one lane |")
    print("|---|---|---|---|---|---|---|---|")
    for name in [given.study] if given.study else STUDIES:
        scenes = scenes_of(name, given.scenes, given.alike)
        layout, effects = scenes[0].bearing.layout, scenes[0].modelled
        one, many = build_model(layout, effects), build_model(layout, effects, lanes=width)
        scalar = Scalar("--study", name, "--scenes", str(given.scenes), *(["--alike"] if given.alike else []))
        rounds = [(scalar.seconds(), serial(scenes, one), together(scenes, many)) for _ in range(ROUNDS)]
        lane, alone, batch = (1e3 * min(times) / len(scenes) for times in zip(*rounds, strict=True))
        off = apart(scenes, width)
        print(f"| {name} | {lane:.2f} | {alone:.2f} | {batch:.2f} | {np.median(off):.0e} | {max(off):.0e} "
              f"| {alone / batch:.2f} | {lane / batch:.2f} |", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
