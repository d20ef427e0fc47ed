"""The error that `--error` states against the true one: prints the tables of docs/accuracy.md.

`python benchmarks/promises.py`: some minutes, and half an hour for the random scenes. The true error is that of the run
against `esdirk4` at 1e-6 or tighter with all effects for which the scene has parameters, which a run of the default
method confirms; the tables have the largest difference of the two.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import islice

import auto_scenes
from plain import plain_scene
from quick import parser, pick

from msfp_gen import Effects, Load, Motion, RunError, Scene, Top
from msfp_gen.scene.effect_switching import all_effects
from msfp_gen.studies.accuracy.error_target import simulate_within
from msfp_gen.studies.accuracy.timed_run import Errors, errors, largest_error, run_native

TARGET = 0.005
TIGHT = 1e-6  # tolerance of the reference run, or a tenth of that of the run, if this is less
SEED, COUNT = 21, 30


@dataclass(frozen=True)
class Promise:
    """What a run to a requested error states, and its true error.

    floor: difference between the two runs that determine the true error [-]; nan where the second one ended early.
    """

    name: str
    stated: float | None
    true: Errors
    floor: float
    tolerance: float
    left_out: str
    models: tuple[str, ...]

    @property
    def kept(self) -> bool:
        """Whether the true error is at most the stated one, or not known better than to the floor."""
        return self.stated is None or largest_error(self.true) <= max(self.stated, self.floor)


def scenes() -> Iterator[tuple[str, Scene]]:
    """Name and scene: tests and orbits of PEER 2017/07, records, rims, light and heavy loads, uplift, a friction law."""
    for name in ("fenz-test1", "fenz-test3", "fenz-test5", "becker-circle-50", "becker-eight-125", "double-push"):
        yield name, replace(plain_scene(name), stop=None)
    test = plain_scene("fenz-test4")
    damped = test.bearing.replace(contact_damping=1e-4)
    yield "fenz-test4, damped", replace(test, bearing=damped)
    yield "light load", replace(test, bearing=damped, top=replace(test.top, axial_load=5e3))
    yield "heavy load", replace(test, bearing=damped, top=replace(test.top, axial_load=1e6))
    yield "heavy sliders, 18 Hz", heavy_sliders()
    varying = Load.harmonic((0.0, 0.0, 0.7 * 112e3), frequency=0.05, cycles=5.0, lead_in=20.0)
    yield "axial load varying by 70 %", replace(test, bearing=damped, load=varying)
    record = replace(plain_scene("ridgecrest-clc"), duration=20.0)
    yield "ridgecrest-clc, 20 s", record
    yield "ridgecrest-ccc, 20 s", replace(plain_scene("ridgecrest-ccc"), duration=20.0)
    law = record.bearing.replace(friction_slow=[0.04, 0.02, 0.02, 0.05], velocity_rate=50.0)
    yield "friction of velocity", replace(record, bearing=law, effects=replace(record.effects, friction="velocity"))
    shaken = Motion.harmonic(0.02, 2.0, cycles=4.0)
    tilting = Top.mass(11428.0, 300.0, 0.5, rotational_stiffness=1e7, rotational_damping=1e4)
    yield "uplift", Scene(record.bearing, shaken, tilting, effects=Effects(uplift=True, dimension="planar"))


def heavy_sliders() -> Scene:
    """Sliders so heavy under so small a load that they ring at 18 Hz: part of the motion, not noise above it."""
    test = plain_scene("fenz-test2")
    bodies = [
        replace(body, mass=20.0 * body.mass, inertia=tuple(20.0 * each for each in body.moments))
        for body in test.bearing.bodies
    ]
    bearing = test.bearing.replace(bodies=bodies, contact_damping=1e-4)
    motion, top = Motion.harmonic(0.05, 0.5, cycles=3), replace(test.top, axial_load=1.15e3, damping=1e4)
    effects = Effects(dimension="planar")
    return replace(test, bearing=bearing, motion=motion, duration=None, top=top, effects=effects)


def promise(name: str, scene: Scene, target: float = TARGET, budget: float = 60.0) -> Promise:
    """A run to a requested error, and its true error. Raises RunError where the error is not reached."""
    found = simulate_within(scene, target, budget=budget)
    every, tolerance = replace(scene, effects=all_effects(scene)), min(TIGHT, 0.1 * found.chosen.rtol)
    reference, second = (run_native(method, every, tolerance, 120.0, 0) for method in ("esdirk4", "implicit"))
    true = errors(run_native("implicit", found.result.scene, found.chosen.rtol, 120.0, 0), reference)
    if true is None or not reference.finished:
        raise RunError(f"the reference run ends early: {reference.message}", status=reference.status)
    between = errors(second, reference) if second.finished else None
    return Promise(
        name=name,
        stated=found.estimate,
        true=true,
        floor=float("nan") if between is None else largest_error(between),
        tolerance=found.chosen.rtol,
        left_out="ringing" if found.left_out else "-",
        models=tuple(found.result.provenance["model"].split(", then ")),
    )


def rows(scenes: Iterable[tuple[str, Scene]]) -> Iterator[str]:
    """Rows of a table."""
    yield "| scene | stated | true, RMS | true, peaks | confirmed to | tolerance | left out |\n|---|---|---|---|---|---|---|"
    for name, scene in islice(scenes, pick(None, 2)):
        try:
            found = promise(name, scene)
        except RunError as error:
            yield f"| {name} | - | - | - | - | - | {str(error).split(';')[0]} |"
            continue
        peaks = max(found.true.force_peak, found.true.sliding_peak)
        stated = "not known" if found.stated is None else f"{100 * found.stated:.3f} %"
        percents = " | ".join(f"{100 * value:.3f} %" for value in (found.true.worst_rms, peaks, found.floor))
        mark = "" if found.kept else " **missed**"
        yield f"| {name}{mark} | {stated} | {percents} | {found.tolerance:g} | {found.left_out} |"


def demanding(count: int) -> Iterator[tuple[str, Scene]]:
    """The first random scenes that need what `Auto` may leave out."""
    found = (auto_scenes.demanding(SEED, number) for number in range(count))
    return ((scene.name, scene) for scene in found)


def main() -> None:
    """Print the tables."""
    options = parser(__doc__)
    options.add_argument("--count", type=int, default=COUNT, help="number of random scenes")
    for table in (scenes(), demanding(options.parse_args().count)):
        for line in rows(table):
            print(line, flush=True)
        print()


if __name__ == "__main__":
    main()
