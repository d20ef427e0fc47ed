"""Time single evaluations of compiled models: `python benchmarks/kernels.py`, two tables of docs/performance.md.

It compares a Newton iteration of the default method (residual, tangent, solve) with CasADi's C, if that is installed; the
accelerations with the articulated-body recursion of the same chain; and iteration and build for few and many bodies.
States are from runs in which all surfaces move; times are nanoseconds of CPU time, the best of many.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import casadi_peer
import numpy as np
from quick import installed, parser, pick
from runs import row

from msfp_gen import Bearing, Body, Effects, Layout, Motion, Scene, Surface, Top, build_model, load_scene, simulate
from msfp_gen.jit.compiler import FLAGS, find_compiler
from msfp_gen.model.compiled import bodies_and_surfaces, top_values
from msfp_gen.scene.top import load_values

HERE = Path(__file__).parent
FULL = Effects()
BETA = 1.5e-3  # gamma h of a step on a record [s]
# Symbols of the generator for the values of a surface and of the top, in the order of `msfp_gen.specification.contract`.
SURFACE_SYMBOLS = ("R", "sc", "mu", "dy", "kc", "cc", "td")
TOP_SYMBOLS = ("k", "c", "kr", "cr", "kv", "cv", "m", "jt", "ja", "h", "x0x", "x0y")
ROUNDS = pick(5, 1)


class State(NamedTuple):
    """The input of `c/kernels.c`, by name."""

    bodies: np.ndarray
    surfaces: np.ndarray
    top: np.ndarray
    base: np.ndarray
    load: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    f: np.ndarray


def compiled(main: Path, target: Path, folder: Path | None = None) -> Path:
    """Compile `main` with the sources of a built model, with the flags of the model; returns the program."""
    units = [] if folder is None else [str(p) for p in folder.glob("*.c") if not p.name.startswith("msfp_")]
    found = [] if folder is None else ["-I", str(folder)]
    command = [
        *find_compiler().command,
        *FLAGS["c"],
        *FLAGS["user"],
        *found,
        str(main),
        *units,
        "-o",
        str(target),
        "-lm",
    ]
    subprocess.run(command, check=True)
    return target


def state_of(scene: Scene) -> State:
    """The state in the first half of the run at which the slowest surface slides fastest."""
    history = simulate(scene).history
    speed = np.abs(history.slip_velocity).min(axis=1).max(axis=1)
    i = int(np.argmax(speed[: len(speed) // 2]))
    motion, t = scene.motion, float(history.time[i])
    bodies, surfaces = bodies_and_surfaces(scene.bearing, scene.effects)
    top = top_values(scene.top, motion.displacement(0.0)[:2])
    base = np.array([motion.evaluate(t, order) for order in range(3)])
    return State(
        bodies,
        surfaces,
        top,
        base,
        load_values(scene.top),
        history.tilt_angles[i],
        history.tilt_rates[i],
        history.tilt_accelerations[i],
        history.friction_state[i],
    )


def prepared(scene: Scene, state: State) -> tuple[str, Path]:
    """The input of `c/kernels.c` as text, and the folder of the built model."""
    model = build_model(scene.bearing.layout, scene.effects)
    text = " ".join(repr(float(x)) for value in (BETA, scene.bearing.gravity, *state) for x in np.ravel(value))
    return text, model.info.folder


def timed(scene: Scene, state: State) -> list[float]:
    """Times of residual, tangent, Newton iteration and accelerations [ns]."""
    text, sources = prepared(scene, state)
    with tempfile.TemporaryDirectory() as folder:
        program = compiled(HERE / "c" / "kernels.c", Path(folder) / "kernels", sources)
        done = subprocess.run([program], input=text, text=True, capture_output=True, check=True)
    return [float(word) for word in done.stdout.split()]


CASES = {
    "spatial, inertial": FULL,
    "spatial, massless": replace(FULL, sliders="massless"),
    "planar, inertial": replace(FULL, dimension="planar"),
    "planar, massless": replace(FULL, dimension="planar", sliders="massless", rims=False),
}


def deep(layout: Layout) -> Scene:
    """A scene on a circular path with a stack of any number of bodies, whose radii decrease towards the middle."""
    radii = [2.0 * 0.8**k for k in range(layout.m)] + [2.0 * 0.8**k for k in range(layout.p)][::-1]
    bearing = Bearing(
        layout,
        0.06,
        [Surface(r, 0.15, 0.05, 5e-4, 1e8, 1e4) for r in radii],
        [Body(0.06, 0.03, 50.0, (0.5, 0.8), 0.1, 0.003) for _ in radii],
    )
    return Scene(
        bearing=bearing, motion=Motion.circle(0.05, 3.0, cycles=0.5), effects=FULL, top=Top.rig(1e6, 1e9, 1e5, 1e9, 1e5)
    )


def numbers(scene: Scene, state: State) -> dict[tuple[str, int, str], float]:
    """Parameters of the graph of CasADi, by record, index and field."""
    out: dict[tuple[str, int, str], float] = {("beta", 0, ""): BETA}
    layout, g = scene.bearing.layout, scene.bearing.gravity
    signs = (*layout.signs, 0)
    for axis, name in enumerate("xyz"):
        out["load", 0, name] = state.load[axis]
        out |= {("base", 0, f"{letter}{name}"): state.base[order, axis] for order, letter in enumerate("CVA")}
    for k in range(1, layout.n):
        height, centroid, mass, transverse, axial = state.bodies[k, :5]
        sign, above = signs[k - 1], signs[k]
        bottom = -sign * state.surfaces[k - 1, 0]
        c = bottom + (centroid if sign > 0 else height - centroid)
        e = bottom + height + (above * state.surfaces[k, 0] if above else 0.0)
        values = {"c": c, "e": e, "m": mass, "jt": transverse, "ja": axial, "g": g}
        out |= {("body_parameters", k, name): value for name, value in values.items()}
        for i, name in enumerate(("psi", "theta")):
            out["Q", k - 1, name] = state.q[k - 1, i] - BETA * state.v[k - 1, i]
            out["V", k - 1, name] = state.v[k - 1, i] - BETA * state.a[k - 1, i]
        for i, name in enumerate("YZ"):
            out["fp", k - 1, name] = state.f[k - 1, i]
        values = dict.fromkeys(("rs", "pr", "ks", "cs", "ca", "sa"), 0.0) | {"sign": sign}  # rims are left out
        values |= dict(zip(SURFACE_SYMBOLS, state.surfaces[k - 1], strict=True))
        out |= {("surface_parameters", k - 1, name): value for name, value in values.items()}
    values = dict(zip(TOP_SYMBOLS, state.top, strict=True)) | {"g": g, "mz": state.top[6], "x0z": 0.0, "sr": 1.0}
    return out | {("top_parameters", 0, name): value for name, value in values.items()}


def against_casadi(scene: Scene, state: State, ours: float) -> None:
    """Print the time of one Newton iteration by CasADi's C, with the flags of this project and with -march=native."""
    if not installed("casadi", f"CasADi beside a Newton iteration of {ours:.0f} ns"):
        return
    unknowns = [*state.v[:, :2].ravel(), *state.f.ravel()]
    given, times = numbers(scene, state), []
    for flags in ((), ("-O3", "-march=native", "-ffp-contract=fast")):
        with tempfile.TemporaryDirectory() as folder:
            seconds, residual = casadi_peer.timed(scene, given, unknowns, Path(folder), flags)
        times.append(seconds)
    model = build_model(scene.bearing.layout, scene.effects)
    stack = model.stack(scene.bearing, scene.top, anchor=scene.motion.displacement(0.0)[:2])
    # With beta = 0 the condensed residual is at the given Y, Z, so the moments of both must agree.
    expected = stack.condensed(state.q, state.v, state.a, state.f, state.base, state.load, BETA, 1.0, 1.0 / BETA, 0.0)[
        1
    ]
    moment = np.abs(state.load).max() * state.surfaces[:, 0].max()  # of the terms, which cancel near a solution
    difference = np.abs(residual[: len(expected)] - expected).max() / moment
    if difference > 1e-12:
        raise SystemExit("CasADi computes another residual: the times cannot be compared")
    row(
        "one Newton iteration (residual, tangent, solve), TFP: CasADi's C with a dense solve",
        f"{ours:.0f} ns",
        f"{times[0]:.0f} ns; {times[1]:.0f} ns with `-O3 -march=native`; residuals differ by {difference:.0e} of load times radius",
        f"{times[0] / ours:.1f} times faster; {times[1] / ours:.1f}",
    )


def against_the_recursion(ours: float) -> None:
    """Print the time of accelerations and of the articulated-body recursion in C, with given moments of the surfaces."""
    with tempfile.TemporaryDirectory() as folder:
        program = compiled(HERE / "c" / "recursion.c", Path(folder) / "recursion")
        theirs = float(subprocess.run([program], text=True, capture_output=True, check=True).stdout.split()[0])
    row(
        "accelerations, TFP: articulated-body recursion of the same chain in C, with given moments of the surfaces",
        f"{ours:.0f} ns",
        f"{theirs:.0f} ns",
        f"{ours / theirs:.1f} times slower",
    )


def against_depth() -> None:
    """Print the times of Newton iteration and build for ten surfaces and for four."""
    small, large = (deep(Layout(*counts)) for counts in ((5, 2, 2), (11, 5, 5)))
    states = [(scene, state_of(scene)) for scene in (small, large)]
    few, many = np.min([[timed(*each)[2] for each in states] for _ in range(ROUNDS)], axis=0)  # in turn
    row(
        "one Newton iteration, (11,5,5): (5,2,2)", f"{many:.0f} ns", f"{few:.0f} ns", f"{many / few:.1f} times the time"
    )
    few, many = np.min(
        [[build_seconds(scene.bearing.layout) for scene in (small, large)] for _ in range(pick(3, 1))], axis=0
    )
    text = "derive, emit and compile, CPU time, (11,5,5): (5,2,2)"
    row(text, f"{many:.2f} s", f"{few:.2f} s", f"{many / few:.2f} times the time")


BUILD = """
import resource, sys
from msfp_gen import Layout, build_model
def cpu():
    return sum(u.ru_utime + u.ru_stime for u in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))
begin = cpu()
build_model(Layout(*map(int, sys.argv[1:])))
print(cpu() - begin)
"""


def build_seconds(layout: Layout) -> float:
    """CPU time of `build_model` into an empty cache, with the compiler [s]."""
    with tempfile.TemporaryDirectory() as cache:
        command = [sys.executable, "-c", BUILD, str(layout.n), str(layout.m), str(layout.p)]
        done = subprocess.run(
            command, env={**os.environ, "MSFP_GEN_CACHE": cache}, text=True, capture_output=True, check=True
        )
    return float(done.stdout)


def main() -> None:
    """Print the table of the models, then the comparisons."""
    parser(__doc__).parse_args()
    print("| effects, fenz-test2 | value [ns] | tangent [ns] | Newton iteration [ns] | accelerations [ns] |")
    print("|---|---|---|---|---|")
    for name, effects in CASES.items():
        scene = replace(load_scene("fenz-test2"), effects=effects)
        found = timed(scene, state_of(scene))
        print(f"| {name} | " + " | ".join("" if ns < 0 else f"{ns:.0f}" for ns in found) + " |", flush=True)
    scene = replace(load_scene("fenz-test2"), effects=FULL)
    state = state_of(scene)
    ours = timed(scene, state)
    print("\n| what is compared | msfp-gen | the other | ratio |\n|---|---|---|---|")
    against_casadi(scene, state, ours[2])
    against_the_recursion(ours[3])
    against_depth()


if __name__ == "__main__":
    main()
