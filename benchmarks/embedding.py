"""Cost of a step of a triple pendulum by every way: `python benchmarks/embedding.py`. Tables of docs/embedding.md.

First the example of an exported library, run in C and in Python: CPU time of a step, the best of many, and the ratio to
C. Then a two-port in steps of an analysis by every way (`embedding_ports.py`): with gfortran, fmpy and openseespy where
they are installed. Derivatives and lengths of steps in detail: `two_port.py`; states and Model Exchange: `fmu.py`.
"""

from __future__ import annotations

import re
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import process_time_ns

import numpy as np
from embedding_ports import doors, worked_example
from quick import parser, pick

from msfp_gen import Layout, build_model
from msfp_gen.embedding import values
from msfp_gen.embedding.library import export_library
from msfp_gen.jit.compiler import FLAGS, find_compiler
from msfp_gen.specification.layout import ModelSpec

HERE = Path(__file__).parent
ROUNDS = pick(200, 1)
SPEC = ModelSpec(Layout.tfp())


def in_c() -> list[float]:
    """Times of `c/steps.c`: rows kept; handed to a callback; one step a call."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        export_library([SPEC], folder / "msfp")
        example = (folder / "msfp/share/msfp/examples/example.c").read_text(encoding="utf-8")
        pattern = r'^#include "msfp_.*?$|static const double (?:bodies|surfaces|top).*?^};'
        parts = re.findall(pattern, example, flags=re.DOTALL | re.MULTILINE)
        (folder / "values.h").write_text("\n".join(parts) + "\n", encoding="utf-8")
        includes = [f"-I{folder}", f"-I{folder / 'msfp/include'}"]
        library = [str(folder / "msfp/lib/libmsfp.a"), *FLAGS["libraries"], "-o", str(folder / "steps")]
        command = [*find_compiler().command, "-std=c99", "-O2", *includes, str(HERE / "c" / "steps.c"), *library]
        subprocess.run(command, check=True)
        printed = subprocess.run([str(folder / "steps")], check=True, capture_output=True, text=True).stdout
    return [float(word) for word in printed.split()]


def in_python(steps: int) -> float:
    """The same run by the module of the model, `steps` steps a call."""
    module = build_model(SPEC.layout, SPEC.effects).extension
    found = values.example(SPEC)
    stack = module.Stack(values.GRAVITY, *(np.array(rows) for rows in (found.bodies, found.surfaces, found.top)))
    knots, motion, load = np.array([0.0, values.DURATION]), np.zeros((1, 6, 6)), np.zeros((1, 6, 6))
    motion[0, 0, 2], load[0, 2, 0] = 0.5 * values.ACCELERATION, -values.LOAD
    state = np.zeros((4, 3)), np.zeros((4, 3)), np.zeros((4, 2))

    def once() -> float:
        begin = process_time_ns()
        run = module.Run(stack, knots, motion, knots, load, np.zeros(0), *state, duration=values.DURATION)
        while run.advance(steps):
            pass
        return (process_time_ns() - begin) / run.counts["steps"]

    return least(once)


def least(once: Callable[[], float]) -> float:
    """The least value of many calls."""
    return min(once() for _ in range(ROUNDS))


def main() -> None:
    """Print the tables."""
    parser(__doc__).parse_args()
    kept, callback, single = in_c()
    rows = {
        "C, rows kept": kept,
        "C, rows handed to a callback": callback,
        "C, one step a call": single,
        "Python, `Run.advance(1000)`": in_python(1000),
        "Python, `Run.advance(1)`": in_python(1),
    }
    print("| | microseconds a step | over C |\n|---|---|---|")
    for text, time in rows.items():
        print(f"| {text} | {1e-3 * time:.2f} | {time / kept:.2f} |")
    steps = doors()
    print("\n| | microseconds a step | over C | with the tangent, over C |\n|---|---|---|---|")
    for text, (plain, tangent) in steps.items():
        print(f"| {text} | {1e-3 * plain:.0f} | {plain / steps['C'][0]:.1f} | {tangent / steps['C'][0]:.1f} |")
    example = worked_example()
    print("\n| worked example | microseconds a step |\n|---|---|")
    for text, time in example.items():
        print(f"| {text} | {time:.0f} |")


if __name__ == "__main__":
    main()
