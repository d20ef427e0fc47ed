"""What must hold of every run, as properties over random scenes: energy, dissipation, the disc, tolerance, limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import strategies as st
from support import Array
from support.random_scenes import LAYOUTS, bearings, between, capacity, scenes
from support.stacks import LOAD, PLANAR, a_pendulum, a_rig, a_stack, holds, nested_radii, pendulum_angle, swing

from msfp_gen import Effects, Motion, RunError, Scene, Solver, simulate
from msfp_gen.results.history import History
from msfp_gen.results.result import Result
from msfp_gen.scene.top import MassTop

MASSLESS = Effects(dimension="planar", sliders="massless", bouc_wen="report")


def run_of(scene: Scene) -> Result:
    """The run; where a mass was thrown against a rim, and lifted off or jammed, what there is until then."""
    try:
        return simulate(scene)
    except RunError as error:
        assert error.status in ("uplift", "irregular") and isinstance(scene.top, MassTop), str(error)
        assert isinstance(error.result, Result) and error.result.summary["rims_met"], str(error)
        return error.result


def unresolved(scene: Scene, history: History) -> float:
    """mu N R times the tolerance of angles [J]: what a stuck surface stores or gives in moves that small."""
    reach = max(surface.friction * surface.radius for surface in scene.bearing.surfaces)
    return float(history.normal_force.max()) * reach * scene.solver.angle_tolerance


def pressed_in(scene: Scene, history: History) -> float:
    """What stuck surfaces may give beyond what they took [J]: their spring mu N/d_y is the stiffer the more presses, so
    that mu N d_y (Y^2 + Z^2)/2 is no potential where N rises. Thrown on rims, all methods agree on how much."""
    square = (history.friction_state**2).sum(axis=2)
    rises = 0.5 * (square[1:] + square[:-1]) * np.maximum(np.diff(history.normal_force, axis=0), 0.0)
    scale = [0.5 * surface.friction * surface.yield_displacement for surface in scene.bearing.surfaces]
    return float(rises.sum(axis=0) @ scale)


@holds(12, 400, scene=scenes())
def test_energy_balances_and_only_friction_and_rims_take_it(scene: Scene) -> None:
    """Input = kinetic + potential + stored + dissipated to a per cent, as of the presets; friction less its
    recoverable part, rims and dampers never give back; |f| <= 1; rims push and interfaces press."""
    run = run_of(scene)
    history, energy = run.history, run.history.energy
    peak = np.abs(energy["input"]).max()
    if run.status != "irregular":  # on the way to a normal force without a bound no step is short enough
        assert np.abs(energy["numerical"]).max() < 1e-2 * peak + unresolved(scene, run.history)
    for source in ("friction_dissipated", "rim_dissipated", "top_dissipated"):
        assert np.diff(energy[source]).min() > -1e-3 * peak - unresolved(scene, history), source
    given = unresolved(scene, history) + pressed_in(scene, history)
    assert energy["friction_stored"].min() > -1e-3 * peak - given and energy["rim_stored"].min() >= 0
    assert np.linalg.norm(history.friction_state, axis=2).max() < 1 + 10 * scene.solver.rtol
    assert history.rim_force.min() >= 0 and not history.rim_force[history.gap > 0].any()
    assert history.normal_force.min() > 0


@pytest.mark.parametrize("rtol", [1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("layout", LAYOUTS, ids=str)
def test_rows_between_steps_keep_to_the_friction_disc(layout: tuple[int, int, int], rtol: float) -> None:
    """The parabola through a step passed it by up to nine tolerances where the motion turns; steps themselves stay
    within one."""
    bearing = a_stack(layout, nested_radii(layout), yield_displacement=1e-3)
    top = a_rig(tilt=0.0 if layout == (2, 1, 0) else 1e6)
    scene = Scene(bearing, Motion.harmonic(0.1, 0.5, cycles=2), top, PLANAR, Solver(rtol=rtol), output_step=2e-3)
    assert np.linalg.norm(simulate(scene).history.friction_state, axis=2).max() < 1 + rtol


@holds(6, 200, quick={"scene": scenes(law="isotropic", layouts=[(5, 2, 2)])}, scene=scenes(law="isotropic"))
def test_energy_balances_with_the_isotropic_law(scene: Scene) -> None:
    run = run_of(scene)
    energy = run.history.energy
    peak = np.abs(energy["input"]).max()
    if run.status != "irregular":  # on the way to a normal force without a bound no step is short enough
        assert np.abs(energy["numerical"]).max() < 1e-2 * peak + unresolved(scene, run.history)
    assert np.diff(energy["friction_dissipated"]).min() > -1e-3 * peak - unresolved(scene, run.history)
    assert np.linalg.norm(run.history.friction_state, axis=2).max() < 1 + 10 * scene.solver.rtol


def force(scene: Scene, rtol: float, rows: int = 100) -> Array:
    run = simulate(replace(scene, solver=Solver(rtol=rtol), output_step=scene.end / rows))
    found: Array = run.history.top_force[:, 0]
    return found


@holds(6, 100, layout=st.sampled_from(LAYOUTS), data=st.data())
def test_half_the_tolerance_never_errs_ten_times_more(layout: tuple[int, int, int], data: st.DataObject) -> None:
    """The plain quasi-static ODE does: it goes wrong without a word at 1e-2 and 1e-3. From 1e-2 down to 1e-5;
    from the default, 1e-4, on the error is below 1 % at every point of the loop, steep unloading included."""
    bearing = data.draw(bearings(layout))
    top = a_rig(LOAD, 0.0 if layout == (2, 1, 0) else 1e6)
    scene = Scene(bearing, Motion.harmonic(0.8 * capacity(bearing), 0.1, cycles=1.0), top, MASSLESS)
    wanted = force(scene, 1e-7)
    floor = 1e-5 * np.abs(wanted).max()
    tolerances = [1e-2 / 2**i for i in range(0, 11, 2)]
    errors = [
        (float(np.abs(force(scene, t) - wanted).max()), float(np.abs(force(scene, t / 2) - wanted).max()))
        for t in tolerances
    ]
    for tolerance, (coarse, fine) in zip(tolerances, errors, strict=True):
        assert fine < 10 * coarse + floor, tolerance
        assert fine < 1e-2 * np.abs(wanted).max() or tolerance > 2e-4, tolerance


@holds(6, 100, layout=st.sampled_from(LAYOUTS), times=between(10.0, 1e4), data=st.data())
def test_quasi_static_loop_does_not_know_the_rate(
    layout: tuple[int, int, int], times: float, data: st.DataObject
) -> None:
    """Massless sliders on springs: played so many times faster the same forces come in the same order."""
    bearing = data.draw(bearings(layout)).replace(rim_damping=0.0, contact_damping=0.0)
    top, reach = a_rig(LOAD, 0.0 if layout == (2, 1, 0) else 1e6), 1.2 * capacity(bearing)
    slow, fast = (
        force(Scene(bearing, Motion.harmonic(reach, f, cycles=1.25), top, MASSLESS), 1e-5) for f in (0.01, 0.01 * times)
    )
    assert np.abs(fast - slow).max() < 1e-3 * np.abs(slow).max()


def off_massless(mass: float, load: float) -> float:
    """What sliders of that mass change in the force of a double pendulum, over its peak."""
    bearing = a_stack((3, 1, 1), [1.0, 1.0], body={"mass": mass}, yield_displacement=5e-3)
    scene = Scene(bearing, Motion.harmonic(0.05, 0.5, cycles=0.5), a_rig(load, 1e3 * load), PLANAR)
    heavy, light = (force(replace(scene, effects=effects), 1e-7) for effects in (PLANAR, MASSLESS))
    return float(np.abs(heavy - light).max() / np.abs(light).max())


def test_massless_is_the_limit_of_light_sliders_at_first_order() -> None:
    """A third of the mass, a third of the difference, from 20 kg down to 2 kg under 10 kN."""
    apart = np.array([off_massless(20.0 * scale, 1e4) for scale in (1.0, 0.3, 0.1)])
    rates = np.log(apart[:-1] / apart[1:]) / np.log([1 / 0.3, 3.0])
    assert np.abs(rates - 1.0).max() < 0.2


@holds(3, 30, mass=between(2.0, 20.0), load=between(5e3, 5e4))
def test_massless_is_the_limit_of_light_sliders(mass: float, load: float) -> None:
    """Whatever mass and load: a tenth of the mass, the difference below a fifth or at what the ringing leaves."""
    assert off_massless(0.1 * mass, load) < 0.2 * off_massless(mass, load) + 5e-4


@holds(
    10, 200, radius=between(0.05, 20.0), angle=between(1e-3, 1.4), mass=between(0.1, 50.0), part=st.floats(0.05, 0.5)
)
def test_frictionless_pendulum_against_elliptic_functions(
    radius: float, angle: float, mass: float, part: float
) -> None:
    """Two periods of any swing, the slider up to half as high as its bowl is deep."""
    bearing = a_pendulum(radius, mass, height=part * radius)
    period = 2 * np.pi * np.sqrt(radius / 9.8)
    run = simulate(swing(bearing, angle, 2 * period, solver=Solver(rtol=1e-7, atol_angle=1e-9 * angle))).history
    assert np.abs(run.tilt_angles[:, 0, 1] - pendulum_angle(bearing, angle, run.time)).max() < 2e-3 * angle
