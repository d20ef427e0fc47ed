"""Friction before and at sliding: contact damping, and the elastic-perfectly plastic law (docs/friction.md)."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from support import scene_of, thinned
from support.stacks import a_stack

from msfp_gen import (
    Bearing,
    Body,
    Effects,
    InitialState,
    Layout,
    Load,
    Motion,
    Result,
    Scene,
    Solver,
    Surface,
    Top,
    presets,
    simulate,
)
from msfp_gen.studies.accuracy.timed_run import errors, run_native

RADIUS, HEIGHT, MU, OFFSET, WEIGHT, GRAVITY = 2.2, 0.1, 0.06, 0.08, 1e6, 9.8


def pendulum(d_y: float, T: float) -> Bearing:
    """A single pendulum whose top plate is the slider."""
    surface = Surface(RADIUS, 0.5, MU, d_y, 1e8, 1e3, contact_damping=T)
    return Bearing(Layout(2, 1, 0), HEIGHT, [surface], [Body(0.1, 0.05, 200.0, (1.0, 2.0), 0.1)], gravity=GRAVITY)


def off_centre(law: str, d_y: float, T: float, motion: Motion, **solver: Any) -> Scene:
    """A mass at rest on a single pendulum, held by friction 80 mm off the centre."""
    angle = np.arcsin(OFFSET / RADIUS)
    held = float(np.tan(angle) / MU * (RADIUS - HEIGHT) / RADIUS)
    state = InitialState(q=((0.0, angle, 0.0),), v=((0.0, 0.0, 0.0),), h=((held, 0.0),))
    effects, top = Effects(bouc_wen=law), Top.mass(WEIGHT / GRAVITY, 1.0, 0.0)
    settings = Solver(**{"rtol": 1e-4, **solver})
    return Scene(pendulum(d_y, T), motion, top, effects=effects, solver=settings, initial_state=state, output_step=0.05)


def shaken_off_centre(law: str, d_y: float) -> float:
    """How far it has moved after a minute of 0.02 g at 1 Hz, which Coulomb friction holds [m]."""
    motion = Motion.harmonic(0.02 * 9.81 / (2 * np.pi) ** 2, 1.0, cycles=50, lead_in=10.0)
    run = simulate(off_centre(law, d_y, 1e-4, motion))
    assert run.status == "ok"
    return float(run.history.sliding[-1, 0] - run.history.sliding[0, 0])


@pytest.mark.slow
@pytest.mark.parametrize("d_y", [5e-4, 1e-4])
def test_a_stuck_bearing_does_not_creep_under_small_cycles(d_y: float) -> None:
    """The plastic law holds it to a micrometre; the Bouc-Wen law lets it slide back by millimetres."""
    assert abs(shaken_off_centre("plastic", d_y)) < 1e-6
    assert shaken_off_centre("report", d_y) < -2e-3


@pytest.mark.slow
def test_a_stuck_mass_rings_down_as_its_damping_says() -> None:
    """On the spring mu N/d_y a mass has the damping ratio omega T/2: the logarithmic decrement of its free ringing."""
    T, d_y = 2e-3, 5e-4
    rest = Motion.harmonic(1e-12, 1.0, cycles=7, lead_in=1.0)
    scene = off_centre("plastic", d_y, T, rest, rtol=1e-7, method="esdirk4")
    state = scene.initial_state
    assert state is not None
    scene = replace(scene, initial_state=replace(state, h=((0.8 * state.h[0][0], 0.0),)), output_step=1e-3)
    history = simulate(scene).history
    slide = history.sliding[:, 0] - history.sliding[-1, 0]
    peaks = np.flatnonzero((slide[1:-1] > slide[:-2]) & (slide[1:-1] >= slide[2:])) + 1
    amplitudes, times = slide[peaks[:5]], history.time[peaks[:5]]
    omega = 2 * np.pi * 4 / (times[-1] - times[0])
    decrement = np.log(amplitudes[0] / amplitudes[-1]) / 4
    assert decrement == pytest.approx(np.pi * omega * T, rel=0.01)


@cache
def run_of(name: str, law: str, T: float, method: str, rtol: float) -> Any:
    scene = scene_of(name, {"bouc_wen": law}, {"method": method, "rtol": rtol}, output_step=0.01)
    return simulate(replace(scene, bearing=scene.bearing.replace(contact_damping=T)))


def distance(one: Any, other: Any) -> float:
    """RMS of the difference of two forces over the largest force."""
    a, b = one.history.top_force[:, :2], other.history.top_force[:, :2]
    return float(np.sqrt(np.mean(np.sum((a - b) ** 2, axis=1))) / np.abs(b).max())


@pytest.mark.parametrize("law", thinned(["report", "plastic"], lambda law: law == "plastic"))
def test_with_damping_a_tighter_tolerance_converges(law: str) -> None:
    """Five stages and two rims: the method of order 4 at 1e-6 and the default at 1e-5 agree to 0.005 %."""
    tight = run_of("fenz-test5", law, 1e-4, "esdirk4", 1e-6)
    assert distance(run_of("fenz-test5", law, 1e-4, "implicit", 1e-5), tight) < 5e-5
    assert distance(run_of("fenz-test5", law, 1e-4, "implicit", 1e-4), tight) < 4e-4


def test_damping_costs_no_peak_of_the_loop() -> None:
    """A tenth of a millisecond moves the largest force of test 5 by less than 0.01 %."""
    peaks = [
        float(np.abs(run_of("fenz-test5", "report", T, "implicit", 1e-4).history.top_force).max()) for T in (0.0, 1e-4)
    ]
    assert peaks[1] == pytest.approx(peaks[0], rel=1e-4)


@pytest.mark.parametrize("law", ["report", "isotropic", "plastic"])
def test_energy_closes_and_contact_damping_only_dissipates(law: str) -> None:
    run = run_of("fenz-test5", law, 1e-3, "implicit", 1e-5)
    energy, peak = run.history.energy, np.abs(run.history.energy["input"]).max()
    assert np.abs(energy["numerical"]).max() < 1e-3 * peak
    assert np.diff(energy["contact_dissipated"]).min() >= -1e-9 * peak
    assert 1e-6 * peak < energy["contact_dissipated"][-1] < 0.01 * peak


@pytest.mark.parametrize("law", ["report", pytest.param("plastic", marks=pytest.mark.slow)])
def test_explicit_and_implicit_method_agree(law: str) -> None:
    """One surface with the damping that dopri5 resolves, through a reversal."""
    heavy = {"mass": 50.0, "inertia": (1.0, 1.0)}
    bearing = a_stack(
        (3, 1, 1), [1.0, 1.0], heavy, yield_displacement=1e-3, friction=[0.05, 0.08], contact_damping=1e-3
    )
    motion = Motion.harmonic(0.02, 1.0, cycles=0.6, lead_in=0.3)
    scene = Scene(
        bearing,
        motion,
        Top.rig(1e5, 1e8, 1e3, 1e7, 1e4),
        effects=Effects(bouc_wen=law),
        output_step=0.01,
        solver=Solver(rtol=1e-6),
    )
    explicit = simulate(replace(scene, solver=Solver(method="dopri5", rtol=1e-5, max_steps=2_000_000)))
    assert explicit.status == "ok"
    assert distance(simulate(scene), explicit) < 2e-4


@pytest.mark.parametrize("law", thinned(["report", "plastic"], lambda law: law == "report"))
def test_quasistatic_steps_equal_the_integrated_run(law: str) -> None:
    """Closed-form steps of a planar model without masses, with contact damping, against the method of order 4."""
    effects = {"bouc_wen": law, "dimension": "planar", "sliders": "massless"}
    scene = scene_of("fenz-test4", effects, {"rtol": 1e-5}, output_step=0.05)
    scene = replace(scene, bearing=scene.bearing.replace(contact_damping=1e-3))
    flows = simulate(scene)
    integrated = simulate(replace(scene, solver=replace(scene.solver, method="esdirk4")))
    assert distance(flows, integrated) < 3e-4
    for term in ("friction_dissipated", "contact_dissipated"):
        largest = integrated.history.energy["friction_dissipated"][-1]
        assert flows.history.energy[term][-1] == pytest.approx(integrated.history.energy[term][-1], abs=1e-3 * largest)


def test_plastic_friction_is_along_the_slip() -> None:
    """On a circle the friction state turns with the slip and stays on the edge of the unit disc."""
    run = simulate(replace(scene_of("becker-circle-50", {"bouc_wen": "plastic"}), output_step=0.05))
    state, slip = run.history.friction_state[:, 0], run.history.slip_velocity[:, 0]
    size, speed = np.linalg.norm(state, axis=1), np.linalg.norm(slip, axis=1)
    assert size.max() < 1 + 1e-9
    slides = (size > 0.999) & (speed > 0.2 * speed.max())
    assert slides.mean() > 0.3
    cosine = np.sum(state * slip, axis=1)[slides] / speed[slides]
    assert np.median(cosine) > 0.9999 and cosine.min() > 0.99


def test_a_run_that_creeps_says_so() -> None:
    """A Bouc-Wen law long stuck off the centre, and not a plastic one."""
    motion = Motion.harmonic(0.02 * 9.81 / (2 * np.pi) ** 2, 1.0, cycles=30, lead_in=10.0)
    report, plastic = (off_centre(law, 5e-4, 1e-4, motion) for law in ("report", "plastic"))
    creeping = simulate(report)
    held = simulate(replace(plastic, effects=replace(plastic.effects, dimension="planar", rims=False)))
    assert [note.kind for note in held.notes] == []
    (note,) = [note for note in creeping.notes if note.kind == "creep"]
    moved = float(np.ptp(creeping.history.sliding))
    assert "bouc_wen = 'plastic'" in note.line
    assert 0.3 * moved < note.value < 1.05 * moved  # part of it in rows where friction is nearly mobilised


CREEPING = [
    ("double-fp", 0.1, 0.02, 2e6),
    ("prototype-tfp", 0.08, 0.02, 112e3),
    pytest.param("quintuple-fp", 0.25, 0.0, 112e3, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("name", "pushed", "back", "load"), CREEPING)
def test_creep_under_a_ripple_of_the_load_is_that_of_all_surfaces(
    name: str, pushed: float, back: float, load: float
) -> None:
    """Pushed out, back by a share, and held by a soft rig for a minute, under a load that varies by 3 %.

    The surfaces of the quintuple pendulum, which is not let back, are nearly mobilised in every cycle.
    """
    bearing, rise = presets.bearing(name), smooth(np.linspace(0, 1, 101))
    time, path = np.linspace(0, 10, 201), pushed * np.concatenate([rise, 1 - back * rise[1:]])
    top = Top.rig(load, 5 * load / bearing.surfaces[0].radius, rotational_stiffness=10 * load)
    ripple = Load.harmonic((0.0, 0.0, 0.03 * load), frequency=1.0, cycles=58, lead_in=11.0)
    motion = Motion.from_arrays(time, np.outer(path, [1.0, 0.0, 0.0])).held(70.0)
    scene = Scene(bearing, motion, top, Effects(dimension="planar"), load=ripple, output_step=0.05)
    yields = np.array([surface.yield_displacement for surface in bearing.surfaces])

    def moved(run: Result) -> float:
        held = (run.history.time > 12) & (run.history.time < 68)
        elastic = yields * np.ptp(run.history.friction_state[held], axis=0)[:, 0]
        return float((np.ptp(run.history.sliding[held], axis=0) - elastic).clip(0).sum())

    run = simulate(scene)
    (note,) = [note for note in run.notes if note.kind == "creep"]
    assert 0.5 * moved(run) < note.value < 2 * moved(run) and moved(run) > 5e-4
    plastic = simulate(replace(scene, effects=replace(scene.modelled, bouc_wen="plastic")))
    assert moved(plastic) < 0.01 * moved(run)


def smooth(share: np.ndarray) -> np.ndarray:
    """A rise from 0 to 1 that starts and ends at rest."""
    return np.asarray(share**3 * (10 - 15 * share + 6 * share**2))


def vibrating(amplitude: float, **solver: Any) -> Scene:
    """A mass on a triple pendulum that slides for moments, and vibrates on stuck surfaces between."""
    top = Top.mass(17.7e3, 5.3e3, 0.4, 1.73e6, 8.7e3, 1.66e8, 1.7e5)
    motion, effects = Motion.harmonic(amplitude, 0.3, cycles=2), Effects(dimension="planar", bouc_wen="plastic")
    bearing = presets.bearing("prototype-tfp").replace(yield_displacement=9e-4)
    return Scene(bearing, motion, top, effects, Solver(**{"rtol": 1e-4, **solver}))


@pytest.mark.slow
@pytest.mark.parametrize("output_step", [None, 0.01])
def test_vibrations_of_a_stuck_mass_whose_errors_add_up_are_noted(output_step: float | None) -> None:
    """The number is the true error within a factor of four; at a tight tolerance there is no note."""
    scene = vibrating(0.07)
    tight = run_native("esdirk4", scene, 1e-7, 60.0, repeats=0)
    true = errors(run_native("implicit", scene, 1e-4, 60.0, repeats=0), tight)
    assert true is not None and true["force"].rms > 0.005
    (note,) = [note for note in simulate(replace(scene, output_step=output_step)).notes if note.kind == "vibration"]
    assert true["force"].rms / 4 < note.value < 4 * true["force"].rms and "--error" in note.text
    for calm in (vibrating(0.07, rtol=1e-7), vibrating(0.07, method="esdirk4"), vibrating(0.25)):
        assert not [note for note in simulate(replace(calm, output_step=output_step)).notes if note.kind == "vibration"]


def test_contact_damping_that_changes_sliding_is_noted() -> None:
    """At a hundredth of a second the damping dissipates a few per cent of what friction does."""
    run = run_of("fenz-test5", "report", 1e-4, "implicit", 1e-4)
    assert not [note for note in run.notes if note.kind == "damping"]
    scene = scene_of("ridgecrest-clc", {"bouc_wen": "report"}, duration=12.0)
    run = simulate(replace(scene, bearing=scene.bearing.replace(contact_damping=1e-2)))
    (note,) = [note for note in run.notes if note.kind == "damping"]
    energy = run.history.energy
    assert note.time == run.history.time[-1]
    assert note.value == energy["contact_dissipated"][-1] / energy["friction_dissipated"][-1] > 0.01
