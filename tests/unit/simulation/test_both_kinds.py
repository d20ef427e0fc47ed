"""What holds for a run of any system: of one bearing, and of a building."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import preset_run, scene_of
from support.buildings import pushed, pushed_scene
from support.resuming import stopping_at

from msfp_gen import InputError, RunError, simulate, simulate_batch
from msfp_gen.buildings import run as building_run
from msfp_gen.results.files import table_of
from msfp_gen.results.quantities import quantities
from msfp_gen.results.result import load_result
from msfp_gen.simulation import bearing_run, checkpoint

SYSTEMS = {"bearing": lambda: scene_of("fenz-test2"), "building": pushed_scene}
RUNS = {"bearing": lambda: preset_run("fenz-test2"), "building": pushed}
OPTIONS = [
    ("bearing", "threads", 2),
    ("building", "strict", True),
    ("building", "gradients", ["motion.scale"]),
    ("building", "energy_gradients", True),
]


def assert_equal(one: Any, other: Any) -> None:
    """All rows and peaks of two results, bit by bit; only the time on the clock may differ."""
    assert one.dataset.equals(other.dataset)
    mine, yours = ({**each.summary, "wall_time": 0, "real_time_factor": 0} for each in (one, other))
    assert mine == yours


@pytest.mark.parametrize("kind", SYSTEMS)
def test_an_interrupted_run_is_resumed_bit_by_bit(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bearing_run, "STEPS_PER_CALL", 20)
    monkeypatch.setattr(building_run, "STEPS_PER_CALL", 20)
    system, whole, file = SYSTEMS[kind](), RUNS[kind](), tmp_path / "run.ck"
    with pytest.raises(RunError, match=r"stopped at t = .*interrupted") as caught:
        simulate(system, progress=stopping_at(0.4 * system.end), checkpoint=file)
    part: Any = caught.value.result
    assert caught.value.status == "interrupted" and 1 < len(part.time) < len(whole.time)
    before = checkpoint.read_checkpoint(file)[1][0].wall
    resumed = simulate(system, checkpoint=file, resume=True)
    assert_equal(resumed, whole)
    assert resumed.work["wall_time"] > before > 0, "the time of both processes"


@pytest.mark.parametrize("kind", SYSTEMS)
def test_a_checkpoint_is_of_one_system_and_not_overwritten(kind: str, tmp_path: Path) -> None:
    file, short = tmp_path / "run.ck", replace(SYSTEMS[kind](), duration=0.05)
    simulate(short, checkpoint=file)
    with pytest.raises(InputError, match="this file exists; resume it"):
        simulate(short, checkpoint=file)
    with pytest.raises(InputError, match=r"made for another scene: duration was 0\.05, now it is 0\.06"):
        simulate(replace(short, duration=0.06), checkpoint=file, resume=True)
    with pytest.raises(InputError, match="resume: needs the checkpoint to resume from; give checkpoint"):
        simulate(short, resume=True)


@pytest.mark.parametrize(("kind", "option", "value"), OPTIONS, ids=str)
def test_options_of_another_kind_are_refused(kind: str, option: str, value: Any) -> None:
    with pytest.raises(InputError, match=f"^{option}: the run of this scene has no such option"):
        simulate(SYSTEMS[kind](), **{option: value})


@pytest.mark.parametrize("kind", SYSTEMS)
def test_a_run_out_of_steps_keeps_its_rows_and_says_so(kind: str, tmp_path: Path) -> None:
    system = SYSTEMS[kind]()
    with pytest.raises(RunError, match=r"stopped at t = .*max_steps") as caught:
        simulate(replace(system, solver=replace(system.solver, max_steps=5)))
    part: Any = caught.value.result
    assert caught.value.status == part.status == "steps" and part.message == str(caught.value)
    assert len(part.time) >= 1 and "steps" in repr(part)
    read = load_result(part.save(tmp_path / "part.nc"))
    assert (read.status, read.message) == (part.status, part.message)
    assert_equal(read, part)


@pytest.mark.parametrize("kind", SYSTEMS)
def test_the_scene_of_a_file_runs_again(kind: str, tmp_path: Path) -> None:
    read = load_result(RUNS[kind]().save(tmp_path / "run.nc"))
    assert read.scene.every_effects == SYSTEMS[kind]().every_effects
    assert_equal(simulate(read.scene), RUNS[kind]())


def test_a_batch_takes_both_kinds_and_gives_the_results_of_simulate() -> None:
    systems = [make() for make in SYSTEMS.values()]
    for system, result, run in zip(systems, simulate_batch(systems, workers=2), RUNS.values(), strict=True):
        assert result.scene is system
        assert_equal(result, run())


@pytest.mark.parametrize("kind", SYSTEMS)
def test_columns_of_a_scene_are_those_of_its_run(kind: str) -> None:
    """In order, and with the same values; of a bearing those of the effects that are modelled."""
    run = RUNS[kind]()
    storage, exported = run.storage, {column.name: column.values for column in table_of(run.dataset)}
    columns, arrays = storage.columns(run.scene), storage.arrays_of(run)
    assert list(exported) == [name for name, (variable, _) in columns.items() if variable.field in arrays]
    for name, values in exported.items():
        variable, index = columns[name]
        assert np.array_equal(values, variable.of(arrays)[:, *index])


@pytest.mark.parametrize("kind", SYSTEMS)
def test_every_quantity_of_the_catalogue_is_in_a_run(kind: str) -> None:
    run, cycles = RUNS[kind](), RUNS["bearing"]().characterise().envelope
    characterisation = replace(run.characterise(), envelope=cycles)  # the building moves for less than a cycle
    values = {name: source.value(run.entry, characterisation) for name, source in quantities(run.scene).items()}
    missing = {name.rstrip("_1234") for name, value in values.items() if value is None}
    # no friction law, no uplift; and both runs end in motion
    optional = {"least_friction", "most_friction", "peak_temperature", "maximum_uplift", "residual_displacement"}
    assert missing <= optional and values["peak_force"] == characterisation.peak_force
