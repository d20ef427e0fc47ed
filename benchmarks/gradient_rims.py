"""Errors of derivatives after rim contacts, true and stated: `python benchmarks/gradient_rims.py`, some minutes.

Derivatives of sliding displacements and of the force with respect to the capacity of the surface whose rim is met, over
the largest of each, from some time after an event to the next one; and the error of the sliding displacements
themselves. Against the derivatives of a run at a tolerance of 1e-11, which are compared first with differences of such
runs. A table of docs/gradients.md.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from quick import parser, pick

from msfp_gen import Effects, Motion, Result, Scene, load_scene, simulate
from msfp_gen.scene.parameters import changed_parameters, parameters_of

TOLERANCES = pick((1e-4, 1e-5, 1e-6, 1e-8), (1e-4,))
TIGHT = {"rtol": 1e-11, "method": "esdirk4"}
BEFORE = 0.02  # from an event after it, by which differences are disturbed [s]
CHANGES = (1, 2, 4)  # of the differences, in steps of 5e-6 of the capacity


def preset(name: str, effects: Effects | None = None, **bearing: Any) -> Scene:
    """A preset without a stop condition, with other values of its bearing."""
    scene = load_scene(name)
    effects = scene.effects if effects is None else effects
    return replace(scene, bearing=scene.bearing.replace(**bearing), effects=effects, motion_table=None, stop=None)


def cycle(scene: Scene, amplitude: float, frequency: float, output_step: float) -> Scene:
    """The scene under one cycle of a displacement [m] at a frequency [1/s]."""
    motion = Motion.harmonic(amplitude, frequency, cycles=1.0)
    return replace(scene, motion=motion, duration=1.0 / frequency, output_step=output_step)


def scenes() -> dict[str, tuple[Scene, int, float]]:
    """By name: a scene, the surface whose capacity is the parameter, the time after an event that is left out [s]."""
    planar = Effects(dimension="planar", sliders="massless")
    single = preset("single-push", planar, rim_damping=0.0)
    single = replace(single, top=replace(single.top, damping=0.0, stiffness=1e9))
    double = preset("double-push", Effects(), capacity=[0.2, 0.1], contact_damping=2e-3)
    slow = replace(preset("fenz-test5", contact_damping=1e-3), duration=60.0, output_step=0.1)
    return {
        "single pendulum": (cycle(single, 0.4, 0.5, 0.02), 0, 0.01),
        "double pendulum": (cycle(double, 0.27, 0.2, 0.05), 1, 0.1),
        "test 5 of PEER 2017/07": (slow, 0, 0.7),
        "triple pendulum at 0.5 Hz": (cycle(preset("fenz-test2", contact_damping=1e-3), 0.12, 0.5, 0.02), 0, 0.1),
    }


def away(result: Result, after: float) -> Any:
    """Whether a row is away from events, shape (T,). after: an event [s]."""
    since = result.history.time - np.array([[event.time] for event in result.events])
    return ~np.any((since > -BEFORE) & (since < after), axis=0) & (result.history.time > 0)


def differences(scene: Scene, path: str) -> Any:
    """Richardson-extrapolated derivative of the sliding displacements."""
    (parameter,) = parameters_of(scene, [path])
    slopes = []
    for size in (5e-6 * k * parameter.value for k in CHANGES):
        pair = [changed_parameters(scene, {parameter: parameter.value + sign * size}) for sign in (1, -1)]
        above, below = (simulate(each).history.sliding for each in pair)
        slopes.append((above - below) / (2 * size))
    one, two, four = slopes
    fine, coarse = one + (one - two) / 3, two + (two - four) / 3
    return fine + (fine - coarse) / 15


def share(error: Any, of: Any) -> str:
    """The largest error over the largest value."""
    return f"{np.abs(error).max() / np.abs(of).max():.0e}"


def cells(scene: Scene, path: str, reference: Result, rows: Any) -> list[str]:
    """Errors of one run, true and stated: a row of the table."""
    result, exact = simulate(scene, gradients=[path]), reference.gradient
    found, covered = [], []
    for variable in ("sliding", "top_force"):
        of, stated = exact[variable].values[0][rows], result.gradient[f"{variable}_error"].values[0][rows]
        error = np.abs(result.gradient[variable].values[0][rows] - of)
        covered.append(error <= stated + 1e-6 * np.abs(of).max())
        found += [share(error, of), share(stated, of)]
    part = np.mean(np.concatenate([each.ravel() for each in covered]))
    response = reference.history.sliding[rows]
    return [*found, f"{part:.0%}", share(result.history.sliding[rows] - response, response)]


def main() -> None:
    """Print the table, and for each scene how well the derivatives of the tight run agree with differences."""
    parser(__doc__).parse_args()
    print("| scene | method | `solver.rtol` | sliding | stated | force | stated | covered | run |")
    print("|---|---|---|---|---|---|---|---|---|")
    agreement = {}
    for name, (scene, surface, after) in list(scenes().items())[: pick(None, 1)]:
        path = f"bearing.surfaces[{surface}].capacity"
        tight = replace(scene, solver=replace(scene.solver, **TIGHT))
        reference = simulate(tight, gradients=[path], gradient_errors=False)
        rows = away(reference, after)
        found = reference.gradient.sliding.values[0][rows]
        agreement[name] = share(differences(tight, path)[rows] - found, found)
        for method in ("implicit", "esdirk4"):
            for rtol in TOLERANCES:
                changed = replace(scene, solver=replace(scene.solver, rtol=rtol, method=method))
                row = cells(changed, path, reference, rows)
                print(f"| {name} | `{method}` | {rtol:g} | {' | '.join(row)} |", flush=True)
    print("\nDerivatives of sliding agree with differences:", agreement)


if __name__ == "__main__":
    main()
