"""Steps land where prescribed histories have jumps and kinks, see short pulses, and take times that are one as one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from msfp_gen import Effects, Load, Motion, Rotation, RunError, Scene, Solver, Top, presets, simulate
from msfp_gen.motions.piecewise import ORDER, hermite5
from msfp_gen.motions.time_grid import TIME_TOLERANCE, Resolution, TimeGrid, distinct_times, snapped
from msfp_gen.results.result import Result
from msfp_gen.simulation.start import time_grid

PLANAR = Effects(dimension="planar", sliders="massless")
RIG = Top.rig(112e3, stiffness=1e6, damping=5.0, rotational_stiffness=1e6)


def at_rest(*knots: float) -> Motion:
    """A base that rests, with pieces between the given times."""
    return Motion(np.array([0.0, *knots]), np.zeros((len(knots), 6, ORDER)))


def scene_of(**more: Any) -> Scene:
    given: dict[str, Any] = {"motion": at_rest(10.0), "top": RIG, "effects": PLANAR}
    return Scene(presets.bearing("fenz-tfp"), **given | more)


def lateral(time: list[float], force: list[float]) -> Load:
    return Load.from_arrays(time, np.outer(force, [1.0, 0.0, 0.0]))


def peak(result: Result) -> float:
    return float(np.abs(result.history.top_force[:, 0]).max())


PULSE = lateral([0, 5, 5.005, 5.01, 10], [0, 0, 10e3, 0, 0])
SWAY = Load.harmonic((0.0, 0.0, 40e3), frequency=0.2, cycles=1)


def test_a_pulse_in_a_summed_load_is_seen() -> None:
    alone, summed = simulate(scene_of(load=PULSE)), simulate(scene_of(load=PULSE + SWAY))
    assert peak(alone) > 1e3
    assert peak(summed) == pytest.approx(peak(alone), rel=0.02)
    fine = simulate(scene_of(load=PULSE + SWAY, solver=Solver(max_step=5e-4)))
    assert peak(summed) == pytest.approx(peak(fine), rel=2e-3)


def test_steps_land_on_every_jump_and_kink_of_a_load() -> None:
    jumps = lateral([0, 2.2, 2.2, 3.3, 3.37, 10], [0, 0, 2e3, 2e3, -1e3, -1e3])
    for load in (jumps, jumps + SWAY, SWAY + jumps + PULSE):
        result = simulate(scene_of(load=load))
        found = result.history.time
        kinks = [2.2, 3.3, 3.37] + ([5.0, 5.005, 5.01] if load.duration > 10 else [])
        assert not [knot for knot in kinks if np.abs(found - knot).min() > 1e-12], "a kink was stepped over"
    assert np.diff(simulate(scene_of(load=jumps)).history.time).max() > 0.1  # not because every step is short


def test_a_motion_given_as_pieces_is_seen_after_a_long_rest() -> None:
    rows = np.zeros((5, 6))
    rows[2, 0] = 0.05
    knots, rest = np.array([0.0, 5.0, 5.5, 6.0, 10.0]), np.zeros((5, 6))
    motion = Motion(knots, hermite5(knots, rows, rest, rest))
    result = simulate(scene_of(motion=motion))
    fine = simulate(scene_of(motion=motion, solver=Solver(max_step=2e-3)))
    assert peak(result) == pytest.approx(peak(fine), rel=5e-3) and peak(fine) > 1e4
    assert np.isin(knots[1:4], result.history.time).all()


def smooth_pulse(centre: float, width: float, height: float) -> Motion:
    """A bell of displacement in 384 smooth pieces between two long rests: no knot has a kink."""
    time = np.linspace(-4.0, 4.0, 385)
    bell = np.exp(-(time**2))
    rows = [bell, -2 * time * bell / width, (4 * time**2 - 2) * bell / width**2]
    values = np.zeros((3, 387, 6))
    for row, value in zip(values, rows, strict=True):
        row[1:-1, 0] = height * value
    return Motion(knots := np.concatenate([[0.0], centre + width * time, [2 * centre]]), hermite5(knots, *values))


@pytest.mark.parametrize("width", [0.02, 0.2])
def test_a_smooth_pulse_is_seen_after_a_long_rest(width: float) -> None:
    motion = smooth_pulse(6.0, width, 0.02)
    assert not len(motion.resolution.kinks[1:-1]) and motion.max_step is None
    result, fine = (simulate(scene_of(motion=motion, solver=Solver(max_step=s))) for s in (None, width / 50))
    assert peak(fine) > 3e3
    assert peak(result) == pytest.approx(peak(fine), rel=5e-3)


def test_a_load_that_jumps_at_its_last_sample_holds_what_follows() -> None:
    load = Load.from_arrays([0, 5, 5], np.outer([0, 0, 1], [0.0, 0.0, -30e3]))
    assert load.jumps.tolist() == [5.0]
    assert load.evaluate([4.9, 5.0, 9.0])[:, 2].tolist() == [0.0, -30e3, -30e3]
    pressed = -simulate(scene_of(load=load)).history.top_force[:, 2]
    assert pressed[-1] - pressed[0] == pytest.approx(-30e3, rel=1e-6)


def test_unevenly_sampled_loads_are_followed_at_their_shortest_interval() -> None:
    """Steps follow the samples at hand, not the median interval."""
    time = np.concatenate([np.linspace(0, 8, 81), [8.002, 8.004, 8.006, 8.008, 8.01, 10.0]])
    force = np.zeros(len(time))
    force[82:85] = [8e3, -8e3, 8e3]
    result = simulate(scene_of(load=Load.from_arrays(time, np.outer(force, [1.0, 0, 0])) + SWAY))
    assert np.abs(result.history.time[:, None] - time[81:86]).min(axis=0).max() < 1e-12
    assert peak(result) > 500


def test_steps_land_where_a_load_stops_to_change() -> None:
    """Its value is held after its end, so that a load that still rises there has a kink."""
    rising = lateral([0, 5.0], [0, 5e3])
    assert rising.resolution.kinks.tolist() == [5.0]
    assert not len(Load.constant((0.0, 0.0, 1e4)).resolution.kinks)
    result = simulate(scene_of(load=rising))
    assert 5.0 in result.history.time and np.diff(result.history.time).max() > 0.1


@pytest.mark.parametrize("second", [0.3, 0.1 + 0.2, 0.3 + 1e-12, 0.3 + 5e-10])
@pytest.mark.parametrize("effects", [PLANAR, Effects(dimension="planar", rims=False)], ids=["massless", "inertial"])
def test_loads_that_jump_at_one_time_add_up_to_one_jump(second: float, effects: Effects) -> None:
    one, two = (lateral([0, t, t, 10], [0, 0, 1e3, 1e3]) for t in (0.3, second))
    whole = lateral([0, 0.3, 0.3, 10], [0, 0, 2e3, 2e3])
    exact, summed, steep = (
        simulate(scene_of(load=load, duration=0.6, effects=effects))
        for load in (whole, one + two, lateral([0, 0.3, 0.3 + 5e-10, 10], [0, 0, 2e3, 2e3]))
    )
    for result in (summed, steep):
        np.testing.assert_array_equal(result.history.time, exact.history.time)
        np.testing.assert_array_equal(result.history.top_force, exact.history.top_force)


# ---- one time -----------------------------------------------------------------------------------------------------


def test_times_that_no_step_can_tell_apart_are_one() -> None:
    assert distinct_times(np.array([0.3, 0.1 + 0.2, 5.0, 5.0 + 4e-9, 5.0 + 1e-8])).tolist() == [0.3, 5.0, 5.0 + 1e-8]
    assert not len(distinct_times(np.zeros(0)))
    pieces = np.arange(3.0).reshape(3, 1, 1)
    knots, same = snapped(np.array([0.0, 0.1 + 0.2, 0.4, 5.0 + 1e-12]), pieces, np.array([0.3, 5.0]))
    assert knots.tolist() == [0.0, 0.3, 0.4, 5.0] and same.ravel().tolist() == [0.0, 1.0, 2.0]
    knots, fewer = snapped(np.array([0.0, 1.0, 1.0 + 1e-10, 2.0]), pieces, np.array([1.0]))
    assert knots.tolist() == [0.0, 1.0, 2.0] and fewer.ravel().tolist() == [0.0, 2.0]
    assert snapped(knots, fewer, np.zeros(0))[0].tolist() == [0.0, 1.0, 2.0]


def test_intervals_of_a_grid_take_the_shorter_step_and_end_with_the_run() -> None:
    one = Resolution(np.array([0.0, 2.0, 6.0]), np.array([2.0]), np.array([np.inf, 0.5]))
    two = Resolution(np.array([0.0, 3.0]), np.zeros(0), np.array([0.7]))
    grid = TimeGrid.of([one, two], np.array([4.0]), 5.0, 10.0)
    assert grid.stops.tolist() == [2.0, 4.0] and grid.jumps.tolist() == [4.0]
    assert grid.ends.tolist() == [2.0, 6.0] and grid.steps.tolist() == [0.7, 0.5]


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(
    shifts=st.lists(st.sampled_from([0.0, 1e-16, -1e-16, 3e-15, -1e-13, 1e-12, -1e-11, 1e-10]), min_size=5, max_size=5),
    steps=st.sampled_from([0.1, 0.3, 0.7]),
    rows=st.sampled_from([None, 0.1, 0.05]),
)
def test_times_that_differ_by_rounding_end_no_run(shifts: list[float], steps: float, rows: float | None) -> None:
    """Knots of a motion, a load, a rotation, a jump, the end and the rows at sums that floating point tells apart."""

    def scene(a: float, b: float, c: float, d: float, e: float) -> Scene:
        knots = np.array([0.0, steps + a, 2 * steps, 3 * steps + b, 10 * steps])
        values = np.zeros((5, 6))
        values[2, 0] = 2e-3
        motion = Motion(knots, hermite5(knots, values, np.zeros((5, 6)), np.zeros((5, 6))))
        load = lateral([0, 2 * steps + c, 2 * steps + c, 3 * steps, 8 * steps], [0, 0, 800, 0, 0])
        tilts = [[0, 0], [0, 1e-3], [0, 2e-3], [0, 0]]
        turned = Rotation.from_arrays([0, steps, 3 * steps + d, 9 * steps], tilts)
        effects = replace(PLANAR, top_rotation=True)
        end = min(8 * steps + e, motion.duration)
        return scene_of(motion=motion, load=load, top_rotation=turned, duration=end, effects=effects, output_step=rows)

    exact, moved = simulate(scene(0, 0, 0, 0, 0)), simulate(scene(*shifts))
    assert moved.status == exact.status == "ok"
    assert abs(moved.history.time[-1] - exact.history.time[-1]) < 1e-9
    assert peak(moved) == pytest.approx(peak(exact), rel=1e-3)


@pytest.mark.parametrize("method", ["implicit", "esdirk4", "dopri5"])
@pytest.mark.parametrize("gap", [0.0, 1e-16, 1e-13, 1e-10, 3e-9])
def test_every_method_ends_beside_a_knot(method: Any, gap: float) -> None:
    load = lateral([0, 0.1 + 0.2, 0.3 + gap + 1e-3, 1], [0, 0, 500, 500])
    motion = at_rest(0.3, 0.6 + gap, 0.6 + gap + 1.0)
    effects = Effects(dimension="planar", rims=False)
    scene = scene_of(load=load, motion=motion, duration=0.6, effects=effects, solver=Solver(method=method))
    assert simulate(scene).history.time[-1] == pytest.approx(0.6, abs=TIME_TOLERANCE)


def test_the_grid_of_a_scene_holds_all_its_histories() -> None:
    turned = Rotation.from_arrays([0, 1.5, 4], [[0, 0], [0, 1e-3], [0, 0]])
    scene = scene_of(load=PULSE, top_rotation=turned, effects=Effects(top_rotation=True))
    assert {1.5, 5.0, 5.005, 5.01} <= set(time_grid(scene).stops)
    with pytest.raises(RunError, match="max_steps"):
        simulate(replace(scene, solver=Solver(max_steps=3)))
