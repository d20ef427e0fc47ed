"""The compiled run of a building: threads, checkpoints, steps, motions of the supports."""

from __future__ import annotations

from dataclasses import replace
from time import sleep
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from support.buildings import BEARING, INTERFACE, LOAD, MOTION, frame, scene

from msfp_gen import (
    BaseSlab,
    Building,
    BuildingBearing,
    BuildingScene,
    Effects,
    InputError,
    Motion,
    RunError,
    simulate,
    simulate_batch,
)
from msfp_gen.buildings import run as run_of_building
from msfp_gen.buildings.result import BuildingResult
from msfp_gen.buildings.run import CompiledBuildingRun, building_result, start_building_run

EVENTFUL = scene(frame(), duration=0.8)


def same(one: BuildingResult, other: BuildingResult) -> bool:
    names = ("time", "displacement", "acceleration", "wrench", "dissipated", "stored", "input", "received")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


def test_results_do_not_depend_on_the_number_of_threads():
    one, three = simulate(EVENTFUL, threads=1), simulate(EVENTFUL, threads=3)
    assert same(one, three) and one.counters == three.counters


def test_results_do_not_depend_on_the_way_that_the_clock_chooses(monkeypatch):
    """Threads by the clock: some stages alone, some together, as the machine happens to be loaded."""
    monkeypatch.setattr("msfp_gen.buildings.run.BEARINGS_OF_A_THREAD", 1)
    monkeypatch.setattr("msfp_gen.buildings.run.usable_cores", lambda: 3)
    one, chosen = simulate(EVENTFUL, threads=1), simulate(EVENTFUL)
    assert same(one, chosen) and one.counters == chosen.counters


@pytest.mark.parametrize(("workers", "count", "threads"), [(2, 3, 2), (1, 2, 4), (4, 2, 2), (5, 5, 1), (7, 7, 1)])
def test_buildings_of_a_batch_share_the_cores(workers, count, threads, monkeypatch):
    """Runs at the same time by threads of each are at most the cores, or one thread for each run that was asked for."""
    monkeypatch.setattr("msfp_gen.buildings.run.BEARINGS_OF_A_THREAD", 1)  # of its four bearings
    monkeypatch.setattr("msfp_gen.studies.batch.usable_cores", lambda: 5)
    real, found = run_of_building._threads, []
    monkeypatch.setattr(run_of_building, "_threads", lambda *given: found.append(real(*given)) or found[-1])
    scenes = [replace(EVENTFUL, duration=0.1 + 0.02 * k) for k in range(count)]
    results = simulate_batch(scenes, workers=workers)
    assert found == count * [threads] and (threads == 1 or min(workers, count) * threads <= 5)
    for made, result in zip(scenes, results, strict=True):
        alone = simulate(made, threads=1)
        assert result.scene is made and same(alone, result) and alone.counters == result.counters


@pytest.mark.parametrize("effects", [None, Effects(uplift=True)], ids=["default", "uplift"])
def test_a_restored_run_continues_bit_by_bit(effects):
    made = replace(EVENTFUL, bearings=[replace(each, effects=effects) for each in EVENTFUL.bearings], duration=0.3)
    whole = simulate(made)
    begun = start_building_run(made)
    begun.run.advance(whole.counters["steps"] // 2)
    snapshot = begun.run.snapshot()
    begun.run.advance(3)
    later = start_building_run(made, threads=2)
    later.run.restore(snapshot)
    while later.run.advance(7):
        pass
    assert same(building_result(later), whole) and later.run.counts == whole.counters


def test_the_time_of_a_run_has_none_of_making_its_models(monkeypatch):
    """Of a run whose models are compiled it would be tens of seconds for one."""

    def slow(*arguments: Any, **options: Any) -> Any:
        sleep(2.0)
        return start_building_run(*arguments, **options)

    monkeypatch.setattr("msfp_gen.buildings.run.start_building_run", slow)
    assert 0 < simulate(replace(EVENTFUL, duration=0.02)).wall_time < 1.5


def test_a_checkpoint_of_another_structure_is_refused(tmp_path):
    file, short = tmp_path / "run.ckpt", replace(EVENTFUL, duration=0.05)
    simulate(short, checkpoint=file)
    with pytest.raises(InputError, match="made for another scene: the content"):
        simulate(replace(short, building=frame(frequency=4.0)), checkpoint=file, resume=True)
    with pytest.raises(ValueError, match="no snapshot"):
        start_building_run(short).run.restore(b"x" * 100)


def test_the_compiled_run_refuses_a_snapshot_of_another_building():
    """Structure, motion, tolerance, end and bearings are in its identity; the number of threads is not."""
    short = replace(EVENTFUL, duration=0.05)
    begun = start_building_run(short)
    begun.run.advance(5)
    snapshot = begun.run.snapshot()
    rougher = BEARING.replace(friction=0.08)
    others = {
        "structure": replace(short, building=frame(frequency=4.0)),
        "motion": replace(short, motion=Motion.ramp(0.05, 1.0)),
        "tolerance": replace(short, solver=replace(short.solver, rtol=2e-4)),
        "end": replace(short, duration=0.06),
        "bearing": replace(short, bearings=[replace(short.bearings[0], bearing=rougher), *short.bearings[1:]]),
    }
    for name, other in others.items():
        with pytest.raises(ValueError, match="no snapshot of a run of this building"):
            start_building_run(other).run.restore(snapshot)
            pytest.fail(name)
    start_building_run(short, threads=2).run.restore(snapshot)


@pytest.mark.parametrize("option", ["threads", "cores"])
@pytest.mark.parametrize("number", [0, 1.5, True, "two"])
def test_a_wrong_number_of_threads_is_refused(option, number):
    with pytest.raises(InputError, match=rf"{option} = {number!r}: give a whole number of at least 1"):
        simulate(EVENTFUL, **{option: number})


def test_rows_lie_at_even_times_and_steps_end_at_samples():
    record = Motion.from_acceleration(0.007 * np.arange(30), np.random.default_rng(1).normal(size=(30, 3)))
    result = simulate(replace(EVENTFUL, motion=record, duration=None, output_step=0.02))
    assert result.time == pytest.approx([*0.02 * np.arange(11), 0.203])
    assert result.counters["steps"] >= 29 + 10


def test_a_motion_of_its_own_moves_one_support():
    """A slow lift of one of three supports tilts the slab as a rigid body on them."""
    places = [(0.0, 0.0), (4.0, 0.0), (0.0, 5.0)]
    lift = 0.01
    rise = Motion.from_arrays(np.linspace(0, 20, 201), raised(lift))
    still = Motion.from_arrays(np.linspace(0, 20, 201), np.zeros((201, 3)))
    bearings = [BuildingBearing(BEARING, INTERFACE, place) for place in places]
    bearings[2] = replace(bearings[2], motion=rise)
    slab = Building.shear(BaseSlab(3e4, (1e5, 1e5, 1e5), (1.0, 1.5)), [])
    result = simulate(BuildingScene(slab, bearings, still))
    base = result.node("base")[-1, 0]
    assert result.support[-1, :, 0, 2] == pytest.approx([0.0, 0.0, lift], abs=1e-9) and not result.ground.any()
    assert base[3] == pytest.approx(lift / 5.0, rel=2e-3)
    assert result.bearing_displacement[-1, :, 2] == pytest.approx([0.0, 0.0, 0.0], abs=3e-5)


def raised(height: float) -> np.ndarray:
    share = np.linspace(0, 1, 201)
    rise = np.zeros((201, 3))
    rise[:, 2] = height * share**3 * (10 - 15 * share + 6 * share**2)
    return rise


def test_equal_motions_of_the_supports_are_the_common_motion():
    own = replace(EVENTFUL, bearings=[replace(each, motion=MOTION) for each in EVENTFUL.bearings], duration=0.3)
    common = simulate(replace(EVENTFUL, duration=0.3))
    assert same(simulate(own), common) and len(own.grounds[0]) == 1
    other = replace(own, motion=Motion.from_arrays(np.linspace(0, 1, 11), np.zeros((11, 3))))
    moved = simulate(other)
    assert len(other.grounds[0]) == 2
    assert np.abs(moved.displacement - common.displacement).max() < 1e-4 * np.abs(common.displacement).max()
    assert np.array_equal(moved.ground, np.zeros_like(moved.ground))
    assert moved.axial_force.min() > 0.5 * LOAD


def test_where_the_building_does_not_converge_a_bearing_is_named():
    """All bearings follow, but their forces do not settle within a tolerance below the rounding of their equations."""
    with pytest.raises(RunError, match=r"^bearing [1-4].*Newton's method did not converge .* larger solver\.rtol"):
        simulate(replace(EVENTFUL, solver=replace(EVENTFUL.solver, rtol=1e-13)))


def test_a_run_that_fails_before_its_first_row_has_no_result(monkeypatch):
    """A result without rows would have no summary and no figure."""

    def failed(made: BuildingScene) -> Any:
        state = {"rows": (), "row_count": 0, "status": ("newton", 1, 0, 0.0), "time": 0.0}
        compiled = Mock(spec_set=CompiledBuildingRun, advance=lambda steps: False, **state)
        return replace(start_building_run(made), run=compiled)

    monkeypatch.setattr("msfp_gen.buildings.run.start_building_run", failed)
    with pytest.raises(RunError, match="bearing 1: stopped at t = 0 s") as caught:
        simulate(scene(frame()))
    assert caught.value.result is None
