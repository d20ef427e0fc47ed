"""Gradients of runs against differences of runs that choose their own steps: smooth runs, and through rim contacts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support import Array, scene_of
from support.gradients import DAMPED, derivative, double, single, step_of, triple, values_around

from msfp_gen import Effects, Motion, Result, Rotation, Scene, load_scene, simulate
from msfp_gen.results.gradients import energy_terms
from msfp_gen.scene.parameters import changed_parameters, parameters_of

COMMON = {
    "bearing.surfaces[0].friction": 4e-3,
    "bearing.surfaces[0].yield_displacement": 1e-2,
    "bearing.surfaces[0].radius": 2e-3,
    "bearing.bodies[0].height": 2e-3,
    "motion.scale": 2e-3,
}
"""Parameters of every layout, with the steps of the differences over the parameter."""
SPATIAL = {
    "bearing.surfaces[0].contact_damping": 0.2,
    "bearing.bodies[0].mass": 0.2,
    "motion.direction": 1e-3,
    "initial_state.h[0][0]": 4e-2,
}
RIG = {"top.axial_load": 4e-3, "top.rotational_stiffness": 2e-2, "top.stiffness": 0.1}
RIMS = {"capacity": 1e-3, "rim_stiffness": 1e-2}
NAMES = ("top_force", "tilt")
TERMS = tuple(f"energy_{name}" for name in energy_terms(integrals=True, uplift=False))
LAW = {"bearing.surfaces[1].friction_slow": 1e-2, "bearing.surfaces[1].velocity_rate": 1e-2, "load.scale": 0.1}


def fine(scene: Scene, rtol: float, output_step: float, max_step: float | None = None) -> Scene:
    """The scene with steps of fourth order at a small tolerance.

    max_step: where forces inside longer steps are interpolated less exactly than the differences need.
    """
    solver = replace(scene.solver, rtol=rtol, method="esdirk4", max_step=max_step)
    return replace(scene, solver=solver, output_step=output_step, stop=None, motion_table=None)


def check_free(scene: Scene, sizes: Mapping[str, float], limit: float, away: float = 0.0) -> None:
    """Force, angles, energies agree with differences to `limit` of the largest derivative and the noise of differences.

    Where a rim is met, also to the error that the run states of its derivatives.

    Of energies it is that of any energy: they share one balance, and small terms are checked with the same steps.
    Rows within `away` [s] of an event are left out, which the differences shift; and the first row. Differences must
    know every derivative to a fiftieth (of energies to 3 %), also that of a mass, on which the run hardly depends.
    """
    result = simulate(scene, gradients=list(sizes), energy_gradients=True)
    time = result.history.time
    rows = ~np.any([np.abs(time - e.time) < away for e in result.events], axis=0) & (time > 0)
    for index, parameter in enumerate(parameters_of(scene, list(sizes))):
        step = step_of(parameter, sizes[parameter.path])
        runs = [simulate(changed_parameters(scene, {parameter: v})).dataset for v in values_around(parameter, step)]
        compared = {name: derivative([run[name].values[rows] for run in runs], step) for name in NAMES + TERMS}
        for name, (found, _) in compared.items():
            together = [compared[other] for other in (TERMS if name in TERMS else (name,))]
            largest, noise = (max(float(np.abs(each[i]).max()) for each in together) for i in (0, 1))
            error = np.abs(result.gradient[name].values[index][rows] - found).max()
            about = (parameter.path, name, error / largest, noise / largest) if largest else parameter.path
            assert noise <= (3e-2 if name in TERMS else 2e-2) * largest, about
            errors = result.gradient.get(f"{name}_error")
            stated = 0.0 if errors is None else float(errors.values[index][rows].max())
            assert stated <= 2e-2 * largest, about
            assert error <= limit * largest + noise + stated, about


def smooth_triple() -> tuple[Scene, dict[str, float]]:
    """The first quarter of a cycle: no slip reverses."""
    return fine(triple(1.5), 1e-12, 0.1), COMMON | SPATIAL | RIG


def smooth_double() -> tuple[Scene, dict[str, float]]:
    """Below a mass on a vertical spring, with friction that depends on velocity."""
    return fine(replace(double(), duration=0.3), 1e-12, 0.05, 1e-4), COMMON | SPATIAL | LAW | {"top.mass": 4e-3}


def smooth_single() -> tuple[Scene, dict[str, float]]:
    """Quasi-static steps."""
    scene = replace(single(), duration=0.4, output_step=0.05)
    scene = replace(scene, solver=replace(scene.solver, rtol=1e-11, max_step=2e-3))
    return scene, COMMON | {"top.axial_load": 4e-3, "top.stiffness": 0.1, "initial_state.h[0][0]": 4e-2}


def rims_triple() -> tuple[Scene, dict[str, float]]:
    """Test 5 of PEER 2017/07 with damped contacts, until a slider has met its rim."""
    scene = scene_of("fenz-test5", duration=26.0)
    scene = replace(scene, bearing=scene.bearing.replace(**DAMPED))
    return fine(scene, 1e-12, 0.5), COMMON | SPATIAL | RIG | {
        f"bearing.surfaces[0].{name}": RIMS[name] for name in RIMS
    }


def rims_double() -> tuple[Scene, dict[str, float]]:
    """A double pendulum whose upper slider meets its rim and stays there."""
    scene = double()
    bearing, top = scene.bearing.replace(capacity=[0.2, 0.1]), load_scene("double-push").top
    scene = replace(scene, bearing=bearing, top=top, effects=Effects(friction="velocity"), duration=1.2)
    scene = replace(scene, motion=Motion.harmonic(0.27, 0.2, cycles=1.0))
    paths = COMMON | SPATIAL | RIG | LAW | {f"bearing.surfaces[1].{name}": RIMS[name] for name in RIMS}
    return fine(scene, 1e-12, 0.1, 2e-4), paths | {"bearing.surfaces[1].rim_damping": 0.1}


def rims_heated() -> tuple[Scene, dict[str, float]]:
    """The same, while its surfaces warm up."""
    scene, sizes = rims_double()
    sizes = {path: size for path, size in sizes.items() if path not in LAW}
    bearing = scene.bearing.replace(friction_slow=None, reference_pressure=5e6, velocity_rate=100.0, conductivity=0.5)
    scene = replace(scene, bearing=bearing, effects=Effects(friction="pvt"))
    assert simulate(scene).history.temperature.max() > 40.0
    law = {"bearing.surfaces[0].start_temperature": 4e-2, "bearing.surfaces[0].conductivity": 4e-3}
    return scene, {path: size for path, size in sizes.items() if path in COMMON or "surfaces[1]" in path} | law


def rims_single() -> tuple[Scene, dict[str, float]]:
    """A single pendulum that meets its rim twice and leaves it."""
    effects = Effects(dimension="planar", sliders="massless")
    scene = replace(single(), effects=effects, motion=Motion.harmonic(0.4, 0.5, cycles=2.0), duration=1.8)
    sizes = COMMON | {f"bearing.surfaces[0].{name}": RIMS[name] for name in RIMS}
    return fine(scene, 1e-10, 0.05), sizes | {"bearing.surfaces[0].yield_displacement": 3e-2}


Case = Callable[[], tuple[Scene, dict[str, float]]]
slow = pytest.mark.slow


@pytest.mark.slow
@pytest.mark.parametrize("case", [smooth_single, smooth_double, smooth_triple])
def test_differences_with_free_steps_in_smooth_runs(case: Case) -> None:
    check_free(*case(), 1e-6)


@pytest.mark.parametrize(
    ("case", "away"),
    [pytest.param(rims_single, 0.05, marks=slow), pytest.param(rims_double, 0.1, marks=slow),
     pytest.param(rims_heated, 0.1, marks=slow),
     pytest.param(rims_triple, 1.0, marks=slow)],
)  # fmt: skip
def test_differences_with_free_steps_through_rim_contacts(case: Case, away: float) -> None:
    check_free(*case(), 1e-4, away)


def test_a_short_check_of_a_triple_pendulum() -> None:
    """Of every change: two parameters at a larger tolerance, with slip that reverses."""
    scene = fine(triple(1.5), 1e-11, 0.1)
    check_free(scene, {"bearing.surfaces[0].radius": 4e-3, "motion.scale": 4e-3}, 1e-5)


def test_peaks_of_the_summary() -> None:
    paths = {"bearing.surfaces[0].radius": 4e-3, "motion.scale": 4e-3}
    scene = replace(triple(4.0, rtol=1e-9), output_step=0.1)
    slopes = simulate(scene, gradients=list(paths)).gradient_summary
    for parameter in parameters_of(scene, list(paths)):
        step = step_of(parameter, paths[parameter.path])
        runs = [simulate(changed_parameters(scene, {parameter: v})).summary for v in values_around(parameter, step)]
        for name in ("peak_displacement", "peak_force"):
            found, _ = derivative([np.array(list(run[name].values())) for run in runs], step)
            given = np.array(list(slopes[parameter.path][name].values()))
            assert np.abs(given - found).max() <= 1e-5 * np.abs(found).max(), (parameter.path, name)


@pytest.mark.parametrize(("duration", "rtol", "events"), [(26.0, 1e-7, 1), pytest.param(60.0, 3e-9, 4, marks=slow)])
def test_times_of_rim_contacts(duration: float, rtol: float, events: int) -> None:
    """Two sliders of test 5 of PEER 2017/07 meet their rims and leave them. 2 %: rates at an event ring."""
    scene = scene_of("fenz-test5", solver={"rtol": rtol}, duration=duration, output_step=0.5)
    scene = replace(scene, bearing=scene.bearing.replace(**DAMPED))
    paths = ["bearing.surfaces[0].capacity", "motion.scale"]
    result = simulate(scene, gradients=paths)
    assert len(result.events) == events
    for index, parameter in enumerate(parameters_of(scene, paths)):
        step = step_of(parameter, 2e-3)
        runs = [simulate(changed_parameters(scene, {parameter: v})).dataset for v in values_around(parameter, step)]
        found, _ = derivative([run["event_time"].values for run in runs], step)
        error = np.abs(result.gradient["event_time"].values[index] - found).max()
        assert error <= 2e-2 * np.abs(found).max(), parameter.path


@pytest.mark.slow
@pytest.mark.parametrize(("method", "rtol"), [("esdirk4", 1e-10), ("implicit", 1e-6)])
def test_times_of_rim_events_of_massless_bodies(method: str, rtol: float) -> None:
    """Their rates jump at the rim: the time depends on those before it, also in a step of a microsecond to it, and in
    quasi-static steps.
    """
    scene, _ = rims_single()
    scene = replace(scene, solver=replace(scene.solver, method=method, rtol=rtol))
    (parameter,) = parameters_of(scene, ["bearing.surfaces[0].capacity"])
    step = step_of(parameter, 2e-3)
    runs = [simulate(changed_parameters(scene, {parameter: value})) for value in values_around(parameter, step)]
    given = simulate(scene, gradients=[parameter.path]).gradient.event_time.values[0]
    assert [event.kind for event in runs[0].events] == 2 * ["rim_contact", "rim_release"]
    for index in range(4):
        found, noise = derivative([np.array(run.events[index].time) for run in runs], step)
        assert noise <= 1e-3 * abs(found)
        assert given[index] == pytest.approx(float(found), rel=1e-3)


def slow_contact() -> Scene:
    """Test 5 of PEER 2017/07 with damped contacts: a slider approaches its rim at 4 mm/s."""
    scene = scene_of("fenz-test5", duration=24.0, output_step=0.1)
    return replace(scene, bearing=scene.bearing.replace(**DAMPED), stop=None, motion_table=None)


def massless_contacts() -> Scene:
    """Four contacts of a massless single pendulum."""
    scene = rims_single()[0]
    return replace(scene, solver=replace(scene.solver, max_step=None), output_step=0.02)


def fast_contacts() -> Scene:
    """The triple pendulum of PEER 2017/07 at 0.5 Hz: a rim is met and left twice, and sliders ring."""
    scene = scene_of("fenz-test2", duration=2.0, output_step=0.02, stop=None, motion_table=None)
    scene = replace(scene, bearing=scene.bearing.replace(**DAMPED))
    return replace(scene, motion=Motion.harmonic(0.12, 0.5, cycles=1.0))


CAPACITY = "bearing.surfaces[0].capacity"
RINGING = {slow_contact: 0.7, massless_contacts: 0.01, fast_contacts: 0.1}
"""Time after an event in which differences contain the phase of ringing [s]."""
Runs = Callable[[float, str], Result]


@cache
def reference(scene: Callable[[], Scene]) -> tuple[Runs, Result, Array]:
    """Runs of a scene by tolerance and method, with derivatives by a capacity; a tight one; rows away from events."""

    @cache
    def run(rtol: float, method: str, capacity: float | None = None) -> Result:
        given = scene()
        changed = replace(given, solver=replace(given.solver, rtol=rtol, method=method))
        if capacity is None:
            return simulate(changed, gradients=[CAPACITY])
        (parameter,) = parameters_of(changed, [CAPACITY])
        return simulate(changed_parameters(changed, {parameter: capacity}))

    tight = run(1e-10, "esdirk4")
    time = tight.history.time
    since = time - np.array([[event.time] for event in tight.events])
    rows = ~np.any((since > -0.02) & (since < RINGING[scene]), axis=0) & (time > 0)
    value = scene().bearing.surfaces[0].capacity
    above, below = (run(1e-10, "esdirk4", value * (1 + sign * 1e-4)).history.sliding[rows] for sign in (1, -1))
    found, exact = (above - below) / (2e-4 * value), tight.gradient.sliding.values[0][rows]
    assert np.abs(found - exact).max() <= (1e-2 if scene is fast_contacts else 1e-4) * np.abs(found).max()
    return run, tight, rows


@pytest.mark.parametrize(
    ("scene", "method", "limits"),
    [(slow_contact, "implicit", {1e-4: 1e-4, 1e-5: 3e-5, 1e-6: 5e-6}),
     (slow_contact, "esdirk4", {1e-5: 3e-4, 1e-6: 3e-5}),
     pytest.param(massless_contacts, "implicit", {1e-4: 1e-5}, marks=slow),
     pytest.param(massless_contacts, "esdirk4", {1e-4: 1e-4, 1e-6: 1e-5}, marks=slow)],
)  # fmt: skip
def test_derivatives_after_rim_contacts_are_as_exact_as_the_run(
    scene: Callable[[], Scene], method: str, limits: dict[float, float]
) -> None:
    """The time of the contact, and rows in steps that move with it, cost no accuracy at ordinary tolerances."""
    run, tight, rows = reference(scene)
    exact = tight.gradient.sliding.values[0][rows]
    for rtol, limit in limits.items():
        result = run(rtol, method)
        error = np.abs(result.gradient.sliding.values[0][rows] - exact).max()
        assert error <= limit * np.abs(exact).max(), (method, rtol)
        times = result.gradient.event_time.values / tight.gradient.event_time.values
        assert np.abs(times - 1).max() <= 1e-3, (method, rtol)


@pytest.mark.parametrize(
    ("scene", "least"),
    [
        (slow_contact, 0.95),
        pytest.param(massless_contacts, 0.95, marks=slow),
        pytest.param(fast_contacts, 0.85, marks=slow),
    ],
)
def test_the_stated_error_covers_the_true_one(scene: Callable[[], Scene], least: float) -> None:
    """Of 95 of 100 rows, and the largest error of sliding displacements in every run.

    Of forces while sliders ring, which both runs filter, of 85 of 100.
    """
    run, tight, rows = reference(scene)
    covered = dict[str, list[Array]](sliding=[], top_force=[])
    for method in ("implicit", "esdirk4"):
        for rtol in (1e-4, 1e-5, 1e-6):
            gradient = run(rtol, method).gradient
            for name, of_runs in covered.items():
                exact, stated = tight.gradient[name].values[0][rows], gradient[f"{name}_error"].values[0][rows]
                noise = 1e-6 * np.abs(exact).max()  # of the tight run
                error = np.abs(gradient[name].values[0][rows] - exact)
                of_runs.append(np.ravel(error <= stated + noise))
                assert name == "top_force" or error.max() <= stated.max() + noise, (method, rtol)
    assert np.mean(np.concatenate(covered["sliding"])) >= 0.95
    assert np.mean(np.concatenate(covered["top_force"])) >= least


def sampled_contact(rtol: float, method: str, max_step: float | None = None) -> Scene:
    """Test 2 of PEER 2017/07, tenfold and at 1 Hz, from 201 samples: a slider meets its rim, whose damper is strong."""
    scene, time = scene_of("fenz-test2", duration=0.14, output_step=2.5e-4), np.linspace(0.0, 1.0, 201)
    motion = Motion.from_arrays(time, np.outer(np.sin(2 * np.pi * time), [0.12, 0.0, 0.0]))
    scene = replace(scene, motion=motion, motion_table=None, stop=None)
    solver = replace(scene.solver, rtol=rtol, method=method, max_step=max_step)
    return replace(scene, bearing=scene.bearing.replace(rim_damping=8000.0, **DAMPED), solver=solver)


@pytest.mark.slow
def test_the_gradient_after_a_rim_contact_under_a_sampled_motion_improves_with_the_tolerance() -> None:
    """Of forces from a millisecond after the contact on, against differences of runs with steps of 10 microseconds.

    Slider and rim meet at 0.3 m/s: a step of a microsecond, the shortest to an event, ends beyond the tolerance of the
    gap, and some of its stages have the force of the damper.
    """
    tight = sampled_contact(1e-10, "esdirk4", 1e-5)
    (parameter,) = parameters_of(tight, ["motion.scale"])
    runs = [simulate(changed_parameters(tight, {parameter: v})) for v in values_around(parameter, 1e-5)]
    (event,) = runs[0].events
    rows = runs[0].history.time > event.time + 1e-3
    found, noise = derivative([run.history.top_force[rows, 0] for run in runs], 1e-5)
    assert np.linalg.norm(noise) < 0.02 * np.linalg.norm(found)
    limits = {"implicit": {1e-6: 0.1, 1e-7: 0.05, 3e-8: 0.02, 1e-8: 0.015}, "esdirk4": {1e-7: 0.05, 1e-9: 0.015}}
    for method, rtol, limit in ((name, *pair) for name, pairs in limits.items() for pair in pairs.items()):
        given = simulate(sampled_contact(rtol, method), gradients=["motion.scale"]).gradient
        error = given.top_force.values[0, rows, 0] - found
        assert np.linalg.norm(error) <= limit * np.linalg.norm(found), (method, rtol)
        assert given.event_time.values[0, 0] == pytest.approx(-0.1653, rel=0.02)


@pytest.mark.slow
def test_plates_that_are_tilted_at_the_start() -> None:
    """The state after the slow tilting depends on the parameters, and runs of their own compute it for differences."""
    scene = triple(0.2, rtol=1e-9, method="esdirk4")
    motion = scene.motion.rocking(Rotation.constant(0.003, 0.006))
    scene = replace(scene, motion=motion, motion_table=None, output_step=0.02)
    sizes = dict.fromkeys(
        ("bearing.surfaces[0].friction", "bearing.bodies[0].height", "top.axial_load", "motion.scale"), 1e-4
    )
    gradients = simulate(scene, gradients=list(sizes)).gradients
    assert gradients is not None
    for index, parameter in enumerate(parameters_of(scene, list(sizes))):
        step = step_of(parameter, sizes[parameter.path])
        values = values_around(parameter, step)
        runs = [simulate(changed_parameters(scene, {parameter: value})).history for value in values]
        for name in ("tilt_angles", "friction_state"):
            found, noise = derivative([getattr(run, name) for run in runs], step)
            slope = gradients.arrays[name][index]
            limit = 3e-3 * np.abs(found).max() + noise.max()
            assert np.abs(slope - found).max() <= limit, (parameter.path, name)
            assert slope[0].any() == (parameter.part != "motion")
