"""What must hold of every run, as properties over random scenes: energy, dissipation, the disc, tolerance, limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st
from random_scenes import LAYOUTS, bearings, between, capacity, scenes
from stacks import LOAD, PLANAR, a_pendulum, a_rig, holds, pendulum_angle, swing
from support import Array

from msfp_gen import Effects, Motion, Scene, Solver, simulate

MASSLESS = Effects(dimension="planar", sliders="massless")


@holds(12, 400, scene=scenes())
def test_energy_balances_and_only_friction_and_rims_take_it(scene: Scene) -> None:
    """Input = kinetic + potential + stored + dissipated to half a per cent; friction less its recoverable part, rims and
    dampers never give back; |f| <= 1; rims push and interfaces press."""
    run = simulate(scene)
    history, energy = run.history, run.history.energy
    peak = np.abs(energy["input"]).max()
    assert np.abs(energy["numerical"]).max() < 5e-3 * peak
    for source in ("friction_dissipated", "rim_dissipated", "top_dissipated"):
        assert np.diff(energy[source]).min() > -1e-4 * peak, source
    assert energy["friction_stored"].min() > -1e-4 * peak and energy["rim_stored"].min() >= 0
    assert np.linalg.norm(history.friction_state, axis=2).max() < 1 + 10 * scene.solver.rtol
    assert history.rim_force.min() >= 0 and not history.rim_force[history.gap > 0].any()
    assert history.normal_force.min() > 0


@holds(6, 200, scene=scenes(law="isotropic"))
def test_energy_balances_with_the_isotropic_law(scene: Scene) -> None:
    run = simulate(scene)
    energy = run.history.energy
    peak = np.abs(energy["input"]).max()
    assert np.abs(energy["numerical"]).max() < 5e-3 * peak
    assert np.diff(energy["friction_dissipated"]).min() > -1e-4 * peak
    assert np.linalg.norm(run.history.friction_state, axis=2).max() < 1 + 10 * scene.solver.rtol


def force(scene: Scene, rtol: float, rows: int = 100) -> Array:
    run = simulate(replace(scene, solver=Solver(rtol=rtol), output_step=scene.end / rows))
    found: Array = run.history.top_force[:, 0]
    return found


@holds(6, 100, layout=st.sampled_from(LAYOUTS), data=st.data())
def test_half_the_tolerance_never_errs_ten_times_more(layout: tuple[int, int, int], data: st.DataObject) -> None:
    """The plain quasi-static ODE does: it goes wrong without a word at 1e-2 and 1e-3. From 1e-2 down to 1e-5."""
    bearing = data.draw(bearings(layout))
    top = a_rig(LOAD, 0.0 if layout == (2, 1, 0) else 1e6)
    scene = Scene(bearing, Motion.harmonic(0.8 * capacity(bearing), 0.1, cycles=1.0), top, MASSLESS)
    wanted = force(scene, 1e-7)
    floor = 1e-5 * np.abs(wanted).max()
    tolerances = [1e-2 / 2**i for i in range(0, 11, 2)]
    errors = [(float(np.abs(force(scene, t) - wanted).max()), float(np.abs(force(scene, t / 2) - wanted).max()))
              for t in tolerances]  # fmt: skip
    for tolerance, (coarse, fine) in zip(tolerances, errors, strict=True):
        assert fine < 10 * coarse + floor, tolerance
        assert coarse < (0.5 * tolerance + 2e-3) * 10 * np.abs(wanted).max(), tolerance


@holds(6, 100, layout=st.sampled_from(LAYOUTS), times=between(10.0, 1e4), data=st.data())
def test_quasi_static_loop_does_not_know_the_rate(layout: tuple[int, int, int], times: float, data: st.DataObject) -> None:
    """Massless sliders on springs: played so many times faster the same forces come in the same order."""
    bearing = data.draw(bearings(layout)).replace(rim_damping=0.0)
    top, reach = a_rig(LOAD, 0.0 if layout == (2, 1, 0) else 1e6), 1.2 * capacity(bearing)
    slow, fast = (
        force(Scene(bearing, Motion.harmonic(reach, f, cycles=1.25), top, MASSLESS), 1e-5) for f in (0.01, 0.01 * times)
    )
    assert np.abs(fast - slow).max() < 1e-3 * np.abs(slow).max()


@holds(3, 30, mass=between(2.0, 20.0), load=between(5e3, 5e4))
def test_massless_is_the_limit_of_light_sliders(mass: float, load: float) -> None:
    """The force differs in proportion to the sliders' mass: a tenth of it, a tenth of the difference."""
    from stacks import a_stack

    motion, apart = Motion.harmonic(0.05, 0.5, cycles=0.5), []
    for scale in (1.0, 0.1):
        bearing = a_stack((3, 1, 1), [1.0, 1.0], body={"mass": scale * mass}, yield_displacement=5e-3)
        scene = Scene(bearing, motion, a_rig(load, 1e3 * load), PLANAR)
        heavy, light = (force(replace(scene, effects=effects), 1e-7) for effects in (PLANAR, MASSLESS))
        apart.append(np.abs(heavy - light).max() / np.abs(light).max())
    assert 0.8 < np.log10(apart[0] / apart[1]) < 1.2


@holds(10, 200, radius=between(0.05, 20.0), angle=between(1e-3, 1.4), mass=between(0.1, 50.0), part=st.floats(0.05, 0.5))
def test_frictionless_pendulum_against_elliptic_functions(radius: float, angle: float, mass: float, part: float) -> None:
    """Two periods of any swing, the slider up to half as high as its bowl is deep."""
    height = part * radius
    bearing = a_pendulum(radius, mass, capacity=1.45 * radius, yield_displacement=1e6)
    body = replace(bearing.bodies[0], height=height, centroid=height / 2, rim_radius=1e-3 * radius)
    bearing = replace(bearing, bodies=[body])
    period = 2 * np.pi * np.sqrt(radius / 9.8)
    assume(angle < 1.45)
    run = simulate(swing(bearing, angle, 2 * period, solver=Solver(rtol=1e-7, atol_angle=1e-9 * angle))).history
    assert np.abs(run.tilt_angles[:, 0, 1] - pendulum_angle(bearing, angle, run.time)).max() < 2e-3 * angle
