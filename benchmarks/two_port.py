"""Cost of a trial of a two-port and of its derivatives, relative to a run: prints the table of docs/embedding.md.

A triple pendulum under 60 mm of motion of its upper end, committed in steps of a structural analysis: `python
benchmarks/two_port.py`.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from quick import parser, pick

from msfp_gen import Effects, Motion, Scene, Top, TwoPort, presets, simulate
from msfp_gen.common.arrays import Array

BEARING = presets.bearing("fenz-tfp").replace(contact_damping=1e-4)
LOAD, AMPLITUDE, PERIOD, DURATION = 112e3, 0.06, 2.0, pick(4.0, 0.4)
STEPS = pick((0.01, 0.005, 0.002), (0.01,))  # of the analysis [s]
STILL = np.zeros((3, 6))
REPEATS = pick(3, 1)  # the fastest counts


def end(at: float) -> Array:
    """Motion of an end along E1, shape (3, 6)."""
    w, out = 2 * np.pi / PERIOD, np.zeros((3, 6))
    s, c = np.sin(w * at), np.cos(w * at)
    out[:, 0] = AMPLITUDE * np.array([s**3, 3 * w * s**2 * c, 3 * w**2 * (2 * s * c**2 - s**3)])
    return out


def port() -> TwoPort:
    return TwoPort(BEARING, Top.node(1e8, 6.7e7, 1e6), LOAD)


def seconds(step: float, orders: tuple[str, ...] = ()) -> float:
    """CPU time of a committed step, with derivatives [s]."""
    two_port, count = port(), round(DURATION / step)
    ends = [end(step * i) for i in range(1, count + 1)]
    start = time.process_time()
    for i, upper in enumerate(ends, start=1):
        response = two_port.trial(step * i, STILL, upper)
        for order in orders:
            getattr(response, order)
        two_port.commit()
    return (time.process_time() - start) / count


def run_seconds(step: float) -> float:
    """CPU time of a run of the same relative motion, over its number of analysis steps [s]."""
    times = np.arange(round(DURATION / step) + 1) * step
    motion = Motion.from_arrays(times, np.array([-end(at)[0, :3] for at in times]))
    scene = Scene(BEARING, motion, Top.rig(LOAD, 1e8, 0.0, 1e6, vertical_stiffness=6.7e7), Effects())
    start = time.process_time()
    simulate(scene)
    return (time.process_time() - start) / (len(times) - 1)


def main() -> None:
    """Print the table."""
    parser(__doc__).parse_args()
    heads = (
        "step of the analysis",
        "trial, over the same time of a run",
        "tangent, over trial",
        "all three, over trial",
    )
    rows = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for step in STEPS:
        trial = min(seconds(step) for _ in range(REPEATS))
        tangent = min(seconds(step, ("tangent",)) for _ in range(REPEATS)) - trial
        everything = min(seconds(step, ("tangent", "damping", "inertia")) for _ in range(REPEATS)) - trial
        run = min(run_seconds(step) for _ in range(REPEATS))
        rows.append(f"| {1e3 * step:g} ms | {trial / run:.1f} | {tangent / trial:.1f} | {everything / trial:.1f} |")
    sys.stdout.write("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
