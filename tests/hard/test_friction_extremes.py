"""Friction: all stuck, turning back in every stage, from a hard yield displacement to a soft one, from none to 0.5."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from reference.friction_circle import Push, first_slip, force_at
from support import failure_of, preset_run, thinned
from support.stacks import (
    LOAD,
    PLANAR,
    TILT_STIFFNESS,
    a_pendulum,
    a_rig,
    a_stack,
    off_the_reference,
    pendulum_angle,
    pushed,
    slow_path,
    swing,
)

from msfp_gen import Motion, Scene, Solver, presets, simulate
from msfp_gen.results.result import Result

TFP, RADII, FRICTION = (5, 2, 2), [1.0, 0.3, 0.3, 1.0], [0.03, 0.015, 0.015, 0.1]
TRAVEL = [0.2, 0.06, 0.06, 0.2]
PATH = [0.1, -0.05, 0.02]


def triple(**values: object) -> Result:
    """The path over a triple pendulum, at 5 mm/s."""
    bearing = a_stack(TFP, RADII, **{"friction": FRICTION, "capacity": TRAVEL, **values})
    return pushed(bearing, PATH, speed=5e-3, rtol=1e-5)


# ---- stuck -----------------------------------------------------------------------------------------------------


def test_all_surfaces_stuck_are_springs_in_a_row() -> None:
    """Twenty micrometres, a hundredth of the first slip: the force of the reference, hardly any loss, no slip."""
    bearing = a_stack(TFP, RADII, friction=0.1, capacity=TRAVEL, yield_displacement=1e-3)
    run = pushed(bearing, [2e-5, -2e-5, 0.0], speed=2e-5, rtol=1e-6, atol_angle=1e-10)
    assert off_the_reference(run, rows=40, stride=1e-6) < 1e-3
    assert np.abs(run.history.friction_state).max() < 0.05
    energy = run.history.energy
    assert energy["friction_dissipated"][-1] < 0.05 * np.abs(energy["input"]).max()


def test_a_stuck_bearing_on_a_slope_does_not_creep() -> None:
    """Held at half its friction for ten minutes it stays where it is, to nanometres: Bouc-Wen holds, tanh(v) creeps."""
    bearing = a_stack((3, 1, 1), [1.0, 1.0], friction=0.05, yield_displacement=1e-4)
    wave = slow_path([3e-5], speed=1e-5).held(600.0)
    scene = Scene(bearing, wave, a_rig(), effects=PLANAR, solver=Solver(rtol=1e-6, atol_angle=1e-12))
    history = simulate(scene).history
    hold = history.time >= wave.duration - 600.0
    assert np.abs(history.friction_state[-1, :, 0]).max() > 0.1
    assert np.ptp(history.sliding[hold], axis=0).max() < 1e-9


# ---- turning back ----------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_reversal_in_every_stage() -> None:
    """The bearing of Table A.1 turned back in each of its five stages, ever wider, rims included."""
    turns = [0.001, -0.001, 0.02, -0.02, 0.06, -0.06, 0.1, -0.1, 0.138, -0.138, 0.0]
    run = pushed(presets.bearing("fenz-tfp"), turns, load=112e3, speed=2e-3, rtol=1e-5)
    assert {event.surface for event in run.events if event.kind == "rim_contact"} == {1, 4}
    assert off_the_reference(run, rows=80) < 3e-3
    assert run.summary["energy"]["closure_error"] < 1e-3


@pytest.mark.parametrize("after", thinned([1e-6, 1e-5, 1e-4, 1e-3], lambda after: after == 1e-6))
def test_reversal_right_after_the_knee(after: float) -> None:
    """Turned back `after` the knee by so many metres, when Y is nearly 1 and the tangent changes most."""
    bearing = a_stack((3, 1, 1), [1.0, 1.0], yield_displacement=1e-4)
    knee = 6e-4
    run = pushed(bearing, [knee + after, knee, knee + 2 * after, 0.0], speed=1e-3, rtol=1e-6)
    assert off_the_reference(run, rows=60, stride=1e-5) < 2e-3
    assert np.linalg.norm(run.history.friction_state, axis=2).max() < 1 + 1e-5


# ---- yield displacement and size -------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("yield_displacement", thinned([1e-4, 1e-3, 1e-2], lambda d_y: d_y == 1e-3))
def test_soft_yield_follows_the_reference(yield_displacement: float) -> None:
    assert off_the_reference(triple(yield_displacement=yield_displacement), rows=30) < 1e-3


@pytest.mark.parametrize("yield_displacement", thinned([1e-6, 1e-5], lambda d_y: d_y == 1e-6))
def test_hard_yield_tends_to_the_closed_form(yield_displacement: float) -> None:
    """One micrometre: the rigid-plastic closed form, within what a yield displacement leaves of it."""
    values = {"friction": FRICTION, "capacity": TRAVEL, "body": {"mass": 1e-3}}
    bearing = a_stack(TFP, RADII, yield_displacement=yield_displacement, **values)
    history = pushed(bearing, [-0.15], speed=5e-3).history
    u, force = np.abs(history.displacement[:, 0]), np.abs(history.top_force[:, 0])
    rows = np.flatnonzero(u > 2e-3)[:: max(1, len(u) // 30)]
    want = force_at(Push(bearing, LOAD, TILT_STIFFNESS), list(u[rows]))
    assert np.abs(force[rows] - want).max() < 5 * yield_displacement * LOAD + 1e-5 * LOAD


FRICTIONS = {
    "half everywhere": [0.5] * 4,
    "outer 100 times inner": [0.1, 0.001, 0.001, 0.1],
    "inner 100 times outer": [0.001, 0.1, 0.1, 0.001],
    "in turns": [0.1, 0.001, 0.1, 0.001],
    "one rough": [0.001, 0.001, 0.001, 0.1],
    "three without": [0.0, 0.05, 0.0, 0.0],
}


OFTEN = ("three without",)


@pytest.mark.parametrize("kind", thinned(FRICTIONS, lambda kind: kind in OFTEN))
def test_friction_however_spread_follows_the_reference(kind: str) -> None:
    assert off_the_reference(triple(friction=FRICTIONS[kind]), rows=30) < 2e-3


@pytest.mark.parametrize("start", [0.01, 0.5, 1.3])
def test_no_friction_is_a_pendulum(start: float) -> None:
    bearing = a_pendulum(yield_displacement=1e-3, capacity=1.5 * 0.5)  # Y races, and pulls nothing
    run = simulate(swing(bearing, start, 3.0, solver=Solver(rtol=1e-6))).history
    assert np.abs(run.tilt_angles[:, 0, 1] - pendulum_angle(bearing, start, run.time)).max() < 1e-3 * start


# ---- unusual orderings -----------------------------------------------------------------------------------------


ORDERS = [
    ((5, 4, 0), [1.0, 0.7, 0.5, 0.3]),
    ((5, 0, 4), [0.3, 0.5, 0.7, 1.0]),
    ((5, 3, 1), [1.0, 0.5, 0.25, 1.0]),
    ((5, 1, 3), [1.0, 0.25, 0.5, 1.0]),
]


@pytest.mark.slow
@pytest.mark.parametrize(("layout", "radii"), thinned(ORDERS, lambda layout, _: layout == (5, 3, 1)), ids=str)
def test_any_number_up_and_down_follows_the_reference(layout: tuple[int, int, int], radii: list[float]) -> None:
    bearing = a_stack(layout, radii, friction=[0.02, 0.04, 0.06, 0.08])
    assert off_the_reference(pushed(bearing, PATH, speed=2e-3, rtol=1e-5), rows=60) < 2e-3


def test_rough_inside_smooth_outside_slides_outside_first() -> None:
    """Section 4.2's bearing. Formulas for the usual order start at F/N = 0.168; it slides at 0.06."""
    scene = preset_run("unusual-tfp").scene
    slip = first_slip(Push(scene.bearing, 112e3, 1e10))
    assert slip.surface in (1, 4) and slip.at.force / 112e3 < 0.08
    run = preset_run("unusual-tfp").history
    early = int(np.argmax(run.horizontal > 2e-3))
    assert 0.05 < np.abs(run.top_force[early, 0]) / 112e3 < 0.08
    assert set(np.argsort(run.sliding[early])[-2:]) == {0, 3}


INVERTED = {"friction": FRICTION, "yield_displacement": 5e-3}


def test_small_radii_outside_large_inside_stands_while_friction_holds() -> None:
    """The other way round from any catalogue: sphere centres upside down, an inverted pendulum that friction holds up.
    The reference finds no path; two tolerances and two methods agree."""
    bearing = a_stack(TFP, [0.3, 1.0, 1.0, 0.3], **INVERTED)
    scene = Scene(bearing, Motion.harmonic(1e-3, 1.0, cycles=0.5), a_rig(), effects=PLANAR, output_step=0.01)
    tight, loose, explicit = (
        simulate(replace(scene, solver=s)).history.top_force[:, 0]
        for s in (Solver(rtol=1e-7), Solver(rtol=1e-5), Solver(rtol=1e-6, method="dopri5"))
    )
    assert np.abs(explicit - tight).max() < 5e-3 * np.abs(tight).max()
    assert np.abs(loose - tight).max() < 2e-2 * np.abs(tight).max()


@pytest.mark.parametrize("rtol", [1e-3, 1e-4, 1e-6])
def test_a_stack_that_falls_over_ends_with_a_name(rtol: float) -> None:
    """Pushed further, the same stack falls over within milliseconds: no number is made up for what follows."""
    bearing = a_stack(TFP, [0.3, 1.0, 1.0, 0.3], **INVERTED)
    scene = Scene(bearing, Motion.harmonic(0.03, 1.0, cycles=0.5), a_rig(), effects=PLANAR, solver=Solver(rtol=rtol))
    error = failure_of(scene)
    assert error.status in ("newton", "irregular", "uplift", "angle")
    assert isinstance(error.result, Result) and np.isfinite(error.result.history.top_force).all()
