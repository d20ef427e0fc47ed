"""Proof that studies hold what docs/studies.md says: `python benchmarks/studies.py [PROOF ...] [--runs 100000]`.

Proofs: kills, shards, dask, cores, overhead, fragility; all of them unless some are named. Each prints one row of the
table in docs/studies.md. `kills` also measures the memory of an uninterrupted run. Ten minutes on two idle cores.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from hashlib import sha256
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pandas as pd
from batch import WAYS, way, worker_counts
from quick import installed, parser, pick

import msfp_gen
from msfp_gen import simulate
from msfp_gen.scene.file.loader import dumps
from msfp_gen.studies import fragility, load_study, read_study

KILLS = pick(5, 2)
PLANAR = {  # less than 1 ms a run
    "bearing": "fenz-tfp",
    "motion": {"kind": "harmonic", "amplitude": 0.025, "frequency": 0.5, "cycles": 1.0},
    "top": {"kind": "rig", "axial_load": 112e3, "stiffness": 1e8, "rotational_stiffness": 1e6},
    "effects": {"dimension": "planar", "sliders": "massless", "rims": False, "bouc_wen": "plastic"},
    "solver": {"rtol": 1e-2},
}
KEEP = ["peak_displacement", "peak_force", "peak_sliding"]


def planar(runs: int, seed: int = 1, **changes: Any) -> dict[str, Any]:
    """A study of short planar runs without masses."""
    axes = {
        "friction": {"multiplies": "bearing.friction", "distribution": "lognormal", "median": 1.0, "dispersion": 0.2},
        "load": {"sets": "top.axial_load", "distribution": "uniform", "low": 90e3, "high": 130e3},
    }
    sampling = {"samples": runs, "seed": seed, "method": "random"}
    return {"name": "proof", "scene": PLANAR, "axes": axes, "sampling": sampling, "keep": KEEP, **changes}


def ten_ms(runs: int, **changes: Any) -> dict[str, Any]:
    """A study of spatial runs of about 10 ms."""
    axes = {"friction": {"multiplies": "bearing.friction", "distribution": "uniform", "low": 0.8, "high": 1.2}}
    sampling = {"samples": runs, "seed": 1}
    return {"name": "proof", "scene": "fenz-test4", "axes": axes, "sampling": sampling, "keep": KEEP, **changes}


@dataclass
class Memory:
    """Resident memory of a process and its children [MB], by the share of the study that was done."""

    samples: list[tuple[float, float]] = field(default_factory=list)

    def add(self, share: float, pid: int) -> None:
        """Add what the processes have now."""
        total = sum(_resident(each) for each in (pid, *_children(pid)))
        self.samples.append((share, total))

    def between(self, low: float, high: float) -> float:
        """The largest value between two shares."""
        return max((total for share, total in self.samples if low <= share <= high), default=float("nan"))


def _resident(pid: int) -> float:
    try:
        text = Path(f"/proc/{pid}/status").read_text(encoding="utf-8")
    except OSError:
        return 0.0
    return next((int(line.split()[1]) / 1024 for line in text.splitlines() if line.startswith("VmRSS")), 0.0)


def _children(pid: int) -> list[int]:
    """The processes that any thread of a process started."""
    found = []
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(OSError):
            found += [int(each) for each in path.read_text(encoding="utf-8").split()]
    return sorted(found)


def hash_of(folder: Path) -> str:
    """Digest of all rows of a study, sorted by run."""
    rows = read_study(folder)
    return sha256(pd.util.hash_pandas_object(rows, index=False).to_numpy().tobytes()).hexdigest()[:16]


def parts(folder: Path) -> int:
    """The number of parts that are written."""
    return sum(1 for _ in folder.glob("part-*.parquet"))


def start(file: Path, folder: Path, *options: str) -> subprocess.Popen[bytes]:
    """The command that runs a study."""
    command = [sys.executable, "-m", "msfp_gen", "study", str(file), "-o", str(folder), *options]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def kills(folder: Path, runs: int) -> Iterator[str]:
    """A study that is killed five times at random moments against one that is not, and the memory of the latter."""
    file, whole, killed = folder / "study.toml", folder / "whole", folder / "killed"
    file.write_text(dumps(planar(runs)), encoding="utf-8")
    total, memory = load_study(file).chunks, Memory()
    process = start(file, whole)
    while process.poll() is None:
        memory.add(parts(whole) / total, process.pid)
        time.sleep(0.5)
    rng = random.Random(1)
    for index, share in enumerate(sorted(rng.uniform(0.02, 0.9) for _ in range(KILLS))):
        process = start(file, killed)
        while parts(killed) < share * total and process.poll() is None:
            time.sleep(0.01)
        time.sleep(rng.uniform(0.0, 0.2))
        workers = _children(process.pid)
        if index % 2 and workers and process.poll() is None:
            os.kill(workers[-1], signal.SIGKILL)
        else:
            process.kill()
        process.wait()
    done = parts(killed)
    assert start(file, killed).wait() == 0
    same = hash_of(whole) == hash_of(killed)
    yield (
        f"{runs} runs, {KILLS} `kill -9` of the study or a worker at random moments (the last with {done} of {total} "
        f"parts) | tables equal: {same}"
    )
    early, late = memory.between(0.05, 0.25), memory.between(0.75, 1.0)
    yield f"resident memory of all processes in the last quarter of {runs} runs over that in the first | {late / early:.2f}"


def shards(folder: Path, runs: int) -> Iterator[str]:
    """Two shards at the same time against one run."""
    file, whole, halves = folder / "study.toml", folder / "whole", folder / "halves"
    runs = max(runs // 10, 2)
    file.write_text(dumps(planar(runs)), encoding="utf-8")
    assert start(file, whole).wait() == 0
    both = [start(file, halves, "--shard", f"{i}/2", "--workers", "1") for i in (1, 2)]
    assert [process.wait() for process in both] == [0, 0]
    yield f"{runs} runs in two shards at the same time | tables equal: {hash_of(whole) == hash_of(halves)}"


def dask(folder: Path, runs: int) -> Iterator[str]:
    """A Dask cluster of which a worker is killed against a local run."""
    if not installed("distributed", "a study on Dask of which a worker is killed"):
        return
    from threading import Thread

    from distributed import LocalCluster

    runs = max(runs // 10, 2)
    chunk = max(1, min(64, runs // 40))
    table, whole, cluster_folder = planar(runs, chunk=chunk), folder / "whole", folder / "dask"
    msfp_gen.study(table, whole)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster:
        victim = next(iter(cluster.workers.values())).pid

        def kill() -> None:
            while parts(cluster_folder) < min(20, runs // chunk // 2):
                time.sleep(0.005)
            os.kill(victim, signal.SIGKILL)

        Thread(target=kill, daemon=True).start()
        msfp_gen.study(table, cluster_folder, dask=cluster.scheduler_address)
    yield f"{runs} runs on Dask, one worker killed | tables equal: {hash_of(whole) == hash_of(cluster_folder)}"


def rate(folder: Path) -> float:
    """Runs per second from the first part to the last: without the start of the processes."""
    times = sorted((path.stat().st_mtime, path) for path in folder.glob("part-*.parquet"))
    counted = sum(len(pd.read_parquet(path, columns=["run"])) for _, path in times[1:])
    return counted / (times[-1][0] - times[0][0])


def cores(folder: Path, _: int) -> Iterator[str]:
    """Runs per second by number of workers over those of one, in threads, in processes and as chosen."""
    counts, kinds = worker_counts()[1:], {"planar": planar(pick(8192, 64)), "10 ms": ten_ms(pick(1024, 64), chunk=8)}
    for kind, table in kinds.items():
        found: dict[tuple[str, int], float] = {}
        for number in range(pick(3, 1)):
            for each, workers in [("threads", 1), *product(WAYS, counts)]:
                out = folder / f"{kind}-{each}-{workers}-{number}"
                with way(each):
                    msfp_gen.study(table, out, workers=workers)
                found[each, workers] = max(found.get((each, workers), 0.0), rate(out))
        one = found.pop(("threads", 1))
        ratios = ", ".join(f"{each} {workers}: {value / one:.2f}" for (each, workers), value in found.items())
        yield f"runs per second over those of one worker ({one:.0f} runs/s), {kind} runs | {ratios}"


def overhead(folder: Path, _: int) -> Iterator[str]:
    """CPU time of Python around runs, alone and in a study on one worker, and the time of a first run; best of rounds."""
    for name, table in {"planar runs": planar(pick(512, 32)), "spatial runs": ten_ms(pick(128, 16), chunk=32)}.items():
        study = load_study(table)
        scenes = [study.scene(run) for run in range(1, study.runs + 1)]
        steps, loops, studies = [], [], []
        for number in range(pick(5, 1)):
            begin = time.process_time()
            runs = [simulate(scene) for scene in scenes]
            loops.append(time.process_time() - begin)
            steps.append(sum(run.counters.wall_time for run in runs))
            begin = time.process_time()
            msfp_gen.study(study, folder / f"{name} {number}", workers=1)
            studies.append(time.process_time() - begin)
        integrated, run, row = (1e3 * min(each) / len(scenes) for each in (steps, loops, studies))
        text = f"{name}: integration, the rest of `simulate`, the rest of a row of a study on one worker"
        yield f"{text} | {integrated:.2f}, {run - integrated:.2f}, {row - run:.2f} ms"
    command = [sys.executable, "-c", "import msfp_gen as m; m.simulate(m.load_scene('fenz-test2'))"]
    firsts = []
    for _ in range(pick(5, 1)):
        begin = time.perf_counter()
        subprocess.run(command, check=True)
        firsts.append(time.perf_counter() - begin)
    yield f"a new process that imports the package and runs a preset, its model in the cache | {min(firsts):.2f} s"


def fragilities(folder: Path, _: int) -> Iterator[str]:
    """Demand over a lognormal capacity of median 1.2 and dispersion 0.4: how often the 95 % intervals hold these."""
    axes = {
        "capacity": {"distribution": "lognormal", "median": 1.2, "dispersion": 0.4},
        "scale": {"distribution": "uniform", "low": 0.3, "high": 3.0},
    }
    held = {"median": 0, "dispersion": 0}
    seeds = pick(20, 1)
    for seed in range(seeds):
        sampling = {"samples": 300, "seed": seed, "method": "random"}
        table = planar(300, axes=axes, sampling=sampling, quantities={"ratio": "scale / capacity"})
        msfp_gen.study(table, folder / str(seed), workers=1)
        state = fragility(read_study(folder / str(seed)), "scale", "ratio", [1.0]).states[0]
        held["median"] += state.median_interval[0] <= 1.2 <= state.median_interval[1]
        held["dispersion"] += state.dispersion_interval[0] <= 0.4 <= state.dispersion_interval[1]
    yield f"{seeds} studies of 300 runs with a known fragility: 95 % intervals that hold it | {json.dumps(held)}"


PROOFS: dict[str, Callable[[Path, int], Iterator[str]]] = {
    "kills": kills,
    "shards": shards,
    "dask": dask,
    "cores": cores,
    "overhead": overhead,
    "fragility": fragilities,
}


def main() -> None:
    """Print the rows of the chosen proofs."""
    options = parser(__doc__)
    options.add_argument("proofs", nargs="*", metavar="PROOF", help=", ".join(PROOFS))
    options.add_argument(
        "--runs", type=int, default=pick(100_000, 200), help="runs of `kills`; a tenth of them elsewhere"
    )
    given = options.parse_args()
    if unknown := [name for name in given.proofs if name not in PROOFS]:
        options.error(f"{unknown[0]!r} is no proof; they are {', '.join(PROOFS)}")
    for name in given.proofs or PROOFS:
        with TemporaryDirectory() as folder:
            for row in PROOFS[name](Path(folder), given.runs):
                print(f"| {row} |", flush=True)


if __name__ == "__main__":
    main()
