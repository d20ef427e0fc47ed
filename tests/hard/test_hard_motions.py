"""Motions: none, very slow, very fast, very long, with spikes, and with what no run should take: jumps of velocity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import Array
from support.stacks import PLANAR, a_pendulum, a_rig, a_stack, off_the_reference, pendulum_angle, pushed, swing

from msfp_gen import Bearing, Effects, InputError, Motion, Scene, Solver, Top, load_scene, simulate
from msfp_gen.results.result import Result


def triple(**values: float) -> Bearing:
    return a_stack(
        (5, 2, 2), [1.0, 0.3, 0.3, 1.0], friction=[0.03, 0.015, 0.015, 0.1], capacity=[0.2, 0.06, 0.06, 0.2], **values
    )


def shaken(bearing: Bearing, motion: Motion, output_step: float, **solver: object) -> Result:
    return simulate(Scene(bearing, motion, a_rig(), PLANAR, Solver(**solver), output_step=output_step))


@pytest.mark.parametrize("dimension", ["planar", "spatial"])
def test_no_motion_at_all(dimension: str) -> None:
    """Ten minutes of nothing: exactly nothing, in a handful of steps, and a summary without a division by zero."""
    still = Motion(knots=[0.0, 600.0], coefficients=np.zeros((1, 6, 6)))
    run = simulate(Scene(triple(), still, a_rig(), Effects(dimension=dimension)))
    for name in ("tilt_angles", "tilt_rates", "friction_state", "slip_velocity", "sliding", "displacement"):
        assert not np.any(getattr(run.history, name)), name
    assert not np.any(run.history.top_force[:, :2]) and run.counters.steps < 50
    assert run.summary["energy"]["closure_error"] is None


@pytest.mark.slow
def test_a_millihertz() -> None:
    """A period of a thousand seconds takes no more steps than one of ten."""
    slow, fast = (shaken(triple(), Motion.harmonic(0.1, f, cycles=0.75), 0.01 / f) for f in (1e-3, 1e-1))
    assert off_the_reference(slow, rows=30) < 1e-3
    assert slow.counters.steps < 1.5 * fast.counters.steps < 1000


def test_a_kilohertz() -> None:
    """Ten micrometres at 1 kHz, among the stuck modes of the sliders: the explicit method and the default agree once
    the tolerance is of the size of the motion; with the default tolerance that ringing is filtered."""
    bearing, wave = a_stack((3, 1, 1), [1.0, 1.0], yield_displacement=1e-3), Motion.harmonic(1e-5, 1e3, cycles=5.0)
    explicit = shaken(bearing, wave, 1e-5, method="dopri5", rtol=1e-7, atol_angle=1e-12).history.top_force[:, 0]
    tight = shaken(bearing, wave, 1e-5, rtol=1e-8, atol_angle=1e-13).history.top_force[:, 0]
    assert np.abs(tight - explicit).max() < 5e-3 * np.abs(explicit).max()


@pytest.mark.slow
def test_six_hundred_seconds_of_cycles_do_not_drift() -> None:
    """Three hundred cycles: the last thirty write the loops of the first to 0.1 % on average, each of them to 1 %.

    One loop differs from the next by how inner surfaces of like friction share the way, which hangs on the last digit.
    """
    period, rows = 2.0, 100
    run = shaken(triple(), Motion.harmonic(0.1, 1 / period, cycles=299.75), period / rows)
    assert run.history.time[-1] == 600.0
    for values in (run.history.top_force[:, :1], run.history.sliding):
        loops = values[: 300 * rows].reshape(300, rows, -1)
        size = np.abs(values).max()
        assert np.abs(loops[-30:].mean(axis=0) - loops[3:33].mean(axis=0)).max() < 1e-3 * size
        assert np.abs(loops[3:] - loops[3]).max() < 1e-2 * size
    assert run.summary["energy"]["closure_error"] < 1e-3


@pytest.mark.slow
def test_six_hundred_seconds_of_a_frictionless_swing() -> None:
    """Nothing damps it but the method: amplitude and phase after 400 periods, against elliptic functions."""
    bearing = a_pendulum()
    run = simulate(
        replace(swing(bearing, 0.1, 600.0, solver=Solver(rtol=1e-7, atol_angle=1e-10)), output_step=0.5)
    ).history
    energy = run.energy["kinetic"] + run.energy["potential"]
    stored = bearing.bodies[0].mass * 9.8 * 0.49 * (1 - np.cos(0.1))
    assert np.abs(energy).max() < 5e-3 * stored
    late = run.time > 595.0
    want = pendulum_angle(bearing, 0.1, run.time[late])
    assert np.abs(run.tilt_angles[late, 0, 1] - want).max() < 0.05 * 0.1


# ---- spikes ----------------------------------------------------------------------------------------------------


def spiked(seed: int, count: int = 6, size: float = 50.0) -> Motion:
    """A calm wave of 0.5 m/s^2 with single samples, 5 ms apart, of 5 g in it, each taken back 0.1 s later."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 3.0, 0.005)
    acceleration = np.zeros((len(t), 3))
    acceleration[:, 0] = 0.5 * np.sin(2 * np.pi * t)
    where, sign = rng.integers(10, len(t) - 40, count), rng.choice([-1.0, 1.0], count)
    np.add.at(acceleration[:, 0], where, size * sign)
    np.add.at(acceleration[:, 0], where + 20, -size * sign)
    return Motion.from_acceleration(t, acceleration)


def apart(one: Array, other: Array) -> float:
    """Root mean square of the difference over the peak."""
    return float(np.sqrt(np.mean((one - other) ** 2)) / np.abs(other).max())


@pytest.mark.parametrize("seed", range(3))
def test_a_record_with_spikes_is_seen_spike_by_spike(seed: int) -> None:
    """A step lands on every sample, so no spike is passed over. Five g within a sample make the sliders ring, which a
    loose tolerance filters: compared is the mean square, with a tight tolerance."""
    motion = spiked(seed)
    loose, tight = (shaken(triple(), motion, 0.005, rtol=rtol).history.top_force[:, 0] for rtol in (1e-4, 1e-7))
    assert apart(loose, tight) < 1e-2
    own = simulate(Scene(triple(), motion, a_rig(), PLANAR)).history.time
    assert np.abs(own[np.searchsorted(own, motion.knots[:-1] - 1e-12)] - motion.knots[:-1]).max() < 1e-12


@pytest.mark.slow
def test_a_record_with_spikes_is_that_of_the_explicit_method() -> None:
    motion = spiked(0)
    tight = shaken(triple(), motion, 0.005, rtol=1e-7).history.top_force[:, 0]
    explicit = shaken(triple(), motion, 0.005, method="dopri5", rtol=1e-6).history.top_force[:, 0]
    assert apart(explicit, tight) < 3e-3


@pytest.mark.slow
def test_one_spike_after_a_long_rest_is_not_missed() -> None:
    """Sixty seconds with one spike in their middle, where adaptive solvers step over it: the frictionless slider gets
    the speed a dt that it brings, like a linear oscillator integrated with the spike as a breakpoint."""
    t = np.arange(0.0, 60.0, 0.005)
    acceleration = np.zeros((len(t), 3))
    acceleration[6000, 0] = 2.0
    bearing = a_pendulum(radius=10.0, capacity=1.0)
    scene = Scene(
        bearing,
        Motion.from_acceleration(t, acceleration),
        Top.prescribed((0.0, 0.0, 0.0)),
        PLANAR,
        Solver(rtol=1e-6, atol_angle=1e-9),
        output_step=0.01,
    )
    run = simulate(scene).history

    def rates(at: float, y: Array) -> list[float]:
        return [y[1], -9.8 / 10.0 * y[0] + np.interp(at, [29.995, 30.0, 30.005], [0.0, 2.0, 0.0]) / 10.0]

    found = solve_ivp(
        rates, (29.995, 59.9), [0.0, 0.0], rtol=1e-9, atol=1e-14, max_step=0.001, t_eval=run.time[3005:5990]
    )
    assert np.abs(found.y[0]).max() > 1e-4
    assert np.abs(np.abs(run.tilt_angles[3005:5990, 0, 1]) - np.abs(found.y[0])).max() < 0.02 * np.abs(found.y[0]).max()


# ---- jumps of velocity -----------------------------------------------------------------------------------------


def test_a_jump_of_velocity_is_refused_by_name() -> None:
    pieces = np.zeros((2, 6, 6))
    pieces[1, 0, 1] = 0.2
    with pytest.raises(InputError, match=r"velocity of u_g1 jumps by 0\.2 at t = 1 s; that is an impulse"):
        Motion(knots=[0.0, 1.0, 2.0], coefficients=pieces, jumps=[1.0])


def started(rise: float) -> Array:
    """Force after a start to 0.2 m/s within `rise` [s], every 10 ms."""
    pieces = np.zeros((2, 6, 6))
    pieces[0, 0, 3:5] = 0.2 / rise**2, -0.1 / rise**3
    pieces[1, 0, :2] = 0.1 * rise, 0.2
    motion = Motion(knots=[0.0, rise, 0.3], coefficients=pieces)
    force: Array = shaken(triple(), motion, 0.01, rtol=1e-6).history.top_force[:, 0]
    return force


def test_a_start_ever_faster_has_a_limit() -> None:
    """What a jump would mean: friction and light sliders pass on no impulse that grows, so a rise over a millisecond is
    already the jump. That is the remedy that the refusal names."""
    rises = [1e-2, 1e-3, 1e-4, 1e-5]
    late = [started(rise)[20:] for rise in rises]
    steps = [float(np.abs(late[i] - late[-1]).max() / np.abs(late[-1]).max()) for i in range(3)]
    assert steps[0] < 0.05 and steps[1] < 0.02 and steps[2] < 0.02
    assert np.isfinite(late).all()


@pytest.mark.parametrize("speed", [0.01, 1.0])
def test_a_sampled_motion_that_starts_moving_starts_the_bearing_with_it(speed: float) -> None:
    """Samples that begin at full speed are no impulse either: the whole bearing begins with them, and says so."""
    t = np.linspace(0.0, 1.0, 101)
    motion = Motion.from_arrays(t, np.outer(t * speed, [1.0, 0.0, 0.0]))
    assert motion.metadata["initial_speed"] == pytest.approx(speed)
    history = simulate(Scene(triple(), motion, Top.mass(1e4, 1e3, 0.5, 1e7), PLANAR)).history
    assert np.abs(history.displacement).max() < 1e-9 and np.abs(history.top_force[:, 0]).max() < 1e-3


def test_acceleration_may_jump_where_it_is_declared() -> None:
    """A push that starts and ends at once, 0.5 m/s^2 for 0.1 s: the reference's path, step by step."""
    pieces = np.zeros((2, 6, 6))
    pieces[0, 0, 2] = 0.25
    pieces[1, 0, :2] = 0.0025, 0.05
    motion = Motion(knots=[0.0, 0.1, 0.5], coefficients=pieces, jumps=[0.1])
    loose, tight = (shaken(triple(), motion, 0.01, rtol=rtol).history.top_force[:, 0] for rtol in (1e-4, 1e-7))
    assert np.abs(loose - tight).max() < 5e-3 * np.abs(tight).max()


def test_no_scene_of_ours_needs_more() -> None:
    """The report's own motions rise smoothly: 20 s of lead-in instead of a start at full speed."""
    motion = load_scene("becker-circle-50").motion
    assert not len(motion.jumps) and not np.any(motion.velocity(0.0)) and not np.any(motion.acceleration(0.0))
    assert pushed(triple(), [0.05], speed=5e-3).succeeded
