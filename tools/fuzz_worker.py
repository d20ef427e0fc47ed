"""One worker of the fuzz campaign: reads lines "run NUMBER" or "check NUMBER" and answers each with a line of JSON.

fuzz.py starts it, and kills it if it hangs.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_balance import verified
from fuzz_combined import case as combined_case
from fuzz_scenes import case, load_of, sensible
from fuzz_second import Second

from msfp_gen import InputError, RunError, Scene, simulate
from msfp_gen.results.result import Result
from msfp_gen.scene.top import MassTop

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))
from quick import parser

MEMORY = 4 << 30  # memory limit [bytes]; a run that needs more ends with a named failure
ROWS = 8  # rows of a run that the second method repeats
NAMES = ("newton", "step", "irregular", "uplift", "angle", "steps", "separated", "monitor", "stiff", "law")


def not_finite(result: Result) -> list[str]:
    """Names of arrays with values that are not finite."""
    arrays = {**vars(result.history), **result.history.energy}
    return [name for name, values in arrays.items() if isinstance(values, np.ndarray) and not np.isfinite(values).all()]


def wrong(result: Result) -> list[str]:
    """Violations of conditions that every successful run must meet."""
    history, energy, rtol = result.history, result.history.energy, result.scene.solver.rtol
    surfaces = result.scene.bearing.surfaces
    rise = sum(float(s.max()) ** 2 / (2 * x.radius) for s, x in zip(history.sliding.T, surfaces, strict=True))
    # The input alone is no measure: it is the difference of the work of load and base, and nearly zero where springs that
    # were deformed at the start supply what the dampers dissipate.
    terms = [float(np.abs(values).max()) for name, values in energy.items() if name != "numerical"]
    peak = max(*terms, load_of(result.scene.top) * rise, 1e-12)
    unresolved = (
        3
        * float(history.normal_force.max())
        * result.scene.solver.angle_tolerance
        * max(s.friction * s.radius for s in surfaces)
    )
    found = []
    closure = float(np.abs(energy["numerical"]).max())
    if closure > max(0.03, 30 * rtol) * peak + unresolved and "energy" not in {note.kind for note in result.notes}:
        found.append(f"energy {closure / peak:.2g}")
    disc = float(np.linalg.norm(history.friction_state, axis=2).max()) - 1
    # The error control permits one tolerance beyond the unit disc per step; sliding corrects it within some steps.
    if disc > max(10 * rtol, 1e-9):
        found.append(f"disc {disc / rtol:.3g} rtol")
    if history.rim_force.min() < 0 or history.rim_force[history.gap > 0].any():
        found.append("rim")
    if history.normal_force.min() < 0 or (
        history.normal_force.min() == 0 and "uplift" not in result.provenance["model"]
    ):
        found.append("normal")
    rest = (result.scene.output_step or 0.0) * (1 + 1e-9)
    if result.status == "ok" and abs(history.time[-1] - result.scene.end) > rest + 1e-9:
        found.append("end")
    return found


def run(scene: Scene, verify: bool = False) -> dict[str, Any]:
    """Run one scene: its status, message, counters and violations. verify: check its rows and steps as well."""
    begin = time.perf_counter()
    result, message = None, ""
    try:
        result = simulate(scene)
        status = result.status
    except RunError as error:
        status, message = error.status, str(error)
        result = error.result if isinstance(error.result, Result) else None
        if status not in NAMES or "stopped at t = " not in message:
            status = f"unnamed {status}"
    except InputError as error:
        status, message = "refused", str(error)
    out: dict[str, Any] = {"status": status, "message": message, "wall": time.perf_counter() - begin}
    if result is not None:
        out["beyond"] = isinstance(scene.top, MassTop) and bool(result.summary["rims_met"])
        out["counts"] = {k: v for k, v in asdict(result.counters).items() if k != "wall_time"}
        out["noted"] = "energy" in {note.kind for note in result.notes}
        out["not_finite"] = not_finite(result)
        if result.succeeded:
            out["wrong"] = wrong(result)
        if verify:
            found = verified(scene, result)
            out |= found | {"wrong": out.get("wrong", []) + found["wrong"]}
    return out


def describe(scene: Scene) -> dict[str, Any]:
    """Properties of a scene, and whether the second method covers all of its effects."""
    effects = scene.effects
    return {
        "spec": scene.spec.key,
        "top": scene.top.kind,
        "method": scene.solver.method,
        "sensible": sensible(scene),
        "checkable": effects.friction == "constant" and not effects.uplift,
    }


def check(seed: int, number: int, short: bool) -> dict[str, Any]:
    """Repeat a few rows of a run by the second method, from a random row.

    `deviation` is the largest difference over the permitted one; at most 1 if both agree. Permitted is the tolerance of
    the run per row, plus three times the change of the second method under halved steps.
    """
    scene = case(seed, number, short).scene
    if scene.effects.dimension == "planar":  # psi and theta in an oblique plane include a small twist
        scene = replace(scene, motion=scene.motion.rotated(-(scene.motion.plane() or 0.0)))
    run = simulate(replace(scene, output_step=None))
    history, solver = run.history, run.scene.solver
    last = max(1, len(history.time) - ROWS)
    first = int(np.random.default_rng([seed, number]).integers(last))
    rows = range(first, min(first + ROWS, len(history.time)))
    second = Second(run.scene)
    try:
        whole = second.march(history, rows)
        halved = second.march(history, rows, halved=True)
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        return {"number": number, "status": "no verdict", "message": str(error)}
    compared = slice(rows[1], rows[-1] + 1)
    angles = solver.rtol * float(np.abs(history.tilt_angles).max()) + solver.angle_tolerance
    parts = {
        "angles": (history.tilt_angles[compared], halved.q, whole.q, angles),
        "friction": (history.friction_state[compared], halved.f, whole.f, 10 * solver.rtol),
        "force": (history.top_force[compared], halved.force, whole.force, 10 * solver.rtol * second.size),
    }
    over = {
        name: float(np.abs(run_ - best).max() / (len(rows) * unit + 3 * np.abs(best - coarse).max()))
        for name, (run_, best, coarse, unit) in parts.items()
    }
    worst = max(over.values())
    return {"number": number, "agrees": worst <= 1.0, "deviation": worst, **over}


def main() -> None:
    """Read tasks from standard input, write lines of JSON to standard output."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    options = parser(__doc__)
    options.add_argument("seed", nargs="?", type=int, default=1)
    options.add_argument("which", nargs="?", default="short")
    given = options.parse_args()
    seed, which = given.seed, given.which
    short = which == "short"
    for line in sys.stdin:
        task, number = line.split()[0], int(line.split()[1])
        if task == "check":
            print(json.dumps(check(seed, number, short)), flush=True)
            continue
        if which == "combined":
            scene = combined_case(seed, number).scene
            row = {"number": number, "spec": scene.spec.key, "checkable": False, **run(scene, verify=True)}
            print(json.dumps(row), flush=True)
            continue
        scene = case(seed, number, short).scene
        if which == "sensible" and not sensible(scene):
            print(json.dumps({"number": number, "status": "passed over"}), flush=True)
            continue
        row = {"number": number, **describe(scene), **run(scene)}
        row["sensible"] = row["sensible"] and not row.get(
            "beyond", False
        )  # except a mass whose resonance reaches the rims
        print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
