"""Time builds and runs on this machine: `python benchmarks/speed.py`, two tables of docs/performance.md.

Builds go to a temporary cache. Every run is repeated and its fastest wall time counts.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

from quick import parser, pick

LAYOUTS = pick(("5 2 2", "7 3 3", "11 5 5"), ("5 2 2",))
SCENES = pick(("fenz-test2", "fenz-test5", "becker-eight-125", "ridgecrest-clc", "ridgecrest-ccc"), ("fenz-test2",))
REPEATS = pick(5, 1)

WARM = """
import msfp_gen, time
from msfp_gen import Layout, build_model
begin = time.perf_counter()
build_model(Layout.tfp())
print(time.perf_counter() - begin)
"""


def cold_build(layout: str, cache: str) -> float:
    """Wall time of `msfp-gen generate` for a layout that is not in the cache, with the start of the interpreter [s]."""
    begin = time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "msfp_gen", "generate", *layout.split()],
        check=True,
        stdout=subprocess.DEVNULL,
        env={**os.environ, "MSFP_GEN_CACHE": cache},
    )
    return time.perf_counter() - begin


def warm_build(cache: str) -> float:
    """Wall time of `build_model` in a new process that finds the model in the cache [s]."""
    done = subprocess.run(
        [sys.executable, "-c", WARM],
        check=True,
        text=True,
        stdout=subprocess.PIPE,
        env={**os.environ, "MSFP_GEN_CACHE": cache},
    )
    return float(done.stdout)


def main() -> None:
    """Print both tables."""
    parser(__doc__).parse_args()
    from plain import plain_scene

    from msfp_gen import simulate

    print("| build | wall time [s] |\n|---|---|")
    with tempfile.TemporaryDirectory() as cache:
        print(f"| (2,1,0), first of a cache: it translates the wrapper too | {cold_build('2 1 0', cache):.2f} |")
        for layout in LAYOUTS:
            print(f"| ({layout.replace(' ', ',')}) | {cold_build(layout, cache):.2f} |", flush=True)
        best = min(warm_build(cache) for _ in range(REPEATS))
        print(f"| (5,2,2) from the cache, in a new process | {best:.4f} |\n")
    print("| scene | run [ms] | times real time | steps | Newton iterations |\n|---|---|---|---|---|")
    for name in SCENES:
        runs = [simulate(plain_scene(name)) for _ in range(REPEATS)]
        best_run = min(runs, key=lambda run: run.counters.wall_time)
        count = best_run.counters
        speed = best_run.history.time[-1] / count.wall_time
        print(
            f"| `{name}` | {1e3 * count.wall_time:.1f} | {speed:,.0f} | {count.steps:,} | {count.newton_iterations:,} |"
        )


if __name__ == "__main__":
    main()
