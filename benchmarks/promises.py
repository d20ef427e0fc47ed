"""The error that `--error` states against the true one: prints a table of docs/accuracy.md.

`python benchmarks/promises.py`: some minutes. The true error is that of the run against `esdirk4` at 1e-6 or tighter,
which a run of the default method confirms; the table has the difference of the two, RMS.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

from quick import parser, pick

from msfp_gen import Effects, Load, Motion, RunError, Scene, Top, load_scene
from msfp_gen.studies.accuracy.error_target import simulate_within
from msfp_gen.studies.accuracy.measure import Errors, errors
from msfp_gen.studies.accuracy.trial import Trial, run_native

TARGET = 0.005
TIGHT = 1e-6  # tolerance of the reference run, or a tenth of that of the run, if this is less


def scenes() -> Iterator[tuple[str, Scene]]:
    """Name and scene: tests and orbits of PEER 2017/07, records, rims, light and heavy loads, uplift, a friction law."""
    for name in ("fenz-test1", "fenz-test3", "fenz-test5", "becker-circle-50", "becker-eight-125", "double-push"):
        yield name, replace(load_scene(name), stop=None)
    test = load_scene("fenz-test4")
    damped = test.bearing.replace(contact_damping=1e-4)
    yield "fenz-test4, damped", replace(test, bearing=damped)
    yield "light load", replace(test, bearing=damped, top=replace(test.top, axial_load=5e3))
    yield "heavy load", replace(test, bearing=damped, top=replace(test.top, axial_load=1e6))
    yield "heavy sliders, 18 Hz", heavy_sliders()
    varying = Load.harmonic((0.0, 0.0, 0.7 * 112e3), frequency=0.05, cycles=5.0, lead_in=20.0)
    yield "axial load varying by 70 %", replace(test, bearing=damped, load=varying)
    record = replace(load_scene("ridgecrest-clc"), duration=20.0)
    yield "ridgecrest-clc, 20 s", record
    yield "ridgecrest-ccc, 20 s", replace(load_scene("ridgecrest-ccc"), duration=20.0)
    law = record.bearing.replace(friction_slow=[0.04, 0.02, 0.02, 0.05], velocity_rate=50.0)
    yield "friction of velocity", replace(record, bearing=law, effects=replace(record.effects, friction="velocity"))
    shaken = Motion.harmonic(0.02, 2.0, cycles=4.0)
    tilting = Top.mass(11428.0, 300.0, 0.5, rotational_stiffness=1e7, rotational_damping=1e4)
    yield "uplift", Scene(record.bearing, shaken, tilting, effects=Effects(uplift=True, dimension="planar"))


def heavy_sliders() -> Scene:
    """Sliders so heavy under so small a load that they ring at 18 Hz: part of the motion, not noise above it."""
    test = load_scene("fenz-test2")
    bodies = [
        replace(body, mass=20.0 * body.mass, inertia=tuple(20.0 * each for each in body.moments))
        for body in test.bearing.bodies
    ]
    bearing = test.bearing.replace(bodies=bodies, contact_damping=1e-4)
    motion, top = Motion.harmonic(0.05, 0.5, cycles=3), replace(test.top, axial_load=1.15e3, damping=1e4)
    effects = Effects(dimension="planar")
    return replace(test, bearing=bearing, motion=motion, duration=None, top=top, effects=effects)


def largest(found: Errors) -> float:
    """Largest of the errors that `--error` bounds: RMS and peaks, of force and of sliding."""
    return max(found.worst_rms, found.force_peak, found.sliding_peak)


def truth(scene: Scene, tolerance: float) -> tuple[Trial, float]:
    """The reference run, and how far a second family of methods is from it, RMS."""
    reference, second = (run_native(method, scene, tolerance, 120.0, 0) for method in ("esdirk4", "implicit"))
    difference = errors(second, reference)
    return reference, float("nan") if difference is None else difference.worst_rms


def stated_and_true() -> Iterator[str]:
    """Rows of the table."""
    yield "| scene | stated | true, RMS | true, peaks | confirmed to | tolerance | left out |\n|---|---|---|---|---|---|---|"
    for name, scene in islice(scenes(), pick(None, 2)):
        try:
            found = simulate_within(scene, TARGET, budget=60.0)
        except RunError as error:
            yield f"| {name} | - | - | - | - | - | {str(error).split(';')[0]} |"
            continue
        tolerance = min(TIGHT, 0.1 * found.chosen.rtol)
        reference, floor = truth(replace(scene, effects=found.result.scene.effects), tolerance)
        run = run_native("implicit", found.result.scene, found.chosen.rtol, 120.0, 0)
        true = errors(run, reference)
        assert true is not None
        peaks = max(true.force_peak, true.sliding_peak)
        stated = "not known" if found.estimate is None else f"{100 * found.estimate:.3f} %"
        percents = " | ".join(f"{100 * value:.3f} %" for value in (true.worst_rms, peaks, floor))
        yield f"| {name} | {stated} | {percents} | {found.chosen.rtol:g} | {'ringing' if found.left_out else '-'} |"


def main() -> None:
    """Print the table."""
    parser(__doc__).parse_args()
    for line in stated_and_true():
        print(line, flush=True)


if __name__ == "__main__":
    main()
