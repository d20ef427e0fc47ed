"""Throughput of batches: `python benchmarks/batch.py` (docs/performance.md).

Runs per second with 1, 2, ... workers, compared with a loop of `simulate` over the same scenes. All scenes differ, in
the scale of the record, the axial load or the amplitude. The loop and the batches are timed in turns and the best of
several rounds counts, to reduce the influence of other jobs. `--processes` uses processes instead of threads.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from plain import plain_scene
from quick import parser, pick

from msfp_gen import Scene, simulate, simulate_batch
from msfp_gen.common.cores import usable_cores
from msfp_gen.scene.file.source import changed_scene

STUDIES = {
    "ridgecrest-clc": ("motion.scale", np.linspace(0.3, 1.1, pick(16, 2))),
    "becker-eight-125": ("top.axial_load", np.linspace(0.9e5, 1.3e5, pick(64, 2))),
    "fenz-test2": ("motion.amplitude", np.linspace(0.015, 0.035, pick(256, 2))),
}


def with_value(name: str, field: str, value: float) -> Scene:
    """The scene with a changed value of motion or top."""
    part = field.partition(".")[0]
    return replace(plain_scene(name), **{part: getattr(changed_scene(name, {field: value}), part)})


def one_by_one(scenes: Sequence[Scene]) -> None:
    """Run the scenes in a loop."""
    for scene in scenes:
        simulate(scene)


def seconds(work: Callable[[], object]) -> float:
    """Wall time of a call."""
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def main() -> None:
    """Print one row per study."""
    options = parser(__doc__)
    options.add_argument("--rounds", type=int, default=pick(9, 1), help="rounds, of which the best counts")
    options.add_argument("--processes", action="store_true", help="processes instead of threads")
    given = options.parse_args()
    workers = range(1, usable_cores() + 1)
    print(f"runs per second, and in brackets the ratio to the loop; best of {given.rounds} rounds")
    print("| study | one run [ms] | loop of `simulate` |" + "".join(f" workers: {count} |" for count in workers))
    print("|---|---|---|" + "---|" * len(workers))
    for name, (field, values) in STUDIES.items():
        scenes = [with_value(name, field, float(value)) for value in values]
        simulate(scenes[0])  # builds the model before timing
        batches = [partial(simulate_batch, scenes, workers=n, processes=given.processes) for n in workers]
        rounds = [[seconds(work) for work in (partial(one_by_one, scenes), *batches)] for _ in range(given.rounds)]
        loop, *times = (min(column) for column in zip(*rounds, strict=True))
        cells = "".join(f" {len(scenes) / took:.0f} ({loop / took:.2f}) |" for took in times)
        print(f"| {name} | {1e3 * loop / len(scenes):.1f} | {len(scenes) / loop:.0f} |{cells}", flush=True)


if __name__ == "__main__":
    main()
