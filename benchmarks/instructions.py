"""Count the instructions of kernels and runs: `python benchmarks/instructions.py`, some minutes, with valgrind installed.

callgrind counts, so the numbers do not depend on the load of the machine. It does not support AVX-512, so the models are
compiled for AVX2 (level 3 of x86-64). For a run it counts the loop in C (`msfp_run_advance` of the model), for a kernel
one call. A table of docs/performance.md.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import embedding_ports
import kernels
from quick import parser, pick

from msfp_gen import Layout, Scene, load_scene
from msfp_gen.embedding.library import export_library
from msfp_gen.jit.compiler import FLAGS, find_compiler

CALLS = pick(200, 2)
RUN = """
import sys
from dataclasses import replace
sys.path.insert(0, {folder!r})
from plain import plain_scene
from msfp_gen import Effects, simulate
scene = plain_scene({name!r})
simulate(replace(scene, effects=Effects(**{effects!r}), solver=replace(scene.solver, rtol={rtol}), output_step=None))
"""
RUNS = {
    "`fenz-test2` at 1e-4": ("fenz-test2", {}, 1e-4),
    "the same, planar and massless, no rims": (
        "fenz-test2",
        {"dimension": "planar", "sliders": "massless", "rims": False},
        1e-4,
    ),
    "`ridgecrest-clc` at 3e-3": ("ridgecrest-clc", {}, 3e-3),
}
AVX2 = "-UMSFP_X86_64_LEVEL -DMSFP_X86_64_LEVEL=3"
KERNELS = ("one value of the residual", "one residual with its tangent", "one Newton iteration", "accelerations")


def instructions(command: list[str], within: str, given: str = "") -> int:
    """Instructions of a command inside the function `within` and the functions it calls."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        callgrind = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", f"--toggle-collect={within}"]
        subprocess.run([*callgrind, *command], input=given, text=True, check=True, capture_output=True)
        found = re.search(r"^summary: (\d+)", out.read_text(), re.MULTILINE)
    if found is None:
        raise SystemExit(f"callgrind counted nothing inside {within}")
    return int(found[1])


def of_kernels(scene: Scene) -> list[float]:
    """Instructions of one call of each kernel, at a state of the scene."""
    text, folder = kernels.prepared(scene, kernels.state_of(scene))
    with tempfile.TemporaryDirectory() as target:
        program = str(kernels.compiled(kernels.HERE / "c" / "kernels.c", Path(target) / "kernels", folder))
        return [instructions([program, str(CALLS), str(i)], "repeated", text) / CALLS for i in range(len(KERNELS))]


def of_two_port() -> tuple[float, float]:
    """Instructions of a trial of 10 ms of a two-port, and of one of its derivatives."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        export_library([embedding_ports.SPEC], folder / "msfp")
        embedding_ports.headers(folder)
        includes = [f"-I{folder}", f"-I{folder / 'msfp/include'}"]
        library = [str(folder / "msfp/lib/libmsfp.a"), *FLAGS["libraries"], "-o", str(folder / "port")]
        source = str(embedding_ports.HERE / "c" / "port.c")
        subprocess.run([*find_compiler().command, "-std=c99", "-O2", *includes, source, *library], check=True)
        given = embedding_ports.numbers()
        count = int(given["count"] * given["rounds"])
        trials, derivatives = (
            instructions([str(folder / "port")], f"msfp_5_2_2_api_port_{call}") for call in ("trial", "derivative")
        )
    return trials / (2 * count), derivatives / count


def main() -> None:
    """Print one row per run and kernel."""
    parser(__doc__).parse_args()
    if not shutil.which("valgrind"):
        print("left out, since valgrind is not installed: instructions of runs and kernels")
        return
    print("| what | instructions |\n|---|---|")
    for text, (name, effects, rtol) in pick(list(RUNS.items()), list(RUNS.items())[:1]):
        program = RUN.format(folder=str(Path(__file__).parent), name=name, effects=effects, rtol=rtol)
        os.environ["MSFP_GEN_CFLAGS"] = AVX2  # of the processes that follow
        subprocess.run([sys.executable, "-c", program], check=True)  # builds the model
        count = instructions([sys.executable, "-c", program], "msfp_5_2_2_run_advance")
        print(f"| {text} | {count / 1e6:.1f} million |", flush=True)
    tfp = replace(load_scene("fenz-test2"), effects=kernels.FULL)
    few, many = of_kernels(tfp), of_kernels(kernels.deep(pick(Layout(11, 5, 5), Layout(5, 2, 2))))
    for text, count, more in zip(KERNELS, few, many, strict=True):
        print(f"| {text}, TFP; (11,5,5) | {count / 1e3:.1f} thousand; {more / 1e3:.1f} ({more / count:.1f} times) |")
    trial, derivative = of_two_port()
    print(f"| derivative of a two-port after a trial of 10 ms | {derivative / trial:.1f} times the trial |")


if __name__ == "__main__":
    main()
