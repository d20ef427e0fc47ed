"""Throughput of batches: `python benchmarks/batch.py` (docs/performance.md).

Runs per second with 1, 2, 4, ... workers, compared with a loop of `simulate` over the same scenes: with all calls in
threads, with all in processes, and as `simulate_batch` chooses. All scenes differ, in the scale of the record, the axial
load or the amplitude, and are new, as a user gives them. The loop and the batches are timed in turns and the best of
several rounds counts, to reduce the influence of other jobs.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial

import numpy as np
from plain import plain_scene
from quick import parser, pick

from msfp_gen import Scene, simulate, simulate_batch
from msfp_gen.common.cores import usable_cores
from msfp_gen.scene.file.source import changed_scene
from msfp_gen.studies.workers import Workers

STUDIES = {
    "ridgecrest-clc": ("motion.scale", np.linspace(0.3, 1.1, pick(16, 2))),
    "becker-eight-125": ("top.axial_load", np.linspace(0.9e5, 1.3e5, pick(64, 2))),
    "fenz-test2": ("motion.amplitude", np.linspace(0.015, 0.035, pick(512, 2))),
}


# How workers run a call -> whether in a process.
WAYS: dict[str, Callable[..., bool]] = {
    "threads": lambda *_: False,
    "processes": lambda *_: True,
    "as chosen": Workers.in_process,
}


@contextmanager
def way(name: str) -> Iterator[None]:
    """Let workers run all calls in one of WAYS."""
    Workers.in_process = WAYS[name]  # type: ignore[method-assign]
    try:
        yield
    finally:
        Workers.in_process = WAYS["as chosen"]  # type: ignore[method-assign]


def worker_counts() -> list[int]:
    """1, 2, 4, ... and the number of cores."""
    cores = usable_cores()
    return [2**power for power in range(cores.bit_length()) if 2**power < cores] + [cores]


def with_value(name: str, field: str, value: float) -> Scene:
    """The scene with a changed value of motion or top."""
    part = field.partition(".")[0]
    return replace(plain_scene(name), **{part: getattr(changed_scene(name, {field: value}), part)})


def one_by_one(scenes: Sequence[Scene]) -> None:
    """Run the scenes in a loop."""
    for scene in scenes:
        simulate(scene)


def batch(workers: int, name: str, scenes: Sequence[Scene]) -> None:
    """Run the scenes as one batch in one of WAYS."""
    with way(name):
        simulate_batch(scenes, workers=workers)


def seconds(work: Callable[[Sequence[Scene]], object], scenes: Sequence[Scene]) -> float:
    """Wall time of a call with scenes of which nothing is known yet, such as the time grids of their motions."""
    new = [replace(scene, motion=replace(scene.motion)) for scene in scenes]
    begin = time.perf_counter()
    work(new)
    return time.perf_counter() - begin


def main() -> None:
    """Print one row per study and way."""
    options = parser(__doc__)
    options.add_argument("--rounds", type=int, default=pick(9, 1), help="rounds, of which the best counts")
    options.add_argument("--studies", nargs="+", default=list(STUDIES), choices=STUDIES, help="which studies")
    given = options.parse_args()
    counts = worker_counts()
    print(f"runs per second over those of a loop of `simulate`; {usable_cores()} cores, best of {given.rounds} rounds")
    print("| study | one run [ms] | workers are |" + "".join(f" {count} |" for count in counts))
    print("|---|---|---|" + "---|" * len(counts))
    for name in given.studies:
        field, values = STUDIES[name]
        scenes = [with_value(name, field, float(value)) for value in values]
        simulate(scenes[0])  # builds the model before timing
        batches = [partial(batch, count, each) for each in WAYS for count in counts]
        for work in batches:  # workers live on: their start is not that of a batch
            work(scenes)
        rounds = [[seconds(work, scenes) for work in (one_by_one, *batches)] for _ in range(given.rounds)]
        loop, *times = (min(column) for column in zip(*rounds, strict=True))
        for index, each in enumerate(WAYS):
            own = times[index * len(counts) : (index + 1) * len(counts)]
            cells = "".join(f" {loop / took:.2f} |" for took in own)
            print(f"| {name} | {1e3 * loop / len(scenes):.1f} | {each} |{cells}", flush=True)


if __name__ == "__main__":
    main()
