"""The error that `--error` states against the true one, and Auto against all effects: prints the tables of docs/accuracy.md.

`python benchmarks/promises.py`: some minutes. The true error is that of the run against `esdirk4` at 1e-6, which a run of
the default method at 1e-6 confirms; the table has the difference of the two, RMS.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace

from msfp_gen import Auto, Effects, Load, Motion, RunError, Scene, Top, load_scene, simulate
from msfp_gen.studies.accuracy.error_target import simulate_within
from msfp_gen.studies.accuracy.measure import Errors, errors
from msfp_gen.studies.accuracy.trial import Trial, run_native

TARGET = 0.005


def scenes() -> Iterator[tuple[str, Scene]]:
    """Name and scene: tests and orbits of PEER 2017/07, records, rims, light and heavy loads, uplift, a friction law."""
    for name in ("fenz-test1", "fenz-test3", "fenz-test5", "becker-circle-50", "becker-eight-125", "double-push"):
        yield name, replace(load_scene(name), stop=None)
    test = load_scene("fenz-test4")
    damped = test.bearing.replace(contact_damping=1e-4)
    yield "fenz-test4, damped", replace(test, bearing=damped)
    yield "light load", replace(test, bearing=damped, top=replace(test.top, axial_load=5e3))
    yield "heavy load", replace(test, bearing=damped, top=replace(test.top, axial_load=1e6))
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


def largest(found: Errors) -> float:
    """Largest of the errors that `--error` bounds: RMS and peaks, of force and of sliding."""
    return max(found.worst_rms, found.force_peak, found.sliding_peak)


def truth(scene: Scene) -> tuple[Trial, float]:
    """The reference run, and how far a second family of methods is from it, RMS."""
    reference, second = (run_native(method, scene, 1e-6, 120.0, 0) for method in ("esdirk4", "implicit"))
    difference = errors(second, reference)
    return reference, float("nan") if difference is None else difference.worst_rms


def stated_and_true() -> Iterator[str]:
    """Rows of the first table."""
    yield "| scene | stated | true, RMS | true, peaks | confirmed to | tolerance | left out |\n|---|---|---|---|---|---|---|"
    for name, scene in scenes():
        try:
            found = simulate_within(scene, TARGET, budget=60.0)
        except RunError as error:
            yield f"| {name} | - | - | - | - | - | {str(error).split(';')[0]} |"
            continue
        reference, floor = truth(replace(scene, effects=found.result.scene.effects))
        run = run_native("implicit", found.result.scene, found.chosen.rtol, 120.0, 0)
        true = errors(run, reference)
        assert true is not None
        peaks = max(true.force_peak, true.sliding_peak)
        stated = "not known" if found.estimate is None else f"{100 * found.estimate:.3f} %"
        percents = " | ".join(f"{100 * value:.3f} %" for value in (true.worst_rms, peaks, floor))
        yield f"| {name} | {stated} | {percents} | {found.chosen.rtol:g} | {'ringing' if found.left_out else '-'} |"


def automatic() -> Iterator[str]:
    """Rows of the second table: Auto and all effects at the same tight tolerance."""
    yield "| scene | effects chosen | force, RMS | peak force | peak sliding |\n|---|---|---|---|---|"
    for name, scene in scenes():
        full = scene.effects if isinstance(scene.effects, Effects) else scene.modelled
        chosen = replace(scene, effects=Auto(bouc_wen=full.bouc_wen, friction=full.friction))
        tight = replace(scene.solver, rtol=1e-5)
        try:
            key = simulate(replace(chosen, solver=tight)).provenance["model"]
            one, two = (run_native("implicit", s, 1e-5, 120.0, 0) for s in (chosen, replace(scene, effects=full)))
        except RunError as error:
            yield f"| {name} | {str(error)[:60]} | - | - | - |"
            continue
        off = errors(one, two)
        assert off is not None
        cells = " | ".join(f"{100 * v:.3f} %" for v in (off.force_rms, off.force_peak, off.sliding_peak))
        yield f"| {name} | {key} | {cells} |"


def main() -> None:
    """Print the tables."""
    for table in (stated_and_true,) if "--auto" not in sys.argv else (automatic,):
        for line in table():
            print(line, flush=True)
        print()


if __name__ == "__main__":
    main()
