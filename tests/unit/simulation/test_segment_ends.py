"""Runs under `Auto` end with a result, wherever a segment ends: after no step, at its start, by any status."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from support import preset_run
from support.random_scenes import between
from support.stacks import holds

from msfp_gen import Auto, Effects, Load, Motion, RunError, Scene, Solver, Top, load_scene, presets, simulate
from msfp_gen.results.history import History
from msfp_gen.results.joining import joined
from msfp_gen.results.result import Result
from msfp_gen.scene.effect_selection import EffectSelection
from msfp_gen.simulation.bearing_run import BearingRun
from msfp_gen.simulation.rows import Segment
from msfp_gen.simulation.start import start_compiled_run
from msfp_gen.simulation.system import finish

BEARING = presets.bearing("fenz-tfp")
AUTO = Auto(dimension="planar", rims=True)  # three models: massless, inertial, and inertial with uplift
WRONG: dict[str, Any] = {"sliders": "massless", "uplift": False}  # a selection that the monitors must correct


def with_effects(scene: Scene, **effects: Any) -> Scene:
    """The scene started with other effects than selected."""
    again = replace(scene)
    again.__dict__["effect_selection"] = EffectSelection(replace(scene.modelled, **effects))
    return again


def ended(scene: Scene) -> tuple[BearingRun, Result]:
    """All segments of a run, and its result."""
    sequence = BearingRun.of(scene)
    finish(sequence, scene.end)
    return sequence, sequence.result()


def pulled(lift: float, start: float, length: float, end: float) -> Load:
    """An upward force that jumps to `lift` [N] and back."""
    times = [0.0, start, start, start + length, start + length, end + 1.0]
    return Load.from_arrays(times, np.outer([0, 0, 1, 1, 0, 0], [0.0, 0.0, lift]))


@st.composite
def scenes(draw: Any) -> Scene:
    """A triple pendulum under 2 to 300 kN whose load may vanish or reverse at once, in a run of few steps."""
    weight = draw(between(2e3, 3e5))
    motion = Motion.harmonic(draw(st.floats(0.005, 0.16)), draw(between(0.1, 3.0)), cycles=1.5)
    end = motion.duration
    lift = draw(st.floats(0.5, 1.5)) * weight
    load = pulled(lift, draw(st.sampled_from([0.0, 0.1, 0.3, 0.7])) * end, draw(st.floats(1e-3, 0.3)), end)
    rigs = [Top.rig(weight, 1e3 * weight, 0.0, 10 * weight), Top.rig(weight, 1e8, 5.0, 1e6, 5.0)]
    mass = Top.mass(weight / 9.8, 0.05 * weight / 9.8, 0.5, 100 * weight, weight)
    scene = Scene(
        BEARING,
        motion,
        draw(st.sampled_from([*rigs, mass])),
        effects=AUTO,
        load=draw(st.sampled_from([load, None])),
        output_step=draw(st.sampled_from([None, 0.02])),
        solver=Solver(rtol=1e-3, max_steps=draw(st.sampled_from([3, 400]))),
    )
    return with_effects(scene, **draw(st.sampled_from([{}, WRONG])))


@holds(20, 3000, scene=scenes())
def test_every_end_of_every_segment_is_a_result(scene: Scene) -> None:
    sequence, result = ended(scene)
    times = np.concatenate([part.model.unpack(part.run.rows)["time"] for part in sequence.segments])
    history = result.history
    assert history.time[0] == 0.0 and np.all(np.diff(history.time) > 0) and np.isin(history.time, times).all()
    if scene.output_step is None:
        assert len(history.time) == len(np.unique(times)), "a row is lost"
    assert result.status == sequence.segments[-1].status and bool(result.message) != result.succeeded
    assert result.dataset.sizes["time"] == len(history.time)
    assert result.summary["status"] == result.status and result.status in repr(result)


def test_a_segment_without_a_step_changes_nothing() -> None:
    """As where two monitors trip at one instant: the segment between has the row from which it started, and no more."""
    history = preset_run("fenz-test2").history
    parts = [rows_of(history, slice(0, 30)), rows_of(history, slice(29, 30)), rows_of(history, slice(29, None))]
    whole = joined(parts)
    np.testing.assert_array_equal(whole.time, history.time)
    np.testing.assert_array_equal(whole.top_force, history.top_force)
    for name, values in history.energy.items():
        np.testing.assert_allclose(whole.energy[name], values, rtol=1e-12, atol=1e-9)


def test_the_first_row_is_of_the_model_that_goes_on() -> None:
    """A lateral load from the start: there massless sliders are out of balance, and the run goes on with their mass."""
    scene = replace(load_scene("fenz-test2"), effects=AUTO, duration=0.1, load=Load.constant((2e3, 0.0, 0.0)))
    sequence, result = ended(with_effects(scene, **WRONG))
    light, heavy = sequence.segments
    assert (light.model.effects.sliders, heavy.model.effects.sliders) == ("massless", "inertial")
    assert light.run.counts["steps"] == 0 and light.run.row_count == 1
    alone = simulate(replace(scene, effects=heavy.model.effects))
    np.testing.assert_array_equal(result.history.contact_angles, alone.history.contact_angles)
    out_of_balance = light.model.unpack(light.run.rows)["angles"][0]
    assert np.abs(out_of_balance - alone.history.contact_angles[0]).max() > 1e-3
    np.testing.assert_array_equal(result.extremes.most_normal, alone.extremes.most_normal)


def test_the_times_of_a_run_are_no_longer_than_it_took() -> None:
    begin = time.perf_counter()
    result = simulate(replace(load_scene("fenz-test2"), duration=5.0))
    took = time.perf_counter() - begin
    assert 0.0 < result.counters.wall_time < took and 0.0 <= float(result.provenance["build_seconds"]) < took


def rows_of(history: History, rows: slice) -> History:
    cut = {name: values[rows] for name, values in history.arrays().items()}
    return replace(history, **cut, energy={name: values[rows] for name, values in history.energy.items()})


def test_a_last_segment_that_fails_at_once_loses_no_row() -> None:
    scene = replace(load_scene("fenz-test2"), duration=5.0)
    lifted = replace(scene, load=Load.constant((0.0, 0.0, 2e5)))  # pulls from the start, and the model has no uplift
    sequence, result = ended(scene)
    first = sequence.segments[0]
    failed = start_compiled_run(lifted, first.model, scene.effect_selection, scene.end, None, ())[0]
    assert failed.row_count == 0 and failed.status[0] == "uplift"
    sequence.segments.append(Segment(first.model, failed, 0.0, "uplift", 0.0, 0.0))
    for with_initial_row in (False, True):
        after = sequence.result(with_initial_row)
        assert (after.status, result.status) == ("uplift", "ok") and "would have to" in after.message
        np.testing.assert_array_equal(after.history.top_force, result.history.top_force)


def test_a_run_that_cannot_start_goes_on_with_more_effects() -> None:
    """The load pulls from the start: the first model has no row, and the next begins at the initial state."""
    scene = replace(load_scene("fenz-test2"), effects=AUTO, duration=0.1, load=pulled(1.2e5, 0.0, 0.01, 1.0))
    sequence, result = ended(with_effects(scene, **WRONG))
    assert [part.run.row_count > 0 for part in sequence.segments] == [False, True]
    assert result.notes[0].kind == "uplift" and result.notes[0].time == 0.0 and result.history.time[-1] == 0.1
    with pytest.raises(RunError, match="at t = 0 s") as caught:  # nothing was computed
        simulate(replace(scene, effects=Effects(dimension="planar")))
    assert caught.value.result is None
