"""Time builds and runs on this machine, then run the other benchmarks of docs/performance.md: `python benchmarks/speed.py`.

Builds go to a temporary cache. Every run is repeated and its fastest wall time counts.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from quick import OPTIONS, parser, pick

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
    """Print both tables, then run the other scripts."""
    parser(__doc__).parse_args()
    from plain import plain_scene

    from msfp_gen import simulate

    with tempfile.TemporaryDirectory() as cache:
        print(f"first build of a cache, which translates the wrapper: {cold_build('2 1 0', cache):.2f} s\n")
        print("| layout | cold build [s] | over (5 2 2) |\n|---|---|---|")
        first = 0.0
        for layout in LAYOUTS:
            seconds = cold_build(layout, cache)
            first = first or seconds
            print(f"| {layout} | {seconds:.2f} | {seconds / first:.2f} |")
        print(f"\nwarm build_model: {min(warm_build(cache) for _ in range(REPEATS)):.4f} s\n")
    print("| scene | run [s] | times real time | steps | Newton iterations |\n|---|---|---|---|---|")
    for name in SCENES:
        runs = [simulate(plain_scene(name)) for _ in range(REPEATS)]
        best = min(runs, key=lambda run: run.counters.wall_time)
        count = best.counters
        speed = best.history.time[-1] / count.wall_time
        print(f"| {name} | {count.wall_time:.4f} | {speed:.0f} | {count.steps} | {count.newton_iterations} |")
    for script in ("kernels.py", "runs.py", "batch.py", "instructions.py"):
        print(flush=True)
        subprocess.run([sys.executable, str(Path(__file__).with_name(script)), *OPTIONS], check=True)


if __name__ == "__main__":
    main()
