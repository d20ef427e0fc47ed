"""Whole runs of the compiled runtime: against quasi-static loops, each other, and what must hold of every run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from reference import energy, kinematics
from reference.friction_circle import Push
from reference.parameters import fenz
from reference.quasi_static import follow
from support import Array, preset_run, scene_of, thinned

from msfp_gen import (
    Bearing,
    Body,
    Effects,
    Layout,
    Motion,
    Scene,
    Solver,
    Surface,
    Top,
    load_scene,
    presets,
    simulate,
)
from msfp_gen.results.result import Result
from msfp_gen.scene.scene_fields import InitialState, Stop

LOAD, ROTATIONAL_STIFFNESS = 112e3, 1e6
TESTS = [f"fenz-test{i}" for i in range(1, 6)]
REPORT = Effects(bouc_wen="report")
RUNS = [*TESTS, "fenz-monotonic", "unusual-tfp", "becker-circle-50", "becker-eight-125"]


def apart(one: Result, other: Result) -> float:
    """Largest difference of horizontal force over the largest force; both written at the same times."""
    assert np.allclose(one.history.time, other.history.time, rtol=0, atol=1e-9)
    force = [run.history.top_force[:, :2] for run in (one, other)]
    return float(np.linalg.norm(force[0] - force[1], axis=1).max() / np.linalg.norm(force[0], axis=1).max())


def peak(run: Result) -> float:
    return float(np.abs(run.history.top_force[:, :2]).max())


# ---- the report's five loops ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", thinned(TESTS, lambda name: name in ("fenz-test1", "fenz-test2")))
def test_loop_follows_the_quasi_static_reference(name: str) -> None:
    """Peak and every point of the first three quarters of a cycle, to 0.3 % of the peak force."""
    run = preset_run(name)
    u, force = run.history.displacement[:, 0], run.history.top_force[:, 0]
    rows = np.flatnonzero(run.history.time <= 0.8 * float(run.scene.motion.metadata["period"]))
    turns = rows[1:-1][np.diff(np.sign(np.diff(u[rows]))) != 0]
    rows = np.unique([*rows[:: max(1, len(rows) // 60)], *turns])
    path = follow(Push(fenz(), LOAD, ROTATIONAL_STIFFNESS, weights=True), list(u[rows]), stride=1e-3)
    want = np.array([here.force for here in path])
    assert np.abs(force).max() == pytest.approx(np.abs(want).max(), rel=3e-3)
    assert np.abs(force[rows] - want).max() < 3e-3 * np.abs(want).max()


def test_creep_of_stuck_surfaces_is_that_of_the_reference() -> None:
    """In stage I the outer surfaces slip a little each cycle before they yield: both cycles, at a tight tolerance."""
    run = simulate(scene_of("fenz-test1", solver={"rtol": 1e-6}, output_step=0.1))
    u, force = run.history.displacement[:, 0], run.history.top_force[:, 0]
    path = follow(Push(fenz(), LOAD, ROTATIONAL_STIFFNESS, weights=True), list(u), stride=1e-3)
    assert np.abs(force - [here.force for here in path]).max() < 2e-4 * np.abs(force).max()


def test_fifth_loop_reaches_all_regimes() -> None:
    """Model choice 5: with k_top = 1e8 N/m the relative amplitude is A, every rim is met, and F/N reaches 0.345."""
    run = preset_run("fenz-test5")
    assert peak(run) / LOAD == pytest.approx(0.345, abs=0.002)
    assert {event.surface for event in run.events if event.kind == "rim_contact"} == {1, 4}
    assert run.summary["peak_displacement"]["E1"] == pytest.approx(0.140, rel=5e-3)


@pytest.mark.parametrize("name", TESTS[1:4])
def test_loop_repeats_itself(name: str) -> None:
    """The second cycle writes the loop of the first. (In test 1 stuck surfaces creep with each cycle, as below.)"""
    scene = load_scene(name)
    period = float(scene.motion.metadata["period"])
    steps = 400
    run = simulate(replace(scene, output_step=period / steps, solver=replace(scene.solver, rtol=1e-5)))
    force, end = run.history.top_force[:, 0], len(run.history.time) - 1
    second, first = force[end - steps : end + 1], force[end - 2 * steps : end - steps + 1]
    assert np.abs(second - first)[steps // 10 :].max() < 2e-3 * peak(run)


# ---- one model against another ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", thinned(TESTS, lambda name: name == "fenz-test2"))
def test_slider_inertia_hardly_matters_at_this_load(name: str) -> None:
    """Peaks of rows close together, at a tolerance below the difference: a run's own steps may pass a peak."""
    scenes = (scene_of(name, {"dimension": "planar", **e}, {"rtol": 1e-6}) for e in ({}, {"sliders": "massless"}))
    with_inertia, without = (peak(simulate(replace(s, output_step=s.end / 2000))) for s in scenes)
    assert without == pytest.approx(with_inertia, rel=5e-5)


@pytest.mark.parametrize("azimuth", thinned([0.0, np.pi / 2], lambda azimuth: azimuth > 0.0), ids=["E1", "E2"])
def test_planar_run_equals_spatial_run(azimuth: float) -> None:
    scene = scene_of("fenz-test2", solver={"rtol": 1e-6}, output_step=0.1, duration=25.0)
    turned = replace(scene, motion=scene.motion.rotated(azimuth))
    flat, full = (simulate(replace(turned, effects=replace(scene.effects, dimension=d))) for d in ("planar", "spatial"))
    assert apart(full, flat) < 2e-4
    assert np.abs(full.history.tilt_angles - flat.history.tilt_angles).max() < 1e-5
    assert np.abs(full.history.friction_state - flat.history.friction_state).max() < 2e-3


@pytest.mark.slow
def test_planar_run_at_any_azimuth_to_the_square_of_the_tilt() -> None:
    """Y, Z live on Euler bases that twist by psi' sin(theta): the isotropic law loses its direction by that much."""
    scene = scene_of("fenz-test2", {"bouc_wen": "isotropic"}, {"rtol": 1e-6}, output_step=0.1, duration=25.0)
    turned = replace(scene, motion=scene.motion.rotated(np.pi / 6))
    flat, full = (simulate(replace(turned, effects=replace(scene.effects, dimension=d))) for d in ("planar", "spatial"))
    tilt = np.abs(full.history.tilt_angles).max()
    assert apart(full, flat) < tilt**2
    along = full.history.top_force[:, :2] @ [np.cos(np.pi / 6), np.sin(np.pi / 6)]
    aside = full.history.top_force[:, :2] @ [-np.sin(np.pi / 6), np.cos(np.pi / 6)]
    assert np.abs(aside).max() < tilt**2 * np.abs(along).max()


def test_methods_agree() -> None:
    """dopri5 resolves every kHz mode, so this is short: two seconds, peak force, and the force at each hundredth."""
    motion = Motion.harmonic(0.005, 0.5, cycles=0.75)
    scene = replace(scene_of("fenz-test1", {"dimension": "planar"}, output_step=0.01), motion=motion)
    explicit = simulate(replace(scene, solver=replace(scene.solver, method="dopri5", rtol=1e-7)))
    implicit = simulate(scene)
    assert peak(implicit) == pytest.approx(peak(explicit), rel=2e-3)
    assert apart(explicit, implicit) < 2e-3
    assert explicit.counters.steps > 20 * implicit.counters.steps


@pytest.mark.slow
def test_methods_agree_on_the_second_test_of_fenz() -> None:
    scene = scene_of("fenz-test2", output_step=0.02)
    explicit = simulate(replace(scene, solver=replace(scene.solver, method="dopri5", rtol=1e-6)))
    implicit = simulate(scene)
    assert peak(implicit) == pytest.approx(peak(explicit), rel=2e-3)
    assert apart(explicit, implicit) < 2e-3


# ---- what holds of every run ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*RUNS, "ridgecrest-clc"])
def test_energy_balance_closes(name: str) -> None:
    energy = preset_run(name).summary["energy"]
    assert energy["closure_error"] < 0.01, f"{100 * energy['closure_error']:.3f} % of {energy['peak_input']:.4g} J"
    assert 0.5 < energy["dissipated_share"] < 1.01


@pytest.mark.parametrize("name", RUNS)
def test_dissipation_never_comes_back(name: str) -> None:
    energy = preset_run(name).history.energy
    for source in ("friction_dissipated", "rim_dissipated", "top_dissipated"):
        assert np.diff(energy[source]).min() > -1e-3 * np.abs(energy["input"]).max(), source


@pytest.mark.parametrize("name", [*RUNS, "ridgecrest-clc"])
def test_friction_stays_in_the_unit_disc_and_normal_forces_press(name: str) -> None:
    run = preset_run(name)
    assert np.linalg.norm(run.history.friction_state, axis=2).max() < 1 + 10 * run.scene.solver.rtol
    assert run.history.normal_force.min() > 0


@pytest.mark.parametrize("name", RUNS)
def test_rims_only_push_and_only_where_met(name: str) -> None:
    history = preset_run(name).history
    assert history.rim_force.min() >= 0
    assert not history.rim_force[history.gap > 0].any()


@pytest.mark.parametrize("name", RUNS)
def test_counters_tell_the_work_done(name: str) -> None:
    run = preset_run(name)
    c = run.counters
    assert c.steps == len(run.history.time) - 1
    assert 0 < c.factorisations <= c.newton_iterations < c.evaluations and c.newton_iterations >= c.steps
    assert c.events == len(run.events)
    assert c.wall_time > 0
    assert np.all(np.diff(run.history.time) > 0)
    assert run.history.time[-1] == (run.scene.end if run.status == "ok" else run.events[-1].time)


@pytest.mark.parametrize("method", ["implicit", "dopri5"])
def test_same_run_twice_is_the_same_to_the_last_bit(method: str) -> None:
    scene = scene_of("becker-circle-50", solver={"method": method}, duration=10.0 if method == "implicit" else 0.2)
    one, other = (simulate(scene) for _ in range(2))
    assert vars(one.history).keys() == vars(other.history).keys()
    for name, values in vars(one.history).items():
        if name == "energy":
            assert all(np.array_equal(v, other.history.energy[k]) for k, v in values.items())
        else:
            assert np.array_equal(values, getattr(other.history, name)), name
    assert replace(one.counters, wall_time=0.0) == replace(other.counters, wall_time=0.0)


# ---- output, stops, starts, jumps -------------------------------------------------------------------------------


@pytest.mark.parametrize(("method", "duration"), [("implicit", 25.0), ("dopri5", 0.3)])
def test_dense_output_lies_on_the_steps(method: str, duration: float) -> None:
    """Rows asked for between steps join the solver's own rows, and asking changes no step."""
    scene = scene_of("fenz-test2", {"dimension": "planar"}, {"method": method, "rtol": 1e-5}, duration=duration)
    own = simulate(scene)
    step = duration / 997
    dense = simulate(replace(scene, output_step=step))
    assert replace(dense.counters, wall_time=0.0) == replace(own.counters, wall_time=0.0)
    assert dense.history.time == pytest.approx(step * np.arange(len(dense.history.time)), abs=1e-12)
    assert len(dense.history.time) == 998
    for name in ("displacement", "top_force", "tilt_angles"):
        rows, wanted = getattr(dense.history, name), getattr(own.history, name)
        rows, wanted = (x.reshape(len(x), -1) for x in (rows, wanted))
        linear = np.array([np.interp(own.history.time, dense.history.time, column) for column in rows.T]).T
        assert np.abs(linear - wanted).max() < 5e-3 * np.abs(wanted).max(), name


def test_run_stops_at_a_displacement() -> None:
    run = simulate(replace(scene_of("fenz-monotonic"), stop=Stop(displacement=0.05)))
    assert run.status == "stopped" and run.succeeded
    assert run.history.horizontal[-1] == pytest.approx(0.05, rel=1e-5)
    assert run.history.horizontal[:-1].max() < 0.05
    assert (run.events[-1].kind, run.events[-1].surface) == ("stop", 0)


def test_run_stops_when_every_rim_is_met() -> None:
    """Inner rims of a softer bearing come first: friction as in section 4.2, all rims met before 140 mm."""
    scene = scene_of("fenz-monotonic", stop=Stop(all_rims=True))
    bearing = scene.bearing.replace(capacity=[0.03, 0.005, 0.005, 0.03])
    run = simulate(replace(scene, bearing=bearing))
    assert run.status == "stopped"
    assert {e.surface for e in run.events if e.kind == "rim_contact"} == {1, 2, 3, 4}
    assert np.all(run.history.gap[-1] <= 0) and not np.all(run.history.gap[-2] <= 0)


def test_run_begins_in_its_initial_state() -> None:
    """A bearing let go off centre under a mass: it starts there, goes back, and friction takes what it stored."""
    first = simulate(scene_of("fenz-test2", duration=10.0)).history
    start = InitialState(first.tilt_angles[-1], first.tilt_rates[-1], first.friction_state[-1])
    still = Motion(knots=[0.0, 0.5], coefficients=np.zeros((1, 6, 6)))
    mass = Top.mass(LOAD / 9.8, 300.0, 0.5, 1e7, 1e4)
    held = simulate(Scene(presets.bearing("fenz-tfp"), still, mass, Effects(), initial_state=start)).history
    for name in ("tilt_angles", "tilt_rates", "friction_state"):
        assert np.array_equal(getattr(held, name)[0], getattr(first, name)[-1]), name
    assert held.sliding[-1, 0] < held.sliding[0, 0]
    assert held.energy["friction_dissipated"][-1] > 0
    assert held.energy["potential"][-1] < 0


def test_declared_jump_of_acceleration_restarts_the_integrator() -> None:
    """A base whose acceleration jumps: a row lies on the jump, and halves joined there give the same as two runs."""
    coefficients = np.zeros((2, 6, 6))
    coefficients[0, 0, 2] = 0.25  # 0.5 m/s^2 for 0.1 s, then the speed reached
    coefficients[1, 0, :2] = 0.25 * 0.1**2, 0.5 * 0.1
    motion = Motion(knots=[0.0, 0.1, 0.3], coefficients=coefficients, jumps=[0.1])
    scene = Scene(presets.bearing("fenz-tfp"), motion, Top.rig(LOAD, 1e8, 5.0, ROTATIONAL_STIFFNESS), REPORT)
    run = simulate(scene).history
    row = int(np.flatnonzero(run.time == 0.1)[0])
    assert run.time[row + 1] - run.time[row] < 2e-4  # it starts anew, with a small step
    tight = simulate(replace(scene, solver=replace(scene.solver, rtol=1e-7))).history
    assert run.top_force[-1, 0] == pytest.approx(tight.top_force[-1, 0], rel=2e-3)
    u: Array = run.base_displacement[:, 0]
    assert u[row] == pytest.approx(0.0025, rel=1e-12) and u[-1] == pytest.approx(0.0125, rel=1e-12)


def test_moments_that_lock_the_spin_do_work() -> None:
    """A tilting plate led round a circle turns about its axis: without that work the balance is off by per cents."""
    bearing = Bearing(
        layout=Layout(2, 1, 0),
        base_height=0.03,
        surfaces=[Surface(1.0, 0.3, 0.05, 5e-4, 1e7, 0.0)],
        bodies=[Body(0.04, 0.02, 10.0, (0.2, 0.3), 0.03, 0.002)],
    )
    motion = Motion.circle(0.2, 2.0, cycles=1.0, lead_in=3.0)
    top = Top.rig(1e5, 1e8, 5.0, 1e6, 5.0)
    scene = Scene(bearing=bearing, motion=motion, top=top, effects=Effects(), solver=Solver(rtol=1e-5))
    closure = simulate(scene).summary["energy"]["closure_error"]
    assert closure < 1e-3, closure


def test_energies_of_bodies_are_those_of_the_reference() -> None:
    """Bodies that spin and swing off centre until friction stops them: translation, swing, spin, and height."""
    bearing = presets.bearing("fenz-tfp").replace(contact_damping=0.0)
    rates = [(0.2, 0.1, 30.0), (-0.1, 0.2, -40.0), (0.1, -0.2, 50.0), (0.0, 0.1, 20.0)]
    tilts = [(2e-3, -1e-3, 0.0), (-1e-3, 2e-3, 0.0), (1e-3, -3e-3, 0.0), (-2e-3, 2e-3, 0.0)]
    start = InitialState(tilts, rates, np.zeros((4, 2)))
    still = Motion(knots=[0.0, 0.008], coefficients=np.zeros((1, 6, 6)))
    effects = Effects(spin="patch", bouc_wen="report")
    top = Top.prescribed((0.0, 0.0, -LOAD))
    history = simulate(Scene(bearing, still, top, effects, Solver(rtol=1e-6), initial_state=start)).history
    rows = range(0, len(history.time), len(history.time) // 8)
    moving = zip(history.tilt_angles[rows], history.tilt_rates[rows], history.tilt_accelerations[rows], strict=True)
    states = [kinematics.State(*state) for state in moving]
    for name, of in (("kinetic", energy.kinetic_energy), ("potential", energy.potential_energy)):
        expected = np.array([of(bearing, state) for state in states])
        found = history.energy[name][rows]
        assert np.ptp(found) > (0.5 * expected[0] if name == "kinetic" else 1e-4), name
        assert found == pytest.approx(expected - expected[0], abs=1e-9 * expected[0]), name
